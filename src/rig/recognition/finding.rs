//! What is found for a role, and how sure it is.

use std::collections::{BTreeMap, BTreeSet};

use super::{Part, Role, Side};

/// The joints of a role.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoleFinding {
    /// From the body outward; never empty. Where a limb segment is split, the anatomical joint is the first.
    pub joints: Vec<usize>,
    /// From 0 to 1.
    pub confidence: f64,
    /// Other joints that could have been meant, likeliest first.
    pub alternatives: Vec<Vec<usize>>,
    /// Why these joints, and what is odd about them.
    pub reasons: Vec<String>,
}

/// How sure a finding is, by where it comes from.
pub(super) mod sure {
    /// The file itself says so.
    pub(crate) const DECLARED: f64 = 1.0;
    /// The name says it, and the joint is where it should be.
    pub(crate) const NAMED: f64 = 0.95;
    /// The name says one of several things, and the hierarchy decides.
    pub(crate) const DECIDED: f64 = 0.93;
    /// Found by where it is in the hierarchy.
    pub(crate) const STRUCTURE: f64 = 0.85;
    /// The name says it, but the joint is not where it should be.
    pub(crate) const MISPLACED: f64 = 0.55;
}

/// The findings so far; a joint has one role at most.
#[derive(Debug, Default)]
pub(super) struct Findings {
    pub roles: BTreeMap<Role, RoleFinding>,
    pub declared: BTreeMap<Role, Vec<usize>>,
    taken: BTreeSet<usize>,
}

impl Findings {
    /// Nothing found yet, with what the file declares.
    pub(super) fn new(declared: BTreeMap<Role, Vec<usize>>) -> Self {
        Self { declared, ..Self::default() }
    }

    /// The anatomical joint of a role.
    pub(super) fn first(&self, side: Side, part: Part) -> Option<usize> {
        self.roles.get(&Role::new(side, part)).and_then(|finding| finding.joints.first().copied())
    }

    /// The first joint that the file declares for a role.
    pub(super) fn declared_first(&self, side: Side, part: Part) -> Option<usize> {
        self.declared.get(&Role::new(side, part)).and_then(|joints| joints.first().copied())
    }

    /// Whether the joint has a role already.
    pub(super) fn is_taken(&self, joint: usize) -> bool {
        self.taken.contains(&joint)
    }

    /// Gives joints a role, but for those that have one already.
    pub(super) fn assign(&mut self, role: Role, joints: &[usize], confidence: f64, reason: impl Into<String>) {
        let joints: Vec<usize> = joints.iter().copied().filter(|joint| !self.taken.contains(joint)).collect();
        if joints.is_empty() {
            return;
        }
        self.taken.extend(&joints);
        let (confidence, reason) = if self.declared.get(&role).is_some_and(|declared| declared.contains(&joints[0])) {
            (sure::DECLARED, "the file declares it".into())
        } else {
            (confidence, reason.into())
        };
        self.roles.insert(role, RoleFinding { joints, confidence, alternatives: Vec::new(), reasons: vec![reason] });
    }

    /// Gives a finding's joints its role, but for those that have one already. Nothing where none is left.
    pub(super) fn take_over(&mut self, role: Role, mut finding: RoleFinding) {
        finding.joints.retain(|joint| !self.taken.contains(joint));
        if !finding.joints.is_empty() {
            self.taken.extend(&finding.joints);
            self.roles.insert(role, finding);
        }
    }

    /// Notes other joints for a role, but for those that have a role themselves.
    pub(super) fn offer(&mut self, role: Role, others: &[usize]) {
        let own: Vec<Vec<usize>> =
            others.iter().filter(|joint| !self.taken.contains(joint)).map(|joint| vec![*joint]).collect();
        if let Some(finding) = self.roles.get_mut(&role) {
            finding.alternatives.extend(own);
        }
    }

    /// Takes a role away again.
    pub(super) fn remove(&mut self, role: Role) -> Option<RoleFinding> {
        let finding = self.roles.remove(&role)?;
        for joint in &finding.joints {
            self.taken.remove(joint);
        }
        Some(finding)
    }
}
