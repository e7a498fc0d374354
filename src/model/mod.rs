//! What a skeleton, a pose, a clip and a scene are.
//!
//! Pure data and geometry. Knows no file format, no rig convention and no algorithm.
//!
//! Conventions, everywhere below: right-handed, +Y up, +Z front, meters, seconds, radians; quaternions `x y z w`,
//! Hamilton product, active rotations; `a * b` applies `b` first. `parent_from_child` names read by adjacency.

mod appearance;
mod axes;
mod clip;
mod control;
mod humanoid;
mod json_words;
mod look_at;
mod morph;
mod pose;
pub mod rotation;
mod scene;
mod skeleton;
mod skin_points;
mod skin_vertices;
mod sparse_keys;
mod stretched;
mod track;
mod transform;
mod travel;
mod warning;

pub use appearance::{Appearance, Carrier, FourInfluences, Paint, Surface, SurfaceShape};
pub use axes::{Axes, AxesError, SignedAxis};
pub use clip::{Clip, ClipError, JointContacts, JointTracks};
pub use control::{Canceled, Control, Phase, Progress};
pub use humanoid::HumanoidBone;
pub use json_words::no_json;
pub use look_at::{LookAt, LookRange};
pub use morph::{Morph, MorphMesh, MorphPlace, MorphTrack, VRM_EXPRESSIONS};
pub use pose::{LocalPose, ModelPose};
pub use scene::{Payload, Scene, Skin};
pub use skeleton::{Joint, Skeleton, SkeletonError};
pub use skin_points::{SkinPoint, SkinPoints};
pub use skin_vertices::{Influence, SkinVertices};
pub use sparse_keys::{JointKeys, KeyCurve, SparseKeys, hermite};
pub use stretched::{Stretched, joints_stretched_in, straightened_clip};
pub use track::Track;
pub use transform::Transform;
pub use travel::Travel;
pub use warning::{Reporter, Warning};
