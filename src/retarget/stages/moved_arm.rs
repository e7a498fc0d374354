//! An arm whose wrist is moved: the elbow bends, and the hand keeps how it is turned.

use glam::DVec3;

use super::{
    posing::{Pose, Posing},
    solve::{AXIS_SECONDS, Around, HINGE_WEIGHT, SolvedLimb},
    temporal::smoothed,
    work::{Change, Changed, Goal, Work},
};
use crate::model::{Canceled, rotation::smootherstep};

/// An arm that is extended to the first share of its length bends as it has to, one that is to the second does not.
const BENT: f64 = 0.85;
const STRAIGHT: f64 = 0.98;

/// An arm of the target by slots of a posing, which whoever moves it has.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct MovedArm {
    pub(in crate::retarget) limb: SolvedLimb,
    /// Upper arm and forearm, and the hand where it turns about its wrist.
    pub(in crate::retarget) changed: Vec<Changed>,
}

impl MovedArm {
    /// How much of what its wrist is moved by its elbow may bend for: none of it where the arm is nearly straight, since to bring the wrist nearer
    /// by a little, the elbow would have to bend by a lot.
    pub(in crate::retarget) fn bends(&self, pose: &Pose) -> f64 {
        let [shoulder, elbow, wrist] = self.limb.slots.places(pose);
        let length = shoulder.distance(elbow) + elbow.distance(wrist);
        let extension = shoulder.distance(wrist) / length.max(f64::MIN_POSITIVE);
        1.0 - smootherstep((extension - BENT) / (STRAIGHT - BENT))
    }

    /// What its wrist moves by where it should move by so much and the elbow bends for a share of that: otherwise the arm swings.
    fn reachable(&self, pose: &Pose, wanted: DVec3, bends: f64) -> DVec3 {
        let [shoulder, _, wrist] = self.limb.slots.places(pose);
        let line = wrist - shoulder;
        let (now, then) = (line.length(), (line + wanted).length());
        (line + wanted).normalize_or_zero() * (now + (then - now) * bends) - line
    }

    /// What the wrist reaches for that is moved by so much.
    fn goal(&self, pose: &Pose, by: DVec3) -> Goal {
        let [start, middle, end] = self.limb.slots.places(pose);
        let length = start.distance(middle) + middle.distance(end);
        Goal {
            position: end + by,
            rotation: pose.model[self.limb.slots.end].rotation,
            extension: start.distance(end) / length.max(f64::MIN_POSITIVE),
            ..Goal::default()
        }
    }

    /// About which axes the arm bends, frame by frame: an arm that is nearly straight does not say it, as a knee does not. Smooth in the
    /// model, since what an arm rolls, its forearm rolls back.
    fn axes(&self, posing: &Posing, work: &Work<'_>) -> Result<Vec<DVec3>, Canceled> {
        let fill = |pose: &mut Pose, frame: usize, row: &mut [DVec3]| {
            posing.fill_model(pose, &work.target, frame);
            let axis = self.limb.weighted_axis(&self.limb.place(pose), &self.goal(pose, DVec3::ZERO));
            row[0] = pose.model[self.limb.slots.start].rotation * (axis + self.limb.rest.hinge * HINGE_WEIGHT);
        };
        let rows = work.rows(1, || posing.pose(), fill)?;
        Ok(smoothed(&rows, work.performed, AXIS_SECONDS))
    }

    /// Moves the wrist by so much at every frame, in plan units, as far as the arm reaches without its elbow bending for more than a share of it. What
    /// is less than `little` is nothing.
    pub(in crate::retarget) fn lead_wrist(
        &self,
        posing: &Posing,
        wanted: impl Fn(usize) -> DVec3 + Sync,
        bends: impl Fn(&Pose, usize) -> f64 + Sync,
        little: f64,
        work: &mut Work<'_>,
    ) -> Result<(), Canceled> {
        if !(0..work.frame_count()).any(|frame| wanted(frame).length() > little) {
            return Ok(());
        }
        let reached = |pose: &mut Pose, frame: usize, row: &mut [DVec3]| {
            let wanted = wanted(frame);
            if wanted.length() > little {
                posing.fill_model(pose, &work.target, frame);
                row[0] = self.reachable(pose, wanted, bends(pose, frame));
            }
        };
        let reached = work.rows(1, || posing.pose(), reached)?;
        self.move_wrist(posing, |frame| reached[frame], little, work)
    }

    /// Moves the wrist by so much at every frame, in plan units; where that is less than `little`, the arm stays as it is.
    pub(in crate::retarget) fn move_wrist(
        &self,
        posing: &Posing,
        by: impl Fn(usize) -> DVec3 + Sync + Send,
        little: f64,
        work: &mut Work<'_>,
    ) -> Result<(), Canceled> {
        let axes = self.axes(posing, work)?;
        let slots = [self.limb.slots.start, self.limb.slots.middle, self.limb.slots.end];
        let width = self.changed.len();
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Change]| {
            let by = by(frame);
            if by.length_squared() < little * little {
                let kept = |slot| posing.local_rotation(slot, &work.target, frame);
                row.iter_mut().zip(slots).for_each(|(change, slot)| change.rotation = kept(slot));
                return;
            }
            posing.fill(pose, &work.target, frame);
            let goal = self.goal(pose, by);
            let axis = pose.model[self.limb.slots.start].rotation.conjugate() * axes[frame];
            let around = Around { axis: axis.try_normalize(), change: None };
            row.copy_from_slice(&self.limb.solve(posing, pose, &goal, around).changes[..width]);
        };
        let rows = work.rows(width, || posing.pose(), fill)?;
        work.write_columns(&self.changed, |frame, index| &rows[frame * width + index]);
        Ok(())
    }
}
