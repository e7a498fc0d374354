//! Which joint of a rest file stands for which joint of the rig: by name, by role, and by how joints hang together.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::model::{ModelPose, Skeleton};

use super::{
    super::super::{alignment::split, rig::Rig},
    names::by_name,
};

/// Names are believed while no larger share of them contradicts the roles of their joints.
const MAX_CONFLICTS: f64 = 0.3;
/// Lengths of bones that hang alike differ by no more than this share.
const LENGTH_TOLERANCE: f64 = 0.2;

/// What of the rest file a joint of the rig corresponds to: one joint, or a place between two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Anchor {
    from: usize,
    to: usize,
    /// 0 at `from`, 1 at `to`.
    share: f64,
}

impl Anchor {
    const fn at(joint: usize) -> Self {
        Self { from: joint, to: joint, share: 0.0 }
    }

    /// The joint, where it is one.
    pub(super) fn joint(&self) -> Option<usize> {
        (self.share == 0.0).then_some(self.from)
    }

    /// Where it is in a pose of the rest file.
    pub(super) fn place(&self, pose: &ModelPose) -> DVec3 {
        let place = |joint: usize| pose.transforms()[joint].translation;
        place(self.from).lerp(place(self.to), self.share)
    }
}

/// Which joints correspond, and how that was found out.
#[derive(Clone, Debug, Default)]
pub(super) struct Matching {
    /// By joint of the rig.
    pub(super) anchors: Vec<Option<Anchor>>,
    pub(super) by_name: usize,
    pub(super) by_role: usize,
    pub(super) by_structure: usize,
    /// Whether left and right are named the other way round in one of the files.
    pub(super) is_mirrored: bool,
}

impl Matching {
    /// Matches by name and by role.
    pub(super) fn find(rig: &Rig<'_>, rest: &Rig<'_>) -> Self {
        let mut matching = Self { anchors: vec![None; rig.skeleton().len()], ..Self::default() };
        let (ours, theirs) = (roles_by_joint(rig), roles_by_joint(rest));
        let twins = by_name(rig.skeleton(), rest.skeleton());
        let trust = Trust::of(&twins, &ours, &theirs);
        matching.is_mirrored = trust == Trust::Mirrored;
        for (joint, twin) in twins.into_iter().enumerate() {
            let Some(twin) = twin else { continue };
            if trust == Trust::Full || (ours[joint].is_some() && ours[joint] == theirs[twin]) {
                matching.anchors[joint] = Some(Anchor::at(twin));
                matching.by_name += 1;
            }
        }
        matching.add_roles(rig, rest);
        if matching.count() == 0 && has_same_shape(rig.skeleton(), rest.skeleton()) {
            matching.anchors = (0..rig.skeleton().len()).map(|joint| Some(Anchor::at(joint))).collect();
            matching.by_structure = rig.skeleton().len();
        }
        matching
    }

    /// How many joints correspond to something.
    pub(super) fn count(&self) -> usize {
        self.by_name + self.by_role + self.by_structure
    }

    fn taken(&self, count: usize) -> Vec<bool> {
        let mut taken = vec![false; count];
        self.anchors.iter().flatten().filter_map(Anchor::joint).for_each(|joint| taken[joint] = true);
        taken
    }

    fn add_roles(&mut self, rig: &Rig<'_>, rest: &Rig<'_>) {
        let mut taken = self.taken(rest.skeleton().len());
        for (role, ours) in &rig.roles {
            let theirs = rest.role(role);
            let (_, part) = split(role);
            let is_spread = matches!(part, "spine" | "neck") && ours.len() != theirs.len();
            let pairs = match part {
                _ if theirs.is_empty() => 0,
                _ if ours.len() == theirs.len() => ours.len(),
                "thumb" | "index" | "middle" | "ring" | "pinky" => ours.len().min(theirs.len()),
                _ => 1,
            };
            for (&joint, &twin) in ours.iter().zip(theirs).take(pairs) {
                if self.anchors[joint].is_none() && !taken[twin] {
                    self.anchors[joint] = Some(Anchor::at(twin));
                    self.by_role += 1;
                    taken[twin] = true;
                }
            }
            if is_spread {
                self.spread(rig, rest, role);
            }
        }
    }

    /// The joints of a spine or neck behind the first at the same share of its length on one of another number of joints.
    fn spread(&mut self, rig: &Rig<'_>, rest: &Rig<'_>, role: &str) {
        let ends: &[&str] = if role == "spine" { &["neck", "head"] } else { &["head"] };
        let has = |end: &&&str| !rig.role(end).is_empty() && !rest.role(end).is_empty();
        let Some(end) = ends.iter().find(has) else { return };
        let chain = |rig: &Rig<'_>| -> Vec<usize> { [rig.role(role), &rig.role(end)[..1]].concat() };
        let (ours, theirs) = (chain(rig), chain(rest));
        let (our_shares, their_shares) = (shares(&ours, &rig.rest), shares(&theirs, &rest.rest));
        for (&joint, share) in ours.iter().zip(&our_shares).skip(1).filter(|(joint, _)| **joint != ours[ours.len() - 1])
        {
            let above = their_shares.iter().position(|other| other > share);
            if let (None, Some(above @ 1..)) = (self.anchors[joint], above) {
                let (low, high) = (their_shares[above - 1], their_shares[above]);
                let share = ((share - low) / (high - low)).max(1e-9);
                self.anchors[joint] = Some(Anchor { from: theirs[above - 1], to: theirs[above], share });
                self.by_role += 1;
            }
        }
    }

    /// The only child without a twin, below two joints that correspond: the end of a finger, the top of a head. `scale` is the
    /// length of our bones over theirs.
    pub(super) fn add_structure(&mut self, rig: &Rig<'_>, rest: &Rig<'_>, scale: f64) {
        let mut taken = self.taken(rest.skeleton().len());
        let (our_roles, their_roles) = (roles_by_joint(rig), roles_by_joint(rest));
        let (our_children, their_children) = (rig.skeleton().children(), rest.skeleton().children());
        for (joint, children) in our_children.iter().enumerate() {
            let Some(twin) = self.anchors[joint].and_then(|anchor| anchor.joint()) else { continue };
            let open = children.iter().copied().filter(|child| self.anchors[*child].is_none());
            let Some(child) = only(open) else { continue };
            let Some(other) = only(their_children[twin].iter().copied().filter(|child| !taken[*child])) else {
                continue;
            };
            let length = |rig: &Rig<'_>, from: usize, to: usize| {
                rig.rest.transforms()[from].translation.distance(rig.rest.transforms()[to].translation)
            };
            let (ours, theirs) = (length(rig, joint, child), length(rest, twin, other) * scale);
            let is_alike = (ours - theirs).abs() <= LENGTH_TOLERANCE * ours.max(theirs);
            if is_alike && our_roles[child] == their_roles[other] {
                self.anchors[child] = Some(Anchor::at(other));
                self.by_structure += 1;
                taken[other] = true;
            }
        }
    }
}

/// How far the names of two files are believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Trust {
    Full,
    /// Only where the roles of the joints agree.
    WithRoles,
    /// The same, as one file calls right what the other calls left.
    Mirrored,
}

impl Trust {
    fn of(twins: &[Option<usize>], ours: &[Option<String>], theirs: &[Option<String>]) -> Self {
        let (mut agree, mut mirrored, mut conflict) = (0_usize, 0_usize, 0_usize);
        for (joint, twin) in twins.iter().enumerate().filter_map(|(joint, twin)| Some((joint, (*twin)?))) {
            let (Some(our), Some(their)) = (&ours[joint], &theirs[twin]) else { continue };
            let ((our_side, our_part), (their_side, their_part)) = (split(our), split(their));
            if our == their {
                agree += usize::from(!our_side.is_empty());
            } else if our_part == their_part && our_side != their_side {
                mirrored += 1;
            } else {
                conflict += 1;
            }
        }
        if mirrored > agree {
            Self::Mirrored
        } else if (conflict + mirrored) as f64 > MAX_CONFLICTS * (agree + mirrored + conflict) as f64 {
            Self::WithRoles
        } else {
            Self::Full
        }
    }
}

/// The role of each joint.
fn roles_by_joint(rig: &Rig<'_>) -> Vec<Option<String>> {
    let mut roles = vec![None; rig.skeleton().len()];
    let by_role: &BTreeMap<String, Vec<usize>> = &rig.roles;
    for (role, joints) in by_role {
        joints.iter().for_each(|joint| roles[*joint] = Some(role.clone()));
    }
    roles
}

/// Where the joints of a chain lie, as shares of its length.
fn shares(chain: &[usize], pose: &ModelPose) -> Vec<f64> {
    let place = |joint: usize| pose.transforms()[joint].translation;
    let mut done = vec![0.0];
    for pair in chain.windows(2) {
        done.push(done[done.len() - 1] + place(pair[0]).distance(place(pair[1])));
    }
    let total = done[done.len() - 1].max(f64::MIN_POSITIVE);
    done.iter().map(|length| length / total).collect()
}

/// Whether two skeletons hang together in the same way, joint by joint.
fn has_same_shape(ours: &Skeleton, theirs: &Skeleton) -> bool {
    let parents = |skeleton: &Skeleton| skeleton.joints().iter().map(|joint| joint.parent).collect::<Vec<_>>();
    ours.len() > 2 && parents(ours) == parents(theirs)
}

fn only(mut items: impl Iterator<Item = usize>) -> Option<usize> {
    let first = items.next()?;
    items.next().is_none().then_some(first)
}
