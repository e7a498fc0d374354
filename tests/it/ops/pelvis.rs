//! `pelvis`: offsets, scale rules, the crotch's height, and what goals do with them; alphas over time.

use glam::DVec3;

use super::stage::{KINEMATICS, Played, Stage, degrees};

fn with_pelvis(pelvis: &str, more: &str) -> String {
    format!(r#"{{"ops": [{{"op": "pelvis"{pelvis}}}, {{"op": "fk"}}{more}]}}"#)
}

#[test]
fn a_lowered_pelvis_bends_the_knees_or_sinks_the_feet() {
    let stage = Stage::walk();
    let ik = r#", {"op": "ik", "softness": 0}"#;
    let plain = stage.play(&with_pelvis("", ik));
    let bent = stage.play(&with_pelvis(r#", "offset": [0.05, -0.1, 0]"#, ik));
    let sunk = stage.play(&with_pelvis(r#", "offset": [0.05, -0.1, 0], "affect_ik_vertical": 1"#, ik));
    let still = stage.play(&with_pelvis(r#", "offset": [0.05, -0.1, 0], "affect_ik_horizontal": 0"#, ik));
    for frame in [0, 45, 110] {
        for foot in ["foot_l", "foot_r"] {
            let moved = |played: &Played| stage.place(played, frame, foot) - stage.place(&plain, frame, foot);
            for (played, wanted) in
                [(&bent, DVec3::X * 0.05), (&sunk, DVec3::new(0.05, -0.1, 0.0)), (&still, DVec3::ZERO)]
            {
                let off = moved(played).distance(wanted);
                assert!(off < 1e-4, "{foot} at frame {frame}: {} where {wanted} is wanted", moved(played));
            }
        }
        let lowered = stage.place(&bent, frame, "pelvis") - stage.place(&plain, frame, "pelvis");
        assert!(lowered.distance(DVec3::new(0.05, -0.1, 0.0)) < 1e-5, "the pelvis: {lowered}");
    }
}

#[test]
fn a_turned_pelvis_leaves_what_hangs_from_it_pointing_as_it_did() {
    let stage = Stage::walk();
    let plain = stage.play(KINEMATICS);
    let turned = stage.play(&with_pelvis(r#", "turn_offset": [0, 30, 0]"#, ""));
    let local = stage.play(&with_pelvis(r#", "local_turn_offset": [0, 0, 20], "local_offset": [0.1, 0, 0]"#, ""));
    for frame in [0, 60] {
        let wanted = glam::DQuat::from_rotation_y(30_f64.to_radians()) * stage.turned(&plain, frame, "pelvis");
        assert!(degrees(stage.turned(&turned, frame, "pelvis"), wanted) < 1e-3, "about up");
        let wanted = stage.turned(&plain, frame, "pelvis") * glam::DQuat::from_rotation_z(20_f64.to_radians());
        assert!(degrees(stage.turned(&local, frame, "pelvis"), wanted) < 1e-3, "about its own Z");
        let moved = stage.place(&local, frame, "pelvis") - stage.place(&plain, frame, "pelvis");
        assert!(moved.distance(wanted * DVec3::X * 0.1) < 1e-5, "along its own X: {moved}");
        for joint in ["head", "calf_l", "hand_r"] {
            let off = degrees(stage.turned(&turned, frame, joint), stage.turned(&plain, frame, joint));
            assert!(off < 1e-3, "{joint}: {off}");
        }
    }
}

#[test]
fn scale_rules_compare_what_they_say() {
    let stage = Stage::walk();
    let scale = |rule: &str| {
        let played = stage.play(&with_pelvis(&format!(r#", "scale": "{rule}""#), ""));
        played.mapping.pelvis.expect("a pelvis").position.scale
    };
    let rest = |scene: &retargetd::model::Scene| scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let (source, target) = (rest(&stage.source), rest(&stage.target));
    let leg = |pose: &retargetd::model::ModelPose, joints: [usize; 3]| {
        let [hip, knee, ankle] = joints.map(|joint| pose.transforms()[joint].translation);
        hip.distance(knee) + knee.distance(ankle)
    };
    let source_leg =
        leg(&source, ["LeftUpLeg", "LeftLeg", "LeftFoot"].map(|name| stage.source_joint(&format!("mixamorig:{name}"))));
    let target_leg = leg(&target, ["thigh_l", "calf_l", "foot_l"].map(|name| stage.target_joint(name)));
    let (legs, height) = (target_leg / source_leg, scale("height"));
    assert!((scale("legs") - DVec3::splat(legs)).length() < 1e-6, "{} where {legs} is wanted", scale("legs"));
    assert!((scale("limbs") - DVec3::new(legs, height.y, legs)).length() < 1e-6, "{}", scale("limbs"));
    assert_eq!(scale("none"), DVec3::ONE, "meters stay meters");
    // The walker is 1.80 m tall and the mannequin 1.65 m; their highest joints are a little apart in the head.
    assert!((scale("stature").y - 1.65 / 1.80).abs() < 0.12, "{}", scale("stature"));
    assert!((scale("stature").y - height.y).abs() > 1e-3, "not the height of the pelvis");
}

#[test]
fn the_target_sits_on_the_ground_when_the_source_does() {
    let stage = Stage::walk();
    let played =
        stage.play(&with_pelvis(r#", "floor_constraint": 1, "source_crotch": 0.12, "target_crotch": 0.05"#, ""));
    let crotch = played.mapping.pelvis.expect("a pelvis").crotch.expect("a rule");
    let height = |source: f64| crotch.scale * source + crotch.raise(DVec3::Y * (source + crotch.source_floor));
    assert!((height(0.12) - 0.05).abs() < 1e-9, "both crotches are on the floor: {}", height(0.12));
    let rest = |scene: &retargetd::model::Scene, joint: usize| {
        scene.skeleton.rest_pose().to_model(&scene.skeleton).transforms()[joint].translation.y
    };
    let (source, target) = (rest(&stage.source, 0), rest(&stage.target, stage.target_joint("pelvis")));
    assert!((height(source) - target).abs() < 0.02, "standing is standing: {} and {target}", height(source));
    let faded = stage.play(&with_pelvis(r#", "floor_constraint": 1, "floor_falloff": 0.5"#, ""));
    let plain = stage.play(KINEMATICS);
    let (first, second) = (stage.place(&faded, 40, "pelvis"), stage.place(&plain, 40, "pelvis"));
    assert!(first.distance(second) < 1e-6, "a walk is far above the ground: {first} {second}");
}

#[test]
fn alphas_over_time_are_the_constant_ones_at_each_time() {
    let stage = Stage::walk();
    let config = |alpha: &str| {
        format!(r#"{{"ops": [{{"op": "pelvis", "alpha": {alpha}}}, {{"op": "fk", "shoulder": 0, "alpha": {alpha}}}]}}"#)
    };
    let (constant, keyed) = (stage.play(&config("0.5")), stage.play(&config("[[0, 0.5]]")));
    let rising = stage.play(&config("[[0, 0], [2, 1]]"));
    let plain = stage.play(&config("1"));
    let compare = |first: &Played, second: &Played, frame: usize| {
        for joint in ["pelvis", "spine_03", "head", "upperarm_l", "lowerarm_r", "hand_l", "thigh_l", "calf_r", "foot_l"]
        {
            let off = degrees(stage.turned(first, frame, joint), stage.turned(second, frame, joint));
            // The last step of spines and necks, their direction as a whole, is left out where a constant alpha is not 1.
            assert!(off < 0.2, "{joint} at frame {frame}: {off}");
        }
        let (first, second) = (stage.place(first, frame, "pelvis"), stage.place(second, frame, "pelvis"));
        assert!(first.distance(second) < 1e-4, "the pelvis at frame {frame}: {first} {second}");
    };
    for frame in [0, 30, 77] {
        compare(&constant, &keyed, frame);
    }
    compare(&rising, &constant, 30);
    compare(&rising, &plain, 90);
    let some = stage
        .play(r#"{"ops": [{"op": "pelvis", "frames": [50, 60]}, {"op": "fk", "shoulder": 0, "frames": [50, 60]}]}"#);
    compare(&some, &plain, 55);
    compare(&some, &rising, 0);
}

#[test]
fn alphas_out_of_range_are_named() {
    for (op, pointer) in [
        (r#"{"op": "fk", "alpha": 1.5}"#, "/ops/0/alpha"),
        (r#"{"op": "pelvis", "alpha": [[1, 0], [0, 1]]}"#, "/ops/0/alpha"),
        (r#"{"op": "pelvis", "frames": [20, 10]}"#, "/ops/0/frames"),
    ] {
        let error = Stage::walk().try_play(&format!(r#"{{"ops": [{op}]}}"#)).err().expect("refused");
        assert_eq!(error.fields[0].pointer, pointer, "{op}: {:?}", error.fields);
    }
}
