//! Soles from the mesh.

use glam::DVec3;

use crate::model::{Influence, SkinPoints};

use super::{
    Foot, FootShape, SupportPoint,
    extremes::{FootFrame, extreme, farthest},
};

/// Fewer vertices are no foot.
const FEW_VERTICES: usize = 8;
/// Vertices closer than this share of a leg where they were bound are one, seen by several joints.
const SAME_PLACE: f64 = 1e-5;
/// A vertex that is farther from the ankle than this many times the middle distance hangs on something else: a cape, a skirt.
const FAR_OFF: f64 = 4.0;
/// No vertex so near is one of those, in leg lengths: where many vertices are about the ankle, the middle one is near and toes are far.
const NEAR: f64 = 0.4;
/// Any vertex farther than this is one, in leg lengths; blocky feet may be longer than their legs.
const MAX_FAR: f64 = 3.0;
/// A sole is at most this share of a leg below the lowest joint of its foot, and at most so far above it.
const THICKEST: f64 = 0.5;
const ABOVE_JOINTS: f64 = 0.06;
/// The joint of the ball that is not there, as a share of the way from the back of the heel to the tip of the toes.
const VIRTUAL_BALL: f64 = 0.72;
/// Degrees off straight down in which the back of the heel and the tip of the toes are looked for.
const END_TILT: f64 = 35.0;

/// The shape of a foot; nothing where no mesh lies about its joints as a foot's does.
pub(super) fn shape(foot: &Foot<'_, '_>) -> Option<FootShape> {
    let points = near(vertices(foot), foot);
    if points.len() < FEW_VERTICES || !is_below(&points, foot) {
        return None;
    }
    let end = foot.side.rest.transforms()[foot.leg.end].rotation.conjugate();
    let ball = foot.leg.ball.map(|ball| foot.offset(foot.leg.end, foot.place(ball)));
    let frame = FootFrame { down: end * -foot.up, front: end * foot.front, left: end * foot.left, ball };
    let mut points = extreme(&points, &frame, foot.length * foot.unit);
    foot.mark_toes(&mut points);
    let contacts = contacts(&points, &frame, foot)?.map(Some);
    Some(FootShape { points, contacts, is_from_mesh: true })
}

/// What a part of a leg says of one vertex: the sum of its weights, and of where its joints put the vertex at rest, times them.
#[derive(Clone, Copy, Default)]
struct Seen {
    weight: f64,
    place: DVec3,
}

impl Seen {
    fn place(&self) -> Option<DVec3> {
        (self.weight > 0.0).then(|| self.place / self.weight)
    }
}

const FOOT: usize = 0;
const TOES: usize = 1;
const SHIN: usize = 2;

/// The part of a leg that a joint is of.
fn part_of(foot: &Foot<'_, '_>, joint: usize) -> Option<usize> {
    let is_below = |root: usize| foot.side.skeleton().is_ancestor_or_self(root, joint);
    match joint {
        _ if foot.leg.ball.is_some_and(is_below) => Some(TOES),
        _ if is_below(foot.leg.end) => Some(FOOT),
        // Joints between knee and ankle that take a share of the shin's twist lean with it.
        _ if is_below(foot.leg.shin) => Some(SHIN),
        _ => None,
    }
}

/// The vertices of a foot, with the shares of each that move with toes and shin. Vertices of equal place count once. Feet without a skin
/// may be meshes that hang on their joints, as those of robots.
fn vertices(foot: &Foot<'_, '_>) -> Vec<SupportPoint> {
    let parts: Vec<Option<usize>> = (0..foot.side.skeleton().len()).map(|joint| part_of(foot, joint)).collect();
    let vertices = &foot.side.scene.skin_vertices;
    let is_of_foot = |influences: &&[Influence]| {
        let is_below = |one: &&Influence| matches!(parts[one.joint as usize], Some(FOOT | TOES));
        influences.iter().filter(is_below).map(|one| one.weight).sum::<f32>() >= SkinPoints::MIN_WEIGHT
    };
    let of = |influences: &[Influence]| vertex(foot, influences, &parts);
    let mut found: Vec<([i64; 3], SupportPoint)> = vertices.skinned().filter(is_of_foot).filter_map(of).collect();
    if found.is_empty() {
        found = vertices.rigid().filter(is_of_foot).filter_map(of).collect();
    }
    found.sort_by_key(|(cell, _)| *cell);
    found.dedup_by_key(|(cell, _)| *cell);
    found.into_iter().map(|(_, point)| point).collect()
}

/// A vertex from what foot, toes and shin say of it, and a cell of the place at which it was bound; nothing of one that is the shin's.
fn vertex(foot: &Foot<'_, '_>, influences: &[Influence], parts: &[Option<usize>]) -> Option<([i64; 3], SupportPoint)> {
    let (bind_pose, rest) = (&foot.side.scene.bind_pose, foot.side.rest.transforms());
    let (mut seen, mut bound) = ([Seen::default(); 3], DVec3::ZERO);
    for one in influences {
        let (joint, weight, position) = (one.joint as usize, f64::from(one.weight), one.position.as_dvec3());
        bound += bind_pose.get(joint).copied().flatten().unwrap_or(rest[joint]).transform_point(position) * weight;
        if let Some(part) = parts[joint] {
            seen[part].place += rest[joint].transform_point(position) * weight;
            seen[part].weight += weight;
        }
    }
    let [of_foot, of_toes, of_shin] = seen;
    let place = of_foot.place().or_else(|| of_toes.place())?;
    let weight = of_foot.weight + of_toes.weight + of_shin.weight;
    let mut point = foot.support(place, of_toes.weight / weight);
    point.shin = of_shin.weight / weight;
    if let Some((ball, place)) = foot.leg.ball.zip(of_toes.place()) {
        point.from_ball = foot.offset(ball, place);
    }
    if let Some(place) = of_shin.place() {
        point.from_shin = foot.offset_in_shin(place);
    }
    Some(((bound / (SAME_PLACE * foot.length)).round().as_i64vec3().to_array(), point))
}

/// The vertices that lie about the foot.
fn near(mut points: Vec<SupportPoint>, foot: &Foot<'_, '_>) -> Vec<SupportPoint> {
    let mut distances: Vec<f64> = points.iter().map(|point| point.from_end.length()).collect();
    distances.sort_by(f64::total_cmp);
    let Some(middle) = distances.get(distances.len() / 2).copied() else { return points };
    let leg = foot.length * foot.unit;
    let most = (FAR_OFF * middle).clamp(NEAR * leg, MAX_FAR * leg);
    points.retain(|point| point.from_end.length() <= most);
    points
}

/// Whether the lowest vertex is where a sole may be.
fn is_below(points: &[SupportPoint], foot: &Foot<'_, '_>) -> bool {
    let down = foot.side.rest.transforms()[foot.leg.end].rotation.conjugate() * -foot.up;
    let depth = points.iter().map(|point| point.from_end.dot(down)).fold(f64::NEG_INFINITY, f64::max);
    let joints = [Some(foot.leg.end), foot.leg.ball].into_iter().flatten();
    let lowest =
        joints.map(|joint| foot.offset(foot.leg.end, foot.place(joint)).dot(down)).fold(f64::NEG_INFINITY, f64::max);
    let length = foot.length * foot.unit;
    (-ABOVE_JOINTS * length..THICKEST * length).contains(&(depth - lowest))
}

/// The back of the heel, the ball and the tip of the toes, in the middle of the foot.
fn contacts(points: &[SupportPoint], frame: &FootFrame, foot: &Foot<'_, '_>) -> Option<[super::FootPoint; 3]> {
    let back = farthest(points, frame.direction(END_TILT, 180.0))?;
    let tip = farthest(points, frame.direction(END_TILT, 0.0))?;
    let beside = frame.ball.map_or(0.0, |ball| ball.dot(frame.left));
    let centered = |place: DVec3, beside: f64| place + frame.left * (beside - place.dot(frame.left));
    let back = centered(back, 0.0);
    let tip = centered(tip, beside);
    let depth = points.iter().map(|point| point.from_end.dot(frame.down)).fold(f64::NEG_INFINITY, f64::max);
    let ball = frame.ball.unwrap_or_else(|| back.lerp(tip, VIRTUAL_BALL));
    let ball = ball + frame.down * (depth - ball.dot(frame.down));
    let rest = &foot.side.rest.transforms()[foot.leg.end];
    let place = |from_end: DVec3| rest.translation + rest.rotation * from_end / foot.unit;
    let joint = foot.leg.ball.unwrap_or(foot.leg.end);
    Some([foot.fixed(foot.leg.end, place(back)), foot.fixed(joint, place(ball)), foot.fixed(joint, place(tip))])
}
