//! Soles of feet without a mesh, by the proportions of a human foot.

use super::{Foot, FootPoint, FootShape, SupportPoint};
use crate::rig::limb::LimbJoints;
use glam::DVec3;

// All lengths are in distances from the ankle to the joint of the ball along the floor. Of a human foot of 26 cm it is 13 cm.
/// The back of the heel behind the ankle.
const HEEL: f64 = 0.4;
/// The tips of the toes beyond the joint of the ball.
const TOES: f64 = 0.55;
/// The edges of heel, ball and toes beside the middle of the foot.
const HEEL_WIDTH: f64 = 0.25;
const BALL_WIDTH: f64 = 0.33;
const TOE_WIDTH: f64 = 0.2;
/// That distance in leg lengths where there is no joint of the ball, and its bounds where there is one.
const USUAL: f64 = 0.16;
const BOUNDS: [f64; 2] = [0.06, 0.4];

/// The shape of a foot that stands on the floor of its rest pose.
pub(crate) fn shape(foot: &Foot<'_, '_>) -> Option<FootShape> {
    let sole = foot.leg.sole?;
    let ankle = foot.place(foot.leg.end);
    let heel = ankle - foot.up * (sole.heel / foot.unit);
    let on_floor = |place: DVec3| place + foot.up * (heel - place).dot(foot.up);
    let ball_at = foot.leg.ball.map(|ball| on_floor(foot.place(ball)));
    let [least, most] = BOUNDS.map(|share| share * foot.length);
    let long = ball_at.map_or(USUAL * foot.length, |ball| (ball - heel).dot(foot.front).clamp(least, most));
    let ball = ball_at.unwrap_or(heel + foot.front * long);
    let beyond = foot.leg.tip.map_or(0.0, |tip| (foot.place(tip) - ball).dot(foot.front));
    let tip = ball + foot.front * if beyond > 0.1 * long { beyond } else { TOES * long };
    let back = heel - foot.front * (HEEL * long);
    let toes = if foot.leg.ball.is_some() { 1.0 } else { 0.0 };
    let sides = |middle: DVec3, wide: f64| [-1.0, 1.0].map(|side| middle + foot.left * (side * wide * long));
    // Toes are round: they do not get thinner when the foot points down.
    let tip_joint = foot.leg.tip.filter(|_| beyond > 0.1 * long).map(|joint| foot.place(joint));
    let thick = tip_joint.map_or(0.0, |joint| (joint - tip).dot(foot.up).max(0.0));
    let toe_tip = SupportPoint { radius: thick * foot.unit, ..foot.support(tip + foot.up * thick, toes) };
    let mut points: Vec<SupportPoint> = vec![foot.support(back, 0.0), toe_tip];
    points.extend(sides(back.lerp(heel, 0.6), HEEL_WIDTH).map(|place| foot.support(place, 0.0)));
    points.extend(sides(ball, BALL_WIDTH).map(|place| foot.support(place, 0.0)));
    points.extend(sides(tip.lerp(ball, 0.25), TOE_WIDTH).map(|place| foot.support(place, toes)));
    foot.mark_toes(&mut points);
    let joint = foot.leg.ball.unwrap_or(foot.leg.end);
    let contacts = [foot.fixed(foot.leg.end, back), foot.fixed(joint, ball), foot.fixed(joint, tip)].map(Some);
    Some(FootShape { points, contacts, is_from_mesh: false })
}

/// Where nobody knows how the foot is turned at rest: as far below each joint as the floor is there, whatever way the foot is turned.
pub(crate) fn balls(leg: &LimbJoints) -> FootShape {
    let Some(sole) = leg.sole else { return FootShape::default() };
    let point = |from_end: DVec3, from_ball: DVec3, toes: f64, radius: f64| SupportPoint {
        from_end,
        from_ball,
        from_shin: DVec3::ZERO,
        toes,
        shin: 0.0,
        radius,
        gives_way: false,
    };
    let mut points = vec![point(DVec3::ZERO, DVec3::ZERO, 0.0, sole.heel)];
    let to_ball = sole.end_to_ball.zip(sole.ball);
    points.extend(to_ball.map(|(from_end, radius)| point(from_end, DVec3::ZERO, 1.0, radius)));
    let to_tip = sole.end_to_ball.zip(sole.ball_to_tip.zip(sole.tip));
    points.extend(to_tip.map(|(from_end, (from_ball, radius))| point(from_end, from_ball, 1.0, radius)));
    let fixed = |joint: Option<usize>| joint.map(|joint| FootPoint { joint, offset: DVec3::ZERO });
    FootShape { points, contacts: [Some(leg.end), leg.ball, leg.tip].map(fixed), is_from_mesh: false }
}
