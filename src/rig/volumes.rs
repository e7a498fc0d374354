//! How thick a body is: capsules and balls about its bones. (docs/algorithm/body.md.)
//!
//! As thick as the mesh where there is one, else as bodies usually are. Shares of the leg (hip to ankle): of a man of 1.75 m it is
//! 0.86 m.

use glam::DVec3;

use super::{limb::Limb, rig::Rig, rig_memory::Question};

/// Fewer points of a mesh do not say how thick a part is.
const FEW_POINTS: usize = 12;
/// Share of the points about a bone that lie within the radius.
const WITHIN: f64 = 0.6;
/// The trunk is looked at within so many legs above and below a line across it.
const BAND: f64 = 0.08;
/// Share of the points of the trunk there that lie within its width and its depth.
const WITHIN_TRUNK: f64 = 0.9;
/// What is lower below the pelvis than this, in legs, is no trunk but a skirt, a cape or a tail.
const LAP: f64 = 0.3;
/// A mesh that says a part is thinner or thicker than usual by more than this factor is clothes, or belongs to something else.
const MAX_UNUSUAL: f64 = 2.5;

/// A part of the body on both sides.
#[derive(Clone, Debug)]
pub struct BodyPart {
    /// What it is, for tests and messages.
    pub name: &'static str,
    /// The arm that it is a part of; its own hand cannot touch it.
    pub arm: Option<Limb>,
    /// Of the source.
    pub source: Capsule,
    /// Of the target.
    pub target: Capsule,
}

/// A hand on both sides.
#[derive(Clone, Debug)]
pub struct HandPair {
    /// Its arm, as an index into the limbs.
    pub limb: usize,
    /// A capsule of no length.
    pub source: Capsule,
    /// Likewise.
    pub target: Capsule,
}

/// What is within a radius of a line, in plan units.
#[derive(Clone, Copy, Debug)]
pub struct Capsule {
    /// Where the line begins.
    pub start: Anchor,
    /// Where it ends.
    pub end: Anchor,
    /// How thick.
    pub radius: f64,
}

/// A point that is fixed to a joint.
#[derive(Clone, Copy, Debug)]
pub struct Anchor {
    /// The joint.
    pub joint: usize,
    /// From the joint, in its axes, in plan units.
    pub offset: DVec3,
}

impl Anchor {
    /// In a unit of which one of this is so many.
    pub(crate) fn in_unit(self, unit: f64) -> Self {
        Self { offset: self.offset * unit, ..self }
    }
}

impl Capsule {
    /// In a unit of which one of this is so many.
    pub(crate) fn in_unit(self, unit: f64) -> Self {
        Self { start: self.start.in_unit(unit), end: self.end.in_unit(unit), radius: self.radius * unit }
    }
}

/// The parts that both rigs have. `unit` is plan units per unit of the source.
pub(crate) fn body_parts(source: &Rig<'_>, target: &Rig<'_>, unit: f64) -> Vec<BodyPart> {
    let mut of_target = capsules(target, 1.0);
    let mut parts = Vec::new();
    for (name, arm, source) in capsules(source, unit) {
        if let Some(position) = of_target.iter().position(|(other, _, _)| *other == name) {
            let (_, _, target) = of_target.swap_remove(position);
            parts.push(BodyPart { name, arm, source, target });
        }
    }
    parts
}

/// The parts of a rig's body with its hands, lengths in the scene's unit. Unlike those of [`body_parts`], which hands are led to as they
/// lie on the other body, they are nowhere thicker than the mesh.
#[must_use]
pub fn body_capsules(side: &Rig<'_>) -> Vec<(&'static str, Capsule)> {
    side.recall(HowThickItIs, |_| fitted_capsules(side))
}

/// Where the trunk ends on all sides: points of hips, waist and chest, and how much beyond them it reaches. Of the mesh where there is one,
/// but for what a few of its vertices are, such as spikes. In the scene's unit.
pub(crate) fn trunk_ends(side: &Rig<'_>) -> Vec<(Anchor, f64)> {
    side.recall(WhereItsTrunkEnds, |_| Body::of(side, 1.0).map(|body| body.trunk_ends()).unwrap_or_default())
}

/// Where does its trunk end?
#[derive(PartialEq)]
struct WhereItsTrunkEnds;

impl Question for WhereItsTrunkEnds {
    type Answer = Vec<(Anchor, f64)>;
}

/// How thick is it?
#[derive(PartialEq)]
struct HowThickItIs;

impl Question for HowThickItIs {
    type Answer = Vec<(&'static str, Capsule)>;
}

fn fitted_capsules(side: &Rig<'_>) -> Vec<(&'static str, Capsule)> {
    let trunk = Body::of(side, 1.0).map(|body| body.fitted_trunk()).unwrap_or_default();
    let round = capsules(side, 1.0).into_iter().map(|(name, _, capsule)| (name, capsule));
    let others: Vec<_> = round.filter(|(name, _)| !trunk.iter().any(|(fitted, _)| fitted == name)).collect();
    let parts = trunk.into_iter().chain(others);
    let hands = [("left_hand", Limb::LeftArm), ("right_hand", Limb::RightArm)];
    parts.chain(hands.into_iter().filter_map(|(name, arm)| Some((name, hand(side, arm, 1.0)?)))).collect()
}

/// The ball of a hand; nothing for what is no arm.
pub(crate) fn hand(side: &Rig<'_>, limb: Limb, unit: f64) -> Option<Capsule> {
    let prefix = limb.side_of_arm()?;
    let body = Body::of(side, unit)?;
    let (forearm, wrist) = (body.place(&format!("{prefix}forearm"))?, body.first(&format!("{prefix}hand"))?);
    let at = body.at(wrist);
    let palm = match body.place(&format!("{prefix}middle")) {
        Some(knuckle) => at + (knuckle - at) * 0.8,
        None => at + (at - forearm).normalize_or_zero() * (0.09 * body.leg),
    };
    let anchor = body.anchor(wrist, palm);
    Some(Capsule { start: anchor, end: anchor, radius: 0.025 * body.leg * unit })
}

/// Along the axes and between them, of any length.
pub(super) fn all_sides() -> impl Iterator<Item = DVec3> {
    let sides = [-1.0, 0.0, 1.0];
    let all =
        sides.into_iter().flat_map(move |x| sides.into_iter().flat_map(move |y| sides.map(|z| DVec3::new(x, y, z))));
    all.filter(|direction| *direction != DVec3::ZERO)
}

/// Which value such a share of them is below; there is one at least.
pub(super) fn share_of(values: &mut [f64], share: f64) -> f64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
    let index = (values.len() as f64 * share) as usize;
    *values.select_nth_unstable_by(index.min(values.len() - 1), f64::total_cmp).1
}

type Named = (&'static str, Option<Limb>, Capsule);

fn capsules(side: &Rig<'_>, unit: f64) -> Vec<Named> {
    let Some(body) = Body::of(side, unit) else { return Vec::new() };
    [body.trunk(), body.limbs()].concat()
}

/// A rig at rest.
pub(super) struct Body<'a, 'b> {
    side: &'a Rig<'b>,
    unit: f64,
    /// Hip to ankle, in the scene's unit.
    pub(super) leg: f64,
}

impl<'a, 'b> Body<'a, 'b> {
    pub(super) fn of(side: &'a Rig<'b>, unit: f64) -> Option<Self> {
        let mut body = Self { side, unit, leg: 0.0 };
        let [thigh, shin, foot] = ["left_thigh", "left_shin", "left_foot"].map(|role| body.place(role));
        let (thigh, shin, foot) = (thigh?, shin?, foot?);
        body.leg = thigh.distance(shin) + shin.distance(foot);
        (body.leg > 0.0).then_some(body)
    }

    pub(super) fn first(&self, role: &str) -> Option<usize> {
        self.side.role(role).first().copied()
    }

    pub(super) fn at(&self, joint: usize) -> DVec3 {
        self.side.rest.transforms()[joint].translation
    }

    pub(super) fn place(&self, role: &str) -> Option<DVec3> {
        self.first(role).map(|joint| self.at(joint))
    }

    pub(super) fn anchor(&self, joint: usize, place: DVec3) -> Anchor {
        let rest = self.side.rest.transforms()[joint];
        Anchor { joint, offset: rest.rotation.conjugate() * (place - rest.translation) * self.unit }
    }

    /// From one place to another, both fixed to joints; `thickness` is the usual one in legs, and the mesh of `joints` has a say.
    fn capsule(&self, start: (usize, DVec3), end: (usize, DVec3), thickness: f64, joints: &[usize]) -> Capsule {
        let usual = thickness * self.leg;
        let radius = self.thickness(start.1, end.1, joints).unwrap_or(usual);
        let radius = radius.clamp(usual / MAX_UNUSUAL, usual * MAX_UNUSUAL);
        Capsule { start: self.anchor(start.0, start.1), end: self.anchor(end.0, end.1), radius: radius * self.unit }
    }

    /// Where the vertices are at rest that joints move.
    pub(super) fn mesh_points(&self, joints: &[usize]) -> impl Iterator<Item = DVec3> {
        joints.iter().flat_map(|&joint| {
            let rest = self.side.rest.transforms()[joint];
            let points = self.side.scene.skin_points.of(joint).iter();
            points.map(move |point| rest.transform_point(point.position.as_dvec3()))
        })
    }

    /// See [`trunk_ends`].
    fn trunk_ends(&self) -> Vec<(Anchor, f64)> {
        let joints = self.side.role("pelvis").iter().chain(self.side.role("spine"));
        let lap = self.place("pelvis").map_or(f64::NEG_INFINITY, |pelvis| pelvis.dot(self.side.up()) - LAP * self.leg);
        let of_mesh: Vec<(Anchor, f64)> = joints.flat_map(|&joint| self.ends_of(joint, lap)).collect();
        if !of_mesh.is_empty() {
            return of_mesh;
        }
        let ends = |(_, _, capsule): &Named| [capsule.start, capsule.end].map(|anchor| (anchor, capsule.radius));
        self.trunk().iter().filter(|(name, ..)| *name != "head").flat_map(ends).collect()
    }

    /// What the mesh of a joint reaches to along its axes and between them, but for what is below a height.
    fn ends_of(&self, joint: usize, lap: f64) -> Vec<(Anchor, f64)> {
        let points: Vec<DVec3> = self.mesh_points(&[joint]).filter(|point| point.dot(self.side.up()) > lap).collect();
        if points.len() < FEW_POINTS {
            return Vec::new();
        }
        let center = points.iter().sum::<DVec3>() / points.len() as f64;
        let end = |direction: DVec3| {
            let direction = direction.try_normalize()?;
            let ways = points.iter().map(|point| (*point - center).dot(direction));
            Some((self.anchor(joint, center + direction * ways.fold(0.0, f64::max)), 0.0))
        };
        all_sides().filter_map(end).collect()
    }

    /// The distance from the line within which most of the points beside it are.
    fn thickness(&self, start: DVec3, end: DVec3, joints: &[usize]) -> Option<f64> {
        let line = end - start;
        let mut distances = Vec::new();
        for point in self.mesh_points(joints) {
            let share = (point - start).dot(line) / line.length_squared().max(f64::MIN_POSITIVE);
            if (0.0..=1.0).contains(&share) {
                distances.push(point.distance(start + line * share));
            }
        }
        (distances.len() >= FEW_POINTS).then(|| share_of(&mut distances, WITHIN))
    }

    /// Across the trunk, fixed to a joint, from `center - half` to `center + half`. Where the mesh of `joints` says how wide and how deep
    /// the trunk is there, the capsule is as wide and as deep.
    fn across(&self, joint: usize, center: DVec3, half: DVec3, thickness: f64, joints: &[usize]) -> Capsule {
        let usual = thickness * self.leg;
        let capsule = |center: DVec3, half: DVec3, radius: f64| Capsule {
            start: self.anchor(joint, center + half),
            end: self.anchor(joint, center - half),
            radius: radius * self.unit,
        };
        let aside = half.reject_from(self.side.up()).normalize_or_zero();
        let ahead = aside.cross(self.side.up());
        let mut widths = Vec::new();
        let mut depths = Vec::new();
        for from_center in self.mesh_points(joints).map(|point| point - center) {
            if from_center.dot(self.side.up()).abs() < BAND * self.leg {
                widths.push(from_center.dot(aside).abs());
                depths.push(from_center.dot(ahead));
            }
        }
        if widths.len() < FEW_POINTS || aside == DVec3::ZERO {
            return capsule(center, half, usual);
        }
        let width = share_of(&mut widths, WITHIN_TRUNK);
        let beyond = (1.0 - WITHIN_TRUNK) / 2.0;
        let (back, front) = (share_of(&mut depths, beyond), share_of(&mut depths, 1.0 - beyond));
        let radius = ((front - back) / 2.0).min(width).clamp(usual / MAX_UNUSUAL, usual * MAX_UNUSUAL);
        let half = aside * (width - radius).clamp(0.0, usual * MAX_UNUSUAL);
        capsule(center + ahead * f64::midpoint(front, back), half, radius)
    }

    /// Hips and chest lie across, so that they are wider than deep; the waist stands between them, the head on top.
    fn trunk(&self) -> Vec<Named> {
        let mut found = Vec::new();
        let spine = self.side.role("spine");
        let (Some(pelvis), Some(left), Some(right)) =
            (self.first("pelvis"), self.place("left_thigh"), self.place("right_thigh"))
        else {
            return found;
        };
        let chest = spine.last().copied().unwrap_or(pelvis);
        found.push(("hips", None, self.capsule((pelvis, left), (pelvis, right), 0.13, &[pelvis])));
        if let (Some(left), Some(right)) = (self.place("left_upper_arm"), self.place("right_upper_arm")) {
            let middle = (left + right) / 2.0 - self.side.up() * (0.12 * self.leg);
            let half = (left - right) * 0.3;
            found.push(("chest", None, self.capsule((chest, middle + half), (chest, middle - half), 0.13, &[chest])));
            let hips = (self.place("left_thigh").unwrap_or(middle) + self.place("right_thigh").unwrap_or(middle)) / 2.0;
            let joints: Vec<usize> = spine.iter().copied().chain([pelvis]).collect();
            found.push(("waist", None, self.capsule((pelvis, hips), (chest, middle), 0.14, &joints)));
        }
        if let Some(head) = self.first("head") {
            let up = self.side.up() * self.leg;
            let (low, high) = (self.at(head) + up * 0.07, self.at(head) + up * 0.13);
            found.push(("head", None, self.capsule((head, low), (head, high), 0.11, &[head])));
        }
        found
    }

    /// Hips, waist and chest, each as wide and as deep as the mesh is there: what is inside of them is inside of the body. The round ones of
    /// [`Self::trunk`] reach past the sides of a trunk, which is wider than deep.
    fn fitted_trunk(&self) -> Vec<(&'static str, Capsule)> {
        let spine = self.side.role("spine");
        let thighs = ["left_thigh", "right_thigh"];
        let (Some(pelvis), [Some(left), Some(right)]) = (self.first("pelvis"), thighs.map(|role| self.place(role)))
        else {
            return Vec::new();
        };
        let hips = (left + right) / 2.0;
        let around: Vec<usize> = thighs.iter().filter_map(|role| self.first(role)).chain([pelvis]).collect();
        let mut found = vec![("hips", self.across(pelvis, hips, (left - right) / 2.0, 0.13, &around))];
        if let (Some(left), Some(right)) = (self.place("left_upper_arm"), self.place("right_upper_arm")) {
            let shoulders = (left - right) / 2.0;
            let middle = (left + right) / 2.0 - self.side.up() * (0.12 * self.leg);
            let trunk: Vec<usize> = spine.iter().copied().chain([pelvis]).collect();
            let joint = |place: usize| spine.get(place).copied().unwrap_or(pelvis);
            let (chest, waist) = (joint(spine.len().saturating_sub(1)), joint(spine.len() / 2));
            found.push(("chest", self.across(chest, middle, shoulders * 0.6, 0.13, &trunk)));
            found.push(("waist", self.across(waist, (hips + middle) / 2.0, shoulders * 0.25, 0.14, &trunk)));
        }
        found
    }

    fn limbs(&self) -> Vec<Named> {
        const PARTS: [(&str, &str, &str, Option<Limb>, f64); 8] = [
            ("left_upper_arm", "left_upper_arm", "left_forearm", Some(Limb::LeftArm), 0.052),
            ("left_forearm", "left_forearm", "left_hand", Some(Limb::LeftArm), 0.041),
            ("right_upper_arm", "right_upper_arm", "right_forearm", Some(Limb::RightArm), 0.052),
            ("right_forearm", "right_forearm", "right_hand", Some(Limb::RightArm), 0.041),
            ("left_thigh", "left_thigh", "left_shin", None, 0.087),
            ("left_shin", "left_shin", "left_foot", None, 0.058),
            ("right_thigh", "right_thigh", "right_shin", None, 0.087),
            ("right_shin", "right_shin", "right_foot", None, 0.058),
        ];
        let part = |(name, start, end, arm, thickness): (&'static str, &str, &str, Option<Limb>, f64)| {
            let (joint, end) = (self.first(start)?, self.place(end)?);
            let joints = self.side.role(start);
            let capsule = self.capsule((joint, self.at(joint)), (joint, end), thickness, joints);
            Some((name, arm, capsule))
        };
        PARTS.into_iter().filter_map(part).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::{Reporter, SkinPoint, SkinPoints, Transform},
        retarget::RetargetSpec,
        samples,
    };

    #[test]
    fn a_trunk_is_as_wide_and_as_deep_as_its_mesh() {
        let mut scene = samples::walk_scene();
        let rest = scene.skeleton.rest_pose().to_model(&scene.skeleton);
        let mut entries = Vec::new();
        for name in ["mixamorig:Hips", "mixamorig:Spine", "mixamorig:Spine1", "mixamorig:Spine2"] {
            let joint = scene.skeleton.find(name).expect("a joint of the walker");
            let at = rest.transforms()[joint].translation;
            // Walls of a box of 24 by 14 centimeters about each joint, eight high.
            for step in 0..40 {
                for (x, z) in [(0.12, 0.07), (0.12, -0.07), (-0.12, 0.07), (-0.12, -0.07)] {
                    let place = DVec3::new(x, at.y - 0.1 + 0.005 * f64::from(step), at.z + z);
                    let own = rest.transforms()[joint].relative(&Transform::from_translation(place)).translation;
                    let point = SkinPoint { position: own.as_vec3(), weight: 1.0 };
                    entries.push((u32::try_from(joint).expect("few joints"), point));
                }
            }
        }
        scene.skin_points = SkinPoints::new(scene.skeleton.len(), &entries);
        let spec = RetargetSpec::default();
        let rig = Rig::new("target", &scene, None, &spec.target, &mut Reporter::new()).expect("a rig");
        let capsules = body_capsules(&rig);
        for name in ["hips", "waist", "chest"] {
            let (_, capsule) = capsules.iter().find(|(other, _)| *other == name).expect(name);
            let half = capsule.start.offset.distance(capsule.end.offset) / 2.0;
            assert!((capsule.radius - 0.07).abs() < 0.02, "{name} is as deep: {}", capsule.radius);
            assert!((half + capsule.radius - 0.12).abs() < 0.02, "{name} is as wide: {half} and {}", capsule.radius);
        }
    }
}
