//! One rig with everything that retargeting needs to know about it.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};

use crate::model::{Axes, LocalPose, ModelPose, Reporter, Scene, SignedAxis, Skeleton};

use super::{
    error::{SpecError, SpecErrorKind, SpecField},
    recognition::{Hints, Recognition, recognise},
    rest::{RestSource, bind_pose, take_over},
    spec::{ClipChoice, RestRule, RestSpec, RigSpec, UnitSpec},
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
        let skeleton = &scene.skeleton;
        if skeleton.is_empty() {
            return Err(SpecError::new(
                SpecErrorKind::NoSkeleton,
                format!("the {name} file has no joints"),
                "send a file with a skeleton; 'retargetd inspect FILE' says what a file holds",
            ));
        }
        let (rest_local, rest_source) = find_rest(name, scene, rest_scene, spec, reporter)?;
        let rest = rest_local.to_model(skeleton);
        let recognition = recognise(skeleton, &rest, &Hints::of(scene));
        let roles = find_roles(name, skeleton, &recognition, spec)?;
        let (work_from_scene, axes) = find_axes(name, scene, &recognition, spec, reporter);
        let unit_metres = match spec.unit {
            Some(UnitSpec::Metres(metres)) => metres,
            _ => scene.unit_metres.unwrap_or_else(|| guess_unit(name, skeleton, &rest, &roles, reporter)),
        };
        Ok(Self { name, scene, rest_local, rest, rest_source, recognition, roles, work_from_scene, axes, unit_metres })
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

/// The clip that a spec names.
pub(super) fn find_clip(scene: &Scene, choice: &ClipChoice, side: &str, pointer: &str) -> Result<usize, SpecField> {
    let found = match choice {
        ClipChoice::Index(index) => (*index < scene.clips.len()).then_some(*index),
        ClipChoice::Name(name) => scene.clips.iter().position(|clip| clip.name() == name),
    };
    found.ok_or_else(|| {
        let names: Vec<&str> = scene.clips.iter().map(crate::model::Clip::name).collect();
        let (label, name) = match choice {
            ClipChoice::Index(index) => (index.to_string(), String::new()),
            ClipChoice::Name(name) => (format!("'{name}'"), name.clone()),
        };
        let detail = format!("the {side} file has no clip {label}; its clips are: {}", list(&names));
        SpecField::new(SpecErrorKind::UnknownName, pointer, detail).with_nearest(&name, names)
    })
}

fn list(names: &[&str]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn find_rest(
    name: &'static str,
    scene: &Scene,
    rest_scene: Option<&Scene>,
    spec: &RigSpec,
    reporter: &mut Reporter,
) -> Result<(LocalPose, RestSource), SpecError> {
    let refuse = |field: SpecField| SpecError::from_fields(vec![field]).unwrap_or_else(unreachable_error);
    let holder = rest_scene.unwrap_or(scene);
    let nodes = scene.skeleton.rest_pose();
    let (pose, source) = match &spec.rest {
        RestSpec::Frame(frame) => {
            let clip = find_clip(holder, &frame.clip, name, &format!("/{name}/rest/clip")).map_err(refuse)?;
            let clip = &holder.clips[clip];
            if frame.frame >= clip.frame_count() {
                let detail = format!("frame {} is past the clip's {} frames", frame.frame, clip.frame_count());
                let pointer = format!("/{name}/rest/frame");
                return Err(refuse(SpecField::new(SpecErrorKind::InvalidValue, pointer, detail)));
            }
            (clip.local_pose(&holder.skeleton, frame.frame), RestSource::ClipFrame)
        }
        RestSpec::Rule(rule) => {
            let upload = rest_scene.is_some();
            let bind = (*rule != RestRule::Nodes).then(|| bind_pose(holder, reporter, name)).flatten();
            let source = match (upload, bind.is_some()) {
                (true, _) => RestSource::Upload,
                (false, true) => RestSource::Bind,
                (false, false) => RestSource::Nodes,
            };
            (bind.unwrap_or_else(|| holder.skeleton.rest_pose()), source)
        }
    };
    let Some(rest_scene) = rest_scene else { return Ok((pose, source)) };
    let mut taken = nodes;
    let found = take_over(&scene.skeleton, &mut taken, &rest_scene.skeleton, &pose);
    if found == 0 {
        return Err(SpecError::new(
            SpecErrorKind::NoSkeleton,
            format!("the rest file of the {name} shares no joint name with the {name} file"),
            "the rest file must hold the same skeleton, by names",
        ));
    }
    let missing = scene.skeleton.joints().iter().filter(|joint| joint.is_joint).count().saturating_sub(found);
    if missing > 0 {
        reporter.warn(
            "rest_file_incomplete",
            name,
            format!("{missing} joints of the {name} are not in its rest file; they keep their node transform"),
            "export the rest file from the same rig",
        );
    }
    Ok((taken, source))
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
    for (role, names) in &spec.roles {
        let pointer = format!("/{name}/roles/{role}");
        if role.parse::<super::Role>().is_err() {
            let detail = format!("there is no role '{role}'");
            let known: Vec<String> = roles.keys().cloned().collect();
            let field = SpecField::new(SpecErrorKind::UnknownName, pointer, detail);
            fields.push(field.with_nearest(role, known.iter().map(String::as_str)));
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
    (DQuat::from_mat3(&scene_from_work).conjugate().normalize(), axes)
}

/// Metres per unit from how tall a figure is: people are between 0.5 and 3 metres. A root above the pelvis may be anywhere.
fn guess_unit(
    name: &'static str,
    skeleton: &Skeleton,
    rest: &ModelPose,
    roles: &BTreeMap<String, Vec<usize>>,
    reporter: &mut Reporter,
) -> f64 {
    const CANDIDATES: [(f64, &str); 5] =
        [(1.0, "metres"), (0.01, "centimetres"), (0.0254, "inches"), (0.056_444, "CMU units"), (0.001, "millimetres")];
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

fn unreachable_error() -> SpecError {
    SpecError::new(SpecErrorKind::InvalidValue, "the rest pose cannot be found", String::new())
}
