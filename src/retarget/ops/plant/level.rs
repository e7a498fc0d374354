//! Feet that stand on an edge by the measure of the rest pose, and on their soles in truth.

use glam::{DQuat, DVec3};

use crate::model::rotation::smootherstep;

use super::PlantStage;
use crate::retarget::{
    stages::contact_points::Part,
    stages::{temporal::median, work::Work},
};

/// Up to this roll feet are left as they are, in radians: people do not stand perfectly level.
const LITTLE_ROLL: f64 = 0.052;
/// Radians beyond that over which more and more of it is taken off.
const ROLL_FADE: f64 = 0.087;
/// In fewer frames nobody can tell how a foot stands.
const MIN_FRAMES: usize = 3;

/// How a foot lies at rest, in the axes of its end; unit vectors.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct FootAxes {
    pub(in crate::retarget) front: DVec3,
    pub(in crate::retarget) left: DVec3,
}

impl PlantStage {
    /// Turns feet about their length by what they are rolled in contacts with heel and ball: the same all along the clip.
    pub(in crate::retarget) fn level(&self, work: &mut Work<'_>) {
        for foot in self.feet.iter().filter(|_| self.op.level) {
            let Some(axes) = foot.axes else { continue };
            let contacts = &work.contacts;
            let (end, ball) = (contacts.find(foot.limb, Part::End), contacts.find(foot.limb, Part::Ball));
            let (Some(end), Some(ball)) = (end, ball) else { continue };
            let stands = (0..work.frame_count()).filter(|frame| end.touches[*frame] && ball.touches[*frame]);
            let goal = |frame: usize| frame * self.limb_count + foot.limb;
            let roll =
                |frame: usize| (work.goals[goal(frame)].rotation * axes.left).dot(self.up).clamp(-1.0, 1.0).asin();
            let mut rolls: Vec<f64> = stands.map(roll).collect();
            let Some(rolled) = median(&mut rolls).filter(|_| rolls.len() >= MIN_FRAMES) else { continue };
            let share = smootherstep((rolled.abs() - LITTLE_ROLL) / ROLL_FADE);
            if share == 0.0 {
                continue;
            }
            for frame in 0..work.frame_count() {
                let alpha = self.schedule.alpha_at(work.moment(frame));
                let turn = DQuat::from_axis_angle(axes.front, -rolled * share * alpha);
                work.goals[goal(frame)].rotation *= turn;
            }
        }
    }
}
