//! The main job: read, resolve, plan, run, measure, write.

use crate::{
    model::Phase,
    retarget::{ReportDetail, measure},
    rig::Rig,
};

use super::{
    Counts, Failure, FailureCode, Inputs, Outcome, Report, RigFacts, Rigs, Timings, WarningView,
    alignment::view,
    characters::{Ensemble, parts, together},
    curves::with_curves,
    edit::edited_clip,
    facts::joint_count,
    files::{Files, Sides},
    layer::laid_over,
    limited::limited_view,
    morphs::with_morphs,
    outputs::{Written, write_outputs},
    pass::Pass,
    pictures::Sights,
    provenance::Provenance,
    strict::check_strict,
    tune::Subject,
    wanted::{Wanted, wanted_outputs},
    work::Work,
};

/// Puts the source's clip onto the target.
pub(super) fn retargeted(work: Work<'_>, inputs: &Inputs<'_>) -> Result<Outcome, Failure> {
    let Work { spec, knowledge, limits, control, begin, mut reporter } = work;
    let wanted = wanted_outputs(&spec, inputs.formats)?;
    let files = Files::load(inputs, wanted.iter().any(Wanted::shows_source), (limits, control), &mut reporter)?;
    let read_seconds = control.seconds() - begin;

    let planning = control.seconds();
    control.enter(Phase::Plan, 0);
    let parts = parts(&spec, &files, knowledge)?;
    let asked = (!parts.is_empty()).then(|| spec.clone());
    let spec = parts.first().map_or(spec, |first| first.spec.clone());
    let Sides { spec, source, target } = files.sides(spec, knowledge, &mut reporter)?;
    let clip = files.choose_clip(&spec, &mut reporter)?;
    let edited = edited_clip(&source, clip, &spec, control, &mut reporter)?;
    let clip = edited.as_ref();
    let subject = Subject { source: &source, target: &target, clip, control };
    let tuning_begin = control.seconds();
    let (spec, tuning) = subject.settle(spec)?;
    let tune_seconds = control.seconds() - tuning_begin;
    control.enter(Phase::Retarget, clip.frame_count() as u64);
    let Pass {
        mapping,
        ops,
        resolved,
        alignment,
        stack,
        result,
        contacts,
        reaches,
        limited,
        seconds: retarget_seconds,
    } = Pass::run(&spec, &source, &target, clip, control, &mut reporter)?;
    let plan_seconds = control.seconds() - planning - retarget_seconds - tune_seconds;

    let measuring = control.seconds();
    let measures = (spec.report.detail() != ReportDetail::None)
        .then(|| measure(&mapping, &source, &target, clip, &result, &spec.report, &reaches));
    let measure_seconds = control.seconds() - measuring;
    let first = (&target, result, stack.driven_joint_count(), measures);
    let Ensemble { result, driven_joints, measures, views } =
        together(&parts, (&files, knowledge), first, control, &mut reporter)?;
    // What was found out about one character is not to be said of all of them.
    let resolved = asked.unwrap_or(resolved);

    let (result, face_fit) =
        with_morphs(result, clip, (&source, &target), &spec.morphs, (limits, control), &mut reporter)?;
    let curves = with_curves(&result, clip, source.scene, target.scene, &ops.curves)?;
    let (scene, result) = curves.map_or((None, result), |(scene, result)| (Some(scene), result));
    let target = match &scene {
        Some(scene) => Rig { scene, ..target },
        None => target,
    };
    let result = match &spec.layer {
        Some(layer) => laid_over(&target, &spec.target, &result, layer, control, &mut reporter)?,
        None => result,
    };
    let writing = control.seconds();
    control.enter(Phase::Write, wanted.len() as u64);
    let counts = Counts {
        frames: result.frame_count(),
        source_joints: joint_count(&files.source.scene),
        target_joints: joint_count(&files.target.scene),
        driven_joints,
    };
    let rigs =
        Rigs { source: RigFacts::of(&source, files.source.format), target: RigFacts::of(&target, files.target.format) };
    let resolved_spec = serde_json::to_value(&resolved)
        .map_err(|error| Failure::new(FailureCode::Internal, format!("the resolved spec: {error}")))?;
    let Written { outputs, keys } = write_outputs(
        &wanted,
        &target,
        &result,
        (
            &Provenance { source: inputs.source.bytes, resolved_spec: &resolved_spec },
            &Sights { source: Some((&source, clip)), measures: measures.as_ref(), limits },
        ),
        control,
        &mut reporter,
    )?;
    let warnings: Vec<WarningView> = reporter.into_warnings().into_iter().map(WarningView::from).collect();
    if spec.strict {
        check_strict(&warnings, measures.as_ref())?;
    }
    let timings = Timings {
        read_seconds,
        plan_seconds,
        tune_seconds,
        retarget_seconds,
        measure_seconds,
        write_seconds: control.seconds() - writing,
        total_seconds: control.seconds() - begin,
    };
    let alignment = view(&alignment, target.skeleton());
    let limited = limited_view(&limited, target.skeleton());
    let report = Report {
        timings,
        counts,
        warnings,
        rigs,
        contacts,
        reaches,
        limited,
        tuning,
        characters: views,
        alignment,
        keys,
        face_fit,
        measures,
        ..Report::default()
    };
    Ok(Outcome { outputs, report, resolved_spec })
}
