//! How smooth a result is beside its source.

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

/// Mean jerk, m/s³, and mean speed, m/s.
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
    pub(super) fn jerk_ratio(&self, compared: &Compared) -> Finding {
        let mut reading = Reading::default();
        for followed in &self.followed {
            let source = self.pace(compared, &compared.source, followed, &mut |_, _| {});
            let mut roughest = (0, 0.0);
            let target = self.pace(compared, &compared.target, followed, &mut |frame, jerk| {
                if jerk > roughest.1 {
                    roughest = (frame, jerk);
                }
            });
            if source.speed < LEAST_SPEED || target.speed < LEAST_SPEED || source.jerk <= 0.0 {
                continue;
            }
            let ratio = (target.jerk / target.speed) / (source.jerk / source.speed);
            reading.parts.insert(followed.role.to_owned(), ratio);
            let frame = compared.frames.indices[roughest.0];
            reading.worst.push((frame, followed.joint, followed.role.to_owned(), ratio));
        }
        reading.value = reading.parts.values().copied().fold(0.0, f64::max);
        if reading.parts.is_empty() { Err(NOTHING_MOVES) } else { Ok(reading) }
    }

    fn pace(&self, compared: &Compared, motion: &Motion, followed: &Followed, see: &mut dyn FnMut(usize, f64)) -> Pace {
        let position = |frame: usize| {
            let position = motion.position(frame, followed.slot);
            match self.pelvis.filter(|_| !followed.in_world) {
                Some(pelvis) => position - motion.position(frame, pelvis),
                None => position,
            }
        };
        let (mut sum, mut count) = (Pace::default(), 0_usize);
        for run in &compared.frames.runs {
            for frame in run.start..run.end.saturating_sub(3) {
                let seconds = (compared.times_seconds[frame + 3] - compared.times_seconds[frame]) / 3.0;
                let [first, second, third, fourth] = [0, 1, 2, 3].map(|step| position(frame + step));
                let jerk = (fourth - third * 3.0 + second * 3.0 - first).length() / seconds.powi(3);
                if !jerk.is_finite() {
                    continue;
                }
                see(frame + 1, jerk);
                sum.jerk += jerk;
                sum.speed += fourth.distance(first) / (3.0 * seconds);
                count += 1;
            }
        }
        let count = count.max(1) as f64;
        Pace { jerk: sum.jerk / count, speed: sum.speed / count }
    }
}
