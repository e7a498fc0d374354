//! What a retarget would do, without doing it: the resolved spec, how sure each role is on both sides, and what each target
//! joint would be driven by.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use crate::{
    drawing::{is_draw_document, parse_draw_value},
    model::{Clip, Control, JointTracks, Phase, Reporter},
    retarget::{
        JointDriver, Mapping, Resolved, ResolvedOps, RetargetSpec, RotationMode, TranslationMode, joint_drivers,
        parse_document, resolve,
    },
    rig::{RigSpec, Role, RoleFinding},
};

use super::{
    Failure, FailureCode, Inputs, Knowledge, Limits, NamedBytes, Rigs, WarningView,
    alignment::{AlignmentView, view as view_alignment},
    edit::edited_clip,
    facts::{RigFacts, joint_count},
    files::{Files, RigPair, in_config, read_spec},
    labels::{Labels, OneOrMore},
    output_request::output_requests,
};

/// What a retarget would do.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Proposal {
    /// The spec with everything found out filled in: to be edited and sent as the config. Sent as it is, it gives what the
    /// config that was checked gives.
    pub resolved_spec: serde_json::Value,
    /// What was found out about the two rigs.
    pub rigs: Rigs,
    /// How much of the target would move.
    pub counts: ProposalCounts,
    /// The roles of both sides, in the order of the body.
    pub roles: Vec<RolePair>,
    /// What drives each joint of the target, parents before children.
    pub joints: Vec<DriverView>,
    /// How the target's rest pose would be turned to look like the source's, and what is left, by joint.
    pub alignment: Vec<AlignmentView>,
    /// Guesses, repairs and losses.
    pub warnings: Vec<WarningView>,
}

/// How much of the target would move.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct ProposalCounts {
    /// Joints of the source.
    pub source_joints: usize,
    /// Joints of the target.
    pub target_joints: usize,
    /// Target joints that something drives.
    pub driven_joints: usize,
    /// Roles that both sides have.
    pub roles_on_both_sides: usize,
}

/// A role, and who has it.
#[derive(Clone, Debug, Serialize)]
pub struct RolePair {
    /// Its name.
    pub role: String,
    /// Joints of the source; nothing where it has no such role.
    pub source: Option<OneOrMore>,
    /// Joints of the target.
    pub target: Option<OneOrMore>,
    /// How sure both sides together are, 0 to 1: that of the less sure side. Nothing where one side lacks the role.
    pub confidence: Option<f64>,
    /// What speaks for the source's joints, and what else they could be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source_details: Option<RoleDoubts>,
    /// The same for the target's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_details: Option<RoleDoubts>,
}

/// How sure a role is on one side, and why.
#[derive(Clone, Debug, Serialize)]
pub struct RoleDoubts {
    /// From 0 to 1; 1 where the config says it.
    pub confidence: f64,
    /// Other joints that could have been meant.
    pub alternatives: Vec<OneOrMore>,
    /// Why these joints.
    pub reasons: Vec<String>,
}

/// What drives a joint of the target.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct DriverView {
    /// The joint's name, or `#<node index>`.
    pub joint: String,
    /// Its node's index in the file.
    pub node: usize,
    /// `pelvis`; `chain`; `twist` where it takes a share of a limb's twist; `shoulder` where a clavicle lifts with its arm; `ride`
    /// where a joint of the body carries it; nothing where it only follows its parent.
    pub driver: Option<&'static str>,
    /// The role or chain that it belongs to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chain: Option<String>,
    /// The source joints that it follows, and how much each counts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<SourceShare>,
    /// How its rotation is found, where a chain drives it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation: Option<RotationMode>,
    /// How its translation is found, where a chain drives it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub translation: Option<TranslationMode>,
    /// Ops behind forward kinematics that may turn or move it too, in their order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ops: Vec<&'static str>,
    /// One sentence: why this driver, or why none.
    pub reason: String,
}

/// A source joint, and how much it counts.
#[derive(Clone, Debug, Serialize)]
pub struct SourceShare {
    /// Its name, or `#<node index>`.
    pub joint: String,
    /// 0 to 1; those of one target joint add up to 1.
    pub weight: f64,
}

/// Reads a config by itself and gives it back as it is understood, defaults and all.
///
/// # Errors
/// When it is no config, names fields that do not exist, or has values that cannot be used.
pub fn check_config(config: NamedBytes<'_>) -> Result<serde_json::Value, Failure> {
    if let Some(document) = parse_document(config.bytes).ok().filter(is_draw_document) {
        return to_json(&parse_draw_value(document).map_err(in_config)?);
    }
    let spec = read_spec(Some(config))?;
    output_requests(&spec, &[])?;
    to_json(&spec)
}

/// Says what [`super::retarget_with`] would do with the same inputs. Source files need no animation for it.
///
/// # Errors
/// As [`super::retarget_with`], but for what concerns frames.
pub fn propose(
    inputs: &Inputs<'_>,
    knowledge: &Knowledge,
    limits: &Limits,
    control: &Control,
) -> Result<Proposal, Failure> {
    let mut reporter = Reporter::new();
    control.enter(Phase::Read, 0);
    let spec = read_spec(inputs.config)?;
    output_requests(&spec, inputs.formats)?;
    let files = Files::load(inputs, false, knowledge, (limits, control), &mut reporter)?;
    control.enter(Phase::Plan, 0);
    let RigPair { spec, source, target } = files.sides(spec, knowledge, &mut reporter)?;
    let still;
    let clip = match files.choose_clip(&spec, &mut reporter) {
        Ok(clip) => clip,
        Err(failure) if failure.code == FailureCode::NoAnimation => {
            reporter.warn("no_animation", "source", failure.detail, failure.hint);
            still = still_clip(source.skeleton().len())?;
            &still
        }
        Err(failure) => return Err(failure),
    };
    let edited = edited_clip(&source, clip, &spec, control, &mut reporter)?;
    let clip = edited.as_ref();
    let Resolved { mapping, ops, spec: resolved, alignment } =
        resolve(&spec, &source, &target, clip, &mut reporter).map_err(in_config)?;
    let labels = (Labels::new(source.scene), Labels::new(target.scene));
    let roles = role_pairs(
        &Side { roles: &source.roles, found: &source.recognition.roles, spec: &spec.source, labels: &labels.0 },
        &Side { roles: &target.roles, found: &target.recognition.roles, spec: &spec.target, labels: &labels.1 },
    );
    let drivers = joint_drivers(source.skeleton(), target.skeleton(), &mapping);
    let role_of: BTreeMap<usize, &str> = target
        .roles
        .iter()
        .flat_map(|(role, joints)| joints.iter().map(move |joint| (*joint, role.as_str())))
        .collect();
    let helpers: BTreeSet<usize> = target.recognition.twist_helpers.iter().copied().collect();
    let view = |(joint, driver): (usize, &JointDriver)| {
        let own = &target.skeleton().joints()[joint];
        let described = describe(driver, &mapping, &labels.0, &labels.1);
        let ride = mapping.rides.iter().find(|ride| ride.joint == joint).map(|ride| labels.1.of(ride.on));
        if let (JointDriver::Nothing, Some(on)) = (driver, ride) {
            let reason = format!("it hangs elsewhere in the file, and is carried by '{on}' as on a body");
            let carried = DriverView { driver: Some("ride"), ..DriverView::none(reason) };
            return DriverView { joint: labels.1.of(joint), node: own.node, ..carried };
        }
        let idle = || idle_reason(role_of.get(&joint).copied(), helpers.contains(&joint), own.is_joint, &spec);
        DriverView {
            joint: labels.1.of(joint),
            node: own.node,
            ..described.unwrap_or_else(|| DriverView::none(idle()))
        }
    };
    let mut joints: Vec<DriverView> = drivers.iter().enumerate().map(view).collect();
    add_ops(&mut joints, &mapping, &ops);
    let counts = ProposalCounts {
        source_joints: joint_count(source.scene),
        target_joints: joint_count(target.scene),
        driven_joints: joints.iter().filter(|joint| joint.driver.is_some()).count(),
        roles_on_both_sides: roles.iter().filter(|pair| pair.confidence.is_some()).count(),
    };
    Ok(Proposal {
        resolved_spec: to_json(&resolved)?,
        rigs: Rigs {
            source: RigFacts::of(&source, files.source.format),
            target: RigFacts::of(&target, files.target.format),
        },
        counts,
        roles,
        joints,
        alignment: view_alignment(&alignment, target.skeleton()),
        warnings: reporter.into_warnings().into_iter().map(WarningView::from).collect(),
    })
}

/// Says of each joint which ops behind forward kinematics may change it.
fn add_ops(joints: &mut [DriverView], mapping: &Mapping, ops: &ResolvedOps) {
    for op in &ops.ops {
        for joint in op.changed(mapping) {
            if let Some(view) = joints.get_mut(joint)
                && !view.ops.contains(&op.name())
            {
                view.ops.push(op.name());
            }
        }
    }
}

fn to_json(spec: &impl Serialize) -> Result<serde_json::Value, Failure> {
    serde_json::to_value(spec)
        .map_err(|error| Failure::new(FailureCode::Internal, format!("the spec cannot be written: {error}")))
}

/// One frame in which every joint is at rest: what a source without animation is resolved against.
fn still_clip(joints: usize) -> Result<Clip, Failure> {
    Clip::new(String::new(), vec![0.0], vec![JointTracks::default(); joints])
        .map_err(|error| Failure::new(FailureCode::Internal, error.to_string()))
}

struct Side<'a> {
    roles: &'a BTreeMap<String, Vec<usize>>,
    found: &'a BTreeMap<Role, RoleFinding>,
    spec: &'a RigSpec,
    labels: &'a Labels<'a>,
}

impl Side<'_> {
    fn joints(&self, role: &str) -> Option<OneOrMore> {
        self.roles.get(role).map(|joints| self.labels.one_or_more(joints))
    }

    fn details(&self, role: Role, name: &str) -> Option<RoleDoubts> {
        let joints = self.roles.get(name)?;
        let is_given = self.spec.roles.contains_key(name) || (name == "pelvis" && self.spec.root.is_some());
        match self.found.get(&role) {
            Some(finding) if !is_given || finding.joints == *joints => Some(RoleDoubts {
                confidence: if is_given { 1.0 } else { hundredths(finding.confidence) },
                alternatives: finding.alternatives.iter().map(|joints| self.labels.one_or_more(joints)).collect(),
                reasons: finding.reasons.clone(),
            }),
            _ => Some(RoleDoubts {
                confidence: 1.0,
                alternatives: Vec::new(),
                reasons: vec!["the config says so".to_owned()],
            }),
        }
    }
}

fn role_pairs(source: &Side<'_>, target: &Side<'_>) -> Vec<RolePair> {
    let mut pairs = Vec::new();
    let names = source.roles.keys().chain(target.roles.keys());
    let roles: BTreeSet<Role> = names.filter_map(|role| role.parse().ok()).collect();
    let mut roles: Vec<Role> = roles.into_iter().collect();
    roles.sort_by_key(|role| (role.part, role.number, role.side));
    for role in roles {
        let name = role.to_string();
        let (source_joints, target_joints) = (source.joints(&name), target.joints(&name));
        let (source_details, target_details) = (source.details(role, &name), target.details(role, &name));
        let both = source_details.as_ref().zip(target_details.as_ref());
        let confidence = both.map(|(source, target)| source.confidence.min(target.confidence));
        let (source, target) = (source_joints, target_joints);
        pairs.push(RolePair { role: name, source, target, confidence, source_details, target_details });
    }
    pairs
}

impl DriverView {
    fn none(reason: String) -> Self {
        let (joint, sources) = (String::new(), Vec::new());
        Self {
            joint,
            node: 0,
            driver: None,
            chain: None,
            sources,
            rotation: None,
            translation: None,
            ops: Vec::new(),
            reason,
        }
    }
}

/// All but the joint itself; nothing where nothing concerns the joint.
fn describe(driver: &JointDriver, mapping: &Mapping, labels: &Labels<'_>, ours: &Labels<'_>) -> Option<DriverView> {
    let share = |(joint, weight): (usize, f64)| SourceShare { joint: labels.of(joint), weight: hundredths(weight) };
    match driver {
        JointDriver::Nothing => None,
        JointDriver::Pelvis { source } => Some(DriverView {
            driver: Some("pelvis"),
            sources: vec![share((*source, 1.0))],
            ..DriverView::none("the pelvis op moves and turns it".to_owned())
        }),
        JointDriver::Chain { chain, sources } => {
            let pair = &mapping.chains[*chain];
            let (theirs, ours) = (pair.source.len(), pair.target.len());
            let rotation = match pair.drive.rotation {
                RotationMode::Auto if theirs == ours => RotationMode::OneToOne,
                RotationMode::Auto => RotationMode::Interpolated,
                mode => mode,
            };
            let count = |joints: usize| if joints == 1 { "one joint".to_owned() } else { format!("{joints} joints") };
            let how = match rotation {
                RotationMode::Interpolated => "at equal places along the chain",
                RotationMode::OneToOneReversed => "joint by joint from the end",
                _ => "joint by joint",
            };
            let reason = format!("'{}': {} of the source onto {}, {how}", pair.name, count(theirs), count(ours));
            Some(DriverView {
                driver: Some("chain"),
                chain: Some(pair.name.clone()),
                sources: sources.iter().map(|source| share(*source)).filter(|share| share.weight > 0.0).collect(),
                rotation: Some(rotation),
                translation: Some(pair.drive.translation),
                ..DriverView::none(reason)
            })
        }
        JointDriver::Twist { segment, share: part, chain, sources } => {
            let percent = part * 100.0;
            let reason = format!("it takes {percent:.0} % of the twist of the limb at '{}'", ours.of(*segment));
            Some(DriverView {
                driver: Some("twist"),
                chain: chain.map(|chain| mapping.chains[chain].name.clone()),
                sources: sources.iter().map(|source| share(*source)).filter(|share| share.weight > 0.0).collect(),
                ..DriverView::none(reason)
            })
        }
        JointDriver::Shoulder { upper_arm } => {
            let reason =
                format!("it lifts as '{}' is raised, since the source has no joint for it", ours.of(*upper_arm));
            Some(DriverView { driver: Some("shoulder"), ..DriverView::none(reason) })
        }
        JointDriver::Surplus { chain } => {
            let pair = &mapping.chains[*chain];
            let reason = match pair.drive.rotation {
                RotationMode::None => format!("chain '{}' has rotation 'none', so it stays at rest", pair.name),
                _ => format!(
                    "chain '{}' has more joints here than in the source ({} against {}); this one stays at rest",
                    pair.name,
                    pair.target.len(),
                    pair.source.len()
                ),
            };
            Some(DriverView { chain: Some(pair.name.clone()), ..DriverView::none(reason) })
        }
    }
}

fn idle_reason(role: Option<&str>, is_helper: bool, is_joint: bool, spec: &RetargetSpec) -> String {
    let is_explicit = spec.map.is_some() || spec.ops.is_some();
    match role {
        Some("root") => "it is the root above the pelvis, which stays where it is".to_owned(),
        Some(role) if is_explicit => format!("it is '{role}', which the config's 'map' and 'ops' leave out"),
        Some(role) => format!("it is '{role}', which the source does not have"),
        None if is_helper => "it carries part of a limb's twist and follows its parent".to_owned(),
        None if !is_joint => "it is a node but not a joint".to_owned(),
        None => "it has no role, and no joint of the source has its name".to_owned(),
    }
}

fn hundredths(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}
