//! Animation stacks to clips: which nodes a stack moves, and their transforms at the chosen times.
//!
//! The parser evaluates curves, layers and extrapolation. It is asked for the components that move, of the nodes that
//! move, and for nothing else.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3, Quat, Vec3};
use rayon::prelude::*;
use ufbx::{ElementType, ExtrapolationMode, Interpolation};

use crate::{
    formats::{Budget, FormatError, Limit},
    model::{Canceled, Clip, ClipError, Control, JointTracks, Reporter, Track, rotation::near},
};

use super::{
    keys::{self, Grid, KeyFacts, KeyTimes},
    nodes::{self, Nodes},
    properties::{Properties, is_shape_weight},
};

/// The parser's flags, which it exports without a way to read them.
const EXPLICIT: u32 = 0x4;
const TRANSLATION: u32 = 0x10;
const ROTATION: u32 = 0x20;
const SCALE: u32 = 0x40;

/// The spherical path between two keys and the file's own path through its angles part noticeably beyond this.
const LINEAR_ROTATION_STEP_DEGREES: f64 = 10.0;
/// Below this many evaluations, other threads cost more than they give.
const PARALLEL_EVALUATIONS: usize = 8_192;
const CANCEL_INTERVAL_FRAMES: usize = 1_024;
const DEFAULT_FPS: f64 = 30.0;

/// Which components of a joint a stack moves, as the parser's flags.
type Moves = BTreeMap<usize, u32>;

/// Where a clip lies on the clock of its file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Origin {
    /// The time in the file that is the clip's zero.
    begin_seconds: f64,
    /// Whether its curves say more than straight lines between its keys would.
    is_curved: bool,
}

/// One clip per animation stack, in file order. Times begin at 0 with the first sample.
///
/// # Errors
/// When a curve gives a number that is not finite, a limit is exceeded, or the work is canceled.
pub(super) fn read_all(
    file: &ufbx::SceneRoot,
    nodes: &Nodes,
    properties: &Properties,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<(Vec<Clip>, Vec<Origin>), FormatError> {
    let stacks = file.anim_stacks.len();
    budget.take(Limit::Clips, stacks as u64, "animation stacks")?;
    let fps = frame_rate(file, reporter);
    let mut densified = false;
    let mut clips = Vec::with_capacity(stacks);
    let mut origins = Vec::with_capacity(stacks);
    for stack in 0..stacks {
        budget.check_canceled()?;
        let (clip, times) = read_stack(file, nodes, stack, fps, &mut densified, budget, reporter)?;
        origins.push(Origin {
            begin_seconds: times.seconds.first().copied().unwrap_or_default(),
            is_curved: times.grid != Grid::NotNeeded,
        });
        let curves = properties.tracks(file, &file.anim_stacks[stack], &times.seconds, budget)?;
        clips.push(clip.with_morphs(curves).map_err(|error| not_a_clip(&file.anim_stacks[stack], &error))?);
    }
    Ok((clips, origins))
}

/// What the curves of a stack say at these times of its clip; nothing where they say no more than straight lines between the clip's
/// frames.
///
/// # Errors
/// As [`read_all`].
pub(super) fn evaluated(
    file: &ufbx::SceneRoot,
    nodes: &Nodes,
    properties: &Properties,
    (stack_index, origin): (usize, Origin),
    times_seconds: &[f64],
    budget: &mut Budget<'_>,
) -> Result<Option<Clip>, FormatError> {
    if !origin.is_curved || times_seconds.is_empty() {
        return Ok(None);
    }
    let stack = &file.anim_stacks[stack_index];
    let name = stack.element.name.to_string();
    let (moves, ..) = survey(file, nodes, stack, budget)?;
    let in_file: Vec<f64> = times_seconds.iter().map(|time| origin.begin_seconds + time).collect();
    let tracks = sampled(file, nodes, stack_index, &in_file, &moves, budget)?;
    let curves = properties.tracks(file, stack, &in_file, budget)?;
    let evaluated = Clip::new(name, times_seconds.to_vec(), tracks).and_then(|clip| clip.with_morphs(curves));
    evaluated.map(Some).map_err(|error| not_a_clip(stack, &error))
}

fn frame_rate(file: &ufbx::Scene, reporter: &mut Reporter) -> f64 {
    let fps = file.settings.frames_per_second;
    if fps.is_finite() && (0.1..=10_000.0).contains(&fps) {
        return fps;
    }
    reporter.warn(
        "frame_rate_guessed",
        "GlobalSettings",
        format!("the file's frame rate, {fps}, makes no sense; {DEFAULT_FPS} frames per second were taken instead"),
        "set the time mode of the file before exporting",
    );
    DEFAULT_FPS
}

/// The clip of a stack, and at which times in the file its frames are.
fn read_stack(
    file: &ufbx::SceneRoot,
    nodes: &Nodes,
    stack_index: usize,
    fps: f64,
    densified: &mut bool,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<(Clip, KeyTimes), FormatError> {
    let stack = &file.anim_stacks[stack_index];
    let name = stack.element.name.to_string();
    let (moves, facts, has_shapes) = survey(file, nodes, stack, budget)?;
    let times = keys::key_times(facts, fps, budget.limits().frames_per_clip);
    report(&times, &name, densified, reporter);
    if (moves.is_empty() && !has_shapes) || times.seconds.is_empty() {
        budget.take_array(nodes.len() as u64, size_of::<JointTracks>() as u64, &name)?;
        let at = times.seconds.first().copied().unwrap_or_default();
        let still = clip(name, vec![0.0], vec![JointTracks::default(); nodes.len()])?;
        return Ok((still, KeyTimes { seconds: vec![at], left_out: 0, grid: Grid::NotNeeded }));
    }
    let tracks = sampled(file, nodes, stack_index, &times.seconds, &moves, budget)?;
    let first = times.seconds[0];
    let clip = clip(name, times.seconds.iter().map(|time| time - first).collect(), tracks)?;
    Ok((clip, times))
}

/// The tracks of all joints at times of the file.
fn sampled(
    file: &ufbx::SceneRoot,
    nodes: &Nodes,
    stack_index: usize,
    times_seconds: &[f64],
    moves: &Moves,
    budget: &mut Budget<'_>,
) -> Result<Vec<JointTracks>, FormatError> {
    let name = file.anim_stacks[stack_index].element.name.to_string();
    budget.take_array(nodes.len() as u64, size_of::<JointTracks>() as u64, &name)?;
    let frames = times_seconds.len() as u64;
    let samples = frames.saturating_mul(moves.len() as u64);
    budget.take(Limit::FramesPerClip, frames, &name)?;
    budget.take(Limit::Samples, samples, &name)?;
    budget.take_array(samples, (size_of::<Quat>() + 2 * size_of::<Vec3>()) as u64, &name)?;

    let moving: Vec<(usize, u32)> = moves.iter().map(|(joint, flags)| (*joint, *flags)).collect();
    let control = budget.control();
    // Evaluation only reads the parsed scene, which the parser declares shareable between threads.
    let sample = |(joint, flags): &(usize, u32)| {
        let stack = &file.anim_stacks[stack_index];
        Sampler { file, nodes, stack, times: times_seconds, moves, control }.run(*joint, *flags)
    };
    let evaluated: Vec<Result<JointTracks, FormatError>> = if moving.len() * times_seconds.len() < PARALLEL_EVALUATIONS
    {
        moving.iter().map(sample).collect()
    } else {
        moving.par_iter().map(sample).collect()
    };
    let mut tracks = vec![JointTracks::default(); nodes.len()];
    // In order, so that of several errors the same one is told every time.
    for ((joint, _), evaluated) in moving.iter().zip(evaluated) {
        tracks[*joint] = evaluated?;
    }
    Ok(tracks)
}

fn not_a_clip(stack: &ufbx::AnimStack, error: &ClipError) -> FormatError {
    FormatError::malformed("animation", stack.element.name.to_string(), error.to_string())
}

fn clip(name: String, times: Vec<f64>, tracks: Vec<JointTracks>) -> Result<Clip, FormatError> {
    let place = name.clone();
    Clip::new(name, times, tracks).map_err(|error| FormatError::malformed("animation", place, error.to_string()))
}

fn report(times: &KeyTimes, stack: &str, densified: &mut bool, reporter: &mut Reporter) {
    if times.left_out > 0 {
        reporter.warn(
            "keys_outside_stack",
            stack,
            format!(
                "{} key times lie before the begin or after the end of the stack and are not played",
                times.left_out
            ),
            "set the time span of the take before exporting if they matter",
        );
    }
    match times.grid {
        Grid::NotNeeded => {}
        Grid::Joined if *densified => {}
        Grid::Joined => {
            *densified = true;
            reporter.warn(
                "keys_densified",
                stack,
                "the keys are too far apart for straight lines between them; frames at the file's rate were added",
                "nothing is lost; bake the animation before exporting to keep exactly your keys",
            );
        }
        Grid::TooLong => reporter.warn(
            "keys_not_densified",
            stack,
            "frames at the file's rate would exceed the limit on frames; only the keys themselves were sampled",
            "bake or shorten the animation before exporting",
        ),
    }
}

/// Which joints a stack moves, what its curves say about time, and whether it moves faces.
fn survey(
    file: &ufbx::Scene,
    nodes: &Nodes,
    stack: &ufbx::AnimStack,
    budget: &mut Budget<'_>,
) -> Result<(Moves, KeyFacts, bool), FormatError> {
    let (mut moves, mut has_shapes) = (Moves::new(), false);
    let mut facts = KeyFacts { is_linear: stack.layers.len() <= 1, ..KeyFacts::default() };
    let (begin, end) = (stack.time_begin, stack.time_end);
    facts.span_seconds = (begin.is_finite() && end.is_finite() && begin < end).then_some((begin, end));
    for layer in &stack.layers {
        for property in &layer.anim_props {
            let Some(target) = moved_by(file, nodes, property) else { continue };
            let curves = property.anim_value.curves.iter().flatten();
            let mut keys = 0;
            for curve in curves {
                keys += curve.keyframes.len();
                budget.take_array(curve.keyframes.len() as u64, size_of::<f64>() as u64, "animation curves")?;
                add_curve(curve, matches!(target, Moved::Joint(_, flags) if flags & ROTATION != 0), &mut facts);
            }
            has_shapes |= matches!(target, Moved::Shape);
            if let Moved::Joint(joint, flags) = target
                && (keys > 0 || value_differs(file, nodes, joint, property))
            {
                *moves.entry(joint).or_default() |= flags;
            }
        }
    }
    if facts.keys_seconds.is_empty() && !moves.is_empty() {
        facts.keys_seconds.push(stack.time_begin);
        facts.keys_seconds.retain(|time| time.is_finite());
    }
    inherit_scale_motion(file, nodes, &mut moves);
    Ok((moves, facts, has_shapes))
}

enum Moved {
    Joint(usize, u32),
    LayerWeight,
    Shape,
}

fn moved_by(file: &ufbx::Scene, nodes: &Nodes, property: &ufbx::AnimProp) -> Option<Moved> {
    match property.element.type_ {
        ElementType::AnimLayer if &*property.prop_name == "Weight" => Some(Moved::LayerWeight),
        ElementType::BlendChannel => is_shape_weight(property).then_some(Moved::Shape),
        ElementType::Node => {
            let node = file.nodes.as_ref().get(property.element.typed_id as usize)?;
            let joint = nodes.joint(node)?;
            let flags = match &*property.prop_name {
                "Lcl Translation" => TRANSLATION,
                "Lcl Rotation" if has_pivot(node) => TRANSLATION | ROTATION,
                "Lcl Rotation" => ROTATION,
                "Lcl Scaling" if has_pivot(node) => TRANSLATION | SCALE,
                "Lcl Scaling" => SCALE,
                "PreRotation" | "PostRotation" | "RotationOffset" | "RotationPivot" | "ScalingOffset"
                | "ScalingPivot" | "RotationOrder" => TRANSLATION | ROTATION | SCALE,
                _ => return None,
            };
            Some(Moved::Joint(joint, flags))
        }
        _ => None,
    }
}

/// Whether a turn or a stretch of the node also moves it.
fn has_pivot(node: &ufbx::Node) -> bool {
    ["RotationPivot", "ScalingPivot", "ScalingOffset"].into_iter().any(|name| {
        ufbx::find_prop(&node.element.props, name).is_some_and(|property| {
            let value = &property.value_vec4;
            value.x != 0.0 || value.y != 0.0 || value.z != 0.0
        })
    })
}

/// Whether an animated property without any key still differs from the node's own value.
fn value_differs(file: &ufbx::Scene, nodes: &Nodes, joint: usize, property: &ufbx::AnimProp) -> bool {
    let own = ufbx::find_prop(&nodes.node(file, joint).element.props, &property.prop_name);
    let value = &property.anim_value.default_value;
    own.is_some_and(|own| {
        let own = &own.value_vec4;
        own.x != value.x || own.y != value.y || own.z != value.z
    })
}

fn add_curve(curve: &ufbx::AnimCurve, turns: bool, facts: &mut KeyFacts) {
    let keys = curve.keyframes.as_ref();
    let moves_on = |extrapolation: &ufbx::Extrapolation| !matches!(extrapolation.mode, ExtrapolationMode::Constant);
    facts.extrapolates |= moves_on(&curve.pre_extrapolation) || moves_on(&curve.post_extrapolation);
    for pair in keys.windows(2) {
        let is_line = pair[0].value == pair[1].value && !matches!(pair[0].interpolation, Interpolation::Cubic)
            || matches!(pair[0].interpolation, Interpolation::Linear);
        let is_wide = turns && (pair[1].value - pair[0].value).abs() > LINEAR_ROTATION_STEP_DEGREES;
        facts.is_linear &= is_line && !is_wide;
    }
    facts.keys_seconds.extend(keys.iter().map(|key| key.time).filter(|time| time.is_finite()));
}

/// A child that does not inherit its parent's scale has to undo it, so it moves when that does.
fn inherit_scale_motion(file: &ufbx::Scene, nodes: &Nodes, moves: &mut Moves) {
    for joint in 0..nodes.len() {
        let Some(parent) = nodes.parent(joint) else { continue };
        let parent_own_scale_moves = moves.get(&parent).is_some_and(|flags| flags & SCALE != 0);
        if parent_own_scale_moves && nodes::ignores_parent_scale(nodes.node(file, joint)) {
            *moves.entry(joint).or_default() |= SCALE;
        }
    }
}

/// Samples one joint.
struct Sampler<'a> {
    file: &'a ufbx::Scene,
    nodes: &'a Nodes,
    stack: &'a ufbx::AnimStack,
    times: &'a [f64],
    moves: &'a Moves,
    control: &'a Control,
}

impl Sampler<'_> {
    fn run(&self, joint: usize, flags: u32) -> Result<JointTracks, FormatError> {
        let node = self.nodes.node(self.file, joint);
        let rest = self.nodes.rest(joint);
        let parent = self.nodes.parent(joint).filter(|_| nodes::ignores_parent_scale(node));
        let capacity = |flag: u32| if flags & flag == 0 { 0 } else { self.times.len() };
        let mut translations: Vec<Vec3> = Vec::with_capacity(capacity(TRANSLATION));
        let mut rotations: Vec<Quat> = Vec::with_capacity(capacity(ROTATION));
        let mut scales: Vec<Vec3> = Vec::with_capacity(capacity(SCALE));
        let mut previous = rest.rotation;
        for (frame, time) in self.times.iter().enumerate() {
            if frame % CANCEL_INTERVAL_FRAMES == 0 {
                self.control.check().map_err(|canceled: Canceled| FormatError::from(canceled))?;
            }
            let mut local =
                nodes::transform(&ufbx::evaluate_transform_flags(&self.stack.anim, node, *time, EXPLICIT | flags));
            if flags & ROTATION == 0 {
                local.rotation = DQuat::IDENTITY;
            }
            if flags & SCALE == 0 {
                local.scale = DVec3::ONE;
            } else if let Some(parent) = parent {
                local.scale = nodes::without_parent_scale(local.scale, self.own_scale(parent, *time));
            }
            if flags & TRANSLATION == 0 {
                local.translation = DVec3::ZERO;
            }
            if !nodes::is_sane(&local) {
                return Err(self.not_finite(joint, *time));
            }
            if flags & TRANSLATION != 0 {
                translations.push(local.translation.as_vec3());
            }
            if flags & ROTATION != 0 {
                let rotation = near(local.rotation.normalize(), previous);
                previous = rotation;
                rotations.push(rotation.as_quat());
            }
            if flags & SCALE != 0 {
                scales.push(local.scale.as_vec3());
            }
        }
        Ok(JointTracks { translation: track(translations), rotation: track(rotations), scale: track(scales) })
    }

    /// The scale that a joint's own property gives, before inheritance is resolved.
    fn own_scale(&self, joint: usize, time: f64) -> DVec3 {
        let node = self.nodes.node(self.file, joint);
        if self.moves.get(&joint).is_some_and(|flags| flags & SCALE != 0) {
            nodes::transform(&ufbx::evaluate_transform_flags(&self.stack.anim, node, time, EXPLICIT | SCALE)).scale
        } else {
            nodes::transform(&node.local_transform).scale
        }
    }

    fn not_finite(&self, joint: usize, time: f64) -> FormatError {
        FormatError::malformed(
            "animation",
            self.stack.element.name.to_string(),
            format!(
                "the curves of node '{}' give a number that is not finite or absurdly large at {time} s",
                self.nodes.node(self.file, joint).element.name
            ),
        )
    }
}

fn track<T: Copy + PartialEq>(values: Vec<T>) -> Track<T> {
    if values.is_empty() { Track::Rest } else { Track::Sampled(values).compacted() }
}
