//! Auto-tune: never worse, the same every time, within its limits, and found again from the resolved spec.

use retargetd::{
    engine::{Control, Failure, FailureCode, Format, Inputs, Limits, NamedBytes, Outcome, retarget},
    samples,
};
use serde_json::{Value, json};

use crate::support::corpus_file;

fn run(source: &[u8], target: &[u8], config: &Value, control: &Control) -> Result<Outcome, Failure> {
    let config = config.to_string();
    let inputs = Inputs {
        source: NamedBytes { name: "source", bytes: source },
        target: NamedBytes { name: "target", bytes: target },
        source_rest: None,
        target_rest: None,
        config: Some(NamedBytes { name: "config.json", bytes: config.as_bytes() }),
        formats: &[Format::PosesNpz],
    };
    retarget(&inputs, &Limits::default(), control)
}

fn tuned(source: &[u8], target: &[u8], config: &Value) -> Outcome {
    run(source, target, config, &Control::new()).expect("a result")
}

fn score(outcome: &Outcome) -> f64 {
    outcome.report.measures.as_ref().expect("measured").score
}

/// The score is never worse, the report is that of the spec that was found, and the resolved spec gives the same again.
fn check(source: &[u8], target: &[u8], config: &Value) -> Outcome {
    let outcome = tuned(source, target, config);
    let tuning = outcome.report.tuning.as_ref().expect("it was tuned");
    assert!(tuning.score_after <= tuning.score_before, "{tuning:?}");
    assert!((score(&outcome) - tuning.score_after).abs() < 1e-9, "the report is of what was found: {tuning:?}");
    let again = tuned(source, target, &outcome.resolved_spec);
    assert!(again.report.tuning.is_none(), "what was found is not searched again");
    assert_eq!(again.outputs[0].bytes, outcome.outputs[0].bytes, "the resolved spec gives the same");
    outcome
}

#[test]
fn a_bad_scale_is_found_and_mended() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let ops = json!([{"op": "pelvis", "scale_horizontal": 1.25}, {"op": "fk"}]);
    let outcome = check(&walk, &mannequin, &json!({"ops": ops, "tune": true}));
    let tuning = outcome.report.tuning.as_ref().expect("tuned");
    assert!(tuning.score_after < tuning.score_before * 0.8, "much better: {tuning:?}");
    let found = tuning.parameters["pelvis.scale_horizontal"];
    assert!((found.from - 1.25).abs() < 1e-9 && (0.9..1.1).contains(&found.to), "back to what fits: {found:?}");
    let plain = tuned(&walk, &mannequin, &json!({"ops": ops}));
    assert!((score(&plain) - tuning.score_before).abs() < 1e-9, "it began where it says");
}

#[test]
fn the_search_is_the_same_every_time_and_keeps_its_limits() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let bounds = json!({"pelvis.scale_vertical": [0.98, 1.02]});
    let config = json!({"tune": {"max_evaluations": 7, "bounds": bounds}});
    let (first, second) = (tuned(&walk, &mannequin, &config), tuned(&walk, &mannequin, &config));
    assert_eq!(first.outputs[0].bytes, second.outputs[0].bytes, "the same bytes");
    let tuning = first.report.tuning.as_ref().expect("tuned");
    assert!(tuning.evaluations <= 7, "{tuning:?}");
    assert_eq!(tuning.parameters.keys().collect::<Vec<_>>(), [&"pelvis.scale_vertical"], "only what was named");
    assert!((0.98..=1.02).contains(&tuning.parameters["pelvis.scale_vertical"].to), "within its bounds: {tuning:?}");
    assert_eq!(first.report.tuning, second.report.tuning, "the same search");
}

#[test]
fn real_clips_never_get_worse() {
    let pairs = [
        ("mixamo/bvh/beta_walking_mixed_orders.bvh", "readyplayerme/rpm_avatar_a.glb"),
        ("bvh/misc/walk01_24fps.bvh", "unreal/ue4_names_apose.glb"),
    ];
    for (source, target) in pairs {
        let (Some(source), Some(target)) = (corpus_file(source), corpus_file(target)) else { continue };
        let (source, target) = (std::fs::read(source).expect("readable"), std::fs::read(target).expect("readable"));
        check(&source, &target, &json!({"tune": {"max_evaluations": 25}, "ops": [{"op": "pelvis"}, {"op": "fk"}]}));
    }
}

#[test]
fn limits_that_are_none_are_refused() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    for (tune, pointer) in [
        (json!({"max_evaluations": 0}), "/tune/max_evaluations"),
        (json!({"bounds": {"pelvis.scale_vertical": [1.1, 0.9]}}), "/tune/bounds/pelvis.scale_vertical"),
        (json!({"bounds": {"pelvis.color": [0, 1]}}), "/tune"),
        (json!("fast"), "/tune"),
    ] {
        let failure = run(&walk, &mannequin, &json!({ "tune": tune }), &Control::new()).expect_err("refused");
        assert!(failure.errors[0].pointer.starts_with(pointer), "{tune}: {:?}", failure.errors);
    }
    let control = Control::new();
    control.cancel();
    let failure = run(&walk, &mannequin, &json!({"tune": true}), &control).expect_err("canceled");
    assert_eq!(failure.code, FailureCode::Canceled, "a search can be canceled");
}
