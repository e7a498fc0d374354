//! Drawn characters: a picture with joints that a motion moves in its plane, as Animated Drawings does (facebookresearch/AnimatedDrawings,
//! MIT; Smith et al., "A Method for Animating Children's Drawings of the Human Figure", ACM TOG 2023).
//!
//! | file | what it answers |
//! | --- | --- |
//! | `config` | what the configs of that program say: scene, character, motion, retarget |
//! | `error` | what is wrong with them, and where |
//! | `driver` | where the joints of the motion are, seen from a body that always faces one way |
//! | `plane` | onto which plane a group of joints is projected, and which angle a bone has there |
//! | `puppet` | the joints of a drawing at rest, and turned |
//! | `root` | where the drawing goes |
//! | `performance` | all of it: what a drawing does in a motion, with that program's numbers |
//!
//! Its numbers are reproduced with what is wrong in them: a child of a joint that is not driven is off by the turn of the joints above it, and the
//! last driven child of a joint turns all of its children.
//!
//! Must never know: rigs and their roles, the file system, the clock.

mod config;
mod driver;
mod error;
mod performance;
mod plane;
mod puppet;
mod root;

pub use config::{
    BodypartGroup, CharacterFiles, CharacterSpec, DrawingRetargetSpec, MotionSpec, ProjectionGroup, ProjectionMethod,
    RootOffset, RuntimeCheck, SceneSpec, SkeletonJoint, UpAxis, read_character, read_motion, read_retarget, read_scene,
};
pub use driver::{Driver, DriverFrame};
pub use error::DrawingError;
pub use performance::Performance;
pub use plane::Plane;
pub use puppet::Puppet;
