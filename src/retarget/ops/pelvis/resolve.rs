//! How far the pelvis travels, and above which floors.

use glam::{DQuat, DVec3, EulerRot};

use crate::model::{Clip, Reporter};

use super::sizes::{MIN_HEIGHT, Sizes};
use crate::{
    retarget::{
        mapping::{Mapping, PelvisPair, PelvisPosition},
        ops::context::nothing_to_map,
        ops::{Alpha, HeightRule, PelvisOp, PelvisScale, PelvisScaleRule, ScaleOrigin},
        resolve::pairs::Tops,
        spec::RetargetSpec,
    },
    rig::{
        RigSpec,
        error::SpecError,
        floor::{Stance, clip_floor},
        rig::Rig,
    },
};

/// Ankles above the sole, as a share of what is above them up to the pelvis: 3.9 % of a person's height of 51 % (Winter,
/// Biomechanics and Motor Control of Human Movement, after Drillis and Contini).
const ANKLE_HEIGHT: f64 = 0.076;
/// Joints at the toes above the sole, likewise.
const TOE_HEIGHT: f64 = 0.02;
/// Feet whose lowest joint is less than this share of the legs below the ankle have no joints at the toes.
const HAS_TOES: f64 = 0.03;

pub(in crate::retarget) fn resolve_pelvis(
    op: &PelvisOp,
    source: &Rig<'_>,
    target: &Rig<'_>,
    spec: &RetargetSpec,
    clip: &Clip,
    mapping: &mut Mapping,
    reporter: &mut Reporter,
) -> Result<(), SpecError> {
    let Some((source_pelvis, target_pelvis)) = pelvis_joints(op, source, target, reporter) else { return Ok(()) };
    let source_height = Height::measure(source, &spec.source, op.source_height, source_pelvis)?;
    let mut target_height = Height::measure(target, &spec.target, op.target_height, target_pelvis)?;
    if op.target_height == HeightRule::AboveFloor && source.stands_on_four() && target.stands_on_four() {
        target_height.value += lifted_by_alignment(target, target_pelvis, mapping);
    }
    let unit = mapping.plan_from_source.scale.x;
    let (mut source_floor, mut is_joint) = (source_height.floor, false);
    if !source_height.stands {
        let found = clip_floor(source, clip, source_pelvis, source_height.floor);
        (source_floor, is_joint) = (found.height, found.is_joint);
    }
    let (source_value, target_value) = Height::comparable(&source_height, &target_height);
    let ratio = target_value / if source_value < MIN_HEIGHT { 1.0 } else { source_value };
    let source_sole = if is_joint { source_height.guessed_sole * unit } else { 0.0 };
    mapping.global_scale = match op.scale {
        // What is no body has no height to compare.
        PelvisScale::Value(value) if [source, target].iter().all(|side| !side.recognition.is_body()) => value,
        _ => ratio / unit,
    };
    if !op.enabled {
        return Ok(());
    }
    let sizes = Sizes { source, target, floors: [source_height.floor, target_height.floor], unit };
    let scale = sizes.scale(op.scale, mapping.global_scale, reporter);
    let (source_origin, target_origin, source_sole) = match op.origin {
        ScaleOrigin::Origin => (DVec3::ZERO, DVec3::ZERO, 0.0),
        // Nothing says where the target's floor is, so it is where the source's is.
        ScaleOrigin::Floor if !target_height.has_floor => (DVec3::ZERO, DVec3::ZERO, 0.0),
        ScaleOrigin::Floor => {
            let up = mapping.plan_from_target * target.up();
            (up * (source_floor * unit - source_sole), up * target_height.floor, source_sole)
        }
    };
    let plain = PelvisPosition {
        canonical_from_plan: (target.canonical_from_scene * mapping.plan_from_target.conjugate()).normalize(),
        scale,
        source_origin,
        target_origin,
        source_sole,
    };
    let crotch = (op.floor_constraint > 0.0).then(|| {
        let heights = [source_height.value, target_height.value];
        let floor = source_floor * unit - source_sole;
        sizes.crotch(op, heights, floor, scale.y, mapping.plan_from_target * target.up())
    });
    let alpha = constant_alpha(&op.alpha, op.frames);
    let turn = plain.canonical_from_plan.conjugate() * degrees_xyz(op.turn_offset) * plain.canonical_from_plan;
    mapping.pelvis = Some(PelvisPair {
        source: source_pelvis,
        target: target_pelvis,
        rotation_alpha: alpha * op.rotation_alpha,
        translation_alpha: alpha * op.translation_alpha,
        position: blended(
            op,
            target.unit_meters,
            PelvisPosition {
                scale: DVec3::new(op.scale_horizontal, op.scale_vertical, op.scale_horizontal) * scale,
                ..plain
            },
        ),
        plain,
        turn: turn.normalize(),
        local_turn: degrees_xyz(op.local_turn_offset),
        local_offset: DVec3::from(op.local_offset) / target.unit_meters,
        crotch,
        affects_goals: [op.affect_ik_horizontal, op.affect_ik_vertical],
    });
    Ok(())
}

/// The pelvis of both rigs; where one has none, the op is left out and says so.
fn pelvis_joints(op: &PelvisOp, source: &Rig<'_>, target: &Rig<'_>, reporter: &mut Reporter) -> Option<(usize, usize)> {
    let (of_source, of_target) = (source.role("pelvis").first(), target.role("pelvis").first());
    if op.enabled && (of_source.is_none() || of_target.is_none()) {
        let side = if of_source.is_none() { "source" } else { "target" };
        reporter.warn(
            "pelvis_not_found",
            side,
            format!("no joint of the {side} was recognized as the pelvis; the pelvis op is left out"),
            format!("name the joint in {side}.root"),
        );
    }
    of_source.copied().zip(of_target.copied())
}

/// Animals stand on bent legs, which the alignment has bent as the source's are.
fn lifted_by_alignment(target: &Rig<'_>, pelvis: usize, mapping: &Mapping) -> f64 {
    mapping.target_rest.transforms()[pelvis].translation.dot(target.up()) - target.rest_height(pelvis)
}

fn degrees_xyz(degrees: [f64; 3]) -> DQuat {
    let [x, y, z] = degrees.map(f64::to_radians);
    DQuat::from_euler(EulerRot::XYZ, x, y, z)
}

/// The same position with the op's offset, and blended with the source's own. Both are affine in the source's position, so the blend
/// is one of scales and of origins.
fn blended(op: &PelvisOp, unit_meters: f64, position: PelvisPosition) -> PelvisPosition {
    let turn = position.canonical_from_plan;
    let share = DVec3::from(op.blend_to_source_weights) * op.blend_to_source;
    let toward_source = turn * (position.source_origin - position.target_origin);
    let moved = toward_source * share + DVec3::from(op.offset) / unit_meters;
    PelvisPosition {
        scale: position.scale + (DVec3::ONE - position.scale) * share,
        target_origin: position.target_origin + turn.conjugate() * moved,
        ..position
    }
}

/// What moves two skeletons that are no bodies: there is no floor and no height, only a size.
pub(in crate::retarget) fn resolve_top(op: &PelvisOp, tops: &Tops, mapping: &mut Mapping) {
    let unit = mapping.plan_from_source.scale.x;
    mapping.global_scale = tops.size_ratio / unit;
    if !op.enabled {
        return;
    }
    let scale = match op.scale {
        PelvisScale::Rule(PelvisScaleRule::None) => 1.0,
        PelvisScale::Rule(_) => mapping.global_scale,
        PelvisScale::Value(value) => value,
    };
    let position = PelvisPosition {
        canonical_from_plan: DQuat::IDENTITY,
        scale: DVec3::splat(scale),
        source_origin: DVec3::ZERO,
        target_origin: DVec3::ZERO,
        source_sole: 0.0,
    };
    let alpha = constant_alpha(&op.alpha, op.frames);
    mapping.pelvis = Some(PelvisPair {
        source: tops.source,
        target: tops.target,
        rotation_alpha: alpha * op.rotation_alpha,
        translation_alpha: alpha * op.translation_alpha,
        position,
        plain: position,
        turn: DQuat::IDENTITY,
        local_turn: DQuat::IDENTITY,
        local_offset: DVec3::ZERO,
        crotch: None,
        affects_goals: [op.affect_ik_horizontal, op.affect_ik_vertical],
    });
}

/// The alpha that the plan applies; what changes over time is faded behind it.
pub(in crate::retarget) fn constant_alpha(alpha: &Alpha, frames: Option<[usize; 2]>) -> f64 {
    alpha.constant().filter(|_| frames.is_none()).unwrap_or(1.0)
}

/// How far the lowest joint of the feet is above the soles of a rig that nothing says it of. It hangs from its pelvis, as captures
/// do, `height` above that joint and `legs` above the ankles.
fn guess_sole(legs: f64, height: f64) -> f64 {
    let foot = height - legs;
    if foot < HAS_TOES * legs { (ANKLE_HEIGHT * legs - foot).max(0.0) } else { TOE_HEIGHT * legs }
}

/// A pelvis height at rest, in the scene's unit.
struct Height {
    value: f64,
    floor: f64,
    /// As in [`Stance`].
    sole: Option<f64>,
    /// What of the sole is a guess: all or nothing of it.
    guessed_sole: f64,
    /// Whether the rest pose stands on the file's own floor, so that the floor of its clips is known too.
    stands: bool,
    /// Whether it is known where the floor of the file is: the rest pose stands on it, or the spec says it.
    has_floor: bool,
}

impl Height {
    fn measure(side: &Rig<'_>, spec: &RigSpec, rule: HeightRule, pelvis: usize) -> Result<Self, SpecError> {
        let ground = match &spec.ground {
            Some(name) if rule != HeightRule::AboveOrigin => {
                let joint = side.joint(name, &format!("/{}/ground", side.name)).map_err(|field| {
                    SpecError::from_fields(vec![field]).unwrap_or_else(|| nothing_to_map(side, side))
                })?;
                Some(side.rest_height(joint))
            }
            _ => None,
        };
        let stance = Stance::of(side, pelvis);
        let height = side.rest_height(pelvis);
        let stands = ground.is_none() && stance.stands;
        let as_asked =
            |value: f64, floor: f64| Self { value, floor, sole: Some(0.0), guessed_sole: 0.0, stands, has_floor: true };
        Ok(match (rule, ground) {
            (HeightRule::AboveOrigin, _) => as_asked(height, stance.floor),
            (_, Some(floor)) => as_asked(height - floor, floor),
            (HeightRule::AboveGroundJoint, None) => as_asked(height - stance.floor, stance.floor),
            (HeightRule::AboveFloor, None) => {
                let Stance { floor, sole, height, legs, .. } = stance;
                let guess = if sole.is_none() { legs.map(|legs| guess_sole(legs, height)) } else { None };
                let guessed_sole = guess.unwrap_or(0.0);
                let value = height + guessed_sole;
                Self { value, floor, sole: sole.or(guess), guessed_sole, stands, has_floor: stands }
            }
        })
    }

    /// Both values above the same thing: the floor where both sides have one, else the lowest joint of the feet.
    fn comparable(source: &Self, target: &Self) -> (f64, f64) {
        match (source.sole, target.sole) {
            (Some(_), Some(_)) | (None, None) => (source.value, target.value),
            (source_sole, target_sole) => {
                (source.value - source_sole.unwrap_or(0.0), target.value - target_sole.unwrap_or(0.0))
            }
        }
    }
}
