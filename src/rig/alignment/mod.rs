//! Turning the target's rest pose until it looks like the source's, direction and roll.
//!
//! Only the pose that is measured from is turned; no rig is changed. For every bone that has a role on both sides the
//! shortest arc from its own direction to the source's is applied, parents first, each correction carried down to the
//! children before their own is measured: an A pose turned into a T pose moves the whole arm at the shoulder, and the elbow
//! adds only what is left. What remains is how the bone is rolled about that direction; where both sides tell (knuckles, the
//! bend of an elbow, the way that a foot points), the difference is taken out as well.
//!
//! | file | answers |
//! |---|---|
//! | `look` | where the parts of a body point and how they are rolled |
//! | `curve` | how the bends of a spine are laid onto one of another number of joints |
//! | `face` | where a head looks |
//! | `mesh` | what the skinned mesh says where no joint does |
//! | `canonical` | the same for a T pose and an A pose, of no body in particular |
//! | `rules` | what each part of the target is to be turned to |
//! | `sole` | how far a foot is tilted in a moment of a motion |
//! | `stand` | how a turned body stands on the floor |
//! | `turn` | the turning itself, parents before children, and what is left over |

mod arc;
mod canonical;
mod curve;
mod face;
mod look;
mod mesh;
mod rules;
mod sole;
mod stand;
mod turn;

pub(crate) use arc::arc;
pub use canonical::CanonicalPose;
pub use look::RollCue;

use crate::model::ModelPose;

use self::{
    look::Look,
    rules::{Aim, Wish, wishes},
    stand::slope,
    turn::turn,
};
pub(crate) use super::named_pair::split;
use super::{named_pair::NamedPair, rig::Rig, spec::Align};

/// A rest pose that was turned, and what was done to it.
#[derive(Clone, Debug)]
pub(crate) struct Alignment {
    /// The target's rest pose in its own space and unit; as long as the target's skeleton.
    pub(crate) rest: ModelPose,
    /// The joints that were compared, parents before children.
    pub(crate) joints: Vec<AlignedJoint>,
}

/// How well one joint of the target's rest pose looks like the source's.
#[derive(Clone, Debug, PartialEq)]
pub struct AlignedJoint {
    /// The role, or the chain's name.
    pub name: String,
    /// The target's joint.
    pub joint: usize,
    /// What was aligned.
    pub how: HowAligned,
    /// What the roll was found from, on the source and on the target; nothing where one of them does not tell.
    pub roll_from: Option<(RollCue, RollCue)>,
    /// How far the joint was turned from its own orientation, in degrees, 0 to 180.
    pub turned_degrees: f64,
    /// The angle that is left between the two directions; nothing where the joint has none.
    pub direction_degrees: Option<f64>,
    /// The roll that is left about the direction, −180 to 180; nothing where one of the sides does not tell.
    pub roll_degrees: Option<f64>,
}

/// What of a joint was aligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HowAligned {
    /// Nothing: alignment is off.
    Off,
    /// It keeps its own orientation in model space.
    Kept,
    /// With its chain as a whole, which keeps its own bends; what is left is that of its own bone.
    Whole,
    /// Its slope, so that an animal stands on both pairs of its legs.
    Sloped,
    /// Its heading only; pitch and roll stay, so that soles stay flat.
    Heading,
    /// Its direction; the roll is not known well enough.
    Direction,
    /// Direction and roll.
    Full,
}

impl HowAligned {
    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Kept => "kept",
            Self::Whole => "whole",
            Self::Sloped => "sloped",
            Self::Heading => "heading",
            Self::Direction => "direction",
            Self::Full => "full",
        }
    }
}

/// Aligns the target's rest pose with the source's. `pairs` are the chains that correspond; of the target's joints only
/// theirs and the pelvis are turned, all others ride their parents. The pelvis is moved until the soles are as high as at rest, and
/// the trunk of a four-legged animal sloped until both pairs of its paws are.
pub(crate) fn align(source: &Rig<'_>, target: &Rig<'_>, pairs: &[NamedPair], mode: Align) -> Alignment {
    let mut wishes = wishes(&Look::Rig(source), target, pairs, false, mode);
    let aligned = turn(target, &wishes, mode);
    match slope(target, &aligned.rest) {
        Some((trunk, further)) if mode != Align::Off && wishes[trunk].is_none() => {
            wishes[trunk] = Some(Wish { name: "spine".to_owned(), aim: Aim::Further(further), roll: None });
            turn(target, &wishes, mode)
        }
        _ => aligned,
    }
}

/// The rest pose of a rig turned into a pose that any body can take.
///
/// `from_nothing` turns the parts that otherwise keep how they are as well (pelvis, clavicles, feet): for rest poses that are no
/// pose at all.
pub(crate) fn canonical_rest(rig: &Rig<'_>, pose: CanonicalPose, from_nothing: bool) -> Alignment {
    let own = |(role, joints): (&String, &Vec<usize>)| NamedPair {
        name: role.clone(),
        source_name: role.clone(),
        source: joints.clone(),
        also: Vec::new(),
        target: joints.clone(),
        role: Some(role.clone()),
    };
    let pairs: Vec<NamedPair> = rig.roles.iter().filter(|(role, _)| *role != "pelvis").map(own).collect();
    turn(rig, &wishes(&Look::Canonical(pose), rig, &pairs, from_nothing, Align::Auto), Align::Auto)
}

/// A part without the number that tells it from others of its kind: `leg` of `leg_3`.
pub(crate) fn unnumbered(part: &str) -> &str {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    part.rsplit_once('_').filter(|(_, number)| is_number(number)).map_or(part, |(part, _)| part)
}
