//! One rig with everything that retargeting needs to know about it.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};

use crate::model::{Axes, LocalPose, ModelPose, Reporter, Scene, SignedAxis, Skeleton};

use super::{
    alignment::{CanonicalPose, canonical_rest},
    error::{SpecError, SpecErrorKind, SpecField},
    recognition::{Hints, Recognition, RigKind, RigTemplate, body_frame, recognise, rest_pose_kind},
    rest::{Rest, RestFit, RestSource, edit, find_rest, grounded, uploaded},
    spec::{ClipChoice, RestSpec, RigSpec, UnitSpec},
};

/// Cosine below which the body's own axis contradicts the axis that the file declares.
const CONTRADICTION_COSINE: f64 = 0.5;

/// One rig: its scene, the pose that is measured from, what its joints mean and how its space lies.
#[derive(Debug)]
pub struct Rig<'a> {
    /// `source` or `target`; the first part of every pointer into the spec.
    pub name: &'static str,
    /// The file.
    pub scene: &'a Scene,
    /// The local rest pose.
    pub rest_local: LocalPose,
    /// The same in model space.
    pub rest: ModelPose,
    /// Where it came from.
    pub rest_source: RestSource,
    /// Why it was taken from there, as a clause for people.
    pub rest_reason: String,
    /// What to write into a spec to get the same pose again, but for its edits.
    pub rest_spec: RestSpec,
    /// How the rest file was put onto this rig, where one was given.
    pub rest_fit: Option<RestFit>,
    /// Joints that keep their orientation in model space when this rig is aligned.
    pub keep_pose: Vec<usize>,
    /// What a joint points at, where the spec says it.
    pub points_at: BTreeMap<usize, usize>,
    /// What the joints mean.
    pub recognition: Recognition,
    /// Joints of each role, recognition and the spec's overrides together.
    pub roles: BTreeMap<String, Vec<usize>>,
    /// Turns the scene to +Y up, +Z front.
    pub work_from_scene: DQuat,
    /// The axes that this came from, nearest signed ones.
    pub axes: Axes,
    /// Metres per unit of the scene.
    pub unit_metres: f64,
}

impl<'a> Rig<'a> {
    /// Finds out about one rig.
    ///
    /// # Errors
    /// When the file has no joints, or the spec names joints, clips or roles that do not exist.
    pub fn new(
        name: &'static str,
        scene: &'a Scene,
        rest_scene: Option<&Scene>,
        spec: &RigSpec,
        reporter: &mut Reporter,
    ) -> Result<Self, SpecError> {
        Self::with_templates(name, scene, rest_scene, spec, &[], reporter)
    }

    /// The same, with templates of the user's own, which are tried before the built-in ones.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_templates(
        name: &'static str,
        scene: &'a Scene,
        rest_scene: Option<&Scene>,
        spec: &RigSpec,
        templates: &[RigTemplate],
        reporter: &mut Reporter,
    ) -> Result<Self, SpecError> {
        let skeleton = &scene.skeleton;
        if skeleton.is_empty() {
            return Err(SpecError::new(
                SpecErrorKind::NoSkeleton,
                format!("the {name} file has no joints"),
                "send a file with a skeleton; 'retargetd inspect FILE' says what a file holds",
            ));
        }
        let Some(rest_scene) = rest_scene else {
            let rest = find_rest(name, scene, spec, templates, reporter)?;
            return Self::resting(name, scene, rest, spec, templates, reporter);
        };
        // What the rest file is compared with: the rig as it rests by itself.
        let plain = RigSpec { rest: RestSpec::default(), pose: Vec::new(), ..spec.clone() };
        let own = find_rest(name, scene, &plain, templates, &mut Reporter::new())?;
        let own = Self::resting(name, scene, own, &plain, templates, &mut Reporter::new())?;
        let (rest, fit) = uploaded(&own, rest_scene, spec, templates, reporter)?;
        let rig = Self::resting(name, scene, rest, spec, templates, reporter)?;
        Ok(Self { rest_fit: Some(fit), ..rig })
    }

    /// A rig that rests in a pose that was found already, but for the edits of the spec.
    pub(super) fn resting(
        name: &'static str,
        scene: &'a Scene,
        rest: Rest,
        spec: &RigSpec,
        templates: &[RigTemplate],
        reporter: &mut Reporter,
    ) -> Result<Self, SpecError> {
        let skeleton = &scene.skeleton;
        let Rest { pose: rest_local, source: rest_source, reason: rest_reason, spec: rest_spec, is_to_be_solved } =
            rest;
        let rest = rest_local.to_model(skeleton);
        let recognition = recognise(skeleton, &rest, &Hints { templates, ..Hints::of(scene) });
        let roles = find_roles(name, skeleton, &recognition, spec)?;
        let (work_from_scene, axes) = find_axes(name, scene, &recognition, spec, reporter);
        let unit_metres = match spec.unit {
            Some(UnitSpec::Metres(metres)) => metres,
            _ => scene.unit_metres.unwrap_or_else(|| guess_unit(name, skeleton, &rest, &roles, reporter)),
        };
        let mut rig = Self {
            name,
            scene,
            rest_local,
            rest,
            rest_source,
            rest_reason,
            rest_spec,
            rest_fit: None,
            keep_pose: Vec::new(),
            points_at: BTreeMap::new(),
            recognition,
            roles,
            work_from_scene,
            axes,
            unit_metres,
        };
        rig.name_alignment(spec)?;
        if is_to_be_solved {
            let from_nothing = rig.recognition.body.is_none();
            let solved = canonical_rest(&rig, CanonicalPose::T, from_nothing).rest;
            rig.take_rest(solved.to_local(skeleton));
        }
        if rig.rest_source == RestSource::Bind
            && let Some(grounded) = grounded(&rig)
        {
            rig.take_rest(grounded);
            rig.rest_reason.push_str("; it is put onto the floor");
        }
        if let Some(edited) = edit(&rig, &spec.pose)? {
            rig.take_rest(edited);
            rig.rest_reason.push_str("; the config edits it");
        }
        Ok(rig)
    }

    /// Measures from another pose. What the joints mean and how the space lies stay.
    fn take_rest(&mut self, pose: LocalPose) {
        self.rest = pose.to_model(self.skeleton());
        self.rest_local = pose;
        self.recognition.body = body_frame(&self.recognition.roles, &self.rest).or(self.recognition.body);
        self.recognition.rest_pose =
            rest_pose_kind(&self.recognition.roles, &self.rest, self.recognition.body.as_ref());
    }

    /// Finds the joints that the spec names for alignment.
    fn name_alignment(&mut self, spec: &RigSpec) -> Result<(), SpecError> {
        let mut fields = Vec::new();
        let mut keep_pose = Vec::new();
        for (index, joint) in spec.keep_pose.iter().enumerate() {
            match self.joint(joint, &format!("/{}/keep_pose/{index}", self.name)) {
                Ok(joint) => keep_pose.push(joint),
                Err(field) => fields.push(field),
            }
        }
        let mut points_at = BTreeMap::new();
        for (from, to) in &spec.points_at {
            let pointer = format!("/{}/points_at/{from}", self.name);
            match (self.joint(from, &pointer), self.joint(to, &pointer)) {
                (Ok(from), Ok(to)) => drop(points_at.insert(from, to)),
                (from, to) => fields.extend([from.err(), to.err()].into_iter().flatten()),
            }
        }
        self.keep_pose = keep_pose;
        self.points_at = points_at;
        SpecError::from_fields(fields).map_or(Ok(()), Err)
    }

    /// The skeleton.
    #[must_use]
    pub const fn skeleton(&self) -> &'a Skeleton {
        &self.scene.skeleton
    }

    /// Up, in the scene's space.
    #[must_use]
    pub fn up(&self) -> DVec3 {
        self.work_from_scene.conjugate() * DVec3::Y
    }

    /// Height of a joint at rest, in the scene's unit.
    #[must_use]
    pub fn rest_height(&self, joint: usize) -> f64 {
        self.rest.transforms()[joint].translation.dot(self.up())
    }

    /// Whether it is an animal on four or more legs.
    pub(super) fn stands_on_four(&self) -> bool {
        self.recognition.is_body() && self.recognition.kind != RigKind::Biped
    }

    /// The joints of a role; empty where there is none.
    #[must_use]
    pub fn role(&self, role: &str) -> &[usize] {
        self.roles.get(role).map_or(&[], Vec::as_slice)
    }

    /// Looks a joint up by name, by `#<node index>`, or by its name without a namespace.
    ///
    /// # Errors
    /// When there is none; the error has the nearest names.
    pub fn joint(&self, name: &str, pointer: &str) -> Result<usize, SpecField> {
        find_joint(self.skeleton(), self.name, name, pointer)
    }
}

fn find_joint(skeleton: &Skeleton, side: &str, name: &str, pointer: &str) -> Result<usize, SpecField> {
    if let Some(joint) = skeleton.find(name) {
        return Ok(joint);
    }
    let by_node = name.strip_prefix('#').and_then(|digits| digits.parse::<usize>().ok());
    if let Some(joint) = by_node.and_then(|node| skeleton.joints().iter().position(|joint| joint.node == node)) {
        return Ok(joint);
    }
    let bare = |joint: &crate::model::Joint| joint.name.rsplit([':', '|']).next() == Some(name);
    let mut without_namespace = (0..skeleton.len()).filter(|index| bare(&skeleton.joints()[*index]));
    if let (Some(joint), None) = (without_namespace.next(), without_namespace.next()) {
        return Ok(joint);
    }
    let detail = format!("the {side} skeleton has no joint '{name}'");
    let names = skeleton.joints().iter().map(|joint| joint.name.as_str());
    Err(SpecField::new(SpecErrorKind::UnknownJoint, pointer, detail).with_nearest(name, names))
}

/// The clip that a spec names, on one side.
///
/// # Errors
/// When the file has no such clip; the error lists those that it has, and the nearest names.
pub fn find_clip(scene: &Scene, choice: &ClipChoice, side: &str, pointer: &str) -> Result<usize, SpecField> {
    let found = match choice {
        ClipChoice::Index(index) => (*index < scene.clips.len()).then_some(*index),
        ClipChoice::Name(name) => scene.clips.iter().position(|clip| clip.name() == name),
    };
    found.ok_or_else(|| {
        let names: Vec<&str> = scene.clips.iter().map(crate::model::Clip::name).collect();
        let (detail, name) = match (choice, names.len()) {
            (_, 0) => (format!("the {side} file has no clips"), ""),
            (ClipChoice::Index(index), 1) => {
                (format!("the {side} file has no clip {index}; it has one, which is clip 0: {}", list(&names)), "")
            }
            (ClipChoice::Index(index), count) => {
                let last = count - 1;
                (format!("the {side} file has no clip {index}; its clips are 0 to {last}: {}", list(&names)), "")
            }
            (ClipChoice::Name(name), _) => {
                (format!("the {side} file has no clip '{name}'; its clips are: {}", list(&names)), name.as_str())
            }
        };
        SpecField::new(SpecErrorKind::UnknownName, pointer, detail).with_nearest(name, names)
    })
}

/// Names for a message; a file may have hundreds.
fn list(names: &[&str]) -> String {
    const MOST: usize = 12;
    let shown: Vec<String> = names.iter().take(MOST).map(|name| format!("'{name}'")).collect();
    let more = if names.len() > MOST { format!(" and {} more", names.len() - MOST) } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

fn find_roles(
    name: &'static str,
    skeleton: &Skeleton,
    recognition: &Recognition,
    spec: &RigSpec,
) -> Result<BTreeMap<String, Vec<usize>>, SpecError> {
    let mut roles: BTreeMap<String, Vec<usize>> =
        recognition.roles.iter().map(|(role, finding)| (role.to_string(), finding.joints.clone())).collect();
    let mut fields = Vec::new();
    let recognised: Vec<String> = roles.keys().cloned().collect();
    let unknown = |role: &str, pointer: String| {
        let field = SpecField::new(SpecErrorKind::UnknownName, pointer, format!("there is no role '{role}'"));
        let is_known = role.parse::<super::Role>().is_ok();
        (!is_known).then(|| field.with_nearest(role, recognised.iter().map(String::as_str)))
    };
    for (role, alternatives) in &spec.role_names {
        if let Some(field) = unknown(role, format!("/{name}/role_names/{role}")) {
            fields.push(field);
            continue;
        }
        let joints: Vec<usize> = alternatives.iter().filter_map(|names| first_named(skeleton, names)).collect();
        if !joints.is_empty() {
            roles.insert(role.clone(), joints);
        }
    }
    for (role, names) in &spec.roles {
        let pointer = format!("/{name}/roles/{role}");
        if let Some(field) = unknown(role, pointer.clone()) {
            fields.push(field);
            continue;
        }
        let mut joints = Vec::new();
        for joint in names.names() {
            match find_joint(skeleton, name, joint, &pointer) {
                Ok(joint) => joints.push(joint),
                Err(field) => fields.push(field),
            }
        }
        if joints.is_empty() {
            roles.remove(role);
        } else {
            roles.insert(role.clone(), joints);
        }
    }
    if let Some(root) = &spec.root {
        match find_joint(skeleton, name, root, &format!("/{name}/root")) {
            Ok(joint) => drop(roles.insert("pelvis".into(), vec![joint])),
            Err(field) => fields.push(field),
        }
    }
    SpecError::from_fields(fields).map_or(Ok(roles), Err)
}

/// The first of some names that a joint has, capitals or not.
fn first_named(skeleton: &Skeleton, names: &[String]) -> Option<usize> {
    let named = |name: &String| skeleton.joints().iter().position(|joint| joint.name.eq_ignore_ascii_case(name));
    names.iter().find_map(named)
}

/// The rotation to +Y up, +Z front. What the spec says wins; then what the file declares, unless the body contradicts it; then
/// where the body's head and face are.
fn find_axes(
    name: &'static str,
    scene: &Scene,
    recognition: &Recognition,
    spec: &RigSpec,
    reporter: &mut Reporter,
) -> (DQuat, Axes) {
    if let Some(axes) = spec.axes.as_deref().and_then(|axes| axes.parse::<Axes>().ok()) {
        return (axes.ours_from_this(), axes);
    }
    let declared = scene.axes.unwrap_or_default();
    let Some(body) = &recognition.body else {
        if scene.axes.is_none() {
            reporter.warn(
                "axes_guessed",
                name,
                format!("the file does not say its axes and no body was recognised; {declared} is taken"),
                format!("set {name}.axes in the config"),
            );
        }
        return (declared.ours_from_this(), declared);
    };
    let declared_up = scene.axes.map(|axes| axes.up().direction());
    let up = match declared_up {
        Some(up) if up.dot(body.up) >= CONTRADICTION_COSINE => up,
        Some(_) => {
            let up = SignedAxis::nearest(body.up);
            reporter.warn(
                "up_contradicts_file",
                name,
                format!("the file says that {} is up, but the body stands along {}", declared.up().name(), up.name()),
                format!("set {name}.axes in the config if this is wrong"),
            );
            up.direction()
        }
        None => SignedAxis::nearest(body.up).direction(),
    };
    let level = body.forward - up * body.forward.dot(up);
    let front = if level.length() > 1e-6 { level.normalize() } else { up.any_orthonormal_vector() };
    let nearest = SignedAxis::nearest(front);
    // A body that faces an axis but for a few degrees stands in that axis' space; its own few degrees are part of its rest pose.
    let front = if nearest.direction().dot(front) > 0.9 && nearest.direction().dot(up).abs() < 1e-9 {
        nearest.direction()
    } else {
        front
    };
    let scene_from_work = glam::DMat3::from_cols(up.cross(front), up, front);
    let axes = Axes::new(SignedAxis::nearest(up), nearest).unwrap_or(declared);
    let work_from_scene = DQuat::from_mat3(&scene_from_work).conjugate().normalize();
    // Where the axes say it exactly, to the last bit what the resolved spec says when it is run again.
    let is_exact = axes.ours_from_this().dot(work_from_scene).abs() > 1.0 - 1e-12;
    (if is_exact { axes.ours_from_this() } else { work_from_scene }, axes)
}

/// The rotation to +Y up, +Z front of a file by its body, quietly.
pub(super) fn axes_of_body(scene: &Scene, recognition: &Recognition) -> (DQuat, Axes) {
    find_axes("", scene, recognition, &RigSpec::default(), &mut Reporter::new())
}

/// Metres per unit from how tall a figure is: people are between 0.5 and 3 metres. A root above the pelvis may be anywhere.
fn guess_unit(
    name: &'static str,
    skeleton: &Skeleton,
    rest: &ModelPose,
    roles: &BTreeMap<String, Vec<usize>>,
    reporter: &mut Reporter,
) -> f64 {
    const CANDIDATES: [(f64, &str); 6] = [
        (1.0, "metres"),
        (0.01, "centimetres"),
        (0.0254, "inches"),
        (0.1, "decimetres"),
        (0.056_444, "CMU units"),
        (0.001, "millimetres"),
    ];
    let pelvis = roles.get("pelvis").and_then(|joints| joints.first());
    let is_body = |joint: &usize| pelvis.is_none_or(|pelvis| skeleton.is_ancestor_or_self(*pelvis, *joint));
    let joints = (0..skeleton.len()).filter(is_body).map(|joint| rest.transforms()[joint].translation);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for position in joints {
        low = low.min(position);
        high = high.max(position);
    }
    let size = (high - low).max_element();
    let plausible = |metres: &&(f64, &str)| (0.9..2.6).contains(&(size * metres.0));
    let (metres, unit) = CANDIDATES.iter().find(plausible).copied().unwrap_or((1.0, "metres"));
    reporter.warn(
        "unit_guessed",
        name,
        format!("the file does not say its unit; from a size of {size:.4} units it is taken to be {unit}"),
        format!("set {name}.unit in the config if this is wrong"),
    );
    metres
}
