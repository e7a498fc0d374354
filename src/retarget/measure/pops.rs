//! Knees and elbows that spring: how much their speed changes from one frame to the next, beyond what the source's does. A frame is one of
//! 30 a second where the clip has more: who looks sees a knee that snaps within a tenth of a second, in however many frames.

use super::{
    body::first_joint,
    limbs::angle,
    metric::{Finding, Reading, Series},
    motion::{Both, Compared, LONGEST_FRAME_SECONDS, Wanted},
    statistics::frames_per_second,
};
use crate::rig::Rig;

/// Roles of the three joints of each bend.
const KNEES: [(&str, [&str; 3]); 2] = [
    ("left_knee", ["left_thigh", "left_shin", "left_foot"]),
    ("right_knee", ["right_thigh", "right_shin", "right_foot"]),
];
const ELBOWS: [(&str, [&str; 3]); 2] = [
    ("left_elbow", ["left_upper_arm", "left_forearm", "left_hand"]),
    ("right_elbow", ["right_upper_arm", "right_forearm", "right_hand"]),
];
/// What the source does within this many frames of one excuses the target there.
const NEAR: usize = 2;
/// Frames that are shorter are looked at several at a time.
const SHORTEST_FRAME_SECONDS: f64 = 1.0 / 30.0;
const NONE: &str = "no such joint was recognized on both sides";
const TOO_SHORT: &str = "the clip has fewer than three frames";

/// The bends that are looked at.
pub(super) struct Pops(Vec<Bend>);

struct Bend {
    name: &'static str,
    joint: usize,
    points: [usize; 3],
}

impl Pops {
    pub(super) fn knees(rigs: &Both<&Rig<'_>>, wanted: &mut Wanted) -> Self {
        Self::find(KNEES, rigs, wanted)
    }

    pub(super) fn elbows(rigs: &Both<&Rig<'_>>, wanted: &mut Wanted) -> Self {
        Self::find(ELBOWS, rigs, wanted)
    }

    fn find(bends: [(&'static str, [&str; 3]); 2], rigs: &Both<&Rig<'_>>, wanted: &mut Wanted) -> Self {
        let bend = |(name, roles): (&'static str, [&str; 3])| {
            let [start, middle, end] = roles.map(|role| first_joint(rigs, role));
            let (start, middle, end) = (start?, middle?, end?);
            Some(Bend { name, joint: middle.target, points: [start, middle, end].map(|joint| wanted.joint(joint)) })
        };
        Self(bends.into_iter().filter_map(bend).collect())
    }

    /// Degrees per frame², largest.
    pub(super) fn measure(&self, compared: &Compared) -> Finding {
        if self.0.is_empty() {
            return Err(NONE);
        }
        let series = |bend: &Bend| {
            let (source, target) = (bend.changes(compared, false), bend.changes(compared, true));
            let mut values = vec![f64::NAN; compared.len()];
            for run in &compared.frames.runs {
                let reach = NEAR * spacing(&compared.performed_seconds[run.clone()]);
                for frame in run.clone() {
                    let near = frame.saturating_sub(reach).max(run.start)..(frame + reach + 1).min(run.end);
                    let excused = source[near].iter().copied().fold(0.0, f64::max);
                    values[frame] = (target[frame] - excused).max(if target[frame].is_nan() { f64::NAN } else { 0.0 });
                }
            }
            Series { part: bend.name.to_owned(), joint: bend.joint, values }
        };
        let series: Vec<Series> = self.0.iter().map(series).collect();
        Reading::of_worst_part(&series, &compared.frames.indices, 1.0).ok_or(TOO_SHORT)
    }
}

impl Bend {
    /// How much the speed of the bend changes at each frame, in degrees per frame²; NaN at the ends of a run. Short frames are taken together
    /// to [`SHORTEST_FRAME_SECONDS`]; of long ones counts as much as one of [`LONGEST_FRAME_SECONDS`] would have.
    fn changes(&self, compared: &Compared, is_target: bool) -> Vec<f64> {
        let side = compared.side(is_target);
        let bend = |frame: usize| {
            let [start, middle, end] = self.points.map(|point| side.position(frame, point));
            angle(middle - start, end - middle)
        };
        let bends: Vec<f64> = (0..compared.len()).map(bend).collect();
        let mut changes = vec![f64::NAN; compared.len()];
        let times = &compared.performed_seconds;
        for run in &compared.frames.runs {
            let spacing = spacing(&times[run.clone()]);
            for frame in run.start + 1..run.end.saturating_sub(1) {
                let apart = spacing.min(frame - run.start).min(run.end - 1 - frame);
                let [earlier, later] = [frame - apart, frame + apart];
                let (before, after) = (times[frame] - times[earlier], times[later] - times[frame]);
                let change = (bends[later] - bends[frame]) / after - (bends[frame] - bends[earlier]) / before;
                // Keys may lie unevenly; a frame is as long as the two about it are on the mean.
                let frame_seconds = f64::midpoint(before, after);
                let share = (LONGEST_FRAME_SECONDS / frame_seconds).min(1.0);
                changes[frame] = change.abs() * frame_seconds * share * share;
            }
        }
        changes
    }
}

/// How many frames last as long as one of [`SHORTEST_FRAME_SECONDS`].
fn spacing(times_seconds: &[f64]) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of frames")]
    let whole = (frames_per_second(times_seconds) * SHORTEST_FRAME_SECONDS).round() as usize;
    whole.clamp(1, times_seconds.len().max(2) - 1)
}
