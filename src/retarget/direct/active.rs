//! What the loop over frames still has to compute where some outputs do without it.

use super::{
    super::plan::{
        ChordStep, Driver, Needs, Output, Parent, Plan, Sample, TargetStep, Translation, TwistEnd, TwistSegment,
    },
    Direct,
};

/// Steps of a plan, in its order.
pub(in super::super) struct Active {
    /// Slots of the source.
    pub(in super::super) source: Vec<usize>,
    /// Slots of the target, each with the index of its output among [`Self::outputs`].
    pub(in super::super) target: Vec<(usize, Option<usize>)>,
    /// Outputs whose tracks the loop fills.
    pub(in super::super) outputs: Vec<Output>,
}

impl Active {
    /// What outputs need that are not found directly.
    pub(in super::super) fn new(plan: &Plan, direct: &[Option<Direct>]) -> Self {
        let outputs: Vec<Output> =
            plan.outputs.iter().zip(direct).filter(|(_, direct)| direct.is_none()).map(|(output, _)| *output).collect();
        let mut output_of: Vec<Option<usize>> = vec![None; plan.target_steps.len()];
        for (index, output) in outputs.iter().enumerate() {
            output_of[output.slot] = Some(index);
        }
        let mut needed = Needed { plan, target: vec![false; plan.target_steps.len()], source: Vec::new() };
        needed.source.resize(plan.source_steps.len(), !plan.normalizes);
        // What carries chains along reads all that was laid out.
        needed.target.fill(!plan.normalizes);
        for output in &outputs {
            needed.output(output.slot);
        }
        let chosen = |needed: &[bool]| -> Vec<usize> { (0..needed.len()).filter(|slot| needed[*slot]).collect() };
        Self {
            source: chosen(&needed.source),
            target: chosen(&needed.target).into_iter().map(|slot| (slot, output_of[slot])).collect(),
            outputs,
        }
    }
}

struct Needed<'a> {
    plan: &'a Plan,
    target: Vec<bool>,
    source: Vec<bool>,
}

impl Needed<'_> {
    /// A target slot that is written, for which its parent is needed too.
    fn output(&mut self, slot: usize) {
        self.target(slot);
        self.target_parent(slot);
    }

    fn target_parent(&mut self, slot: usize) {
        if let Parent::Slot(parent) = self.plan.target_steps[slot].parent {
            self.target(parent);
        }
    }

    fn target(&mut self, slot: usize) {
        if std::mem::replace(&mut self.target[slot], true) {
            return;
        }
        let step = &self.plan.target_steps[slot];
        if needs_parent(step) {
            self.target_parent(slot);
        }
        if let Some(ride) = &step.ride {
            self.target(ride.on);
        }
        match &step.driver {
            Driver::Hold | Driver::Carried(_) => {}
            Driver::Pelvis(driver) => self.source(driver.source_slot),
            Driver::Shoulder(driver) => self.sample(driver.sample),
            Driver::Twist(driver) => {
                match driver.segment {
                    TwistSegment::Slot(segment) => self.target(segment),
                    TwistSegment::Source(sample, _) => self.sample(sample),
                }
                match driver.against {
                    TwistEnd::Carrier(carrier, _) => self.target(carrier),
                    TwistEnd::End(sample, ..) => self.sample(sample),
                }
            }
            Driver::Model(driver) => {
                self.sample(driver.sample);
                driver.also.iter().for_each(|(sample, _)| self.sample(*sample));
                if let Translation::Scaled { parent_slot: Some(parent), .. } = driver.translation {
                    self.source(parent);
                }
                if let Some(begin) = &driver.begin {
                    self.chord(begin);
                }
                if let Some(chord) = driver.chord {
                    self.begin_of(chord);
                }
            }
        }
    }

    /// The step that finds a chord's turn: the last one that begins a chord at this slot or the one before.
    fn begin_of(&mut self, chord: usize) {
        let begins = |step: &TargetStep| match &step.driver {
            Driver::Model(driver) => driver.begin.as_ref().is_some_and(|begin| begin.fills(chord)),
            _ => false,
        };
        if let Some(slot) = self.plan.target_steps.iter().position(begins) {
            self.target(slot);
        }
    }

    fn chord(&mut self, step: &ChordStep) {
        self.source(step.source_start);
        self.source(step.source_end);
        step.turned.iter().chain(&step.kept).for_each(|(sample, _)| self.sample(*sample));
    }

    fn sample(&mut self, sample: Sample) {
        match sample {
            Sample::At(slot) => self.source(slot),
            Sample::Between { first, second, .. } => {
                self.source(first);
                self.source(second);
            }
        }
    }

    fn source(&mut self, slot: usize) {
        if !std::mem::replace(&mut self.source[slot], true)
            && let Parent::Slot(parent) = self.plan.source_steps[slot].parent
        {
            self.source(parent);
        }
    }
}

/// Whether a step looks at its parent to know its own transform.
#[expect(clippy::float_cmp, reason = "exactly one means that there is nothing to blend")]
fn needs_parent(step: &TargetStep) -> bool {
    match &step.driver {
        Driver::Model(driver) => step.needs == Needs::Transform || driver.rotation_alpha != 1.0,
        Driver::Twist(_) => step.needs == Needs::Transform,
        Driver::Hold | Driver::Pelvis(_) | Driver::Shoulder(_) | Driver::Carried(_) => true,
    }
}

impl ChordStep {
    const fn fills(&self, chord: usize) -> bool {
        self.slot == chord || self.correction.has_chest() && self.slot + 1 == chord
    }
}
