//! Which point of one face is which of another.

use glam::DVec3;

use super::Face;

/// Faces are laid over each other in so many rounds.
const ROUNDS: usize = 12;
/// The share of points that a round goes by: the nearest ones, as hair and teeth may have no counterpart.
const KEPT_SHARE: f64 = 0.8;
/// Points farther apart than this share of the face's size have nothing to do with each other.
const FARTHEST_SHARE: f64 = 0.12;
/// Points of the same index may be this far apart, as a share of the size, on average.
const SAME_TOPOLOGY_SHARE: f64 = 0.08;
/// Points near a place whose displacements are mixed.
const NEIGHBORS: usize = 3;

/// Where each moving point of the target is on the source.
#[derive(Clone, Debug)]
pub(super) struct Correspondence {
    /// Point of the target, and points of the source with shares that make 1.
    pub(super) pairs: Vec<(usize, [(usize, f64); NEIGHBORS])>,
    /// Lengths of the target per length of the source.
    pub(super) scale: f64,
    /// Whether both are the same points in the same order.
    pub(super) is_same_topology: bool,
    /// How far apart corresponding points are on average, as a share of the target's size.
    pub(super) mean_distance_share: f64,
}

/// A uniform scale, and then a move.
#[derive(Clone, Copy, Debug)]
struct Placement {
    scale: f64,
    offset: DVec3,
}

impl Placement {
    fn of(self, point: DVec3) -> DVec3 {
        point * self.scale + self.offset
    }

    /// The one that brings points nearest to others, pair by pair, in the sense of least squares.
    fn best(pairs: &[(DVec3, DVec3)]) -> Option<Self> {
        let count = pairs.len() as f64;
        let (from, to) = pairs.iter().fold((DVec3::ZERO, DVec3::ZERO), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
        let (from, to) = (from / count, to / count);
        let spread: f64 = pairs.iter().map(|pair| (pair.0 - from).length_squared()).sum();
        let shared: f64 = pairs.iter().map(|pair| (pair.0 - from).dot(pair.1 - to)).sum();
        let scale = shared / spread;
        (scale.is_finite() && scale > 0.0).then_some(Self { scale, offset: to - from * scale })
    }
}

/// Finds it; nothing where a face has no point that moves. Both faces look the same way.
pub(super) fn correspondence(source: &Face, target: &Face) -> Option<Correspondence> {
    let (ours, theirs) = (target.moving(), source.moving());
    let (size, their_size) = (extent(target, &ours)?, extent(source, &theirs)?);
    if let Some(found) = by_index(source, target, &ours, size) {
        return Some(found);
    }
    let by_landmarks = Placement::best(&common_landmarks(source, target));
    let mut placement = by_landmarks.unwrap_or_else(|| {
        let scale = size.1 / their_size.1;
        Placement { scale, offset: size.0 - their_size.0 * scale }
    });
    let near = |placement: Placement| {
        let placed: Vec<DVec3> = source.positions.iter().map(|point| placement.of(*point)).collect();
        ByHeight::new(placed)
    };
    let farthest = FARTHEST_SHARE * size.1;
    // Points that move can be the mouth of one face and all of another: what is known to belong together says it better.
    let rounds = if by_landmarks.is_some() { 0 } else { ROUNDS };
    for _ in 0..rounds {
        let places = near(placement);
        let mut pairs: Vec<(f64, DVec3, DVec3)> = ours
            .iter()
            .filter_map(|point| {
                let place = target.positions[*point];
                let (found, distance) = places.nearest(place, farthest * 2.0)[0]?;
                Some((distance, source.positions[found], place))
            })
            .collect();
        pairs.sort_by(|one, other| one.0.total_cmp(&other.0));
        pairs.truncate(((pairs.len() as f64 * KEPT_SHARE) as usize).max(4));
        let pairs: Vec<(DVec3, DVec3)> = pairs.into_iter().map(|(_, from, to)| (from, to)).collect();
        let Some(better) = Placement::best(&pairs) else { break };
        placement = better;
    }
    let places = near(placement);
    let mut sum = 0.0;
    let pairs: Vec<(usize, [(usize, f64); NEIGHBORS])> = ours
        .iter()
        .filter_map(|point| {
            let found = places.nearest(target.positions[*point], farthest);
            let first = found[0]?;
            sum += first.1;
            Some((*point, shares(found.map(|one| one.unwrap_or(first)), size.1)))
        })
        .collect();
    let mean = sum / pairs.len() as f64 / size.1;
    (!pairs.is_empty()).then_some(Correspondence {
        pairs,
        scale: placement.scale,
        is_same_topology: false,
        mean_distance_share: mean,
    })
}

/// Places that both have, the source's first.
fn common_landmarks(source: &Face, target: &Face) -> Vec<(DVec3, DVec3)> {
    let theirs = |number: usize| source.landmarks.iter().find(|(other, _)| *other == number).map(|(_, place)| *place);
    target.landmarks.iter().filter_map(|(number, place)| Some((theirs(*number)?, *place))).collect()
}

/// Where both have as many points, and those of one index lie in one place.
fn by_index(source: &Face, target: &Face, ours: &[usize], size: (DVec3, f64)) -> Option<Correspondence> {
    if source.counts != target.counts {
        return None;
    }
    let pairs: Vec<(DVec3, DVec3)> =
        ours.iter().map(|point| (source.positions[*point], target.positions[*point])).collect();
    let placement = Placement::best(&pairs)?;
    let distance = pairs.iter().map(|(from, to)| placement.of(*from).distance(*to)).sum::<f64>();
    let mean_distance_share = distance / pairs.len() as f64 / size.1;
    let alone = |point: &usize| (*point, [(*point, 1.0), (*point, 0.0), (*point, 0.0)]);
    (mean_distance_share < SAME_TOPOLOGY_SHARE).then(|| Correspondence {
        pairs: ours.iter().map(alone).collect(),
        scale: placement.scale,
        is_same_topology: true,
        mean_distance_share,
    })
}

/// The middle of these points, and how large they are: both by medians, which single shapes that move the hair do not shift far.
fn extent(face: &Face, points: &[usize]) -> Option<(DVec3, f64)> {
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let middle = [0, 1, 2].map(|axis| median(points.iter().map(|point| face.positions[*point][axis]).collect()));
    let [Some(x), Some(y), Some(z)] = middle else { return None };
    let middle = DVec3::new(x, y, z);
    let radius = median(points.iter().map(|point| face.positions[*point].distance(middle)).collect())?;
    (radius > 0.0).then_some((middle, 2.0 * radius))
}

/// The nearer, the more.
fn shares(found: [(usize, f64); NEIGHBORS], size: f64) -> [(usize, f64); NEIGHBORS] {
    let weights = found.map(|(point, distance)| (point, 1.0 / (distance / size + 1e-6)));
    let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
    weights.map(|(point, weight)| (point, weight / sum))
}

/// Points by their height, so that those near a place are found without looking at all.
struct ByHeight {
    points: Vec<(usize, DVec3)>,
}

impl ByHeight {
    fn new(points: Vec<DVec3>) -> Self {
        let mut points: Vec<(usize, DVec3)> = points.into_iter().enumerate().collect();
        points.sort_by(|one, other| one.1.y.total_cmp(&other.1.y).then(one.0.cmp(&other.0)));
        Self { points }
    }

    /// The nearest ones that are not too far, nearest first, with their distances.
    fn nearest(&self, place: DVec3, farthest: f64) -> [Option<(usize, f64)>; NEIGHBORS] {
        let mut found: [Option<(usize, f64)>; NEIGHBORS] = [None; NEIGHBORS];
        let middle = self.points.partition_point(|(_, point)| point.y < place.y);
        let mut look = |index: usize, point: DVec3, limit: &mut f64| {
            let distance = point.distance(place);
            if distance < *limit {
                let at = found.iter().position(|known| known.is_none_or(|known| distance < known.1)).unwrap_or(0);
                found[at..].rotate_right(1);
                found[at] = Some((index, distance));
                *limit = found[NEIGHBORS - 1].map_or(*limit, |last| last.1);
            }
        };
        let mut limit = farthest;
        let (mut below, mut above) = (self.points[..middle].iter().rev(), self.points[middle..].iter());
        let (mut is_below, mut is_above) = (true, true);
        while is_below || is_above {
            is_below = is_below
                && below.next().is_some_and(|(index, point)| {
                    look(*index, *point, &mut limit);
                    place.y - point.y < limit
                });
            is_above = is_above
                && above.next().is_some_and(|(index, point)| {
                    look(*index, *point, &mut limit);
                    point.y - place.y < limit
                });
        }
        found
    }
}
