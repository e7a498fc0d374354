//! A skeleton as lengths and ways: the tree that limbs are looked for in.

use glam::DVec3;

/// Joints with more children than this are no part of a body that we know; the longest ones are kept.
const MAX_CHILDREN: usize = 32;

/// A piece of a skeleton is joined to another over gaps no longer than this share of the body.
const LONGEST_GAP: f64 = 0.25;
/// A single joint is joined over gaps no longer than this share...
const LONGEST_GAP_OF_ONE: f64 = 0.06;
/// ... or this, where it lies straight on from the end of a limb (a foot of an IK rig).
const LONGEST_BONE: f64 = 0.4;
/// How straight that is: a cosine.
const STRAIGHT_ON: f64 = 0.7;
/// Pieces are alike when their lengths differ by no more than this share.
const ALIKE_SHARE: f64 = 0.03;
/// More pieces than this are no body in parts.
const MAX_PIECES: usize = 64;
/// Larger skeletons are not put together from pieces.
const MAX_JOINTS: usize = 2000;

/// The joints that count, with their lengths. Knows no names.
#[derive(Debug)]
pub(super) struct Shape<'a> {
    pub positions: &'a [DVec3],
    /// Joints that count, parents before children.
    pub order: Vec<usize>,
    /// The next joint above that counts.
    pub parent: Vec<Option<usize>>,
    /// Those with the longest way down first.
    pub children: Vec<Vec<usize>>,
    /// Length of the bone from the parent.
    pub length: Vec<f64>,
    /// Length of the longest way down along the bones.
    pub reach: Vec<f64>,
    pub depth: Vec<usize>,
    /// The longest side of the box around all joints.
    pub span: f64,
}

impl<'a> Shape<'a> {
    /// The tree of the joints in `members`, as the file has it.
    pub(super) fn new(parents: &[Option<usize>], positions: &'a [DVec3], members: &[bool]) -> Self {
        let mut parent = vec![None; parents.len()];
        for joint in 0..parents.len() {
            let above = parents[joint];
            // Parents come before children, so the one above knows its next member already.
            parent[joint] = above.and_then(|above| if members[above] { Some(above) } else { parent[above] });
        }
        let order = (0..parents.len()).filter(|joint| members[*joint]).collect();
        Self::from_parents(parent, positions, order)
    }

    /// The same with limbs joined to the nearest joint of the trunk where the file hangs them all from one node above (deform
    /// bones of control rigs, feet of IK rigs). Nothing where there is only one piece.
    pub(super) fn bridged(&self) -> Option<Self> {
        let is_hub = |joint: usize| self.parent[joint].is_none() && self.children[joint].len() > 2;
        let is_top = |joint: usize| self.parent[joint].is_none_or(is_hub);
        let tops: Vec<usize> = self.order.iter().copied().filter(|joint| is_top(*joint) && !is_hub(*joint)).collect();
        if tops.len() < 2 || tops.len() > MAX_PIECES || self.order.len() > MAX_JOINTS {
            return None;
        }
        let mut piece: Vec<Option<usize>> = vec![None; self.parent.len()];
        for joint in &self.order {
            piece[*joint] = if tops.contains(joint) {
                Some(*joint)
            } else {
                self.parent[*joint].filter(|above| !is_hub(*above)).and_then(|above| piece[above])
            };
        }
        let is_single = |top: usize| self.children[top].is_empty();
        let are_twins = |one: usize, other: usize| {
            one != other
                && (is_single(one) && is_single(other)
                    || (self.reach[one] - self.reach[other]).abs() <= ALIKE_SHARE * self.reach[one])
        };
        let has_twin = |top: usize| tops.iter().any(|other| are_twins(top, *other));
        let by_reach = |first: &usize, second: &usize| self.reach[*first].total_cmp(&self.reach[*second]);
        let core = tops.iter().copied().filter(|top| !has_twin(*top)).max_by(by_reach)?;
        let mut parent: Vec<Option<usize>> = self.parent.clone();
        let mut inside: Vec<usize> = self.order.iter().copied().filter(|joint| piece[*joint] == Some(core)).collect();
        parent[core] = None;
        let mut open: Vec<usize> = tops.into_iter().filter(|top| *top != core).collect();
        // The piece that is nearest to what is joined already comes next, so that a hand finds its forearm.
        let mut is_end: Vec<bool> = self.children.iter().map(Vec::is_empty).collect();
        let gap = |top: usize, joint: usize| self.positions[top].distance(self.positions[joint]) / self.span;
        loop {
            let may_join = |top: usize, joint: usize| {
                let other = piece[joint].filter(|other| *other != core);
                let longest = match (is_single(top), is_end[joint]) {
                    (false, _) => LONGEST_GAP,
                    (true, true) if self.goes_on(joint, top) => LONGEST_BONE,
                    (true, _) => LONGEST_GAP_OF_ONE,
                };
                gap(top, joint) <= longest && other.is_none_or(|other| !are_twins(top, other))
            };
            let nearest_of = |(place, top): (usize, &usize)| {
                let near = inside.iter().copied().filter(|joint| may_join(*top, *joint));
                let nearest = near.min_by(|first, second| gap(*top, *first).total_cmp(&gap(*top, *second)))?;
                Some((place, nearest, gap(*top, nearest)))
            };
            let next =
                open.iter().enumerate().filter_map(nearest_of).min_by(|first, second| first.2.total_cmp(&second.2));
            let Some((place, anchor, _)) = next else { break };
            let top = open.swap_remove(place);
            parent[top] = Some(anchor);
            is_end[anchor] = false;
            inside.extend(self.order.iter().copied().filter(|joint| piece[*joint] == Some(top)));
        }
        // A joint may hang below one that the file lists behind it.
        let mut order = Vec::with_capacity(inside.len());
        let mut children = vec![Vec::new(); parent.len()];
        inside.sort_unstable();
        for joint in &inside {
            if let Some(above) = parent[*joint] {
                children[above].push(*joint);
            }
        }
        order.push(core);
        let mut next = 0;
        while let Some(joint) = order.get(next) {
            order.extend(children[*joint].iter().copied());
            next += 1;
        }
        Some(Self::from_parents(parent, self.positions, order))
    }

    /// The largest of the branches that the skeleton begins with, where it has at least half of all joints and others lie beside it.
    pub(super) fn core(&self, parents: &[Option<usize>]) -> Option<Self> {
        let mut below = vec![1_usize; self.parent.len()];
        for joint in self.order.iter().rev() {
            if let Some(above) = self.parent[*joint] {
                below[above] += below[*joint];
            }
        }
        let mut tops = self.order.iter().copied().filter(|joint| self.parent[*joint].is_none());
        let mut top = tops.next().filter(|_| tops.next().is_none())?;
        while let [only] = self.children[top].as_slice() {
            top = *only;
        }
        let largest = self.children[top].iter().copied().max_by_key(|child| (below[*child], usize::MAX - *child))?;
        if below[largest] * 2 < self.order.len() {
            return None;
        }
        let mut members = vec![false; self.parent.len()];
        for joint in &self.order {
            members[*joint] = *joint == largest || self.parent[*joint].is_some_and(|above| members[above]);
        }
        Some(Self::new(parents, self.positions, &members))
    }

    /// Whether a joint lies straight on from the bone that another ends.
    fn goes_on(&self, end: usize, next: usize) -> bool {
        let Some(above) = self.parent[end] else { return false };
        let (bone, gap) = (self.positions[end] - self.positions[above], self.positions[next] - self.positions[end]);
        bone.normalize_or_zero().dot(gap.normalize_or_zero()) > STRAIGHT_ON
    }

    fn from_parents(parent: Vec<Option<usize>>, positions: &'a [DVec3], order: Vec<usize>) -> Self {
        let count = parent.len();
        let (mut length, mut reach, mut depth) = (vec![0.0; count], vec![0.0_f64; count], vec![0; count]);
        let mut children = vec![Vec::new(); count];
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for joint in &order {
            low = low.min(positions[*joint]);
            high = high.max(positions[*joint]);
            if let Some(above) = parent[*joint] {
                length[*joint] = positions[*joint].distance(positions[above]);
                depth[*joint] = depth[above] + 1;
                children[above].push(*joint);
            }
        }
        for joint in order.iter().rev() {
            if let Some(above) = parent[*joint] {
                reach[above] = reach[above].max(reach[*joint] + length[*joint]);
            }
        }
        let way = |joint: &usize| reach[*joint] + length[*joint];
        for below in &mut children {
            below.sort_by(|first, second| way(second).total_cmp(&way(first)).then(first.cmp(second)));
            below.truncate(MAX_CHILDREN);
        }
        let span = if order.is_empty() { 0.0 } else { (high - low).max_element() };
        Self { positions, order, parent, children, length, reach, depth, span }
    }

    /// The lowest joint that both are below or equal to.
    pub(super) fn common_ancestor(&self, first: usize, second: usize) -> Option<usize> {
        let (mut first, mut second) = (first, second);
        while first != second {
            if self.depth[first] >= self.depth[second] {
                first = self.parent[first]?;
            } else {
                second = self.parent[second]?;
            }
        }
        Some(first)
    }

    /// The joints from below `above` down to `joint`.
    pub(super) fn way(&self, above: usize, joint: usize) -> Option<Vec<usize>> {
        let mut way = Vec::new();
        let mut current = joint;
        while current != above {
            way.push(current);
            current = self.parent[current]?;
        }
        way.reverse();
        Some(way)
    }
}
