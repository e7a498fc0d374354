//! The main job: read, understand, transfer, write.

use crate::model::Phase;

use super::{
    Counts, Failure, FailureCode, Inputs, Outcome, Report, RigFacts, Rigs, Timings, WarningView,
    alignment::view,
    characters::{parts, together},
    facts::joint_count,
    files::{Files, RigPair},
    limited::limited_view,
    output_request::{OutputRequest, output_requests},
    outputs::{WrittenOutputs, write_outputs},
    pictures::Sights,
    provenance::Provenance,
    strict::check_strict,
    task_context::TaskContext,
    transfer::MovedJoints,
};

/// Puts the source's clip onto the target.
pub(super) fn retargeted(work: TaskContext<'_>, inputs: &Inputs<'_>) -> Result<Outcome, Failure> {
    let TaskContext { spec, knowledge, limits, control, begin, mut reporter } = work;
    let wanted = output_requests(&spec, inputs.formats)?;
    let is_source_shown = wanted.iter().any(OutputRequest::shows_source);
    let files = Files::load(inputs, is_source_shown, knowledge, (limits, control), &mut reporter)?;
    let read_seconds = control.seconds() - begin;

    let planning = control.seconds();
    control.enter(Phase::Plan, 0);
    let parts = parts(&spec, &files, knowledge)?;
    let asked = (!parts.is_empty()).then(|| spec.clone());
    let spec = parts.first().map_or(spec, |first| first.spec.clone());
    let is_strict = spec.strict;
    let RigPair { spec, source, target } = files.sides(spec, knowledge, &mut reporter)?;
    let clip = files.choose_clip(&spec, &mut reporter)?;
    let plan_seconds = control.seconds() - planning;
    let mut joints = MovedJoints::new(spec, (&source, &target), clip, control, &mut reporter)?;
    let views = together(&parts, (&files, knowledge), (&target, &mut joints.transfer), control, &mut reporter)?;
    // What was found out about one character is not to be said of all of them.
    joints.transfer.resolved = asked.unwrap_or(joints.transfer.resolved);
    let moved = joints.finished((&source, &target), (limits, control), &mut reporter)?;
    let target = match &moved.scene {
        Some(scene) => target.with_scene(scene),
        None => target,
    };

    let writing = control.seconds();
    control.enter(Phase::Write, wanted.len() as u64);
    let counts = Counts {
        frames: moved.clip.frame_count(),
        source_joints: joint_count(&files.source.scene),
        target_joints: joint_count(&files.target.scene),
        driven_joints: moved.driven_joints,
    };
    let rigs =
        Rigs { source: RigFacts::of(&source, files.source.format), target: RigFacts::of(&target, files.target.format) };
    let resolved_spec = serde_json::to_value(&moved.resolved)
        .map_err(|error| Failure::new(FailureCode::Internal, format!("the resolved spec: {error}")))?;
    let WrittenOutputs { outputs, keys } = write_outputs(
        &wanted,
        &target,
        &moved.clip,
        (
            &Provenance::of(inputs.source.bytes, &resolved_spec),
            &Sights { source: Some((&source, moved.source_clip.as_ref())), measures: moved.measures.as_ref(), limits },
        ),
        control,
        &mut reporter,
    )?;
    let warnings: Vec<WarningView> = reporter.into_warnings().into_iter().map(WarningView::from).collect();
    if is_strict {
        check_strict(&warnings, moved.measures.as_ref())?;
    }
    let timings = Timings {
        read_seconds,
        plan_seconds: plan_seconds + moved.timings.plan_seconds,
        write_seconds: control.seconds() - writing,
        total_seconds: control.seconds() - begin,
        ..moved.timings
    };
    let report = Report {
        timings,
        counts,
        warnings,
        rigs,
        contacts: moved.contacts,
        reaches: moved.reaches,
        limited: limited_view(&moved.limited, target.skeleton()),
        tuning: moved.tuning,
        characters: views,
        alignment: view(&moved.alignment, target.skeleton()),
        keys,
        face_fit: moved.face_fit,
        measures: moved.measures,
        ..Report::default()
    };
    Ok(Outcome { outputs, report, resolved_spec })
}
