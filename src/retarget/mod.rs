//! The algorithm: a [`Plan`] compiled once from a mapping and a clip, a loop over frames, and measures of the result.
//!
//! Per frame there are indices and constants only. Knows no format, no name and no file.

mod chord;
mod compile;
mod cuts;
mod direct;
mod drivers;
mod explain;
mod joined;
mod lanes;
mod looped;
pub(in crate::retarget) mod mapping;
mod measure;
pub(in crate::retarget) mod ops;
mod places;
mod plan;
mod raised_ground;
pub(in crate::retarget) mod resolve;
mod run;
pub(in crate::retarget) mod spec;
mod stack;
mod stages;
mod treadmill;
mod vectors;
mod workspace;

pub use drivers::{JointDriver, joint_drivers};
pub use explain::{DriverKind, JointExplanation, explain_joint};
pub(crate) use joined::{add_limited, add_reaches};
pub use mapping::{
    ChainPair, Chord, ChordCorrection, CrotchRule, Drive, FurtherChain, Ground, LimbPair, Mapping, PelvisPair,
    PelvisPosition, ShoulderPair, Spacing, TwistAgainst, TwistPair,
};
pub use measure::{ContactMeasure, Curves, LimbDirection, Measures, Metric, SidePair, Verdict, Worst, measure};
pub use ops::*;
pub use plan::Plan;
pub use resolve::{Resolved, resolve};
pub use run::{RunError, run};
pub use spec::*;
pub use stack::Stack;
pub use stages::{ContactTrack, LimbReach, LimitedJoint, StackResult};
