//! The limbs that both rigs have, and how their feet stand.

use glam::{DQuat, DVec3};

use super::animal_legs::animal_leg;
use crate::{
    model::{Clip, Track},
    retarget::mapping::LimbPair,
    rig::{
        Limb, LimbJoints, Sole,
        limb_joints::{by_roles, limb_joints},
        rig::Rig,
        soles::foot_shape,
    },
};

/// A foot whose ankle is higher than the other by more than this share of its length does not stand.
const RAISED: f64 = 0.2;
/// Cosine of half the angle by which what is stiff may turn: a tenth of a degree.
const STIFF: f32 = 1.0 - 4e-7;

/// The limbs of which both rigs have start, middle and end, with what is known of their feet.
pub(in crate::retarget) fn find_limbs(source: &Rig<'_>, target: &Rig<'_>, clip: &Clip) -> Vec<LimbPair> {
    let mut limbs: Vec<LimbPair> = Limb::all().filter_map(|limb| find_limb(limb, source, target)).collect();
    limbs.iter_mut().for_each(|pair| pair.has_stiff_foot = has_stiff_foot(pair, source, clip));
    for pair in limbs.chunk_by_mut(|one, other| one.limb.is_paired_with(other.limb)) {
        share_soles(pair, source, |pair| &mut pair.source);
        share_soles(pair, target, |pair| &mut pair.target);
    }
    shape_feet(&mut limbs, source, target);
    limbs
}

/// Whether there is a leg that both rigs have and whose target joints are driven.
pub(in crate::retarget) fn have_driven_leg(
    source: &Rig<'_>,
    target: &Rig<'_>,
    is_driven: impl Fn(usize) -> bool,
) -> bool {
    let legs = Limb::all().filter(|limb| limb.is_leg());
    let mut targets = legs.filter_map(|limb| find_limb(limb, source, target)).map(|pair| pair.target);
    targets.any(|leg| [leg.start, leg.middle].into_iter().all(&is_driven))
}

/// Whether both rigs have two arms, and the target's are driven.
pub(in crate::retarget) fn have_driven_arms(
    source: &Rig<'_>,
    target: &Rig<'_>,
    is_driven: impl Fn(usize) -> bool,
) -> bool {
    let arms = [Limb::LeftArm, Limb::RightArm];
    let targets = arms.map(|limb| find_limb(limb, source, target).map(|pair| pair.target));
    targets.iter().all(|arm| arm.is_some_and(|arm| [arm.start, arm.middle].into_iter().all(&is_driven)))
}

/// A limb of which both rigs have start, middle and end.
fn find_limb(limb: Limb, source: &Rig<'_>, target: &Rig<'_>) -> Option<LimbPair> {
    let unit = source.unit_meters / target.unit_meters;
    let [of_source, of_target] = match limb.roles() {
        Some(roles) => [by_roles(roles, source)?, by_roles(roles, target)?],
        None => animal_leg(limb, source, target)?,
    };
    let (source, target) = (limb_joints(limb, &of_source, source, unit)?, limb_joints(limb, &of_target, target, 1.0)?);
    Some(LimbPair::of(limb, source, target))
}

/// Skeletons of points have ankles and nothing beyond.
fn has_stiff_foot(pair: &LimbPair, source: &Rig<'_>, clip: &Clip) -> bool {
    let LimbJoints { middle, end, ball, .. } = pair.source;
    let turns = |joint: &usize| match &clip.joints()[*joint].rotation {
        Track::Sampled(values) => values.iter().any(|value| value.dot(values[0]).abs() < STIFF),
        Track::Rest | Track::Constant(_) => false,
    };
    let below_shin = source
        .skeleton()
        .path(middle, end)
        .filter(|_| pair.limb.is_leg() && pair.limb.whole_leg().is_none() && ball.is_none());
    clip.frame_count() > 1 && below_shin.is_some_and(|path| !path[1..].iter().any(turns))
}

/// Both feet have the sole of the one that stands: a rest pose may be a frame of a walk.
fn share_soles(limbs: &mut [LimbPair], rig: &Rig<'_>, side: impl Fn(&mut LimbPair) -> &mut LimbJoints) {
    let soles: Vec<Sole> = limbs.iter_mut().filter_map(|pair| side(pair).sole).collect();
    let least = |part: fn(&Sole) -> Option<f64>| soles.iter().filter_map(part).reduce(f64::min);
    let (heel, ball, tip) = (least(|sole| Some(sole.heel)), least(|sole| sole.ball), least(|sole| sole.tip));
    let is_raised = |sole: &Sole| {
        let raised = sole.heel - heel.unwrap_or(sole.heel);
        raised > RAISED * sole.end_to_ball.map_or(sole.heel, DVec3::length)
    };
    let standing = soles.iter().find(|sole| !is_raised(sole));
    for joints in limbs.iter_mut().map(side) {
        let (end, toe) = (joints.end, joints.ball);
        let Some(sole) = joints.sole.as_mut() else { continue };
        if is_raised(sole) {
            sole.down =
                standing.and_then(|standing| down_as_if_standing(standing, sole, rig, end, toe)).unwrap_or_default();
        }
        sole.heel = heel.unwrap_or(sole.heel);
        sole.ball = sole.ball.and(ball);
        sole.tip = sole.tip.and(tip);
    }
}

/// A foot in the air is tipped, too: it would stand with its ball as far off straight below the ankle as the other foot's is, turned
/// about the body's own left. Straight down then, in the axes of its joints; nothing where it has no ball.
fn down_as_if_standing(
    standing: &Sole,
    raised: &Sole,
    rig: &Rig<'_>,
    end: usize,
    ball: Option<usize>,
) -> Option<[Option<DVec3>; 3]> {
    let (stands, bone) = (standing.end_to_ball?, raised.end_to_ball?.try_normalize()?);
    let angle = stands.angle_between(standing.down[0]?);
    let turned = |joint: usize| rig.rest.transforms()[joint].rotation;
    let left = turned(end).conjugate() * (rig.canonical_from_scene.conjugate() * DVec3::X);
    let left = (left - bone * left.dot(bone)).try_normalize()?;
    let down = DQuat::from_axis_angle(left, angle) * bone;
    let of_toes = ball.map(|ball| turned(ball).conjugate() * (turned(end) * down));
    Some([Some(down), of_toes, raised.down[2].and(of_toes)])
}

/// Finds the soles of both sides. Of what is turned by nothing but the shins, nobody knows how it lies; and feet of one body are
/// looked at in one way.
fn shape_feet(limbs: &mut [LimbPair], source: &Rig<'_>, target: &Rig<'_>) {
    let unit = source.unit_meters / target.unit_meters;
    let is_leg = |pair: &&mut LimbPair| pair.limb.is_leg();
    let stands = |sole: Option<Sole>| sole.is_some_and(|sole| sole.down[0].is_some());
    let known = |pair: &LimbPair| [!pair.has_stiff_foot && stands(pair.source.sole), stands(pair.target.sole)];
    let legs = || limbs.iter().filter(|pair| pair.limb.is_leg());
    let [source_stands, target_stands] = [0, 1].map(|side| legs().all(|pair| known(pair)[side]));
    for pair in limbs.iter_mut().filter(is_leg) {
        let is_human = pair.limb.whole_leg().is_none();
        pair.source_foot = foot_shape(source, &pair.source, unit, source_stands, is_human);
        pair.target_foot = foot_shape(target, &pair.target, 1.0, target_stands, is_human);
    }
}
