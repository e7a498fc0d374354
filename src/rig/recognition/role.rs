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
    /// A whole leg of a creature with six and more of them, from the body down; numbered from the front.
    Leg,
    /// The tail, from the body outward.
    Tail,
    /// A wing, from the body outward.
    Wing,
}

/// What joints mean: a part of one side of the body.
///
/// On the wire a role is its part's name after its side's, such as `pelvis` or `left_forearm`. Parts that creatures have several
/// of on a side carry a number behind: legs of six and more always (`left_leg_1` is the foremost), others from the second on
/// (`left_wing_2`). Necks, heads, jaws and tails that mirror one another have sides: a hydra's are `left_neck`, `neck`,
/// `right_neck`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Role {
    /// Which half of the body.
    pub side: Side,
    /// Which part of it.
    pub part: Part,
    /// Which of several such parts of that side, from 1: legs and wings from the front, necks, heads, jaws and tails from the
    /// middle.
    pub number: u8,
}

/// No body has more parts of one kind on a side.
const MAX_ALIKE: u8 = 99;

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
    const NAMED: [(Self, &'static str); 29] = [
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
        (Self::Leg, "leg"),
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
    fn from_name(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|entry| entry.1 == name).map(|entry| entry.0)
    }

    /// Whether the part lies on the middle plane of most bodies; all others come in pairs.
    #[must_use]
    pub const fn is_central(self) -> bool {
        matches!(self, Self::Root | Self::Pelvis | Self::Spine | Self::Neck | Self::Head | Self::Jaw | Self::Tail)
    }

    /// Whether it is a whole leg of an animal, from the body down.
    #[must_use]
    pub const fn is_whole_leg(self) -> bool {
        matches!(self, Self::FrontLeg | Self::HindLeg | Self::Leg)
    }

    /// Whether the part may be on that side of a body: paired parts on both, central ones in the middle, and those in the middle
    /// that creatures have several of on both sides, too.
    const fn may_be_on(self, side: Side) -> bool {
        match side {
            Side::Center => self.is_central(),
            Side::Left | Side::Right => {
                !self.is_central() || matches!(self, Self::Neck | Self::Head | Self::Jaw | Self::Tail)
            }
        }
    }

    /// Whether a body may have several of the part on one side, so that they are numbered.
    const fn may_repeat(self) -> bool {
        matches!(self, Self::Leg | Self::Wing | Self::Neck | Self::Head | Self::Jaw | Self::Tail)
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
    /// Whether the number is part of the name.
    fn is_written_with(number: u8, part: Part) -> bool {
        number > 1 || part == Part::Leg
    }

    /// A part on the middle plane; the first of its kind.
    #[must_use]
    pub const fn center(part: Part) -> Self {
        Self::new(Side::Center, part)
    }

    /// A part of one half; the first of its kind.
    #[must_use]
    pub const fn new(side: Side, part: Part) -> Self {
        Self::numbered(side, part, 1)
    }

    /// One of several parts of one half.
    #[must_use]
    pub const fn numbered(side: Side, part: Part, number: u8) -> Self {
        Self { side, part, number }
    }

    /// The same part of the other half.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        Self { side: self.side.opposite(), ..self }
    }

    /// Whether it is a part that only creatures with several of its kind have.
    #[must_use]
    pub(in crate::rig::recognition) fn is_one_of_several(self) -> bool {
        self.number > 1 || self.part == Part::Leg || (self.part.is_central() && self.side != Side::Center)
    }

    /// Whether a body that has no such part of its own may move this one as another moves that one: one of several necks, heads,
    /// jaws or tails as any other, a wing as one of its side.
    #[must_use]
    pub(in crate::rig) fn may_follow(self, other: Self) -> bool {
        self.part == other.part
            && match self.part {
                Part::Neck | Part::Head | Part::Jaw | Part::Tail => true,
                Part::Wing => self.side == other.side,
                _ => false,
            }
    }

    /// The two roles that a name without a side stands for, such as `forearm` or `leg_3`.
    #[must_use]
    pub(in crate::rig::recognition) fn of_both_sides(name: &str) -> Option<[Self; 2]> {
        let left: Self = format!("left_{name}").parse().ok()?;
        (!left.part.is_central()).then(|| [left, left.mirrored()])
    }

    /// Every role that most bodies have: parts from the root outward, left before right, the first of each kind.
    pub fn all() -> impl Iterator<Item = Self> {
        const CENTER: &[Side] = &[Side::Center];
        Part::NAMED.iter().flat_map(|(part, _)| {
            let sides = if part.is_central() { CENTER } else { &Side::BOTH[..] };
            sides.iter().map(|side| Self::new(*side, *part))
        })
    }
}

impl fmt::Display for Role {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = match self.side {
            Side::Center => "",
            Side::Left => "left_",
            Side::Right => "right_",
        };
        write!(formatter, "{side}{}", self.part.name())?;
        if Self::is_written_with(self.number, self.part) { write!(formatter, "_{}", self.number) } else { Ok(()) }
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
        // There is one way to write a role: no `neck_1`, no `left_leg_01`, no leg without a number.
        let number = |digits: &str| digits.parse::<u8>().ok().filter(|_| !digits.starts_with(['0', '+']));
        let numbered = name.rsplit_once('_').and_then(|(name, digits)| Some((name, number(digits)?)));
        let is_numbered = numbered.is_some();
        let (name, number) = numbered.unwrap_or((name, 1));
        let may_be = |part: &Part| part.may_be_on(side) && (number == 1 || part.may_repeat());
        Part::from_name(name)
            .filter(|part| may_be(part) && (1..=MAX_ALIKE).contains(&number))
            .filter(|part| is_numbered == Self::is_written_with(number, *part))
            .map(|part| Self { side, part, number })
            .ok_or_else(|| RoleError { text: text.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_role_comes_back_from_its_name() {
        assert_eq!(Role::all().count(), 7 + 22 * 2, "seven parts are central, the others come in pairs");
        for role in Role::all() {
            assert_eq!(role.to_string().parse(), Ok(role), "{role}");
            assert_eq!(role.mirrored().mirrored(), role, "{role}");
        }
    }

    #[test]
    fn parts_that_creatures_have_several_of_are_numbered() {
        let cases = [
            ("left_leg_1", Role::numbered(Side::Left, Part::Leg, 1)),
            ("right_leg_12", Role::numbered(Side::Right, Part::Leg, 12)),
            ("left_wing_2", Role::numbered(Side::Left, Part::Wing, 2)),
            ("right_neck", Role::new(Side::Right, Part::Neck)),
            ("left_head_2", Role::numbered(Side::Left, Part::Head, 2)),
            ("tail_2", Role::numbered(Side::Center, Part::Tail, 2)),
        ];
        for (name, role) in cases {
            assert_eq!((name.parse(), role.to_string()), (Ok(role), name.to_owned()), "{name}");
        }
        assert_eq!(Role::of_both_sides("leg_3").map(|roles| roles.map(|role| role.to_string())), {
            Some(["left_leg_3".to_owned(), "right_leg_3".to_owned()])
        });
        assert_eq!(Role::of_both_sides("neck"), None, "one neck is in the middle");
    }

    #[test]
    fn what_is_no_role_is_refused() {
        for text in [
            "",
            "left_pelvis",
            "forearm",
            "Left_Hand",
            "left_",
            "left_left_hand",
            "neck_1",
            "left_leg",
            "left_leg_0",
            "left_leg_01",
            "left_leg_100",
            "leg_1",
            "spine_2",
            "left_spine",
            "left_hand_2",
        ] {
            assert!(text.parse::<Role>().is_err(), "{text:?}");
        }
    }
}
