//! Feet that are larger for their legs than the source's stand as quietly.
//!
//! A foot that stands still turns a little: it settles, sways, and captures tremble. Where it is larger beside its leg, the same
//! angle carries ankle and toes farther beside the leg, by as much as it is larger. So while it stands its turns away from how it
//! stands are divided by that. What is taken off is a few degrees at the most: a foot that rolls, or turns about its ball, does so
//! as the source's does.
//!
//! A foot of which the source says nothing turns with the shin above it, which turns by 60 degrees while a walk goes round a corner. It keeps
//! how it stands, and goes along with what an ankle does not give.

use glam::{DQuat, DVec3};

use crate::model::rotation::{approach, near, smootherstep};
use rayon::prelude::*;

use super::{ENDS, PlantStage, PlantedFoot, either};
use crate::retarget::{
    stages::contact_points::{ContactPoints, Part},
    stages::{
        posing::Pose,
        temporal::runs,
        work::{Change, Changed, Work},
    },
};
use crate::{model::Canceled, retarget::ops::PlantMode};

/// Turns up to about this angle count as those of a foot that stands; radians.
const STANDS: f64 = 0.2;
/// From this turn on a foot is as free as the source's, over so many radians.
const TURNS: f64 = 0.6;
const TURNS_FADE: f64 = 1.0;

/// What an ankle gives, in radians: a foot of which the source says nothing stays so far behind its shin at most.
const ANKLE_GIVES: f64 = 0.5;

/// How much of its turns a foot loses while it stands.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Steadied {
    /// The share that is taken off small turns; nothing is taken off by 0.
    share: f64,
    /// At most this much counts of a turn, radians.
    most: f64,
    /// From this turn on a foot is free, radians.
    free_from: f64,
}

impl Steadied {
    /// A foot that is so much larger beside its leg than the source's.
    pub(in crate::retarget) fn of_size(beside_leg: f64) -> Self {
        Self { share: 1.0 - beside_leg.max(1.0).recip(), most: STANDS, free_from: TURNS }
    }

    /// A foot of which the source does not say how it is turned.
    pub(in crate::retarget) fn of_stiff_foot() -> Self {
        Self { share: 1.0, most: ANKLE_GIVES, free_from: std::f64::consts::FRAC_PI_2 }
    }

    /// What is taken off a turn, as a rotation vector.
    fn of_turn(&self, turn: DQuat) -> DVec3 {
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let vector = turn.to_scaled_axis();
        let angle = vector.length();
        if angle <= 0.0 {
            return DVec3::ZERO;
        }
        let counts = 1.0 - smootherstep((angle - self.free_from) / TURNS_FADE);
        vector * (self.share * approach(angle, 0.0, self.most) * counts / angle)
    }
}

/// How the end of a foot and its toes are turned, in plan space.
type Turned = [DQuat; 2];

impl PlantStage {
    /// Takes turns off feet that stand.
    pub(in crate::retarget) fn steady(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let feet: Vec<&PlantedFoot> = self.feet.iter().filter(|foot| foot.steadied.share > 0.0).collect();
        if feet.is_empty() || !self.op.steady || self.op.mode == PlantMode::Grounding {
            return Ok(());
        }
        let width = feet.len();
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Turned]| {
            self.posing.fill_model(pose, &work.target, frame);
            for (foot, turned) in feet.iter().zip(row) {
                *turned = self.turned(foot, pose, work, frame);
            }
        };
        let rows: Vec<Turned> = work.rows(width, || self.posing.pose(), fill)?;
        let rests = |(index, foot): (usize, &&PlantedFoot)| -> Vec<[DVec3; 2]> {
            let of_part = |part: usize| -> Vec<DVec3> {
                let turned: Vec<DQuat> = rows.iter().skip(index).step_by(width).map(|row| row[part]).collect();
                self.taken_off(&turned, &work.contacts, foot, work.performed).collect()
            };
            let (ends, toes) = (of_part(0), of_part(1));
            ends.into_iter().zip(toes).map(|(end, toes)| [end, toes]).collect()
        };
        let taken: Vec<Vec<[DVec3; 2]>> = feet.par_iter().enumerate().map(rests).collect();
        let turn = |foot: usize, part: usize, frame: usize, alpha: f64| {
            DQuat::from_scaled_axis(-taken[foot][frame][part] * alpha)
        };
        let alpha = |frame: usize| self.schedule.alpha_at(work.moment(frame));
        // Toes keep how they are turned, but for their own part, while the foot below which they hang turns.
        let balls: Vec<(usize, usize, Changed)> = feet
            .iter()
            .enumerate()
            .filter_map(|(index, foot)| {
                let slot = foot.ball?;
                let changed = Changed { joint: self.posing.joint(slot), rotates: true, moves: false };
                Some((index, slot, changed))
            })
            .collect();
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Change]| {
            self.posing.fill_model(pose, &work.target, frame);
            for ((index, slot, _), change) in balls.iter().zip(row) {
                let foot = feet[*index];
                let [end, _] = self.turned(foot, pose, work, frame);
                let with_goal = end * pose.model[foot.end].rotation.conjugate();
                let alpha = alpha(frame);
                let above = turn(*index, 0, frame, alpha) * with_goal * self.posing.parent_of(pose, *slot).rotation;
                let toes = turn(*index, 1, frame, alpha) * with_goal * pose.model[*slot].rotation;
                change.rotation = (above.conjugate() * toes).normalize().as_quat();
            }
        };
        let changes = work.rows(balls.len(), || self.posing.pose(), fill)?;
        work.change_goals(self.limb_count, |work, frame, goals| {
            let alpha = self.schedule.alpha_at(work.moment(frame));
            for (index, foot) in feet.iter().enumerate() {
                let goal = &mut goals[foot.limb];
                goal.rotation = (turn(index, 0, frame, alpha) * goal.rotation).normalize();
            }
        })?;
        work.write(&balls.iter().map(|(_, _, changed)| *changed).collect::<Vec<_>>(), &changes);
        Ok(())
    }

    /// How a foot is turned when its end is as its goal says.
    fn turned(&self, foot: &PlantedFoot, pose: &Pose, work: &Work<'_>, frame: usize) -> Turned {
        let goal = work.goals[frame * self.limb_count + foot.limb].rotation;
        let model = |slot: Option<usize>| slot.map_or(DQuat::IDENTITY, |slot| pose.model[slot].rotation);
        let toes = goal * pose.model[foot.end].rotation.conjugate() * model(foot.ball);
        [goal, toes]
    }

    /// What is taken off the turns of a foot or its toes: fully in contacts, and less and less around them.
    fn taken_off(
        &self,
        turned: &[DQuat],
        contacts: &ContactPoints,
        foot: &PlantedFoot,
        times: &[f64],
    ) -> impl Iterator<Item = DVec3> + use<> {
        let mut sums = vec![(DVec3::ZERO, 0.0, 0.0); turned.len()];
        let touches: Vec<bool> = (0..turned.len()).map(|frame| contacts.touches(foot.limb, frame)).collect();
        let lies = |frame: &usize| {
            let touches = |part: Part| contacts.find(foot.limb, part).is_some_and(|point| point.touches[*frame]);
            touches(Part::End) && touches(Part::Ball)
        };
        for (first, last) in runs(&touches) {
            let is_ever_flat = (first..=last).any(|frame| lies(&frame));
            let counts = |frame: &usize| !is_ever_flat || lies(frame);
            let stands = standing(turned, (first..=last).filter(counts)).conjugate();
            let near = |seconds: f64| smootherstep(1.0 - seconds / self.op.blend_seconds.max(f64::MIN_POSITIVE));
            let before = (0..first).rev().map(|frame| (frame, near(times[first] - times[frame])));
            let after = (last + 1..turned.len()).map(|frame| (frame, near(times[frame] - times[last])));
            let fading = before.take_while(|(_, hold)| *hold > 0.0).chain(after.take_while(|(_, hold)| *hold > 0.0));
            for (frame, hold) in fading.chain((first..=last).map(|frame| (frame, 1.0))) {
                let (sum, weights, holds) = &mut sums[frame];
                *sum += foot.steadied.of_turn(turned[frame] * stands) * hold;
                *weights += hold;
                *holds = either(*holds, hold);
            }
        }
        sums.into_iter().map(|(sum, weights, holds)| if weights > 0.0 { sum * (holds / weights) } else { sum })
    }
}

/// The mean of how a foot is turned in the middle of some frames; nothing where there is none.
fn standing(turned: &[DQuat], frames: impl Iterator<Item = usize> + Clone) -> DQuat {
    let count = frames.clone().count();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
    let skipped = (count as f64 * ENDS).floor() as usize;
    let middle = frames.skip(skipped).take(count - 2 * skipped).map(|frame| turned[frame]);
    let Some(first) = middle.clone().next() else { return DQuat::IDENTITY };
    let aligned = middle.map(|turned| near(turned, first));
    let sum = aligned.fold(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), |sum, turned| sum + turned);
    if sum.length_squared() > 0.0 { sum.normalize() } else { first }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nearly all is taken off a foot of endless size.
    const LARGEST: Steadied = Steadied { share: 1.0, most: STANDS, free_from: TURNS };

    #[test]
    fn small_turns_are_those_of_a_foot_that_stands() {
        let turn = DVec3::new(0.3, -0.2, 0.5).normalize() * 0.03;
        let found = LARGEST.of_turn(DQuat::from_scaled_axis(turn));
        assert!(found.distance(turn) < 0.01 * turn.length(), "nearly all of {turn}: {found}");
        assert!(
            LARGEST.of_turn(-DQuat::from_scaled_axis(turn)).distance(found) < 1e-12,
            "whichever quaternion says so"
        );
        assert_eq!(LARGEST.of_turn(DQuat::IDENTITY), DVec3::ZERO, "none");
        let twice = Steadied::of_size(2.0).of_turn(DQuat::from_scaled_axis(turn));
        assert!(twice.distance(found / 2.0) < 1e-12, "half of it of a foot of twice the size");
        assert_eq!(Steadied::of_size(0.5).share, 0.0, "none of a smaller one");
    }

    #[test]
    fn a_foot_that_turns_far_is_free() {
        let found = |angle: f64| LARGEST.of_turn(DQuat::from_rotation_y(angle)).y;
        let angles: Vec<f64> = (0..300).map(|step| f64::from(step) * 0.01).collect();
        assert!(angles.iter().all(|angle| (0.0..=STANDS).contains(&found(*angle))), "never more than a little");
        assert!(angles.windows(2).all(|pair| (found(pair[1]) - found(pair[0])).abs() < 0.011), "never at once");
        assert_eq!([found(1.7), found(3.1), found(-3.1)], [0.0; 3], "from a quarter turn on nothing");
    }

    #[test]
    fn a_foot_that_nothing_is_known_of_stays_behind_its_shin_by_what_an_ankle_gives() {
        let left = |angle: f64| angle - Steadied::of_stiff_foot().of_turn(DQuat::from_rotation_y(angle)).y;
        assert!(left(0.3) < 0.04, "it stands: {}", left(0.3));
        assert!((left(1.5) - 1.0).abs() < 0.01, "it goes along: {}", left(1.5));
        assert!((left(3.0) - 3.0).abs() < 1e-12, "nobody stands like that: {}", left(3.0));
    }

    #[test]
    fn a_foot_stands_as_it_does_in_the_middle() {
        let turned: Vec<DQuat> = (0..10_i32)
            .map(|frame| {
                let turn = DQuat::from_rotation_x(if (2..8).contains(&frame) { 0.1 } else { 1.0 });
                if frame % 2 == 0 { turn } else { -turn }
            })
            .collect();
        let found = standing(&turned, 0..10);
        assert!(found.angle_between(DQuat::from_rotation_x(0.1)) < 1e-6, "{found}");
        assert_eq!(standing(&turned, 9..10), turned[9], "a single frame");
    }
}
