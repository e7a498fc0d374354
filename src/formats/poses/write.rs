//! A clip of a target as dense arrays, whatever the codec: which joints, which values, what `meta` says.

use glam::DQuat;
use serde::Serialize;

use crate::{
    formats::{FormatError, WriteOptions, written},
    model::{Clip, MorphPlace, Reporter, Scene, Skeleton, Track},
};

/// The three local channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    Translation,
    Rotation,
    Scale,
}

impl Channel {
    pub(super) const ALL: [Self; 3] = [Self::Translation, Self::Rotation, Self::Scale];

    /// The key of its array.
    pub(super) const fn key(self) -> &'static str {
        match self {
            Self::Translation => "translations",
            Self::Rotation => "rotations",
            Self::Scale => "scales",
        }
    }

    /// Numbers per value.
    pub(super) const fn width(self) -> usize {
        match self {
            Self::Rotation => 4,
            Self::Translation | Self::Scale => 3,
        }
    }
}

/// What is to be written.
pub(super) struct Poses<'a> {
    skeleton: &'a Skeleton,
    clip: &'a Clip,
    /// Index in the skeleton of every joint that is written, rising.
    joints: Vec<usize>,
    /// Index among the written joints, per joint of the skeleton.
    written: Vec<Option<usize>>,
    morphs: Vec<MorphColumn<'a>>,
    meta: String,
}

/// The weights of one morph.
pub(super) struct MorphColumn<'a> {
    pub(super) name: &'a str,
    rest: f32,
    weights: &'a Track<f32>,
}

impl MorphColumn<'_> {
    pub(super) fn weight(&self, frame: usize) -> f32 {
        self.weights.at(frame, self.rest)
    }
}

#[derive(Serialize)]
struct MetaView<'a> {
    name: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    fps: Option<f64>,
    axes: String,
    unit: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    retargetd: Option<&'a serde_json::Value>,
}

impl<'a> Poses<'a> {
    pub(super) fn new(
        target: &'a Scene,
        clip: &'a Clip,
        options: &'a WriteOptions,
        reporter: &mut Reporter,
    ) -> Result<Self, FormatError> {
        let skeleton = &target.skeleton;
        if skeleton.is_empty() {
            return Err(FormatError::unsupported(
                "write",
                "joint_names",
                "the target has no node that could be written",
                "choose a target with a skeleton",
            ));
        }
        debug_assert_eq!(clip.joints().len(), skeleton.len(), "a clip belongs to its skeleton");
        let joints = written::joints_to_write(skeleton);
        written::warn_of_lost_motion(target, clip, &joints, "pose arrays do", reporter);
        let mut written = vec![None; skeleton.len()];
        for (position, joint) in joints.iter().enumerate() {
            written[*joint] = Some(position);
        }
        let meta = MetaView {
            name: clip.name(),
            fps: clip.uniform_fps().map(tidy_rate),
            axes: target.axes.unwrap_or_default().to_string(),
            unit: target.unit_meters.unwrap_or(1.0),
            retargetd: options.extras.as_ref(),
        };
        let meta = serde_json::to_string(&meta)
            .map_err(|error| FormatError::malformed("write", "meta", format!("cannot be written as JSON: {error}")))?;
        Ok(Self { skeleton, clip, joints, written, morphs: morph_columns(target, clip), meta })
    }

    pub(super) fn joint_count(&self) -> usize {
        self.joints.len()
    }

    pub(super) fn joint_names(&self) -> Vec<&'a str> {
        self.joints.iter().map(|joint| self.skeleton.joints()[*joint].name.as_str()).collect()
    }

    /// Index of every joint's parent among the written ones, −1 for a root.
    pub(super) fn parents(&self) -> impl Iterator<Item = i32> {
        self.joints.iter().map(|joint| {
            let parent = self.skeleton.parent(*joint).and_then(|parent| self.written[parent]);
            parent.and_then(|parent| i32::try_from(parent).ok()).unwrap_or(-1)
        })
    }

    pub(super) fn times(&self) -> &[f64] {
        self.clip.times_seconds()
    }

    /// The local rest value of a written joint.
    pub(super) fn rest(&self, channel: Channel, joint: usize) -> impl Iterator<Item = f32> + use<> {
        let rest = &self.skeleton.joints()[self.joints[joint]].rest;
        values(match channel {
            Channel::Translation => Value::Vector(rest.translation.as_vec3().to_array()),
            Channel::Rotation => Value::Rotation(unit(rest.rotation)),
            Channel::Scale => Value::Vector(rest.scale.as_vec3().to_array()),
        })
    }

    /// The local value of a written joint at a frame.
    pub(super) fn value(&self, channel: Channel, joint: usize, frame: usize) -> impl Iterator<Item = f32> + use<> {
        let joint = self.joints[joint];
        let rest = &self.skeleton.joints()[joint].rest;
        let tracks = &self.clip.joints()[joint];
        values(match channel {
            Channel::Translation => Value::Vector(tracks.translation.at(frame, rest.translation.as_vec3()).to_array()),
            Channel::Rotation => Value::Rotation(unit(tracks.rotation.wide_at(frame, rest.rotation))),
            Channel::Scale => Value::Vector(tracks.scale.at(frame, rest.scale.as_vec3()).to_array()),
        })
    }

    /// Names of the joints with contacts, and their tracks; both empty where nothing is known of any.
    pub(super) fn contacts(&self) -> (Vec<&'a str>, Vec<&'a [bool]>) {
        let tracks = self.clip.contacts().iter().filter(|track| self.written[track.joint].is_some());
        tracks.map(|track| (self.skeleton.joints()[track.joint].name.as_str(), track.touches.as_slice())).unzip()
    }

    /// The weights of the morphs that the clip animates.
    pub(super) fn morphs(&self) -> &[MorphColumn<'a>] {
        &self.morphs
    }

    pub(super) fn meta(&self) -> &str {
        &self.meta
    }
}

/// One column per name: the meshes of one face have shapes of the same names, and the first stands for all.
fn morph_columns<'a>(target: &'a Scene, clip: &'a Clip) -> Vec<MorphColumn<'a>> {
    let mut columns: Vec<MorphColumn<'a>> = Vec::new();
    for track in clip.morphs() {
        let Some(morph) = target.morphs.get(track.morph) else { continue };
        // What an expression does to meshes is there as weights of their own.
        if matches!(&morph.place, MorphPlace::Expression(binds) if !binds.is_empty()) {
            continue;
        }
        if columns.iter().all(|column| column.name != morph.name) {
            columns.push(MorphColumn { name: &morph.name, rest: morph.rest, weights: &track.weights });
        }
    }
    columns
}

enum Value {
    Vector([f32; 3]),
    Rotation([f32; 4]),
}

fn values(value: Value) -> impl Iterator<Item = f32> + use<> {
    let (values, width) = match value {
        Value::Vector([x, y, z]) => ([x, y, z, 0.0], 3),
        Value::Rotation(values) => (values, 4),
    };
    values.into_iter().take(width)
}

/// What is a unit quaternion but for the rounding of single precision keeps its bits, so that reading and writing settle.
fn unit(rotation: DQuat) -> [f32; 4] {
    let is_unit = (rotation.length() - 1.0).abs() < 1e-5;
    let rotation = if is_unit { rotation } else { rotation.normalize() };
    rotation.as_quat().to_array()
}

/// Key times that were rounded to single precision give 29.999998; nobody means that.
fn tidy_rate(fps: f64) -> f64 {
    let whole = fps.round();
    if whole > 0.0 && (fps - whole).abs() < 1e-4 { whole } else { fps }
}
