//! From the edits of an op to a stage.

use super::{
    super::{builder::StackBuilder, posing::Posing, work::Changed},
    PosedStage, Step,
};
use glam::DVec3;

use crate::{model::Transform, retarget::ops::schedule::Schedule};

impl PosedStage {
    /// The stage of the steps that `build` makes; nothing where there are none. They are made twice: to find out which joints are
    /// needed, and then with their slots.
    pub(in crate::retarget) fn new<S: Step + 'static>(
        stack: &StackBuilder<'_>,
        schedule: &Schedule,
        build: impl Fn(&mut StepBuilder<'_>) -> Vec<S>,
    ) -> Option<Self> {
        let mut first = StepBuilder::new(stack, None);
        if build(&mut first).is_empty() {
            return None;
        }
        let source = stack.source_posing(first.source_wanted);
        let target = stack.target_posing(first.target_wanted);
        let mut builder = StepBuilder::new(stack, Some((&source, &target)));
        let steps = build(&mut builder);
        let changed = builder.changed;
        let slots = changed.iter().map(|changed| target.slot(changed.joint)).collect();
        Some(Self { schedule: schedule.clone(), source, target, steps: Box::new(steps), fades: false, changed, slots })
    }
}

/// Collects which joints the steps of an op need, and gives them their slots.
pub(in crate::retarget) struct StepBuilder<'a> {
    pub(in crate::retarget) stack: &'a StackBuilder<'a>,
    posings: Option<(&'a Posing, &'a Posing)>,
    source_wanted: Vec<usize>,
    target_wanted: Vec<usize>,
    changed: Vec<Changed>,
}

impl<'a> StepBuilder<'a> {
    fn new(stack: &'a StackBuilder<'a>, posings: Option<(&'a Posing, &'a Posing)>) -> Self {
        Self { stack, posings, source_wanted: Vec::new(), target_wanted: Vec::new(), changed: Vec::new() }
    }

    pub(in crate::retarget) fn source(&mut self, joint: usize) -> usize {
        self.source_wanted.push(joint);
        self.posings.map_or(0, |(source, _)| source.slot(joint))
    }

    pub(in crate::retarget) fn target(&mut self, joint: usize) -> usize {
        self.target_wanted.push(joint);
        self.posings.map_or(0, |(_, target)| target.slot(joint))
    }

    pub(in crate::retarget) fn change(&mut self, joint: usize, rotates: bool, moves: bool) -> usize {
        match self.changed.iter_mut().find(|changed| changed.joint == joint) {
            Some(changed) => {
                changed.rotates |= rotates;
                changed.moves |= moves;
            }
            None => self.changed.push(Changed { joint, rotates, moves }),
        }
        self.target(joint)
    }

    /// How much higher the floors of result and clip are than those of the rest poses.
    pub(in crate::retarget) fn floors(&self) -> (DVec3, DVec3) {
        let ground = self.stack.ground();
        let raised = ground.up * (ground.target_floor - ground.target_rest_floor);
        (raised, ground.up * (ground.source_floor - ground.source_rest_floor))
    }

    /// The rest pose that motion is put onto, below the parent.
    pub(in crate::retarget) fn rest_below_parent(&self, joint: usize) -> Transform {
        let rest = &self.stack.target_rest;
        let above = self.stack.target.parent(joint).map_or(self.stack.plan_from_target, |parent| rest[parent]);
        above.relative(&rest[joint])
    }

    /// The topmost driven joints below a joint, which then change too.
    pub(in crate::retarget) fn driven_below(&mut self, joint: usize) -> Vec<usize> {
        let topmost = self.stack.topmost_driven_below(Some(joint));
        topmost.into_iter().map(|joint| self.change(joint, true, true)).collect()
    }
}
