//! The main job: read, resolve, plan, run, measure, write.

use crate::{
    formats::{self, Format, FormatError, Include, Limits, TargetClips, WriteOptions},
    model::{Axes, Clip, Control, Phase, Reporter, Scene},
    retarget::{Measures, Plan, RunError, Verdict, measure, run},
    rig::{
        ClipChoice, IncludeSpec, OutputChoice, OutputSpec, ReportDetail, Resolved, RetargetSpec, Rig, SpecError,
        SpecErrorKind, SpecField, TargetClipsSpec, parse_spec, resolve, with_standing_rest,
    },
};

use super::{
    Counts, Failure, FailureCode, Inputs, Outcome, Output, Report, RigFacts, Rigs, Timings, WarningView,
    convert::{convert_clip, convert_scene, into_ours},
    edit::edited_clip,
    load::{Loaded, load},
};

/// Retargets.
///
/// # Errors
/// When an input cannot be read, the spec does not fit, there is nothing to retarget, or the work is canceled.
pub fn retarget(inputs: &Inputs<'_>, limits: &Limits, control: &Control) -> Result<Outcome, Failure> {
    let begin = control.seconds();
    let mut reporter = Reporter::new();
    control.enter(Phase::Read, 0);
    let spec = match inputs.config {
        Some(config) => parse_spec(config.bytes).map_err(in_config)?,
        None => RetargetSpec::default(),
    };
    let wanted = wanted_outputs(&spec, inputs.formats)?;
    let files = Files::load(inputs, limits, control, &mut reporter)?;
    let read_seconds = control.seconds() - begin;

    let planning = control.seconds();
    control.enter(Phase::Plan, 0);
    let spec = files.with_standing_rests(spec, &mut reporter);
    let source = files.source_side(&spec, &mut reporter)?;
    let target = files.target_side(&spec, &mut reporter)?;
    let clip = choose_clip(&spec, &files.source.scene, &mut reporter)?;
    let Resolved { mapping, spec: resolved } =
        resolve(&spec, &source, &target, clip, &mut reporter).map_err(in_config)?;
    let edited = edited_clip(&source, clip, &spec, control, &mut reporter)?;
    let clip = edited.as_ref();
    let retargeting = control.seconds();
    let plan = Plan::new(source.skeleton(), target.skeleton(), &mapping);
    control.enter(Phase::Retarget, clip.frame_count() as u64);
    let result = run(&plan, clip, control).map_err(run_failure)?;
    let retarget_seconds = control.seconds() - retargeting;

    let plan_seconds = control.seconds() - planning - retarget_seconds;

    let measuring = control.seconds();
    let measures = (spec.report.detail() != ReportDetail::None)
        .then(|| measure(&mapping, &source, &target, clip, &result, &spec.report));
    let measure_seconds = control.seconds() - measuring;

    let writing = control.seconds();
    control.enter(Phase::Write, wanted.len() as u64);
    let counts = Counts {
        frames: result.frame_count(),
        source_joints: joint_count(&files.source.scene),
        target_joints: joint_count(&files.target.scene),
        driven_joints: plan.driven_joint_count(),
    };
    let rigs = Rigs { source: facts(&source, files.source.format), target: facts(&target, files.target.format) };
    let resolved_spec = serde_json::to_value(&resolved)
        .map_err(|error| Failure::new(FailureCode::Internal, format!("the resolved spec: {error}")))?;
    let outputs = write_outputs(&wanted, &target, &result, &resolved_spec, control, &mut reporter)?;
    let warnings: Vec<WarningView> = reporter.into_warnings().into_iter().map(WarningView::from).collect();
    if spec.strict && !warnings.is_empty() {
        return Err(strict_failure(&warnings));
    }
    if let Some(failed) = measures.as_ref().filter(|measures| spec.strict && measures.verdict == Verdict::Fail) {
        return Err(strict_measures_failure(failed));
    }
    let timings = Timings {
        read_seconds,
        plan_seconds,
        retarget_seconds,
        measure_seconds,
        write_seconds: control.seconds() - writing,
        total_seconds: control.seconds() - begin,
    };
    let report = Report { timings, counts, warnings, rigs, measures };
    Ok(Outcome { outputs, report, resolved_spec })
}

struct Files {
    source: Loaded,
    target: Loaded,
    source_rest: Option<Loaded>,
    target_rest: Option<Loaded>,
}

impl Files {
    fn load(inputs: &Inputs<'_>, limits: &Limits, control: &Control, reporter: &mut Reporter) -> Result<Self, Failure> {
        let mut read = |file, part| load(file, part, limits, control, reporter);
        Ok(Self {
            source: read(inputs.source, "source")?,
            target: read(inputs.target, "target")?,
            source_rest: inputs.source_rest.map(|file| read(file, "source_rest")).transpose()?,
            target_rest: inputs.target_rest.map(|file| read(file, "target_rest")).transpose()?,
        })
    }

    /// Settles what is measured from where a file's own rest pose is none and nobody sent another.
    fn with_standing_rests(&self, mut spec: RetargetSpec, reporter: &mut Reporter) -> RetargetSpec {
        if self.source_rest.is_none() {
            spec.source = with_standing_rest("source", &self.source.scene, &spec.source, reporter);
        }
        if self.target_rest.is_none() {
            spec.target = with_standing_rest("target", &self.target.scene, &spec.target, reporter);
        }
        spec
    }

    fn source_side(&self, spec: &RetargetSpec, reporter: &mut Reporter) -> Result<Rig<'_>, Failure> {
        let rest = self.source_rest.as_ref().map(|loaded| &loaded.scene);
        Rig::new("source", &self.source.scene, rest, &spec.source, reporter)
            .map_err(|error| in_config_or(error, "source"))
    }

    fn target_side(&self, spec: &RetargetSpec, reporter: &mut Reporter) -> Result<Rig<'_>, Failure> {
        let rest = self.target_rest.as_ref().map(|loaded| &loaded.scene);
        Rig::new("target", &self.target.scene, rest, &spec.target, reporter)
            .map_err(|error| in_config_or(error, "target"))
    }
}

/// The clip that the spec names, else the first in which something moves.
pub(super) fn choose_clip<'a>(
    spec: &RetargetSpec,
    scene: &'a Scene,
    reporter: &mut Reporter,
) -> Result<&'a Clip, Failure> {
    let names = || scene.clips.iter().map(Clip::name).collect::<Vec<_>>();
    if let Some(choice) = &spec.clip {
        let found = match choice {
            ClipChoice::Index(index) => scene.clips.get(*index),
            ClipChoice::Name(name) => scene.clips.iter().find(|clip| clip.name() == name),
        };
        return found.ok_or_else(|| {
            let detail = format!("the source file has no such clip; its clips are: {}", names().join(", "));
            let wanted = if let ClipChoice::Name(name) = choice { name.as_str() } else { "" };
            let field = SpecField::new(SpecErrorKind::UnknownName, "/clip", detail).with_nearest(wanted, names());
            let error = SpecError::new(SpecErrorKind::UnknownName, field.detail.clone(), "");
            in_config(SpecError { fields: vec![field], ..error })
        });
    }
    let clip = scene.clips.iter().find(|clip| clip.is_animated());
    let moving = scene.clips.iter().filter(|clip| clip.is_animated()).count();
    if let (Some(clip), true) = (clip, moving > 1) {
        reporter.warn(
            "clip_chosen",
            "source",
            format!("the source has {moving} clips; the first, '{}', is taken", clip.name()),
            format!("name one in \"clip\": {}", names().join(", ")),
        );
    }
    clip.ok_or_else(|| {
        let detail = if scene.clips.is_empty() {
            "the source file has no animation".to_owned()
        } else {
            format!("the source file has {} clips, but nothing moves in them", scene.clips.len())
        };
        Failure::new(FailureCode::NoAnimation, detail)
            .in_part("source")
            .with_hint("send a file with an animation as the source; perhaps source and target are swapped")
    })
}

/// One output with every question answered.
pub(super) struct Wanted {
    format: Format,
    options: OutputSpec,
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
        let error = SpecError::new(SpecErrorKind::InvalidValue, field.detail.clone(), "");
        in_config(SpecError { fields: vec![field], ..error })
    })
}

fn unwritable_format(format: Format) -> Failure {
    let writable = Format::ALL.into_iter().filter(|format| format.info().writes).map(|format| format.info().name);
    Failure::new(FailureCode::UnsupportedFormat, format!("{} files can be read but not written", format.info().name))
        .with_hint(format!("ask for one of {}", writable.collect::<Vec<_>>().join(", ")))
}

pub(super) fn write_outputs(
    wanted: &[Wanted],
    target: &Rig<'_>,
    result: &Clip,
    resolved_spec: &serde_json::Value,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<Output>, Failure> {
    let extras = serde_json::json!({
        "engine": { "name": env!("CARGO_PKG_NAME"), "version": env!("CARGO_PKG_VERSION") },
        "source_clip": result.name(),
        "spec_version": resolved_spec.get("version").cloned().unwrap_or_default(),
    });
    let mut outputs = Vec::with_capacity(wanted.len());
    for output in wanted {
        control.check()?;
        let renamed = output.options.clip_name.as_ref().map(|name| result.clone().renamed(name.clone()));
        let clip = renamed.as_ref().unwrap_or(result);
        let options = WriteOptions {
            format: output.format,
            include: match output.options.include {
                IncludeSpec::Full => Include::Everything,
                IncludeSpec::SkeletonAndAnimation => Include::SkeletonAndAnimation,
            },
            target_clips: match output.options.target_clips {
                TargetClipsSpec::Keep => TargetClips::Keep,
                TargetClipsSpec::Drop => TargetClips::Drop,
            },
            extras: Some(extras.clone()),
        };
        let bytes = write_one(target, clip, &options, control, reporter)
            .map_err(|error| Failure::from(error).in_part("target"))?;
        let name = format!("{}.{}", file_stem(result.name()), output.format.info().endings[0]);
        outputs.push(Output { format: output.format, name, bytes });
        control.advance(1);
    }
    Ok(outputs)
}

/// glTF is +Y up and metres by definition, so targets that are not are turned on the way out; BVH and pose arrays keep the
/// target's own space.
fn write_one(
    target: &Rig<'_>,
    clip: &Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    let is_ours = target.scene.axes == Some(Axes::Y_UP_Z_FRONT) && target.scene.unit_metres == Some(1.0);
    let wants_ours = match options.format {
        Format::Glb | Format::Gltf | Format::Vrm | Format::Vrma | Format::Fbx => true,
        Format::PosesNpz | Format::PosesJson => target.scene.axes.is_none(),
        Format::Bvh => false,
    };
    let conversion = into_ours(target.axes, target.unit_metres);
    if is_ours || !wants_ours || conversion.is_identity() {
        return formats::write(target.scene, clip, options, control, reporter);
    }
    let scene = convert_scene(target.scene, &conversion);
    let clip = convert_clip(clip.clone(), target.scene, &conversion)
        .map_err(|error| FormatError::malformed("convert", "", error.to_string()))?;
    formats::write(&scene, &clip, options, control, reporter)
}

fn file_stem(name: &str) -> String {
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
        rest_pose_from: side.rest_source.name(),
        axes: side.axes.to_string(),
        unit_metres: side.unit_metres,
    }
}

pub(super) fn in_config(error: SpecError) -> Failure {
    let is_about_rigs = matches!(error.kind, SpecErrorKind::NothingToMap | SpecErrorKind::NoSkeleton);
    Failure::from(error).in_part(if is_about_rigs { "" } else { "config" })
}

pub(super) fn in_config_or(error: SpecError, part: &'static str) -> Failure {
    let is_about_file = error.kind == SpecErrorKind::NoSkeleton;
    Failure::from(error).in_part(if is_about_file { part } else { "config" })
}

fn run_failure(error: RunError) -> Failure {
    match error {
        RunError::Canceled(canceled) => canceled.into(),
        RunError::OutOfRange(_) => Failure::new(FailureCode::AssetMalformed, error.to_string())
            .in_part("source")
            .with_hint("check the units of both files; distances of the source are beyond any figure's size"),
    }
}

pub(super) fn strict_failure(warnings: &[WarningView]) -> Failure {
    let first = &warnings[0];
    let detail = format!(
        "strict was asked for and there are {} warnings; the first is {}: {}",
        warnings.len(),
        first.code,
        first.detail
    );
    let errors = warnings.iter().map(|warning| super::FieldError {
        pointer: String::new(),
        code: warning.code,
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
                code: name.name(),
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
