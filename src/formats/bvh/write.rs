//! A clip into BVH text.
//!
//! BVH joints have no rest rotation and no scale: with every channel at zero, all of them look along the world's axes. So
//! offsets are written as the rest pose has them in model space, and every rotation as what it adds to the rest pose.
//! With `A` the rest rotation of a joint in model space, `Aₚ` that of its parent, `L` the local rotation of a frame, `S`
//! the parent's accumulated scale and `l` the local translation:
//!
//! ```text
//! channel rotation = Aₚ · L · A⁻¹        offset or channel position = Aₚ · (S ∘ l)
//! ```
//!
//! Positions in the world are then those of the clip, for any rest rotations and scales; the joints' own axes are lost. Where the root
//! is, its channels say alone: its offset is zero, as in most files.
//! Written are the joints and the nodes between them; meshes, cameras and the other clips of the target have no place in
//! a BVH.

use glam::{DQuat, DVec3};

use crate::{
    formats::{
        ErrorKind, FormatError, Limit, Limits, WriteOptions,
        euler::{EulerOrder, EulerTrack, OrderChoice, report_orders},
        sections::{ClipTimes, WriteSeek, unwritable},
    },
    model::{Canceled, Clip, Control, LocalPose, ModelPose, Reporter, Scene, Skeleton, Track, Transform},
};

use super::{
    bones::{Bone, bones},
    hierarchy::Channel,
    text::push_number,
};

const USUAL_ORDER: EulerOrder = EulerOrder::ZXY;
/// A millionth of a degree: over the longest chains, still far below a millionth of the size.
const ANGLE_DECIMALS: usize = 6;
const MAX_FPS: f64 = 120.0;
/// The rate of a clip of one frame, which has none.
const SINGLE_FRAME_FPS: f64 = 30.0;
const FRAMES_PER_CHECK: usize = 64;

/// Encodes `clip`.
///
/// # Errors
/// When the clip is not of the target's skeleton, has too many frames, or the work is canceled.
pub(in crate::formats) fn write(
    target: &Scene,
    clip: &Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    let skeleton = &target.skeleton;
    if clip.joints().len() != skeleton.len() || skeleton.is_empty() {
        let detail = format!("the clip has {} joints and the skeleton {}", clip.joints().len(), skeleton.len());
        return Err(FormatError::malformed("write", "", detail));
    }
    let timing = Timing::of(clip, reporter)?;
    let rest = skeleton.rest_pose().to_model(skeleton);
    let bones = bones(skeleton, clip, &rest, reporter);
    report_losses(skeleton, clip, &bones, &rest, reporter);
    let frames = Frames { clip, skeleton, timing: &timing, rest: &rest };
    let orders = match options.rotation_order {
        Some(order) => vec![order; bones.len()],
        None => orders(&frames, &bones, control, reporter)?,
    };
    let mut rows = Rows::new(bones, &orders, rest);
    let mut out = rows.head(&orders, timing.frames, timing.step_seconds);
    let frames = Frames { clip, skeleton, timing: &timing, rest: &rows.rest.clone() };
    frames.each(control, |local, model| rows.push(&mut out, skeleton, local, model))?;
    Ok(out)
}

/// The rows of a file, each of which depends on the one before it: angles go the short way.
#[derive(Debug)]
struct Rows {
    bones: Vec<Bone>,
    tracks: Vec<EulerTrack>,
    rest: ModelPose,
    decimals: usize,
}

impl Rows {
    fn new(bones: Vec<Bone>, orders: &[EulerOrder], rest: ModelPose) -> Self {
        let decimals = length_decimals(&bones, &rest);
        Self { bones, tracks: orders.iter().map(|order| EulerTrack::new(*order)).collect(), rest, decimals }
    }

    /// What comes before the first row.
    fn head(&self, orders: &[EulerOrder], frames: usize, step_seconds: f64) -> Vec<u8> {
        let mut out = Vec::new();
        write_hierarchy(&mut out, &self.bones, orders, self.decimals);
        out.extend_from_slice(format!("MOTION\nFrames: {frames}\nFrame Time: {step_seconds}\n").as_bytes());
        out
    }

    fn push(&mut self, out: &mut Vec<u8>, skeleton: &Skeleton, local: &LocalPose, model: &ModelPose) {
        let Self { bones, tracks, rest, decimals } = self;
        for (bone, track) in bones.iter().zip(tracks) {
            if bone.has_position {
                let position = position(skeleton, bone, rest, local, model);
                for axis in 0..3 {
                    push_number(out, position[axis], *decimals);
                    out.push(b' ');
                }
            }
            for angle in track.next(rotation(bone, rest, local, model)) {
                push_number(out, angle.to_degrees(), ANGLE_DECIMALS);
                out.push(b' ');
            }
        }
        out.pop();
        out.push(b'\n');
    }
}

/// A BVH that grows by the rows of one section of a clip after the other.
#[derive(Debug)]
pub(in crate::formats) struct BvhSectionWriter(Rows);

impl BvhSectionWriter {
    /// Writes everything before the rows. The order of rotations of each joint is what suits the first section.
    ///
    /// # Errors
    /// When the work is canceled, or the file cannot be written.
    pub(in crate::formats) fn begin(
        (target, clip): (&Scene, &Clip),
        times: &ClipTimes,
        rotation_order: Option<EulerOrder>,
        sink: &mut dyn WriteSeek,
        control: &Control,
        reporter: &mut Reporter,
    ) -> Result<Self, FormatError> {
        let ClipTimes::Even { step_seconds, frames: all_frames, .. } = *times else {
            let detail = "the frames of the clip are not evenly spaced, as a BVH needs";
            let hint = "ask for a GLB, or resample the clip before";
            return Err(FormatError::unsupported("write", "MOTION", detail, hint));
        };
        let skeleton = &target.skeleton;
        let timing = Timing { frames: clip.frame_count(), step_seconds, is_resampled: false };
        let rest = skeleton.rest_pose().to_model(skeleton);
        let mut bones = bones(skeleton, clip, &rest, reporter);
        // What is still in the first section may move in another one.
        for bone in &mut bones {
            bone.has_position |= clip.joints()[bone.joint].translation.is_animated();
        }
        report_losses(skeleton, clip, &bones, &rest, reporter);
        let orders = match rotation_order {
            Some(order) => vec![order; bones.len()],
            None => orders(&Frames { clip, skeleton, timing: &timing, rest: &rest }, &bones, control, reporter)?,
        };
        let rows = Rows::new(bones, &orders, rest);
        sink.write_all(&rows.head(&orders, all_frames, step_seconds)).map_err(unwritable)?;
        Ok(Self(rows))
    }

    /// Writes the rows of a section's frames.
    ///
    /// # Errors
    /// When the work is canceled, or the file cannot be written.
    pub(in crate::formats) fn add(
        &mut self,
        (target, clip): (&Scene, &Clip),
        sink: &mut dyn WriteSeek,
        control: &Control,
    ) -> Result<(), FormatError> {
        let skeleton = &target.skeleton;
        let mut out = Vec::new();
        for frame in 0..clip.frame_count() {
            if frame % FRAMES_PER_CHECK == 0 {
                control.check()?;
            }
            let local = clip.local_pose(skeleton, frame);
            self.0.push(&mut out, skeleton, &local, &local.to_model(skeleton));
        }
        sink.write_all(&out).map_err(unwritable)
    }
}

/// The frames that are written.
struct Frames<'a> {
    clip: &'a Clip,
    skeleton: &'a Skeleton,
    timing: &'a Timing,
    rest: &'a ModelPose,
}

impl Frames<'_> {
    fn each(&self, control: &Control, mut show: impl FnMut(&LocalPose, &ModelPose)) -> Result<(), Canceled> {
        for frame in 0..self.timing.frames {
            if frame % FRAMES_PER_CHECK == 0 {
                control.check()?;
            }
            let local = self.timing.pose(self.clip, self.skeleton, frame);
            show(&local, &local.to_model(self.skeleton));
        }
        Ok(())
    }
}

/// The order of rotations of each bone.
fn orders(
    frames: &Frames<'_>,
    bones: &[Bone],
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<EulerOrder>, FormatError> {
    let mut choices = vec![OrderChoice::new(USUAL_ORDER); bones.len()];
    frames.each(control, |local, model| {
        for (bone, choice) in bones.iter().zip(&mut choices) {
            choice.look(rotation(bone, frames.rest, local, model));
        }
    })?;
    if choices.iter().any(OrderChoice::is_in_doubt) {
        frames.each(control, |local, model| {
            for (bone, choice) in bones.iter().zip(&mut choices).filter(|(_, choice)| choice.is_in_doubt()) {
                choice.try_all(rotation(bone, frames.rest, local, model));
            }
        })?;
    }
    let orders: Vec<EulerOrder> = choices.iter().map(OrderChoice::best).collect();
    let by_name = bones.iter().zip(&orders).map(|(bone, order)| (bone.name.to_string(), *order));
    report_orders(USUAL_ORDER, "HIERARCHY", by_name, reporter);
    Ok(orders)
}

/// The channel rotation of a bone; the top ones carry everything above them.
fn rotation(bone: &Bone, rest: &ModelPose, local: &LocalPose, model: &ModelPose) -> DQuat {
    let rest_of = |joint: usize| rest.transforms()[joint].rotation;
    let rotation = match bone.parent_joint {
        Some(parent) => rest_of(parent) * local.transforms()[bone.joint].rotation * rest_of(bone.joint).conjugate(),
        None => model.transforms()[bone.joint].rotation * rest_of(bone.joint).conjugate(),
    };
    rotation.normalize()
}

fn position(skeleton: &Skeleton, bone: &Bone, rest: &ModelPose, local: &LocalPose, model: &ModelPose) -> DVec3 {
    match bone.parent_joint {
        Some(_) => super::bones::unrotated(skeleton, bone.joint, rest, local, model),
        None => model.transforms()[bone.joint].translation,
    }
}

fn write_hierarchy(out: &mut Vec<u8>, bones: &[Bone], orders: &[EulerOrder], decimals: usize) {
    out.extend_from_slice(b"HIERARCHY\n");
    let mut depth = 0;
    for (bone, order) in bones.iter().zip(orders) {
        while depth > bone.depth {
            depth -= 1;
            line(out, depth, "}");
        }
        line(out, depth, &format!("{} {}", if bone.depth == 0 { "ROOT" } else { "JOINT" }, bone.name));
        line(out, depth, "{");
        depth += 1;
        // Some programs add it to the position of the channels, others do not.
        let offset = if bone.depth == 0 { DVec3::ZERO } else { bone.offset };
        write_offset(out, depth, offset, decimals);
        write_channels(out, depth, bone.has_position, *order);
        for end in &bone.ends {
            line(out, depth, "End Site");
            line(out, depth, "{");
            write_offset(out, depth + 1, *end, decimals);
            line(out, depth, "}");
        }
    }
    while depth > 0 {
        depth -= 1;
        line(out, depth, "}");
    }
}

fn write_offset(out: &mut Vec<u8>, depth: usize, offset: DVec3, decimals: usize) {
    out.resize(out.len() + depth, b'\t');
    out.extend_from_slice(b"OFFSET");
    for axis in 0..3 {
        out.push(b' ');
        push_number(out, offset[axis], decimals);
    }
    out.push(b'\n');
}

fn write_channels(out: &mut Vec<u8>, depth: usize, has_position: bool, order: EulerOrder) {
    let positions = (0..3).filter(|_| has_position).map(Channel::Position);
    let channels: Vec<String> =
        positions.chain(order.axes().into_iter().map(Channel::Rotation)).map(Channel::name).collect();
    line(out, depth, &format!("CHANNELS {} {}", channels.len(), channels.join(" ")));
}

fn line(out: &mut Vec<u8>, depth: usize, text: &str) {
    out.resize(out.len() + depth, b'\t');
    out.extend_from_slice(text.as_bytes());
    out.push(b'\n');
}

/// So many decimals that rounding moves a joint by a hundred-millionth of the skeleton's size at most.
fn length_decimals(bones: &[Bone], rest: &ModelPose) -> usize {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for bone in bones {
        let position = rest.transforms()[bone.joint].translation;
        low = low.min(position);
        high = high.max(position);
    }
    let size = (high - low).length();
    if !size.is_finite() || size <= 0.0 {
        return 9;
    }
    (8.0 - size.log10().floor()).clamp(4.0, 14.0) as usize
}

/// Which frames are written: the clip's own where they are evenly spaced, else resampled ones.
struct Timing {
    frames: usize,
    step_seconds: f64,
    is_resampled: bool,
}

impl Timing {
    fn of(clip: &Clip, reporter: &mut Reporter) -> Result<Self, FormatError> {
        let times = clip.times_seconds();
        let duration = clip.duration_seconds();
        if times[0].abs() > 1e-6 {
            reporter.warn(
                "start_time_dropped",
                "MOTION",
                format!("the clip begins at {} s; a BVH always begins at 0", times[0]),
                "",
            );
        }
        if clip.frame_count() == 1 {
            return Ok(Self { frames: 1, step_seconds: SINGLE_FRAME_FPS.recip(), is_resampled: false });
        }
        if clip.uniform_fps().is_some() {
            let step_seconds = duration / (clip.frame_count() - 1) as f64;
            return Ok(Self { frames: clip.frame_count(), step_seconds, is_resampled: false });
        }
        let gap = times.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
        let densest = gap.recip();
        // Key times come with rounding; a rate that is nearly whole is meant to be.
        let whole = densest.round();
        let densest = if (densest - whole).abs() < 1e-3 * whole { whole } else { densest };
        let fps = densest.min(MAX_FPS);
        let intervals = (duration * fps).round().max(1.0);
        let most = Limits::default().frames_per_clip;
        if intervals >= most as f64 {
            return Err(FormatError {
                kind: ErrorKind::LimitExceeded { limit: Limit::FramesPerClip, most, actual: intervals as u64 },
                phase: "write",
                place: "MOTION".into(),
                detail: format!("evenly spaced frames at {fps} per second over {duration} s are too many for a BVH"),
                hint: "ask for glTF or pose arrays, which keep uneven keys".into(),
            });
        }
        reporter.warn(
            "resampled_uniform",
            "MOTION",
            format!(
                "the keys are not evenly spaced, as a BVH needs; the clip was resampled at {fps} frames per second"
            ),
            "ask for glTF or pose arrays to keep the keys as they are",
        );
        Ok(Self { frames: intervals as usize + 1, step_seconds: duration / intervals, is_resampled: true })
    }

    fn pose(&self, clip: &Clip, skeleton: &Skeleton, frame: usize) -> LocalPose {
        if !self.is_resampled {
            return clip.local_pose(skeleton, frame);
        }
        let times = clip.times_seconds();
        let time = times[0] + frame as f64 * self.step_seconds;
        let after = times.partition_point(|key| *key <= time).clamp(1, times.len() - 1);
        let part = ((time - times[after - 1]) / (times[after] - times[after - 1])).clamp(0.0, 1.0);
        let (before, after) = (clip.local_pose(skeleton, after - 1), clip.local_pose(skeleton, after));
        let blend = |(from, to): (&Transform, &Transform)| Transform {
            translation: from.translation.lerp(to.translation, part),
            rotation: from.rotation.slerp(to.rotation, part),
            scale: from.scale.lerp(to.scale, part),
        };
        LocalPose::new(before.transforms().iter().zip(after.transforms()).map(blend).collect())
    }
}

fn report_losses(skeleton: &Skeleton, clip: &Clip, bones: &[Bone], rest: &ModelPose, reporter: &mut Reporter) {
    let count = |is_lost: &dyn Fn(usize) -> bool| bones.iter().filter(|bone| is_lost(bone.joint)).count();
    let turned = count(&|joint| rest.transforms()[joint].rotation.w.abs() < 1.0 - 1e-10);
    if turned > 0 {
        reporter.warn(
            "rest_rotations_folded",
            "HIERARCHY",
            format!("{turned} joints have rest rotations, which a BVH cannot hold; their offsets were turned instead"),
            "positions are exact; choose glb where the joints' own axes matter",
        );
    }
    let scaled = count(&|joint| !rest.transforms()[joint].scale.abs_diff_eq(DVec3::ONE, 1e-6));
    if scaled > 0 {
        reporter.warn(
            "scales_folded",
            "HIERARCHY",
            format!(
                "{scaled} joints have a scale at rest, which a BVH cannot hold; it was multiplied into the offsets"
            ),
            "positions are exact; choose glb where the joints' own scale matters",
        );
    }
    let stretched = count(&|joint| {
        let scale = &clip.joints()[joint].scale;
        let rest = skeleton.joints()[joint].rest.scale.as_vec3();
        match scale {
            Track::Rest => false,
            Track::Constant(value) => !value.abs_diff_eq(rest, 1e-5),
            Track::Sampled(values) => values.iter().any(|value| !value.abs_diff_eq(rest, 1e-5)),
        }
    });
    if stretched > 0 {
        reporter.warn(
            "scale_animation_lost",
            "MOTION",
            format!(
                "{stretched} joints change their scale, which a BVH cannot hold; their children move as they should"
            ),
            "choose glb where the scale matters",
        );
    }
}
