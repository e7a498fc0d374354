//! Forward kinematics by matrices, and what tests measure with them.

use std::{collections::BTreeMap, path::Path};

use glam::{DMat4, DQuat, DVec3, Vec3};
use retargetd::{
    engine::{Inspection, NamedBytes, OneOrMore, inspect},
    formats::{self, Limits},
    model::{Clip, Control, JointTracks, Reporter, Scene, Skeleton, Track},
    retarget::{
        ContactTrack, Measures, Metric, MetricName, Resolved, RetargetSpec, Stack, StackResult, measure, resolve,
    },
    rig::{Rig, RigSpec},
};

use crate::support::corpus_file;

/// The matrices of all joints in the scene's space at a frame, or at rest.
pub(crate) fn world(skeleton: &Skeleton, clip: Option<(&Clip, usize)>) -> Vec<DMat4> {
    let mut world: Vec<DMat4> = Vec::with_capacity(skeleton.len());
    for (index, joint) in skeleton.joints().iter().enumerate() {
        let rest = joint.rest;
        let (mut translation, mut rotation, mut scale) = (rest.translation, rest.rotation, rest.scale);
        if let Some((clip, frame)) = clip {
            let tracks = &clip.joints()[index];
            if tracks.translation.is_animated() {
                translation = tracks.translation.at(frame, glam::Vec3::ZERO).as_dvec3();
            }
            if tracks.rotation.is_animated() {
                rotation = tracks.rotation.at(frame, glam::Quat::IDENTITY).as_dquat().normalize();
            }
            if tracks.scale.is_animated() {
                scale = tracks.scale.at(frame, glam::Vec3::ONE).as_dvec3();
            }
        }
        let local = DMat4::from_scale_rotation_translation(scale, rotation, translation);
        world.push(joint.parent.map_or(local, |parent| world[parent] * local));
    }
    world
}

/// Where a joint is.
pub(crate) fn position(world: &[DMat4], joint: usize) -> DVec3 {
    world[joint].w_axis.truncate()
}

/// How a joint is turned.
pub(crate) fn rotation(world: &[DMat4], joint: usize) -> DQuat {
    world[joint].to_scale_rotation_translation().1
}

/// How all joints are turned at a frame, by rotations alone: where bones stretch, matrices shear, and a sheared matrix has no
/// one rotation.
pub(crate) fn rotations(skeleton: &Skeleton, clip: &Clip, frame: usize) -> Vec<DQuat> {
    let mut rotations: Vec<DQuat> = Vec::with_capacity(skeleton.len());
    for (joint, tracks) in skeleton.joints().iter().zip(clip.joints()) {
        let own = match tracks.rotation.is_animated() {
            true => tracks.rotation.at(frame, glam::Quat::IDENTITY).as_dquat(),
            false => joint.rest.rotation,
        };
        let own = own.normalize();
        rotations.push(joint.parent.map_or(own, |parent| rotations[parent] * own));
    }
    rotations
}

/// The angle between two rotations, exact for small ones too, where an arc cosine is not.
pub(crate) fn degrees_between(first: DQuat, second: DQuat) -> f64 {
    let turn = first.conjugate() * second;
    2.0 * turn.xyz().length().atan2(turn.w.abs()).to_degrees()
}

/// The frames that a test looks at: all of a short clip, evenly spread ones of a long one, the last always.
pub(crate) fn frames_of(clip: &Clip, most: usize) -> Vec<usize> {
    let last = clip.frame_count() - 1;
    let step = clip.frame_count().div_ceil(most).max(1);
    let mut frames: Vec<usize> = (0..clip.frame_count()).step_by(step).collect();
    if frames.last() != Some(&last) {
        frames.push(last);
    }
    frames
}

/// The value below which a share of all values lies.
pub(crate) fn percentile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let index = (values.len() as f64 * share).ceil().max(1.0) - 1.0;
    values.get(index as usize).copied().unwrap_or(f64::NAN)
}

/// The first clip of one rig on another one, with no config.
pub(crate) fn moved(from: &Rig<'_>, onto: &Rig<'_>) -> StackResult {
    moved_with(from, onto, &RetargetSpec::default())
}

/// The same with a config.
pub(crate) fn moved_with(from: &Rig<'_>, onto: &Rig<'_>, spec: &RetargetSpec) -> StackResult {
    let clip = &from.scene.clips[0];
    let Resolved { mapping, ops, .. } = resolve(spec, from, onto, clip, &mut Reporter::new()).expect("it resolves");
    let stack = Stack::new(from.skeleton(), onto.skeleton(), &mapping, &ops);
    stack.run(clip, &Control::new()).expect("it runs")
}

/// What the report says of a result of [`moved`], or of [`moved_with`] where the config leaves the rigs alone.
pub(crate) fn measured(from: &Rig<'_>, onto: &Rig<'_>, result: &StackResult) -> Measures {
    let (clip, spec) = (&from.scene.clips[0], RetargetSpec::default());
    let resolved = resolve(&spec, from, onto, clip, &mut Reporter::new()).expect("it resolves");
    measure(&resolved.mapping, from, onto, clip, &result.clip, &spec.report, &result.reaches)
}

/// What the report says of a file of the corpus onto another one, with no config; nothing where one of them is not there.
pub(crate) fn measured_in_corpus(files: [&str; 2]) -> Option<Measures> {
    let [source, target] = Figure::of_corpus(files)?;
    let (from, onto) = (rig_of("source", &source.scene), rig_of("target", &target.scene));
    Some(measured(&from, &onto, &moved(&from, &onto)))
}

/// What a metric that is measured says.
pub(crate) fn value(measures: &Measures, name: MetricName) -> f64 {
    let Metric { value, reason, .. } = &measures.metrics[&name];
    value.unwrap_or_else(|| panic!("{name:?} is not measured: {reason:?}"))
}

/// The share of frames in which both say the same of every point.
pub(crate) fn agreement(one: &[ContactTrack], other: &[ContactTrack]) -> f64 {
    let pairs: Vec<(bool, bool)> = one
        .iter()
        .zip(other)
        .flat_map(|(one, other)| {
            assert_eq!(one.point, other.point);
            one.touches.iter().copied().zip(other.touches.iter().copied())
        })
        .collect();
    pairs.iter().filter(|(one, other)| one == other).count() as f64 / pairs.len() as f64
}

/// A scene with one clip, its first, in which every joint that hangs from nothing is moved by so much at a time in seconds.
pub(crate) fn with_roots_moved(scene: &Scene, by: impl Fn(f64) -> Vec3) -> Scene {
    let clip = &scene.clips[0];
    let mut joints = clip.joints().to_vec();
    for (joint, tracks) in scene.skeleton.joints().iter().zip(&mut joints) {
        if joint.parent.is_none()
            && let Track::Sampled(places) = &mut tracks.translation
        {
            places.iter_mut().zip(clip.times_seconds()).for_each(|(place, time)| *place += by(*time));
        }
    }
    with_tracks(scene, joints)
}

/// The scene with its first clip alone, in which joints have these tracks.
pub(crate) fn with_tracks(scene: &Scene, tracks: Vec<JointTracks>) -> Scene {
    let clip = scene.clips[0].clone().with_joints(tracks).expect("a clip");
    Scene { clips: vec![clip], ..scene.clone() }
}

/// The scene with one of its clips alone.
pub(crate) fn with_clip(scene: Scene, name: &str) -> Scene {
    let clip = scene.clips.iter().find(|clip| clip.name() == name).expect("a clip of that name").clone();
    Scene { clips: vec![clip], ..scene }
}

/// The rig that a scene is without a config.
pub(crate) fn rig_of<'a>(side: &'static str, scene: &'a Scene) -> Rig<'a> {
    Rig::new(side, scene, None, &RigSpec::default(), &mut Reporter::new()).expect("a rig")
}

/// A file as a test needs it.
pub(crate) struct Figure {
    pub(crate) bytes: Vec<u8>,
    pub(crate) file_name: String,
    pub(crate) scene: Scene,
    pub(crate) inspection: Inspection,
    pub(crate) roles: BTreeMap<String, usize>,
}

impl Figure {
    pub(crate) fn read(path: &Path) -> Self {
        let file_name = path.file_name().expect("a file").to_string_lossy().into_owned();
        Self::from_bytes(std::fs::read(path).expect("readable"), file_name)
    }

    /// Files of the corpus; nothing where one of them is not there.
    pub(crate) fn of_corpus<const COUNT: usize>(files: [&str; COUNT]) -> Option<[Self; COUNT]> {
        let paths = files.map(corpus_file);
        paths.iter().all(Option::is_some).then(|| paths.map(|path| Self::read(&path.expect("it is there"))))
    }

    pub(crate) fn from_bytes(bytes: Vec<u8>, file_name: String) -> Self {
        let scene = read_scene(&bytes, &file_name);
        let file = NamedBytes { name: &file_name, bytes: &bytes };
        let inspection = inspect(file, &Limits::default(), &Control::new()).expect("a file that can be read");
        let mut roles = BTreeMap::new();
        for (role, joints) in inspection.rigs.iter().flat_map(|rig| &rig.roles.0) {
            let first = match joints {
                OneOrMore::One(name) => Some(name),
                OneOrMore::More(names) => names.first(),
            };
            let joint = |name: &String| (0..scene.skeleton.len()).find(|&joint| scene.skeleton.label(joint) == *name);
            if let Some(joint) = first.and_then(joint) {
                roles.insert(role.clone(), joint);
            }
        }
        Self { bytes, file_name, scene, inspection, roles }
    }

    pub(crate) fn named_bytes(&self) -> NamedBytes<'_> {
        NamedBytes { name: &self.file_name, bytes: &self.bytes }
    }

    pub(crate) fn skeleton(&self) -> &Skeleton {
        &self.scene.skeleton
    }

    /// The clip that a retarget takes when nobody names one.
    pub(crate) fn clip(&self) -> &Clip {
        self.scene.clips.iter().find(|clip| clip.is_animated()).expect("an animation")
    }

    /// `T`, `A`, `arms_down` or `other`.
    pub(crate) fn rest_kind(&self) -> &'static str {
        self.inspection.rigs.first().map_or("other", |rig| rig.rest_pose)
    }
}

pub(crate) fn read_scene(bytes: &[u8], file_name: &str) -> Scene {
    let format = formats::sniff(bytes, file_name).expect("a known format");
    formats::read(bytes, format, &Limits::default(), &Control::new(), &mut Reporter::new()).expect("readable")
}
