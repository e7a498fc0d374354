//! How smooth a result is beside its source.

use glam::DVec3;

use super::{
    body::{Size, bones_length, first_joint, last_joint},
    metric::{Finding, Reading},
    motion::{Both, Compared, Motion, Wanted},
};
use crate::rig::{Rig, Role};

/// What is followed, and from where: every limb from its own start, the head from the pelvis, and the pelvis from the world. Seen so,
/// a limb that is longer by a factor moves farther by that factor and no rougher, whatever carries it; and what carries it is
/// followed by itself.
const FOLLOWED: [(&str, Option<&str>); 6] = [
    ("pelvis", None),
    ("head", Some("pelvis")),
    ("left_hand", Some("left_upper_arm")),
    ("right_hand", Some("right_upper_arm")),
    ("left_foot", Some("left_thigh")),
    ("right_foot", Some("right_thigh")),
];
/// What moves more slowly than this, in meters per second, stands: its jerk is noise.
const MIN_SPEED: f64 = 0.02;
/// Positions that are compared lie at least so far apart: as those of 60 frames per second do.
const MIN_STEP_SECONDS: f64 = 1.0 / 61.0;
/// Frames that such positions lie apart at most.
const MAX_SPACING: usize = 15;
/// Jerk in m/s³ that nobody sees of a body whose leg is a meter long, and which both sides have beside their own: a shake of a tenth of a
/// millimeter from frame to frame at 30 per second has it. Without, half a centimeter of rise and fall beside a very smooth source counts as rough.
const UNSEEN_JERK: f64 = 20.0;
/// Share of the source's roughest frames that is left out.
const ROUGHEST: f64 = 0.02;
const NOTHING_MOVES: &str =
    "no pelvis, hand, foot or head moves, or the clip has fewer than four frames at 60 per second or less";

/// What is looked at.
pub(super) struct Smoothness {
    followed: Vec<Followed>,
    /// Length of a leg of the source, in meters.
    leg: f64,
}

struct Followed {
    role: String,
    joint: usize,
    slot: usize,
    /// Where it is seen from; nothing where that is the world.
    carrier: Option<usize>,
    /// How large the target is there, for a source of 1.
    size: f64,
}

/// Both sides over four frames.
struct Step {
    frame: usize,
    /// From the first to the last of them.
    seconds: f64,
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
    pub(super) fn find(rigs: &Both<&Rig<'_>>, sizes: &Both<Size>, wanted: &mut Wanted) -> Self {
        let legs = sizes.target.leg.zip(sizes.source.leg).map_or(1.0, |(target, source)| target / source);
        let mut followed = Vec::new();
        let mut follow = |role: &str, end: Option<Both<usize>>, carrier: Option<Both<usize>>| {
            let Some(end) = end else { return };
            let size = carrier.map_or(legs, |carrier| {
                let length = |rig: &Rig<'_>, from, to| bones_length(rig, from, to).max(f64::MIN_POSITIVE);
                length(rigs.target, carrier.target, end.target) / length(rigs.source, carrier.source, end.source)
            });
            let carrier = carrier.map(|joint| wanted.joint(joint));
            followed.push(Followed {
                role: role.to_owned(),
                joint: end.target,
                slot: wanted.joint(end),
                carrier,
                size,
            });
        };
        for (role, carrier) in FOLLOWED {
            follow(role, first_joint(rigs, role), carrier.and_then(|carrier| first_joint(rigs, carrier)));
        }
        let is_leg = |role: &&String| role.parse::<Role>().is_ok_and(|role| role.part.is_whole_leg());
        for leg in rigs.target.roles.keys().filter(is_leg) {
            follow(leg, last_joint(rigs, leg), first_joint(rigs, leg));
        }
        Self { followed, leg: sizes.source.leg.unwrap_or(1.0) }
    }

    /// Mean jerk over mean speed, target over source: size does not count, roughness does. The worst of all ends. A target that
    /// moves less than its size says, such as a foot that stands where it would have slid, is no rougher for that.
    ///
    /// The roughest frames of the source are left out on both sides: a capture that jumps once, such as from a T pose into a walk,
    /// would outweigh all others. A jump that only the target makes counts.
    pub(super) fn jerk_ratio(&self, compared: &Compared) -> Finding {
        let mut reading = Reading::default();
        for followed in &self.followed {
            let mut steps = followed.steps(compared);
            steps.sort_by(|first, second| first.source.jerk.total_cmp(&second.source.jerk));
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
            let left_out = (steps.len() as f64 * ROUGHEST).ceil() as usize;
            steps.truncate(steps.len() - left_out.min(steps.len().saturating_sub(1)));
            let source = Pace::mean(&steps, |step| step.source);
            let target = Pace::mean(&steps, |step| step.target);
            if source.speed < MIN_SPEED || target.speed < MIN_SPEED || source.jerk <= 0.0 {
                continue;
            }
            let pace = target.speed.max(source.speed * followed.size);
            let rough = |pace: Pace, size: f64| pace.jerk + UNSEEN_JERK * self.leg * size;
            let ratio = (rough(target, followed.size) / pace) / (rough(source, 1.0) / source.speed);
            reading.parts.insert(followed.role.clone(), ratio);
            let roughest = steps.iter().max_by(|first, second| first.target.jerk.total_cmp(&second.target.jerk));
            let frame = roughest.map_or(0, |step| compared.frames.indices[step.frame]);
            reading.worst.push((frame, followed.joint, followed.role.clone(), ratio));
        }
        reading.value = reading.parts.values().copied().fold(0.0, f64::max);
        if reading.parts.is_empty() { Err(NOTHING_MOVES) } else { Ok(reading) }
    }
}

impl Followed {
    /// Every four frames as far apart as [`spacing`] says. Keys may lie unevenly, so jerk is the third divided difference.
    fn steps(&self, compared: &Compared) -> Vec<Step> {
        let mut steps = Vec::with_capacity(compared.len());
        for run in &compared.frames.runs {
            let apart = spacing(&compared.performed_seconds[run.clone()]);
            for frame in run.start..run.end.saturating_sub(3 * apart) {
                let times = [0, 1, 2, 3].map(|step| compared.performed_seconds[frame + step * apart]);
                let seconds = times[3] - times[0];
                let [source, target] = [&compared.source, &compared.target].map(|motion| {
                    let places = [0, 1, 2, 3].map(|step| self.position(motion, frame + step * apart));
                    let speed = places[3].distance(places[0]) / seconds;
                    Pace { jerk: third_derivative(places, times).length(), speed }
                });
                if source.jerk.is_finite() && target.jerk.is_finite() {
                    steps.push(Step { frame: frame + apart, seconds, source, target });
                }
            }
        }
        steps
    }

    fn position(&self, motion: &Motion, frame: usize) -> DVec3 {
        let carrier = self.carrier.map_or(DVec3::ZERO, |carrier| motion.position(frame, carrier));
        motion.position(frame, self.slot) - carrier
    }
}

/// How many frames apart positions are compared. The noise of a capture grows with the third power of the frame rate until its jerk
/// outweighs all that is seen: a shake of a tenth of a millimeter at 120 frames per second is rougher than any walk. An odd number, so that a
/// shake from frame to frame is still seen.
fn spacing(times_seconds: &[f64]) -> usize {
    let [Some(first), Some(last)] = [times_seconds.first(), times_seconds.last()] else { return 1 };
    let mean = (last - first) / (times_seconds.len() - 1).max(1) as f64;
    let is_far = |apart: &usize| mean * *apart as f64 >= MIN_STEP_SECONDS;
    (1..MAX_SPACING).step_by(2).find(is_far).unwrap_or(MAX_SPACING)
}

/// Six times the third divided difference: exact for cubics, however the times lie.
fn third_derivative(places: [DVec3; 4], times: [f64; 4]) -> DVec3 {
    let first = [0, 1, 2].map(|index| (places[index + 1] - places[index]) / (times[index + 1] - times[index]));
    let second = [0, 1].map(|index| (first[index + 1] - first[index]) / (times[index + 2] - times[index]));
    (second[1] - second[0]) / (times[3] - times[0]) * 6.0
}

impl Pace {
    /// The mean over time.
    fn mean(steps: &[Step], side: fn(&Step) -> Self) -> Self {
        let whole: f64 = steps.iter().map(|step| step.seconds).sum();
        let sum = steps.iter().fold(Self::default(), |sum, step| {
            let Self { jerk, speed } = side(step);
            Self { jerk: sum.jerk + jerk * step.seconds, speed: sum.speed + speed * step.seconds }
        });
        Self { jerk: sum.jerk / whole.max(f64::MIN_POSITIVE), speed: sum.speed / whole.max(f64::MIN_POSITIVE) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_follow_faster_than_is_seen_are_compared_farther_apart() {
        let apart = |fps: f64| spacing(&(0..50).map(|frame| f64::from(frame) / fps).collect::<Vec<_>>());
        assert_eq!([24.0, 30.0, 60.0, 100.0, 120.0, 240.0].map(apart), [1, 1, 1, 3, 3, 5]);
        assert_eq!([spacing(&[]), spacing(&[0.0]), spacing(&[0.0; 9])], [1, 15, 15], "no time passes");
    }

    #[test]
    fn jerk_does_not_depend_on_where_the_keys_lie() {
        let cubic = |time: f64| DVec3::new(time.powi(3), 2.0 * time * time, 1.0 - time);
        for times in [[0.0, 0.1, 0.2, 0.3], [0.0, 0.03, 0.031, 0.2], [1.0, 1.5, 1.6, 1.65]] {
            let jerk = third_derivative(times.map(cubic), times);
            assert!(jerk.distance(DVec3::X * 6.0) < 1e-6, "{times:?}: {jerk}");
        }
    }
}
