//! What a foot stands on: support points of its sole, from the skinned mesh where there is one, else guessed from proportions.
//!
//! A foot has two rigid parts: what moves with the ankle, and what moves with the toes; the shin may have a hold of it, too. A vertex
//! of the mesh that several of them move lies between, by their weights (linear blend skinning). Of the vertices of a foot only those can be the lowest one at
//! some tilt that are extreme in some direction that may point down. Those are looked for in directions about straight down, up
//! to 75 degrees off it on all sides, with the toes straight and bent up; they are the support points: the back of the heel, the
//! inner and outer edge, the ball, the tips of the toes. The lowest of them is as deep as the whole foot to about a millimeter.
//!
//! A foot without a mesh gets a heel behind the ankle, toes beyond a leaf toe joint, a forefoot where there is no toe joint, and
//! a width, by the proportions of a human foot.

mod extremes;
mod guess;
mod skin;

use glam::DVec3;

use super::{limb::LimbJoints, rig::Rig, rig_memory::Question};

/// The sole of a foot in its own axes, in plan units.
#[derive(Clone, Debug, Default)]
pub struct FootShape {
    /// What can touch the floor; empty where nothing is known of the foot.
    pub points: Vec<SupportPoint>,
    /// Where contacts are looked for and held: the back of the heel, the ball, the tip of the toes. Nothing where it is not
    /// known how the sole lies below the joints.
    pub contacts: [Option<FootPoint>; 3],
    /// Whether it is taken from a mesh.
    pub is_from_mesh: bool,
}

/// A point of a sole.
#[derive(Clone, Copy, Debug)]
pub struct SupportPoint {
    /// From the ankle, in the ankle's axes, with the toes as they are at rest.
    pub from_end: DVec3,
    /// From the joint of the ball, in its axes. The same as above for a foot without one.
    pub from_ball: DVec3,
    /// From the ankle, in the axes of the shin.
    pub from_shin: DVec3,
    /// The share by which it moves with the toes, 0 to 1.
    pub toes: f64,
    /// The share by which it moves with the shin, 0 to 1; what is left moves with the ankle.
    pub shin: f64,
    /// How far the sole is below the point, however the foot is turned: of feet of which nobody knows how they are turned at rest.
    pub radius: f64,
    /// Whether bending the toes lifts it.
    pub gives_way: bool,
}

/// A point that is fixed to a joint of a foot.
#[derive(Clone, Copy, Debug)]
pub struct FootPoint {
    /// The joint.
    pub joint: usize,
    /// From the joint, in its axes.
    pub offset: DVec3,
}

impl FootShape {
    /// How far the sole is below the ankle when the foot stands flat; `down` in the ankle's axes.
    #[must_use]
    pub fn depth(&self, down: DVec3) -> f64 {
        self.points.iter().map(|point| point.from_end.dot(down) + point.radius).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// The shape of the foot of a leg. `unit` is plan units per unit of the side's scene, `stands` whether the rest pose says how its feet
/// lie when they stand, `is_human` whether a foot without a mesh has the proportions of a human one. Needs the leg's `sole`.
pub(crate) fn foot_shape(side: &Rig<'_>, leg: &LimbJoints, unit: f64, stands: bool, is_human: bool) -> FootShape {
    side.recall(WhatItStandsOn { leg: *leg, unit, stands, is_human }, |asked| {
        let foot = Foot::of(side, leg, unit).filter(|_| asked.stands);
        let shape = foot.and_then(|foot| skin::shape(&foot).or_else(|| guess::shape(&foot).filter(|_| is_human)));
        shape.unwrap_or_else(|| guess::balls(leg))
    })
}

/// What does a foot stand on?
#[derive(PartialEq)]
struct WhatItStandsOn {
    leg: LimbJoints,
    unit: f64,
    stands: bool,
    is_human: bool,
}

impl Question for WhatItStandsOn {
    type Answer = FootShape;
}

/// A foot at rest, as it stands. Lengths are in the scene's unit, directions in its model space.
struct Foot<'a, 'b> {
    side: &'a Rig<'b>,
    leg: LimbJoints,
    unit: f64,
    up: DVec3,
    front: DVec3,
    left: DVec3,
    /// Length of thigh and shin.
    length: f64,
}

impl<'a, 'b> Foot<'a, 'b> {
    /// Nothing of a foot of which it is not known how it would stand.
    fn of(side: &'a Rig<'b>, leg: &LimbJoints, unit: f64) -> Option<Self> {
        let down = leg.sole?.down[0]?;
        let place = |joint: usize| side.rest.transforms()[joint].translation;
        let length = place(leg.start).distance(place(leg.middle)) + place(leg.middle).distance(place(leg.end));
        // A foot that is in the air at rest stands along the up of its own.
        let up = side.rest.transforms()[leg.end].rotation * -down;
        let facing = side.canonical_from_scene.conjugate() * DVec3::Z;
        let ahead = |to: DVec3| {
            let along = to - place(leg.end);
            let along = along - up * along.dot(up);
            (along.length() > 0.03 * length).then(|| along.normalize())
        };
        let below = side.skeleton();
        let farthest = (leg.end + 1..below.len()).filter(|joint| below.is_ancestor_or_self(leg.end, *joint)).max_by(
            |one, other| place(*one).distance(place(leg.end)).total_cmp(&place(*other).distance(place(leg.end))),
        );
        let pointed = [leg.ball, leg.tip, farthest].into_iter().flatten().find_map(|joint| ahead(place(joint)));
        let facing = (facing - up * facing.dot(up)).normalize_or(up.any_orthonormal_vector());
        let front = pointed.filter(|front| front.dot(facing) > 0.0).unwrap_or(facing);
        (length > 0.0).then(|| Self { side, leg: *leg, unit, up, front, left: up.cross(front), length })
    }

    fn place(&self, joint: usize) -> DVec3 {
        self.side.rest.transforms()[joint].translation
    }

    /// From a joint to a place, in the joint's axes and in plan units.
    fn offset(&self, joint: usize, place: DVec3) -> DVec3 {
        let rest = &self.side.rest.transforms()[joint];
        rest.rotation.conjugate() * (place - rest.translation) * self.unit
    }

    /// A point that is at a place at rest.
    fn support(&self, place: DVec3, toes: f64) -> SupportPoint {
        let from_end = self.offset(self.leg.end, place);
        let from_ball = self.leg.ball.map_or(from_end, |ball| self.offset(ball, place));
        let from_shin = self.offset_in_shin(place);
        SupportPoint { from_end, from_ball, from_shin, toes, shin: 0.0, radius: 0.0, gives_way: false }
    }

    /// From the ankle to a place at rest, in the axes of the shin.
    fn offset_in_shin(&self, place: DVec3) -> DVec3 {
        let shin = &self.side.rest.transforms()[self.leg.shin];
        shin.rotation.conjugate() * (place - self.place(self.leg.end)) * self.unit
    }

    /// A point at a place at rest that is fixed to a joint.
    fn fixed(&self, joint: usize, place: DVec3) -> FootPoint {
        FootPoint { joint, offset: self.offset(joint, place) }
    }

    /// Marks the points that the toes lift when they bend: those that move with them and are not right at the joint of the ball.
    fn mark_toes(&self, points: &mut [SupportPoint]) {
        let Some(ball) = self.leg.ball else { return };
        let front = self.side.rest.transforms()[ball].rotation.conjugate() * self.front;
        let ahead = |point: &SupportPoint| if point.toes >= FOLLOWS_TOES { point.from_ball.dot(front) } else { 0.0 };
        let farthest = points.iter().map(ahead).fold(0.0, f64::max);
        for point in points.iter_mut() {
            point.gives_way = farthest > 0.0 && ahead(point) >= LIFTED_BY_TOES * farthest;
        }
    }
}

/// A point that moves with the toes by this share is one of the toes.
const FOLLOWS_TOES: f64 = 0.7;
/// Points nearer to the joint of the ball than this share of the toes are hardly lifted when the toes bend.
const LIFTED_BY_TOES: f64 = 0.35;

#[cfg(test)]
mod tests;
