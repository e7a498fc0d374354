//! What a joint means on a body: a side and a part, and their names on the wire.
//!
//! Knows no joint, no skeleton and no naming convention.

use std::{fmt, str::FromStr};

/// Which half of the body, as the character sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// On the middle plane.
    Center,
    /// The character's own left.
    Left,
    /// The character's own right.
    Right,
}

/// A part of a body. A limb part is named by the bone that the joint starts: the forearm is the joint at the elbow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Part {
    /// The top joint that moves the character, where there is one above the pelvis.
    Root,
    /// The joint that carries the body: both legs and the spine hang from it.
    Pelvis,
    /// From the first joint above the pelvis to the one that the arms hang from.
    Spine,
    /// From there to the head.
    Neck,
    /// The head.
    Head,
    /// The lower jaw.
    Jaw,
    /// An eye.
    Eye,
    /// Between chest and upper arm.
    Clavicle,
    /// From the shoulder.
    UpperArm,
    /// From the elbow.
    Forearm,
    /// From the wrist.
    Hand,
    /// From the hip.
    Thigh,
    /// From the knee.
    Shin,
    /// From the ankle.
    Foot,
    /// From the ball of the foot.
    Toe,
    /// The thumb; its first joint may be called a metacarpal.
    Thumb,
    /// Phalanges of the index finger.
    Index,
    /// Phalanges of the middle finger.
    Middle,
    /// Phalanges of the ring finger.
    Ring,
    /// Phalanges of the little finger.
    Pinky,
    /// The bone of the palm below the index finger.
    IndexMetacarpal,
    /// The bone of the palm below the middle finger.
    MiddleMetacarpal,
    /// The bone of the palm below the ring finger.
    RingMetacarpal,
    /// The bone of the palm below the little finger.
    PinkyMetacarpal,
    /// A whole front leg of a quadruped, from the body down.
    FrontLeg,
    /// A whole hind leg of a quadruped, from the body down.
    HindLeg,
    /// The tail, from the body outward.
    Tail,
    /// A wing, from the body outward.
    Wing,
}

/// What joints mean: a part of one side of the body.
///
/// On the wire a role is its part's name after its side's, such as `pelvis` or `left_forearm`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Role {
    /// Which half of the body.
    pub side: Side,
    /// Which part of it.
    pub part: Part,
}

/// Why text is no role.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{text}' is not a role: roles are named like 'pelvis', 'spine', 'left_upper_arm' or 'right_index'")]
pub struct RoleError {
    /// The text that was seen.
    pub text: String,
}

impl Side {
    /// The two halves.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// The other half; the center is its own.
    #[must_use]
    pub const fn opposite(self) -> Self {
        match self {
            Self::Center => Self::Center,
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }
}

impl Part {
    /// All parts with their names, from the root outward.
    const NAMED: [(Self, &'static str); 28] = [
        (Self::Root, "root"),
        (Self::Pelvis, "pelvis"),
        (Self::Spine, "spine"),
        (Self::Neck, "neck"),
        (Self::Head, "head"),
        (Self::Jaw, "jaw"),
        (Self::Eye, "eye"),
        (Self::Clavicle, "clavicle"),
        (Self::UpperArm, "upper_arm"),
        (Self::Forearm, "forearm"),
        (Self::Hand, "hand"),
        (Self::Thigh, "thigh"),
        (Self::Shin, "shin"),
        (Self::Foot, "foot"),
        (Self::Toe, "toe"),
        (Self::Thumb, "thumb"),
        (Self::Index, "index"),
        (Self::Middle, "middle"),
        (Self::Ring, "ring"),
        (Self::Pinky, "pinky"),
        (Self::IndexMetacarpal, "index_metacarpal"),
        (Self::MiddleMetacarpal, "middle_metacarpal"),
        (Self::RingMetacarpal, "ring_metacarpal"),
        (Self::PinkyMetacarpal, "pinky_metacarpal"),
        (Self::FrontLeg, "front_leg"),
        (Self::HindLeg, "hind_leg"),
        (Self::Tail, "tail"),
        (Self::Wing, "wing"),
    ];

    /// The five fingers, from the thumb.
    pub const FINGERS: [Self; 5] = [Self::Thumb, Self::Index, Self::Middle, Self::Ring, Self::Pinky];

    /// The name on the wire, without a side.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMED.iter().find(|(part, _)| *part == self).map_or("", |(_, name)| name)
    }

    /// The part of that name on the wire, without a side.
    #[must_use]
    pub(in crate::rig::recognition) fn from_name(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|entry| entry.1 == name).map(|entry| entry.0)
    }

    /// Whether the part lies on the middle plane; all others come in pairs.
    #[must_use]
    pub const fn is_central(self) -> bool {
        matches!(self, Self::Root | Self::Pelvis | Self::Spine | Self::Neck | Self::Head | Self::Jaw | Self::Tail)
    }

    /// The bone of the palm that belongs to a finger; the thumb has none of its own.
    #[must_use]
    pub const fn metacarpal(self) -> Option<Self> {
        match self {
            Self::Index => Some(Self::IndexMetacarpal),
            Self::Middle => Some(Self::MiddleMetacarpal),
            Self::Ring => Some(Self::RingMetacarpal),
            Self::Pinky => Some(Self::PinkyMetacarpal),
            _ => None,
        }
    }
}

impl Role {
    /// A part on the middle plane.
    #[must_use]
    pub const fn center(part: Part) -> Self {
        Self { side: Side::Center, part }
    }

    /// A part of one half.
    #[must_use]
    pub const fn new(side: Side, part: Part) -> Self {
        Self { side, part }
    }

    /// The same part of the other half.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        Self { side: self.side.opposite(), part: self.part }
    }

    /// Every role that there is: parts from the root outward, left before right.
    pub fn all() -> impl Iterator<Item = Self> {
        const CENTER: &[Side] = &[Side::Center];
        Part::NAMED.iter().flat_map(|(part, _)| {
            let sides = if part.is_central() { CENTER } else { &Side::BOTH[..] };
            sides.iter().map(|side| Self { side: *side, part: *part })
        })
    }
}

impl fmt::Display for Role {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.side {
            Side::Center => formatter.write_str(self.part.name()),
            Side::Left => write!(formatter, "left_{}", self.part.name()),
            Side::Right => write!(formatter, "right_{}", self.part.name()),
        }
    }
}

impl FromStr for Role {
    type Err = RoleError;

    fn from_str(text: &str) -> Result<Self, RoleError> {
        let (side, name) = match (text.strip_prefix("left_"), text.strip_prefix("right_")) {
            (Some(name), _) => (Side::Left, name),
            (None, Some(name)) => (Side::Right, name),
            (None, None) => (Side::Center, text),
        };
        Part::from_name(name)
            .filter(|part| part.is_central() == (side == Side::Center))
            .map(|part| Self { side, part })
            .ok_or_else(|| RoleError { text: text.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_role_comes_back_from_its_name() {
        assert_eq!(Role::all().count(), 7 + 21 * 2, "seven parts are central, the others come in pairs");
        for role in Role::all() {
            assert_eq!(role.to_string().parse(), Ok(role), "{role}");
            assert_eq!(role.mirrored().mirrored(), role, "{role}");
        }
    }

    #[test]
    fn what_is_no_role_is_refused() {
        for text in ["", "left_pelvis", "forearm", "Left_Hand", "left_", "left_left_hand"] {
            assert!(text.parse::<Role>().is_err(), "{text:?}");
        }
    }
}
