//! How far the pelvis travels, and above which floors.

use glam::{DQuat, DVec3, EulerRot};

use crate::model::{Clip, Reporter};

use super::{
    super::{
        error::SpecError,
        floor::{Stance, clip_floor},
        mapping::{CrotchRule, Mapping, PelvisPair, PelvisPosition},
        recognition::RigKind,
        spec::{Alpha, HeightRule, PelvisOp, PelvisScale, PelvisScaleRule, RetargetSpec, RigSpec, ScaleOrigin},
        understand::Rig,
    },
    nothing_to_map,
    pairs::Tops,
};

/// ikrigretarget's guard: a source height below this counts as one.
const LEAST_HEIGHT: f64 = 1e-4;
/// A crotch is at least this share of the pelvis' height above the floor.
const LEAST_CROTCH: f64 = 0.1;

pub(super) fn resolve_pelvis(
    op: &PelvisOp,
    source: &Rig<'_>,
    target: &Rig<'_>,
    spec: &RetargetSpec,
    clip: &Clip,
    mapping: &mut Mapping,
    reporter: &mut Reporter,
) -> Result<(), SpecError> {
    let joints = (source.role("pelvis").first().copied(), target.role("pelvis").first().copied());
    let (Some(source_pelvis), Some(target_pelvis)) = joints else {
        if op.enabled {
            let side = if joints.0.is_none() { "source" } else { "target" };
            reporter.warn(
                "pelvis_not_found",
                side,
                format!("no joint of the {side} was recognised as the pelvis; the pelvis op is left out"),
                format!("name the joint in {side}.root"),
            );
        }
        return Ok(());
    };
    let source_height = Height::measure(source, &spec.source, op.source_height, source_pelvis)?;
    let target_height = Height::measure(target, &spec.target, op.target_height, target_pelvis)?;
    let unit = mapping.plan_from_source.scale.x;
    let (source_value, target_value) = Height::comparable(&source_height, &target_height);
    let ratio = target_value / if source_value < LEAST_HEIGHT { 1.0 } else { source_value };
    mapping.global_scale = match op.scale {
        // What is no body has no height to compare.
        PelvisScale::Value(value) if [source, target].iter().all(|side| side.recognition.kind == RigKind::Other) => {
            value
        }
        _ => ratio / unit,
    };
    if !op.enabled {
        return Ok(());
    }
    let clip_floor = if source_height.stands {
        source_height.floor
    } else {
        clip_floor(source, clip, source_pelvis, source_height.floor)
    };
    let sizes = Sizes { source, target, floors: [source_height.floor, target_height.floor], unit };
    let scale = sizes.scale(op.scale, mapping.global_scale, reporter);
    let (source_origin, target_origin) = match op.origin {
        ScaleOrigin::Origin => (DVec3::ZERO, DVec3::ZERO),
        // Nothing says where the target's floor is, so it is where the source's is.
        ScaleOrigin::Floor if !target_height.has_floor => (DVec3::ZERO, DVec3::ZERO),
        ScaleOrigin::Floor => {
            let up = mapping.plan_from_target * target.up();
            (up * clip_floor * unit, up * target_height.floor)
        }
    };
    let plain = PelvisPosition {
        ours_from_plan: (target.work_from_scene * mapping.plan_from_target.conjugate()).normalize(),
        scale,
        source_origin,
        target_origin,
    };
    let crotch = (op.floor_constraint > 0.0).then(|| {
        let below = |given: Option<f64>, side: &Rig<'_>, height: &Height, pelvis: usize| {
            given.map_or_else(|| crotch_below(side, height, pelvis), |metres| metres / side.unit_metres)
        };
        let source_below = below(op.source_crotch, source, &source_height, source_pelvis) * unit;
        let target_below = below(op.target_crotch, target, &target_height, target_pelvis);
        let least = LEAST_CROTCH * target_height.value;
        let source_crotch = (source_height.value * unit - source_below).max(LEAST_CROTCH * source_height.value * unit);
        CrotchRule {
            up: mapping.plan_from_target * target.up(),
            source_floor: clip_floor * unit,
            source_below,
            target_below,
            ratio: (target_height.value - target_below).max(least) / source_crotch.max(f64::MIN_POSITIVE),
            scale: scale.y,
            weight: op.floor_constraint,
            faded_at: (op.floor_falloff > 0.0).then_some(op.floor_falloff * source_crotch),
        }
    });
    let alpha = constant_alpha(&op.alpha, op.frames);
    let [left, up, front] = op.turn_offset.map(f64::to_radians);
    let [x, y, z] = op.local_turn_offset.map(f64::to_radians);
    let turn =
        plain.ours_from_plan.conjugate() * DQuat::from_euler(EulerRot::XYZ, left, up, front) * plain.ours_from_plan;
    mapping.pelvis = Some(PelvisPair {
        source: source_pelvis,
        target: target_pelvis,
        rotation_alpha: alpha * op.rotation_alpha,
        translation_alpha: alpha * op.translation_alpha,
        position: blended(
            op,
            target.unit_metres,
            PelvisPosition {
                scale: DVec3::new(op.scale_horizontal, op.scale_vertical, op.scale_horizontal) * scale,
                ..plain
            },
        ),
        plain,
        turn: turn.normalize(),
        local_turn: DQuat::from_euler(EulerRot::XYZ, x, y, z),
        local_offset: DVec3::from(op.local_offset) / target.unit_metres,
        crotch,
        affects_goals: [op.affect_ik_horizontal, op.affect_ik_vertical],
    });
    Ok(())
}

/// The same position with the op's offset, and blended with the source's own. Both are affine in the source's position, so the blend
/// is one of scales and of origins.
fn blended(op: &PelvisOp, unit_metres: f64, position: PelvisPosition) -> PelvisPosition {
    let turn = position.ours_from_plan;
    let share = DVec3::from(op.blend_to_source_weights) * op.blend_to_source;
    let toward_source = turn * (position.source_origin - position.target_origin);
    let moved = toward_source * share + DVec3::from(op.offset) / unit_metres;
    PelvisPosition {
        scale: position.scale + (DVec3::ONE - position.scale) * share,
        target_origin: position.target_origin + turn.conjugate() * moved,
        ..position
    }
}

/// What moves two skeletons that are no bodies: there is no floor and no height, only a size.
pub(super) fn resolve_top(op: &PelvisOp, tops: &Tops, mapping: &mut Mapping) {
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
        ours_from_plan: DQuat::IDENTITY,
        scale: DVec3::splat(scale),
        source_origin: DVec3::ZERO,
        target_origin: DVec3::ZERO,
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
pub(super) fn constant_alpha(alpha: &Alpha, frames: Option<[usize; 2]>) -> f64 {
    alpha.constant().filter(|_| frames.is_none()).unwrap_or(1.0)
}

/// How far a crotch is below the pelvis joint, in the scene's unit: it lies half as far below the hips as those are apart.
fn crotch_below(side: &Rig<'_>, height: &Height, pelvis: usize) -> f64 {
    let place = |role: &str| side.role(role).first().map(|&joint| side.rest.transforms()[joint].translation);
    let (Some(left), Some(right)) = (place("left_thigh"), place("right_thigh")) else { return 0.1 * height.value };
    let hips = (left + right).dot(side.up()) / 2.0;
    side.rest_height(pelvis) - (hips - left.distance(right) / 2.0)
}

/// What scale rules compare.
struct Sizes<'a> {
    source: &'a Rig<'a>,
    target: &'a Rig<'a>,
    /// Below the source's and the target's rest pose.
    floors: [f64; 2],
    /// Target units per source unit.
    unit: f64,
}

impl Sizes<'_> {
    /// Factors along left, up and front.
    fn scale(&self, scale: PelvisScale, height: f64, reporter: &mut Reporter) -> DVec3 {
        let rule = match scale {
            PelvisScale::Value(value) => return DVec3::splat(value),
            PelvisScale::Rule(rule) => rule,
        };
        let legs = |reporter: &mut Reporter| {
            let ratio = leg_length(self.source)
                .zip(leg_length(self.target))
                .map(|(source, target)| target / (source * self.unit));
            if ratio.is_none() {
                reporter.warn(
                    "legs_not_found",
                    "ops",
                    "the pelvis is to be scaled by the legs, but not both rigs have any; the height of the pelvis is taken",
                    "name thighs, shins and feet in source.roles and target.roles",
                );
            }
            ratio.unwrap_or(height)
        };
        match rule {
            PelvisScaleRule::None => DVec3::ONE,
            PelvisScaleRule::Height => DVec3::splat(height),
            PelvisScaleRule::Legs => DVec3::splat(legs(reporter)),
            PelvisScaleRule::Stature => {
                let (source, target) = (stature(self.source, self.floors[0]), stature(self.target, self.floors[1]));
                DVec3::splat(if source > LEAST_HEIGHT { target / (source * self.unit) } else { height })
            }
            PelvisScaleRule::Limbs => {
                let legs = legs(reporter);
                DVec3::new(legs, height, legs)
            }
        }
    }
}

/// Mean length of the legs from hip to ankle, in the scene's unit.
fn leg_length(side: &Rig<'_>) -> Option<f64> {
    let place = |role: String| Some(side.rest.transforms()[*side.role(&role).first()?].translation);
    let leg = |name: &str| {
        let [hip, knee, ankle] = ["thigh", "shin", "foot"].map(|part| place(format!("{name}_{part}")));
        Some(hip?.distance(knee?) + knee?.distance(ankle?))
    };
    let legs: Vec<f64> = ["left", "right"].into_iter().filter_map(leg).filter(|length| *length > 0.0).collect();
    (!legs.is_empty()).then(|| legs.iter().sum::<f64>() / legs.len() as f64)
}

/// Height of the highest joint of a body above a floor, in the scene's unit.
fn stature(side: &Rig<'_>, floor: f64) -> f64 {
    let joints = side.role("pelvis").first().into_iter().flat_map(|&pelvis| {
        (pelvis..side.skeleton().len()).filter(move |&joint| side.skeleton().is_ancestor_or_self(pelvis, joint))
    });
    joints.map(|joint| side.rest_height(joint)).fold(floor, f64::max) - floor
}

/// A pelvis height at rest, in the scene's unit.
struct Height {
    value: f64,
    floor: f64,
    /// As in [`Stance`].
    sole: Option<f64>,
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
        let as_asked = |value: f64, floor: f64| Self { value, floor, sole: Some(0.0), stands, has_floor: true };
        Ok(match (rule, ground) {
            (HeightRule::AboveOrigin, _) => as_asked(height, stance.floor),
            (_, Some(floor)) => as_asked(height - floor, floor),
            (HeightRule::AboveGroundJoint, None) => as_asked(height - stance.floor, stance.floor),
            (HeightRule::AboveFloor, None) => {
                let Stance { floor, sole, height, .. } = stance;
                Self { value: height, floor, sole, stands, has_floor: stands }
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
