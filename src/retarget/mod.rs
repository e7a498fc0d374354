//! The algorithm: a [`Plan`] compiled once from a mapping and a clip, a loop over frames, and measures of the result.
//!
//! Per frame there are indices and constants only. Knows no format, no name and no file.

mod chord;
mod compile;
mod curves;
mod drivers;
mod explain;
mod lanes;
mod measure;
mod places;
mod plan;
mod run;
mod stages;
mod workspace;

pub use curves::carried_curves;
pub use drivers::{JointDriver, joint_drivers};
pub use explain::{DriverKind, JointExplanation, explain_joint};
pub use measure::{ContactMeasure, Curves, LimbDirection, Measures, Metric, SidePair, Verdict, Worst, measure};
pub use plan::Plan;
pub use run::{RunError, run};
pub use stages::{ContactTrack, LimbReach, LimitedJoint, Stack, StackResult, filtered};
