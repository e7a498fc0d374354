//! A character in a pose, as a file: its T pose, its A pose, or the rest pose of another character.
//!
//! A glTF or VRM keeps its document; its nodes stand in the pose, and its first and only animation holds it for one frame. Its
//! skins stay bound as they were, so the mesh follows. BVH and pose arrays have the pose as their rest pose and as their only
//! frame.

use glam::{Quat, Vec3};

use crate::{
    formats::{self, Limits, TargetClips, WriteOptions},
    model::{Axes, Clip, Control, Joint, JointTracks, LocalPose, Phase, Reporter, Scene, Skeleton, Track},
    rig::{PoseChoice, Posed, Rig, posed_target},
};

use super::{
    Counts, Failure, FailureCode, Outcome, Output, PoseInputs, Report, RigFacts, Rigs, Timings, WarningView,
    alignment::view,
    facts::joint_count,
    files::{in_config_or, load},
    memory::LoadedFile,
    output_request::{OutputRequest, output_requests},
    pictures,
    provenance::engine,
    strict::check_strict,
    swapped_inputs::explain_rest,
    task_context::TaskContext,
};

/// Rotations closer than this are the same, as one minus the cosine of half the angle.
const SAME_ROTATION: f64 = 1e-12;

/// Puts the target into a pose. The source is read only where the pose is taken from it.
pub(super) fn posed(work: TaskContext<'_>, inputs: &PoseInputs<'_>) -> Result<Outcome, Failure> {
    let TaskContext { ref spec, knowledge, limits, control, begin, mut reporter } = work;
    let choice = spec.pose.unwrap_or_default().to;
    let wanted = output_requests(spec, inputs.formats)?;
    let mut read = |file, part| load(file, part, limits, control, &mut reporter);
    let mut target = read(inputs.target, "target")?;
    let target_rest = inputs.target_rest.map(|file| read(file, "target_rest")).transpose()?;
    let is_from_source = choice == PoseChoice::Source;
    let source = inputs.source.filter(|_| is_from_source).map(|file| read(file, "source")).transpose()?;
    let source_rest =
        inputs.source_rest.filter(|_| is_from_source).map(|file| read(file, "source_rest")).transpose()?;
    let read_seconds = control.seconds() - begin;

    let planning = control.seconds();
    control.enter(Phase::Plan, 0);
    let source_rig = source.as_ref().map(|source| {
        let rest = source_rest.as_ref().map(|rest| &rest.scene);
        Rig::with_recognizer("source", &source.scene, rest, &spec.source, knowledge.recognizer(), &mut reporter)
            .map_err(|error| explain_rest(in_config_or(error, "source"), "source", &source.scene, &target.scene, rest))
    });
    let source_rig = source_rig.transpose()?;
    let rest = target_rest.as_ref().map(|rest| &rest.scene);
    let other = source.as_ref().map_or(&target.scene, |source| &source.scene);
    let target_rig =
        Rig::with_recognizer("target", &target.scene, rest, &spec.target, knowledge.recognizer(), &mut reporter)
            .map_err(|error| explain_rest(in_config_or(error, "target"), "target", &target.scene, other, rest))?;
    check_body(&target_rig, choice)?;
    let Posed { pose, alignment } = posed_target(source_rig.as_ref(), &target_rig, choice, spec.align)
        .ok_or_else(|| Failure::new(FailureCode::Internal, "a pose of the source was asked for, and there is none"))?;
    let alignment = view(&alignment, target_rig.skeleton());
    let target_facts = RigFacts::of(&target_rig, target.format);
    let source_facts = match (&source_rig, &source) {
        (Some(rig), Some(source)) => RigFacts::of(rig, source.format),
        _ => target_facts.clone(),
    };
    let space = (target_rig.axes, target_rig.unit_meters);
    let plan_seconds = control.seconds() - planning;

    let writing = control.seconds();
    control.enter(Phase::Write, wanted.len() as u64);
    let posed = PosedCharacter::new(&mut target, &pose, choice)?;
    let mut outputs = Vec::with_capacity(wanted.len());
    for output in &wanted {
        control.check()?;
        outputs.push(posed.write(&target.scene, output, space, (limits, control), &mut reporter)?);
        control.advance(1);
    }
    let warnings: Vec<WarningView> = reporter.into_warnings().into_iter().map(WarningView::from).collect();
    if spec.strict {
        check_strict(&warnings, None)?;
    }
    let counts = Counts {
        frames: 1,
        source_joints: source.as_ref().map_or(0, |source| joint_count(&source.scene)),
        target_joints: joint_count(&target.scene),
        driven_joints: posed.joints.len(),
    };
    let timings = Timings {
        read_seconds,
        plan_seconds,
        write_seconds: control.seconds() - writing,
        total_seconds: control.seconds() - begin,
        ..Timings::default()
    };
    let rigs = Rigs { source: source_facts, target: target_facts };
    let report = Report { timings, counts, warnings, rigs, alignment, ..Report::default() };
    let resolved_spec = serde_json::to_value(spec)
        .map_err(|error| Failure::new(FailureCode::Internal, format!("the resolved spec: {error}")))?;
    Ok(Outcome { outputs, report, resolved_spec })
}

/// A T pose needs arms or legs.
fn check_body(target: &Rig<'_>, choice: PoseChoice) -> Result<(), Failure> {
    let has = |role: &str| !target.role(role).is_empty();
    let has_limbs = ["left_upper_arm", "right_upper_arm", "left_thigh", "right_thigh"].into_iter().any(has);
    if choice == PoseChoice::Rest || has_limbs {
        return Ok(());
    }
    Err(Failure::new(
        FailureCode::NothingToMap,
        "no arm and no leg of a body was recognized, so there is nothing to pose",
    )
    .in_part("target")
    .with_hint("name the joints in target.roles; 'retargetd inspect FILE' says what was recognized"))
}

/// What is written: a skeleton whose rest transforms are the pose, and a clip that holds it.
struct PosedCharacter {
    /// Joints that the pose turns or moves.
    joints: Vec<usize>,
    clip: Clip,
}

impl PosedCharacter {
    /// Puts the pose into the scene's skeleton.
    fn new(target: &mut LoadedFile, pose: &LocalPose, choice: PoseChoice) -> Result<Self, Failure> {
        let internal = |error: &dyn std::fmt::Display| {
            Failure::new(FailureCode::Internal, format!("the pose cannot be written: {error}"))
        };
        let scene = &mut target.scene;
        let mut joints = Vec::new();
        let mut tracks = vec![JointTracks::default(); scene.skeleton.len()];
        let mut rests: Vec<Joint> = scene.skeleton.joints().to_vec();
        for (index, (joint, posed)) in rests.iter_mut().zip(pose.transforms()).enumerate() {
            let turns = 1.0 - joint.rest.rotation.dot(posed.rotation).abs() > SAME_ROTATION;
            let moves = joint.rest.translation.distance(posed.translation) > f64::from(f32::EPSILON);
            if turns {
                joint.rest.rotation = posed.rotation;
                tracks[index].rotation = Track::<Quat>::Constant(posed.rotation.as_quat().normalize());
            }
            if moves {
                joint.rest.translation = posed.translation;
                tracks[index].translation = Track::<Vec3>::Constant(posed.translation.as_vec3());
            }
            if turns || moves {
                joints.push(index);
            }
        }
        scene.skeleton = Skeleton::new(rests).map_err(|error| internal(&error))?;
        let clip = Clip::new(name(choice).to_owned(), vec![0.0], tracks).map_err(|error| internal(&error))?;
        Ok(Self { joints, clip })
    }

    fn write(
        &self,
        scene: &Scene,
        output: &OutputRequest,
        space: (Axes, f64),
        (limits, control): (&Limits, &Control),
        reporter: &mut Reporter,
    ) -> Result<Output, Failure> {
        let renamed = output.options.clip_name.as_ref().map(|name| self.clip.clone().renamed(name.clone()));
        let clip = renamed.as_ref().unwrap_or(&self.clip);
        let options = WriteOptions {
            // Another clip would play instead of the pose.
            target_clips: TargetClips::Drop,
            extras: Some(serde_json::json!({ "engine": engine(), "pose": clip.name() })),
            ..output.write_options(reporter)
        };
        let name = format!("{}.{}", clip.name().replace(' ', "_"), output.format.info().endings[0]);
        if output.format.info().is_picture {
            let bytes = pictures::posed(output, scene, limits, control, reporter)?;
            return Ok(Output { format: output.format, name, bytes });
        }
        let written = formats::write_in_space(scene, &self.joints, clip, space, &options, control, reporter);
        let bytes = written.map_err(|error| Failure::from(error).in_part("target"))?;
        Ok(Output { format: output.format, name, bytes })
    }
}

const fn name(choice: PoseChoice) -> &'static str {
    match choice {
        PoseChoice::T => "T pose",
        PoseChoice::A => "A pose",
        PoseChoice::Source => "aligned pose",
        PoseChoice::Rest => "rest pose",
    }
}
