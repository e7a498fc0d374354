//! A limb whose bend is turned to where the source's points. (docs/algorithm/legs.md.)

use glam::DQuat;

use crate::model::rotation::signed_angle;

use super::{
    super::{goals::source_pole, limbs::LimbSlots},
    figure::Figure,
};

/// One limb.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoleStep {
    pub(super) source: LimbSlots,
    pub(super) target: LimbSlots,
    /// The angle between the rest poses' bends, where it is kept.
    pub(super) kept_angle: f64,
    pub(super) align: f64,
    /// Radians.
    pub(super) offset: f64,
}

impl PoleStep {
    pub(super) fn apply(&self, figure: &mut Figure<'_>) {
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
