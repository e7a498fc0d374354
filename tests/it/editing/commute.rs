//! Edits and a retarget that is a function of each frame may be done in either order.

use retargetd::{
    model::{Clip, Control, Reporter},
    retarget::{Plan, Resolved, RetargetSpec, resolve, run},
    rig::Rig,
    samples,
};
use serde_json::json;

use super::edited;

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
