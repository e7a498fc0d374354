//! How smooth a result is beside its source.

use glam::DVec3;

use super::{
    body::first_joint,
    metric::{Finding, Reading},
    motion::{Both, Compared, Motion, Wanted},
};
use crate::rig::Rig;

/// What is followed, and whether it is followed in the world or relative to the pelvis. Feet meet the world, hands and head the
/// body.
const FOLLOWED: [(&str, bool); 5] =
    [("left_foot", true), ("right_foot", true), ("left_hand", false), ("right_hand", false), ("head", false)];
/// What moves more slowly than this, in metres per second, stands: its jerk is noise.
const LEAST_SPEED: f64 = 0.02;
/// Share of the source's roughest frames that is left out.
const ROUGHEST: f64 = 0.02;
const NOTHING_MOVES: &str = "no hand, foot or head moves, or the clip has fewer than four frames";

/// What is looked at.
pub(super) struct Smoothness {
    pelvis: Option<usize>,
    followed: Vec<Followed>,
}

struct Followed {
    role: &'static str,
    joint: usize,
    slot: usize,
    in_world: bool,
}

/// Both sides over four neighbouring frames.
struct Step {
    frame: usize,
    source: Pace,
    target: Pace,
}

/// Jerk, m/s³, and speed, m/s.
#[derive(Clone, Copy, Debug, Default)]
struct Pace {
    jerk: f64,
    speed: f64,
}

impl Smoothness {
    pub(super) fn find(rigs: &Both<&Rig<'_>>, wanted: &mut Wanted) -> Self {
        let pelvis = first_joint(rigs, "pelvis").map(|joint| wanted.joint(joint));
        let follow = |(role, in_world): (&'static str, bool)| {
            let joint = first_joint(rigs, role)?;
            Some(Followed { role, joint: joint.target, slot: wanted.joint(joint), in_world })
        };
        Self { pelvis, followed: FOLLOWED.into_iter().filter_map(follow).collect() }
    }

    /// Mean jerk over mean speed, target over source: size does not count, roughness does. The worst of all ends.
    ///
    /// The roughest frames of the source are left out on both sides: a capture that jumps once, such as from a T pose into a walk,
    /// would outweigh all others. A jump that only the target makes counts.
    pub(super) fn jerk_ratio(&self, compared: &Compared) -> Finding {
        let mut reading = Reading::default();
        for followed in &self.followed {
            let mut steps = self.steps(compared, followed);
            steps.sort_by(|first, second| first.source.jerk.total_cmp(&second.source.jerk));
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
            let left_out = (steps.len() as f64 * ROUGHEST).ceil() as usize;
            steps.truncate(steps.len() - left_out.min(steps.len().saturating_sub(1)));
            let source = Pace::mean(steps.iter().map(|step| step.source));
            let target = Pace::mean(steps.iter().map(|step| step.target));
            if source.speed < LEAST_SPEED || target.speed < LEAST_SPEED || source.jerk <= 0.0 {
                continue;
            }
            let ratio = (target.jerk / target.speed) / (source.jerk / source.speed);
            reading.parts.insert(followed.role.to_owned(), ratio);
            let roughest = steps.iter().max_by(|first, second| first.target.jerk.total_cmp(&second.target.jerk));
            let frame = roughest.map_or(0, |step| compared.frames.indices[step.frame]);
            reading.worst.push((frame, followed.joint, followed.role.to_owned(), ratio));
        }
        reading.value = reading.parts.values().copied().fold(0.0, f64::max);
        if reading.parts.is_empty() { Err(NOTHING_MOVES) } else { Ok(reading) }
    }

    /// Every four neighbouring frames.
    fn steps(&self, compared: &Compared, followed: &Followed) -> Vec<Step> {
        let mut steps = Vec::with_capacity(compared.len());
        for run in &compared.frames.runs {
            for frame in run.start..run.end.saturating_sub(3) {
                let seconds = (compared.times_seconds[frame + 3] - compared.times_seconds[frame]) / 3.0;
                let [source, target] = [&compared.source, &compared.target].map(|motion| {
                    let [first, second, third, fourth] =
                        [0, 1, 2, 3].map(|step| self.position(motion, frame + step, followed));
                    let jerk = (fourth - third * 3.0 + second * 3.0 - first).length() / seconds.powi(3);
                    Pace { jerk, speed: fourth.distance(first) / (3.0 * seconds) }
                });
                if source.jerk.is_finite() && target.jerk.is_finite() {
                    steps.push(Step { frame: frame + 1, source, target });
                }
            }
        }
        steps
    }

    fn position(&self, motion: &Motion, frame: usize, followed: &Followed) -> DVec3 {
        let position = motion.position(frame, followed.slot);
        match self.pelvis.filter(|_| !followed.in_world) {
            Some(pelvis) => position - motion.position(frame, pelvis),
            None => position,
        }
    }
}

impl Pace {
    fn mean(paces: impl ExactSizeIterator<Item = Self>) -> Self {
        let count = paces.len().max(1) as f64;
        let sum =
            paces.fold(Self::default(), |sum, pace| Self { jerk: sum.jerk + pace.jerk, speed: sum.speed + pace.speed });
        Self { jerk: sum.jerk / count, speed: sum.speed / count }
    }
}
