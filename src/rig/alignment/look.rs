//! How a body holds itself: where each of its parts points, and how it is rolled about that.
//!
//! Everything is told in canonical space, +Y up, +Z front, so the character's left is +X, and two bodies can be compared whatever
//! the axes and units of their files.

use glam::{DQuat, DVec3};

use super::{super::rig::Rig, canonical::CanonicalPose, face::Face, mesh, split};

/// A straighter elbow or knee has no plane, in degrees.
const MIN_BEND_DEGREES: f64 = 3.0;
/// Joints are placed so well that their line is known to this many degrees.
const PLACEMENT_DEGREES: f64 = 3.0;
/// Elbows of the two sides that differ by more from mirror images are an accident of the pose, in degrees.
const UNLIKE_DEGREES: f64 = 40.0;
/// An elbow or knee further from how bodies are made bends sideways, which in a pose that somebody laid out is an accident too,
/// and in a motion is not, in degrees.
const SIDEWAYS_DEGREES: f64 = 50.0;
/// One that is further than this bends backward.
const BACKWARD_DEGREES: f64 = 100.0;
/// Feet are turned out by up to this much against their knees, in degrees.
const TURN_OUT_DEGREES: f64 = 20.0;
/// Bodies are made alike to this many degrees.
const CONVENTION_DEGREES: f64 = 45.0;
/// A thumb stands off the palm by about this much, in degrees.
const THUMB_DEGREES: f64 = 35.0;
/// Two neighboring knuckles give the line of all to this many degrees.
const NEIGHBORS_DEGREES: f64 = 10.0;
/// Shoulders are level to this many degrees.
const SHOULDERS_DEGREES: f64 = 5.0;

/// An End Site nearer to its joint than this share of the bone above says nothing: exporters put one there since a joint must end somewhere.
const MIN_END_SHARE: f64 = 0.05;
/// A hand is bent by no more against its forearm where somebody laid a body out, in degrees.
const HAND_DEGREES: f64 = 60.0;

/// What tells how a bone is rolled about its own direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RollCue {
    /// The line of the knuckles, from the little finger to the index.
    Knuckles,
    /// The side that the thumb is on.
    Thumb,
    /// The flat of the skinned mesh. It does not tell the palm from the back of the hand.
    Mesh,
    /// The axis that the elbow or knee is bent about.
    Bend,
    /// The way that the foot of the leg points.
    Foot,
    /// The line from one eye to the other, and where the eyes are in the mesh of the head.
    Eyes,
    /// The line from one shoulder to the other.
    Shoulders,
    /// How bodies are made: elbows bend forward, knees backward.
    Convention,
}

impl RollCue {
    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Knuckles => "knuckles",
            Self::Thumb => "thumb",
            Self::Mesh => "mesh",
            Self::Bend => "bend",
            Self::Foot => "foot",
            Self::Eyes => "eyes",
            Self::Shoulders => "shoulders",
            Self::Convention => "convention",
        }
    }

    /// Whether the axis has a sign.
    pub(super) const fn is_signed(self) -> bool {
        !matches!(self, Self::Mesh)
    }
}

/// A direction across a bone, which with the bone's own direction says how it is turned.
#[derive(Clone, Copy, Debug)]
pub(super) struct Second {
    /// Unit vector; not quite square to the bone.
    pub(super) axis: DVec3,
    pub(super) cue: RollCue,
    /// How far it may be from the truth.
    pub(super) uncertainty_degrees: f64,
}

/// A bone of a chain, in canonical space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bone {
    /// The share of the chain's length at which it begins.
    pub(super) begin: f64,
    /// The share at which it ends; more than `begin`.
    pub(super) end: f64,
    /// Unit vector.
    pub(super) direction: DVec3,
}

/// A body to compare with: a rig in its rest pose, or a pose that bodies of any build can take.
#[derive(Clone, Copy, Debug)]
pub(in crate::rig) enum Look<'a> {
    /// A rig in its rest pose.
    Rig(&'a Rig<'a>),
    /// A pose by its name.
    Canonical(CanonicalPose),
}

impl Look<'_> {
    /// From a role's first joint to the first of another role.
    pub(super) fn toward(&self, role: &str, end: &str) -> Option<DVec3> {
        match self {
            Self::Rig(rig) => (at(rig, end)? - at(rig, role)?).try_normalize(),
            Self::Canonical(pose) => pose.direction(role),
        }
    }

    /// Where a joint points that has nothing to point at: where its skinned mesh is, else its End Site.
    pub(super) fn leaf(&self, role: &str) -> Option<DVec3> {
        match self {
            Self::Rig(rig) => {
                let joint = *rig.role(role).last()?;
                let of_a_hand = split(role).1 == "hand";
                let direction = mesh::direction(rig, joint).or_else(|| end_site(rig, joint, of_a_hand))?;
                Some(rig.canonical_from_scene * direction)
            }
            Self::Canonical(pose) => pose.direction(role),
        }
    }

    /// The bones of a chain that plays a role.
    pub(super) fn chain(&self, role: &str, joints: &[usize]) -> Vec<Bone> {
        match self {
            Self::Rig(rig) => chain(rig, joints),
            Self::Canonical(pose) => {
                pose.direction(role).map(|direction| Bone { begin: 0.0, end: 1.0, direction }).into_iter().collect()
            }
        }
    }

    /// The character's own left, along a pair of joints.
    pub(super) fn across(&self, part: &str) -> Option<DVec3> {
        match self {
            Self::Rig(rig) => (at(rig, &format!("left_{part}"))? - at(rig, &format!("right_{part}"))?).try_normalize(),
            Self::Canonical(_) => Some(DVec3::X),
        }
    }

    /// How far the hips are turned about the vertical against the front of the body's space, in radians.
    pub(super) fn heading_radians(&self) -> f64 {
        let forward = self.across("thigh").map_or(DVec3::Z, |left| left.cross(DVec3::Y));
        forward.x.atan2(forward.z)
    }

    /// How the head is held.
    pub(super) fn face(&self) -> Option<Face> {
        match self {
            Self::Rig(rig) => Face::of(rig),
            Self::Canonical(_) => Some(Face::ahead(self)),
        }
    }

    /// How a role's bone is rolled.
    pub(super) fn second(&self, role: &str) -> Option<Second> {
        match self {
            Self::Rig(rig) => second(rig, role),
            Self::Canonical(pose) => pose.second(role),
        }
    }
}

/// Bones of a list of joints; what has no length is left out.
pub(super) fn chain(rig: &Rig<'_>, joints: &[usize]) -> Vec<Bone> {
    let bones = joints.windows(2).map(|pair| place(rig, pair[1]) - place(rig, pair[0]));
    let total: f64 = bones.clone().map(DVec3::length).sum();
    let mut done = 0.0;
    bones
        .filter_map(|bone| {
            let begin = done / total;
            done += bone.length();
            Some(Bone { begin, end: done / total, direction: bone.try_normalize()? })
        })
        .collect()
}

/// Where a joint is, in canonical space.
pub(super) fn place(rig: &Rig<'_>, joint: usize) -> DVec3 {
    rig.canonical_from_scene * rig.rest.transforms()[joint].translation
}

fn at(rig: &Rig<'_>, role: &str) -> Option<DVec3> {
    rig.role(role).first().map(|joint| place(rig, *joint))
}

fn end_site(rig: &Rig<'_>, joint: usize, of_a_hand: bool) -> Option<DVec3> {
    let joints = rig.skeleton().joints();
    let mut below = (joint + 1..joints.len()).filter(|other| joints[*other].parent == Some(joint));
    let (Some(only), None) = (below.next(), below.next()) else { return None };
    let place = |joint: usize| rig.rest.transforms()[joint].translation;
    let bone = place(only) - place(joint);
    let above = joints[joint].parent.map_or(DVec3::ZERO, |parent| place(joint) - place(parent));
    let is_stub = bone.length() < MIN_END_SHARE * above.length();
    let is_bent = of_a_hand && bone.angle_between(above).to_degrees() > HAND_DEGREES && !rig.rest_source.is_in_motion();
    if joints[only].is_joint || is_stub || is_bent { None } else { bone.try_normalize() }
}

fn second(rig: &Rig<'_>, role: &str) -> Option<Second> {
    let (side, part) = split(role);
    match part {
        "hand" => palm(rig, side, role),
        "upper_arm" => bend(rig, side, ARM).or_else(|| arm_convention(rig, side)),
        "forearm" => bend(rig, side, ARM),
        "thigh" | "shin" => {
            bend(rig, side, LEG).or_else(|| foot(rig, side, role)).or_else(|| leg_convention(rig, side))
        }
        "spine" => {
            let axis = Look::Rig(rig).across("upper_arm")?;
            Some(Second { axis, cue: RollCue::Shoulders, uncertainty_degrees: SHOULDERS_DEGREES })
        }
        _ => None,
    }
}

const ARM: [&str; 3] = ["upper_arm", "forearm", "hand"];
const LEG: [&str; 3] = ["thigh", "shin", "foot"];

/// The axis of an elbow or knee, by the right hand, where it is bent enough for one.
fn bend(rig: &Rig<'_>, side: &str, limb: [&str; 3]) -> Option<Second> {
    let (axis, degrees) = hinge(rig, side, limb)?;
    if degrees < MIN_BEND_DEGREES {
        return None;
    }
    // A body in motion bends its two elbows as it likes; a rest pose that bends one of them is badly placed.
    if !rig.rest_source.is_in_motion() {
        let other = if side == "left_" { "right_" } else { "left_" };
        // An axis of rotation is mirrored against the plane of the mirror.
        let mirrored = hinge(rig, other, limb).map(|(axis, _)| DVec3::new(axis.x, -axis.y, -axis.z))?;
        if axis.angle_between(mirrored).to_degrees() > UNLIKE_DEGREES {
            return None;
        }
    }
    let made = if limb == ARM { arm_convention(rig, side) } else { leg_convention(rig, side) };
    let most = if rig.rest_source.is_in_motion() { BACKWARD_DEGREES } else { SIDEWAYS_DEGREES };
    if made.is_some_and(|made| made.axis.angle_between(axis).to_degrees() > most) {
        return None;
    }
    let uncertainty_degrees = (PLACEMENT_DEGREES / degrees).atan().to_degrees();
    Some(Second { axis, cue: RollCue::Bend, uncertainty_degrees })
}

fn hinge(rig: &Rig<'_>, side: &str, limb: [&str; 3]) -> Option<(DVec3, f64)> {
    let [start, middle, end] = limb.map(|part| at(rig, &format!("{side}{part}")));
    let (upper, lower) = ((middle? - start?).try_normalize()?, (end? - middle?).try_normalize()?);
    Some((upper.cross(lower).try_normalize()?, upper.angle_between(lower).to_degrees()))
}

/// In a T pose an elbow bends forward, about the vertical.
fn arm_convention(rig: &Rig<'_>, side: &str) -> Option<Second> {
    let direction = Look::Rig(rig).toward(&format!("{side}upper_arm"), &format!("{side}forearm"))?;
    arm_convention_along(side, direction)
}

/// As above, for an arm that was moved from a T pose to that direction the shortest way.
pub(super) fn arm_convention_along(side: &str, direction: DVec3) -> Option<Second> {
    let outward = if side == "left_" { DVec3::X } else { DVec3::NEG_X };
    // Beyond this there are several ways to get there, and nothing says which was taken.
    if direction.dot(outward) < -0.5 {
        return None;
    }
    let axis = DQuat::from_rotation_arc(outward, direction) * outward.cross(DVec3::Z);
    Some(Second { axis, cue: RollCue::Convention, uncertainty_degrees: CONVENTION_DEGREES })
}

/// Below a body that stands, a knee bends backward, about its left.
fn leg_convention(rig: &Rig<'_>, side: &str) -> Option<Second> {
    let direction = Look::Rig(rig).toward(&format!("{side}thigh"), &format!("{side}shin"))?;
    if direction.y > 0.5 {
        return None;
    }
    let axis = DQuat::from_rotation_arc(DVec3::NEG_Y, direction) * DVec3::X;
    Some(Second { axis, cue: RollCue::Convention, uncertainty_degrees: CONVENTION_DEGREES })
}

/// A knee bends in the plane that its foot points in.
fn foot(rig: &Rig<'_>, side: &str, role: &str) -> Option<Second> {
    let look = Look::Rig(rig);
    let (foot, toe) = (format!("{side}foot"), format!("{side}toe"));
    let end = if role.ends_with("thigh") { format!("{side}shin") } else { foot.clone() };
    let along = look.toward(role, &end)?;
    let heading = look.toward(&foot, &toe).or_else(|| look.leaf(&foot))?.with_y(0.0).try_normalize()?;
    // A leg that points where its foot does has no plane.
    let axis = heading.cross(along);
    (axis.length() > 0.5).then(|| Second {
        axis: axis.normalize(),
        cue: RollCue::Foot,
        uncertainty_degrees: TURN_OUT_DEGREES,
    })
}

fn palm(rig: &Rig<'_>, side: &str, role: &str) -> Option<Second> {
    let knuckle = |finger: &str| at(rig, &format!("{side}{finger}"));
    let pairs = [("index", "pinky"), ("index", "ring"), ("middle", "pinky"), ("index", "middle"), ("middle", "ring")];
    let knuckles = pairs.iter().enumerate().find_map(|(rank, (near, far))| {
        let axis = (knuckle(near)? - knuckle(far)?).try_normalize()?;
        let uncertainty_degrees = if rank < 2 { 0.0 } else { NEIGHBORS_DEGREES };
        Some(Second { axis, cue: RollCue::Knuckles, uncertainty_degrees })
    });
    let thumb = || {
        let tip = rig.role(&format!("{side}thumb")).last()?;
        let axis = (place(rig, *tip) - at(rig, role)?).try_normalize()?;
        Some(Second { axis, cue: RollCue::Thumb, uncertainty_degrees: THUMB_DEGREES })
    };
    let flat = || {
        let flat = mesh::flat(rig, *rig.role(role).last()?)?;
        let (axis, uncertainty_degrees) = (rig.canonical_from_scene * flat.axis, flat.uncertainty_degrees);
        Some(Second { axis, cue: RollCue::Mesh, uncertainty_degrees })
    };
    knuckles.or_else(thumb).or_else(flat)
}
