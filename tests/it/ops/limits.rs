//! `limits`: nothing bends farther than it may.

use super::stage::{KINEMATICS, Stage, degrees};

fn bent(op: &str, degrees: f64) -> String {
    // The mannequin's forearms bend about their own Z.
    format!(
        r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk"}},
             {{"op": "additive_pose", "degrees": {{"left_forearm": [0, 0, {degrees}]}}}}{op}]}}"#
    )
}

#[test]
fn what_bodies_do_is_left_alone() {
    for stage in [Stage::walk(), Stage::onto_itself()] {
        let (plain, limited) = (stage.play(KINEMATICS), stage.play(&bent(r#", {"op": "limits"}"#, 0.0)));
        for frame in [0, 25, 77] {
            for joint in 0..stage.target.skeleton.len() {
                let turned =
                    |played: &super::stage::Played| stage.target_pose(played, frame).transforms()[joint].rotation;
                let off = degrees(turned(&plain), turned(&limited));
                // Rigs with other rest poses bend a little otherwise than the source, which the soft begin takes back.
                assert!(off < 0.5, "{}: {off}", stage.target.skeleton.label(joint));
            }
        }
    }
}

#[test]
fn an_elbow_does_not_bend_the_wrong_way() {
    let stage = Stage::walk();
    let elbow = |played: &super::stage::Played| {
        let at = |name: &str| stage.place(played, 30, name);
        let (upper, lower) = (at("lowerarm_l") - at("upperarm_l"), at("hand_l") - at("lowerarm_l"));
        upper.angle_between(lower).to_degrees()
    };
    let plain = elbow(&stage.play(KINEMATICS));
    for degrees in [-120.0, 120.0] {
        let wrong = stage.play(&bent("", degrees));
        let mended = stage.play(&bent(r#", {"op": "limits"}"#, degrees));
        let hard = stage.play(&bent(r#", {"op": "limits", "relative": false, "ranges": {"forearm": {"bend": [-5, 30], "side": [-5, 5], "twist": [-90, 90]}}}"#, degrees));
        assert!(elbow(&hard) < 33.0, "{degrees}: at most the limit: {}", elbow(&hard));
        if elbow(&wrong) > 60.0 && degrees < 0.0 {
            assert!(
                elbow(&mended) < plain + 40.0,
                "{degrees}: {} to {}, where it was {plain}",
                elbow(&wrong),
                elbow(&mended)
            );
        }
    }
}

#[test]
fn ranges_must_be_ranges() {
    let stage = Stage::walk();
    for (ranges, pointer) in [
        (r#"{"spine": {"bend": [10, 20], "side": [0, 0], "twist": [0, 0]}}"#, "/ops/0/ranges/spine/bend"),
        (r#"{"beard": {"bend": [-10, 20], "side": [0, 0], "twist": [0, 0]}}"#, "/ops/0/ranges/beard"),
    ] {
        let error = stage.try_play(&format!(r#"{{"ops": [{{"op": "limits", "ranges": {ranges}}}]}}"#)).err();
        assert_eq!(error.expect("refused").fields[0].pointer, pointer, "{ranges}");
    }
}

#[test]
fn half_a_range_is_enough() {
    let stage = Stage::walk();
    let elbow = |played: &super::stage::Played| {
        let at = |name: &str| stage.place(played, 30, name);
        let (upper, lower) = (at("lowerarm_l") - at("upperarm_l"), at("hand_l") - at("lowerarm_l"));
        upper.angle_between(lower).to_degrees()
    };
    for ranges in [r#"{"forearm": {"bend": [-5, 30]}}"#, r#"{"forearm": {"bend": [null, 30]}}"#] {
        let ops = format!(r#", {{"op": "limits", "relative": false, "ranges": {ranges}}}"#);
        assert!(elbow(&stage.play(&bent(&ops, 100.0))) < 33.0, "{ranges}: the side that is given holds");
    }
}
