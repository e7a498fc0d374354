//! A retarget of a clip that is too long to be held: section by section, with what lies some seconds around each, on one plan.
//!
//! The rigs and the plan are made from the first section. Each further one is read, moved and measured like a clip of its own, goes over
//! from the one before it within half a second, and is written. So memory depends on the length of a section and not on that of the clip.

mod found;
mod layout;
mod seam;
mod work;

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::{
    formats::{ClipTimes, Format, Limits, SectionWriter, SectionedFile, WriteOptions, WriteSeek},
    model::{Clip, Control, Phase, Reporter},
    retarget::{RetargetSpec, Stack, Task, resolve},
    rig::Rig,
};

use super::{
    Counts, Failure, FailureCode, Inputs, Knowledge, NamedBytes, Outcome, Report, RigFacts, Rigs, Timings, WarningView,
    alignment::view,
    facts::joint_count,
    files::{Files, RigPair, in_config, read_spec},
    limited::limited_view,
    output_request::{OutputRequest, output_requests},
    provenance::{Provenance, digest},
    retarget_run::run_failure,
    strict::check_strict,
    task::warn_of_empty_config,
};
use found::Found;
use layout::Layout;
use work::Work;

/// Bytes of the source that are digested at once.
const BYTES_AT_ONCE: usize = 1 << 18;

/// How a long clip was worked through.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SectionsView {
    /// How many sections there were.
    pub count: usize,
    /// Frames of the longest, without those that are looked at around it.
    pub frames: usize,
    /// Frames over which two of them go over into one another.
    pub fade_frames: usize,
}

/// A long clip, and where what is made of it goes.
pub struct SectionedInputs<'a> {
    /// The file with the clip.
    pub source: &'a mut dyn SectionedFile,
    /// Its name, the character and the config; what `source` and `formats` have is not looked at.
    pub others: Inputs<'a>,
    /// The results: of each its format and a place. What is there when the retarget fails is of no use.
    pub sinks: Vec<(Format, &'a mut dyn WriteSeek)>,
}

/// Whether a config asks for something that is found only where the whole clip is at hand: a JSON pointer.
///
/// # Errors
/// When it is none.
pub fn about_whole_clip(config: Option<NamedBytes<'_>>) -> Result<Option<String>, Failure> {
    Ok(pointer_about_whole_clip(&read_spec(config)?))
}

fn pointer_about_whole_clip(spec: &RetargetSpec) -> Option<String> {
    let is_other_task = spec.pose.is_some() || spec.task != Task::Retarget;
    if is_other_task { Some("/task".to_owned()) } else { spec.about_whole_clip() }
}

/// Retargets a long clip. The outcome has no files, since they are where `sinks` say.
///
/// Beside those of the whole clip its report has no contacts and no values over time; measures are those of the section in which each is worst.
///
/// # Errors
/// As [`super::run`]; and when a format or the config needs the whole clip, or a file cannot be written.
pub fn retarget_in_sections(
    inputs: SectionedInputs<'_>,
    knowledge: &Knowledge,
    limits: &Limits,
    control: &Control,
) -> Result<Outcome, Failure> {
    let SectionedInputs { source, others, sinks } = inputs;
    let begin = control.seconds();
    control.enter(Phase::Read, 0);
    let mut reporter = Reporter::new();
    let spec = spec_for_sections(others.config, &mut reporter)?;
    let formats: Vec<Format> = sinks.iter().map(|(format, _)| *format).collect();
    let wanted = output_requests(&spec, &formats)?;
    let source_sha256 = digest_of(source, control)?;
    let times = source.times().clone();
    let layout = Layout::new(&times);
    warn_of_contacts(source, &mut reporter);
    let head = source.section(layout.sections[0].read.clone(), control)?;
    let named = NamedBytes { name: others.source.name, bytes: &head };
    let files = Files::load(&Inputs { source: named, ..others }, false, knowledge, (limits, control), &mut reporter)?;
    let read_seconds = control.seconds() - begin;

    let planning = control.seconds();
    control.enter(Phase::Plan, 0);
    let RigPair { spec, source: source_rig, target } = files.sides(spec, knowledge, &mut reporter)?;
    let first = files.choose_clip(&spec, &mut reporter)?;
    warn_of_morphs(first, &mut reporter);
    let resolved = resolve(&spec, &source_rig, &target, first, &mut reporter).map_err(in_config)?;
    let stack = Stack::new(source_rig.skeleton(), target.skeleton(), &resolved.mapping, &resolved.ops);
    let resolved_spec = serde_json::to_value(&resolved.spec)
        .map_err(|error| Failure::new(FailureCode::Internal, format!("the resolved spec: {error}")))?;
    let plan_seconds = control.seconds() - planning;

    control.enter(Phase::Retarget, layout.work());
    let provenance = Provenance { source_sha256, resolved_spec: &resolved_spec, edited_clip: None };
    let writers = writers(sinks, &wanted, &times, (&target, first, &provenance), &mut reporter)?;
    let mut work = Work {
        rigs: (&source_rig, &target),
        spec: &spec,
        mapping: &resolved.mapping,
        stack: &stack,
        bounds: (limits, control),
        wanted: &wanted,
        writers,
        found: Found::default(),
        timings: Timings { read_seconds, plan_seconds, ..Timings::default() },
    };
    work.through(source, (&layout, &times), (first, &files), &mut reporter)?;
    let Work { writers, found, timings, .. } = work;
    let warnings: Vec<WarningView> = reporter.into_warnings().into_iter().map(WarningView::from).collect();
    if spec.strict {
        check_strict(&warnings, found.measures.as_ref())?;
    }
    control.check()?;
    writers.into_iter().try_for_each(SectionWriter::finish)?;
    let report = Report {
        timings: Timings { total_seconds: control.seconds() - begin, ..timings },
        counts: Counts {
            frames: times.frames(),
            source_joints: joint_count(&files.source.scene),
            target_joints: joint_count(&files.target.scene),
            driven_joints: stack.driven_joint_count(),
        },
        warnings,
        rigs: Rigs {
            source: RigFacts::of(&source_rig, files.source.format),
            target: RigFacts::of(&target, files.target.format),
        },
        sections: Some(layout.view()),
        reaches: found.reaches,
        limited: limited_view(&found.limited, target.skeleton()),
        alignment: view(&resolved.alignment, target.skeleton()),
        measures: found.measures,
        ..Report::default()
    };
    Ok(Outcome { outputs: Vec::new(), report, resolved_spec })
}

/// The spec, where it asks for nothing that is about the whole clip.
fn spec_for_sections(config: Option<NamedBytes<'_>>, reporter: &mut Reporter) -> Result<RetargetSpec, Failure> {
    warn_of_empty_config(config, reporter);
    let spec = read_spec(config)?;
    let Some(pointer) = pointer_about_whole_clip(&spec) else { return Ok(spec) };
    let detail = format!("{pointer} of the config is about the whole clip, which is worked through in sections");
    let failure = Failure::new(FailureCode::InvalidValue, detail).in_part("config");
    Err(failure.with_hint("leave it out, or cut the clip into shorter ones before"))
}

fn warn_of_contacts(source: &dyn SectionedFile, reporter: &mut Reporter) {
    if source.has_contacts() {
        let detail = "the source says when feet touch the floor; in sections they are looked for instead";
        reporter.warn("contacts_left_out", "source", detail, "cut the clip into shorter ones to have them used");
    }
}

/// Which morphs of a face move is found out of a whole clip.
fn warn_of_morphs(clip: &Clip, reporter: &mut Reporter) {
    let count = clip.morphs().len();
    if count > 0 {
        let detail = format!(
            "the weights of {count} morphs are not in the outputs of a clip that is worked through in sections"
        );
        reporter.warn("morphs_not_written", "source", detail, "cut the clip into shorter ones to have faces moved");
    }
}

/// What writes each result.
fn writers<'a, 's: 'a>(
    sinks: Vec<(Format, &'s mut dyn WriteSeek)>,
    wanted: &[OutputRequest],
    times: &ClipTimes,
    (target, clip, provenance): (&'a Rig<'_>, &Clip, &Provenance<'_>),
    reporter: &mut Reporter,
) -> Result<Vec<SectionWriter<'a>>, Failure> {
    let head = clip.section(0..1).with_contacts(Vec::new()).map_err(|error| run_failure(error.into()))?;
    let extras = provenance.extras(&head, target.skeleton());
    let mut writers = Vec::with_capacity(sinks.len());
    for ((format, sink), wanted) in sinks.into_iter().zip(wanted) {
        let options = WriteOptions { extras: Some(extras.clone()), ..wanted.write_options(reporter) };
        let space = (target.axes, target.unit_meters);
        let writer = SectionWriter::new(target.scene, space, options, times.clone(), sink);
        let Some(writer) = writer else {
            let detail = format!("a {} of these options cannot be written in sections", format.info().name);
            let failure = Failure::new(FailureCode::UnsupportedFormat, detail);
            return Err(
                failure.with_hint("ask for a GLB or a BVH without compression, or cut the clip into shorter ones")
            );
        };
        writers.push(writer);
    }
    Ok(writers)
}

/// The digest of the whole file.
fn digest_of(source: &mut dyn SectionedFile, control: &Control) -> Result<String, Failure> {
    let failed = |error: std::io::Error| {
        Failure::new(FailureCode::AssetMalformed, format!("the file cannot be read: {error}")).in_part("source")
    };
    let reader = source.reader();
    reader.rewind().map_err(failed)?;
    let mut hasher = Sha256::new();
    let mut bytes = vec![0; BYTES_AT_ONCE];
    loop {
        control.check()?;
        match reader.read(&mut bytes).map_err(failed)? {
            0 => return Ok(digest(hasher)),
            read => hasher.update(&bytes[..read]),
        }
    }
}
