//! A mesh whose limbs keep their length and their width: bones, not only joints, hold it, each part turns with its bone, and what lies
//! between two bones turns by its share of both.
//!
//! Shares are harmonic: 1 along their own bone, 0 along all others, and as even as can be between them, measured within the mesh (after
//! P. Joshi et al., "Harmonic Coordinates for Character Articulation", ACM Transactions on Graphics 26, 2007). With the turns known, the
//! places of the vertices are one back-substitution (O. Sorkine and M. Alexa, "As-Rigid-As-Possible Surface Modeling", 2007); around the joints
//! two rounds fit the turns to what came out.

use std::collections::BTreeMap;

use glam::DVec2;

use super::{
    DrawingError, PlanarRig,
    arap::neighbors,
    complex::{Complex, Entry},
    elimination,
    factors::{Factors, Hermitian},
    holds::{Bone, Hold, holds},
    untangle::{Untangling, UntanglingWorkspace},
};

/// Weight of a place that a bone holds, against an edge.
const HOLD_WEIGHT: f64 = 300.0;
/// The same for shares.
const SHARE_WEIGHT: f64 = 30.0;
/// Weight of an edge within a part that is to stay rigid.
const RIGID_WEIGHT: f64 = 12.0;
/// Bones that a vertex has a share of, at most: as many as a glTF skin holds for a vertex.
pub(super) const MAX_SHARES: usize = 4;
/// Smaller shares are left out.
const MIN_SHARE: f64 = 0.02;
/// From this share of one bone on, an edge turns with its bones and with nothing else.
const FIRM_FROM: f64 = 0.97;
/// Up to this share it turns as what is around it does.
const LOOSE_TO: f64 = 0.6;
/// Rounds in which turns are fitted to places.
const ROUNDS: usize = 2;

/// The share of a bone in a vertex.
pub(super) type Share = (usize, f64);

/// A mesh on bones, ready for frames.
#[derive(Clone, Debug)]
pub(super) struct BoneMesh {
    bones: Vec<Bone>,
    /// The joints at rest.
    rest_joints: Vec<DVec2>,
    /// The direction of each bone at rest.
    directions: Vec<DVec2>,
    /// For each vertex the bones that it hangs on, with shares that add up to 1.
    shares: Vec<Vec<Share>>,
    untangling: Untangling,
    /// What firm edges ask for that turn with one bone alone, which are most, summed up for each vertex and bone.
    pulls: Vec<Pull>,
    /// The others; firm ones first.
    edges: Vec<Edge>,
    /// How many of them are firm.
    firm: usize,
    /// The edges at the ends of those that are not, which they are fitted to: their ends, and how they lie at rest, mirrored.
    fitted: Vec<([usize; 2], Complex)>,
    holds: Vec<Hold>,
    factors: Factors<f64>,
    /// For each vertex its place in the factors.
    places: Vec<usize>,
}

#[derive(Clone, Debug)]
struct Edge {
    ends: [usize; 2],
    rest: Complex,
    weight: f64,
    shares: Vec<Share>,
    /// How much it turns with its bones: 0 to 1.
    firmness: f64,
}

/// What a bone asks for at a vertex, in the bone's own directions at rest: as long as the bone has its length, and what is added for each length more.
#[derive(Clone, Copy, Debug)]
struct Pull {
    /// The vertex's place in the factors.
    place: usize,
    bone: usize,
    way: Complex,
    longer: Complex,
}

/// What [`BoneMesh::deform`] works in.
#[derive(Clone, Debug)]
pub(super) struct BoneWorkspace {
    unknowns: Vec<Complex>,
    /// What firm edges and holds ask for: the same in all rounds.
    asked: Vec<Complex>,
    /// Of the edges that are not firm, the ways between their ends before they are turned, by their weights.
    ways: Vec<Complex>,
    turns: Vec<Complex>,
    /// What bones turn them by.
    wanted: Vec<Complex>,
    fits: Vec<Complex>,
    lengths: Vec<f64>,
    untangling: UntanglingWorkspace,
}

/// Where a bone is: what its vertices turn by, how much it is longer than at rest, and where it begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct BonePose {
    pub(super) turn: Complex,
    pub(super) stretch: f64,
    pub(super) start: DVec2,
}

impl BonePose {
    /// The pose of a bone between two places that lay elsewhere at rest.
    pub(super) fn of(rest: [DVec2; 2], posed: [DVec2; 2]) -> Self {
        let (before, after) = (rest[1] - rest[0], posed[1] - posed[0]);
        let turn = (Complex(before).conjugate() * Complex(after)).unit();
        Self { turn, stretch: after.length() / before.length().max(1e-12), start: posed[0] }
    }

    /// A way at rest, as the bone turns and stretches it; `along` is the bone's direction at rest.
    fn carried(&self, way: DVec2, along: DVec2) -> DVec2 {
        let stretched = way + along * (along.dot(way) * (self.stretch - 1.0));
        (self.turn * Complex(stretched)).0
    }
}

impl BoneMesh {
    /// Prepares a mesh. Bones of the joints in `rigid` keep all that is nearer to them than to others as it is.
    ///
    /// # Errors
    ///
    /// Where the mesh is empty, or the rig has no bone.
    pub(super) fn new(
        vertices: &[DVec2],
        triangles: &[[usize; 3]],
        rig: &PlanarRig,
        rigid: &[usize],
    ) -> Result<Self, DrawingError> {
        let bones: Vec<Bone> = rig
            .parents
            .iter()
            .enumerate()
            .filter_map(|(joint, parent)| Some(Bone { joint, from: (*parent)? }))
            .filter(|bone| rig.rest[bone.joint].distance(rig.rest[bone.from]) > 1e-6)
            .collect();
        if vertices.is_empty() || bones.is_empty() {
            let fix = "give a mask with a figure, and joints that lie apart from one another";
            return Err(DrawingError::new("mesh", "there is no figure, or no bone in it", fix));
        }
        let neighbors = neighbors(vertices.len(), triangles);
        let places = elimination::order(&neighbors);
        let holds = holds(vertices, triangles, &neighbors, &bones, &rig.rest);
        let mut shares = shares(&bones, &holds, &neighbors, &places);
        let rigid: Vec<usize> = (0..bones.len()).filter(|bone| rigid.contains(&bones[*bone].joint)).collect();
        shares.iter_mut().for_each(|shares| keep_rigid(shares, &rigid));
        let mut edges: Vec<Edge> = (0..vertices.len())
            .flat_map(|one| neighbors[one].iter().filter(move |&&other| one < other).map(move |&other| [one, other]))
            .map(|ends| edge(ends, vertices, &shares, &rigid))
            .collect();
        edges.sort_by_key(|edge| edge.firmness < 1.0);
        let rows: Vec<Vec<(usize, f64)>> = edges
            .iter()
            .map(|edge| vec![(edge.ends[0], -edge.weight.sqrt()), (edge.ends[1], edge.weight.sqrt())])
            .collect();
        let directions: Vec<DVec2> =
            bones.iter().map(|bone| (rig.rest[bone.joint] - rig.rest[bone.from]).normalize_or_zero()).collect();
        let firm = edges.partition_point(|edge| edge.firmness >= 1.0);
        let mut is_fitted = vec![false; vertices.len()];
        edges[firm..].iter().flat_map(|edge| edge.ends).for_each(|end| is_fitted[end] = true);
        let fitted = edges.iter().filter(|edge| edge.ends.iter().any(|&end| is_fitted[end]));
        let fitted = fitted.map(|edge| (edge.ends, edge.rest.conjugate())).collect();
        let (of_one, edges): (Vec<Edge>, Vec<Edge>) =
            edges.into_iter().partition(|edge| edge.firmness >= 1.0 && edge.shares.len() == 1);
        let held: Vec<Vec<(usize, f64)>> = holds.iter().map(|hold| weighted(hold, HOLD_WEIGHT)).collect();
        let factors = Factors::new(&Hermitian::of_rows(&[&rows, &held], &places, false));
        let rest_joints = rig.rest.clone();
        Ok(Self {
            pulls: pulls(&of_one, &directions, &places),
            directions,
            bones,
            rest_joints,
            shares,
            untangling: Untangling::new(vertices, triangles),
            firm: firm - of_one.len(),
            edges,
            fitted,
            holds,
            factors,
            places,
        })
    }

    /// Memory for [`Self::deform`].
    pub(super) fn workspace(&self) -> BoneWorkspace {
        let count = self.places.len();
        let loose = self.edges.len() - self.firm;
        BoneWorkspace {
            unknowns: vec![Complex::default(); count],
            asked: vec![Complex::default(); count],
            ways: vec![Complex::default(); loose],
            turns: vec![Complex::default(); loose],
            wanted: vec![Complex::default(); loose],
            fits: vec![Complex::default(); count],
            lengths: vec![0.0; loose],
            untangling: UntanglingWorkspace::default(),
        }
    }

    /// The bones.
    pub(super) fn bones(&self) -> &[Bone] {
        &self.bones
    }

    /// For each vertex the bones that it hangs on.
    pub(super) fn shares(&self) -> &[Vec<Share>] {
        &self.shares
    }

    /// Where each bone is when the joints are there.
    pub(super) fn poses(&self, joints: &[DVec2]) -> Vec<BonePose> {
        let pair = |places: &[DVec2], bone: &Bone| [places[bone.from], places[bone.joint]];
        self.bones.iter().map(|bone| BonePose::of(pair(&self.rest_joints, bone), pair(joints, bone))).collect()
    }

    /// Whether a vertex is one bone's alone, so that what is around it keeps its shape.
    pub(super) fn is_firm(&self, vertex: usize) -> bool {
        self.shares[vertex][0].1 >= FIRM_FROM
    }

    /// Where a vertex is that its bones carry by themselves, as skins do: the mean of where each would take it, by its shares.
    pub(super) fn carried(&self, vertex: usize, at: DVec2, poses: &[BonePose]) -> DVec2 {
        let by = |&(bone, share): &Share| {
            let way = at - self.rest_joints[self.bones[bone].from];
            (poses[bone].start + poses[bone].carried(way, self.directions[bone])) * share
        };
        self.shares[vertex].iter().map(by).sum()
    }

    /// Where the vertices are when the joints are at `joints`.
    pub(super) fn deform(&self, joints: &[DVec2], workspace: &mut BoneWorkspace, vertices: &mut [DVec2]) {
        let poses = self.poses(joints);
        self.ask(&poses, workspace);
        for round in 0..=ROUNDS {
            if round > 0 {
                self.fit(vertices, workspace);
            }
            let BoneWorkspace { unknowns, turns, asked, ways, .. } = workspace;
            unknowns.copy_from_slice(asked);
            for ((edge, &turn), &way) in self.edges[self.firm..].iter().zip(turns.iter()).zip(ways.iter()) {
                self.pull(edge, turn * way, unknowns);
            }
            self.factors.solve(unknowns);
            for (vertex, &place) in vertices.iter_mut().zip(&self.places) {
                *vertex = unknowns[place].0;
            }
        }
        self.untangling.untangle(vertices, &mut workspace.untangling);
    }

    /// Sums up what holds and firm edges ask for, and begins with what bones turn the other edges by.
    fn ask(&self, poses: &[BonePose], workspace: &mut BoneWorkspace) {
        let BoneWorkspace { turns, wanted, ways, asked, lengths, .. } = workspace;
        asked.fill(Complex::default());
        for pull in &self.pulls {
            let pose = &poses[pull.bone];
            asked[pull.place] += pose.turn * (pull.way + pull.longer.scaled(pose.stretch - 1.0));
        }
        let (firm, loose) = self.edges.split_at(self.firm);
        for edge in firm {
            self.pull(edge, mixed(&edge.shares, poses).unit() * self.way(edge, poses), asked);
        }
        for ((turn, way), edge) in wanted.iter_mut().zip(ways).zip(loose) {
            (*turn, *way) = (mixed(&edge.shares, poses), self.way(edge, poses));
        }
        units(wanted, lengths);
        turns.copy_from_slice(wanted);
        for hold in &self.holds {
            let pose = &poses[hold.bone];
            let way = hold.at - self.rest_joints[self.bones[hold.bone].from];
            let target = Complex(pose.start + pose.carried(way, self.directions[hold.bone]));
            for &(vertex, share) in &hold.corners {
                asked[self.places[vertex]] += target.scaled(HOLD_WEIGHT * HOLD_WEIGHT * share);
            }
        }
    }

    /// The way between the ends of an edge that it had at rest, stretched, by its weight.
    fn way(&self, edge: &Edge, poses: &[BonePose]) -> Complex {
        let mut way = edge.rest.0;
        for &(bone, share) in &edge.shares {
            let longer = poses[bone].stretch - 1.0;
            if longer.abs() > 1e-12 {
                way += self.directions[bone] * (self.directions[bone].dot(edge.rest.0) * longer * share);
            }
        }
        Complex(way).scaled(edge.weight)
    }

    /// Has an edge ask for a way between its ends.
    fn pull(&self, edge: &Edge, way: Complex, unknowns: &mut [Complex]) {
        unknowns[self.places[edge.ends[0]]] -= way;
        unknowns[self.places[edge.ends[1]]] += way;
    }

    /// Turns edges that no bone holds firmly as what is around them has turned.
    fn fit(&self, vertices: &[DVec2], workspace: &mut BoneWorkspace) {
        let BoneWorkspace { turns, fits, wanted, lengths, .. } = workspace;
        fits.fill(Complex::default());
        for &([one, other], mirrored) in &self.fitted {
            let fit = mirrored * Complex(vertices[other] - vertices[one]);
            fits[one] += fit;
            fits[other] += fit;
        }
        let loose = &self.edges[self.firm..];
        for (turn, edge) in turns.iter_mut().zip(loose) {
            let [one, other] = edge.ends;
            *turn = Complex(fits[one].0 + fits[other].0);
        }
        units(turns, lengths);
        for ((turn, edge), wanted) in turns.iter_mut().zip(loose).zip(wanted.iter()) {
            *turn = Complex(wanted.0 * edge.firmness + turn.0 * (1.0 - edge.firmness));
        }
        units(turns, lengths);
    }
}

/// Gives numbers the length of 1; 0 stays. Square roots and divisions take long, and several are done at once where they stand by themselves.
fn units(numbers: &mut [Complex], lengths: &mut [f64]) {
    for (length, number) in lengths.iter_mut().zip(numbers.iter()) {
        *length = number.0.length_squared().max(f64::MIN_POSITIVE);
    }
    for length in lengths.iter_mut() {
        *length = 1.0 / length.sqrt();
    }
    for (length, number) in lengths.iter().zip(numbers) {
        number.0 *= *length;
    }
}

/// What edges ask for that each turn with one bone, for each vertex and bone.
fn pulls(edges: &[Edge], directions: &[DVec2], places: &[usize]) -> Vec<Pull> {
    let mut sums: BTreeMap<(usize, usize), [DVec2; 2]> = BTreeMap::new();
    for edge in edges {
        let bone = edge.shares[0].0;
        let way = edge.rest.0 * edge.weight;
        let longer = directions[bone] * directions[bone].dot(way);
        for (end, side) in edge.ends.into_iter().zip([-1.0, 1.0]) {
            let sum = sums.entry((places[end], bone)).or_default();
            sum[0] += way * side;
            sum[1] += longer * side;
        }
    }
    let sums = sums.into_iter();
    sums.map(|((place, bone), [way, longer])| Pull { place, bone, way: Complex(way), longer: Complex(longer) })
        .collect()
}

/// The turns of several bones, by their shares, not yet of length 1.
fn mixed(shares: &[Share], poses: &[BonePose]) -> Complex {
    let mut sum = Complex::default();
    for &(bone, share) in shares {
        sum += poses[bone].turn.scaled(share);
    }
    sum
}

fn weighted(hold: &Hold, weight: f64) -> Vec<(usize, f64)> {
    hold.corners.iter().map(|&(vertex, share)| (vertex, share * weight)).collect()
}

fn edge(ends: [usize; 2], vertices: &[DVec2], shares: &[Vec<Share>], rigid: &[usize]) -> Edge {
    let mut sum: Vec<Share> = Vec::new();
    for &(bone, share) in ends.iter().flat_map(|&end| &shares[end]) {
        match sum.iter_mut().find(|(other, _)| *other == bone) {
            Some((_, part)) => *part += share / 2.0,
            None => sum.push((bone, share / 2.0)),
        }
    }
    let (bone, most) = sum.iter().copied().max_by(|one, other| one.1.total_cmp(&other.1)).unwrap_or((0, 1.0));
    let firmness = ((most - LOOSE_TO) / (FIRM_FROM - LOOSE_TO)).clamp(0.0, 1.0);
    let weight = if rigid.contains(&bone) && most > FIRM_FROM { RIGID_WEIGHT } else { 1.0 };
    Edge { ends, rest: Complex(vertices[ends[1]] - vertices[ends[0]]), weight, shares: sum, firmness }
}

/// Gives a vertex that is mostly a rigid bone's to that bone.
fn keep_rigid(shares: &mut Vec<Share>, rigid: &[usize]) {
    if let Some(&(bone, _)) = shares.iter().find(|(bone, share)| rigid.contains(bone) && *share > 0.5) {
        *shares = vec![(bone, 1.0)];
    }
}

/// For each vertex the bones that it hangs on.
fn shares(bones: &[Bone], holds: &[Hold], neighbors: &[Vec<usize>], places: &[usize]) -> Vec<Vec<Share>> {
    let rows: Vec<Vec<(usize, f64)>> = (0..places.len())
        .flat_map(|one| neighbors[one].iter().filter(move |&&other| one < other).map(move |&other| (one, other)))
        .map(|(one, other)| vec![(one, -1.0), (other, 1.0)])
        .collect();
    let held: Vec<Vec<(usize, f64)>> = holds.iter().map(|hold| weighted(hold, SHARE_WEIGHT)).collect();
    let factors = Factors::new(&Hermitian::of_rows(&[&rows, &held], places, false));
    let mut shares: Vec<Vec<Share>> = vec![Vec::new(); places.len()];
    let mut solved = vec![Complex::default(); places.len()];
    // Two bones at a time, one as the real part and one as the imaginary part.
    for pair in (0..bones.len()).step_by(2) {
        solved.fill(Complex::default());
        for hold in holds.iter().filter(|hold| hold.bone / 2 * 2 == pair) {
            let unit = if hold.bone == pair { DVec2::X } else { DVec2::Y };
            for &(vertex, share) in &hold.corners {
                solved[places[vertex]] += Complex(unit * (share * SHARE_WEIGHT * SHARE_WEIGHT));
            }
        }
        factors.solve(&mut solved);
        for (shares, &place) in shares.iter_mut().zip(places) {
            let DVec2 { x, y } = solved[place].0;
            shares.extend([(pair, x), (pair + 1, y)].into_iter().filter(|(_, share)| *share > MIN_SHARE));
        }
    }
    for shares in &mut shares {
        shares.sort_by(|one, other| other.1.total_cmp(&one.1).then(one.0.cmp(&other.0)));
        shares.truncate(MAX_SHARES);
        let sum: f64 = shares.iter().map(|(_, share)| share).sum();
        shares.iter_mut().for_each(|(_, share)| *share /= sum.max(1e-12));
        if shares.is_empty() {
            shares.push((0, 1.0));
        }
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::{CharacterSpec, PlanarRig, untangle::doubled_area};

    /// A bar of 4 by 1, with a joint in its middle and one at each end.
    fn bar() -> (Vec<DVec2>, Vec<[usize; 3]>, PlanarRig) {
        let columns = 33;
        let vertices: Vec<DVec2> = (0..columns * 9)
            .map(|index| DVec2::new((index % columns) as f64 / 40.0 + 0.1, (index / columns) as f64 / 40.0 + 0.1))
            .collect();
        let squares = (0..8).flat_map(|row| (0..columns - 1).map(move |column| row * columns + column));
        let triangles = squares
            .flat_map(|low| [[low, low + 1, low + columns + 1], [low, low + columns + 1, low + columns]])
            .collect();
        let text = "{width: 100, height: 100, skeleton: [{name: root, loc: [12, 80], parent: null},
            {name: middle, loc: [50, 80], parent: root}, {name: end, loc: [88, 80], parent: middle}]}";
        let spec = CharacterSpec::read(text).expect("a spec");
        (vertices, triangles, PlanarRig::new(&spec).expect("a rig"))
    }

    #[test]
    fn a_bend_keeps_lengths_and_widths_and_turns_nothing_over() {
        let (vertices, triangles, rig) = bar();
        let mesh = BoneMesh::new(&vertices, &triangles, &rig, &[]).expect("a mesh");
        let mut bent = vec![DVec2::ZERO; vertices.len()];
        for degrees in [0.0_f64, 30.0, -60.0, 90.0, 120.0] {
            let turn = DVec2::from_angle(degrees.to_radians());
            let joints = [rig.rest[0], rig.rest[1], rig.rest[1] + turn.rotate(rig.rest[2] - rig.rest[1])];
            mesh.deform(&joints, &mut mesh.workspace(), &mut bent);
            let turned_over = triangles
                .iter()
                .filter(|triangle| doubled_area(&bent, triangle) * doubled_area(&vertices, triangle) <= 0.0);
            assert_eq!(turned_over.count(), 0, "at {degrees} degrees");
            // Across the limb, halfway along each bone.
            for column in [7, 25] {
                let width = bent[column].distance(bent[8 * 33 + column]);
                assert!((width / 0.2 - 1.0).abs() < 0.05, "at {degrees} degrees, {width} wide");
            }
            // Beyond the last joint the mesh goes with the last bone.
            let at = |index: usize| {
                let way = vertices[index] - rig.rest[1];
                joints[1] + turn.rotate(way)
            };
            assert!(bent[32].distance(at(32)) < 0.01, "at {degrees} degrees: {} instead of {}", bent[32], at(32));
        }
    }

    #[test]
    fn shares_add_up_and_parts_that_nothing_holds_go_with_the_nearest_bone() {
        let (mut vertices, mut triangles, rig) = bar();
        let first = vertices.len();
        vertices.extend([DVec2::new(0.8, 0.5), DVec2::new(0.85, 0.5), DVec2::new(0.85, 0.55)]);
        triangles.push([first, first + 1, first + 2]);
        let mesh = BoneMesh::new(&vertices, &triangles, &rig, &[]).expect("a mesh");
        for shares in mesh.shares() {
            let sum: f64 = shares.iter().map(|(_, share)| share).sum();
            assert!((sum - 1.0).abs() < 1e-9 && shares.len() <= MAX_SHARES, "{shares:?}");
        }
        let turn = DVec2::from_angle(0.5);
        let moved = |place: DVec2| rig.rest[1] + turn.rotate(place - rig.rest[1]);
        let joints = [rig.rest[0], rig.rest[1], moved(rig.rest[2])];
        let mut bent = vec![DVec2::ZERO; vertices.len()];
        mesh.deform(&joints, &mut mesh.workspace(), &mut bent);
        for vertex in first..first + 3 {
            assert!(bent[vertex].distance(moved(vertices[vertex])) < 1e-3, "{}", bent[vertex]);
        }
    }
}
