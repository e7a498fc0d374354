//! A limb whose bend is turned to where the source's points. (docs/algorithm/legs.md.)

use glam::DQuat;

use crate::model::rotation::signed_angle;

use crate::retarget::{
    ops::ik::source_pole,
    stages::{limbs::LimbSlots, posed::figure::Figure},
};

/// One limb.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct PoleStep {
    pub(in crate::retarget) source: LimbSlots,
    pub(in crate::retarget) target: LimbSlots,
    /// The angle between the rest poses' bends, where it is kept.
    pub(in crate::retarget) kept_angle: f64,
    pub(in crate::retarget) align: f64,
    /// Radians.
    pub(in crate::retarget) offset: f64,
}

impl PoleStep {
    pub(in crate::retarget) fn apply(&self, figure: &mut Figure<'_>) {
        let LimbSlots { start, middle, end } = self.target;
        let places = [start, middle, end].map(|slot| figure.model(slot).translation);
        let Some(line) = (places[2] - places[0]).try_normalize() else { return };
        let pole = source_pole(self.source.places(figure.source), places, self.kept_angle);
        let bent = places[1] - places[0];
        let off = bent - line * bent.dot(line);
        // The pole is as long as it is sure: a straight limb of the source bends nowhere.
        let angle = signed_angle(off, pole, line) * pole.length() * self.align;
        let (upper, hand) = (figure.model(start).rotation, figure.model(end).rotation);
        figure.turn_to(start, DQuat::from_axis_angle(line, angle + self.offset) * upper);
        figure.turn_to(end, hand);
    }
}
