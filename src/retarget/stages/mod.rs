//! What is done behind forward kinematics: contacts, goals, planting, floor and limbs that reach.
//!
//! A [`Stack`] is compiled once. Its stages hold indices and constants only and run one after the other over the whole clip: in
//! parallel over frames where a frame depends on itself only, in one go where something is looked at over time. The result does not
//! depend on the number of threads. Ops that move goals (`ik`, `plant`, `floor`) are solved once, when the last of them in a row is
//! done.

pub(in crate::retarget) mod compile;
pub(in crate::retarget) mod contact_points;
pub(in crate::retarget) mod limbs;
pub(in crate::retarget) mod posed;
pub(in crate::retarget) mod posing;
pub(in crate::retarget) mod pull;
pub(in crate::retarget) mod result;
pub(in crate::retarget) mod ride;
pub(in crate::retarget) mod solve;
pub(in crate::retarget) mod temporal;
pub(in crate::retarget) mod two_bone;
pub(in crate::retarget) mod work;

pub use result::{ContactTrack, LimbReach, StackResult};
pub use work::LimitedJoint;

use crate::model::{Canceled, Clip, Control, JointContacts};

use self::{
    contact_points::ContactPoints, posed::PosedStage, pull::PullStage, ride::RideStage, solve::SolveStage, work::Work,
};
use super::ops::{
    contacts::ContactStage,
    filter::FilterStage,
    floor::{FloorStage, tails::TailStage, toes::ToeStage},
    ik::GoalStage,
    plant::PlantStage,
    props::grips::GripStage,
    root_motion::RootStage,
    scale_source::ScaledSource,
    self_contact::SelfContactStage,
    stride::StrideStage,
};
use super::{
    Plan,
    run::{RunError, run},
};

/// A compiled retarget with all its ops: forward kinematics, then stages.
#[derive(Clone, Debug)]
pub struct Stack {
    plan: Plan,
    source: Option<ScaledSource>,
    stages: Vec<Stage>,
    limbs: Vec<&'static str>,
    /// Points of contact and the joints of the target that they are.
    contact_joints: Vec<(&'static str, usize)>,
    metres_per_unit: f64,
}

/// One stage.
#[derive(Clone, Debug)]
enum Stage {
    Contacts(ContactStage),
    Goals(GoalStage),
    Plant(PlantStage),
    Tilt(FloorStage),
    Floor(FloorStage),
    Pull(PullStage),
    Filter(FilterStage),
    Solve(SolveStage),
    Ride(RideStage),
    Posed(PosedStage),
    Stride(StrideStage),
    Grips(GripStage),
    Toes(ToeStage),
    Tails(TailStage),
    Root(RootStage),
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
        let scaled = self.source.as_ref().map(|source| source.apply(clip, control)).transpose()?;
        let clip = scaled.as_ref().unwrap_or(clip);
        let result = run(&self.plan, clip, control)?;
        if self.stages.is_empty() {
            let (contacts, reaches, limited) = (Vec::new(), Vec::new(), Vec::new());
            return Ok(StackResult { clip: result, contacts, reaches, limited });
        }
        let (name, times, target) = result.into_parts();
        let mut work = Work {
            control,
            times: &times,
            source: clip.joints(),
            target,
            contacts: ContactPoints::default(),
            goals: Vec::new(),
            source_soles: Vec::new(),
            pelvis_moves: Vec::new(),
            residuals: Vec::new(),
            limited: Vec::new(),
        };
        for stage in &self.stages {
            control.check()?;
            stage.run(&mut work)?;
        }
        let (contacts, reaches) = result::tell(&work, &self.limbs, self.metres_per_unit);
        let (target, limited) = (work.target, work.limited);
        let touching = self.touching(&contacts);
        let clip = Clip::new(name, times, target)?.with_contacts(touching)?;
        Ok(StackResult { clip, contacts, reaches, limited })
    }
}

impl Stack {
    /// What touches, as joints of the target; points that it does not have are left out.
    fn touching(&self, contacts: &[ContactTrack]) -> Vec<JointContacts> {
        let joint = |track: &ContactTrack| {
            let (_, joint) = self.contact_joints.iter().find(|(point, _)| *point == track.point)?;
            Some(JointContacts { joint: *joint, touches: track.touches.clone() })
        };
        contacts.iter().filter_map(joint).collect()
    }
}

impl Stage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        match self {
            Self::Contacts(stage) => stage.run(work),
            Self::Goals(stage) => stage.run(work),
            Self::Plant(stage) => stage.run(work),
            Self::Tilt(stage) => stage.tilt(work),
            Self::Floor(stage) => stage.run(work),
            Self::Pull(stage) => stage.run(work),
            Self::Filter(stage) => stage.run(work),
            Self::Solve(stage) => stage.run(work),
            Self::Ride(stage) => stage.run(work),
            Self::Posed(stage) => stage.run(work),
            Self::Stride(stage) => stage.run(work),
            Self::Grips(stage) => stage.run(work),
            Self::Toes(stage) => stage.run(work),
            Self::Tails(stage) => stage.run(work),
            Self::Root(stage) => stage.run(work),
            Self::SelfContact(stage) => stage.run(work),
        }
    }
}
