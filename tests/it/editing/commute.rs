//! Edits and a retarget that is a function of each frame may be done in either order.

use retargetd::{
    model::{Clip, Control, Reporter, Scene},
    retarget::{MetricName, Plan, Resolved, RetargetSpec, resolve, run},
    rig::Rig,
    samples,
};
use serde_json::json;

use super::edited;
use crate::quality::figure::{measured, moved, rig_of};

#[test]
fn edits_of_time_commute_with_retargeting() {
    let (source, target) = (samples::walk_scene(), samples::mannequin_scene());
    let spec = RetargetSpec::default();
    let mut reporter = Reporter::new();
    let from = Rig::new("source", &source, None, &spec.source, &mut reporter).expect("a source");
    let onto = Rig::new("target", &target, None, &spec.target, &mut reporter).expect("a target");
    let Resolved { mapping, .. } = resolve(&spec, &from, &onto, &source.clips[0], &mut reporter).expect("a mapping");
    let plan = Plan::new(from.skeleton(), onto.skeleton(), &mapping);
    let retarget = |clip: &Clip| run(&plan, clip, &Control::new()).expect("a result");
    for edit in [
        json!({"reverse": true}),
        json!({"range": [0.5, 2.5]}),
        json!({"every": 3}),
        json!({"speed": 0.5, "ping_pong": true}),
        json!({"warp": [[0.0, 0.0], [1.0, 3.0], [4.0, 5.0]]}),
        json!({"hold": {"before_seconds": 1.0, "after_seconds": 2.0}, "start_seconds": 3.0}),
    ] {
        let before = retarget(&edited(&source, &source.clips[0], edit.clone()));
        let after = edited(&target, &retarget(&source.clips[0]), edit.clone());
        assert_eq!(before.times_seconds(), after.times_seconds(), "{edit}: times");
        for frame in 0..before.frame_count() {
            let places = |clip: &Clip| {
                let pose = clip.local_pose(&target.skeleton, frame).to_model(&target.skeleton);
                pose.transforms().iter().map(|transform| transform.translation).collect::<Vec<_>>()
            };
            let worst = places(&before).iter().zip(places(&after)).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
            assert!(worst < 1e-5, "{edit}: frame {frame} is off by {worst} m");
        }
    }
}

/// What the default ops make of a clip, and the value of every measure.
fn by_default(source: &Scene, target: &Scene, clip: &Clip) -> (Clip, Vec<(MetricName, Option<f64>)>) {
    let source = Scene { clips: vec![clip.clone()], ..source.clone() };
    let (from, onto) = (rig_of("source", &source), rig_of("target", target));
    let result = moved(&from, &onto);
    let measures = measured(&from, &onto, &result);
    let values = measures.metrics.iter().map(|(name, metric)| (*name, metric.value)).collect();
    (result.clip, values)
}

/// Feet that stand at half the speed are those that stand: contacts, smoothing and measures go by the clock of the performance.
#[test]
fn a_change_of_speed_commutes_with_all_ops() {
    let (source, target) = (samples::walk_scene(), samples::mannequin_scene());
    let (plain, measured) = by_default(&source, &target, &source.clips[0]);
    // Powers of two, which change no digit: rounding alone decides whether a foot stands in a frame in which it is as fast as it may be.
    for speed in [0.25, 0.5, 2.0] {
        let slowed = edited(&source, &source.clips[0], json!({"speed": speed}));
        let (result, values) = by_default(&source, &target, &slowed);
        for frame in 0..plain.frame_count() {
            let [plain, result] = [&plain, &result].map(|clip| clip.local_pose(&target.skeleton, frame));
            let apart = plain.transforms().iter().zip(result.transforms());
            let apart = apart.map(|(plain, result)| plain.rotation.angle_between(result.rotation).to_degrees());
            let worst = apart.fold(0.0, f64::max);
            assert!(worst < 1e-3, "{speed}: frame {frame} is off by {worst} degrees");
        }
        for ((name, value), (_, plain)) in values.iter().zip(&measured) {
            let (value, plain) = (value.unwrap_or(-1.0), plain.unwrap_or(-1.0));
            assert!((value - plain).abs() < 1e-3 * plain.abs().max(1.0), "{speed}: {name:?} is {value}, not {plain}");
        }
    }
}
