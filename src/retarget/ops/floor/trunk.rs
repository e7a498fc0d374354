//! A body that sits or lies on the floor: its trunk rests there, however thick the bodies are.
//!
//! The height of a pelvis is scaled by legs. A short-legged figure that lies is thick for its legs, so that a slender one would hover
//! over the floor, and the other way round it would be in it.

use glam::DVec2;

use super::{FloorFoot, FloorStage, Surface};
use crate::{
    model::{Canceled, rotation::smootherstep},
    retarget::{
        mapping::Ground,
        stages::{
            posing::{Pose, Posing},
            temporal::smoothed,
            work::{Resting, RestingPart, Work},
        },
    },
};

/// A trunk whose lowest point is higher over the floor does not rest on it, in legs of the source; and over how much that begins in clips in
/// which it does. Of figures whose trunks are near the floor as they stand, at such shares of that.
const RESTS_LEGS: f64 = 0.06;
const RESTS_FADE_LEGS: f64 = 0.4;
const RESTS_SHARE: f64 = 0.15;
const RESTS_FADE_SHARE: f64 = 0.6;
/// Over so much a trunk that rests begins to decide alone. Where it is only near the floor, it raises the pelvis beyond what feet ask for: a
/// figure that squats stands on them, and legs that are folded do not fold any farther.
const DECIDES_FADE_LEGS: f64 = 0.06;
/// A pelvis that is higher carries no trunk that rests, as a share of how high it is at rest, and over how much that begins: most clips are
/// done with that.
const UPRIGHT_SHARE: f64 = 0.85;
const UPRIGHT_FADE_SHARE: f64 = 0.1;
/// Standard deviation of the smoothing of what the pelvis is moved by.
const RESTING_SECONDS: f64 = 0.06;
/// Feet that are deeper below the floor are not in it, but on one that is lower, in legs.
pub(super) const SUNK_LEGS: f64 = 0.1;
/// The deepest that is taken over from another figure whose mesh shows it, in legs of the source.
const MAX_DEPTH_LEGS: f64 = 0.04;

/// The trunks of both sides.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct Trunks {
    /// The pose of the source's pelvis, and its slot there.
    pub(in crate::retarget) pelvis: (Posing, usize),
    pub(in crate::retarget) source: Surface,
    pub(in crate::retarget) target: Surface,
    /// How high the lowest point of the source's trunk is over its floor in its rest pose.
    pub(in crate::retarget) standing: f64,
    /// How high the source's pelvis is over its floor in its rest pose.
    pub(in crate::retarget) upright: f64,
}

impl Trunks {
    /// Frame by frame; nothing where the trunk never rests. `legs` are those of source and target, `is_same` of one figure on itself.
    fn resting(
        &self,
        work: &Work<'_>,
        ground: &Ground,
        legs: (f64, f64),
        is_same: bool,
    ) -> Result<Vec<Resting>, Canceled> {
        let ((source_leg, target_leg), (pelvis, slot)) = (legs, &self.pelvis);
        // Who walks down from the floor does not lie on it.
        let has_ground = work.contacts.level_below_raised_ground.is_some();
        let sunk = |frame: usize| {
            if !has_ground {
                return 0.0;
            }
            let soles = work.source_soles.iter().filter_map(|soles| soles.get(frame));
            let lowest = soles.copied().fold(f64::INFINITY, f64::min) - ground.source_floor;
            (lowest + SUNK_LEGS * source_leg).min(0.0)
        };
        let fill = |pose: &mut Pose, frame: usize, row: &mut [f64]| {
            pelvis.fill_model(pose, work.source, frame);
            row[0] = pose.model[*slot].translation.dot(ground.up) - ground.source_floor - sunk(frame);
        };
        let heights = work.rows(1, || pelvis.pose(), fill)?;
        let bent = |height: f64| 1.0 - smootherstep((height / self.upright - UPRIGHT_SHARE) / UPRIGHT_FADE_SHARE);
        if heights.iter().all(|height| bent(*height) <= 0.0) {
            return Ok(Vec::new());
        }
        let standing = (self.standing / source_leg).max(0.0);
        let begin = RESTS_LEGS.min(RESTS_SHARE * standing);
        let fade = RESTS_FADE_LEGS.min(RESTS_FADE_SHARE * standing).max(f64::MIN_POSITIVE);
        let is_same = is_same && self.source.is_guessed() == self.target.is_guessed();
        let deepest = if self.source.is_guessed() { 0.0 } else { -MAX_DEPTH_LEGS };
        let fill = |poses: &mut (Pose, Pose), frame: usize, row: &mut [DVec2]| {
            let bent = bent(heights[frame]);
            if bent <= 0.0 {
                return;
            }
            self.source.posing.fill_model(&mut poses.0, work.source, frame);
            let sunk = sunk(frame) / source_leg;
            let lowest = self.source.lowest(|slot| &poses.0.model[slot], ground.up) - ground.source_floor;
            let source = lowest / source_leg - sunk;
            let share = |fade: f64| bent * (1.0 - smootherstep((source - begin) / fade));
            if share(fade) > 0.0 {
                self.target.posing.fill_model(&mut poses.1, &work.target, frame);
                let lowest = self.target.lowest(|slot| &poses.1.model[slot], ground.up) - ground.target_floor;
                let target = lowest - sunk * target_leg;
                let wanted = if is_same { source } else { source.max(deepest) };
                let off = DVec2::new(1.0, wanted * target_leg - target);
                row.copy_from_slice(&[off * share(fade.min(DECIDES_FADE_LEGS)), off * share(fade)]);
            }
        };
        let rows = work.rows(2, || (self.source.posing.pose(), self.target.posing.pose()), fill)?;
        let over_time = |index: usize| -> Vec<DVec2> {
            let values: Vec<DVec2> = rows.iter().skip(index).step_by(2).copied().collect();
            smoothed(&values, work.performed, RESTING_SECONDS)
        };
        if rows.iter().all(|row| row.x < 1.0) {
            return Ok(Vec::new());
        }
        let part = |value: DVec2| RestingPart { share: value.x, shift: value.y };
        let both = over_time(0).into_iter().zip(over_time(1));
        Ok(both.map(|(decides, near)| Resting { decides: part(decides), near: part(near) }).collect())
    }
}

impl FloorStage {
    /// Sees to it that it is known when the trunk rests, before the pelvis is moved.
    pub(in crate::retarget) fn find_resting(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let Some(trunks) = self.trunks.as_ref().filter(|_| work.resting.is_none()) else { return Ok(()) };
        let is_same = self.feet.iter().all(|foot: &FloorFoot| foot.is_same);
        work.resting = Some(trunks.resting(work, &self.ground, (self.source_leg, self.target_leg), is_same)?);
        Ok(())
    }
}
