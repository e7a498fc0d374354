//! A walk on the toes: heels that never come down stay up, on other figures too.

use glam::{DQuat, DVec3};
use retargetd::{
    model::{JointTracks, Scene, Track},
    samples,
};

use super::figure::{moved, position, rig_of, rotation, with_tracks, world};

/// How far the heels are up.
const RAISED_DEGREES: f64 = 35.0;
const SIDES: [&str; 2] = ["left", "right"];

#[test]
fn who_walks_on_the_toes_keeps_the_heels_up() {
    let walk = samples::walk_scene();
    let on_toes = on_toes(&walk, RAISED_DEGREES);
    let target = samples::mannequin_scene();
    let (flat, heels) = walked(&walk, &target);
    assert!(heels.iter().all(|touches| *touches), "heels of a walk strike the floor: {heels:?}");
    let (raised, heels) = walked(&on_toes, &target);
    assert!(!heels.iter().any(|touches| *touches), "heels that never come down do not touch: {heels:?}");
    let difference = raised - flat;
    assert!((difference - RAISED_DEGREES).abs() < 5.0, "the feet are {difference} degrees steeper, as the source's");
}

/// The middle steepness of the feet of the result, in degrees, and whether each heel of the source ever touches.
fn walked(source: &Scene, target: &Scene) -> (f64, Vec<bool>) {
    let (from, onto) = (rig_of("source", source), rig_of("target", target));
    let result = moved(&from, &onto);
    let heels = result.contacts.iter().filter(|track| SIDES.iter().any(|side| track.point == format!("{side}_foot")));
    let heels: Vec<bool> = heels.map(|track| track.touches.contains(&true)).collect();
    assert_eq!(heels.len(), 2, "{:?}", result.contacts.iter().map(|track| &track.point).collect::<Vec<_>>());
    let mut steepness = Vec::new();
    for frame in 0..result.clip.frame_count() {
        let pose = world(&target.skeleton, Some((&result.clip, frame)));
        for side in SIDES {
            let [foot, toe] = ["foot", "toe"].map(|part| position(&pose, onto.role(&format!("{side}_{part}"))[0]));
            let down = foot - toe;
            steepness.push(down.y.atan2(DVec3::new(down.x, 0.0, down.z).length()).to_degrees());
        }
    }
    steepness.sort_by(f64::total_cmp);
    (steepness[steepness.len() / 2], heels)
}

/// The same walk with feet that are steeper by an angle, toes that stay as they are, and the body lifted by what that takes.
fn on_toes(walk: &Scene, degrees: f64) -> Scene {
    let skeleton = &walk.skeleton;
    let rig = rig_of("source", walk);
    let clip = &walk.clips[0];
    let rest = world(skeleton, None);
    let mut joints: Vec<JointTracks> = clip.joints().to_vec();
    // Toes down, about the body's own left in the scene's space.
    let left = rig.canonical_from_scene.conjugate() * DVec3::X;
    let steeper = DQuat::from_axis_angle(left, degrees.to_radians());
    let mut lift = 0.0_f64;
    for side in SIDES {
        let [foot, toe] = ["foot", "toe"].map(|part| rig.role(&format!("{side}_{part}"))[0]);
        let along = position(&rest, toe) - position(&rest, foot);
        lift = lift.max((along - steeper * along).dot(rig.up()));
        for (joint, turn) in [(foot, steeper), (toe, steeper.conjugate())] {
            let rotations: Vec<glam::Quat> = (0..clip.frame_count())
                .map(|frame| {
                    let pose = world(skeleton, Some((clip, frame)));
                    let own = rotation(&pose, joint);
                    // How the joint is turned against its rest takes the axis with it.
                    let moved = own * rotation(&rest, joint).conjugate();
                    let about = moved * turn * moved.conjugate();
                    let local = clip.joints()[joint].rotation.at(frame, glam::Quat::IDENTITY).as_dquat();
                    let parent = own * local.conjugate();
                    (parent.conjugate() * about * own).as_quat()
                })
                .collect();
            joints[joint].rotation = Track::Sampled(rotations);
        }
    }
    let pelvis = rig.role("pelvis")[0];
    let parent = skeleton.parent(pelvis).map_or(DQuat::IDENTITY, |parent| rotation(&rest, parent));
    let lifted = parent.conjugate() * (rig.up() * lift);
    let places = (0..clip.frame_count()).map(|frame| {
        let rest = skeleton.joints()[pelvis].rest.translation.as_vec3();
        clip.joints()[pelvis].translation.at(frame, rest) + lifted.as_vec3()
    });
    joints[pelvis].translation = Track::Sampled(places.collect());
    with_tracks(walk, joints)
}
