//! Editing a clip: before a retarget, and without one.

use std::borrow::Cow;

use crate::{
    editing::{
        Cycle, EditError, Margin, Mirror, TimeEditError, edit_time, edit_time_by, find_cycles, mirror_components,
        taken_out,
    },
    formats::{self, ErrorKind, FormatError},
    model::{Canceled, Clip, ClipError, Control, JointTracks, Phase, Reporter, Scene},
    retarget::{
        CycleRange, EditSpec, MirrorMode, MirrorSpec, RangeSpec, RetargetSpec, filtered, is_own_shape, parse_document,
        scheduled,
    },
    rig::{Rig, RigSpec, SpecError, SpecErrorKind, SpecField, named_joints},
};

use super::{
    Counts, EditInputs, Failure, FailureCode, Outcome, Report, RigFacts, Rigs, Timings, WarningView,
    facts::joint_count,
    files::{chosen_clip, in_config, in_config_or, load},
    layer::{laid_over, morph_rests},
    output_request::output_requests,
    outputs::{WrittenOutputs, write_outputs},
    pictures::Sights,
    provenance::Provenance,
    strict::check_strict,
    swapped_inputs,
    task_context::TaskContext,
};

/// Above this share of the figure's size, a rig whose two halves differ is worth a word.
const ASYMMETRY_WORTH_A_WORD: f64 = 0.02;

/// Edits one clip of a file. The spec's `source` tells of the rig; `target`, `map` and `ops` have nothing to say here and are warned of.
pub(super) fn edited(work: TaskContext<'_>, inputs: &EditInputs<'_>) -> Result<Outcome, Failure> {
    let TaskContext { ref spec, knowledge, limits, control, begin, mut reporter } = work;
    if inputs.unread_target {
        reporter.warn(
            "field_without_effect",
            "target",
            "a target was sent with a config that asks for an edit of the source only",
            "leave the target out, or leave out \"task\"",
        );
    }
    check_says_something(spec, inputs)?;
    let wanted = output_requests(spec, inputs.formats)?;
    let loaded = load(inputs.source, "source", limits, control, &mut reporter)?;
    let rest = inputs.source_rest.map(|file| load(file, "source_rest", limits, control, &mut reporter)).transpose()?;
    let read_seconds = control.seconds() - begin;

    let planning = control.seconds();
    control.enter(Phase::Plan, 0);
    report_idle_fields(spec, &mut reporter);
    let rest: Option<&Scene> = rest.as_ref().map(|loaded| &loaded.scene);
    let rig = Rig::with_recognizer("source", &loaded.scene, rest, &spec.source, knowledge.recognizer(), &mut reporter)
        .map_err(|error| in_config_or(error, "source"))
        .map_err(|failure| swapped_inputs::explain_rest(failure, "source", &loaded.scene, &loaded.scene, rest))?;
    let clip = chosen_clip(spec, &loaded.scene, &mut reporter, || swapped_inputs::nothing_moves(&loaded.scene))?;
    let plan_seconds = control.seconds() - planning;

    let editing = control.seconds();
    control.enter(Phase::Retarget, clip.frame_count() as u64);
    let edited = edited_clip(&rig, clip, spec, control, &mut reporter)?;
    let laid = spec.layer.as_ref().map(|layer| laid_over(&rig, &spec.source, &edited, layer, control, &mut reporter));
    let edited = laid.transpose()?.map_or(edited, Cow::Owned);
    let retarget_seconds = control.seconds() - editing;

    let writing = control.seconds();
    control.enter(Phase::Write, wanted.len() as u64);
    let resolved_spec = serde_json::to_value(RetargetSpec { pose: None, ..spec.clone() })
        .map_err(|error| Failure::new(FailureCode::Internal, format!("the resolved spec: {error}")))?;
    let edited_clip = loaded.scene.clips.iter().position(|own| std::ptr::eq(own, clip));
    let WrittenOutputs { outputs, keys } = write_outputs(
        &wanted,
        &rig,
        &edited,
        (
            &Provenance { edited_clip, ..Provenance::of(inputs.source.bytes, &resolved_spec) },
            &Sights { source: Some((&rig, clip)), measures: None, limits },
        ),
        control,
        &mut reporter,
    )?;
    let warnings: Vec<WarningView> = reporter.into_warnings().into_iter().map(WarningView::from).collect();
    if spec.strict {
        check_strict(&warnings, None)?;
    }
    let joints = joint_count(&loaded.scene);
    let animated = |tracks: &&JointTracks| {
        tracks.rotation.is_animated() || tracks.translation.is_animated() || tracks.scale.is_animated()
    };
    let driven_joints = edited.joints().iter().filter(animated).count();
    let facts = RigFacts::of(&rig, loaded.format);
    let report = Report {
        timings: Timings {
            read_seconds,
            plan_seconds,
            retarget_seconds,
            write_seconds: control.seconds() - writing,
            total_seconds: control.seconds() - begin,
            ..Timings::default()
        },
        counts: Counts { frames: edited.frame_count(), source_joints: joints, target_joints: joints, driven_joints },
        warnings,
        keys,
        rigs: Rigs { source: facts.clone(), target: facts },
        ..Report::default()
    };
    Ok(Outcome { outputs, report, resolved_spec })
}

/// Refuses a config of another tool that has no edits; one of ours may have none, for who wants another format.
fn check_says_something(spec: &RetargetSpec, inputs: &EditInputs<'_>) -> Result<(), Failure> {
    let Some(config) = inputs.config.filter(|_| spec.edit == EditSpec::default() && spec.layer.is_none()) else {
        return Ok(());
    };
    if parse_document(config.bytes).is_ok_and(|document| is_own_shape(&document)) {
        return Ok(());
    }
    Err(Failure::new(FailureCode::InvalidValue, "this config says nothing about edits")
        .in_part("config")
        .with_hint("send an object such as {\"edit\": {\"reverse\": true}}"))
}

/// Fields of the spec that only a retarget can heed.
fn report_idle_fields(spec: &RetargetSpec, reporter: &mut Reporter) {
    let idle = [
        ("target", spec.target != RigSpec::default()),
        ("map", spec.map.is_some()),
        ("ops", spec.ops.is_some()),
        ("pose", spec.pose.is_some()),
    ];
    for (field, _) in idle.into_iter().filter(|(_, given)| *given) {
        reporter.warn(
            "field_without_effect",
            format!("/{field}"),
            format!("'{field}' says how one rig drives another, and this job edits one file only"),
            "leave it out, or retarget onto a target",
        );
    }
}

/// The clip as the spec wants it; the clip itself where it asks for nothing.
///
/// # Errors
/// When an edit does not fit the clip or the rig, or the work is canceled.
pub fn edited_clip<'a>(
    rig: &Rig<'_>,
    clip: &'a Clip,
    spec: &RetargetSpec,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Cow<'a, Clip>, Failure> {
    let mut edited = Cow::Borrowed(clip);
    let edit = with_found_cycles(&spec.edit, rig, clip, control, reporter)?;
    let margin = Margin::of(&edit, clip, rig.skeleton(), control).map_err(time_failure)?;
    if !spec.edit.keeps_time() {
        let edit = margin.as_ref().map_or(edit.as_ref(), |margin| &margin.wider);
        let between_keys = |times: &[f64]| between_keys(rig.scene, clip, times, control);
        let timed = edit_time_by(clip, &between_keys, rig.skeleton(), rig.up(), edit, control).map_err(time_failure)?;
        edited = Cow::Owned(timed);
    }
    if let Some(mirror) = spec.edit.mirror.details() {
        edited = Cow::Owned(mirrored(rig, &edited, &mirror, reporter)?);
    }
    if let Some(filter) = spec.edit.filter.as_ref().filter(|filter| filter.scope.enabled) {
        let joints = match &filter.scope.mask {
            Some(names) => {
                let rig_spec = if rig.name == "source" { &spec.source } else { &spec.target };
                named_joints(rig, rig_spec, names, "/edit/filter/mask").map_err(in_config)?
            }
            None => (0..rig.skeleton().len()).collect(),
        };
        let schedule = scheduled(&filter.scope, "/edit/filter", rig.scene, &edited).map_err(in_config)?;
        let smooth = filtered(&edited, filter, schedule, joints, control)?;
        edited = Cow::Owned(smooth.map_err(|error| not_a_clip(rig, &error))?);
    }
    if let Some(Margin { cut, .. }) = margin {
        let cropped = edit_time(&edited, rig.skeleton(), rig.up(), &cut, control).map_err(time_failure)?;
        edited = Cow::Owned(cropped);
    }
    if let Some(reference) = spec.edit.additive {
        let difference = taken_out(&edited, rig.skeleton(), morph_rests(rig), reference);
        edited = Cow::Owned(difference.map_err(|error| not_a_clip(rig, &error))?);
    }
    Ok(edited)
}

/// What the curves of the clip's file say between its keys.
fn between_keys(
    scene: &Scene,
    clip: &Clip,
    times_seconds: &[f64],
    control: &Control,
) -> Result<Option<Clip>, TimeEditError> {
    let Some(index) = scene.clips.iter().position(|own| std::ptr::eq(own, clip)) else { return Ok(None) };
    match formats::evaluated(scene, index, times_seconds, control) {
        Ok(evaluated) => Ok(evaluated),
        Err(FormatError { kind: ErrorKind::Canceled, .. }) => Err(Canceled.into()),
        // Straight lines between the frames that were read take no more room than was allowed.
        Err(FormatError { kind: ErrorKind::LimitExceeded { .. }, .. }) => Ok(None),
        Err(FormatError { detail, hint, .. }) => Err(EditError { pointer: "/edit/fps".into(), detail, hint }.into()),
    }
}

/// The edits with the seconds of the cycles that they ask for, which are told.
fn with_found_cycles<'a>(
    edit: &'a EditSpec,
    rig: &Rig<'_>,
    clip: &Clip,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Cow<'a, EditSpec>, Failure> {
    let Some(RangeSpec::Cycles(CycleRange { cycles })) = &edit.range else { return Ok(Cow::Borrowed(edit)) };
    let Some(Cycle { seconds: [start, end], seam_degrees }) = find_cycles(clip, rig.skeleton(), *cycles, control)?
    else {
        // The edit itself says what is missing.
        return Ok(Cow::Borrowed(edit));
    };
    reporter.warn(
        "cycles_found",
        rig.name,
        format!(
            "{cycles} cycles were found from {start:.3} to {end:.3} s; the poses at the two ends differ by {seam_degrees:.1}° on average"
        ),
        "give edit.range in seconds for another part",
    );
    Ok(Cow::Owned(EditSpec { range: Some(RangeSpec::Seconds([start, end])), ..edit.clone() }))
}

fn not_a_clip(rig: &Rig<'_>, error: &ClipError) -> Failure {
    Failure::new(FailureCode::AssetMalformed, error.to_string()).in_part(rig.name)
}

fn mirrored(rig: &Rig<'_>, clip: &Clip, spec: &MirrorSpec, reporter: &mut Reporter) -> Result<Clip, Failure> {
    let mut pairs = Vec::with_capacity(spec.pairs.len());
    let mut fields = Vec::new();
    for (index, names) in spec.pairs.iter().enumerate() {
        let found = [0, 1].map(|end| rig.joint(&names[end], &format!("/edit/mirror/pairs/{index}/{end}")));
        match found {
            [Ok(first), Ok(second)] => pairs.push((first, second)),
            [first, second] => fields.extend([first.err(), second.err()].into_iter().flatten()),
        }
    }
    if let Some(error) = SpecError::from_fields(fields) {
        return Err(in_config(error));
    }
    let mirror = Mirror::new(rig, &pairs);
    report_asymmetry(rig, &mirror, clip, reporter);
    let mirrored = match spec.mode {
        MirrorMode::Model => mirror.apply(clip, spec.plane),
        MirrorMode::Components => mirror_components(rig, &mirror, clip, spec.center_axis, spec.pelvis_axis),
    };
    mirrored.map_err(|error| not_a_clip(rig, &error))
}

/// Says where the two halves of a rig differ, since the mirrored motion differs there too.
fn report_asymmetry(rig: &Rig<'_>, mirror: &Mirror<'_>, clip: &Clip, reporter: &mut Reporter) {
    let twins = mirror.twins();
    let skeleton = rig.skeleton();
    if let Some((joint, share)) = twins.asymmetry.filter(|(_, share)| *share > ASYMMETRY_WORTH_A_WORD) {
        reporter.warn(
            "mirror_asymmetric_rest",
            rig.name,
            format!(
                "the rest pose is not symmetric: '{}' is {:.1} % of the figure's size from where the mirror image of '{}' is",
                skeleton.label(joint),
                share * 100.0,
                skeleton.label(twins.of(joint))
            ),
            "the mirrored motion is right as a turn from the rest pose; give a symmetric rest pose for mirrored positions",
        );
    }
    let moves = |joint: &&usize| {
        let tracks = &clip.joints()[**joint];
        tracks.rotation.is_animated() || tracks.translation.is_animated()
    };
    let lonely: Vec<String> =
        twins.lonely.iter().filter(moves).map(|joint| format!("'{}'", skeleton.label(*joint))).collect();
    if !lonely.is_empty() {
        reporter.warn(
            "mirror_without_twin",
            rig.name,
            format!(
                "{} animated joints have no mirror image: {}; each mirrors its own motion",
                lonely.len(),
                first_few(&lonely)
            ),
            "name the pairs in edit.mirror.pairs",
        );
    }
}

fn first_few(names: &[String]) -> String {
    const MAX: usize = 8;
    let shown = names[..names.len().min(MAX)].join(", ");
    if names.len() > MAX { format!("{shown} and {} more", names.len() - MAX) } else { shown }
}

fn time_failure(error: TimeEditError) -> Failure {
    match error {
        TimeEditError::Canceled(canceled) => canceled.into(),
        TimeEditError::Edit(EditError { pointer, detail, hint }) => {
            let fallback = SpecError::new(SpecErrorKind::InvalidValue, detail.clone(), "");
            let field = SpecField::new(SpecErrorKind::InvalidValue, pointer, detail);
            in_config(SpecError { hint, ..SpecError::from_fields(vec![field]).unwrap_or(fallback) })
        }
    }
}
