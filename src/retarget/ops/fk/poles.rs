//! A limb whose bend is turned to where the source's points. (docs/algorithm/legs.md.)

use crate::retarget::stages::posed::Step;
use crate::retarget::stages::posed::builder::StepBuilder;
use glam::DQuat;

use crate::model::rotation::signed_angle;

use crate::retarget::{
    ops::ik::goals::source_pole,
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

impl Step for PoleStep {
    fn apply(&self, figure: &mut Figure<'_>) {
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

/// A limb whose bend is turned to where the source's points.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Pole {
    /// Index into the limbs.
    pub(in crate::retarget) limb: usize,
    /// How much.
    pub(in crate::retarget) align: f64,
    /// Radians by which it is turned further.
    pub(in crate::retarget) offset: f64,
    /// Whether the angle between the rest poses' bends is kept.
    pub(in crate::retarget) keeps_offset: bool,
}

impl Pole {
    pub(in crate::retarget) fn step(self, builder: &mut StepBuilder<'_>) -> PoleStep {
        let Self { limb, align, offset, keeps_offset } = self;
        let stack = builder.stack;
        let pair = stack.limb(limb);
        let mut source = |joint: usize| builder.source(joint);
        let source = LimbSlots {
            start: source(pair.source.start),
            middle: source(pair.source.middle),
            end: source(pair.source.end),
        };
        let target = LimbSlots {
            start: builder.change(pair.target.start, true, false),
            middle: builder.target(pair.target.middle),
            end: builder.change(pair.target.end, true, false),
        };
        let kept_angle = if keeps_offset { stack.rest(limb).pole_angle } else { 0.0 };
        PoleStep { source, target, kept_angle, align, offset }
    }
}
