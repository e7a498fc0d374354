//! The names of limbs and of their points of contact.

use glam::DVec3;

use super::{Part, Role, Side};

/// Which limb.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limb {
    /// The left leg.
    LeftLeg,
    /// The right leg.
    RightLeg,
    /// The left arm.
    LeftArm,
    /// The right arm.
    RightArm,
    /// A left leg of an animal, by its row in [`ROWS`].
    LeftAnimalLeg(usize),
    /// A right leg of an animal, likewise.
    RightAnimalLeg(usize),
}

/// What a leg of an animal and its points of contact are called.
type LegNames = [&'static str; 4];

/// The names of one row of legs, left and right.
macro_rules! row {
    ($pair:literal, $number:literal) => {
        [row!("left_", $pair, $number), row!("right_", $pair, $number)]
    };
    ($side:literal, $pair:literal, $number:literal) => {
        [
            concat!($side, $pair, "leg", $number),
            concat!($side, $pair, "foot", $number),
            concat!($side, $pair, "toe", $number),
            concat!($side, $pair, "toe_tip", $number),
        ]
    };
}

/// Rows of legs: those of four-legged animals, then those of creatures with six and more from the front.
const ROWS: [[LegNames; 2]; 14] = [
    row!("front_", ""),
    row!("hind_", ""),
    row!("", "_1"),
    row!("", "_2"),
    row!("", "_3"),
    row!("", "_4"),
    row!("", "_5"),
    row!("", "_6"),
    row!("", "_7"),
    row!("", "_8"),
    row!("", "_9"),
    row!("", "_10"),
    row!("", "_11"),
    row!("", "_12"),
];

impl Limb {
    /// All of them, left before right.
    pub fn all() -> impl Iterator<Item = Self> {
        let animals = (0..ROWS.len()).flat_map(|row| [Self::LeftAnimalLeg(row), Self::RightAnimalLeg(row)]);
        [Self::LeftLeg, Self::RightLeg, Self::LeftArm, Self::RightArm].into_iter().chain(animals)
    }

    /// The names of an animal's leg; nothing for other limbs.
    const fn animal(self) -> Option<&'static LegNames> {
        match self {
            Self::LeftAnimalLeg(row) => Some(&ROWS[row][0]),
            Self::RightAnimalLeg(row) => Some(&ROWS[row][1]),
            _ => None,
        }
    }

    /// What the roles of an arm begin with; nothing for what is no arm.
    pub(crate) const fn side_of_arm(self) -> Option<&'static str> {
        match self {
            Self::LeftArm => Some("left_"),
            Self::RightArm => Some("right_"),
            _ => None,
        }
    }

    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::LeftLeg => "left_leg",
            Self::RightLeg => "right_leg",
            Self::LeftArm => "left_arm",
            Self::RightArm => "right_arm",
            Self::LeftAnimalLeg(row) => ROWS[row][0][0],
            Self::RightAnimalLeg(row) => ROWS[row][1][0],
        }
    }

    /// The role of an animal's leg as a whole; nothing for the limbs of bipeds, of which every bone has a role.
    #[must_use]
    pub fn whole_leg(self) -> Option<Role> {
        let role: Role = self.animal()?[0].parse().ok()?;
        matches!(role.part, Part::FrontLeg | Part::HindLeg | Part::Leg).then_some(role)
    }

    /// Whether it is a leg.
    #[must_use]
    pub const fn is_leg(self) -> bool {
        !matches!(self, Self::LeftArm | Self::RightArm)
    }

    /// Which half of the body it is on.
    #[must_use]
    pub const fn side(self) -> Side {
        match self {
            Self::LeftLeg | Self::LeftArm | Self::LeftAnimalLeg(_) => Side::Left,
            Self::RightLeg | Self::RightArm | Self::RightAnimalLeg(_) => Side::Right,
        }
    }

    /// Whether two limbs are the left and the right of one pair, or one limb.
    #[must_use]
    pub const fn is_paired_with(self, other: Self) -> bool {
        match (self, other) {
            (
                Self::LeftAnimalLeg(row) | Self::RightAnimalLeg(row),
                Self::LeftAnimalLeg(of_other) | Self::RightAnimalLeg(of_other),
            ) => row == of_other,
            (Self::LeftAnimalLeg(_) | Self::RightAnimalLeg(_), _)
            | (_, Self::LeftAnimalLeg(_) | Self::RightAnimalLeg(_)) => false,
            (one, other) => one.is_leg() == other.is_leg(),
        }
    }

    /// The roles of its start, middle and end, and of what lies beyond the end; nothing for legs that have one role as a whole.
    #[must_use]
    pub const fn roles(self) -> Option<[&'static str; 4]> {
        match self {
            Self::LeftLeg => Some(["left_thigh", "left_shin", "left_foot", "left_toe"]),
            Self::RightLeg => Some(["right_thigh", "right_shin", "right_foot", "right_toe"]),
            Self::LeftArm => Some(["left_upper_arm", "left_forearm", "left_hand", "left_middle"]),
            Self::RightArm => Some(["right_upper_arm", "right_forearm", "right_hand", "right_middle"]),
            Self::LeftAnimalLeg(_) | Self::RightAnimalLeg(_) => None,
        }
    }

    /// The names of its points of contact: its end, the ball of the foot, the end of the toes. Hands have the first only.
    #[must_use]
    pub const fn contact_points(self) -> [&'static str; 3] {
        match self {
            Self::LeftLeg => ["left_foot", "left_toe", "left_toe_tip"],
            Self::RightLeg => ["right_foot", "right_toe", "right_toe_tip"],
            Self::LeftArm => ["left_hand", "", ""],
            Self::RightArm => ["right_hand", "", ""],
            Self::LeftAnimalLeg(row) => [ROWS[row][0][1], ROWS[row][0][2], ROWS[row][0][3]],
            Self::RightAnimalLeg(row) => [ROWS[row][1][1], ROWS[row][1][2], ROWS[row][1][3]],
        }
    }
}

/// The joints of a limb.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimbJoints {
    /// Hip or shoulder.
    pub start: usize,
    /// Knee or elbow.
    pub middle: usize,
    /// The joint of the bone that the end hangs from: the middle, or in legs of more bones one beyond it.
    pub shin: usize,
    /// Ankle or wrist; of an animal's leg the joint of the paw.
    pub end: usize,
    /// The ball of the foot.
    pub ball: Option<usize>,
    /// The end of the toes: the joint farthest from the ball below it.
    pub tip: Option<usize>,
    /// What lies below a foot.
    pub sole: Option<Sole>,
}

impl LimbJoints {
    /// Start, middle and end.
    #[must_use]
    pub const fn joints(&self) -> [usize; 3] {
        [self.start, self.middle, self.end]
    }
}

/// The sole of a foot, from the rest pose, in plan units: how far the floor is below each joint of it. In motion each joint
/// keeps at least that distance from the floor, however it is turned, as if there were a ball around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sole {
    /// Below the ankle.
    pub heel: f64,
    /// Below the joint of the ball.
    pub ball: Option<f64>,
    /// Below the end of the toes.
    pub tip: Option<f64>,
    /// Straight down at rest, in the axes of ankle, ball and end of the toes; unit length. Nothing of a foot that does not stand at rest.
    pub down: [Option<DVec3>; 3],
    /// From the ankle to the joint of the ball, in the ankle's axes.
    pub end_to_ball: Option<DVec3>,
    /// From the joint of the ball to the end of the toes, in the ball's axes.
    pub ball_to_tip: Option<DVec3>,
}

impl Sole {
    /// The points of the sole below ankle, ball and end of the toes at rest, in the axes of those joints.
    #[must_use]
    pub fn points(&self) -> [Option<DVec3>; 3] {
        let [heel, ball, tip] = self.down;
        let below = |down: Option<DVec3>, height: Option<f64>| down.zip(height).map(|(down, height)| down * height);
        [below(heel, Some(self.heel)), below(ball, self.ball), below(tip, self.tip)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_animal_leg_is_a_role() {
        for limb in Limb::all() {
            let role = limb.whole_leg().map(|role| role.to_string());
            assert_eq!(role.as_deref(), limb.animal().map(|names| names[0]), "{limb:?}");
            assert_eq!(role.is_none(), limb.roles().is_some(), "{limb:?}");
        }
    }
}
