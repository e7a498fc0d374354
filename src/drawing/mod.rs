//! Drawings: two-dimensional characters, and how a body in space moves them.
//!
//! | file | what it answers |
//! | --- | --- |
//! | `error` | what is wrong with a drawing or a config, where, and how it is put right |
//! | `yaml` | the text of a config to its typed spec |
//! | `annotate` | a picture of a figure to its mask and joints |
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
//! | `contacts`, `plant` | when feet stand, and what makes them stay |
//! | `facing` | whether a drawing that is seen from the side faces left |
//! | `arap` | the mesh of the drawing, deformed by its joints as the original does it |
//! | `bones`, `holds` | the same mesh held by its bones, and where they hold it |
//! | `untangle` | triangles of a deformed mesh that turned over are turned back |
//! | `skin` | a drawing as a skin on bones, for formats that hold those |
//! | `complex`, `factors`, `elimination` | the linear algebra of that: numbers, sparse factors, an order that keeps them sparse |
//! | `lattice` | a mask to a mesh |
//! | `parts` | which bone carries which triangle |
//! | `viewpoint` | from where drawings are seen |
//! | `cutout` | the texture without what the mask leaves out |
//! | `fill` | textured triangles onto a picture |
//! | `overlay` | bones, meshes, colors and a floor |
//! | `puppet` | a drawing that is ready to be seen, one frame at a time |
//! | `humanoid` | how a human body drives a drawing for which nobody wrote a config |
//! | `damping` | bones that do not jump, parts that change places seldom |
//! | `performance` | a drawing, a motion and a retarget spec to the poses of all frames |
//! | `measures` | how good the result is: angles, triangles that turned over, changes of order, slip, areas |
//! | `draw_spec` | what somebody wants of a drawing: the one document, like that of a retarget |
//!
//! The numbers follow *Animated Drawings* (Smith et al., "A Method for Animating Children's Drawings of the Human Figure", ACM
//! Transactions on Graphics 42, 2023) and its program, whose configs are read as they stand.
//!
//! Places of a drawing are in sides of its padded square, x right and y up; angles are in degrees counterclockwise from +Y.

mod annotate;
mod arap;
mod body_motion;
mod bones;
mod bvh;
mod character_spec;
mod complex;
mod contacts;
mod cutout;
mod damping;
mod draw_spec;
mod elimination;
mod error;
mod facing;
mod factors;
mod fill;
mod holds;
mod humanoid;
mod lattice;
mod measures;
mod motion_spec;
mod overlay;
mod parts;
mod performance;
mod planar_rig;
mod plant;
mod principal;
mod projection;
mod puppet;
mod retarget_spec;
mod root_offset;
mod scene_spec;
mod skin;
mod untangle;
mod viewpoint;
mod yaml;

pub use annotate::{
    AnnotatedJoint, Annotation, AnnotationError, BodyKind, LONGEST_SIDE, MAX_MODEL_BYTES, MaskOrigin, PoseModel,
    PoseModelError, annotate,
};
pub use arap::{Arap, ArapWorkspace, Precision};
pub use body_motion::BodyMotion;
pub use bvh::MotionFile;
pub use character_spec::{CharacterSpec, JointSpec};
pub use cutout::{beyond_joints, joints_outside, mask_parts};
pub use draw_spec::{
    Compat, DeformWord, DrawSpec, DrawTask, DrawnCamera, DrawnLayer, DrawnOutput, DrawnOutputs, DrawnView, FigureSpec,
    ProjectSpec, Turn, draw_spec_schema, is_draw_document, parse_draw_spec, parse_draw_value,
};
pub use error::DrawingError;
pub use humanoid::body_joints;
pub use measures::{DrawingMeasures, Measured, measure};
pub use motion_spec::{MotionSpec, UpAxis};
pub use overlay::draw_floor;
pub use performance::{Manner, Performance, Rules};
pub use planar_rig::PlanarRig;
pub use projection::Plane;
pub use puppet::{Deformation, Look, Puppet, PuppetWorkspace};
pub use retarget_spec::{BodypartGroup, ProjectionGroup, ProjectionMethod, RetargetSpec, RootOffset};
pub use scene_spec::{CharacterFiles, ControllerSection, Mode, SceneSection, SceneSpec, ViewSection};
pub use skin::Skin;
pub use yaml::Ordered;

/// Pixels of one texture.
pub const MAX_TEXTURE_PIXELS: usize = 4 << 20;
/// Pixels of one frame.
pub const MAX_VIDEO_PIXELS: usize = 1920 * 1080;
/// Frames of one moving picture.
pub const MAX_VIDEO_FRAMES: usize = 10_000;

/// A bound on drawings that nobody can change: its name, its value, and what it bounds.
pub type DrawingLimit = (&'static str, usize, &'static str);

/// What bounds drawings.
#[must_use]
pub const fn drawing_limits() -> [DrawingLimit; 6] {
    [
        ("drawing_pixels", MAX_TEXTURE_PIXELS, "Pixels of the texture of a drawing"),
        ("drawing_joints", character_spec::MAX_JOINTS, "Joints of a drawing"),
        ("drawing_vertices", arap::MAX_VERTICES, "Vertices of the mesh of a drawing"),
        ("drawing_characters", scene_spec::MAX_CHARACTERS, "Drawings in one scene"),
        ("video_frames", MAX_VIDEO_FRAMES, "Frames of a moving drawing"),
        ("video_pixels", MAX_VIDEO_PIXELS, "Pixels of one frame of a moving drawing"),
    ]
}
