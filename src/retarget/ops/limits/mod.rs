//! A joint that bends no farther than it may. (docs/algorithm/joints.md.)

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::{LimitRange, LimitsOp};

use glam::{DQuat, DVec2, DVec3};

use crate::model::rotation::twist_angle;

use super::edits::LimitFrame;
use crate::model::Transform;

use crate::retarget::stages::posed::figure::Figure;

/// The least width over which angles beyond a limit are compressed, as a share of the limit.
const LEAST_WIDTH: f64 = 0.05;

/// One joint.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct LimitStep {
    pub(in crate::retarget) slot: usize,
    /// The source joint whose excess is allowed.
    pub(in crate::retarget) source: Option<usize>,
    pub(in crate::retarget) zero: LimitFrame,
    pub(in crate::retarget) source_zero: LimitFrame,
    /// Along the bone, the axis about which it bends, and the one across.
    pub(in crate::retarget) axes: [DVec3; 3],
    pub(in crate::retarget) bend: [f64; 2],
    pub(in crate::retarget) side: [f64; 2],
    pub(in crate::retarget) twist: [f64; 2],
    pub(in crate::retarget) begin: f64,
}

/// How a joint is turned from the T pose: about the bone last, and in which direction its bone is swung, in radians.
#[derive(Clone, Copy, Debug)]
struct Turned {
    twist: f64,
    swing: DVec2,
}

impl LimitStep {
    pub(in crate::retarget) fn apply(&self, figure: &mut Figure<'_>) {
        let local = figure.local(self.slot);
        let turned = self.turned(&self.zero, local.rotation);
        let allowed = self.source.map(|slot| self.turned(&self.source_zero, figure.source.local[slot].rotation));
        let swing_share = self.swing_share(turned.swing);
        let allowed_swing = allowed.map_or(0.0, |allowed| self.swing_share(allowed.swing));
        let twist_share = share(turned.twist, self.twist);
        let allowed_twist = allowed.map_or(0.0, |allowed| share(allowed.twist, self.twist));
        let (new_swing, new_twist) =
            (limited(swing_share, allowed_swing, self.begin), limited(twist_share, allowed_twist, self.begin));
        if new_swing >= swing_share && new_twist >= twist_share {
            return;
        }
        let factor = |new: f64, old: f64| if old > 0.0 { new / old } else { 1.0 };
        let swing = turned.swing * factor(new_swing, swing_share);
        let twist = turned.twist * factor(new_twist, twist_share);
        let [along, bend, across] = self.axes;
        let change = DQuat::from_scaled_axis(bend * swing.x + across * swing.y) * DQuat::from_axis_angle(along, twist);
        let parent = self.zero.parent;
        let rotation = parent.conjugate() * change * parent * self.zero.local;
        figure.set_local(self.slot, Transform { rotation: rotation.normalize(), ..local });
    }

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

/// An angle as a share of its limit.
fn share(angle: f64, [least, most]: [f64; 2]) -> f64 {
    let limit = if angle < 0.0 { -least } else { most };
    angle.abs() / limit.max(1e-3)
}

/// Nothing is changed up to `begin`, nor up to what is allowed anyway; from there on it comes ever nearer to the limit.
fn limited(share: f64, allowed: f64, begin: f64) -> f64 {
    let begin = begin.max(allowed);
    if share <= begin {
        return share;
    }
    let width = (1.0 - begin).max(LEAST_WIDTH);
    begin + width * ((share - begin) / width).tanh()
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
