//! `animations` to clips: one clip per animation, all channels on the union of the key times that drive nodes.

use std::{
    collections::{BTreeMap, BTreeSet},
    rc::Rc,
};

use glam::{Quat, Vec3};

use super::{
    accessor::{Accessors, Shape},
    curve::{self, Curve, Interpolation, Value},
    morphs::Morphs,
    nodes::{Graph, UNIT_TOLERANCE},
};
use crate::{
    formats::{Budget, FormatError, Limit, gltf::json::Cursor},
    model::{Clip, JointTracks, MorphTrack, Reporter, Track, rotation::next_to},
};

/// What is reported once per file, however often it is seen: code, what was done, what the user can do.
const NOTES: [(&str, &str, &str); 11] = [
    ("channel_without_node", "a channel has no target node and was left out", ""),
    ("weights_skipped", "morph weights of a node without morph targets were left out", ""),
    ("animation_pointer_skipped", "an animation pointer drives something else than a joint and is not retargeted", ""),
    ("unknown_path", "a channel drives a property that is not known and was left out", ""),
    ("duplicate_channel", "two channels drive one property of one node; the first was used", ""),
    ("animated_matrix_node", "a channel drives a node with a matrix, which was split for it", ""),
    ("key_bounds_missing", "an accessor of key times does not say its bounds, which glTF asks for", ""),
    ("equal_key_times", "two keys have one time; the later one was used", ""),
    ("negative_key_time", "keys lie before the time zero", "move the animation so that it starts at zero"),
    ("keyframe_rotation_not_unit", "a rotation is not of length 1 and was normalized", "normalize rotations on export"),
    ("keyframe_rotation_zero", "a rotation is zero; the one before it was held", "normalize rotations on export"),
];

/// A quaternion whose squared length is this close to one keeps its bits.
const UNIT_SQUARED_TOLERANCE: f64 = 1e-6;

/// Counts of what happened, with the first place of each.
#[derive(Debug, Default)]
struct Notes(BTreeMap<&'static str, (usize, String)>);

impl Notes {
    fn add(&mut self, code: &'static str, place: &Cursor<'_, '_>) {
        self.0.entry(code).or_insert_with(|| (0, place.to_string())).0 += 1;
    }

    fn report(self, reporter: &mut Reporter) {
        for (code, detail, hint) in NOTES {
            let Some((count, place)) = self.0.get(code) else { continue };
            let times = if *count == 1 { String::new() } else { format!(" ({count} times; this is the first)") };
            reporter.warn(code, place.clone(), format!("{detail}{times}"), hint);
        }
    }
}

/// The keys of one input accessor.
#[derive(Clone, Debug)]
struct KeyTimes {
    times: Rc<Vec<f32>>,
    /// How many keys the file has.
    count: usize,
    /// Which of them are used, where not all.
    kept: Option<Rc<Vec<usize>>>,
}

/// The channels of one joint.
#[derive(Debug, Default)]
struct JointCurves {
    translation: Option<Curve<Vec3>>,
    rotation: Option<Curve<Quat>>,
    scale: Option<Curve<Vec3>>,
    /// One per morph target of the node's mesh.
    weights: Vec<Curve<f32>>,
}

/// What reading an animation needs at hand.
struct Reader<'r, 'd, 'b> {
    accessors: &'r mut Accessors<'d>,
    graph: &'r Graph,
    morphs: &'r Morphs,
    budget: &'r mut Budget<'b>,
    notes: Notes,
    key_times: BTreeMap<usize, KeyTimes>,
    keys_added: usize,
}

/// Reads all animations; `properties` are the curves that lie in the extras of each, with the morphs that they are.
pub(super) fn read(
    accessors: &mut Accessors<'_>,
    graph: &Graph,
    morphs: &Morphs,
    properties: Vec<Vec<(usize, Curve<f32>)>>,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Vec<Clip>, FormatError> {
    let root = accessors.root();
    let Some(animations) = root.get("animations")? else { return Ok(Vec::new()) };
    budget.check(Limit::Clips, animations.length()? as u64, "/animations")?;
    let mut reader =
        Reader { accessors, graph, morphs, budget, notes: Notes::default(), key_times: BTreeMap::new(), keys_added: 0 };
    let mut clips = Vec::new();
    let mut properties = properties.into_iter();
    for animation in animations.elements()? {
        clips.push(reader.clip(&animation, properties.next().unwrap_or_default())?);
    }
    if reader.keys_added > 0 {
        let detail =
            format!("the file has curves or steps between keys; keys were added to keep them: {}", reader.keys_added);
        reporter.warn("keys_densified", "/animations", detail, "export the animation sampled, with linear keys");
    }
    reader.notes.report(reporter);
    Ok(clips)
}

impl Reader<'_, '_, '_> {
    fn clip(&mut self, animation: &Cursor<'_, '_>, properties: Vec<(usize, Curve<f32>)>) -> Result<Clip, FormatError> {
        let joints = self.graph.joints.len();
        let name = animation.get("name")?.map_or(Ok(""), |name| name.text())?.to_owned();
        let place = animation.to_string();
        self.budget.take_array(joints as u64, size_of::<JointTracks>() as u64, &place)?;
        let curves = self.channels(animation)?;

        let mut times = self.common_times(&curves, &properties, &place)?;
        if times.is_empty() {
            times.push(0.0);
        }
        self.budget.check(Limit::FramesPerClip, times.len() as u64, &place)?;
        self.budget.take(Limit::Samples, (times.len() as u64).saturating_mul(joints as u64), &place)?;
        let mut tracks = vec![JointTracks::default(); joints];
        let mut weights: Vec<MorphTrack> = Vec::new();
        for (joint, curves) in curves {
            self.budget.check_canceled()?;
            weights.extend(self.morph_tracks(joint, curves.weights, &times, &place)?);
            tracks[joint] = JointTracks {
                translation: self.track(curves.translation, &times, &place)?,
                rotation: self.rotation_track(curves.rotation, &times, &place)?,
                scale: self.track(curves.scale, &times, &place)?,
            };
        }
        weights.extend(self.morphs.of_translation.iter().filter_map(|(joint, morph)| {
            let clamped = |value: &Vec3| value.x.clamp(0.0, 1.0);
            let weights = match &tracks[*joint].translation {
                Track::Rest => return None,
                Track::Constant(value) => Track::Constant(clamped(value)),
                Track::Sampled(values) => Track::Sampled(values.iter().map(clamped).collect()),
            };
            Some(MorphTrack { morph: *morph, weights })
        }));
        for (morph, curve) in properties {
            self.budget.take(Limit::Samples, times.len() as u64, &place)?;
            self.budget.take_array(times.len() as u64, size_of::<f32>() as u64, &place)?;
            weights.push(MorphTrack { morph, weights: Track::Sampled(curve.sampled(&times)).compacted() });
        }
        let times = times.into_iter().map(f64::from).collect();
        Clip::new(name, times, tracks)
            .and_then(|clip| clip.with_morphs(weights))
            .map_err(|error| FormatError::malformed("animations", place, error.to_string()))
    }

    fn channels(&mut self, animation: &Cursor<'_, '_>) -> Result<BTreeMap<usize, JointCurves>, FormatError> {
        let mut curves: BTreeMap<usize, JointCurves> = BTreeMap::new();
        let Some(channels) = animation.get("channels")? else { return Ok(curves) };
        for channel in channels.elements()? {
            self.budget.check_canceled()?;
            let target = channel.require("target")?;
            let path = target.require("path")?.text()?;
            let samplers = animation.require("samplers")?;
            let sampler = samplers.element(channel.require("sampler")?.index(samplers.length()?, "samplers")?)?;
            if path == "pointer" {
                self.notes.add("animation_pointer_skipped", &target);
                continue;
            }
            let Some(node) = target.get("node")? else {
                self.notes.add("channel_without_node", &target);
                continue;
            };
            let joint = self.graph.joint(&node)?;
            let entry = curves.entry(joint).or_default();
            let is_taken = match path {
                "translation" => entry.translation.is_some(),
                "rotation" => entry.rotation.is_some(),
                "scale" => entry.scale.is_some(),
                "weights" if !self.morphs.of_joint.contains_key(&joint) => {
                    self.notes.add("weights_skipped", &target);
                    continue;
                }
                "weights" => !entry.weights.is_empty(),
                _ => {
                    self.notes.add("unknown_path", &target);
                    continue;
                }
            };
            if is_taken {
                self.notes.add("duplicate_channel", &target);
                continue;
            }
            if path == "weights" {
                entry.weights = self.weights(&sampler, joint)?;
                continue;
            }
            if self.graph.has_matrix[joint] {
                self.notes.add("animated_matrix_node", &target);
            }
            match path {
                "rotation" => entry.rotation = Some(self.rotations(&sampler)?),
                "translation" => entry.translation = Some(self.vectors(&sampler)?),
                _ => entry.scale = Some(self.vectors(&sampler)?),
            }
        }
        Ok(curves)
    }

    fn vectors(&mut self, sampler: &Cursor<'_, '_>) -> Result<Curve<Vec3>, FormatError> {
        self.curve(sampler, Shape::Vec3, |value: &Vec3| value.is_finite())
    }

    /// Key values become unit quaternions, each on the hemisphere of the one before where no tangent depends on it.
    fn rotations(&mut self, sampler: &Cursor<'_, '_>) -> Result<Curve<Quat>, FormatError> {
        let mut curve = self.curve(sampler, Shape::Vec4, |value: &Quat| value.is_finite())?;
        let is_cubic = curve.interpolation == Interpolation::Cubic;
        let output = sampler.require("output")?;
        let mut previous: Option<Quat> = None;
        for value in curve.key_values_mut() {
            let length = value.as_dquat().length();
            if length < f64::from(f32::MIN_POSITIVE) {
                self.notes.add("keyframe_rotation_zero", &output);
                *value = previous.unwrap_or(Quat::IDENTITY);
            } else if (length - 1.0).abs() > UNIT_TOLERANCE {
                self.notes.add("keyframe_rotation_not_unit", &output);
            }
            if !is_cubic {
                *value = tidied(*value, previous);
            }
            previous = Some(*value);
        }
        Ok(curve)
    }

    /// The weights of all morph targets of a node's mesh, which lie side by side at each key.
    fn weights(&mut self, sampler: &Cursor<'_, '_>, joint: usize) -> Result<Vec<Curve<f32>>, FormatError> {
        let count = self.morphs.of_joint.get(&joint).map_or(0, |(_, count)| *count);
        let all = self.curve_of(sampler, Shape::Scalar, count, |value: &f32| value.is_finite())?;
        let place = sampler.to_string();
        self.budget.take_array(all.values.len() as u64, size_of::<f32>() as u64, &place)?;
        let one = |morph: usize| Curve {
            times: Rc::clone(&all.times),
            values: all.values.iter().skip(morph).step_by(count).copied().collect(),
            interpolation: all.interpolation,
        };
        Ok((0..count).map(one).collect())
    }

    fn curve<T: Value>(
        &mut self,
        sampler: &Cursor<'_, '_>,
        shape: Shape,
        is_finite: impl Fn(&T) -> bool,
    ) -> Result<Curve<T>, FormatError> {
        self.curve_of(sampler, shape, 1, is_finite)
    }

    /// A curve with so many values side by side.
    fn curve_of<T: Value>(
        &mut self,
        sampler: &Cursor<'_, '_>,
        shape: Shape,
        width: usize,
        is_finite: impl Fn(&T) -> bool,
    ) -> Result<Curve<T>, FormatError> {
        let interpolation = match sampler.get("interpolation")? {
            None => Interpolation::Linear,
            Some(name) => match name.text()? {
                "LINEAR" => Interpolation::Linear,
                "STEP" => Interpolation::Step,
                "CUBICSPLINE" => Interpolation::Cubic,
                other => return Err(name.malformed(format!("'{other}' is not an interpolation"))),
            },
        };
        let keys = self.key_times(&sampler.require("input")?)?;
        let output = sampler.require("output")?;
        let accessor = self.accessors.accessor(&output)?;
        accessor.expect(shape, false, &output)?;
        let values_per_key = interpolation.values_per_key().saturating_mul(width);
        let wanted = keys.count.saturating_mul(values_per_key);
        if accessor.count != wanted {
            return Err(output.malformed(format!(
                "accessor {} has {} values where {} keys need {wanted}",
                accessor.index, accessor.count, keys.count
            )));
        }
        let mut values: Vec<T> = self.accessors.decode(&accessor, wanted, &output, self.budget)?;
        if let Some(at) = values.iter().position(|value| !is_finite(value)) {
            return Err(output.malformed(format!("value {at} of accessor {} is not finite", accessor.index)));
        }
        if let Some(kept) = keys.kept {
            let keys = kept.iter().flat_map(|key| &values[key * values_per_key..(key + 1) * values_per_key]);
            values = keys.copied().collect();
        }
        Ok(Curve { times: keys.times, values, interpolation })
    }

    fn key_times(&mut self, input: &Cursor<'_, '_>) -> Result<KeyTimes, FormatError> {
        let accessor = self.accessors.accessor(input)?;
        if let Some(keys) = self.key_times.get(&accessor.index) {
            return Ok(keys.clone());
        }
        accessor.expect(Shape::Scalar, true, input)?;
        self.budget.check(Limit::FramesPerClip, accessor.count as u64, &input.to_string())?;
        let mut times: Vec<f32> = self.accessors.decode(&accessor, accessor.count, input, self.budget)?;
        if let Some(at) = times.iter().position(|time| !time.is_finite()) {
            return Err(input.malformed(format!("key time {at} of accessor {} is not finite", accessor.index)));
        }
        if let Some(at) = times.windows(2).position(|pair| pair[1] < pair[0]) {
            let (before, after) = (times[at], times[at + 1]);
            let detail = format!("key times of accessor {} must rise, but {after} follows {before}", accessor.index);
            return Err(input.malformed(detail));
        }
        if times[0] < 0.0 {
            self.notes.add("negative_key_time", input);
        }
        if !accessor.has_bounds {
            self.notes.add("key_bounds_missing", input);
        }
        let count = times.len();
        let mut kept = None;
        if times.windows(2).any(|pair| pair[0] == pair[1]) {
            self.notes.add("equal_key_times", input);
            let is_last = |key: &usize| times.get(key + 1).is_none_or(|next| *next != times[*key]);
            let indices: Vec<usize> = (0..count).filter(is_last).collect();
            times = indices.iter().map(|key| times[*key]).collect();
            kept = Some(Rc::new(indices));
        }
        let keys = KeyTimes { times: Rc::new(times), count, kept };
        self.key_times.insert(accessor.index, keys.clone());
        Ok(keys)
    }

    /// The union of all key times, with more keys where the file has curves or steps.
    fn common_times(
        &mut self,
        curves: &BTreeMap<usize, JointCurves>,
        properties: &[(usize, Curve<f32>)],
        place: &str,
    ) -> Result<Vec<f32>, FormatError> {
        let most = self.budget.limits().frames_per_clip;
        let mut all: Vec<Rc<Vec<f32>>> = Vec::new();
        let mut seen = BTreeSet::new();
        let mut between = Vec::new();
        let mut add = |times: &Rc<Vec<f32>>, more: Result<Vec<f32>, u64>| -> Result<(), FormatError> {
            let more =
                more.or_else(|count| self.budget.check(Limit::FramesPerClip, count, place).map(|()| Vec::new()))?;
            between.extend(more);
            if seen.insert(Rc::as_ptr(times)) {
                self.budget.take_array(times.len() as u64, size_of::<f32>() as u64, place)?;
                all.push(Rc::clone(times));
            }
            // Many channels have the same times in between. Twice the limit, so that sorting pays off before the next time.
            if between.len() as u64 > most.saturating_mul(2) {
                between.sort_by(f32::total_cmp);
                between.dedup();
                self.budget.check(Limit::FramesPerClip, between.len() as u64, place)?;
            }
            self.budget.check_canceled().map_err(FormatError::from)
        };
        for (_, curve) in properties {
            add(&curve.times, curve.times_between_keys(most))?;
        }
        for joint in curves.values() {
            for curve in [&joint.translation, &joint.scale].into_iter().flatten() {
                add(&curve.times, curve.times_between_keys(most))?;
            }
            for curve in &joint.weights {
                add(&curve.times, curve.times_between_keys(most))?;
            }
            if let Some(curve) = &joint.rotation {
                add(&curve.times, curve.times_between_keys(most))?;
            }
        }
        let own = if between.is_empty() { 0 } else { curve::union(&all, Vec::new()).len() };
        let times = curve::union(&all, between);
        self.keys_added += if own == 0 { 0 } else { times.len() - own };
        Ok(times)
    }

    fn track(&mut self, curve: Option<Curve<Vec3>>, times: &[f32], place: &str) -> Result<Track<Vec3>, FormatError> {
        let Some(curve) = curve else { return Ok(Track::Rest) };
        self.budget.take(Limit::DecodedBytes, curve.bytes_at(times), place)?;
        Ok(Track::Sampled(curve.sampled(times)).compacted())
    }

    fn morph_tracks(
        &mut self,
        joint: usize,
        curves: Vec<Curve<f32>>,
        times: &[f32],
        place: &str,
    ) -> Result<Vec<MorphTrack>, FormatError> {
        let first = self.morphs.of_joint.get(&joint).map_or(0, |(first, _)| *first);
        self.budget.take(Limit::Samples, (times.len() as u64).saturating_mul(curves.len() as u64), place)?;
        let bytes: u64 = curves.iter().map(|curve| curve.bytes_at(times)).sum();
        self.budget.take(Limit::DecodedBytes, bytes, place)?;
        let track = |(index, curve): (usize, Curve<f32>)| MorphTrack {
            morph: first + index,
            weights: Track::Sampled(curve.sampled(times)).compacted(),
        };
        Ok(curves.into_iter().enumerate().map(track).collect())
    }

    fn rotation_track(
        &mut self,
        curve: Option<Curve<Quat>>,
        times: &[f32],
        place: &str,
    ) -> Result<Track<Quat>, FormatError> {
        let Some(curve) = curve else { return Ok(Track::Rest) };
        self.budget.take(Limit::DecodedBytes, curve.bytes_at(times), place)?;
        let mut rotations = curve.sampled(times);
        let mut previous = None;
        for rotation in &mut rotations {
            *rotation = tidied(*rotation, previous);
            previous = Some(*rotation);
        }
        Ok(Track::Sampled(rotations).compacted())
    }
}

/// A unit quaternion on the hemisphere of the one before it. What is one already keeps its bits.
fn tidied(rotation: Quat, previous: Option<Quat>) -> Quat {
    let precise = rotation.as_dquat();
    let is_unit = (precise.length_squared() - 1.0).abs() <= UNIT_SQUARED_TOLERANCE;
    let rotation = if is_unit { rotation } else { precise.normalize().as_quat() };
    next_to(rotation, previous)
}
