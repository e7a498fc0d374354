//! Two rigs and a clip, and what configs make of them.

use glam::{DQuat, DVec3};
use retargetd::{
    model::{Clip, Control, ModelPose, Reporter, Scene},
    retarget::{Mapping, Resolved, RetargetSpec, Stack, parse_spec, resolve},
    rig::{Rig, SpecError},
    samples,
};

/// Forward kinematics alone: what the ops of these tests stand behind.
pub(crate) const KINEMATICS: &str = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;

/// Two scenes; the first one's first clip is moved onto the second.
pub(crate) struct Stage {
    pub(crate) source: Scene,
    pub(crate) target: Scene,
}

/// What a config gave.
pub(crate) struct Played {
    pub(crate) clip: Clip,
    pub(crate) mapping: Mapping,
    /// Codes of all warnings.
    pub(crate) warnings: Vec<&'static str>,
}

impl Stage {
    /// The walk of the samples and their mannequin.
    pub(crate) fn walk() -> Self {
        Self { source: samples::walk_scene(), target: samples::mannequin_scene() }
    }

    /// The walk onto the rig that it was made for.
    pub(crate) fn onto_itself() -> Self {
        Self { source: samples::walk_scene(), target: samples::walk_scene() }
    }

    pub(crate) fn play(&self, config: &str) -> Played {
        self.try_play(config).unwrap_or_else(|error| panic!("{config}: {error}: {:?}", error.fields))
    }

    pub(crate) fn try_play(&self, config: &str) -> Result<Played, SpecError> {
        let spec: RetargetSpec = parse_spec(config.as_bytes())?;
        let mut reporter = Reporter::new();
        let source = Rig::new("source", &self.source, None, &spec.source, &mut reporter)?;
        let target = Rig::new("target", &self.target, None, &spec.target, &mut reporter)?;
        let clip = &self.source.clips[0];
        let Resolved { mapping, ops, .. } = resolve(&spec, &source, &target, clip, &mut reporter)?;
        let stack = Stack::new(source.skeleton(), target.skeleton(), &mapping, &ops);
        let result = stack.run(clip, &Control::new()).expect("runs");
        let warnings = reporter.into_warnings().iter().map(|warning| warning.code).collect();
        Ok(Played { clip: result.clip, mapping, warnings })
    }

    pub(crate) fn target_joint(&self, name: &str) -> usize {
        self.target.skeleton.find(name).unwrap_or_else(|| panic!("the target has '{name}'"))
    }

    pub(crate) fn source_joint(&self, name: &str) -> usize {
        self.source.skeleton.find(name).unwrap_or_else(|| panic!("the source has '{name}'"))
    }

    pub(crate) fn target_pose(&self, played: &Played, frame: usize) -> ModelPose {
        played.clip.local_pose(&self.target.skeleton, frame).to_model(&self.target.skeleton)
    }

    pub(crate) fn source_pose(&self, frame: usize) -> ModelPose {
        self.source.clips[0].local_pose(&self.source.skeleton, frame).to_model(&self.source.skeleton)
    }

    pub(crate) fn place(&self, played: &Played, frame: usize, joint: &str) -> DVec3 {
        self.target_pose(played, frame).transforms()[self.target_joint(joint)].translation
    }

    pub(crate) fn turned(&self, played: &Played, frame: usize, joint: &str) -> DQuat {
        self.target_pose(played, frame).transforms()[self.target_joint(joint)].rotation
    }
}

/// The angle between two rotations, exact for small ones too.
pub(crate) fn degrees(first: DQuat, second: DQuat) -> f64 {
    let turn = first.conjugate() * second;
    2.0 * turn.xyz().length().atan2(turn.w.abs()).to_degrees()
}
