//! Knees and elbows that spring: how much their speed changes from one frame to the next, beyond what the source's does.

use super::{
    body::first_joint,
    limbs::angle,
    metric::{Finding, Reading, Series},
    motion::{Both, Compared, LONGEST_FRAME_SECONDS, Wanted},
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
                for frame in run.clone() {
                    let near = frame.saturating_sub(NEAR).max(run.start)..(frame + NEAR + 1).min(run.end);
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
    /// How much the speed of the bend changes at each frame, in degrees per frame²; NaN at the ends of a run. Of longer frames as much as
    /// one of [`LONGEST_FRAME_SECONDS`] would have of it.
    fn changes(&self, compared: &Compared, is_target: bool) -> Vec<f64> {
        let side = compared.side(is_target);
        let bend = |frame: usize| {
            let [start, middle, end] = self.points.map(|point| side.position(frame, point));
            angle(middle - start, end - middle)
        };
        let bends: Vec<f64> = (0..compared.len()).map(bend).collect();
        let mut changes = vec![f64::NAN; compared.len()];
        let times = &compared.times_seconds;
        for run in &compared.frames.runs {
            for frame in run.start + 1..run.end.saturating_sub(1) {
                let (before, after) = (times[frame] - times[frame - 1], times[frame + 1] - times[frame]);
                let change = (bends[frame + 1] - bends[frame]) / after - (bends[frame] - bends[frame - 1]) / before;
                // Keys may lie unevenly; a frame is as long as the two about it are on the mean.
                let frame_seconds = f64::midpoint(before, after);
                let share = (LONGEST_FRAME_SECONDS / frame_seconds).min(1.0);
                changes[frame] = change.abs() * frame_seconds * share * share;
            }
        }
        changes
    }
}
