//! A retarget compiled once and run on many motions, as arrays: for callers that hold poses and want poses.

use std::borrow::Cow;

use serde::Serialize;

use crate::{
    formats::{FrameArrays, Limits, PoseFrames},
    model::{Clip, ClipError, Control, JointTracks, Phase, Reporter},
    retarget::Stack,
    rig::{SpecErrorKind, SpecField},
};

use super::{
    Failure, FailureCode, Inputs, Knowledge, RigFacts, Rigs, WarningView,
    edit::edited_clip,
    files::{Files, RigPair, in_config, one_field, read_spec},
    retarget_run::{RetargetRun, run_failure},
    tune::TuningProblem,
};

/// A retarget of one pair of rigs with one spec, without its files.
#[derive(Clone, Debug)]
pub struct Compiled {
    stack: Stack,
    source: PoseFrames,
    target: PoseFrames,
    facts: CompiledFacts,
}

/// What was found out while it was compiled.
#[derive(Clone, Debug, Serialize)]
pub struct CompiledFacts {
    /// The spec with everything found out filled in.
    pub resolved_spec: serde_json::Value,
    /// What was found out about the two rigs.
    pub rigs: Rigs,
    /// Target joints that are driven.
    pub driven_joints: usize,
    /// Guesses.
    pub warnings: Vec<WarningView>,
}

impl Compiled {
    /// Compiles. Where the source has a clip, what is found out from a motion is found out from that; else from its rest pose.
    ///
    /// # Errors
    /// As [`super::retarget`], and when the spec asks for what is done to a whole clip: `edit` and `layer`.
    pub fn new(
        inputs: &Inputs<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<Self, Failure> {
        let mut reporter = Reporter::new();
        control.enter(Phase::Read, 0);
        let spec = read_spec(inputs.config)?;
        let files = Files::load(inputs, false, knowledge, (limits, control), &mut reporter)?;
        control.enter(Phase::Plan, 0);
        let RigPair { spec, source, target } = files.sides(spec, knowledge, &mut reporter)?;
        let scene = source.scene;
        let still = Clip::new(String::new(), vec![0.0], vec![JointTracks::default(); scene.skeleton.len()]);
        let still = still.map_err(no_poses)?;
        let moves = spec.clip.is_some() || scene.clips.iter().any(Clip::is_animated);
        let clip = if moves { files.choose_clip(&spec, &mut reporter)? } else { &still };
        let is_edited = matches!(edited_clip(&source, clip, &spec, control, &mut Reporter::new())?, Cow::Owned(_));
        let whole_clip = [("/edit", is_edited), ("/layer", spec.layer.is_some())];
        if let Some((pointer, _)) = whole_clip.into_iter().find(|(_, is_asked)| *is_asked) {
            return Err(of_a_whole_clip(pointer));
        }
        let subject = TuningProblem { source: &source, target: &target, clip, control };
        let (spec, _) = subject.settle(spec)?;
        let pass = RetargetRun::run(&spec, &source, &target, clip, control, &mut reporter)?;
        let resolved_spec = serde_json::to_value(&pass.resolved)
            .map_err(|error| Failure::new(FailureCode::Internal, format!("the resolved spec: {error}")))?;
        let rigs = Rigs {
            source: RigFacts::of(&source, files.source.format),
            target: RigFacts::of(&target, files.target.format),
        };
        let facts = CompiledFacts {
            resolved_spec,
            rigs,
            driven_joints: pass.stack.driven_joint_count(),
            warnings: reporter.into_warnings().into_iter().map(WarningView::from).collect(),
        };
        Ok(Self {
            stack: pass.stack,
            source: PoseFrames::of(scene, (source.axes, source.unit_meters)),
            target: PoseFrames::of(target.scene, (target.axes, target.unit_meters)),
            facts,
        })
    }

    /// How poses of the source lie in arrays.
    #[must_use]
    pub const fn source(&self) -> &PoseFrames {
        &self.source
    }

    /// How poses of the target lie in arrays.
    #[must_use]
    pub const fn target(&self) -> &PoseFrames {
        &self.target
    }

    /// What was found out.
    #[must_use]
    pub const fn facts(&self) -> &CompiledFacts {
        &self.facts
    }

    /// Retargets a motion; the result is a clip of the target, for [`PoseFrames::fill`] of [`Self::target`].
    ///
    /// # Errors
    /// When the arrays are no poses of the source, the result does not fit into numbers, or the work is canceled.
    pub fn run(&self, times_seconds: Vec<f64>, arrays: &FrameArrays<'_>, control: &Control) -> Result<Clip, Failure> {
        let clip = self.source.clip("", times_seconds, arrays).map_err(no_poses)?;
        control.enter(Phase::Retarget, clip.frame_count() as u64);
        Ok(self.stack.run(&clip, control).map_err(run_failure)?.clip)
    }
}

fn of_a_whole_clip(pointer: &str) -> Failure {
    let detail = format!("'{}' changes a whole clip, and a compiled retarget takes frames as they come", &pointer[1..]);
    let failure = in_config(one_field(SpecField::new(SpecErrorKind::InvalidValue, pointer, detail)));
    failure.with_hint("edit the poses before, or retarget files")
}

fn no_poses(error: ClipError) -> Failure {
    Failure::new(FailureCode::AssetMalformed, error.to_string()).in_part("source")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        engine::NamedBytes,
        formats::{self, Format, FrameArraysMut, WriteOptions},
        model::Scene,
        samples,
    };

    fn compiled(config: &str) -> Result<Compiled, Failure> {
        compiled_for(&samples::walk_clip(), config)
    }

    fn compiled_for(walk: &[u8], config: &str) -> Result<Compiled, Failure> {
        let mannequin = samples::mannequin();
        let inputs = Inputs {
            source: NamedBytes { name: "walk.glb", bytes: walk },
            target: NamedBytes { name: "mannequin.glb", bytes: &mannequin },
            source_rest: None,
            target_rest: None,
            config: Some(NamedBytes { name: "config.json", bytes: config.as_bytes() }),
            formats: &[],
        };
        Compiled::new(&inputs, &Knowledge::default(), &Limits::default(), &Control::new())
    }

    /// The whole walk, moved.
    fn walked(compiled: &Compiled) -> Clip {
        let scene = samples::walk_scene();
        let clip = &scene.clips[0];
        let count = clip.frame_count() * compiled.source().joint_count();
        let (mut translations, mut rotations, mut scales) =
            (vec![0.0; count * 3], vec![0.0; count * 4], vec![0.0; count * 3]);
        let room = FrameArraysMut { translations: &mut translations, rotations: &mut rotations, scales: &mut scales };
        compiled.source().fill(clip, room);
        let arrays = FrameArrays { translations: Some(&translations), rotations: &rotations, scales: Some(&scales) };
        compiled.run(clip.times_seconds().to_vec(), &arrays, &Control::new()).expect("it runs")
    }

    #[test]
    fn it_gives_what_a_retarget_of_files_gives() {
        let compiled = compiled("{}").expect("it compiles");
        let result = walked(&compiled);
        assert_eq!(result.frame_count(), 121, "as long as the walk");
        assert_eq!(compiled.target().joint_count(), compiled.target().names().count());
        assert!(result.is_animated() && compiled.facts().driven_joints > 10, "the mannequin walks");
    }

    #[test]
    fn what_was_compiled_for_a_short_clip_works_on_a_longer_one_to_its_end() {
        let scene = samples::walk_scene();
        let options = WriteOptions::new(Format::Glb);
        let short = scene.clips[0].section(0..10);
        let bare = Scene { clips: Vec::new(), ..scene };
        let file = formats::write(&bare, &short, &options, &Control::new(), &mut Reporter::new()).expect("a file");
        let (of_short, of_whole) = (compiled_for(&file, "{}").expect("fits"), compiled("{}").expect("fits"));
        let (of_short, of_whole) = (walked(&of_short), walked(&of_whole));
        for (joint, (short, whole)) in of_short.joints().iter().zip(of_whole.joints()).enumerate() {
            for frame in 0..of_whole.frame_count() {
                let place = |tracks: &JointTracks| tracks.translation.at(frame, glam::Vec3::ZERO);
                let turn = |tracks: &JointTracks| tracks.rotation.at(frame, glam::Quat::IDENTITY);
                assert!(place(short).distance(place(whole)) < 1e-5, "joint {joint}, frame {frame}");
                assert!(turn(short).dot(turn(whole)).abs() > 1.0 - 1e-6, "joint {joint}, frame {frame}");
            }
        }
    }

    #[test]
    fn what_changes_whole_clips_is_refused() {
        let refused = compiled(r#"{"edit": {"fps": 12}}"#).expect_err("refused");
        assert_eq!((refused.code, refused.errors[0].pointer.as_str()), (FailureCode::InvalidValue, "/edit"));
        assert!(compiled(r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#).is_ok(), "other ops");
    }
}
