//! A clip to an animation, its accessors and one buffer view.

use std::{borrow::Cow, collections::BTreeMap};

use glam::Quat;
use serde_json::{Map, Value};

use super::{
    Output,
    carried::Carried,
    schema::{
        Animation, AnimationExtras, AnimationSampler, Channel, ChannelTarget, Interpolation, PropertyCurves, Shape,
    },
    streams::{Kind, Streams},
    to_value,
};
use crate::{
    formats::{Compression, FormatError},
    model::{Clip, Control, Joint, KeyCurve, MorphPlace, MorphTrack, Reporter, Scene, Track},
};

/// A channel of a node: its name, the shape of its values, and what they are.
#[derive(Clone, Copy)]
struct NodePath {
    name: &'static str,
    shape: Shape,
    kind: Kind,
}

const TRANSLATION: NodePath = NodePath { name: "translation", shape: Shape::Vec3, kind: Kind::Vectors };
const ROTATION: NodePath = NodePath { name: "rotation", shape: Shape::Vec4, kind: Kind::Rotations };
const SCALE: NodePath = NodePath { name: "scale", shape: Shape::Vec3, kind: Kind::Vectors };

/// Adds the clip's data to the document and returns the animation that refers to it; nothing where the target has no node
/// that could be animated. `node_of` gives the node of a joint, by its index and itself; `morph_nodes` are those with morph
/// targets that the document has.
///
/// All tracks lie in one buffer view, unless they are compressed. Tracks with a value per frame share one time accessor. Constant tracks have one key,
/// or two where nothing else makes the animation as long as the clip.
pub(super) fn append<'a>(
    output: &mut Output<'a>,
    target: &Scene,
    clip: &'a Clip,
    node_of: impl Fn(usize, &Joint) -> usize,
    morph_nodes: &[MorphNode],
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Option<Value>, FormatError> {
    if target.skeleton.is_empty() {
        reporter.warn("clip_left_out", "", "the target has no node, so there is nothing to animate", "");
        return Ok(None);
    }
    let times = key_times(clip.times_seconds(), reporter);
    let morphs = morph_weights(clip, morph_nodes);
    let is_sampled = !morphs.is_empty()
        || clip.joints().iter().any(|tracks| {
            [tracks.translation.sample_count(), tracks.rotation.sample_count(), tracks.scale.sample_count()]
                .iter()
                .any(Option::is_some)
        });
    let constant_times = match times.as_slice() {
        [first, .., last] if !is_sampled => vec![*first, *last],
        [first, ..] => vec![*first],
        [] => Vec::new(),
    };
    let is_sparse = clip.sparse_keys().is_some();
    let is_rounded = output.compression != Compression::None;
    let mut carried = is_rounded.then(|| Carried::new(&target.skeleton, clip.times_seconds()));
    let mut writer = Writer::new(Streams::new(output)?, is_sampled.then_some(times), is_sparse, constant_times)?;
    for (index, (joint, tracks)) in target.skeleton.joints().iter().zip(clip.joints()).enumerate() {
        control.check()?;
        let node = node_of(index, joint);
        let keys = clip.sparse_keys().and_then(|keys| keys.joints.get(index));
        writer.track(&tracks.translation, keys.map(|keys| &keys.translation), node, TRANSLATION)?;
        let rotation_keys = keys.map(|keys| &keys.rotation);
        match &mut carried {
            None => writer.track(&tracks.rotation, rotation_keys, node, ROTATION)?,
            Some(carried) => {
                let rest = joint.rest.rotation.as_quat();
                writer.rounded_rotation(index, rest, &tracks.rotation, rotation_keys, node, carried)?;
            }
        }
        writer.track(&tracks.scale, keys.map(|keys| &keys.scale), node, SCALE)?;
    }
    for (node, weights) in morphs {
        writer.weights(node, weights)?;
    }
    if writer.channels.is_empty() {
        let joint = &target.skeleton.joints()[0];
        let detail = "the clip animates nothing; it was written as the first node standing still, for its length";
        reporter.warn("clip_without_channels", clip.name(), detail, "");
        writer.constant(joint.rest.translation.as_vec3(), node_of(0, joint), TRANSLATION)?;
    }
    let (channels, samplers) = writer.finish()?;
    let extras = properties(target, clip)?.map(|curves| AnimationExtras { curves });
    to_value(&Animation { name: clip.name(), channels, samplers, extras }).map(Some)
}

/// Custom properties, which glTF has no channels for: key times and the values of each; nothing where there is none.
fn properties<'a>(target: &Scene, clip: &'a Clip) -> Result<Option<PropertyCurves<'a>>, FormatError> {
    let mut values = Map::new();
    for track in clip.morphs() {
        let Some(property) = target.morphs.get(track.morph).filter(|morph| morph.is_property()) else { continue };
        let of_frames: Vec<f32> = (0..clip.frame_count()).map(|frame| track.weights.at(frame, property.rest)).collect();
        values.insert(property.name.clone(), to_value(&of_frames)?);
    }
    Ok((!values.is_empty()).then(|| PropertyCurves { times_seconds: clip.times_seconds(), values }))
}

/// A node whose mesh has morph targets.
#[derive(Debug)]
pub(super) struct MorphNode {
    /// In the document that is written.
    pub(super) node: usize,
    /// Which of the scene's morphs each target is.
    pub(super) morphs: Vec<Option<usize>>,
    /// Their weights where nothing animates them.
    pub(super) rest: Vec<f32>,
}

/// The nodes with morph targets of a target that came from glTF.
pub(super) fn morph_nodes(target: &Scene) -> Vec<MorphNode> {
    let mut nodes: Vec<MorphNode> = Vec::new();
    for (morph, of_target) in target.morphs.iter().enumerate() {
        let MorphPlace::Mesh { node, index, .. } = of_target.place else { continue };
        if index == 0 {
            nodes.push(MorphNode { node, morphs: Vec::new(), rest: Vec::new() });
        }
        if let Some(node) = nodes.last_mut() {
            node.morphs.push(Some(morph));
            node.rest.push(of_target.rest);
        }
    }
    nodes
}

/// For each node of which a morph is animated the weights of all its morph targets, side by side at each frame.
fn morph_weights(clip: &Clip, nodes: &[MorphNode]) -> Vec<(usize, Vec<f32>)> {
    let of_morph: BTreeMap<usize, &MorphTrack> = clip.morphs().iter().map(|track| (track.morph, track)).collect();
    let mut all = Vec::new();
    for MorphNode { node, morphs, rest } in nodes {
        let track = |morph: &Option<usize>| morph.and_then(|morph| of_morph.get(&morph).copied());
        let tracks: Vec<Option<&MorphTrack>> = morphs.iter().map(track).collect();
        if tracks.iter().all(Option::is_none) {
            continue;
        }
        let mut weights = Vec::with_capacity(tracks.len() * clip.frame_count());
        for frame in 0..clip.frame_count() {
            let at = |track: &Option<&MorphTrack>, rest: f32| track.map_or(rest, |track| track.weights.at(frame, rest));
            weights.extend(tracks.iter().zip(rest).map(|(track, rest)| at(track, *rest)));
        }
        all.push((*node, weights));
    }
    all
}

struct Writer<'o, 'a> {
    streams: Streams<'o, 'a>,
    sampled_input: Option<usize>,
    /// Times of all frames, where there is a sampled track and tracks need some of them only.
    times: Vec<f32>,
    /// Accessors of times for tracks that need some frames only.
    sparse_inputs: BTreeMap<Vec<usize>, usize>,
    constant_input: usize,
    constant_keys: usize,
    channels: Vec<Channel>,
    samplers: Vec<AnimationSampler>,
}

impl<'o, 'a> Writer<'o, 'a> {
    fn new(
        mut streams: Streams<'o, 'a>,
        times: Option<Vec<f32>>,
        is_sparse: bool,
        constant_times: Vec<f32>,
    ) -> Result<Self, FormatError> {
        let (times, sampled_input) = match times {
            Some(times) if is_sparse => (times, None),
            Some(times) => (Vec::new(), Some(streams.add_times(times)?)),
            None => (Vec::new(), None),
        };
        let constant_keys = constant_times.len();
        let constant_input = streams.add_times(constant_times)?;
        Ok(Self {
            streams,
            sampled_input,
            times,
            sparse_inputs: BTreeMap::new(),
            constant_input,
            constant_keys,
            channels: Vec::new(),
            samplers: Vec::new(),
        })
    }

    fn track<T: bytemuck::Pod>(
        &mut self,
        track: &'a Track<T>,
        keys: Option<&KeyCurve<T>>,
        node: usize,
        path: NodePath,
    ) -> Result<(), FormatError> {
        match (track, self.sampled_input) {
            (Track::Constant(value), _) => self.constant(*value, node, path),
            (Track::Sampled(values), None) if !self.times.is_empty() => {
                let Some(keys) = keys.filter(|keys| !keys.frames.is_empty()) else {
                    let output = self.streams.add(Cow::Borrowed(values), path.shape, path.kind)?;
                    let input = self.sparse_input((0..values.len()).collect())?;
                    self.channel(input, output, node, path.name, Interpolation::Linear);
                    return Ok(());
                };
                let (numbers, kind, interpolation) = if keys.is_cubic() {
                    let key = |(value, [before, after]): (&T, &[T; 2])| [*before, *value, *after];
                    (
                        keys.values.iter().zip(&keys.tangents).flat_map(key).collect(),
                        Kind::Exact,
                        Interpolation::CubicSpline,
                    )
                } else {
                    (keys.values.clone(), path.kind, Interpolation::Linear)
                };
                let output = self.streams.add(Cow::Owned(numbers), path.shape, kind)?;
                let input = self.sparse_input(keys.frames.clone())?;
                self.channel(input, output, node, path.name, interpolation);
                Ok(())
            }
            (Track::Sampled(values), Some(input)) => {
                let output = self.streams.add(Cow::Borrowed(values), path.shape, path.kind)?;
                self.channel(input, output, node, path.name, Interpolation::Linear);
                Ok(())
            }
            // Where there is a sampled track, there is an input for it.
            (Track::Rest, _) | (Track::Sampled(_), None) => Ok(()),
        }
    }

    /// A track of rotations in few bits, of a joint whose parent has been written.
    fn rounded_rotation(
        &mut self,
        joint: usize,
        rest: Quat,
        track: &'a Track<Quat>,
        keys: Option<&KeyCurve<Quat>>,
        node: usize,
        carried: &mut Carried,
    ) -> Result<(), FormatError> {
        let keys = keys.filter(|keys| !keys.frames.is_empty());
        let Track::Sampled(values) = track else {
            carried.exact(joint, rest, track);
            return self.track(track, keys, node, NodePath { kind: Kind::Exact, ..ROTATION });
        };
        let Some(keys) = keys else {
            let wanted = carried.wanted(joint, 0..values.len(), values);
            carried.rounded(joint, values, self.streams.as_read(&wanted).into_iter());
            let input = self.input_of_all_frames()?;
            let output = self.streams.add(Cow::Owned(wanted), ROTATION.shape, ROTATION.kind)?;
            self.channel(input, output, node, ROTATION.name, Interpolation::Linear);
            return Ok(());
        };
        if keys.is_cubic() {
            carried.exact(joint, rest, track);
            return self.track(track, Some(keys), node, ROTATION);
        }
        let wanted = carried.wanted(joint, keys.frames.iter().copied(), &keys.values);
        let written: Vec<Quat> = carried.between(keys, &self.streams.as_read(&wanted)).collect();
        carried.rounded(joint, values, written.into_iter());
        let output = self.streams.add(Cow::Owned(wanted), ROTATION.shape, ROTATION.kind)?;
        let input = self.sparse_input(keys.frames.clone())?;
        self.channel(input, output, node, ROTATION.name, Interpolation::Linear);
        Ok(())
    }

    /// The accessor of the times of all frames.
    fn input_of_all_frames(&mut self) -> Result<usize, FormatError> {
        match self.sampled_input {
            Some(input) => Ok(input),
            None => self.sparse_input((0..self.times.len()).collect()),
        }
    }

    /// The accessor of the times of these frames; the same for all tracks that need the same ones.
    fn sparse_input(&mut self, keys: Vec<usize>) -> Result<usize, FormatError> {
        if let Some(input) = self.sparse_inputs.get(&keys) {
            return Ok(*input);
        }
        let times = keys.iter().map(|frame| self.times[*frame]).collect();
        let input = self.streams.add_times(times)?;
        self.sparse_inputs.insert(keys, input);
        Ok(input)
    }

    /// The weights of all morph targets of a node, at all frames.
    fn weights(&mut self, node: usize, weights: Vec<f32>) -> Result<(), FormatError> {
        let output = self.streams.add(Cow::Owned(weights), Shape::Scalar, Kind::Scalars)?;
        let input = self.input_of_all_frames()?;
        self.channel(input, output, node, "weights", Interpolation::Linear);
        Ok(())
    }

    fn constant<T: bytemuck::Pod>(&mut self, value: T, node: usize, path: NodePath) -> Result<(), FormatError> {
        let output = self.streams.add(Cow::Owned(vec![value; self.constant_keys]), path.shape, path.kind)?;
        self.channel(self.constant_input, output, node, path.name, Interpolation::Linear);
        Ok(())
    }

    fn channel(&mut self, input: usize, output: usize, node: usize, path: &'static str, interpolation: Interpolation) {
        self.channels.push(Channel { sampler: self.samplers.len(), target: ChannelTarget { node, path } });
        self.samplers.push(AnimationSampler { input, interpolation, output });
    }

    fn finish(self) -> Result<(Vec<Channel>, Vec<AnimationSampler>), FormatError> {
        self.streams.finish()?;
        Ok((self.channels, self.samplers))
    }
}

/// Times as f32, not negative and strictly rising, as the specification asks.
fn key_times(times_seconds: &[f64], reporter: &mut Reporter) -> Vec<f32> {
    let shift = times_seconds.first().map_or(0.0, |first| (-first).max(0.0));
    if shift > 0.0 {
        let detail = format!("the clip begins {shift} s before zero, which glTF does not allow; it was moved to zero");
        reporter.warn("times_shifted", "", detail, "");
    }
    let mut times: Vec<f32> = Vec::with_capacity(times_seconds.len());
    let mut nudged = 0_usize;
    for seconds in times_seconds {
        let mut time = (seconds + shift) as f32;
        if let Some(previous) = times.last().filter(|previous| time <= **previous) {
            time = previous.next_up();
            nudged += 1;
        }
        times.push(time);
    }
    if nudged > 0 {
        let detail = format!("{nudged} key times are equal in single precision; each was moved to the next larger one");
        reporter.warn("times_nudged", "", detail, "use fewer frames, or a clip that begins near zero");
    }
    times
}
