//! The vertices of a character's meshes with every joint that moves them: linear blend skinning as data.

use glam::{DVec3, Vec3};

use super::{ModelPose, SkinPoint, SkinPoints};

/// One joint's share of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// The joint.
    pub joint: u32,
    /// Its share, above 0; the shares of one vertex sum up to 1.
    pub weight: f32,
    /// Where the joint has the vertex in its own space, as it was bound: in the unit of the scene divided by the joint's scale in
    /// model space, like every child of that joint.
    pub position: Vec3,
}

/// The vertices of all meshes that a skeleton moves: of skinned meshes with all their influences, and of meshes that hang on a joint
/// without a skin, which have one influence. In the order of the file.
///
/// A vertex is where linear blend skinning has it: `Σ weight · model_from_joint.transform_point(position)`. Made by a format's reader:
/// every number is finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkinVertices {
    influences: Vec<Influence>,
    /// The end of each vertex's influences.
    ends: Vec<u32>,
    /// How many of the vertices, from the first on, belong to skinned meshes.
    skinned: usize,
}

impl SkinVertices {
    /// Influences of one vertex that are kept; of more, the heaviest.
    pub const MAX_INFLUENCES: usize = 8;
    /// Bytes of a vertex with that many influences, for budgets.
    pub const MAX_VERTEX_BYTES: usize = Self::MAX_INFLUENCES * size_of::<Influence>() + size_of::<u32>();

    /// Adds a vertex. What has no weight or is not finite is left out, and the rest is scaled to a sum of 1; a vertex of which nothing
    /// is left is left out.
    pub fn push(&mut self, influences: &mut Vec<Influence>, is_skinned: bool) {
        influences.retain(|one| one.weight > 0.0 && one.weight.is_finite() && one.position.is_finite());
        if influences.len() > Self::MAX_INFLUENCES {
            influences.sort_by(|first, second| second.weight.total_cmp(&first.weight));
            influences.truncate(Self::MAX_INFLUENCES);
        }
        let sum: f32 = influences.iter().map(|one| one.weight).sum();
        let end = self.influences.len() + influences.len();
        let Some(end) = u32::try_from(end).ok().filter(|_| sum > 0.0 && sum.is_finite()) else { return };
        self.influences.extend(influences.iter().map(|one| Influence { weight: one.weight / sum, ..*one }));
        self.ends.push(end);
        if is_skinned {
            debug_assert_eq!(self.skinned + 1, self.ends.len(), "skinned meshes come first");
            self.skinned = self.ends.len();
        }
    }

    /// How many vertices there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The influences of a vertex.
    #[must_use]
    pub fn of(&self, vertex: usize) -> &[Influence] {
        let begin = if vertex == 0 { 0 } else { self.ends[vertex - 1] as usize };
        &self.influences[begin..self.ends[vertex] as usize]
    }

    /// The influences of every vertex, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[Influence]> {
        (0..self.len()).map(|vertex| self.of(vertex))
    }

    /// The influences of the vertices of skinned meshes.
    pub fn skinned(&self) -> impl Iterator<Item = &[Influence]> {
        (0..self.skinned).map(|vertex| self.of(vertex))
    }

    /// The influences of the vertices of meshes without a skin that hang on a joint.
    pub fn rigid(&self) -> impl Iterator<Item = &[Influence]> {
        (self.skinned..self.len()).map(|vertex| self.of(vertex))
    }

    /// Where a vertex is in a pose, model space.
    #[must_use]
    pub fn place(&self, vertex: usize, pose: &ModelPose) -> DVec3 {
        let place = |one: &Influence| {
            let model_from_joint = pose.transforms()[one.joint as usize];
            model_from_joint.transform_point(one.position.as_dvec3()) * f64::from(one.weight)
        };
        self.of(vertex).iter().map(place).sum()
    }

    /// The same vertices with the positions changed.
    #[must_use]
    pub fn map(&self, position: impl Fn(&Influence) -> Vec3) -> Self {
        let influences = self.influences.iter().map(|one| Influence { position: position(one), ..*one });
        Self { influences: influences.collect(), ends: self.ends.clone(), skinned: self.skinned }
    }

    /// The vertices of skinned meshes by the joints that move them, those that move little left out.
    #[must_use]
    pub fn points(&self, joint_count: usize) -> SkinPoints {
        let heavy = self.skinned().flatten().filter(|one| one.weight >= SkinPoints::MIN_WEIGHT);
        let entries = heavy.map(|one| (one.joint, SkinPoint { position: one.position, weight: one.weight }));
        SkinPoints::new(joint_count, &entries.collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Transform;

    fn influence(joint: u32, weight: f32, x: f32) -> Influence {
        Influence { joint, weight, position: Vec3::new(x, 0.0, 0.0) }
    }

    #[test]
    fn weights_sum_to_one_and_the_heaviest_are_kept() {
        let mut vertices = SkinVertices::default();
        vertices.push(&mut vec![influence(0, 0.2, 1.0), influence(1, 0.6, 2.0), influence(2, 0.0, 3.0)], true);
        vertices.push(&mut vec![influence(0, f32::NAN, 1.0)], true);
        vertices.push(&mut (0..10).map(|joint| influence(joint, 0.1 + joint as f32, 0.0)).collect(), true);
        vertices.push(&mut vec![influence(3, 1.0, 0.0)], false);
        assert_eq!(vertices.len(), 3, "what is no number is left out");
        assert_eq!(vertices.of(0), [influence(0, 0.25, 1.0), influence(1, 0.75, 2.0)], "in the file's order");
        let second = vertices.of(1);
        assert_eq!((second.len(), second[0].joint), (SkinVertices::MAX_INFLUENCES, 9), "the lightest two are left out");
        assert!((second.iter().map(|one| one.weight).sum::<f32>() - 1.0).abs() < 1e-6, "shares of one");
        let points = vertices.points(4);
        assert_eq!(points.of(1).len(), 1, "a share of 0.75");
        assert!(points.of(0).is_empty() && points.of(3).is_empty(), "too light, and no skinned mesh");
    }

    #[test]
    fn a_vertex_is_between_its_joints() {
        let mut vertices = SkinVertices::default();
        vertices.push(&mut vec![influence(0, 0.5, 1.0), influence(1, 0.5, 1.0)], true);
        let up = Transform::from_translation(DVec3::Y);
        let pose = crate::model::LocalPose::new(vec![Transform::IDENTITY, up]);
        let skeleton = crate::model::Skeleton::new(vec![
            crate::model::Joint { name: "a".into(), parent: None, rest: Transform::IDENTITY, is_joint: true, node: 0 },
            crate::model::Joint { name: "b".into(), parent: Some(0), rest: up, is_joint: true, node: 1 },
        ])
        .expect("valid");
        let place = vertices.place(0, &pose.to_model(&skeleton));
        assert!(place.distance(DVec3::new(1.0, 0.5, 0.0)) < 1e-12, "{place}");
    }
}
