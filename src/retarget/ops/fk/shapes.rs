//! A chain that takes the shape, the local rotations or the lengths of the source's. (docs/algorithm/forward-kinematics.md.)

use crate::retarget::stages::posed::Step;
use crate::retarget::stages::posed::builder::StepBuilder;
use glam::{DQuat, DVec3};

use crate::{
    model::Transform,
    retarget::spec::{RotationMode, TranslationMode},
};

use crate::retarget::stages::{
    posed::figure::{Figure, scaled},
    two_bone::arc,
};

/// One chain.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ShapeStep {
    pub(in crate::retarget) rotation: RotationMode,
    pub(in crate::retarget) translation: TranslationMode,
    pub(in crate::retarget) rotation_alpha: f64,
    pub(in crate::retarget) translation_alpha: f64,
    /// Slots of the source's chain, with the joint that it leads to.
    pub(in crate::retarget) source: Vec<usize>,
    /// Lengths between them at rest.
    pub(in crate::retarget) source_lengths: Vec<f64>,
    /// What a length of the source's line becomes.
    pub(in crate::retarget) line_scale: f64,
    pub(in crate::retarget) links: Vec<Link>,
    /// The joint that the target's chain leads to.
    pub(in crate::retarget) end: Option<usize>,
    /// The chain's joints and the driven ones below them: those keep how they are turned.
    pub(in crate::retarget) kept: Vec<usize>,
    pub(in crate::retarget) below: Vec<usize>,
}

/// One joint of the target's chain, or the one that it leads to.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct Link {
    pub(in crate::retarget) slot: usize,
    /// Whether it is turned; the joint that the chain leads to is only moved.
    pub(in crate::retarget) turns: bool,
    pub(in crate::retarget) rest_local: Transform,
    /// The two source joints that it follows, and how far it is from the first to the second.
    pub(in crate::retarget) follows: (usize, usize, f64),
    /// For all but the first: where its bone ends along the chain, from 0 to 1, and the source's bone at that place.
    pub(in crate::retarget) bone: Option<Bone>,
}

/// A bone of the target's chain: from the joint before to this one.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Bone {
    /// The bone of the source at the same place: from this joint of the source's chain to the next.
    pub(in crate::retarget) segment: usize,
    /// The bone of the source at rest, in the axes of the joint that it begins at.
    pub(in crate::retarget) source_rest: DVec3,
    /// From those axes to the axes of the target joint's parent.
    pub(in crate::retarget) target_from_source: DQuat,
}

impl ShapeStep {
    /// Turns bones until the joints lie on the source's line.
    fn lay_along(&self, figure: &mut Figure<'_>) {
        let Some(first) = self.links.first() else { return };
        let begin = figure.model(first.slot).translation;
        let source = figure.source;
        let origin = source.model[self.source[0]].translation;
        let point = |index: usize| begin + (source.model[self.source[index]].translation - origin) * self.line_scale;
        let mut place = Place { segment: 0, share: 0.0 };
        let mut at = begin;
        let slots = self.links.iter().filter(|link| link.turns).map(|link| link.slot);
        let ends = slots.clone().skip(1).chain(self.end);
        for (slot, end) in slots.zip(ends) {
            let (kept, kept_end) = (figure.kept(slot), figure.kept(end));
            let bone = kept_end.translation - kept.translation;
            let length = figure.model(end).translation.distance(figure.model(slot).translation);
            let next = place.next(&point, self.source.len(), at, length);
            let direction = next.map_or(bone, |(_, found)| found - at);
            let side = bone.any_orthogonal_vector().normalize_or(DVec3::X);
            figure.turn_to(slot, arc(bone, direction, side) * kept.rotation);
            self.take_share(figure, slot);
            if let Some((found, _)) = next {
                place = found;
            }
            at = figure.model(end).translation;
        }
        // The last joint of a chain that leads nowhere keeps how it is turned.
        if self.end.is_none()
            && let Some(last) = self.links.iter().rev().find(|link| link.turns)
        {
            let kept = figure.kept(last.slot).rotation;
            figure.turn_to(last.slot, kept);
            self.take_share(figure, last.slot);
        }
    }

    fn copy_local(&self, figure: &mut Figure<'_>) {
        for link in self.links.iter().filter(|link| link.turns) {
            let (first, second, share) = link.follows;
            let rotation = figure.source.local[first].rotation.slerp(figure.source.local[second].rotation, share);
            let local = figure.local(link.slot);
            figure.set_local(link.slot, Transform { rotation, ..local });
            self.take_share(figure, link.slot);
        }
    }

    /// Goes back toward the rest rotation below the parent, or beyond the result.
    fn take_share(&self, figure: &mut Figure<'_>, slot: usize) {
        #[expect(clippy::float_cmp, reason = "exactly one means that all of it is taken")]
        if self.rotation_alpha == 1.0 {
            return;
        }
        let Some(link) = self.links.iter().find(|link| link.slot == slot) else { return };
        let (local, rest) = (figure.local(slot), link.rest_local.rotation);
        let rotation = rest * scaled((rest.conjugate() * local.rotation).normalize(), self.rotation_alpha);
        figure.set_local(slot, Transform { rotation, ..local });
    }

    fn stretch(&self, figure: &mut Figure<'_>) {
        let source = figure.source;
        let length = |segment: usize| {
            let [first, second] = [segment, segment + 1].map(|index| source.model[self.source[index]].translation);
            first.distance(second)
        };
        let ratio = |now: f64, rest: f64| if rest > 0.0 { now / rest } else { 1.0 };
        let segments = 0..self.source_lengths.len();
        let whole = ratio(segments.map(length).sum(), self.source_lengths.iter().sum());
        for link in &self.links {
            let Some(bone) = &link.bone else { continue };
            let rest = link.rest_local.translation;
            let wanted = match self.translation {
                TranslationMode::StretchUniform => rest * whole,
                TranslationMode::StretchBySegment => {
                    rest * ratio(length(bone.segment), self.source_lengths[bone.segment])
                }
                _ => {
                    let [from, to] = [bone.segment, bone.segment + 1].map(|index| source.model[self.source[index]]);
                    let now = from.rotation.conjugate() * (to.translation - from.translation);
                    let side = bone.source_rest.any_orthogonal_vector().normalize_or(DVec3::X);
                    let turn = arc(bone.source_rest, now, side);
                    let turn = bone.target_from_source * turn * bone.target_from_source.conjugate();
                    turn * rest * ratio(now.length(), bone.source_rest.length())
                }
            };
            let local = figure.local(link.slot);
            let translation = rest + (wanted - rest) * self.translation_alpha;
            figure.set_local(link.slot, Transform { translation, ..local });
        }
    }
}

impl Step for ShapeStep {
    fn apply(&self, figure: &mut Figure<'_>) {
        figure.keep(&self.kept);
        match self.translation {
            TranslationMode::StretchUniform | TranslationMode::StretchBySegment | TranslationMode::OrientAndScale => {
                self.stretch(figure);
            }
            TranslationMode::None | TranslationMode::GloballyScaled | TranslationMode::Absolute => {}
        }
        match self.rotation {
            RotationMode::MatchChain | RotationMode::MatchScaledChain => self.lay_along(figure),
            RotationMode::CopyLocal => self.copy_local(figure),
            _ => {}
        }
        figure.turn_back(&self.below);
    }
}

/// A place on a line of points.
#[derive(Clone, Copy, Debug)]
struct Place {
    segment: usize,
    share: f64,
}

impl Place {
    /// The next place on the line at a distance from a point on it, and the point there; past its end the line goes on straight.
    /// Nothing where the line has no length.
    fn next(
        self,
        point: &impl Fn(usize) -> DVec3,
        count: usize,
        center: DVec3,
        distance: f64,
    ) -> Option<(Self, DVec3)> {
        let last = count.checked_sub(2)?;
        for segment in self.segment..=last {
            let (from, to) = (point(segment), point(segment + 1));
            let least = if segment == self.segment { self.share } else { 0.0 };
            if let Some(share) = leaves(from, to, center, distance)
                && share >= least
                && (share <= 1.0 || segment == last)
            {
                return Some((Self { segment, share }, from.lerp(to, share)));
            }
        }
        // The last segment has no length: the one before it says where the line goes on.
        let (segment, direction) = (0..=last)
            .rev()
            .map(|segment| (segment, point(segment + 1) - point(segment)))
            .find(|(_, way)| *way != DVec3::ZERO)?;
        let end = point(segment + 1);
        let share = leaves(end, end + direction, center, distance)?;
        Some((Self { segment: last, share: 1.0 }, end + direction * share))
    }
}

/// Where a straight line leaves a sphere, as a share of the way from the first point to the second; may be beyond both. Nothing
/// where it does not meet it, or the points are one.
fn leaves(from: DVec3, to: DVec3, center: DVec3, radius: f64) -> Option<f64> {
    let (way, off) = (to - from, from - center);
    let (a, b, c) = (way.length_squared(), way.dot(off), off.length_squared() - radius * radius);
    let root = b * b - a * c;
    (a > 0.0 && root >= 0.0).then(|| (root.sqrt() - b) / a)
}

/// How a chain takes the shape of the source's.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ChainShape {
    /// Joints of the source, from the body outward.
    pub(in crate::retarget) source: Vec<usize>,
    /// Joints of the target.
    pub(in crate::retarget) target: Vec<usize>,
    /// The joints that both chains lead to, where they lead to any.
    pub(in crate::retarget) ends: Option<(usize, usize)>,
    /// A mode that shapes, else `none`.
    pub(in crate::retarget) rotation: RotationMode,
    /// A mode that shapes, else `none`.
    pub(in crate::retarget) translation: TranslationMode,
    /// 0 keeps the rest rotations.
    pub(in crate::retarget) rotation_alpha: f64,
    /// 0 keeps the rest lengths.
    pub(in crate::retarget) translation_alpha: f64,
}

impl ChainShape {
    pub(in crate::retarget) fn step(&self, builder: &mut StepBuilder<'_>) -> ShapeStep {
        let stack = builder.stack;
        let source_joints: Vec<usize> = self.source.iter().copied().chain(self.ends.map(|ends| ends.0)).collect();
        let target_joints: Vec<usize> = self.target.iter().copied().chain(self.ends.map(|ends| ends.1)).collect();
        let lengths = |joints: &[usize], rest: &[Transform]| -> Vec<f64> {
            joints.windows(2).map(|pair| rest[pair[0]].translation.distance(rest[pair[1]].translation)).collect()
        };
        let source_lengths = lengths(&source_joints, &stack.source_rest);
        let target_lengths = lengths(&target_joints, &stack.target_rest);
        let (source_length, target_length) = (source_lengths.iter().sum::<f64>(), target_lengths.iter().sum::<f64>());
        let line_scale = match self.rotation {
            RotationMode::MatchScaledChain if source_length > 0.0 => target_length / source_length,
            _ => stack.mapping.global_scale,
        };
        let (source_shares, target_shares) = (shares(&source_lengths), shares(&target_lengths));
        let is_one_to_one = source_joints.len() == target_joints.len();
        let place = |share: f64, position: usize| {
            if is_one_to_one {
                return (position, 0.0);
            }
            let segment = source_shares.iter().rposition(|start| *start <= share).unwrap_or(0);
            let segment = segment.min(source_shares.len().saturating_sub(2));
            let length = source_shares.get(segment + 1).map_or(0.0, |end| end - source_shares[segment]);
            (segment, if length > 0.0 { ((share - source_shares[segment]) / length).clamp(0.0, 1.0) } else { 0.0 })
        };
        let source: Vec<usize> = source_joints.iter().map(|&joint| builder.source(joint)).collect();
        let turns = self.rotation != RotationMode::None;
        let moves = self.translation != TranslationMode::None;
        let mut links = Vec::with_capacity(target_joints.len());
        for (position, &joint) in target_joints.iter().enumerate() {
            let is_end = position >= self.target.len();
            let (segment, share) = place(target_shares[position], position);
            let bone = (position > 0 && source_joints.len() > 1).then(|| {
                let middle = f64::midpoint(target_shares[position - 1], target_shares[position]);
                let (segment, _) = place(middle, position - 1);
                let [from, to] = [segment, segment + 1].map(|index| stack.source_rest[source_joints[index]]);
                let parent =
                    stack.target.parent(joint).map_or(stack.plan_from_target, |parent| stack.target_rest[parent]);
                Bone {
                    segment,
                    source_rest: from.rotation.conjugate() * (to.translation - from.translation),
                    target_from_source: parent.rotation.conjugate() * from.rotation,
                }
            });
            let slot = builder.change(joint, turns && !is_end, moves && bone.is_some());
            let rest = builder.rest_below_parent(joint);
            links.push(Link {
                slot,
                turns: turns && !is_end,
                rest_local: Transform { rotation: rest.rotation, ..stack.mapping.target_hold.transforms()[joint] },
                follows: (source[segment], source[(segment + 1).min(source.len() - 1)], share),
                bone,
            });
        }
        let below: Vec<usize> = if turns {
            let topmost = self.target.iter().flat_map(|&joint| stack.topmost_driven_below(Some(joint)));
            topmost.filter(|joint| !self.target.contains(joint)).collect()
        } else {
            Vec::new()
        };
        let below: Vec<usize> = below.into_iter().map(|joint| builder.change(joint, true, false)).collect();
        ShapeStep {
            rotation: self.rotation,
            translation: self.translation,
            rotation_alpha: self.rotation_alpha,
            translation_alpha: self.translation_alpha,
            source,
            source_lengths,
            line_scale,
            end: self.ends.map(|ends| builder.target(ends.1)),
            kept: links.iter().map(|link| link.slot).chain(below.iter().copied()).collect(),
            links,
            below,
        }
    }
}

/// How far along a chain each joint is, from 0 to 1; evenly spread where the chain has no length.
fn shares(lengths: &[f64]) -> Vec<f64> {
    let total: f64 = lengths.iter().sum();
    let mut so_far = 0.0;
    let after = lengths.iter().map(|length| {
        so_far += if total > 0.0 { length / total } else { 1.0 / lengths.len() as f64 };
        so_far
    });
    std::iter::once(0.0).chain(after).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_follow_a_line_around_its_corners_and_past_its_end() {
        let line = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0)];
        let point = |index: usize| line[index];
        let begin = Place { segment: 0, share: 0.0 };
        let (place, found) = begin.next(&point, 3, DVec3::ZERO, 0.5).expect("on the first part");
        assert!((place.segment, found) == (0, DVec3::X * 0.5), "{found}");
        let (place, found) = place.next(&point, 3, found, 1.0).expect("around the corner");
        assert_eq!(place.segment, 1, "the second part");
        assert!((found.distance(DVec3::X * 0.5) - 1.0).abs() < 1e-12 && (found.x - 1.0).abs() < 1e-12, "{found}");
        let (_, past) = place.next(&point, 3, found, 3.0).expect("past the end");
        assert!((past.y - found.y - 3.0).abs() < 1e-12 && (past.x - 1.0).abs() < 1e-12, "straight on: {past}");
        assert!(begin.next(&|_| DVec3::ZERO, 3, DVec3::ZERO, 1.0).is_none(), "a line without length leads nowhere");
    }
}
