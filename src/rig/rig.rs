//! One rig with everything that retargeting needs to know about it. What finds it out is in `build`.

use std::{collections::BTreeMap, sync::Arc};

use glam::{DQuat, DVec3};

use crate::model::{Axes, LocalPose, ModelPose, Scene, Skeleton};

use super::{
    error::SpecField,
    lookup::find_joint,
    recognition::{Recognition, RigKind, body_frame, rest_pose_kind},
    rest::{RestFit, RestSource},
    rig_memory::{Question, RigMemory},
    spec::RestSpec,
};

/// One rig: its scene, the pose that is measured from, what its joints mean and how its space lies.
#[derive(Clone, Debug)]
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
    pub canonical_from_scene: DQuat,
    /// The axes that this came from, nearest signed ones.
    pub axes: Axes,
    /// Meters per unit of the scene.
    pub unit_meters: f64,
    /// What was worked out about it. Clones share it; whoever changes anything but words gives the rig a new one.
    pub(crate) memory: Arc<RigMemory>,
}

impl<'a> Rig<'a> {
    /// The skeleton.
    #[must_use]
    pub const fn skeleton(&self) -> &'a Skeleton {
        &self.scene.skeleton
    }

    /// Up, in the scene's space.
    #[must_use]
    pub fn up(&self) -> DVec3 {
        self.canonical_from_scene.conjugate() * DVec3::Y
    }

    /// Height of a joint at rest, in the scene's unit.
    #[must_use]
    pub fn rest_height(&self, joint: usize) -> f64 {
        self.rest.transforms()[joint].translation.dot(self.up())
    }

    /// Whether it is an animal on four or more legs.
    pub(crate) fn stands_on_four(&self) -> bool {
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

    /// The answer to a question about this rig, found once.
    pub(crate) fn recall<Q: Question>(&self, question: Q, answer: impl FnOnce(&Q) -> Q::Answer) -> Q::Answer {
        if self.memory.is_of(&self.rest) { self.memory.recall(question, answer) } else { answer(&question) }
    }

    /// The same rig in a file that has more in it than its own, such as properties that a clip is to animate.
    pub(crate) fn with_scene<'b>(self, scene: &'b Scene) -> Rig<'b>
    where
        'a: 'b,
    {
        Rig { scene, memory: Arc::default(), ..self }
    }

    /// Measures from another pose. What the joints mean and how the space lies stay.
    pub(super) fn take_rest(&mut self, pose: LocalPose) {
        self.rest = pose.to_model(self.skeleton());
        self.rest_local = pose;
        self.memory = Arc::default();
        self.recognition.body = body_frame(&self.recognition.roles, &self.rest).or(self.recognition.body);
        self.recognition.rest_pose =
            rest_pose_kind(&self.recognition.roles, &self.rest, self.recognition.body.as_ref());
    }
}
