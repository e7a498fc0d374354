//! Why a joint of the result is turned as it is at one frame: the chain of contributions, from the target's own rest pose to what
//! came out.
//!
//! Every contribution is a rotation in the target's model space that turns what the ones before it gave, so that the product of all
//! (the last on the left) is the joint's rotation in the result. Forward kinematics is explained from the compiled plan; every op
//! behind it by what it changes when it is added.

use glam::{DQuat, DVec3};
use serde::Serialize;

use crate::{
    formats::Limits,
    model::{Control, ModelPose, Phase, Reporter, Transform, rotation::degrees},
    retarget::{DriverKind, JointExplanation, Mapping, Op, Plan, RetargetSpec, explain_joint},
    rig::{Rig, SpecErrorKind, SpecField},
};

use super::{
    Failure, Inputs, Knowledge,
    edit::edited_clip,
    files::{Files, RigPair, in_config, one_field, read_spec},
    retarget_run::RetargetRun,
    tune,
};

/// Less than this, in degrees, is the rounding of tracks.
const ROUNDING_DEGREES: f64 = 1e-4;

/// Which joint at which frame.
#[derive(Clone, Copy, Debug)]
pub struct Question<'a> {
    /// Frame of the result, from 0.
    pub frame: usize,
    /// Joint of the target, by name or `#<node index>`.
    pub joint: &'a str,
}

/// Why a joint is turned as it is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// Frame of the result, from 0.
    pub frame: usize,
    /// Its key time.
    pub time_seconds: f64,
    /// The joint of the target.
    pub joint: String,
    /// What it means.
    pub roles: Vec<String>,
    /// `pelvis`, `chain`, `carried_chain`, `twist`, `shoulder` or `rides_parent`.
    pub driver: &'static str,
    /// The chain that drives it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chain: Option<String>,
    /// What it follows, with shares.
    pub sources: Vec<SourceView>,
    /// From the rest pose to the result; each turns what the ones before it gave.
    pub contributions: Vec<Contribution>,
    /// How the pelvis' position is found; only for the pelvis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<PelvisView>,
    /// What came out.
    pub result: JointState,
}

/// A source joint that is followed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SourceView {
    /// The joint.
    pub joint: String,
    /// Its share, 0 to 1.
    pub share: f64,
    /// Its rotation at rest, in the source's model space, `x y z w`.
    pub rest_rotation: [f64; 4],
    /// Its rotation at the frame, likewise.
    pub rotation: [f64; 4],
    /// The angle between the two.
    pub turned_degrees: f64,
}

/// One step from the rest pose to the result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contribution {
    /// `rest`, `alignment`, `delta`, `carry`, `chain_direction`, `twist_share`, `shoulder_lift`, `alpha`, `parent`, or the op.
    pub name: String,
    /// What it is.
    pub about: &'static str,
    /// The rotation, in the target's model space, `x y z w`.
    pub rotation: [f64; 4],
    /// Its angle.
    pub degrees: f64,
    /// How far the op moves the joint, meters; only for ops behind forward kinematics.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moved_meters: Option<f64>,
}

/// `result = target_origin + scale ∘ (source − source_origin)`, along right, up and front of the target, in meters; `alpha` goes
/// there from the rest position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PelvisView {
    /// Where the source's pelvis is.
    pub source: [f64; 3],
    /// The point of the source that is scaled about.
    pub source_origin: [f64; 3],
    /// Factors.
    pub scale: [f64; 3],
    /// Where that point goes.
    pub target_origin: [f64; 3],
    /// 1 takes all of it.
    pub alpha: f64,
    /// What the formula gives.
    pub result: [f64; 3],
}

/// A joint of the result, in the target file's own axes and unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct JointState {
    /// In model space, `x y z w`.
    pub rotation: [f64; 4],
    /// In model space.
    pub translation: [f64; 3],
    /// Below the parent, `x y z w`.
    pub local_rotation: [f64; 4],
    /// Below the parent.
    pub local_translation: [f64; 3],
}

/// Explains one joint at one frame of what a retarget of these inputs gives, with what is known of rigs beside what the program comes with.
///
/// # Errors
/// As a retarget; and when the frame or the joint does not exist.
pub fn explain(
    inputs: &Inputs<'_>,
    question: &Question<'_>,
    knowledge: &Knowledge,
    limits: &Limits,
    control: &Control,
) -> Result<Explanation, Failure> {
    let mut reporter = Reporter::new();
    control.enter(Phase::Read, 0);
    let spec = read_spec(inputs.config)?;
    let files = Files::load(inputs, false, knowledge, (limits, control), &mut reporter)?;
    control.enter(Phase::Plan, 0);
    let RigPair { spec, source, target } = files.sides(spec, knowledge, &mut reporter)?;
    let clip = files.choose_clip(&spec, &mut reporter)?;
    let edited = edited_clip(&source, clip, &spec, control, &mut reporter)?;
    let clip = edited.as_ref();
    let asked = |field: SpecField| Failure { part: "", ..in_config(one_field(field)) };
    let joint = target.joint(question.joint, "/joint").map_err(asked)?;
    if question.frame >= clip.frame_count() {
        let detail = format!("frame {} is past the clip's {} frames", question.frame, clip.frame_count());
        let hint = format!("frames are from 0 to {}", clip.frame_count() - 1);
        return Err(asked(SpecField::new(SpecErrorKind::InvalidValue, "/frame", detail)).with_hint(hint));
    }
    let subject = tune::TuningProblem { source: &source, target: &target, clip, control };
    let (spec, _) = subject.settle(spec)?;
    control.enter(Phase::Retarget, 0);
    let run = |spec: &RetargetSpec| RetargetRun::run(spec, &source, &target, clip, control, &mut Reporter::new());
    let pass = run(&spec)?;
    let ops = pass.resolved.ops.clone().unwrap_or_default();
    let (kinematics, later): (Vec<&Op>, Vec<&Op>) = ops.iter().partition(|op| is_kinematics(op));
    let up_to = |count: usize| {
        let ops = kinematics.iter().chain(&later[..count]).map(|op| (*op).clone()).collect();
        RetargetSpec { ops: Some(ops), ..spec.clone() }
    };
    let pose_of =
        |pass: &RetargetRun| pass.result.local_pose(target.skeleton(), question.frame).to_model(target.skeleton());
    let before = if later.is_empty() { None } else { Some(run(&up_to(0))?) };
    let first = before.as_ref().unwrap_or(&pass);
    let turned = pose_of(first);
    let at = (question.frame, joint);
    let skeletons = (source.skeleton(), target.skeleton());
    let plan = Plan::new(source.skeleton(), target.skeleton(), &first.mapping);
    let explained = explain_joint(&plan, &first.mapping, skeletons, clip, at, &turned);
    let mut contributions = kinematic_contributions(&target, joint, explained.as_ref(), &turned);
    let mut last = turned;
    for (count, op) in later.iter().enumerate() {
        let pose = if count + 1 == later.len() { pose_of(&pass) } else { pose_of(&run(&up_to(count + 1))?) };
        let (from, to) = (last.transforms()[joint], pose.transforms()[joint]);
        let moved = from.translation.distance(to.translation) * target.unit_meters;
        let step = contribution(op_name(op), "what this op changes", to.rotation * from.rotation.conjugate());
        contributions.push(Contribution { moved_meters: Some(moved), ..step });
        last = pose;
    }
    let model = last.transforms()[joint];
    let local = target.skeleton().parent(joint).map_or(model, |parent| last.transforms()[parent].relative(&model));
    let roles = target.roles.iter().filter(|(_, joints)| joints.contains(&joint));
    let chain = first.mapping.chains.iter().rev().find(|chain| chain.target.contains(&joint));
    let is_pelvis = first.mapping.pelvis.is_some_and(|pelvis| pelvis.target == joint);
    let source_pose = clip.local_pose(source.skeleton(), question.frame).to_model(source.skeleton());
    Ok(Explanation {
        frame: question.frame,
        time_seconds: pass.result.times_seconds()[question.frame],
        joint: target.skeleton().label(joint),
        roles: roles.map(|(role, _)| role.clone()).collect(),
        driver: driver_name(explained.as_ref()),
        chain: chain.filter(|_| !is_pelvis).map(|chain| chain.name.clone()),
        sources: explained.iter().flat_map(|explained| sources(&source, explained, &source_pose)).collect(),
        contributions,
        position: is_pelvis.then(|| pelvis_position(&first.mapping, &target, &source_pose)).flatten(),
        result: JointState {
            rotation: model.rotation.into(),
            translation: model.translation.into(),
            local_rotation: local.rotation.into(),
            local_translation: local.translation.into(),
        },
    })
}

/// What the plan computes in one go, frame by frame.
const fn is_kinematics(op: &Op) -> bool {
    matches!(op, Op::Pelvis(_) | Op::Fk(_))
}

fn op_name(op: &Op) -> String {
    let value = serde_json::to_value(op).unwrap_or_default();
    value["op"].as_str().unwrap_or("op").to_owned()
}

fn driver_name(explained: Option<&JointExplanation>) -> &'static str {
    match explained.map(|explained| explained.kind) {
        None => "rides_parent",
        Some(DriverKind::Pelvis) => "pelvis",
        Some(DriverKind::Model) => "chain",
        Some(DriverKind::Carried) => "carried_chain",
        Some(DriverKind::Twist) => "twist",
        Some(DriverKind::Shoulder) => "shoulder",
    }
}

fn kinematic_contributions(
    target: &Rig<'_>,
    joint: usize,
    explained: Option<&JointExplanation>,
    turned: &ModelPose,
) -> Vec<Contribution> {
    let rest = target.rest.transforms()[joint].rotation;
    let actual = turned.transforms()[joint].rotation;
    let mut found = vec![contribution("rest".into(), "the target's own rest pose", rest)];
    let Some(explained) = explained else {
        let ridden = actual * rest.conjugate();
        found.push(contribution("parent".into(), "nothing drives the joint: it rides its parent", ridden));
        return found;
    };
    let alignment = explained.aligned_rest * rest.conjugate();
    found.push(contribution("alignment".into(), "the rest pose turned to look like the source's", alignment));
    let about = "what the source has turned since its rest pose";
    found.push(contribution("delta".into(), about, explained.delta));
    let mut product = explained.delta * explained.aligned_rest;
    if let Some(carry) = explained.carry {
        let about = "how the target's parent is turned against the source's";
        found.push(contribution("carry".into(), about, carry));
        product = carry * product;
    }
    let left = actual * product.conjugate();
    let is_whole = (explained.alpha - 1.0).abs() < f64::EPSILON;
    let (name, about) = match (explained.kind, explained.turns_further) {
        _ if !is_whole => ("alpha", "less or more than all of it is taken, from the rest rotation below the parent"),
        (DriverKind::Twist, _) => ("twist_share", "it turns with its limb and takes a share of the limb's twist"),
        (DriverKind::Shoulder, _) => ("shoulder_lift", "it rides its parent and lifts with the arm"),
        (_, true) => ("chain_direction", "the chain as a whole is made to point as the source's does"),
        (_, false) => ("rounding", "numbers of tracks have seven digits"),
    };
    let step = contribution(name.into(), about, left);
    if !is_whole || explained.turns_further || step.degrees > ROUNDING_DEGREES {
        found.push(step);
    }
    found
}

fn contribution(name: String, about: &'static str, rotation: DQuat) -> Contribution {
    let rotation = if rotation.w < 0.0 { -rotation } else { rotation };
    Contribution { name, about, rotation: rotation.into(), degrees: degrees(rotation), moved_meters: None }
}

fn sources(source: &Rig<'_>, explained: &JointExplanation, pose: &ModelPose) -> Vec<SourceView> {
    let view = |&(joint, share): &(usize, f64)| {
        let (rest, now) = (source.rest.transforms()[joint].rotation, pose.transforms()[joint].rotation);
        SourceView {
            joint: source.skeleton().label(joint),
            share,
            rest_rotation: rest.into(),
            rotation: now.into(),
            turned_degrees: degrees(now * rest.conjugate()),
        }
    };
    explained.sources.iter().map(view).collect()
}

fn pelvis_position(mapping: &Mapping, target: &Rig<'_>, source_pose: &ModelPose) -> Option<PelvisView> {
    let pelvis = mapping.pelvis?;
    let position = pelvis.position;
    let in_meters = |point: DVec3| position.canonical_from_plan * point * target.unit_meters;
    let Transform { translation, .. } = mapping.plan_from_source.then_child(&source_pose.transforms()[pelvis.source]);
    let (source, source_origin) = (in_meters(translation), in_meters(position.source_origin));
    let target_origin = in_meters(position.target_origin);
    Some(PelvisView {
        source: source.into(),
        source_origin: source_origin.into(),
        scale: position.scale.into(),
        target_origin: target_origin.into(),
        alpha: pelvis.translation_alpha,
        result: (target_origin + position.scale * (source - source_origin)).into(),
    })
}
