//! What is done behind forward kinematics: contacts, goals, planting, floor and limbs that reach.
//!
//! A [`Stack`] is compiled once. Its stages hold indices and constants only and run one after the other over the whole clip: in
//! parallel over frames where a frame depends on itself only, in one go where something is looked at over time. The result does not
//! depend on the number of threads. Ops that move goals (`ik`, `plant`, `floor`) are solved once, when the last of them in a row is
//! done.

mod compile;
mod contacts;
mod filter;
mod floor;
mod goals;
mod limbs;
mod plant;
mod posing;
mod pull;
mod result;
mod ride;
mod schedule;
mod self_contact;
mod solve;
mod temporal;
mod two_bone;
mod work;

pub use result::{ContactTrack, LimbReach, StackResult};

use crate::model::{Canceled, Clip, Control};

use self::{
    contacts::{ContactPoints, ContactStage},
    filter::FilterStage,
    floor::FloorStage,
    goals::GoalStage,
    plant::PlantStage,
    pull::PullStage,
    ride::RideStage,
    self_contact::SelfContactStage,
    solve::SolveStage,
    work::Work,
};
use super::{
    Plan,
    run::{RunError, run},
};

/// A compiled retarget with all its ops: forward kinematics, then stages.
#[derive(Clone, Debug)]
pub struct Stack {
    plan: Plan,
    stages: Vec<Stage>,
    limbs: Vec<&'static str>,
    metres_per_unit: f64,
}

/// One stage.
#[derive(Clone, Debug)]
enum Stage {
    Contacts(ContactStage),
    Goals(GoalStage),
    Plant(PlantStage),
    Floor(FloorStage),
    Pull(PullStage),
    Filter(FilterStage),
    Solve(SolveStage),
    Ride(RideStage),
    SelfContact(SelfContactStage),
}

impl Stack {
    /// How many target joints forward kinematics drives.
    #[must_use]
    pub fn driven_joint_count(&self) -> usize {
        self.plan.driven_joint_count()
    }

    /// Retargets a clip; see [`run`] for its shape.
    ///
    /// # Errors
    /// When the work is canceled, or the result does not fit into the numbers of a track.
    pub fn run(&self, clip: &Clip, control: &Control) -> Result<StackResult, RunError> {
        let result = run(&self.plan, clip, control)?;
        if self.stages.is_empty() {
            return Ok(StackResult { clip: result, contacts: Vec::new(), reaches: Vec::new() });
        }
        let (name, times, target) = result.into_parts();
        let mut work = Work {
            control,
            times: &times,
            source: clip.joints(),
            target,
            contacts: ContactPoints::default(),
            goals: Vec::new(),
            pelvis_moves: Vec::new(),
            residuals: Vec::new(),
        };
        for stage in &self.stages {
            control.check()?;
            stage.run(&mut work)?;
        }
        let (contacts, reaches) = result::tell(&work, &self.limbs, self.metres_per_unit);
        let target = work.target;
        Ok(StackResult { clip: Clip::new(name, times, target)?, contacts, reaches })
    }
}

impl Stage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        match self {
            Self::Contacts(stage) => stage.run(work),
            Self::Goals(stage) => stage.run(work),
            Self::Plant(stage) => stage.run(work),
            Self::Floor(stage) => stage.run(work),
            Self::Pull(stage) => stage.run(work),
            Self::Filter(stage) => stage.run(work),
            Self::Solve(stage) => stage.run(work),
            Self::Ride(stage) => stage.run(work),
            Self::SelfContact(stage) => stage.run(work),
        }
    }
}
