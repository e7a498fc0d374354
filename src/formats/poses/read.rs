//! From arrays to a scene: what the keys mean, and the rules that they keep.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::{
    formats::{Budget, FormatError, Limit},
    model::{Axes, Clip, Joint, JointTracks, Reporter, Scene, Skeleton, Track, Transform, rotation::next_to},
};

use super::{
    arrays::{Arrays, Meta, NumberArray, invalid, missing, require_shape},
    read_beside::{morphs, with_contacts, with_morph_weights},
};

/// A quaternion whose length is off by more than this was no rounded unit quaternion.
const LENGTH_SLACK: f64 = 1e-3;
/// A quaternion that is a unit one but for the rounding of a chain of single precision products keeps its bits: written
/// back it is the same, and the figures of tools that compute in single precision are met.
const ROUNDING: f64 = 1e-5;
/// A quaternion shorter than this has no direction.
const SHORTEST: f64 = 1e-9;

/// Understands the arrays.
pub(super) fn scene(
    mut arrays: Arrays,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Scene, FormatError> {
    let meta = std::mem::take(&mut arrays.meta);
    let axes = axes(&meta)?;
    let unit_meters = unit_meters(&meta)?;
    warn_of_ignored(&arrays.ignored, reporter);
    let skeleton = skeleton(&mut arrays, budget, reporter)?;
    let morphs = morphs(&mut arrays, budget)?;
    let clip = clip(&mut arrays, meta, &skeleton, morphs.len(), budget, reporter)?;
    Ok(Scene {
        skeleton,
        morphs,
        clips: clip.into_iter().collect(),
        axes: Some(axes),
        unit_meters: Some(unit_meters),
        ..Scene::default()
    })
}

fn axes(meta: &Meta) -> Result<Axes, FormatError> {
    meta.axes
        .as_deref()
        .map_or(Ok(Axes::default()), str::parse)
        .map_err(|error| invalid("meta.axes", error.to_string()))
}

fn unit_meters(meta: &Meta) -> Result<f64, FormatError> {
    let unit = meta.unit.unwrap_or(1.0);
    if unit.is_finite() && unit > 0.0 {
        return Ok(unit);
    }
    Err(invalid("meta.unit", format!("{unit} is not a length in meters; it must be greater than zero")))
}

fn warn_of_ignored(ignored: &[String], reporter: &mut Reporter) {
    if ignored.is_empty() {
        return;
    }
    let shown: Vec<&str> = ignored.iter().take(12).map(String::as_str).collect();
    let more = ignored.len() - shown.len();
    let more = if more == 0 { String::new() } else { format!(" and {more} more") };
    reporter.warn(
        "poses_keys_ignored",
        "",
        format!("these keys are not used: {}{more}", shown.join(", ")),
        "joints and their transforms, contacts and morphs are read; the crate's docs name the keys",
    );
}

fn skeleton(arrays: &mut Arrays, budget: &mut Budget<'_>, reporter: &mut Reporter) -> Result<Skeleton, FormatError> {
    let Some(names) = arrays.names.remove("joint_names") else { return Err(no_joint_names(arrays)) };
    let count = names.len();
    if count == 0 {
        return Err(invalid("joint_names", "there is no joint"));
    }
    budget.take(Limit::Nodes, count as u64, "joint_names")?;
    budget.take_array(count as u64, size_of::<Joint>() as u64, "joint_names")?;
    warn_of_names(&names, reporter);

    let parents = arrays.numbers.remove("parents").ok_or_else(|| missing("parents"))?;
    require_shape(&parents, "parents", &[("J", Some(count))])?;
    let parents = parent_indices(&parents, budget)?;

    let translations = arrays.numbers.remove("rest_translations").ok_or_else(|| missing("rest_translations"))?;
    require_rest(&translations, "rest_translations", count, 3)?;
    let rotations = arrays.numbers.remove("rest_rotations");
    if let Some(rotations) = &rotations {
        require_rest(rotations, "rest_rotations", count, 4)?;
    }
    let scales = arrays.numbers.remove("rest_scales");
    if let Some(scales) = &scales {
        require_rest(scales, "rest_scales", count, 3)?;
    }

    let mut lengths = LengthCheck::new("rest_rotations");
    let mut joints = Vec::with_capacity(count);
    for (index, (name, parent)) in names.into_iter().zip(parents).enumerate() {
        let rotation = match &rotations {
            Some(rotations) => lengths.unit(rotations, index)?,
            None => DQuat::IDENTITY,
        };
        let rest = Transform {
            translation: DVec3::from_array(translations.row(index)),
            rotation,
            scale: scales.as_ref().map_or(DVec3::ONE, |scales| DVec3::from_array(scales.row(index))),
        };
        joints.push(Joint { name, parent, rest, is_joint: true, node: index });
    }
    lengths.warn(reporter);
    Skeleton::new(joints).map_err(|error| invalid("parents", error.to_string()))
}

/// Why there is no skeleton: pose arrays without names, or a file of some other layout.
fn no_joint_names(arrays: &Arrays) -> FormatError {
    const SHOWN: usize = 12;
    if let Some(known) = arrays.numbers.keys().next() {
        let keys: Vec<&str> = arrays.numbers.keys().copied().collect();
        let detail =
            format!("the file has {} of the pose arrays, but the key 'joint_names' is missing", keys.join(", "));
        return invalid("joint_names", detail).with_hint(format!("add one name for each joint of '{known}'"));
    }
    let mut shown: Vec<&str> = arrays.ignored.iter().take(SHOWN).map(String::as_str).collect();
    if arrays.ignored.len() > SHOWN {
        shown.push("…");
    }
    let detail = match shown.as_slice() {
        [] => "the file holds no array".to_owned(),
        keys => format!("no layout of arrays that can be read has these keys: {}", keys.join(", ")),
    };
    invalid("keys", detail).with_hint(
        "send pose arrays (joint_names, parents, rest_translations, rotations, …), or the parameters of a body model (poses or \
         global_orient and body_pose, trans)",
    )
}

fn warn_of_names(names: &[String], reporter: &mut Reporter) {
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    for (index, name) in names.iter().enumerate() {
        if name.is_empty() {
            reporter.warn(
                "joint_name_empty",
                format!("joint_names[{index}]"),
                "the joint has no name; it is called by its index",
                "give every joint a name",
            );
        } else if let Some(first) = seen.get(name.as_str()) {
            reporter.warn(
                "joint_name_not_unique",
                format!("joint_names[{index}]"),
                format!("'{name}' is the name of joint {first} already; both are called by their index"),
                "give every joint a name of its own",
            );
        } else {
            seen.insert(name, index);
        }
    }
}

fn parent_indices(parents: &NumberArray, budget: &Budget<'_>) -> Result<Vec<Option<usize>>, FormatError> {
    let count = parents.shape[0];
    let mut indices = Vec::with_capacity(count);
    let mut depths: Vec<u64> = Vec::with_capacity(count);
    for joint in 0..count {
        let value = parents.value(joint);
        let place = || format!("parents[{joint}]");
        let parent = if value == -1.0 {
            None
        } else if value >= 0.0 && value < joint as f64 && value.fract() == 0.0 {
            Some(value as usize)
        } else if value >= 0.0 && value < count as f64 && value.fract() == 0.0 {
            let detail = format!("the parent {value} does not come before its child {joint}");
            return Err(invalid(place(), detail).with_hint("sort the joints so that parents come before children"));
        } else {
            let detail = format!("{value} is neither -1 nor the index of one of the {count} joints");
            return Err(invalid(place(), detail));
        };
        let depth = parent.map_or(1, |parent| depths[parent] + 1);
        budget.check(Limit::HierarchyDepth, depth, &place())?;
        depths.push(depth);
        indices.push(parent);
    }
    Ok(indices)
}

fn clip(
    arrays: &mut Arrays,
    meta: Meta,
    skeleton: &Skeleton,
    morphs: usize,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Option<Clip>, FormatError> {
    let joints = skeleton.len();
    let morph_weights = arrays.numbers.remove("morph_weights");
    let translations = arrays.numbers.remove("translations");
    let rotations = arrays.numbers.remove("rotations");
    let scales = arrays.numbers.remove("scales");
    let channels = [("translations", &translations, 3), ("rotations", &rotations, 4), ("scales", &scales, 3)];
    let times = arrays.numbers.remove("times");

    let first = channels.iter().find_map(|(key, array, _)| array.as_ref().map(|array| (*key, array)));
    let first = first.or_else(|| morph_weights.as_ref().map(|array| ("morph_weights", array)));
    let Some((first_key, first)) = first else {
        return match times.filter(|times| times.shape.first() != Some(&0)) {
            Some(times) => Err(invalid(
                "times",
                format!("there are {} key times, but nothing that has values at them", times.shape[0]),
            )),
            None => Ok(None),
        };
    };
    let frames = first.shape.first().copied().unwrap_or(0);
    budget.take(Limit::FramesPerClip, frames as u64, first_key)?;
    budget.take(Limit::Samples, (frames as u64).saturating_mul(joints as u64), first_key)?;
    for (key, array, width) in &channels {
        if let Some(array) = array {
            require_shape(array, key, &[("F", Some(frames)), ("J", Some(joints)), ("", Some(*width))])?;
            array.require_finite(key)?;
        }
    }
    let times = key_times(times.as_ref(), frames, meta.fps)?;
    if frames == 0 {
        return Ok(None);
    }
    warn_of_absent(&channels[..2], reporter);

    let sample_bytes = [(&translations, 12), (&rotations, 16), (&scales, 12)];
    let bytes: u64 = sample_bytes.iter().filter(|(array, _)| array.is_some()).map(|(_, bytes)| bytes).sum();
    budget.take_array((frames as u64).saturating_mul(joints as u64), bytes, first_key)?;

    let mut lengths = LengthCheck::new("rotations");
    let mut tracks = Vec::with_capacity(joints);
    for joint in 0..joints {
        budget.check_canceled()?;
        tracks.push(JointTracks {
            translation: vector_track(translations.as_ref(), joint, joints, frames),
            rotation: rotation_track(rotations.as_ref(), joint, joints, frames, &mut lengths)?,
            scale: vector_track(scales.as_ref(), joint, joints, frames),
        });
    }
    lengths.warn(reporter);
    let clip = Clip::new(meta.name.unwrap_or_default(), times, tracks);
    let clip = clip.map_err(|error| invalid("times", error.to_string()))?;
    let clip = with_morph_weights(clip, morph_weights.as_ref(), morphs, budget)?;
    with_contacts(clip, arrays, skeleton, budget).map(Some)
}

fn key_times(times: Option<&NumberArray>, frames: usize, fps: Option<f64>) -> Result<Vec<f64>, FormatError> {
    if let Some(fps) = fps
        && !(fps.is_finite() && fps > 0.0)
    {
        return Err(invalid("meta.fps", format!("{fps} is not a frame rate; it must be greater than zero")));
    }
    let Some(times) = times else {
        return match fps {
            Some(fps) => Ok((0..frames).map(|frame| frame as f64 / fps).collect()),
            None if frames == 0 => Ok(Vec::new()),
            None => {
                Err(missing("times")
                    .with_hint("add an array of key times in seconds, or a frame rate as 'fps' in 'meta'"))
            }
        };
    };
    require_shape(times, "times", &[("F", Some(frames))])?;
    times.require_finite("times")?;
    for frame in 1..frames {
        let (before, time) = (times.value(frame - 1), times.value(frame));
        if time <= before {
            let detail = format!("the key time {time} is not later than {before}, the one before it");
            return Err(invalid(format!("times[{frame}]"), detail));
        }
    }
    Ok((0..frames).map(|frame| times.value(frame)).collect())
}

fn warn_of_absent(channels: &[(&str, &Option<NumberArray>, usize)], reporter: &mut Reporter) {
    for (key, array, _) in channels {
        if array.is_none() {
            reporter.warn(
                "poses_channel_absent",
                *key,
                format!("the file has no '{key}': this channel stays at rest in all frames"),
                format!("add '{key}' if the joints should move that way"),
            );
        }
    }
}

fn vector_track(array: Option<&NumberArray>, joint: usize, joints: usize, frames: usize) -> Track<Vec3> {
    let Some(array) = array else { return Track::Rest };
    let value = |frame| DVec3::from_array(array.row(frame * joints + joint)).as_vec3();
    Track::Sampled((0..frames).map(value).collect()).compacted()
}

fn rotation_track(
    array: Option<&NumberArray>,
    joint: usize,
    joints: usize,
    frames: usize,
    lengths: &mut LengthCheck,
) -> Result<Track<Quat>, FormatError> {
    let Some(array) = array else { return Ok(Track::Rest) };
    let mut values: Vec<Quat> = Vec::with_capacity(frames);
    for frame in 0..frames {
        let rotation = lengths.unit(array, frame * joints + joint)?.as_quat();
        values.push(next_to(rotation, values.last().copied()));
    }
    Ok(Track::Sampled(values).compacted())
}

/// Makes quaternions unit ones, and remembers how many were far from it.
struct LengthCheck {
    key: &'static str,
    off: usize,
    first: String,
    worst: f64,
}

impl LengthCheck {
    const fn new(key: &'static str) -> Self {
        Self { key, off: 0, first: String::new(), worst: 1.0 }
    }

    fn unit(&mut self, array: &NumberArray, row: usize) -> Result<DQuat, FormatError> {
        let rotation = DQuat::from_array(array.row(row));
        let length = rotation.length();
        if length < SHORTEST {
            let place = self.place(array, row);
            return Err(invalid(place, "the quaternion is zero, which is not a rotation")
                .with_hint("write no rotation as 0 0 0 1 (x y z w)"));
        }
        let error = (length - 1.0).abs();
        if error > LENGTH_SLACK {
            if self.off == 0 {
                self.first = self.place(array, row);
            }
            if error > (self.worst - 1.0).abs() {
                self.worst = length;
            }
            self.off += 1;
        }
        Ok(if error > ROUNDING { rotation / length } else { rotation })
    }

    fn place(&self, array: &NumberArray, row: usize) -> String {
        let text = array.index_text(row * 4);
        let outer = text.rsplit_once(", ").map_or(text.as_str(), |(outer, _)| outer);
        format!("{}{outer}]", self.key)
    }

    fn warn(self, reporter: &mut Reporter) {
        if self.off > 0 {
            reporter.warn(
                "quaternion_not_unit",
                self.first,
                format!(
                    "{} quaternions are not of length one (the worst has {:.6}); they were normalized",
                    self.off, self.worst
                ),
                "write unit quaternions, in the order x y z w",
            );
        }
    }
}

fn require_rest(array: &NumberArray, key: &str, count: usize, width: usize) -> Result<(), FormatError> {
    require_shape(array, key, &[("J", Some(count)), ("", Some(width))])?;
    array.require_finite(key)
}
