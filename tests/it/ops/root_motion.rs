//! `root_motion`: the way on the root, or taken out.

use super::stage::{KINEMATICS, Stage, degrees};

fn config(op: &str) -> String {
    format!(r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk"}}, {{"op": "root_motion"{op}}}]}}"#)
}

/// Every joint below the pelvis is where it was.
fn assert_same_body(stage: &Stage, first: &super::stage::Played, second: &super::stage::Played, frame: usize) {
    for joint in ["pelvis", "head", "hand_l", "foot_r", "thumb_03_r"] {
        let (before, after) = (stage.place(first, frame, joint), stage.place(second, frame, joint));
        assert!(before.distance(after) < 1e-5, "{joint} at frame {frame}: {before} and {after}");
        assert!(degrees(stage.turned(first, frame, joint), stage.turned(second, frame, joint)) < 1e-3, "{joint}");
    }
}

#[test]
fn the_root_goes_the_way_and_the_body_stays() {
    let stage = Stage::walk();
    let plain = stage.play(KINEMATICS);
    for (op, height) in
        [("", 0.0), (r#", "turn": true, "smoothing_seconds": 0.4"#, 0.0), (r#", "axes": ["left", "up", "front"]"#, 0.0)]
    {
        let played = stage.play(&config(op));
        for frame in [0, 33, 120] {
            assert_same_body(&stage, &plain, &played, frame);
        }
        let (root, pelvis) = (stage.place(&played, 120, "root"), stage.place(&played, 120, "pelvis"));
        assert!((root.z - pelvis.z).abs() < 0.05 && (root.y - height).abs() < 0.1, "{op}: below the pelvis: {root}");
        assert!((stage.place(&played, 120, "root").z - stage.place(&played, 0, "root").z) > 3.0, "{op}: it walks");
    }
    let exact = stage.play(&config(""));
    let (root, pelvis) = (stage.place(&exact, 70, "root"), stage.place(&exact, 70, "pelvis"));
    assert!(root.x == pelvis.x || (root.x - pelvis.x).abs() < 1e-5, "straight below: {root} {pelvis}");
    assert!(root.y.abs() < 1e-5, "on the floor: {root}");
}

#[test]
fn the_way_of_the_sources_root_can_be_taken() {
    let stage = Stage::walk();
    let plain = stage.play(KINEMATICS);
    let played =
        stage.play(&config(r#", "from": "source_root", "source_joint": "mixamorig:Hips", "place": "first_frame""#));
    assert_same_body(&stage, &plain, &played, 90);
    let source = |frame: usize| stage.source_pose(frame).transforms()[0].translation.z;
    let root = |frame: usize| stage.place(&played, frame, "root").z;
    assert!(root(0).abs() < 1e-5, "it begins at its rest pose: {}", root(0));
    let wanted = (source(90) - source(0)) * played.mapping.global_scale;
    assert!((root(90) - wanted).abs() < 1e-4, "{} where {wanted} is wanted", root(90));
}

#[test]
fn a_figure_stays_in_place() {
    let stage = Stage::walk();
    let plain = stage.play(KINEMATICS);
    let played = stage.play(&config(r#", "action": "remove""#));
    let begin = stage.place(&plain, 0, "pelvis");
    for frame in [0, 40, 120] {
        let (now, before) = (stage.place(&played, frame, "pelvis"), stage.place(&plain, frame, "pelvis"));
        assert!((now.x - begin.x).abs() < 1e-5 && (now.z - begin.z).abs() < 1e-5, "frame {frame}: {now}");
        assert!((now.y - before.y).abs() < 1e-5, "up and down stays: {now}");
    }
    let half = stage.play(&config(r#", "action": "remove", "alpha": 0.5, "axes": ["front"]"#));
    let (now, before) = (stage.place(&half, 120, "pelvis"), stage.place(&plain, 120, "pelvis"));
    assert!((now.z - (before.z + begin.z) / 2.0).abs() < 1e-5 && (now.x - before.x).abs() < 1e-5, "half of it: {now}");
}

#[test]
fn rigs_without_a_root_say_so() {
    let stage = Stage::onto_itself();
    let played = stage.play(&config(""));
    assert!(played.warnings.contains(&"root_not_found"), "{:?}", played.warnings);
    let error = stage.try_play(&config(r#", "joint": "left_foot""#)).err().expect("refused");
    assert_eq!(error.fields[0].pointer, "/ops/2/joint", "a foot does not carry the pelvis: {:?}", error.fields);
    let error = stage.try_play(&config(r#", "mask": ["head"]"#)).err().expect("refused");
    assert_eq!(error.fields[0].pointer, "/ops/2/mask", "{:?}", error.fields);
}
