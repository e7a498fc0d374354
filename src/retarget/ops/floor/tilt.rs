//! Feet tilt less where they would go through the floor, and a little more where they would hover.
//!
//! A foot that is larger than the source's, or that has no toes to bend, goes through the floor when it is tilted as the source's
//! foot is: with its heel when it lands, with its tip when it leaves. Lifting it would bend the knee; instead it is turned toward
//! standing flat about its ankle, just as far as needed and at most until it is flat. A foot with its heel up that hovers while the
//! source's stands is turned the other way, a few degrees at the most. What is still missing then is left to lifting. Toes turn along until they are
//! flat. Runs before feet are planted,
//! so that what stands is held where it is then.

use glam::{DQuat, DVec3};

use crate::model::rotation::smootherstep;

use crate::model::Canceled;

use super::{
    Clearance, FloorFoot, FloorStage, PlacedFoot, Wanted, foot::Tilted, holds, level::is_flat, lift::smooth_above,
};
use crate::retarget::stages::{
    posing::Pose,
    two_bone::arc,
    work::{Change, Changed, Work},
};

/// Standard deviation of the smoothing of how far feet are turned.
const TURN_SECONDS: f64 = 0.05;
/// Feet that are tilted by more than this are not standing: somebody kneels or lies. Radians, and over how many that fades.
const STANDS: f64 = 1.8;
const STANDS_FADE: f64 = 0.6;
/// A foot is tilted more by at most this, in radians, when the points that it is to stand on are at least so far before its ankle, for
/// a leg of 1 m.
const MAX_MORE: f64 = 0.25;
const BEFORE_METERS: f64 = 0.06;
/// Feet that are tilted less than this, in radians, stand flat: nothing says about which axis they would be tilted more.
const SURE_TILT: f64 = 0.25;
/// A foot is turned by at most what it is in the floor by, divided by this, for a leg of 1 m. A point right below the ankle goes into the floor
/// by a millimeter as a sole rolls, and all of the tilt would not bring it out.
const MIN_ARM_METERS: f64 = 0.04;
/// A foot that is in the floor by less than this is not turned, for a leg of 1 m.
const LITTLE_METERS: f64 = 1e-4;

impl FloorStage {
    /// Sets feet flat of which the source does not say how they are turned, the shortest way, as much as they are held.
    pub(in crate::retarget) fn flatten(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        if self.feet.iter().all(|foot| foot.flat.is_none()) {
            return Ok(());
        }
        let holds: Vec<Vec<f64>> = self.feet.iter().map(|foot| holds(foot.limb, work)).collect();
        work.change_goals(self.limb_count, |work, frame, goals| {
            let alpha = self.schedule.alpha_at(work.moment(frame));
            for (foot, holds) in self.feet.iter().zip(&holds) {
                let Some(flat) = foot.flat else { continue };
                let goal = &mut goals[foot.limb];
                let now = goal.rotation * flat;
                let turn = arc(now, self.ground.up, now.any_orthonormal_vector());
                goal.rotation = DQuat::IDENTITY.slerp(turn, holds[frame] * alpha) * goal.rotation;
            }
        })
    }

    /// Turns the goals of feet.
    pub(in crate::retarget) fn tilt(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        self.find_source_soles(work)?;
        self.find_resting(work)?;
        let turns = self.turns(work)?;
        if turns.iter().flatten().all(|turn| *turn == 0.0) {
            return Ok(());
        }
        self.keep_toes(&turns, work)?;
        work.change_goals(self.limb_count, |_, frame, goals| {
            for (foot, turns) in self.feet.iter().zip(&turns) {
                let goal = &mut goals[foot.limb];
                goal.rotation = (self.turn(foot.stands, goal.rotation, turns[frame]) * goal.rotation).normalize();
            }
        })
    }

    /// How far every foot is turned, frame by frame; radians.
    fn turns(&self, work: &Work<'_>) -> Result<Vec<Vec<f64>>, Canceled> {
        let width = self.feet.len();
        let rows = self.clearances(work)?;
        let standing = self.standing(&rows, work);
        let levels = self.levels(&rows, standing, work);
        let holds = self.holds(&rows, &levels, standing, work);
        let wanted = |foot: usize, frame: usize| {
            let clearance = &rows[frame * width + foot];
            self.wanted((foot, frame), clearance, &levels, holds[foot][frame], work.resting(frame).decides.share)
        };
        // Where a foot stands on its whole sole, what it is off by is lifted; only what it is off by beside that is tilt. Else a foot
        // whose floor is too low or too high in the capture would land flat where the source's lands on its heel.
        let has_flat =
            (0..work.frame_count()).any(|frame| self.feet.iter().any(|foot| is_flat(foot.limb, frame, work)));
        let is_touching = standing.is_some();
        let wants = |foot: usize, frame: usize, clearance: &Clearance| {
            let stands = is_flat(self.feet[foot].limb, frame, work)
                || (!has_flat
                    && clearance.is_level
                    && self.carries(foot, frame, clearance.source - levels.standing(foot, frame), standing));
            stands.then(|| clearance.limited(wanted(foot, frame).height - clearance.flat, is_touching))
        };
        let shifts = self.shifts(&rows, work, wants);
        // A foot that leaves the floor tilts less instead: the leg behind the body is straight, and there is no bending its knee.
        let leaves = |foot: usize, frame: usize| {
            work.contacts.touches(self.feet[foot].limb, frame) && self.is_on_toes(foot, frame, work)
        };
        let lifts = |foot: usize| -> Vec<f64> {
            let wants = |frame: usize| wants(foot, frame, &rows[frame * width + foot]);
            let lifts = self.lifts_of_contacts(foot, &shifts, work, wants).into_iter().enumerate();
            lifts.map(|(frame, lift)| if leaves(foot, frame) { shifts[frame] } else { lift }).collect()
        };
        let lifts: Vec<Vec<f64>> = (0..width).map(lifts).collect();
        let fill = |pose: &mut Pose, frame: usize, row: &mut [f64]| {
            let is_off = |foot: usize| {
                let lowest = rows[frame * width + foot].target + lifts[foot][frame];
                let off = if holds[foot][frame] > 0.0 {
                    (wanted(foot, frame).height - lowest).abs()
                } else {
                    wanted(foot, frame).deepest - lowest
                };
                off > LITTLE_METERS * self.target_leg
            };
            if !(0..width).any(is_off) {
                return;
            }
            self.target.fill_model(pose, &work.target, frame);
            for (index, (foot, turn)) in self.feet.iter().zip(row).enumerate() {
                let goal = &work.goals[frame * self.limb_count + foot.limb];
                let placed = PlacedFoot::posed(foot.target, pose).moved_to(goal.position, goal.rotation);
                let wanted = wanted(index, frame).shifted(self.ground.target_floor - lifts[index][frame]);
                let lowest = rows[frame * width + index].target + self.ground.target_floor;
                let turned = self.needed_turn(foot, (&placed, lowest), wanted, holds[index][frame]);
                let stands = 1.0 - work.resting(frame).decides.share;
                *turn = turned * self.schedule.alpha_at(work.moment(frame)) * stands;
            }
        };
        let needed = work.rows(width, || self.target.pose(), fill)?;
        let over_time = |foot: usize| {
            let needed: Vec<f64> = needed.iter().skip(foot).step_by(width).copied().collect();
            if needed.iter().all(|turn| *turn == 0.0) {
                needed
            } else {
                smooth_above(&needed, &needed, work.performed, TURN_SECONDS)
            }
        };
        Ok((0..width).map(over_time).collect())
    }

    /// How far a foot has to be turned whose lowest point is so high, but for toes that bend where they would go through the floor; radians.
    fn needed_turn(&self, foot: &FloorFoot, (placed, lowest): (&PlacedFoot, f64), wanted: Wanted, hold: f64) -> f64 {
        let up = self.ground.up;
        let tilted = foot.stands.filter(|_| !foot.is_same).and_then(|flat| Tilted::of(placed.end.1 * flat, up));
        let Some(tilted) = tilted else { return 0.0 };
        let stands = 1.0 - smootherstep((tilted.angle - STANDS) / STANDS_FADE);
        let sole = &foot.target_sole;
        let of_yielding = if foot.toes_give_way { f64::NEG_INFINITY } else { f64::INFINITY };
        let most_for = |height: f64| (height - lowest).max(0.0) / (MIN_ARM_METERS * self.target_leg);
        let least = placed.turn_to(sole, up, &tilted, wanted.deepest, 0.0, of_yielding).min(most_for(wanted.deepest));
        if hold <= 0.0 {
            return least * stands;
        }
        let before = placed.farthest_before(sole, up.cross(tilted.axis)) / self.target_leg;
        let most = MAX_MORE * smootherstep(tilted.angle / SURE_TILT) * smootherstep(before / BEFORE_METERS - 1.0);
        // Toes that stand already keep a foot from being turned down to the floor.
        let held =
            placed.turn_to(sole, up, &tilted, wanted.height, -most, of_yielding.max(0.0)).min(most_for(wanted.height));
        least.max(held * hold) * stands
    }

    /// Toward flat by an angle, and no farther; `flat` is up at rest in the axes of what is turned.
    fn turn(&self, flat: Option<DVec3>, rotation: DQuat, angle: f64) -> DQuat {
        let tilted = flat.filter(|_| angle != 0.0).and_then(|flat| Tilted::of(rotation * flat, self.ground.up));
        let turn = |tilted: Tilted| DQuat::from_axis_angle(tilted.axis, angle.min(tilted.angle));
        tilted.map_or(DQuat::IDENTITY, turn)
    }

    /// Toes turn along with the foot above them until they are flat.
    fn keep_toes(&self, turns: &[Vec<f64>], work: &mut Work<'_>) -> Result<(), Canceled> {
        let turned = |(index, foot): (usize, &FloorFoot)| {
            let slot = foot.target.ball.filter(|_| foot.toes_give_way)?;
            turns[index].iter().any(|turn| *turn != 0.0).then_some((index, slot))
        };
        let feet: Vec<(usize, usize)> = self.feet.iter().enumerate().filter_map(turned).collect();
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Change]| {
            if feet.iter().all(|(index, _)| turns[*index][frame] == 0.0) {
                for ((_, slot), change) in feet.iter().zip(row) {
                    change.rotation = self.target.local_rotation(*slot, &work.target, frame);
                }
                return;
            }
            self.target.fill_model(pose, &work.target, frame);
            for ((index, slot), change) in feet.iter().zip(row) {
                let foot = &self.feet[*index];
                let goal = work.goals[frame * self.limb_count + foot.limb].rotation;
                let to_goal = goal * pose.model[foot.target.end].rotation.conjugate();
                let above = to_goal * self.target.parent_of(pose, *slot).rotation;
                let toes = to_goal * pose.model[*slot].rotation;
                let angle = turns[*index][frame];
                let turn = self.turn(foot.stands, goal, angle);
                let of_toes = self.turn(foot.toes_up, toes, angle.max(0.0));
                change.rotation = ((turn * above).conjugate() * of_toes * toes).normalize().as_quat();
            }
        };
        let rows = work.rows(feet.len(), || self.target.pose(), fill)?;
        let changed =
            |(_, slot): &(usize, usize)| Changed { joint: self.target.joint(*slot), rotates: true, moves: false };
        work.write(&feet.iter().map(changed).collect::<Vec<_>>(), &rows);
        Ok(())
    }
}
