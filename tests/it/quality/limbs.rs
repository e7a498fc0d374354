//! Limbs that hang from elsewhere, limbs in more or fewer pieces, and limbs that share their twist.

use glam::{DQuat, DVec3};
use retargetd::{
    model::{Clip, Scene},
    retarget::{MetricName, RetargetSpec},
    rig::Align,
    samples,
};

use super::{
    figure::{degrees_between, measured, moved, position, rig_of, rotation, value, world},
    made_rigs::{MadeRig, clip_of, retargeted, roles_of},
};

const MAX_DEGREES: f64 = 0.01;
const MAX_METERS: f64 = 1e-4;

fn joint(scene: &Scene, name: &str) -> usize {
    scene.skeleton.find(name).unwrap_or_else(|| panic!("a joint named {name}"))
}

fn plain(source: &Scene, clip: &Clip, target: &Scene) -> Clip {
    retargeted(&RetargetSpec::default(), source, clip, target).expect("a mapping").0
}

/// Every joint of both skeletons at every frame, by name.
fn assert_same_motion(first: (&Scene, &Clip), second: (&Scene, &Clip), what: &str) {
    for frame in 0..first.1.frame_count() {
        let one = world(&first.0.skeleton, Some((first.1, frame)));
        let other = world(&second.0.skeleton, Some((second.1, frame)));
        for (index, made) in first.0.skeleton.joints().iter().enumerate() {
            let twin = joint(second.0, &made.name);
            let meters = position(&one, index).distance(position(&other, twin));
            let degrees = degrees_between(rotation(&one, index), rotation(&other, twin));
            assert!(meters < MAX_METERS, "{what}: {} is {meters} m off at frame {frame}", made.name);
            assert!(degrees < MAX_DEGREES, "{what}: {} is {degrees}° off at frame {frame}", made.name);
        }
    }
}

#[test]
fn limbs_that_hang_from_the_root_move_as_if_they_hung_from_the_body() {
    let (walk, mannequin) = (samples::walk_scene(), samples::mannequin_scene());
    // Where joints lie is what counts here, not how rest poses are turned to look alike.
    let roles = RetargetSpec { align: Align::Off, ..roles_of(&mannequin) };
    let whole = retargeted(&roles, &walk, &walk.clips[0], &mannequin).expect("a mapping").0;
    let both = |rig: MadeRig, part: &str, parent: &str| {
        let rig = rig.hung_from(&format!("{part}_l"), parent);
        rig.hung_from(&format!("{part}_r"), parent)
    };
    let rig = || MadeRig::of(&mannequin);
    let limbs = both(both(both(rig(), "thigh", "root"), "clavicle", "root"), "upperarm", "root");
    let pieces = both(both(both(limbs.clone(), "foot", "root"), "hand", "root"), "calf", "root");
    let neck = pieces.clone().hung_from("neck_01", "root").hung_from("spine_01", "root").hung_from("spine_04", "root");
    let max_biped = both(both(rig(), "thigh", "spine_01"), "clavicle", "neck_01");
    for (what, rig) in [("limbs", limbs), ("pieces", pieces), ("everything", neck), ("3ds Max Biped", max_biped)] {
        for feet_first in [false, true] {
            let target = rig.scene(|name| feet_first && (name.starts_with("foot") || name.starts_with("hand")));
            let result = retargeted(&roles, &walk, &walk.clips[0], &target).expect("a mapping").0;
            assert_same_motion((&mannequin, &whole), (&target, &result), what);
        }
    }
}

/// Feet, shins, hands and forearms that hang from the root lie where the limbs end whose rest poses are turned to look like the source's.
#[test]
fn limbs_in_pieces_end_where_their_aligned_rest_poses_do() {
    let (walk, mannequin) = (samples::walk_scene(), samples::mannequin_scene());
    let spread = |joint: &str, degrees: f64| {
        let edit = serde_json::json!({"edit": "rotate", "joint": joint, "degrees": [0, 0, degrees]});
        serde_json::from_value(edit).expect("an edit")
    };
    let mut spec = roles_of(&mannequin);
    spec.source.pose = vec![spread("LeftUpLeg", 25.0), spread("RightUpLeg", -25.0)];
    let whole = retargeted(&spec, &walk, &walk.clips[0], &mannequin).expect("a mapping").0;
    let mut rig = MadeRig::of(&mannequin);
    for name in ["foot_l", "foot_r", "calf_l", "calf_r", "hand_l", "hand_r", "lowerarm_l", "lowerarm_r"] {
        rig = rig.hung_from(name, "root");
    }
    let target = rig.scene(|_| false);
    let result = retargeted(&spec, &walk, &walk.clips[0], &target).expect("a mapping").0;
    assert_same_motion((&mannequin, &whole), (&target, &result), "pieces");
}

/// The report says so, too: hips face where the pelvis turns them, whatever thighs hang from.
#[test]
fn hips_face_where_those_of_the_source_do_wherever_thighs_hang_from() {
    let body = samples::mannequin_scene();
    let turning = clip_of(&body, 40, |name, frame| {
        (name == "pelvis").then(|| DQuat::from_rotation_y(f64::to_radians(4.0 * frame as f64)))
    });
    let source = Scene { clips: vec![turning], ..body.clone() };
    for parent in ["root", "spine_01"] {
        let target = MadeRig::of(&body).hung_from("thigh_l", parent).hung_from("thigh_r", parent).scene(|_| false);
        let (from, onto) = (rig_of("source", &source), rig_of("target", &target));
        let facing = value(&measured(&from, &onto, &moved(&from, &onto)), MetricName::Facing);
        assert!(facing < 0.1, "thighs that hang from {parent}: {facing} degrees");
    }
}

#[test]
fn a_foot_without_a_source_rides_the_shin() {
    let (walk, mannequin) = (samples::walk_scene(), samples::mannequin_scene());
    let spec = |roles: &str| -> RetargetSpec {
        serde_json::from_value(
            serde_json::json!({"source": {"roles": serde_json::from_str::<serde_json::Value>(roles).expect("JSON")}}),
        )
        .expect("a spec")
    };
    let no_feet = spec(r#"{"left_foot": [], "right_foot": [], "left_toe": [], "right_toe": []}"#);
    let whole = retargeted(&no_feet, &walk, &walk.clips[0], &mannequin).expect("a mapping");
    assert!(whole.2.contains(&"limbs_not_mapped"), "idle feet are told: {:?}", whole.2);
    let target = MadeRig::of(&mannequin).hung_from("foot_l", "root").hung_from("foot_r", "root").scene(|_| false);
    let apart = retargeted(&no_feet, &walk, &walk.clips[0], &target).expect("a mapping");
    assert_same_motion((&mannequin, &whole.0), (&target, &apart.0), "feet that nothing drives");
}

/// A mannequin whose left hand and left arm turn about their own bones, by as many degrees as there are frames.
fn twisting(part: &str, scene: &Scene, end: &str) -> (Clip, DVec3) {
    let rest = world(&scene.skeleton, None);
    let (start, end) = (joint(scene, part), joint(scene, end));
    let along = (position(&rest, end) - position(&rest, start)).normalize();
    let turned = if part.starts_with("lowerarm") { "hand_l" } else { part };
    let own_axis = rotation(&rest, joint(scene, turned)).conjugate() * along;
    let turn = |name: &str, frame: usize| {
        (name == turned).then(|| DQuat::from_axis_angle(own_axis, (frame as f64 - 180.0).to_radians()))
    };
    (clip_of(scene, 361, turn), along)
}

/// The signed turn of a joint about a line against another one, against what it is at rest.
fn twist(scene: &Scene, clip: &Clip, frame: usize, of: &str, against: &str, along: DVec3) -> f64 {
    let (rest, now) = (world(&scene.skeleton, None), world(&scene.skeleton, Some((clip, frame))));
    let relative =
        |world: &[glam::DMat4]| rotation(world, joint(scene, against)).conjugate() * rotation(world, joint(scene, of));
    let change = relative(&now) * relative(&rest).conjugate();
    let axis = rotation(&rest, joint(scene, against)).conjugate() * along;
    let change = if change.w < 0.0 { -change } else { change };
    2.0 * change.xyz().dot(axis).atan2(change.w).to_degrees()
}

/// What a share of a twist is: all of it up to 120°, less and less up to half a turn.
fn limited(degrees: f64) -> f64 {
    let size = degrees.abs();
    degrees.signum() * if size > 120.0 { 120.0 * (180.0 - size) / 60.0 } else { size }
}

#[test]
fn helpers_share_the_twist_of_their_limb() {
    let target = samples::mannequin_scene();
    let source = MadeRig::of(&target).without(|name| name.contains("twist")).scene(|_| false);
    let (clip, along) = twisting("lowerarm_l", &source, "hand_l");
    let result = plain(&source, &clip, &target);
    for frame in 0..361 {
        let wanted = limited(frame as f64 - 180.0);
        for (helper, share) in [("lowerarm_twist_02_l", 1.0 / 3.0), ("lowerarm_twist_01_l", 2.0 / 3.0)] {
            let found = twist(&target, &result, frame, helper, "lowerarm_l", along);
            assert!((found - wanted * share).abs() < 0.1, "{helper} turns {found}° for {wanted}° at frame {frame}");
        }
    }
    let (clip, along) = twisting("upperarm_l", &source, "lowerarm_l");
    let result = plain(&source, &clip, &target);
    for frame in 31..330 {
        let wanted = frame as f64 - 180.0;
        for (helper, share) in [("upperarm_twist_01_l", 1.0 / 3.0), ("upperarm_twist_02_l", 2.0 / 3.0)] {
            let found = twist(&target, &result, frame, helper, "clavicle_l", along);
            let left = wanted - limited(wanted) * (1.0 - share);
            assert!((found - left).abs() < 0.1, "{helper} turns {found}° for {wanted}° at frame {frame}");
        }
    }
}

#[test]
fn a_twist_never_pops() {
    let target = samples::mannequin_scene();
    let source = MadeRig::of(&target).without(|name| name.contains("twist")).scene(|_| false);
    let (clip, _) = twisting("lowerarm_l", &source, "hand_l");
    let result = plain(&source, &clip, &target);
    for helper in ["lowerarm_twist_01_l", "lowerarm_twist_02_l"] {
        let tracks = &result.joints()[joint(&target, helper)];
        // Frames 0 and 360 are the same pose, so the circle closes.
        for frame in 0..361 {
            let at = |frame: usize| tracks.rotation.at(frame % 361, glam::Quat::IDENTITY).as_dquat();
            let step = degrees_between(at(frame), at(frame + 1));
            assert!(step < 4.0, "{helper} jumps by {step}° at frame {frame}");
        }
    }
}

#[test]
fn twist_is_left_alone_when_it_is_not_wanted() {
    let target = samples::mannequin_scene();
    let source = MadeRig::of(&target).without(|name| name.contains("twist")).scene(|_| false);
    let (clip, along) = twisting("lowerarm_l", &source, "hand_l");
    let spec: RetargetSpec =
        serde_json::from_value(serde_json::json!({"ops": [{"op": "pelvis"}, {"op": "fk", "twist": false}]}))
            .expect("a spec");
    let result = retargeted(&spec, &source, &clip, &target).expect("a mapping").0;
    let found = twist(&target, &result, 270, "lowerarm_twist_01_l", "lowerarm_l", along);
    assert!(found.abs() < MAX_DEGREES, "the helper rides the forearm: {found}°");
}

/// The mannequin with its left forearm and upper arm in two pieces each.
fn split_arm() -> Scene {
    let rig = MadeRig::of(&samples::mannequin_scene()).without(|name| name.contains("twist"));
    let half = |from: &str, to: &str| rig.place(from).midpoint(rig.place(to));
    let (elbow, wrist) = (half("upperarm_l", "lowerarm_l"), half("lowerarm_l", "hand_l"));
    let rig = rig.with("upperarm_half_l", "upperarm_l", elbow).hung_from("lowerarm_l", "upperarm_half_l");
    rig.with("lowerarm_half_l", "lowerarm_l", wrist).hung_from("hand_l", "lowerarm_half_l").scene(|_| false)
}

fn split_spec(side: &str) -> RetargetSpec {
    let roles = serde_json::json!({
        "left_upper_arm": ["upperarm_l", "upperarm_half_l"], "left_forearm": ["lowerarm_l", "lowerarm_half_l"]
    });
    serde_json::from_value(serde_json::json!({side: {"roles": roles}})).expect("a spec")
}

#[test]
fn split_limbs_share_the_twist_of_whole_ones() {
    let source = MadeRig::of(&samples::mannequin_scene()).without(|name| name.contains("twist")).scene(|_| false);
    let target = split_arm();
    let (clip, along) = twisting("lowerarm_l", &source, "hand_l");
    let result = retargeted(&split_spec("target"), &source, &clip, &target).expect("a mapping").0;
    for (frame, degrees) in [(180, 0.0), (240, 60.0), (90, -90.0)] {
        for (piece, share) in [("lowerarm_l", 0.0), ("lowerarm_half_l", 0.5), ("hand_l", 1.0)] {
            let found = twist(&target, &result, frame, piece, "upperarm_half_l", along);
            assert!((found - degrees * share).abs() < 0.1, "{piece} turns {found}° of {degrees}°");
        }
    }
    let (clip, along) = twisting("upperarm_l", &source, "lowerarm_l");
    let result = retargeted(&split_spec("target"), &source, &clip, &target).expect("a mapping").0;
    for (frame, degrees) in [(180, 0.0), (240, 60.0), (90, -90.0)] {
        for (piece, share) in [("upperarm_l", 0.0), ("upperarm_half_l", 1.0)] {
            let found = twist(&target, &result, frame, piece, "clavicle_l", along);
            assert!((found - degrees * share).abs() < 0.1, "{piece} turns {found}° of {degrees}°");
        }
    }
}

#[test]
fn the_twist_of_split_limbs_goes_into_what_follows_whole_ones() {
    let source = split_arm();
    let target = MadeRig::of(&samples::mannequin_scene()).without(|name| name.contains("twist")).scene(|_| false);
    let rest = world(&source.skeleton, None);
    let along = (position(&rest, joint(&source, "hand_l")) - position(&rest, joint(&source, "lowerarm_l"))).normalize();
    let axis = rotation(&rest, joint(&source, "lowerarm_half_l")).conjugate() * along;
    let turn = |name: &str, frame: usize| {
        (name == "lowerarm_half_l").then(|| DQuat::from_axis_angle(axis, (frame as f64).to_radians()))
    };
    let clip = clip_of(&source, 91, turn);
    let result = retargeted(&split_spec("source"), &source, &clip, &target).expect("a mapping").0;
    let turned = |piece: &str| twist(&target, &result, 90, piece, "upperarm_l", along);
    assert!(turned("lowerarm_l").abs() < 0.1, "the elbow stays: {}°", turned("lowerarm_l"));
    assert!((turned("hand_l") - 90.0).abs() < 0.1, "the hand has all of it: {}°", turned("hand_l"));
}
