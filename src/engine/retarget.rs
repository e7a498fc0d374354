//! The main job: read, resolve, plan, run, measure, write.

use std::sync::Arc;

use crate::{
    formats::{self, Compression, EulerOrder, Format, FormatError, Include, TargetClips, WriteOptions},
    model::{Axes, Clip, ClipError, Control, Phase, Reporter, Scene},
    retarget::{Measures, Verdict, measure},
    rig::{
        CompressionSpec, IncludeSpec, OutputChoice, OutputSpec, ReportDetail, RetargetSpec, Rig, SpecErrorKind,
        SpecField, TargetClipsSpec,
    },
};

use super::{
    Counts, Failure, FailureCode, Inputs, Outcome, Output, Report, RigFacts, Rigs, Timings, WarningView,
    alignment::view,
    convert::{convert_clip, convert_keys, convert_scene, into_ours},
    curves::with_curves,
    edit::edited_clip,
    files::{Files, Sides, in_config, one_field},
    keys::{KeysView, reduced},
    layer::laid_over,
    limited::limited_view,
    morphs::with_morphs,
    pass::Pass,
    performance::performance,
    provenance::Provenance,
    rest_file::RestFileView,
    tune::Subject,
    work::Work,
};

/// Puts the source's clip onto the target.
pub(super) fn retargeted(work: Work<'_>, inputs: &Inputs<'_>) -> Result<Outcome, Failure> {
    let Work { spec, knowledge, limits, control, begin, mut reporter } = work;
    let wanted = wanted_outputs(&spec, inputs.formats)?;
    let files = Files::load(inputs, limits, control, &mut reporter)?;
    let read_seconds = control.seconds() - begin;

    let planning = control.seconds();
    control.enter(Phase::Plan, 0);
    let Sides { spec, source, target } = files.sides(spec, knowledge, &mut reporter)?;
    let clip = files.choose_clip(&spec, &mut reporter)?;
    let edited = edited_clip(&source, clip, &spec, control, &mut reporter)?;
    let clip = edited.as_ref();
    let subject = Subject { source: &source, target: &target, clip, control };
    let tuning_begin = control.seconds();
    let (spec, tuning) = subject.settle(spec)?;
    let tune_seconds = control.seconds() - tuning_begin;
    control.enter(Phase::Retarget, clip.frame_count() as u64);
    let Pass { mapping, resolved, alignment, stack, result, contacts, reaches, limited, seconds: retarget_seconds } =
        Pass::run(&spec, &source, &target, clip, control, &mut reporter)?;
    let plan_seconds = control.seconds() - planning - retarget_seconds - tune_seconds;

    let measuring = control.seconds();
    let measures = (spec.report.detail() != ReportDetail::None)
        .then(|| measure(&mapping, &source, &target, clip, &result, &spec.report, &reaches));
    let measure_seconds = control.seconds() - measuring;

    let (result, face_fit) =
        with_morphs(result, clip, (&source, &target), &spec.morphs, (limits, control), &mut reporter)?;
    let curves = with_curves(&result, clip, source.scene, target.scene, &mapping.stages.curves)?;
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
        driven_joints: stack.driven_joint_count(),
    };
    let rigs = Rigs { source: facts(&source, files.source.format), target: facts(&target, files.target.format) };
    let resolved_spec = serde_json::to_value(&resolved)
        .map_err(|error| Failure::new(FailureCode::Internal, format!("the resolved spec: {error}")))?;
    let Written { outputs, keys } = write_outputs(
        &wanted,
        &target,
        &result,
        &Provenance { source: inputs.source.bytes, resolved_spec: &resolved_spec },
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
        alignment,
        keys,
        face_fit,
        measures,
    };
    Ok(Outcome { outputs, report, resolved_spec })
}

/// One output with every question answered.
pub(super) struct Wanted {
    pub(super) format: Format,
    pub(super) options: OutputSpec,
}

impl Wanted {
    /// What a writer is told, but for what the output was made from.
    pub(super) fn write_options(&self, reporter: &mut Reporter) -> WriteOptions {
        let options = &self.options;
        let compression = match options.compression {
            CompressionSpec::None => Compression::None,
            CompressionSpec::Quantized => Compression::Quantized,
            CompressionSpec::Meshopt => Compression::Meshopt,
        };
        if compression != Compression::None && !self.format.holds_gltf() && self.format != Format::Vrma {
            reporter.warn(
                "field_without_effect",
                "/output/compression",
                format!("{} files are not compressed", self.format.info().name),
                "leave it out, or take a glTF format",
            );
        }
        WriteOptions {
            include: match options.include {
                IncludeSpec::Full => Include::Everything,
                IncludeSpec::SkeletonAndAnimation => Include::SkeletonAndAnimation,
            },
            target_clips: match options.target_clips {
                TargetClipsSpec::Keep => TargetClips::Keep,
                TargetClipsSpec::Drop => TargetClips::Drop,
            },
            rotation_order: options.rotation_order.name().and_then(EulerOrder::from_name),
            compression,
            ..WriteOptions::new(self.format)
        }
    }
}

pub(super) fn wanted_outputs(spec: &RetargetSpec, formats: &[Format]) -> Result<Vec<Wanted>, Failure> {
    let specified = match &spec.output {
        None => vec![OutputSpec::default()],
        Some(OutputChoice::One(output)) => vec![output.clone()],
        Some(OutputChoice::Many(outputs)) => outputs.clone(),
    };
    let wanted = if formats.is_empty() {
        let mut wanted = Vec::new();
        for (index, options) in specified.into_iter().enumerate() {
            let format = match options.format.as_deref() {
                None => Format::Glb,
                Some(name) => format_named(name, index)?,
            };
            wanted.push(Wanted { format, options });
        }
        wanted
    } else {
        let options = specified.first().cloned().unwrap_or_default();
        formats.iter().map(|format| Wanted { format: *format, options: options.clone() }).collect()
    };
    match wanted.iter().find(|wanted| !wanted.format.info().writes) {
        Some(unwritable) => Err(unwritable_format(unwritable.format)),
        None => Ok(wanted),
    }
}

fn format_named(name: &str, index: usize) -> Result<Format, Failure> {
    Format::from_name(name).ok_or_else(|| {
        let writable = Format::ALL.into_iter().filter(|format| format.info().writes).map(|format| format.info().name);
        let known: Vec<&str> = writable.collect();
        let detail = format!("there is no output format '{name}'; there are {}", known.join(", "));
        let field = SpecField::new(SpecErrorKind::InvalidValue, format!("/output/{index}/format"), detail);
        let field = field.with_nearest(name, known);
        in_config(one_field(field))
    })
}

fn unwritable_format(format: Format) -> Failure {
    let writable = Format::ALL.into_iter().filter(|format| format.info().writes).map(|format| format.info().name);
    Failure::new(FailureCode::UnsupportedFormat, format!("{} files can be read but not written", format.info().name))
        .with_hint(format!("ask for one of {}", writable.collect::<Vec<_>>().join(", ")))
}

/// The files, and how many keys those have that hold only what is needed.
pub(super) struct Written {
    pub(super) outputs: Vec<Output>,
    pub(super) keys: Vec<KeysView>,
}

pub(super) fn write_outputs(
    wanted: &[Wanted],
    target: &Rig<'_>,
    result: &Clip,
    provenance: &Provenance<'_>,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Written, Failure> {
    let extras = provenance.extras(result, target.skeleton());
    let (mut outputs, mut keys) = (Vec::with_capacity(wanted.len()), Vec::new());
    for output in wanted {
        control.check()?;
        let reduced = reduced(target, result, output, control, reporter)?;
        let result = reduced.as_ref().map_or(result, |(clip, _)| clip);
        keys.extend(reduced.as_ref().map(|(_, view)| view.clone()));
        let renamed = output.options.clip_name.as_ref().map(|name| result.clone().renamed(name.clone()));
        let clip = renamed.as_ref().unwrap_or(result);
        let holds_curves = output.format.holds_gltf() || matches!(output.format, Format::PosesNpz | Format::PosesJson);
        let options = WriteOptions { extras: Some(extras.clone()), ..output.write_options(reporter) };
        let moved = clip.morphs().iter().map(|track| track.morph);
        let (properties, morphs): (Vec<usize>, Vec<usize>) =
            moved.partition(|morph| target.scene.morphs[*morph].is_property());
        let holds = |morph: &&usize| formats::holds_morph(target.scene, **morph, output.format, options.include);
        let lost = morphs.len() - morphs.iter().filter(holds).count();
        if !properties.is_empty() && !holds_curves {
            reporter.warn(
                "curves_not_written",
                output.format.info().name,
                format!("{} custom properties are not in this output", properties.len()),
                "take pose arrays or a glTF format, or leave the curves op out",
            );
        }
        if lost > 0 {
            reporter.warn(
                "morphs_not_written",
                output.format.info().name,
                format!("the weights of {lost} morphs are not in this output"),
                "take pose arrays, or the format of the target with everything of it, or set morphs.enabled to false",
            );
        }
        let bytes = write_one(target, clip, &options, control, reporter)?;
        let name = format!("{}.{}", file_stem(result.name()), output.format.info().endings[0]);
        outputs.push(Output { format: output.format, name, bytes });
        control.advance(1);
    }
    Ok(Written { outputs, keys })
}

/// glTF is +Y up and metres by definition, so targets that are not are turned on the way out; BVH and pose arrays keep the
/// target's own space.
fn write_one(
    target: &Rig<'_>,
    clip: &Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, Failure> {
    let in_target = |error| Failure::from(error).in_part("target");
    if options.format == Format::Vrma {
        let (humanoid, clip) = performance(target, clip, control, reporter)?;
        return formats::write(&humanoid, &clip, options, control, reporter).map_err(in_target);
    }
    let is_ours = target.scene.axes == Some(Axes::Y_UP_Z_FRONT) && target.scene.unit_metres == Some(1.0);
    let wants_ours = match options.format {
        Format::Glb | Format::Gltf | Format::Vrm | Format::Zip | Format::Fbx | Format::PositionsCsv => true,
        Format::PosesNpz | Format::PosesJson => target.scene.axes.is_none(),
        // The first is taken care of, and neither of the latter two is written.
        Format::Vrma | Format::Bvh | Format::BodyModel | Format::JointPositions => false,
    };
    let conversion = into_ours(target.axes, target.unit_metres);
    if is_ours || !wants_ours || conversion.is_identity() {
        return formats::write(target.scene, clip, options, control, reporter).map_err(in_target);
    }
    let not_a_clip = |error: ClipError| in_target(FormatError::malformed("convert", "", error.to_string()));
    let mut scene = convert_scene(target.scene, &conversion);
    if options.target_clips == TargetClips::Keep {
        let clips = target.scene.clips.iter().map(|clip| convert_clip(clip.clone(), target.scene, &conversion));
        scene.clips = clips.collect::<Result<_, _>>().map_err(not_a_clip)?;
    }
    let keys = clip.sparse_keys().map(|keys| Arc::new(convert_keys(keys, target.scene, &conversion)));
    let clip = convert_clip(clip.clone(), target.scene, &conversion).map_err(not_a_clip)?;
    let clip = match keys {
        Some(keys) => clip.with_sparse_keys(keys),
        None => clip,
    };
    formats::write(&scene, &clip, options, control, reporter).map_err(in_target)
}

pub(super) fn file_stem(name: &str) -> String {
    let keep = |letter: char| if letter.is_alphanumeric() || "-_ .".contains(letter) { letter } else { '_' };
    let stem: String = name.chars().map(keep).take(80).collect();
    let stem = stem.trim_matches([' ', '.']).to_owned();
    if stem.is_empty() { "retargeted".to_owned() } else { stem }
}

pub(super) fn joint_count(scene: &Scene) -> usize {
    scene.skeleton.joints().iter().filter(|joint| joint.is_joint).count()
}

pub(super) fn facts(side: &Rig<'_>, format: Format) -> RigFacts {
    RigFacts {
        format: format.info().name,
        recognised_as: side.recognition.recognised_as.clone(),
        confidence: side.recognition.confidence,
        rest_pose: side.recognition.rest_pose.name(),
        rest_pose_from: side.rest_source.name(),
        rest_pose_reason: side.rest_reason.clone(),
        rest_file: RestFileView::of(side),
        axes: side.axes.to_string(),
        unit_metres: side.unit_metres,
    }
}

/// What `strict` means, of a config and on the command line: no warnings, and no measure that fails.
///
/// # Errors
/// When there is a warning, or a measure fails.
pub fn check_strict(warnings: &[WarningView], measures: Option<&Measures>) -> Result<(), Failure> {
    if !warnings.is_empty() {
        return Err(strict_failure(warnings));
    }
    match measures.filter(|measures| measures.verdict == Verdict::Fail) {
        Some(failed) => Err(strict_measures_failure(failed)),
        None => Ok(()),
    }
}

fn strict_failure(warnings: &[WarningView]) -> Failure {
    let first = &warnings[0];
    let detail = format!(
        "strict was asked for and there are {} warnings; the first is {}: {}",
        warnings.len(),
        first.code,
        first.detail
    );
    let errors = warnings.iter().map(|warning| super::FieldError {
        pointer: String::new(),
        code: warning.code.into(),
        detail: format!("{}: {}", warning.place, warning.detail),
        did_you_mean: Vec::new(),
    });
    Failure::new(FailureCode::StrictWarnings, detail)
        .with_hint("mend what the warnings name, or leave strict out")
        .with_errors(errors.collect())
}

fn strict_measures_failure(measures: &Measures) -> Failure {
    let failed = measures.metrics.iter().filter(|(_, metric)| metric.verdict == Verdict::Fail);
    let errors: Vec<super::FieldError> = failed
        .map(|(name, metric)| {
            let value = metric.value.unwrap_or_default();
            let worst = metric.worst.first();
            let place =
                worst.map_or_else(String::new, |worst| format!("; worst at frame {}, '{}'", worst.frame, worst.joint));
            super::FieldError {
                pointer: format!("/report/thresholds/{}", name.name()),
                code: name.name().into(),
                detail: format!("{value} {} where {} is the most{place}", metric.unit, metric.fail_above),
                did_you_mean: Vec::new(),
            }
        })
        .collect();
    let first = errors.first().map(|error| format!("{}: {}", error.code, error.detail)).unwrap_or_default();
    Failure::new(
        FailureCode::StrictMeasures,
        format!("strict was asked for and {} measures fail; the first is {first}", errors.len()),
    )
    .with_hint("look at the report without strict, or set report.thresholds to what is good enough for you")
    .with_errors(errors)
}
