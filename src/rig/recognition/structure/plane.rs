//! The plane that a skeleton is mirrored at, and which joint is whose twin.
//!
//! A creature with many like legs cannot be sorted into pairs by the lengths of its bones alone; where the joints lie at rest can.
//! A skeleton in mid-stride has no such plane, and is not seen as a creature.

use glam::DVec3;

use super::shape::Shape;

/// Joints closer than this share of the body's span to where they are looked for are there.
const NEAR_SHARE: f64 = 0.012;
/// The ends of a pair are at least this far apart, as a share of the body's span.
const MIN_APART: f64 = 0.03;
/// A plane mirrors at least this share of all bones, by length.
const MIN_MIRRORED: f64 = 0.8;
/// Planes are tried between so many ends of chains at most, the farthest out first.
const MAX_ENDS: usize = 40;
/// So many of the likeliest planes are looked at joint by joint.
const MAX_TRIED: usize = 4;
/// Larger skeletons are not looked at joint by joint.
const MAX_JOINTS: usize = 1500;

/// The plane between left and right.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    /// From one side to the other; of unit length.
    pub normal: DVec3,
    /// Where on the normal the plane is.
    offset: f64,
    /// What counts as near.
    near: f64,
    /// Of every joint the one that mirrors it; a joint in the plane is its own.
    pub twin: Vec<Option<usize>>,
    /// The share of all bones, by length, that are mirrored.
    pub share: f64,
}

impl Plane {
    /// How far a point is from the plane, on the side that the normal points to.
    pub(super) fn distance(&self, point: DVec3) -> f64 {
        point.dot(self.normal) - self.offset
    }

    /// Whether a point is in the plane.
    pub(super) fn holds(&self, point: DVec3) -> bool {
        self.distance(point).abs() <= self.near
    }

    fn between(one: DVec3, other: DVec3, near: f64) -> Self {
        let normal = (one - other).normalize_or_zero();
        let offset = normal.dot(one.midpoint(other));
        Self { normal, offset, near, twin: Vec::new(), share: 0.0 }
    }

    fn mirrored(&self, point: DVec3) -> DVec3 {
        point - 2.0 * self.distance(point) * self.normal
    }
}

/// The plane that mirrors most of the skeleton; nothing where none mirrors nearly all of it.
pub(super) fn find_plane(shape: &Shape<'_>) -> Option<Plane> {
    if shape.order.len() > MAX_JOINTS || shape.span <= 0.0 {
        return None;
    }
    let near = NEAR_SHARE * shape.span;
    let ends = ends(shape);
    let mut tried: Vec<(usize, Plane)> = Vec::new();
    for (index, one) in ends.iter().enumerate() {
        for other in ends.iter().skip(index + 1) {
            if one.distance(*other) < MIN_APART * shape.span {
                continue;
            }
            let plane = Plane::between(*one, *other, near);
            let is_mirrored = |end: &&DVec3| {
                let twin = plane.mirrored(**end);
                ends.iter().any(|other| other.distance(twin) <= near)
            };
            tried.push((ends.iter().filter(is_mirrored).count(), plane));
        }
    }
    // Stable: among equals the pair that is farthest out.
    tried.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    tried.truncate(MAX_TRIED);
    let whole = tried.into_iter().map(|(_, plane)| with_twins(shape, plane));
    let best = whole.reduce(|best, plane| if plane.share > best.share { plane } else { best })?;
    (best.share >= MIN_MIRRORED).then_some(best)
}

/// Where chains end, the farthest from the middle first.
fn ends(shape: &Shape<'_>) -> Vec<DVec3> {
    let mut ends: Vec<DVec3> = shape
        .order
        .iter()
        .filter(|joint| shape.children[**joint].is_empty())
        .map(|end| shape.positions[*end])
        .collect();
    let middle = ends.iter().sum::<DVec3>() / ends.len().max(1) as f64;
    ends.sort_by(|one, other| other.distance(middle).total_cmp(&one.distance(middle)));
    ends.truncate(MAX_ENDS);
    ends
}

fn with_twins(shape: &Shape<'_>, plane: Plane) -> Plane {
    let mut twin = vec![None; shape.parent.len()];
    let (mut mirrored, mut all) = (0.0, 0.0);
    for joint in &shape.order {
        let wanted = plane.mirrored(shape.positions[*joint]);
        let distance = |other: &usize| shape.positions[*other].distance(wanted);
        let alike = |other: &&usize| {
            shape.depth[**other] == shape.depth[*joint]
                && shape.children[**other].len() == shape.children[*joint].len()
                && distance(other) <= plane.near
        };
        let nearest = shape.order.iter().filter(alike).min_by(|one, other| distance(one).total_cmp(&distance(other)));
        twin[*joint] = nearest.copied();
        all += shape.length[*joint];
        mirrored += if nearest.is_some() { shape.length[*joint] } else { 0.0 };
    }
    let share = if all > 0.0 { mirrored / all } else { 0.0 };
    Plane { twin, share, ..plane }
}
