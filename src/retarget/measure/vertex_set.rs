//! The lowest of many vertices of a mesh, found exactly, without skinning all.
//!
//! Linear blend skinning with all influences. Vertices that lie together make clusters, and a cluster that cannot reach below what was
//! found is passed over.

use std::{collections::BTreeMap, ops::Range};

use glam::DVec3;

use crate::{
    model::{Influence, Transform},
    rig::Rig,
};

/// Vertices of a cluster, at most, and the size of the cells in which vertices lie together, in leg lengths.
const CLUSTER: usize = 24;
const CELL: f64 = 0.025;

/// Vertices whose lowest one is looked for.
#[derive(Debug, Default)]
pub(super) struct VertexSet {
    clusters: Vec<Cluster>,
    shares: Vec<Share>,
    /// Where the shares of each vertex end.
    ends: Vec<usize>,
}

/// One joint's share of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Share {
    /// The joint's number in [`Kinematics`].
    pub(super) joint: usize,
    pub(super) weight: f64,
    /// Its position in the joint's space, times the weight.
    pub(super) place: DVec3,
}

/// Vertices that lie together and move with the same joints, and how far from their middle they can be.
#[derive(Debug, Default)]
struct Cluster {
    vertices: Range<usize>,
    /// The mean vertex.
    middle: Vec<Share>,
    /// How far a vertex is from it, in the joints' spaces.
    radius: f64,
    /// How much a joint's weight differs from its mean, for each share of the middle.
    spread: Vec<f64>,
}

/// What a joint's pose means for heights: `height = row · place + height · weight`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Row {
    row: DVec3,
    length: f64,
    height: f64,
}

impl Share {
    /// `joints` are those that are posed, rising.
    pub(super) fn of(one: &Influence, joints: &[usize]) -> Self {
        Self {
            joint: joints.binary_search(&(one.joint as usize)).unwrap_or(0),
            weight: f64::from(one.weight),
            place: one.position.as_dvec3() * f64::from(one.weight),
        }
    }
}

impl Row {
    /// Along the rig's up axis, in the scene's unit.
    pub(super) fn of(joint: &Transform, up: DVec3) -> Self {
        let along = joint.rotation.conjugate() * up * joint.scale;
        Self { row: along, length: along.length(), height: joint.translation.dot(up) }
    }

    /// What is so far from the joint in its space is no lower.
    pub(super) fn lower_bound(&self, reach: f64) -> f64 {
        self.height - reach * self.length
    }
}

impl VertexSet {
    /// Some vertices of a rig's meshes. `joints` are those that are posed, rising; the leg is in meters.
    pub(super) fn of_skin(rig: &Rig<'_>, vertices: &[usize], joints: &[usize], leg: f64) -> Self {
        let skin = &rig.scene.skin_vertices;
        let of = |&vertex: &usize| {
            let shares = skin.of(vertex).iter().map(|one| Share::of(one, joints)).collect();
            (shares, skin.place(vertex, &rig.rest) * rig.unit_meters)
        };
        Self::of(vertices.iter().map(of).collect(), CELL * leg)
    }

    /// Of vertices with their places at rest, and the size of a cell.
    fn of(vertices: Vec<(Vec<Share>, DVec3)>, cell: f64) -> Self {
        let joints = |shares: &[Share]| shares.iter().map(|share| share.joint).collect::<Vec<usize>>();
        #[expect(clippy::cast_possible_truncation, reason = "a few cells")]
        let cell_of = |place: DVec3| (place / cell.max(1e-9)).floor().to_array().map(|number| number as i64);
        let mut keyed: Vec<_> =
            vertices.into_iter().map(|(shares, place)| ((joints(&shares), cell_of(place)), shares)).collect();
        keyed.sort_by(|first, second| first.0.cmp(&second.0));
        let mut set = Self::default();
        let mut begin = 0;
        for index in 0..keyed.len() {
            set.shares.extend(&keyed[index].1);
            set.ends.push(set.shares.len());
            // Clusters may go on in the next cell, as cells may hold few vertices.
            let goes_on = keyed.get(index + 1).is_some_and(|next| {
                let is_near = next.0.1[0] == keyed[begin].0.1[0] && next.0.1[1] == keyed[begin].0.1[1];
                next.0.0 == keyed[begin].0.0 && is_near && index + 1 - begin < CLUSTER
            });
            if !goes_on {
                let own: Vec<&[Share]> = keyed[begin..=index].iter().map(|(_, shares)| shares.as_slice()).collect();
                set.clusters.push(Cluster::of(&own, begin..index + 1));
                begin = index + 1;
            }
        }
        set
    }

    fn vertex(&self, vertex: usize) -> &[Share] {
        let begin = if vertex == 0 { 0 } else { self.ends[vertex - 1] };
        &self.shares[begin..self.ends[vertex]]
    }

    /// The height of the lowest vertex, and its cluster. `first` is the cluster that is looked at first, best where it was lowest in the
    /// frame before.
    pub(super) fn lowest(&self, rows: &[Row], first: usize) -> (f64, usize) {
        self.lowest_below(f64::INFINITY, rows, first)
    }

    /// The same of those below a height; the height itself where none is.
    pub(super) fn lowest_below(&self, height_limit: f64, rows: &[Row], first: usize) -> (f64, usize) {
        let mut found = (height_limit, first);
        if self.clusters.is_empty() {
            return found;
        }
        for index in std::iter::once(first).chain((0..self.clusters.len()).filter(|index| *index != first)) {
            let cluster = &self.clusters[index];
            if cluster.lower_bound(rows) >= found.0 {
                continue;
            }
            for vertex in cluster.vertices.clone() {
                let height = height(self.vertex(vertex), rows);
                if height < found.0 {
                    found = (height, index);
                }
            }
        }
        found
    }

    /// Whether there is no vertex.
    pub(super) fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// How far from each of its joints a vertex is at most, in that joint's space: no vertex is lower than the lowest joint is by that.
    pub(super) fn reaches(&self) -> Vec<(usize, f64)> {
        let mut reaches: BTreeMap<usize, f64> = BTreeMap::new();
        for share in &self.shares {
            let reach = reaches.entry(share.joint).or_default();
            *reach = reach.max(share.place.length() / share.weight);
        }
        reaches.into_iter().collect()
    }
}

impl Cluster {
    /// Of vertices with the same joints in the same order.
    fn of(vertices: &[&[Share]], range: Range<usize>) -> Self {
        let count = vertices.len() as f64;
        let mean = |index: usize| Share {
            joint: vertices[0][index].joint,
            weight: vertices.iter().map(|shares| shares[index].weight).sum::<f64>() / count,
            place: vertices.iter().map(|shares| shares[index].place).sum::<DVec3>() / count,
        };
        let middle: Vec<Share> = (0..vertices[0].len()).map(mean).collect();
        let distance = |shares: &&[Share]| {
            shares.iter().zip(&middle).map(|(own, mean)| own.place.distance(mean.place)).sum::<f64>()
        };
        let radius = vertices.iter().map(distance).fold(0.0, f64::max);
        let spread = |index: usize| {
            vertices.iter().map(|shares| (shares[index].weight - middle[index].weight).abs()).fold(0.0, f64::max)
        };
        let spread = (0..middle.len()).map(spread).collect();
        Self { vertices: range, middle, radius, spread }
    }

    /// No vertex is lower. Weights sum up to 1, so that their differences count by how far apart the joints are in height.
    fn lower_bound(&self, rows: &[Row]) -> f64 {
        let first = rows[self.middle[0].joint];
        let (mut reach, mut apart) = (0.0_f64, 0.0);
        for (share, spread) in self.middle.iter().zip(&self.spread) {
            let row = rows[share.joint];
            reach = reach.max(row.length);
            apart += spread * (row.height - first.height).abs();
        }
        height(&self.middle, rows) - self.radius * reach - apart
    }
}

fn height(shares: &[Share], rows: &[Row]) -> f64 {
    let share = |share: &Share| rows[share.joint].row.dot(share.place) + rows[share.joint].height * share.weight;
    shares.iter().map(share).sum()
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    #[test]
    fn the_lowest_of_all_vertices_is_found() {
        // A foot 26 cm long that bends at the ball, with thousands of vertices, and a shin above it.
        let mut vertices = Vec::new();
        for index in 0..4000_usize {
            let (turn, along) = (index as f64 * 2.399, (index % 97) as f64 / 97.0);
            let place = DVec3::new(0.045 * turn.cos(), 0.03 * turn.sin(), 0.26 * along - 0.06);
            let toe = ((place.z - 0.1) / 0.06).clamp(0.0, 1.0);
            let shin = (-place.z * 4.0).clamp(0.0, 0.2);
            let share =
                |joint: usize, weight: f64, origin: DVec3| Share { joint, weight, place: (place - origin) * weight };
            let mut shares = vec![share(0, 1.0 - toe - shin, DVec3::ZERO)];
            shares.extend((toe > 0.0).then(|| share(1, toe, DVec3::Z * 0.13)));
            shares.extend((shin > 0.0).then(|| share(2, shin, DVec3::Y * 0.4)));
            vertices.push((shares, place));
        }
        let set = VertexSet::of(vertices, CELL);
        assert_eq!(set.ends.len(), 4000, "all are kept");
        let mut first = 0;
        for index in 0..500 {
            let angle = f64::from(index) * 0.05;
            let foot = DQuat::from_euler(glam::EulerRot::XYZ, angle, 0.3 * angle, (2.0 * angle).sin());
            let toe = foot * DQuat::from_rotation_x(-0.6 * angle.sin().abs());
            let shin = DQuat::from_rotation_x(0.4 * angle.cos());
            let row = |turn: DQuat, height: f64| {
                let row = turn.conjugate() * DVec3::Y;
                Row { row, length: row.length(), height }
            };
            let rows = [row(foot, 0.1), row(toe, 0.1 + (foot * DVec3::Z).y * 0.13), row(shin, 0.5)];
            let all = (0..4000).map(|vertex| height(set.vertex(vertex), &rows)).fold(f64::INFINITY, f64::min);
            let found;
            (found, first) = set.lowest(&rows, first);
            assert!((found - all).abs() < 1e-12, "pose {index}: {found} where {all} is lowest");
        }
    }
}
