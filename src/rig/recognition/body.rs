//! A skeleton with its names read: the joints that may stand for a part of the body, and who is below whom.
//!
//! What the limbs, the trunk and the fingers are looked for in. Knows names and hierarchy; decides no role.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet},
};

use glam::DVec3;

use super::{
    Side,
    lexicon::Sense,
    names::{Layer, ParsedName, parse_all},
    template::TemplateMatch,
};
use crate::model::{ModelPose, Skeleton};

/// Two sides times a few senses are a body; a hostile file could offer every joint as a candidate for one part.
const MAX_CANDIDATES: usize = 64;

/// An unexplained word on so large a share of the joints is a prefix, such as a character's name.
const PREFIX_SHARE: f64 = 0.3;

/// Fewer distinct parts than this are no layer of a control rig; fewer words than this no prefix.
const FEW_PARTS: usize = 4;

pub(super) struct Body<'a> {
    pub skeleton: &'a Skeleton,
    pub names: Vec<ParsedName>,
    /// Where the joints are in the rest pose, model space.
    pub positions: Vec<DVec3>,
    /// Whether the joint belongs to the body that is looked at (its name may still say nothing).
    pub members: Vec<bool>,
    /// Whether the joint may stand for a part by its name.
    eligible: Vec<bool>,
    /// Preorder interval of every subtree.
    enter: Vec<usize>,
    size: Vec<usize>,
    pub depth: Vec<usize>,
}

/// Where in a skeleton a body is looked for.
#[derive(Clone, Copy)]
pub(super) struct Extent<'a> {
    /// Joints that a viewer does not show, rising; a body of others goes before.
    pub hidden: &'a [usize],
    /// For each joint, whether it is not looked at. Empty: all are.
    pub excluded: &'a [bool],
    /// Whether nodes that the file does not call joints are passed over.
    pub joints_only: bool,
}

impl<'a> Body<'a> {
    /// Reads all names and picks the largest body within the extent.
    pub(super) fn new(
        skeleton: &'a Skeleton,
        rest: &ModelPose,
        template: Option<&TemplateMatch>,
        extent: Extent<'_>,
    ) -> Self {
        let mut names = parse_all(skeleton.joints().iter().map(|joint| joint.name.as_str()));
        for (role, joints) in template.iter().flat_map(|template| &template.roles) {
            if role.is_one_of_several() {
                // No word says which of several it is; the template itself does.
                joints.iter().for_each(|joint| names[*joint].set_nameless());
                continue;
            }
            for (place, joint) in joints.iter().enumerate() {
                names[*joint].set_meaning(*role, place);
            }
        }
        let positions = (0..skeleton.len())
            .map(|joint| rest.transforms().get(joint).map_or(DVec3::ZERO, |transform| transform.translation))
            .collect();
        let (enter, size, depth) = preorder(skeleton);
        let members = vec![true; skeleton.len()];
        let mut body = Self { skeleton, eligible: members.clone(), names, positions, members, enter, size, depth };
        body.judge_names();
        body.keep_layer();
        body.keep_largest(extent);
        body
    }

    /// Whether `joint` is below `ancestor`, and not the same.
    pub(super) fn is_below(&self, joint: usize, ancestor: usize) -> bool {
        self.enter[joint] > self.enter[ancestor] && self.enter[joint] < self.enter[ancestor] + self.size[ancestor]
    }

    /// Whether nothing hangs from the joint.
    pub(super) fn is_leaf(&self, joint: usize) -> bool {
        self.size[joint] == 1
    }

    /// The lowest joint that both are below or equal to.
    pub(super) fn common_ancestor(&self, first: usize, second: usize) -> Option<usize> {
        let mut current = Some(first);
        while let Some(joint) = current {
            if joint == second || self.is_below(second, joint) {
                return current;
            }
            current = self.skeleton.parent(joint);
        }
        None
    }

    /// Joints of a side that have one of the senses, higher ones first. Twist helpers, ends and controls are left out.
    pub(super) fn candidates(&self, side: Option<Side>, senses: &[Sense]) -> Vec<usize> {
        let fits = |joint: &usize| {
            let name = &self.names[*joint];
            self.eligible[*joint] && name.side == side && name.sense.is_some_and(|sense| senses.contains(&sense))
        };
        let mut found: Vec<usize> =
            (0..self.skeleton.len()).filter(|joint| fits(joint) && !self.names[*joint].is_twist).collect();
        found.sort_by_key(|joint| (self.depth[*joint], *joint));
        found.truncate(MAX_CANDIDATES);
        found
    }

    /// Those of `joints` that have no other of them above them.
    pub(super) fn topmost(&self, joints: &[usize]) -> Vec<usize> {
        let is_top = |joint: &usize| !joints.iter().any(|other| self.is_below(*joint, *other));
        joints.iter().copied().filter(is_top).collect()
    }

    /// Those of `joints` that are below `ancestor`.
    pub(super) fn below(&self, joints: &[usize], ancestor: usize) -> Vec<usize> {
        joints.iter().copied().filter(|joint| self.is_below(*joint, ancestor)).collect()
    }

    /// Those of `joints` that are above `joint`, higher ones first.
    pub(super) fn above(&self, joints: &[usize], joint: usize) -> Vec<usize> {
        joints.iter().copied().filter(|ancestor| self.is_below(joint, *ancestor)).collect()
    }

    /// The joints from `start` down to `end`, both included; nothing when they are not connected.
    pub(super) fn path(&self, start: usize, end: usize) -> Option<Vec<usize>> {
        if start == end || self.is_below(end, start) { self.skeleton.path(start, end) } else { None }
    }

    /// Whether the joint's name is one of those senses.
    pub(super) fn means(&self, joint: usize, senses: &[Sense]) -> bool {
        self.eligible[joint] && self.names[joint].sense.is_some_and(|sense| senses.contains(&sense))
    }

    fn judge_names(&mut self) {
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        for name in &self.names {
            for word in name.unexplained.iter().collect::<BTreeSet<_>>() {
                *counts.entry(word).or_default() += 1;
            }
        }
        let named = self.names.iter().filter(|name| name.sense.is_some()).count();
        let enough = ((named as f64 * PREFIX_SHARE) as usize).max(FEW_PARTS);
        let is_odd = |name: &ParsedName| name.unexplained.iter().any(|word| counts[word.as_str()] < enough);
        self.eligible = self
            .names
            .iter()
            .map(|name| name.sense.is_some() && !name.is_control && !name.is_end && !name.is_dummy && !is_odd(name))
            .collect();
    }

    /// A file may hold several skeletons, and a skeleton may come in pieces below one node (Rigify's deform bones).
    fn keep_largest(&mut self, extent: Extent<'_>) {
        let joints = self.skeleton.joints();
        let is_inside = |joint: usize| !extent.excluded.get(joint).copied().unwrap_or(false);
        let counts: Vec<bool> = (0..joints.len())
            .map(|joint| (joints[joint].is_joint || !extent.joints_only) && is_inside(joint))
            .collect();
        // The piece of a joint is named by its top joint.
        let mut piece: Vec<usize> = (0..joints.len()).collect();
        for (index, joint) in joints.iter().enumerate() {
            if let Some(parent) = joint.parent.filter(|parent| counts[*parent]) {
                piece[index] = piece[parent];
            }
        }
        let mut parts_of_piece: BTreeMap<usize, BTreeSet<(Option<Side>, Sense)>> = BTreeMap::new();
        let mut joints_of_piece: BTreeMap<usize, usize> = BTreeMap::new();
        for index in (0..joints.len()).filter(|index| counts[*index]) {
            *joints_of_piece.entry(piece[index]).or_default() += 1;
            if let Some(sense) = self.names[index].sense.filter(|_| self.eligible[index]) {
                parts_of_piece.entry(piece[index]).or_default().insert((self.names[index].side, sense));
            }
        }
        let mut pieces: Vec<_> = parts_of_piece.into_iter().collect();
        let is_hidden = |top: &usize| extent.hidden.binary_search(top).is_ok();
        pieces.sort_by_key(|(top, parts)| (is_hidden(top), Reverse((parts.len(), joints_of_piece.get(top).copied()))));
        let mut pieces = pieces.into_iter();
        let Some((top, mut found)) = pieces.next() else {
            // Names say nothing: all that the file calls joints may be the body.
            self.eligible.iter_mut().zip(&counts).for_each(|(eligible, counts)| *eligible &= counts);
            self.members = counts;
            return;
        };
        let mut inside = BTreeSet::from([top]);
        for (other, parts) in pieces {
            // A second body has the same parts once more; another piece of this one has other parts.
            if joints[other].parent == joints[top].parent && found.is_disjoint(&parts) {
                inside.insert(other);
                found.extend(parts);
            }
        }
        for index in 0..joints.len() {
            self.members[index] = counts[index] && inside.contains(&piece[index]);
            // Finger tips that no vertex is bound to are plain nodes in glTF.
            let goes_on = joints[index].parent.is_some_and(|parent| {
                self.members[parent]
                    && matches!(self.names[index].sense, Some(Sense::Finger(_)))
                    && self.names[parent].sense == self.names[index].sense
            });
            self.members[index] |= goes_on;
            self.eligible[index] &= self.members[index];
        }
    }

    /// In a full control rig only one layer stands for the body: the deform bones, else the plain skeleton.
    fn keep_layer(&mut self) {
        for layer in [Layer::Deform, Layer::Original] {
            let parts: BTreeSet<_> = (0..self.names.len())
                .filter(|joint| self.eligible[*joint] && self.names[*joint].layer == layer)
                .map(|joint| (self.names[joint].side, self.names[joint].sense))
                .collect();
            if parts.len() > FEW_PARTS {
                for joint in 0..self.names.len() {
                    self.eligible[joint] &= self.names[joint].layer == layer;
                }
                return;
            }
        }
    }
}

/// Start and length of every joint's subtree in preorder, and its depth.
fn preorder(skeleton: &Skeleton) -> (Vec<usize>, Vec<usize>, Vec<usize>) {
    let count = skeleton.len();
    let (mut size, mut depth) = (vec![1; count], vec![0; count]);
    for joint in (0..count).rev() {
        if let Some(parent) = skeleton.parent(joint) {
            size[parent] += size[joint];
        }
    }
    let mut enter = vec![0; count];
    let mut next_below = vec![0; count];
    let mut next_root = 0;
    for joint in 0..count {
        let slot = match skeleton.parent(joint) {
            Some(parent) => {
                depth[joint] = depth[parent] + 1;
                &mut next_below[parent]
            }
            None => &mut next_root,
        };
        enter[joint] = *slot;
        *slot += size[joint];
        next_below[joint] = enter[joint] + 1;
    }
    (enter, size, depth)
}
