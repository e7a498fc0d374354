//! The pose that retargeting measures from: which one it is, where it was taken from, and why.
//!
//! | file | answers |
//! |---|---|
//! | `find` | which of the poses that a file offers is its rest pose |
//! | `bind` | in which pose the skins were bound |
//! | `standing` | which frame of a clip can stand in for a rest pose that is none |
//! | `rest_fit` | how a rest file was put onto a rig |
//! | `upload` | the pose of another file, on this rig |
//! | `ground` | a bind pose, put onto the floor |
//! | `edits` | the retarget-pose editor |

mod bind;
mod edits;
mod find;
mod ground;
mod rest_fit;
mod standing;
mod upload;

pub(super) use bind::{BindPose, bind_pose};
pub(super) use edits::edit;
pub(super) use find::{Rest, find_rest};
pub(super) use ground::put_onto_floor;
pub use rest_fit::{OrientationFrom, RestFit};
pub(super) use upload::uploaded;

/// Where a rest pose came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestSource {
    /// A file that was uploaded for it.
    Upload,
    /// A frame of a clip that the spec names.
    ClipFrame,
    /// The pose in which the skins were bound.
    Bind,
    /// The node transforms.
    Nodes,
    /// A frame of a clip, as the file's own rest pose is no body that stands.
    StandingFrame,
    /// A T pose that was made of another pose.
    Solved,
}

impl RestSource {
    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Upload => "upload",
            Self::ClipFrame => "clip_frame",
            Self::Bind => "bind",
            Self::Nodes => "nodes",
            Self::StandingFrame => "standing_frame",
            Self::Solved => "solved",
        }
    }

    /// Whether it is a moment of a motion, and not a pose that somebody laid out.
    #[must_use]
    pub const fn is_in_motion(self) -> bool {
        matches!(self, Self::ClipFrame | Self::StandingFrame)
    }
}
