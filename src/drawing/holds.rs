//! Where bones hold a mesh: places along each bone that are moved into the mesh where they lie outside, and two places for a part of the
//! mesh that no bone goes through.

use glam::DVec2;

use super::arap::{Precision, pin};

/// Places along a bone, with its ends.
const PLACES: usize = 9;
/// Within this share of a bone's length from its ends there is no place but the ends, so that joints bend smoothly.
const BENT_SHARE: f64 = 0.22;
/// A place is moved into the mesh by so much of the bone's length at most, unless it is an end.
const MOVED_AT_MOST: f64 = 0.15;

/// A bone: the joint at its end, and the joint that it begins at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bone {
    pub(super) joint: usize,
    pub(super) from: usize,
}

/// A place in the mesh that goes where a bone goes.
#[derive(Clone, Debug)]
pub(super) struct Hold {
    pub(super) bone: usize,
    /// Corners of the triangle that it lies in, with shares.
    pub(super) corners: [(usize, f64); 3],
    /// Where it is at rest.
    pub(super) at: DVec2,
}

/// All places that bones hold.
pub(super) fn holds(
    vertices: &[DVec2],
    triangles: &[[usize; 3]],
    neighbors: &[Vec<usize>],
    bones: &[Bone],
    joints: &[DVec2],
) -> Vec<Hold> {
    let mut holds = Vec::new();
    for (index, bone) in bones.iter().enumerate() {
        let (start, end) = (joints[bone.from], joints[bone.joint]);
        for place in 0..PLACES {
            let share = place as f64 / (PLACES - 1) as f64;
            let is_end = place == 0 || place + 1 == PLACES;
            if !is_end && !(BENT_SHARE..=1.0 - BENT_SHARE).contains(&share) {
                continue;
            }
            let wanted = start.lerp(end, share);
            let Some((corners, at)) = inside(vertices, triangles, wanted) else { continue };
            if is_end || at.distance(wanted) <= MOVED_AT_MOST * start.distance(end) {
                holds.push(Hold { bone: index, corners, at });
            }
        }
    }
    hold_loose_parts(vertices, neighbors, bones, joints, &mut holds);
    holds
}

/// The corners of a triangle, each with its share of a place in it.
type Corners = [(usize, f64); 3];

/// A place, or the place in the mesh that is nearest to it.
fn inside(vertices: &[DVec2], triangles: &[[usize; 3]], wanted: DVec2) -> Option<(Corners, DVec2)> {
    if let Some(corners) = pin(vertices, triangles, wanted, Precision::Double) {
        return Some((corners, wanted));
    }
    let mut best: Option<(f64, Corners, DVec2)> = None;
    for &[one, two, three] in triangles {
        for (from, to, other) in [(one, two, three), (two, three, one), (three, one, two)] {
            let along = vertices[to] - vertices[from];
            let share = ((wanted - vertices[from]).dot(along) / along.length_squared().max(1e-18)).clamp(0.0, 1.0);
            let at = vertices[from] + along * share;
            let distance = at.distance_squared(wanted);
            if best.is_none_or(|(least, _, _)| distance < least) {
                best = Some((distance, [(from, 1.0 - share), (to, share), (other, 0.0)], at));
            }
        }
    }
    best.map(|(_, corners, at)| (corners, at))
}

/// Hangs parts that no bone goes through on the bone that is nearest to them.
fn hold_loose_parts(
    vertices: &[DVec2],
    neighbors: &[Vec<usize>],
    bones: &[Bone],
    joints: &[DVec2],
    holds: &mut Vec<Hold>,
) {
    let parts = parts(neighbors);
    let count = parts.iter().max().map_or(0, |last| last + 1);
    let mut is_held = vec![false; count];
    holds.iter().for_each(|hold| is_held[parts[hold.corners[0].0]] = true);
    for part in (0..count).filter(|part| !is_held[*part]) {
        let members: Vec<usize> = (0..vertices.len()).filter(|vertex| parts[*vertex] == part).collect();
        let middle = members.iter().map(|&vertex| vertices[vertex]).sum::<DVec2>() / members.len() as f64;
        let distance = |bone: &Bone| {
            let (start, end) = (joints[bone.from], joints[bone.joint]);
            let share = ((middle - start).dot(end - start) / (end - start).length_squared()).clamp(0.0, 1.0);
            start.lerp(end, share).distance(middle)
        };
        let nearest = (0..bones.len()).min_by(|&one, &other| distance(&bones[one]).total_cmp(&distance(&bones[other])));
        let Some(bone) = nearest else { continue };
        let far = |from: DVec2| {
            let away = |vertex: &usize| vertices[*vertex].distance(from);
            members.iter().copied().max_by(|one, other| away(one).total_cmp(&away(other))).unwrap_or(members[0])
        };
        let first = far(middle);
        for vertex in [first, far(vertices[first])] {
            holds.push(Hold { bone, corners: [(vertex, 1.0), (vertex, 0.0), (vertex, 0.0)], at: vertices[vertex] });
        }
    }
}

/// For each vertex the part of the mesh that it belongs to.
fn parts(neighbors: &[Vec<usize>]) -> Vec<usize> {
    const NONE: usize = usize::MAX;
    let mut parts = vec![NONE; neighbors.len()];
    let mut count = 0;
    for start in 0..neighbors.len() {
        if parts[start] != NONE {
            continue;
        }
        let mut open = vec![start];
        parts[start] = count;
        while let Some(vertex) = open.pop() {
            for &other in neighbors[vertex].iter().filter(|other| parts[**other] == NONE).collect::<Vec<_>>() {
                parts[other] = count;
                open.push(other);
            }
        }
        count += 1;
    }
    parts
}
