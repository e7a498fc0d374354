//! Which joints share the twist of a limb, and how much of it each gets.
//!
//! A forearm does not turn about itself at the elbow but along its whole length; rigs have joints for it, beside the bone or
//! splitting it. The twist of a forearm is that of the hand against it, growing from the elbow; the twist of an upper arm is
//! its own against the clavicle, which the shoulder end must not follow (docs/algorithm/joints.md). Thighs are as upper arms, shins
//! as forearms.

use glam::{DQuat, DVec3};

use crate::model::Clip;

use crate::{
    retarget::mapping::{ChainPair, Drive, Mapping, Spacing, TwistAgainst, TwistPair},
    rig::{anatomy::carriers, rig::Rig},
};

/// Segments with a twist, and the part that each leads to.
const SEGMENTS: [(&str, &str); 4] =
    [("upper_arm", "forearm"), ("forearm", "hand"), ("thigh", "shin"), ("shin", "foot")];

/// Whether a part is turned by its own twist against what carries it, as upper arms and thighs are; forearms and shins take
/// the twist of what they lead to.
pub(in crate::retarget) fn is_upper(part: &str) -> bool {
    matches!(part, "upper_arm" | "thigh")
}

/// Whether a part is a segment whose far end twists against it.
pub(in crate::retarget) fn is_lower(part: &str) -> bool {
    matches!(part, "forearm" | "shin")
}

/// Finds all joints of the target that share a twist, and how.
///
/// Where the source moves such joints of its own beside the same segment, they are followed instead: those pairs are added to
/// the mapping's chains.
pub(in crate::retarget) fn find_twists(source: &Rig<'_>, target: &Rig<'_>, clip: &Clip, mapping: &mut Mapping) {
    let carriers = carriers(target);
    let (source_nearest, target_nearest) = (nearest_roles(source), nearest_roles(target));
    let mut twists = Vec::new();
    for (side, (part, end_part)) in
        ["left_", "right_"].into_iter().flat_map(|side| SEGMENTS.iter().map(move |segment| (side, *segment)))
    {
        let role = format!("{side}{part}");
        let (joints, ends) = (target.role(&role), target.role(&format!("{side}{end_part}")));
        let (Some(&first), Some(&end)) = (joints.first(), ends.first()) else { continue };
        let is_driven = |chain: &&ChainPair| chain.target.first() == Some(&first) && is_plain(&chain.drive);
        let Some(chain) = mapping.chains.iter().find(is_driven) else { continue };
        let carrier = carriers.get(&first).copied().filter(|carrier| {
            let rides = mapping.rides.iter().any(|ride| ride.joint == first && ride.on == *carrier);
            rides || target.skeleton().is_ancestor_or_self(*carrier, first)
        });
        let limb = Limb { rig: target, nearest: &target_nearest, part, first, end, carrier };
        if joints.len() > 1 && chain.source.len() == 1 && chain.target == joints {
            twists.extend(limb.splits(joints));
        }
        let driven = mapping.driven();
        let helpers = limb.helpers(|joint| !driven[joint] && joints.len() == 1);
        let theirs = source.role(&role).first().zip(source.role(&format!("{side}{end_part}")).first());
        let theirs = theirs.map_or_else(Vec::new, |(&first, &end)| {
            let limb = Limb { rig: source, nearest: &source_nearest, part, first, end, carrier: None };
            limb.helpers(|joint| clip.joints()[joint].rotation.is_animated())
        });
        if theirs.is_empty() {
            twists.extend(helpers.iter().filter_map(|(joint, place)| limb.twist(*joint, first, *place)));
        } else if !helpers.is_empty() {
            let joints = |helpers: &[(usize, f64)]| helpers.iter().map(|(joint, _)| *joint).collect();
            mapping.chains.push(ChainPair {
                name: format!("{role}_twist"),
                source: joints(&theirs),
                also: Vec::new(),
                target: joints(&helpers),
                drive: Drive::default(),
                chord: None,
                spacing: Spacing::Length,
            });
        }
    }
    mapping.twists = twists;
}

/// Whether a chain takes the whole motion, so that its joints are where the twist is looked for.
fn is_plain(drive: &Drive) -> bool {
    *drive == Drive::default()
}

/// A segment of a limb.
struct Limb<'a> {
    rig: &'a Rig<'a>,
    /// The nearest joint with a role, of every joint.
    nearest: &'a [Option<usize>],
    part: &'a str,
    first: usize,
    end: usize,
    carrier: Option<usize>,
}

impl Limb<'_> {
    fn position(&self, joint: usize) -> DVec3 {
        self.rig.rest.transforms()[joint].translation
    }

    fn relative(&self, above: usize, below: usize) -> DQuat {
        let rest = self.rig.rest.transforms();
        (rest[above].rotation.conjugate() * rest[below].rotation).normalize()
    }

    /// How far along the segment a joint lies, from 0 to 1.
    fn place(&self, joint: usize) -> Option<f64> {
        let along = self.position(self.end) - self.position(self.first);
        let length = along.length_squared();
        (length > 0.0).then(|| ((self.position(joint) - self.position(self.first)).dot(along) / length).clamp(0.0, 1.0))
    }

    fn twist(&self, joint: usize, segment: usize, place: f64) -> Option<TwistPair> {
        let rest = self.rig.rest.transforms();
        let along = (self.position(self.end) - self.position(self.first)).try_normalize()?;
        let (against, share) = if is_upper(self.part) {
            let carrier_from_segment = self.relative(self.carrier?, segment);
            (TwistAgainst::Carrier { joint: self.carrier?, carrier_from_segment }, place - 1.0)
        } else {
            let segment_from_end = self.relative(segment, self.end);
            (TwistAgainst::End { joint: self.end, segment_from_end }, place)
        };
        let segment_from_joint = self.relative(segment, joint);
        let axis = rest[segment].rotation.conjugate() * along;
        (share != 0.0).then_some(TwistPair { joint, segment, axis, segment_from_joint, against, share })
    }

    /// The joints that split a segment which the source has in one piece. The last of an upper arm carries the elbow and keeps
    /// the whole rotation; the first of a forearm hangs from the elbow and keeps it.
    fn splits(&self, joints: &[usize]) -> Vec<TwistPair> {
        let last = joints.len() - 1;
        let twist = |(position, &joint): (usize, &usize)| {
            if is_upper(self.part) {
                self.twist(joint, joint, position as f64 / last as f64)
            } else {
                let hangs = self.rig.skeleton().is_ancestor_or_self(joints[0], joint);
                self.twist(joint, joints[0], self.place(joint)?).filter(|_| hangs)
            }
        };
        joints.iter().enumerate().filter_map(twist).collect()
    }

    /// Joints beside the segment that carry part of its twist, with their places, from the body outward.
    fn helpers(&self, is_wanted: impl Fn(usize) -> bool) -> Vec<(usize, f64)> {
        let belongs = |joint: usize| self.nearest[joint] == Some(self.first) && joint != self.first;
        let candidates = self.rig.recognition.twist_helpers.iter().copied();
        let found = candidates.filter(|joint| belongs(*joint) && is_wanted(*joint));
        let mut helpers: Vec<(usize, f64)> = found.filter_map(|joint| Some((joint, self.place(joint)?))).collect();
        helpers.sort_by(|first, second| first.1.total_cmp(&second.1));
        helpers
    }
}

/// For every joint, the nearest one with a role: itself, or above.
fn nearest_roles(rig: &Rig<'_>) -> Vec<Option<usize>> {
    let skeleton = rig.skeleton();
    let mut nearest: Vec<Option<usize>> = vec![None; skeleton.len()];
    for &joint in rig.roles.values().flatten() {
        nearest[joint] = Some(joint);
    }
    for joint in 0..skeleton.len() {
        nearest[joint] = nearest[joint].or_else(|| skeleton.parent(joint).and_then(|parent| nearest[parent]));
    }
    nearest
}
