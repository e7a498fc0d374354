//! Drawings: two-dimensional characters, and how a body in space moves them.
//!
//! | file | what it answers |
//! | --- | --- |
//! | `error` | what is wrong with a drawing or a config, where, and how it is put right |
//! | `yaml` | the text of a config to its typed spec |
//! | `scene_spec` | who is in a picture, from where it is seen, what comes out |
//! | `character_spec` | the joints of a drawing, in pixels |
//! | `motion_spec` | which frames of a motion file are shown, and where its body faces |
//! | `retarget_spec` | which joints of the body turn which bones of the drawing |
//! | `bvh` | a BVH file to the places of its joints |
//! | `body_motion` | those places seen from the body: upright, facing +X, with the root at the origin |
//! | `projection` | the planes onto which groups of joints are seen, the angles and depths in them |
//! | `principal` | the direction in which points vary least |
//! | `root_offset` | where the root of the drawing goes |
//! | `planar_rig` | the joints of the drawing at rest and posed |
//! | `arap` | the mesh of the drawing, deformed by its joints |
//! | `complex`, `factors`, `dissection` | the linear algebra of that: numbers, sparse factors, an order that keeps them sparse |
//! | `lattice` | a mask to a mesh |
//! | `parts` | which bone carries which triangle |
//! | `viewpoint` | from where drawings are seen |
//! | `fill` | textured triangles onto a picture |
//! | `puppet` | a drawing that is ready to be seen, one frame at a time |
//! | `humanoid` | how a human body drives a drawing for which nobody wrote a config |
//! | `damping` | bones that do not jump, parts that change places seldom |
//! | `performance` | a drawing, a motion and a retarget spec to the poses of all frames |
//!
//! The numbers follow *Animated Drawings* (Smith et al., "A Method for Animating Children's Drawings of the Human Figure", ACM
//! Transactions on Graphics 42, 2023) and its program, whose configs are read as they stand.
//!
//! Places of a drawing are in sides of its padded square, x right and y up; angles are in degrees counterclockwise from +Y.

mod arap;
mod body_motion;
mod bvh;
mod character_spec;
mod complex;
mod damping;
mod dissection;
mod error;
mod factors;
mod fill;
mod humanoid;
mod lattice;
mod motion_spec;
mod parts;
mod performance;
mod planar_rig;
mod principal;
mod projection;
mod puppet;
mod retarget_spec;
mod root_offset;
mod scene_spec;
mod viewpoint;
mod yaml;

pub use arap::{Arap, ArapWorkspace, Precision};
pub use body_motion::BodyMotion;
pub use bvh::MotionFile;
pub use character_spec::{CharacterSpec, JointSpec};
pub use error::DrawingError;
pub use humanoid::body_joints;
pub use motion_spec::{MotionSpec, UpAxis};
pub use performance::{Manner, Performance};
pub use planar_rig::PlanarRig;
pub use projection::Plane;
pub use puppet::{Puppet, PuppetWorkspace};
pub use retarget_spec::{BodypartGroup, ProjectionGroup, ProjectionMethod, RetargetSpec, RootOffset};
pub use scene_spec::{CharacterFiles, ControllerSection, Mode, SceneSection, SceneSpec, ViewSection};
pub use yaml::Ordered;
