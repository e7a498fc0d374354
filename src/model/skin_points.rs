//! Where the vertices of a mesh lie around the joints that move them: what tells a sole from an ankle, and how thick an arm is.

use glam::Vec3;

/// A vertex of a mesh, as one of its joints sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinPoint {
    /// In the joint's own space, as it was bound: the vertex moves with the joint, so in any pose it is at
    /// `model_from_joint.transform_point(position)` as far as this joint is concerned. In the unit of the scene divided by the
    /// joint's scale in model space, like every child of that joint.
    pub position: Vec3,
    /// The share of the vertex that the joint moves, from [`SkinPoints::MIN_WEIGHT`] to 1.
    pub weight: f32,
}

/// The vertices of all skinned meshes by the joints that move them; empty for files without meshes, and for joints that move
/// no vertex by more than a little.
///
/// Made by a format's reader: every position is finite. In the order of the file, so equal files give equal points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkinPoints {
    points: Vec<SkinPoint>,
    /// The first point of every joint, and the end of the last one's.
    begins: Vec<u32>,
}

impl SkinPoints {
    /// Vertices that a joint moves by a smaller share say more about its neighbors than about the joint.
    pub const MIN_WEIGHT: f32 = 0.3;

    /// Sorts points by their joints, keeping their order within a joint. What is not finite, too light, or of no joint among
    /// the first `joint_count` is left out.
    #[must_use]
    pub fn new(joint_count: usize, entries: &[(u32, SkinPoint)]) -> Self {
        let is_kept = |joint: u32, point: &SkinPoint| {
            (joint as usize) < joint_count && point.weight >= Self::MIN_WEIGHT && point.position.is_finite()
        };
        let mut begins = vec![0_u32; joint_count + 1];
        for (joint, point) in entries.iter().take(u32::MAX as usize) {
            if is_kept(*joint, point) {
                begins[*joint as usize + 1] += 1;
            }
        }
        for joint in 0..joint_count {
            begins[joint + 1] += begins[joint];
        }
        let mut next = begins.clone();
        let nothing = SkinPoint { position: Vec3::ZERO, weight: 0.0 };
        let mut points = vec![nothing; begins[joint_count] as usize];
        for (joint, point) in entries.iter().take(u32::MAX as usize) {
            if is_kept(*joint, point) {
                let slot = &mut next[*joint as usize];
                points[*slot as usize] = SkinPoint { weight: point.weight.min(1.0), ..*point };
                *slot += 1;
            }
        }
        Self { points, begins }
    }

    /// The points of a joint; empty where there are none.
    #[must_use]
    pub fn of(&self, joint: usize) -> &[SkinPoint] {
        let ends = self.begins.get(joint).zip(self.begins.get(joint + 1));
        ends.map_or(&[], |(begin, end)| &self.points[*begin as usize..*end as usize])
    }

    /// Whether there is no point at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// How many points there are, over all joints.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// The same points in a scene whose unit of length is `factor` times as many.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        let points = self.points.iter().map(|point| SkinPoint { position: point.position * factor, ..*point });
        Self { points: points.collect(), begins: self.begins.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f32, weight: f32) -> SkinPoint {
        SkinPoint { position: Vec3::new(x, 0.0, 0.0), weight }
    }

    #[test]
    fn points_are_sorted_by_joint_and_what_says_nothing_is_left_out() {
        let entries = [
            (2, point(1.0, 1.0)),
            (0, point(2.0, 0.5)),
            (2, point(3.0, 0.29)),
            (7, point(4.0, 1.0)),
            (2, point(5.0, 1.5)),
            (0, point(f32::NAN, 1.0)),
        ];
        let points = SkinPoints::new(3, &entries);
        assert_eq!(points.of(0), [point(2.0, 0.5)], "the one that is finite");
        assert_eq!(points.of(1), [], "nothing is bound to it");
        assert_eq!(points.of(2), [point(1.0, 1.0), point(5.0, 1.0)], "in the order of the file, weights at most 1");
        assert_eq!(points.of(7), [], "not one of the joints");
        assert_eq!((points.len(), points.is_empty()), (3, false), "three are kept");
        assert!(SkinPoints::default().of(0).is_empty(), "a file without meshes");
    }
}
