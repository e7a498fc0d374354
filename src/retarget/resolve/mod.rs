//! From a spec and two rigs to a mapping in indices, and to the spec with everything found out filled in.

pub(in crate::retarget) mod animal_legs;
pub(in crate::retarget) mod filled_in;
pub(in crate::retarget) mod helpers;
pub(in crate::retarget) mod limbs;
pub(in crate::retarget) mod notes;
pub(in crate::retarget) mod ops;
pub(in crate::retarget) mod pairs;

use crate::retarget::ops::resolved::ResolvedOps;
use glam::DVec3;

use crate::model::{Axes, Clip, Reporter, Transform};
use crate::retarget::ops::context::nothing_to_map;

use self::{
    filled_in::filled_in,
    helpers::follow_helpers,
    limbs::{have_driven_arms, have_driven_leg},
    notes::{check_kinds, report_cuts, report_idle_limbs, report_loose_joints, report_rigs},
    ops::resolve_ops,
    pairs::find_pairs,
};
use super::ops::{
    arm_clearance::need::need_room,
    curves::resolve::has_properties,
    fk::resolve::{order_chains, resolve_fk},
    pelvis::resolve::{resolve_pelvis, resolve_top},
};
use super::{
    cuts::Cuts,
    mapping::{ChainPair, Ground, Mapping},
    ops::{
        ArmClearanceOp, Carry, ContactsOp, CurvesOp, FkOp, FloorOp, HandContactOp, IkOp, Op, PelvisOp, PlantOp,
        fk::{shoulders::find_shoulders, twists::find_twists},
    },
    spec::{RetargetSpec, TranslationMode},
};
use crate::rig::{
    HelperJoints,
    alignment::{AlignedJoint, Alignment, align},
    anatomy::{loose_joints, rides},
    error::SpecError,
    leg_rows::{is_whole_leg, leg_rows},
    named_pair::NamedPair,
    rig::Rig,
};

/// What resolving gives.
#[derive(Clone, Debug)]
pub struct Resolved {
    /// What drives what.
    pub mapping: Mapping,
    /// What is done with the result of forward kinematics.
    pub ops: ResolvedOps,
    /// The spec with everything found out filled in; resolved again, it gives the same mapping.
    pub spec: RetargetSpec,
    /// How well the target's rest pose was turned to look like the source's, by joint.
    pub alignment: Vec<AlignedJoint>,
}

/// Resolves a spec against two rigs and the clip that is to be moved.
///
/// # Errors
/// When the spec names what does not exist, a chain is not connected, or nothing can be mapped.
pub fn resolve(
    spec: &RetargetSpec,
    source: &Rig<'_>,
    target: &Rig<'_>,
    clip: &Clip,
    reporter: &mut Reporter,
) -> Result<Resolved, SpecError> {
    check_kinds(spec, source, target)?;
    report_rigs(spec, source, target, reporter);
    let found = find_pairs(spec, source, target)?;
    let pairs = &found.pairs;
    let ops = spec.ops.clone().unwrap_or_else(|| default_ops(spec, source, target, pairs, clip));
    let Alignment { rest: aligned, joints: alignment } =
        align(source, target, &alignable(pairs, source, target), spec.align);
    let carried = is_carried(&ops);
    let canonical_from_plan =
        if carried { Axes::Z_UP_Y_FRONT.canonical_from_this() } else { target.canonical_from_scene };
    let plan_from_source = Transform {
        translation: DVec3::ZERO,
        rotation: (canonical_from_plan.conjugate() * source.canonical_from_scene).normalize(),
        scale: DVec3::splat(source.unit_meters / target.unit_meters),
    };
    let mut mapping = Mapping {
        source_rest: source.rest.clone(),
        target_hold: if carried { target.rest_local.clone() } else { target.skeleton().rest_pose() },
        target_rest: aligned,
        plan_from_source,
        plan_from_target: (canonical_from_plan.conjugate() * target.canonical_from_scene).normalize(),
        pelvis: None,
        chains: Vec::new(),
        rides: Vec::new(),
        twists: Vec::new(),
        shoulders: Vec::new(),
        global_scale: 1.0,
        ground: Ground::default(),
        limbs: Vec::new(),
    };
    let mut fields = Vec::new();
    let mut kinematics = Vec::new();
    for (index, op) in ops.iter().enumerate() {
        match op {
            Op::Pelvis(op) => match &found.tops {
                Some(tops) => resolve_top(op, tops, &mut mapping),
                None => resolve_pelvis(op, source, target, spec, clip, &mut mapping, reporter)?,
            },
            Op::Fk(op) => {
                let chains = resolve_fk(op, index, spec, pairs, source, target, &mut fields);
                kinematics.push((index, chains.clone()));
                mapping.chains.extend(chains);
            }
            _ => {}
        }
    }
    if let Some(error) = SpecError::from_fields(fields) {
        return Err(error);
    }
    if found.tops.is_some() {
        keep_slides(&mut mapping.chains, clip);
    }
    order_chains(&mut mapping.chains);
    let resolved = resolve_ops(&ops, &kinematics, [source, target], clip, &mut mapping, reporter)?;
    if mapping.pelvis.is_none() && mapping.chains.is_empty() {
        return Err(nothing_to_map(source, target));
    }
    if !carried {
        follow_bodies(&ops, source, target, clip, &mut mapping, reporter);
    }
    report_idle_limbs(spec, source, target, &mapping, reporter);
    if let Some(cuts) = Cuts::new(source.skeleton(), &mapping).filter(|_| resolved.work_in_parts()) {
        report_cuts(&cuts.find(clip), reporter);
    }
    let spec = filled_in(spec, source, target, &found, &mapping, ops);
    Ok(Resolved { mapping, ops: resolved, spec, alignment })
}

/// What a body does beside its chains: joints ride what carries them, twists are shared out, clavicles follow their arms.
fn follow_bodies(
    ops: &[Op],
    source: &Rig<'_>,
    target: &Rig<'_>,
    clip: &Clip,
    mapping: &mut Mapping,
    reporter: &mut Reporter,
) {
    // What the parents of chains that are carried along do is part of the chain.
    mapping.rides = rides(target);
    for op in ops {
        if let Op::Fk(op) = op
            && op.enabled
        {
            if op.twist {
                find_twists(source, target, clip, mapping);
            }
            mapping.shoulders = find_shoulders(source, target, mapping, op.shoulder);
        }
    }
    let loose = loose_joints(target, &mapping.driven(), &mapping.rides);
    report_loose_joints(target, &loose, reporter);
    mapping.rides.extend(loose);
}

/// The pairs whose rest poses are to look alike. Four-legged animals stand on both ends of their spine: one that is tipped to
/// another's slope has its front paws in the floor or in the air.
///
/// Creatures with other numbers of legs stand on them in other ways: each keeps its own.
fn alignable(pairs: &[NamedPair], source: &Rig<'_>, target: &Rig<'_>) -> Vec<NamedPair> {
    let stand_alike = leg_rows(source).len() == leg_rows(target).len();
    let is_other_leg = |pair: &NamedPair| !stand_alike && pair.role.as_deref().is_some_and(is_whole_leg);
    let is_tipped = |pair: &&NamedPair| target.stands_on_four() && pair.role.as_deref() == Some("spine");
    pairs.iter().filter(|pair| !is_tipped(pair) && !is_other_leg(pair)).cloned().collect()
}

/// What is no body has joints that slide, such as pistons and trolleys; where they do, their way counts.
fn keep_slides(chains: &mut [ChainPair], clip: &Clip) {
    for chain in chains {
        let slides = clip.joints()[chain.source[0]].translation.is_animated();
        if slides && chain.drive.translation == TranslationMode::None {
            chain.drive.translation = TranslationMode::GloballyScaled;
        }
    }
}

/// What is done when nobody says: rotations are copied, where legs are mapped, feet stay where they stand, and what is animated beside
/// the joints goes along. Helper joints follow last, when all others are where they stay.
fn default_ops(spec: &RetargetSpec, source: &Rig<'_>, target: &Rig<'_>, pairs: &[NamedPair], clip: &Clip) -> Vec<Op> {
    let mut ops = vec![Op::Pelvis(PelvisOp::default()), Op::Fk(FkOp::default())];
    let is_driven = |joint: usize| pairs.iter().any(|pair| pair.target.contains(&joint));
    if need_room(source, target) {
        ops.push(Op::ArmClearance(ArmClearanceOp::default()));
    }
    if have_driven_leg(source, target, is_driven) {
        ops.extend([
            Op::Contacts(ContactsOp::default()),
            Op::Ik(IkOp::default()),
            Op::Plant(PlantOp::default()),
            Op::Floor(FloorOp::default()),
        ]);
    }
    if have_driven_arms(source, target, is_driven) {
        ops.push(Op::HandContact(HandContactOp::default()));
    }
    if spec.target.helper_joints == HelperJoints::Follow {
        ops.extend(follow_helpers(target));
    }
    if has_properties(source.scene, clip) {
        ops.push(Op::Curves(CurvesOp::default()));
    }
    ops
}

/// Whether chains are carried along by their parents, as ikrigretarget does it. Idle joints then keep the rest pose, as in that
/// program, and not their node transform.
fn is_carried(ops: &[Op]) -> bool {
    ops.iter().any(|op| matches!(op, Op::Fk(op) if op.enabled && op.carry == Carry::Parent))
}
