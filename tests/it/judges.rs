//! Written files, as other programs read them: every joint where it is in our own poses.

mod assimp;
mod blender;
mod browser;
mod carried;
mod drawn;
mod files;
mod marks;
mod meshes;
mod options;
mod skinned;
mod three;
mod vrma;

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use retargetd::{
    engine::{self, Format, Inputs, Limits, NamedBytes},
    model::{Clip, Control, LocalPose, Scene, Transform},
};
use serde_json::Value;

use crate::quality::figure::read_scene;

/// How far joints may be from where they should be, as a share of the figure's size.
const MAX_OF_SIZE: f64 = 1e-4;
const MAX_DEGREES: f64 = 0.01;

/// How far joints are from where they should be.
#[derive(Clone, Copy, Debug, Default)]
struct Apart {
    /// As a share of the figure's size.
    size: f64,
    degrees: f64,
    /// How many joints were compared.
    joints: usize,
}

/// Whether a reader's joints have the axes of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Axes {
    /// They do.
    Same,
    /// They have the reader's.
    Own,
}

/// The angle between two rotations, exact for small ones too.
fn angle(one: DQuat, other: DQuat) -> f64 {
    let turn = one.conjugate() * other;
    2.0 * turn.xyz().length().atan2(turn.w.abs())
}

/// A clip that was written, and what it should look like.
struct Written {
    scene: Scene,
    clip: Clip,
}

impl Written {
    /// The clip of a file of ours.
    fn of(bytes: &[u8], name: &str) -> Self {
        let scene = read_scene(bytes, name);
        let clip = scene.clips[0].clone();
        Self { scene, clip }
    }

    /// The pose at a time from the clip's beginning on, between two frames as players have it.
    fn pose(&self, seconds: f64) -> LocalPose {
        let times = self.clip.times_seconds();
        let time = times[0] + seconds;
        let after = times.partition_point(|key| *key <= time).clamp(1, times.len() - 1);
        let part = ((time - times[after - 1]) / (times[after] - times[after - 1])).clamp(0.0, 1.0);
        let [before, after] = [after - 1, after].map(|frame| self.clip.local_pose(&self.scene.skeleton, frame));
        let blend = |(from, to): (&Transform, &Transform)| Transform {
            translation: from.translation.lerp(to.translation, part),
            rotation: from.rotation.slerp(to.rotation, part),
            scale: from.scale.lerp(to.scale, part),
        };
        LocalPose::new(before.transforms().iter().zip(after.transforms()).map(blend).collect())
    }

    /// The height of the rest pose, or what is largest of it.
    fn size(&self) -> f64 {
        let rest = self.scene.skeleton.rest_pose().to_model(&self.scene.skeleton);
        let joints = self.scene.skeleton.joints().iter().zip(rest.transforms()).filter(|(joint, _)| joint.is_joint);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (_, transform) in joints {
            low = low.min(transform.translation);
            high = high.max(transform.translation);
        }
        (high - low).max_element()
    }

    /// Compares with what a reader saw, which calls joints by `name_of` (nothing for those that it does not have) in units of
    /// `unit_meters`. Rotations are compared as they are, or as they changed since the clip's beginning, for readers that have
    /// their own axes of joints.
    fn apart(&self, seen: &Value, unit_meters: f64, axes: Axes, name_of: impl Fn(usize) -> Option<String>) -> Apart {
        assert_eq!(seen["error"], Value::Null, "it can be read");
        let mut apart = Apart::default();
        let times: Vec<f64> = seen["times"].as_array().expect("times").iter().filter_map(Value::as_f64).collect();
        assert!((seen["seconds"].as_f64().expect("a length") - self.clip.duration_seconds()).abs() < 1e-3, "as long");
        let names: BTreeMap<usize, String> =
            (0..self.scene.skeleton.len()).filter_map(|joint| Some((joint, name_of(joint)?))).collect();
        let size = self.size();
        let mut first: BTreeMap<usize, (DQuat, DQuat)> = BTreeMap::new();
        for (index, time) in times.iter().enumerate() {
            let pose = self.pose(*time).to_model(&self.scene.skeleton);
            for (joint, name) in &names {
                let numbers: Vec<f64> = seen["joints"][name][index]
                    .as_array()
                    .unwrap_or_else(|| panic!("'{name}' is there"))
                    .iter()
                    .filter_map(Value::as_f64)
                    .collect();
                let (ours, theirs) = (&pose.transforms()[*joint], numbers);
                let position = DVec3::from_slice(&theirs) * unit_meters;
                let rotation = DQuat::from_slice(&theirs[3..]).normalize();
                apart.size = apart.size.max(ours.translation.distance(position) / size);
                let (ours, theirs) = match axes {
                    Axes::Same => (ours.rotation, rotation),
                    Axes::Own => {
                        let (here, there) = first.entry(*joint).or_insert((ours.rotation, rotation));
                        (ours.rotation * here.conjugate(), rotation * there.conjugate())
                    }
                };
                apart.degrees = apart.degrees.max(angle(ours, theirs).to_degrees());
            }
        }
        apart.joints = names.len();
        apart
    }
}

/// One JSON line for each file that a reader was given.
fn answers(output: &std::process::Output, files: usize) -> Option<Vec<Value>> {
    assert!(output.status.success(), "the reader works: {}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout);
    let answers: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).expect("one JSON a line")).collect();
    assert_eq!(answers.len(), files, "one answer for each file");
    Some(answers)
}

/// A retarget with several outputs.
fn retargeted(source: (&str, &[u8]), target: (&str, &[u8]), config: &str, formats: &[Format]) -> engine::Outcome {
    let inputs = Inputs {
        source: NamedBytes { name: source.0, bytes: source.1 },
        target: NamedBytes { name: target.0, bytes: target.1 },
        source_rest: None,
        target_rest: None,
        config: Some(NamedBytes { name: "config.json", bytes: config.as_bytes() }),
        formats,
    };
    engine::retarget(&inputs, &Limits::default(), &Control::new()).expect("it can be retargeted")
}
