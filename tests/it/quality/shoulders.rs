//! Clavicles that only one side has.

use glam::{DQuat, DVec3};
use retargetd::{
    model::{Clip, Scene},
    retarget::RetargetSpec,
    samples,
};

use super::{
    figure::{degrees_between, position, rotation, world},
    made_rigs::{MadeRig, clip_of, retargeted},
};

const MAX_DEGREES: f64 = 0.05;

fn joint(scene: &Scene, name: &str) -> usize {
    scene.skeleton.find(name).unwrap_or_else(|| panic!("a joint named {name}"))
}

fn without_clavicles() -> Scene {
    let rig = MadeRig::of(&samples::mannequin_scene());
    let rig = rig.hung_from("upperarm_l", "spine_05").hung_from("upperarm_r", "spine_05");
    rig.without(|name| name.starts_with("clavicle")).scene(|_| false)
}

/// The left arm is raised sideways by as many degrees as there are frames; at rest it hangs 45° below the horizontal.
fn raising(scene: &Scene, joints: &[&str]) -> Clip {
    let rest = world(&scene.skeleton, None);
    let turn = |name: &str, frame: usize| {
        let axis = rotation(&rest, joint(scene, name)).conjugate() * DVec3::Z;
        joints.contains(&name).then(|| DQuat::from_axis_angle(axis, (frame as f64).to_radians()))
    };
    clip_of(scene, 91, turn)
}

fn arm(scene: &Scene, world: &[glam::DMat4]) -> DVec3 {
    position(world, joint(scene, "lowerarm_l")) - position(world, joint(scene, "upperarm_l"))
}

#[test]
fn a_raised_arm_lifts_a_shoulder_that_the_source_does_not_have() {
    let (source, target) = (without_clavicles(), samples::mannequin_scene());
    let clip = raising(&source, &["upperarm_l"]);
    let result = retargeted(&RetargetSpec::default(), &source, &clip, &target).expect("a mapping").0;
    let clavicle = joint(&target, "clavicle_l");
    let rest = rotation(&world(&target.skeleton, None), clavicle);
    for frame in [0, 20, 45, 90] {
        let (one, other) =
            (world(&source.skeleton, Some((&clip, frame))), world(&target.skeleton, Some((&result, frame))));
        let off = arm(&source, &one).angle_between(arm(&target, &other)).to_degrees();
        assert!(off < MAX_DEGREES, "the arm points as it should but for {off}°");
        let lift = degrees_between(rest, rotation(&other, clavicle));
        let wanted = 0.3 * frame as f64;
        assert!((lift - wanted).abs() < 0.2, "the shoulder is lifted by {lift}° instead of {wanted}° at frame {frame}");
    }
    let spec: RetargetSpec =
        serde_json::from_value(serde_json::json!({"ops": [{"op": "pelvis"}, {"op": "fk", "shoulder": 0.0}]}))
            .expect("a spec");
    let still = retargeted(&spec, &source, &clip, &target).expect("a mapping").0;
    let lift = degrees_between(rest, rotation(&world(&target.skeleton, Some((&still, 90))), clavicle));
    assert!(lift < MAX_DEGREES, "nobody asked for it: {lift}°");
}

#[test]
fn what_a_clavicle_does_to_an_arm_is_not_lost_on_a_target_without() {
    let (source, target) = (samples::mannequin_scene(), without_clavicles());
    let clip = raising(&source, &["clavicle_l", "upperarm_l"]);
    let result = retargeted(&RetargetSpec::default(), &source, &clip, &target).expect("a mapping").0;
    for frame in [0, 45, 90] {
        let (one, other) =
            (world(&source.skeleton, Some((&clip, frame))), world(&target.skeleton, Some((&result, frame))));
        let off = arm(&source, &one).angle_between(arm(&target, &other)).to_degrees();
        assert!(off < MAX_DEGREES, "the arm is {off}° off at frame {frame}");
    }
}
