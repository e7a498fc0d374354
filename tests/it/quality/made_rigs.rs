//! Scenes made out of others: joints hung elsewhere, joints added, joints posed. Where joints lie at rest does not change.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3, Quat};
use retargetd::{
    model::{Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, Track, Transform},
    retarget::{Plan, Resolved, RetargetSpec, resolve, run},
    rig::{Rig, SpecError},
};

/// One joint of a scene that is being made: where it is in the model, and what carries it.
#[derive(Clone, Debug)]
struct Made {
    name: String,
    parent: Option<String>,
    model: Transform,
    is_joint: bool,
}

/// A skeleton to be changed, by names.
#[derive(Clone, Debug)]
pub(super) struct MadeRig {
    joints: Vec<Made>,
}

impl MadeRig {
    pub(super) fn of(scene: &Scene) -> Self {
        let skeleton = &scene.skeleton;
        let rest = skeleton.rest_pose().to_model(skeleton);
        let name = |joint: usize| skeleton.joints()[joint].name.clone();
        let made = |(index, joint): (usize, &Joint)| Made {
            name: joint.name.clone(),
            parent: joint.parent.map(name),
            model: rest.transforms()[index],
            is_joint: joint.is_joint,
        };
        Self { joints: skeleton.joints().iter().enumerate().map(made).collect() }
    }

    fn index(&self, name: &str) -> usize {
        self.joints.iter().position(|joint| joint.name == name).unwrap_or_else(|| panic!("a joint named {name}"))
    }

    pub(super) fn place(&self, name: &str) -> DVec3 {
        self.joints[self.index(name)].model.translation
    }

    /// Puts a joint elsewhere; what is below it stays.
    pub(super) fn moved(mut self, name: &str, place: DVec3) -> Self {
        let index = self.index(name);
        self.joints[index].model.translation = place;
        self
    }

    /// Hangs a joint, with all below it, from another one.
    pub(super) fn hung_from(mut self, name: &str, parent: &str) -> Self {
        let index = self.index(name);
        self.joints[index].parent = Some(parent.to_owned());
        self
    }

    /// Adds a joint with the axes of its parent.
    pub(super) fn with(mut self, name: &str, parent: &str, place: DVec3) -> Self {
        let rotation = self.joints[self.index(parent)].model.rotation;
        let model = Transform { translation: place, rotation, scale: DVec3::ONE };
        self.joints.push(Made { name: name.into(), parent: Some(parent.into()), model, is_joint: true });
        self
    }

    pub(super) fn without(mut self, wanted: impl Fn(&str) -> bool) -> Self {
        self.joints.retain(|joint| !wanted(&joint.name));
        self
    }

    /// The scene, with joints as late or as early as their parents allow: `first` says which come as early as they can.
    pub(super) fn scene(&self, first: impl Fn(&str) -> bool) -> Scene {
        let mut placed: Vec<&Made> = Vec::new();
        while placed.len() < self.joints.len() {
            let is_placed = |name: &str| placed.iter().any(|joint| joint.name == name);
            let is_next = |joint: &&Made| !is_placed(&joint.name) && joint.parent.as_deref().is_none_or(is_placed);
            let early = self.joints.iter().filter(is_next).find(|joint| first(&joint.name));
            placed.push(early.or_else(|| self.joints.iter().find(is_next)).expect("a tree"));
        }
        let joint = |(node, made): (usize, &&Made)| {
            let parent = made.parent.as_ref().and_then(|name| placed.iter().position(|joint| joint.name == *name));
            let rest = parent.map_or(made.model, |parent| placed[parent].model.relative(&made.model));
            Joint { name: made.name.clone(), parent, rest, is_joint: made.is_joint, node }
        };
        let joints = placed.iter().enumerate().map(joint).collect();
        let axes = Some(retargetd::model::Axes::default());
        Scene { skeleton: Skeleton::new(joints).expect("a skeleton"), axes, unit_meters: Some(1.0), ..Scene::default() }
    }
}

/// A clip of a scene in which only some joints move; `turn` gives what is put onto a joint's rest rotation, in its own axes.
pub(super) fn clip_of(scene: &Scene, frames: usize, turn: impl Fn(&str, usize) -> Option<DQuat>) -> Clip {
    let tracks = scene.skeleton.joints().iter().map(|joint| {
        let moves = turn(&joint.name, 0).is_some();
        let at = |frame| (joint.rest.rotation * turn(&joint.name, frame).unwrap_or_default()).normalize().as_quat();
        let rotations: Vec<Quat> = (0..frames).map(at).collect();
        JointTracks { rotation: if moves { Track::Sampled(rotations) } else { Track::Rest }, ..JointTracks::default() }
    });
    let times = (0..frames).map(|frame| frame as f64 / 30.0).collect();
    Clip::new("made".into(), times, tracks.collect()).expect("a clip")
}

/// A retarget, with its warnings' codes.
pub(super) fn retargeted(
    spec: &RetargetSpec,
    source: &Scene,
    clip: &Clip,
    target: &Scene,
) -> Result<(Clip, Resolved, Vec<&'static str>), SpecError> {
    let mut reporter = Reporter::new();
    let source = Rig::new("source", source, None, &spec.source, &mut reporter)?;
    let target = Rig::new("target", target, None, &spec.target, &mut reporter)?;
    let resolved = resolve(spec, &source, &target, clip, &mut reporter)?;
    let plan = Plan::new(source.skeleton(), target.skeleton(), &resolved.mapping);
    let result = run(&plan, clip, &Control::new()).expect("a result");
    let codes = reporter.warnings().iter().map(|warning| warning.code).collect();
    Ok((result, resolved, codes))
}

/// Says of every role of a body which joints have it, for rigs made of it in which that is hard to find out.
pub(super) fn roles_of(body: &Scene) -> RetargetSpec {
    let rig = Rig::new("target", body, None, &RetargetSpec::default().target, &mut Reporter::new()).expect("a rig");
    let labels = |joints: &Vec<usize>| joints.iter().map(|joint| body.skeleton.label(*joint)).collect::<Vec<_>>();
    let roles: BTreeMap<&String, Vec<String>> = rig.roles.iter().map(|(role, joints)| (role, labels(joints))).collect();
    serde_json::from_value(serde_json::json!({"target": {"roles": roles}})).expect("a spec")
}
