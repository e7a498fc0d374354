//! A joint that bends no farther than it may. (docs/algorithm/joints.md.)

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::{LimitRange, LimitsOp};

use crate::retarget::stages::posed::Step;
use crate::{
    model::Canceled,
    retarget::{
        mapping::Mapping,
        ops::{
            context::Context,
            op_spec::OpSpec,
            resolved::{OpWork, ResolvedOp},
            scope::Scope,
        },
        stages::{
            builder::StackBuilder,
            posed::{PosedStage, builder::StepBuilder},
            stage::Stage,
            work::{Change, Changed, LimitedJoint, Work},
        },
    },
};
use glam::Quat;
use glam::{DQuat, DVec2, DVec3};

use crate::model::rotation::{approach, twist_angle};

use crate::model::Transform;

use crate::retarget::stages::posed::figure::Figure;

/// Angles by which a joint is turned back that count as limited, degrees; less is rounding.
const MIN_LIMITED_DEGREES: f64 = 0.05;
/// The least width over which angles beyond a limit are compressed, as a share of the limit.
const MIN_WIDTH: f64 = 0.05;

/// One joint: its limit, and the slots of it and of the source's joint.
#[derive(Clone, Copy, Debug)]
struct LimitStep {
    slot: usize,
    source: Option<usize>,
    limit: JointLimit,
}

/// How a joint is turned from the T pose: about the bone last, and in which direction its bone is swung, in radians.
#[derive(Clone, Copy, Debug)]
struct Turned {
    twist: f64,
    swing: DVec2,
}

impl JointLimit {
    fn turned(&self, zero: &LimitFrame, local: DQuat) -> Turned {
        let change = zero.parent * local * zero.local.conjugate() * zero.parent.conjugate();
        let [along, bend, across] = self.axes;
        let twist = twist_angle(change, along);
        let swing = change * DQuat::from_axis_angle(along, -twist);
        let swing = if swing.w < 0.0 { -swing } else { swing }.to_scaled_axis();
        Turned { twist, swing: DVec2::new(swing.dot(bend), swing.dot(across)) }
    }

    /// How far a swing is on its way to the ellipse of limits: 1 is on it.
    fn swing_share(&self, swing: DVec2) -> f64 {
        DVec2::new(share(swing.x, self.bend), share(swing.y, self.side)).length()
    }
}

impl Step for LimitStep {
    fn apply(&self, figure: &mut Figure<'_>) {
        let Self { slot, source, limit } = self;
        let local = figure.local(*slot);
        let turned = limit.turned(&limit.zero, local.rotation);
        let allowed = source.map(|slot| limit.turned(&limit.source_zero, figure.source.local[slot].rotation));
        let swing_share = limit.swing_share(turned.swing);
        let allowed_swing = allowed.map_or(0.0, |allowed| limit.swing_share(allowed.swing));
        let twist_share = share(turned.twist, limit.twist);
        let allowed_twist = allowed.map_or(0.0, |allowed| share(allowed.twist, limit.twist));
        let (new_swing, new_twist) =
            (limited(swing_share, allowed_swing, limit.begin), limited(twist_share, allowed_twist, limit.begin));
        if new_swing >= swing_share && new_twist >= twist_share {
            return;
        }
        let factor = |new: f64, old: f64| if old > 0.0 { new / old } else { 1.0 };
        let swing = turned.swing * factor(new_swing, swing_share);
        let twist = turned.twist * factor(new_twist, twist_share);
        let [along, bend, across] = limit.axes;
        let change = DQuat::from_scaled_axis(bend * swing.x + across * swing.y) * DQuat::from_axis_angle(along, twist);
        let parent = limit.zero.parent;
        let rotation = parent.conjugate() * change * parent * limit.zero.local;
        figure.set_local(*slot, Transform { rotation: rotation.normalize(), ..local });
    }
}

/// An angle as a share of its limit.
fn share(angle: f64, [least, most]: [f64; 2]) -> f64 {
    let limit = if angle < 0.0 { -least } else { most };
    angle.abs() / limit.max(1e-3)
}

/// Nothing is changed up to `begin`, nor up to what is allowed anyway; from there on it comes ever nearer to the limit.
fn limited(share: f64, allowed: f64, begin: f64) -> f64 {
    let begin = begin.max(allowed);
    approach(share, begin, begin + (1.0 - begin).max(MIN_WIDTH))
}

/// How far a joint may bend, against what carries it.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct JointLimit {
    /// Joint of the target.
    pub(in crate::retarget) joint: usize,
    /// Joint of the source that has the same role, where what it does beyond the limit is allowed.
    pub(in crate::retarget) source: Option<usize>,
    /// Where the T poses lie.
    pub(in crate::retarget) zero: LimitFrame,
    /// The same of the source.
    pub(in crate::retarget) source_zero: LimitFrame,
    /// Along the bone, the axis about which it bends, and the one across, at the T pose in plan space.
    pub(in crate::retarget) axes: [DVec3; 3],
    /// Radians against and in the direction of bending.
    pub(in crate::retarget) bend: [f64; 2],
    /// Radians across.
    pub(in crate::retarget) side: [f64; 2],
    /// Radians about the bone.
    pub(in crate::retarget) twist: [f64; 2],
    /// The share of a limit up to which nothing is changed.
    pub(in crate::retarget) begin: f64,
}

/// The T pose of a joint: `D = parent · L · local⁻¹ · parent⁻¹` is the identity there.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::retarget) struct LimitFrame {
    /// The rotation of its parent, in plan space.
    pub(in crate::retarget) parent: DQuat,
    /// Its own below the parent.
    pub(in crate::retarget) local: DQuat,
}

impl JointLimit {
    fn step(&self, builder: &mut StepBuilder<'_>) -> LimitStep {
        LimitStep {
            slot: builder.change(self.joint, true, false),
            source: self.source.map(|joint| builder.source(joint)),
            limit: *self,
        }
    }
}

/// The limits of an op.
#[derive(Debug)]
pub(in crate::retarget) struct Limits(Vec<JointLimit>);

/// Takes back what goes beyond them, and tells what that was.
#[derive(Debug)]
struct LimitStage(PosedStage);

impl OpWork for Limits {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        stack.close();
        let posed = PosedStage::new(stack, &op.schedule, |builder| {
            self.0.iter().map(|limit| limit.step(builder)).collect::<Vec<LimitStep>>()
        });
        stack.push_posed(posed.map(LimitStage));
    }

    fn changed(&self, _op: &ResolvedOp, _mapping: &Mapping) -> Vec<usize> {
        self.0.iter().map(|limit| limit.joint).collect()
    }
}

impl Stage for LimitStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let rows = self.0.rows(work)?;
        let limited: Vec<LimitedJoint> = self.limited(&rows, work).collect();
        work.limited.extend(limited);
        work.write(&self.0.changed, &rows);
        Ok(())
    }
}

impl LimitStage {
    /// What is taken back; the rows are not in the tracks yet.
    fn limited<'a>(&'a self, rows: &'a [Change], work: &'a Work<'_>) -> impl Iterator<Item = LimitedJoint> + 'a {
        let PosedStage { changed, target, .. } = &self.0;
        changed.iter().enumerate().filter_map(move |(column, &Changed { joint, .. })| {
            let after = rows.iter().skip(column).step_by(changed.len()).map(|change| change.rotation);
            let before = &work.target[joint].rotation;
            let turned = after.enumerate().map(|(frame, after)| {
                let rest = target.rest_rotation(joint);
                degrees_between(before.at(frame, rest), after)
            });
            let own = work.clock.own();
            let turned: Vec<f64> = turned.skip(own.start).take(own.len()).collect();
            let frames = turned.iter().filter(|degrees| **degrees > MIN_LIMITED_DEGREES).count();
            let (worst_frame, worst_degrees) =
                turned.into_iter().enumerate().max_by(|first, second| first.1.total_cmp(&second.1))?;
            (frames > 0).then_some(LimitedJoint { joint, frames, worst_degrees, worst_frame })
        })
    }
}

/// Exact for small angles too.
fn degrees_between(first: Quat, second: Quat) -> f64 {
    let turn = first.as_dquat().conjugate() * second.as_dquat();
    2.0 * turn.xyz().length().atan2(turn.w.abs()).to_degrees()
}

impl OpSpec for LimitsOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let limits = resolve::resolve(self, context);
        context.push(&self.scope, Limits(limits));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_approached_without_a_jump() {
        assert_eq!(limited(0.5, 0.0, 0.8), 0.5, "within the limit");
        assert_eq!(limited(1.4, 1.5, 0.8), 1.4, "the source bends farther");
        let mut before = limited(0.79, 0.0, 0.8);
        for step in 1..400 {
            let now = limited(0.79 + f64::from(step) * 0.01, 0.0, 0.8);
            assert!(now >= before && now - before <= 0.01 + 1e-12 && now <= 1.0, "{now} after {before}");
            before = now;
        }
        assert!(before > 0.999, "the limit is reached: {before}");
        assert!(limited(2.0, 1.2, 0.8) < 1.3, "not far beyond what the source does");
    }
}
