//! A rig in a rest pose that was found: what its joints mean, and how its space lies.

use std::{collections::BTreeMap, sync::Arc};

use glam::{DQuat, DVec3};

use crate::model::{Axes, ModelPose, Reporter, Scene, SignedAxis, Skeleton};

use super::{
    characters::{outside_of_character, warn_of_others},
    error::{SpecError, SpecErrorKind, SpecField},
    lookup::find_joint,
    recognition::{Hints, Recognition, Recognizer, recognize},
    rest::Rest,
    rig::Rig,
    spec::{RigSpec, UnitSpec},
};

/// Cosine below which the body's own axis contradicts the axis that the file declares.
const CONTRADICTION_COSINE: f64 = 0.5;

impl<'a> Rig<'a> {
    /// A rig that rests in a pose that was found.
    pub(super) fn at_rest(
        name: &'static str,
        scene: &'a Scene,
        rest: Rest,
        spec: &RigSpec,
        recognizer: Recognizer<'_>,
        reporter: &mut Reporter,
    ) -> Result<Self, SpecError> {
        let skeleton = &scene.skeleton;
        let Rest { pose: rest_local, source: rest_source, reason: rest_reason, spec: rest_spec, .. } = rest;
        let rest = rest_local.to_model(skeleton);
        let excluded = outside_of_character(name, skeleton, spec)?;
        let hints = Hints { recognizer, excluded: &excluded, ..Hints::of(scene) };
        let recognition = recognize(skeleton, &rest, &hints);
        if spec.character.is_none() {
            warn_of_others(name, scene, &rest, &recognition, &hints, reporter);
        }
        let roles = find_roles(name, skeleton, &recognition, spec)?;
        let (canonical_from_scene, axes) = find_axes(name, scene, &recognition, spec, reporter);
        let unit_meters = match spec.unit {
            Some(UnitSpec::Meters(meters)) => meters,
            _ => scene.unit_meters.unwrap_or_else(|| guess_unit(name, skeleton, &rest, &roles, reporter)),
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
            canonical_from_scene,
            axes,
            unit_meters,
            memory: Arc::default(),
        };
        rig.name_alignment(spec)?;
        Ok(rig)
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
    let recognized: Vec<String> = roles.keys().cloned().collect();
    let unknown = |role: &str, pointer: String| {
        let field = SpecField::new(SpecErrorKind::UnknownName, pointer, format!("there is no role '{role}'"));
        let is_known = role.parse::<super::Role>().is_ok();
        (!is_known).then(|| field.with_nearest(role, recognized.iter().map(String::as_str)))
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
        return (axes.canonical_from_this(), axes);
    }
    let declared = scene.axes.unwrap_or_default();
    let Some(body) = &recognition.body else {
        if scene.axes.is_none() {
            reporter.warn(
                "axes_guessed",
                name,
                format!("the file does not say its axes and no body was recognized; {declared} is taken"),
                format!("set {name}.axes in the config"),
            );
        }
        return (declared.canonical_from_this(), declared);
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
    let scene_from_canonical = glam::DMat3::from_cols(up.cross(front), up, front);
    let axes = Axes::new(SignedAxis::nearest(up), nearest).unwrap_or(declared);
    let canonical_from_scene = DQuat::from_mat3(&scene_from_canonical).conjugate().normalize();
    // Where the axes say it exactly, to the last bit what the resolved spec says when it is run again.
    let is_exact = axes.canonical_from_this().dot(canonical_from_scene).abs() > 1.0 - 1e-12;
    (if is_exact { axes.canonical_from_this() } else { canonical_from_scene }, axes)
}

/// The rotation to +Y up, +Z front of a file by its body, quietly.
pub(super) fn axes_of_body(scene: &Scene, recognition: &Recognition) -> (DQuat, Axes) {
    find_axes("", scene, recognition, &RigSpec::default(), &mut Reporter::new())
}

/// Meters per unit from how tall a figure is: people are between 0.5 and 3 meters. A root above the pelvis may be anywhere.
fn guess_unit(
    name: &'static str,
    skeleton: &Skeleton,
    rest: &ModelPose,
    roles: &BTreeMap<String, Vec<usize>>,
    reporter: &mut Reporter,
) -> f64 {
    const CANDIDATES: [(f64, &str); 6] = [
        (1.0, "meters"),
        (0.01, "centimeters"),
        (0.0254, "inches"),
        (0.1, "decimeters"),
        (0.056_444, "CMU units"),
        (0.001, "millimeters"),
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
    let plausible = |meters: &&(f64, &str)| (0.9..2.6).contains(&(size * meters.0));
    let (meters, unit) = CANDIDATES.iter().find(plausible).copied().unwrap_or((1.0, "meters"));
    reporter.warn(
        "unit_guessed",
        name,
        format!("the file does not say its unit; from a size of {size:.4} units it is taken to be {unit}"),
        format!("set {name}.unit in the config if this is wrong"),
    );
    meters
}
