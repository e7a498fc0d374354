//! A character whose armature is stretched along one axis, as a viewer shows the result.

use retargetd::{
    engine::{Inputs, NamedBytes, retarget},
    formats::{Format, Limits},
    model::Control,
};

use super::figure::{Figure, frames_of, position, world};
use crate::support::corpus_file;

/// Joints of both rigs whose directions are compared, by role.
const LIMBS: [(&str, &str); 8] = [
    ("left_upper_arm", "left_forearm"),
    ("left_forearm", "left_hand"),
    ("right_upper_arm", "right_forearm"),
    ("right_forearm", "right_hand"),
    ("left_thigh", "left_shin"),
    ("left_shin", "left_foot"),
    ("right_thigh", "right_shin"),
    ("right_shin", "right_foot"),
];

/// The files are read back with the matrices of their nodes multiplied, which is what a viewer does; that reading does so is
/// tested where the joints of the model are.
#[test]
fn limbs_of_a_stretched_armature_point_right_and_keep_their_lengths() {
    let targets = ["odd-transforms/armature_nonuniform_scale.glb", "odd-transforms/armature_nonuniform_scale.fbx"];
    let Some(source) = corpus_file("mixamo/fbx/samba_dancing_skin.fbx") else { return };
    let source = Figure::read(&source);
    for name in targets {
        let target = Figure::read(&corpus_file(name).expect("beside the other"));
        let inputs = Inputs {
            source: source.named_bytes(),
            target: target.named_bytes(),
            source_rest: None,
            target_rest: None,
            config: Some(NamedBytes { name: "config.json", bytes: br#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"# }),
            formats: &[Format::Glb],
        };
        let outcome = retarget(&inputs, &Limits::default(), &Control::new()).expect("a result");
        let result = Figure::from_bytes(outcome.outputs[0].bytes.clone(), "result.glb".into());
        let rest = world(result.skeleton(), None);
        let clip = result.clip();
        for frame in frames_of(clip, 60) {
            let wanted = world(source.skeleton(), Some((source.clip(), frame)));
            let found = world(result.skeleton(), Some((clip, frame)));
            for (start, end) in LIMBS {
                let bone = |figure: &Figure, world: &[glam::DMat4]| {
                    position(world, figure.roles[end]) - position(world, figure.roles[start])
                };
                let degrees = bone(&source, &wanted).angle_between(bone(&result, &found)).to_degrees();
                assert!(degrees < 1.0, "{name}: frame {frame}: {start} is {degrees:.2} degrees off");
                let (length, own) = (bone(&result, &found).length(), bone(&result, &rest).length());
                assert!((length / own - 1.0).abs() < 1e-3, "{name}: frame {frame}: {start} is {length} m, not {own}");
            }
        }
    }
}
