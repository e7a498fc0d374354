//! What a file holds, as users see it: the data. How it reads on a terminal is in [`crate::report`].

use std::collections::BTreeSet;

use glam::DVec3;
use serde::Serialize;

use crate::{
    engine::{
        Failure, Knowledge, NamedBytes, WarningView,
        facts::joint_count,
        files::load,
        flat::{DrawingFacts, LookedAt, look_at},
        labels::{ByRole, Labels, OneOrMore},
    },
    formats::{Format, Limits},
    model::{Clip, Control, JointTracks, Reporter, Scene, SignedAxis},
    rig::{
        FileFacts, Finding, Hints, Prop, RestPoseKind, RestSource, Rig, RigSpec, RigTemplate, Role, Side as RigSide,
        TwistHelper, examine, examine_clips, recognize, report_doubts,
    },
};

/// What a file holds.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Inspection {
    /// Wire name of the format.
    pub format: &'static str,
    /// How much there is.
    pub counts: InspectionCounts,
    /// What a drawing holds beside its joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drawing: Option<DrawingFacts>,
    /// The largest body; empty where there is no skeleton.
    pub rigs: Vec<RigView>,
    /// The animations, in the file's order.
    pub clips: Vec<ClipView>,
    /// What is wrong, odd or worth knowing about the rig and the clips, the worst first.
    pub findings: Vec<FindingView>,
    /// Guesses, repairs and losses.
    pub warnings: Vec<WarningView>,
}

/// Something about a file that its owner should know.
#[derive(Clone, Debug, Serialize)]
pub struct FindingView {
    /// Stable code.
    pub code: &'static str,
    /// `error`, `warning` or `note`.
    pub severity: &'static str,
    /// The joint, clip or skin that it was seen at first; empty where it is about the whole file.
    pub place: String,
    /// What was seen.
    pub detail: String,
    /// What to do about it.
    pub fix: &'static str,
}

impl From<Finding> for FindingView {
    fn from(finding: Finding) -> Self {
        let Finding { code, place, detail } = finding;
        Self { code: code.name(), severity: code.severity().name(), place, detail, fix: code.fix() }
    }
}

/// How much a file holds.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct InspectionCounts {
    /// Nodes of the scene.
    pub nodes: usize,
    /// glTF: distinct joints of all skins. Elsewhere: nodes that the file calls joints.
    pub joints: usize,
    /// Sets of joints that deform a mesh.
    pub skins: usize,
    /// Animations.
    pub clips: usize,
}

/// What a skeleton means.
#[derive(Clone, Debug, Serialize)]
pub struct RigView {
    /// The name of its top node.
    pub name: String,
    /// The naming convention, where it is one with a name.
    pub recognised_as: Option<String>,
    /// From 0 to 1.
    pub confidence: f64,
    /// `biped`, `quadruped` or `other`.
    pub kind: &'static str,
    /// `T`, `A`, `arms_down` or `other`.
    pub rest_pose: &'static str,
    /// The same of the pose that retargeting measures from, which is another where the file's own is no body that stands.
    pub measured_pose: &'static str,
    /// Where the rest pose comes from: `bind`, `nodes`, `standing_frame` or `solved`.
    pub rest_source: &'static str,
    /// Why it is taken from there.
    pub rest_reason: String,
    /// The axis that the body faces, such as `+z`.
    pub forward: Option<&'static str>,
    /// The axis that is up, such as `+y`.
    pub up: Option<&'static str>,
    /// From the lowest to the highest joint of the body, where the unit is known or could be guessed.
    pub height_meters: f64,
    /// All joints, parents before children.
    pub joints: Vec<JointView>,
    /// Joints by role: one name, or names from the body outward.
    pub roles: ByRole<OneOrMore>,
    /// How sure each role is, and why.
    pub role_details: ByRole<RoleView>,
    /// Joints that carry part of a limb's twist.
    pub twist_helpers: Vec<String>,
    /// The same, with the segment that each belongs to.
    pub twists: Vec<TwistView>,
    /// What the hands hold.
    pub props: Vec<PropView>,
    /// A rig template by which this rig is recognized for sure, to be looked at, corrected and kept; nothing for what is no body,
    /// or has no names.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub template: Option<RigTemplate>,
}

/// A joint beside a limb that carries part of its twist.
#[derive(Clone, Debug, Serialize)]
pub struct TwistView {
    /// Its name.
    pub joint: String,
    /// The segment: an upper arm, forearm, thigh or shin.
    pub role: String,
    /// Where it lies on that segment: 0 at the segment's own joint, 1 at the next.
    pub fraction: f64,
}

/// A joint that a hand holds.
#[derive(Clone, Debug, Serialize)]
pub struct PropView {
    /// Its name.
    pub joint: String,
    /// `left` or `right`.
    pub side: &'static str,
}

/// A joint.
#[derive(Clone, Debug, Serialize)]
pub struct JointView {
    /// Its name, or `#<node index>` where it has none of its own.
    pub name: String,
    /// Its node's index in the file.
    pub node: usize,
    /// The node index of the joint that it hangs from.
    pub parent: Option<usize>,
}

/// How sure a role is.
#[derive(Clone, Debug, Serialize)]
pub struct RoleView {
    /// From 0 to 1.
    pub confidence: f64,
    /// Other joints that could have been meant.
    pub alternatives: Vec<OneOrMore>,
    /// Why these joints.
    pub reasons: Vec<String>,
}

/// An animation.
#[derive(Clone, Debug, Serialize)]
pub struct ClipView {
    /// Its name; may be empty.
    pub name: String,
    /// Key times.
    pub frames: usize,
    /// Frames per second; nothing where keys are uneven.
    pub fps: Option<f64>,
    /// Last key time minus first.
    pub duration_seconds: f64,
    /// Joints with an animated channel.
    pub animated_joints: usize,
}

/// Reads a file and says what it holds.
///
/// # Errors
/// When the file cannot be read.
pub fn inspect(file: NamedBytes<'_>, limits: &Limits, control: &Control) -> Result<Inspection, Failure> {
    inspect_with(file, &Knowledge::default(), limits, control)
}

/// The same, with what is known of rigs beside what the program comes with.
///
/// # Errors
/// As [`inspect`].
pub fn inspect_with(
    file: NamedBytes<'_>,
    knowledge: &Knowledge,
    limits: &Limits,
    control: &Control,
) -> Result<Inspection, Failure> {
    if let Some(drawing) = look_at(file, limits, control)? {
        return Ok(inspect_drawing(drawing));
    }
    let mut reporter = Reporter::new();
    let loaded = load(file, "source", limits, control, &mut reporter)?;
    let scene = &loaded.scene;
    let read_warnings = reporter.warnings().to_vec();
    let joints = count_joints(scene, loaded.format);
    let counts =
        InspectionCounts { nodes: scene.skeleton.len(), joints, skins: scene.skins.len(), clips: scene.clips.len() };
    let (rigs, findings) = match read_rig(scene, knowledge, &mut reporter)? {
        Some(rig) => {
            let facts = FileFacts { can_have_skins: loaded.format.info().has_skins, warnings: &read_warnings };
            report_doubts(&scene.skeleton, &rig.recognition, &mut reporter, "source");
            (vec![inspect_rig(&rig, knowledge)], examine(&rig, facts))
        }
        None => (Vec::new(), examine_clips(scene)),
    };
    Ok(Inspection {
        format: loaded.format.info().name,
        counts,
        drawing: None,
        rigs,
        clips: scene.clips.iter().map(inspect_clip).collect(),
        findings: findings.into_iter().map(FindingView::from).collect(),
        warnings: reporter.into_warnings().into_iter().map(WarningView::from).collect(),
    })
}

/// What a drawing holds: joints that rest as they are drawn.
fn inspect_drawing(drawing: LookedAt) -> Inspection {
    let LookedAt { rig, facts, confidence, warnings } = drawing;
    let joints = rig.joint_names.into_iter().zip(rig.parents).enumerate();
    let joints: Vec<JointView> = joints.map(|(node, (name, parent))| JointView { name, node, parent }).collect();
    let count = joints.len();
    let rig = RigView {
        name: "drawing".to_owned(),
        recognised_as: None,
        confidence,
        kind: "drawing",
        rest_pose: "other",
        measured_pose: "other",
        rest_source: "nodes",
        rest_reason: "a drawing rests as it is drawn".to_owned(),
        forward: None,
        up: None,
        height_meters: 0.0,
        joints,
        roles: ByRole(Vec::new()),
        role_details: ByRole(Vec::new()),
        twist_helpers: Vec::new(),
        twists: Vec::new(),
        props: Vec::new(),
        template: None,
    };
    Inspection {
        format: Format::Drawing.info().name,
        counts: InspectionCounts { nodes: count, joints: count, skins: 0, clips: 0 },
        drawing: Some(facts),
        rigs: vec![rig],
        clips: Vec::new(),
        findings: Vec::new(),
        warnings,
    }
}

fn count_joints(scene: &Scene, format: Format) -> usize {
    if format.info().joints_are_skinned {
        return scene.skins.iter().flat_map(|skin| &skin.joints).collect::<BTreeSet<_>>().len();
    }
    joint_count(scene)
}

/// The rig as a retarget with an empty spec would see it; nothing where the file holds none.
fn read_rig<'a>(scene: &'a Scene, knowledge: &Knowledge, reporter: &mut Reporter) -> Result<Option<Rig<'a>>, Failure> {
    if scene.skeleton.is_empty() {
        return Ok(None);
    }
    let mut own = Reporter::new();
    let rig = Rig::with_recognizer("source", scene, None, &RigSpec::default(), knowledge.recognizer(), &mut own)?;
    if !rig.recognition.is_body() && !has_joints(scene) && rig.recognition.roles.is_empty() {
        // Meshes, lamps and cameras: what was guessed about their axes is of no use to anyone.
        return Ok(None);
    }
    reporter.absorb("", own);
    Ok(Some(rig))
}

fn has_joints(scene: &Scene) -> bool {
    scene.skeleton.joints().iter().any(|joint| joint.is_joint)
}

fn inspect_rig(rig: &Rig<'_>, knowledge: &Knowledge) -> RigView {
    let (scene, recognition) = (rig.scene, &rig.recognition);
    let labels = Labels::new(scene);
    let names = |joints: &[usize]| labels.one_or_more(joints);
    let hundredths = |value: f64| (value * 100.0).round() / 100.0;
    let details = |role: &Role| {
        let finding = &recognition.roles[role];
        RoleView {
            confidence: hundredths(finding.confidence),
            alternatives: finding.alternatives.iter().map(|joints| names(joints)).collect(),
            reasons: finding.reasons.clone(),
        }
    };
    let twist = |helper: &TwistHelper| TwistView {
        joint: labels.of(helper.joint),
        role: helper.role.to_string(),
        fraction: hundredths(helper.fraction),
    };
    let prop = |prop: &Prop| PropView {
        joint: labels.of(prop.joint),
        side: if prop.side == RigSide::Right { "right" } else { "left" },
    };
    let in_rig = rig_joints(scene, recognition.roles.values().flat_map(|finding| &finding.joints), has_joints(scene));
    let axis = |direction: DVec3| SignedAxis::nearest(direction).name();
    RigView {
        name: labels.of(top_of(scene, &in_rig)),
        recognised_as: recognition.recognised_as.clone(),
        confidence: hundredths(recognition.confidence),
        kind: recognition.kind.name(),
        rest_pose: own_rest_pose(rig, knowledge).name(),
        measured_pose: recognition.rest_pose.name(),
        rest_source: rig.rest_source.name(),
        rest_reason: rig.rest_reason.clone(),
        forward: recognition.body.map(|body| axis(body.forward)),
        up: recognition.body.map(|body| axis(body.up)),
        height_meters: height(rig, &in_rig),
        joints: in_rig.iter().map(|joint| joint_view(scene, &labels, &in_rig, *joint)).collect(),
        roles: ByRole(
            recognition.roles.iter().map(|(role, finding)| (role.to_string(), names(&finding.joints))).collect(),
        ),
        role_details: ByRole(recognition.roles.keys().map(|role| (role.to_string(), details(role))).collect()),
        twist_helpers: recognition.twist_helpers.iter().map(|joint| labels.of(*joint)).collect(),
        twists: recognition.twists.iter().map(twist).collect(),
        props: recognition.props.iter().map(prop).collect(),
        template: RigTemplate::learn(
            &labels.of(top_of(scene, &in_rig)),
            recognition.kind,
            &scene.skeleton,
            recognition.roles.iter().map(|(role, finding)| (*role, finding.joints.as_slice())),
        ),
    }
}

/// How the file's own rest pose holds the arms, whatever is measured from instead.
fn own_rest_pose(rig: &Rig<'_>, knowledge: &Knowledge) -> RestPoseKind {
    if !matches!(rig.rest_source, RestSource::StandingFrame | RestSource::Solved) {
        return rig.recognition.rest_pose;
    }
    let skeleton = rig.skeleton();
    let hints = Hints { recognizer: knowledge.recognizer(), ..Hints::of(rig.scene) };
    recognize(skeleton, &skeleton.rest_pose().to_model(skeleton), &hints).rest_pose
}

/// What the file calls joints, and what has a role all the same; all nodes where it calls none so.
fn rig_joints<'a>(scene: &Scene, with_role: impl Iterator<Item = &'a usize>, has_joints: bool) -> BTreeSet<usize> {
    let joints = scene.skeleton.joints().iter().enumerate();
    let flagged = joints.filter(|(_, joint)| joint.is_joint || !has_joints).map(|(index, _)| index);
    flagged.chain(with_role.copied()).collect()
}

fn top_of(scene: &Scene, in_rig: &BTreeSet<usize>) -> usize {
    let mut top = in_rig.first().copied().unwrap_or(0);
    while let Some(parent) = scene.skeleton.parent(top) {
        top = parent;
    }
    top
}

fn joint_view(scene: &Scene, labels: &Labels<'_>, in_rig: &BTreeSet<usize>, joint: usize) -> JointView {
    let joints = scene.skeleton.joints();
    let mut parent = joints[joint].parent;
    while let Some(above) = parent.filter(|above| !in_rig.contains(above)) {
        parent = joints[above].parent;
    }
    JointView { name: labels.of(joint), node: joints[joint].node, parent: parent.map(|parent| joints[parent].node) }
}

/// From the lowest to the highest joint of the body, or of all joints where there is no body.
fn height(rig: &Rig<'_>, in_rig: &BTreeSet<usize>) -> f64 {
    let with_role: BTreeSet<usize> =
        rig.recognition.roles.values().flat_map(|finding| finding.joints.iter().copied()).collect();
    let measured = if !rig.recognition.is_body() { in_rig } else { &with_role };
    let heights = measured.iter().map(|joint| rig.rest_height(*joint));
    let (low, high) =
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), height| (low.min(height), high.max(height)));
    if low <= high { ((high - low) * rig.unit_meters * 1e3).round() / 1e3 } else { 0.0 }
}

fn inspect_clip(clip: &Clip) -> ClipView {
    let is_animated = |joint: &&JointTracks| {
        joint.translation.is_animated() || joint.rotation.is_animated() || joint.scale.is_animated()
    };
    ClipView {
        name: clip.name().to_owned(),
        frames: clip.frame_count(),
        fps: clip.uniform_fps().map(|fps| (fps * 1e3).round() / 1e3),
        duration_seconds: clip.duration_seconds(),
        animated_joints: clip.joints().iter().filter(is_animated).count(),
    }
}
