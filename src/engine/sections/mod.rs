//! A retarget of a clip that is too long to be held: section by section, with what lies some seconds around each, on one plan.
//!
//! The rigs and the plan are made from the first section. Each further one is read, moved and measured like a clip of its own, goes over
//! from the one before it within half a second, and is written. So memory depends on the length of a section and not on that of the clip.

mod found;
mod layout;
mod seam;

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::{
    formats::{self, Budget, ClipTimes, Format, FormatError, Limits, SectionWriter, SectionedFile, WriteOptions, WriteSeek},
    model::{Clip, Control, Phase, Reporter},
    retarget::{Mapping, ReportDetail, RetargetSpec, Stack, StackResult, Task, measure, resolve},
    rig::Rig,
};

use super::{
    Counts, Failure, FailureCode, Inputs, Knowledge, NamedBytes, Outcome, Report, RigFacts, Rigs, Timings, WarningView,
    alignment::view,
    facts::joint_count,
    files::{Files, RigPair, in_config, read_spec},
    limited::limited_view,
    morphs::with_morphs,
    output_request::{OutputRequest, output_requests},
    provenance::{Provenance, digest},
    retarget_run::run_failure,
    strict::check_strict,
};
use found::Found;
use layout::{Layout, Section};
use seam::Tail;

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
    let spec = read_spec(config)?;
    let is_other_task = spec.pose.is_some() || spec.task != Task::Retarget;
    Ok(if is_other_task { Some("/task".to_owned()) } else { spec.about_whole_clip() })
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
    let spec = read_spec(others.config)?;
    if let Some(pointer) = about_whole_clip(others.config)? {
        let detail = format!("{pointer} of the config is about the whole clip, which is worked through in sections");
        let failure = Failure::new(FailureCode::InvalidValue, detail).in_part("config");
        return Err(failure.with_hint("leave it out, or cut the clip into shorter ones before"));
    }
    let formats: Vec<Format> = sinks.iter().map(|(format, _)| *format).collect();
    let wanted = output_requests(&spec, &formats)?;
    let source_sha256 = digest_of(source, control)?;
    let times = source.times().clone();
    let layout = Layout::new(&times);
    let mut reporter = Reporter::new();
    if source.has_contacts() {
        let detail = "the source says when feet touch the floor; in sections they are looked for instead";
        reporter.warn("contacts_left_out", "source", detail, "cut the clip into shorter ones to have them used");
    }
    let head = source.section(layout.sections[0].read.clone(), control)?;
    let named = NamedBytes { name: others.source.name, bytes: &head };
    let files = Files::load(&Inputs { source: named, ..others }, false, knowledge, (limits, control), &mut reporter)?;
    let read_seconds = control.seconds() - begin;

    let planning = control.seconds();
    control.enter(Phase::Plan, 0);
    let RigPair { spec, source: source_rig, target } = files.sides(spec, knowledge, &mut reporter)?;
    let first = files.choose_clip(&spec, &mut reporter)?;
    let resolved = resolve(&spec, &source_rig, &target, first, &mut reporter).map_err(in_config)?;
    let stack = Stack::new(source_rig.skeleton(), target.skeleton(), &resolved.mapping, &resolved.ops);
    let resolved_spec = serde_json::to_value(&resolved.spec)
        .map_err(|error| Failure::new(FailureCode::Internal, format!("the resolved spec: {error}")))?;
    let plan_seconds = control.seconds() - planning;

    control.enter(Phase::Retarget, layout.work());
    let provenance = Provenance { source_sha256, resolved_spec: &resolved_spec };
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
    let longest = layout.sections.iter().map(|section| section.own.len()).max().unwrap_or(0);
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
        sections: Some(SectionsView {
            count: layout.sections.len(),
            frames: longest,
            fade_frames: if layout.sections.len() > 1 { layout.fade_frames } else { 0 },
        }),
        reaches: found.reaches,
        limited: limited_view(&found.limited, target.skeleton()),
        alignment: view(&resolved.alignment, target.skeleton()),
        measures: found.measures,
        ..Report::default()
    };
    Ok(Outcome { outputs: Vec::new(), report, resolved_spec })
}

/// What all sections are worked through with, and what was found so far.
struct Work<'a> {
    rigs: (&'a Rig<'a>, &'a Rig<'a>),
    spec: &'a RetargetSpec,
    mapping: &'a Mapping,
    stack: &'a Stack,
    bounds: (&'a Limits, &'a Control),
    wanted: &'a [OutputRequest],
    writers: Vec<SectionWriter<'a>>,
    found: Found,
    timings: Timings,
}

impl Work<'_> {
    /// Moves one section after the other. `first` is the first one's clip, out of those files.
    fn through(
        &mut self,
        source: &mut dyn SectionedFile,
        (layout, times): (&Layout, &ClipTimes),
        (first, files): (&Clip, &Files),
        reporter: &mut Reporter,
    ) -> Result<(), Failure> {
        let mut tail: Option<Tail> = None;
        for (index, section) in layout.sections.iter().enumerate() {
            let reading = self.bounds.1.seconds();
            let read = match index {
                0 => None,
                _ => Some(self.read(source, section, files)?),
            };
            let clip = read.as_ref().unwrap_or(first);
            self.timings.read_seconds += self.bounds.1.seconds() - reading;
            let is_last = index + 1 == layout.sections.len();
            let result = self.section(section, clip, tail.as_ref(), times.seconds(section.read.start), reporter)?;
            let own = section.own.start - section.read.start..section.own.end - section.read.start;
            tail = (!is_last).then(|| Tail::new(result.section(own.end..own.end + layout.fade_frames)));
            let writing = self.bounds.1.seconds();
            for (writer, wanted) in self.writers.iter_mut().zip(self.wanted) {
                let own = result.section(own.clone());
                let named = wanted.options.clip_name.clone().map_or(own.clone(), |name| own.renamed(name));
                writer.add(&named, self.bounds.1, reporter).map_err(|error| Failure::from(error).in_part("target"))?;
            }
            self.timings.write_seconds += self.bounds.1.seconds() - writing;
        }
        Ok(())
    }

    /// Moves and measures one section.
    fn section(
        &mut self,
        section: &Section,
        clip: &Clip,
        tail: Option<&Tail>,
        begins_seconds: f64,
        reporter: &mut Reporter,
    ) -> Result<Clip, Failure> {
        let (limits, control) = self.bounds;
        let moving = control.seconds();
        let StackResult { clip: result, reaches, limited, .. } = self.stack.run(clip, control).map_err(run_failure)?;
        let (result, _) = with_morphs(result, clip, self.rigs, &self.spec.morphs, (limits, control), reporter)?;
        let first = section.own.start - section.read.start;
        let result = match tail {
            Some(tail) => tail.fade_into(result, first).map_err(|error| run_failure(error.into()))?,
            None => result,
        };
        self.timings.retarget_seconds += control.seconds() - moving;
        control.check()?;
        let measuring = control.seconds();
        let measures = (self.spec.report.detail() != ReportDetail::None).then(|| {
            let (source, target) = self.rigs;
            measure(self.mapping, source, target, clip, &result, &self.spec.report, &reaches)
        });
        self.found.add(section, begins_seconds, measures, (reaches, limited));
        self.timings.measure_seconds += control.seconds() - measuring;
        Ok(result)
    }

    /// The clip of a section that is not the first one.
    fn read(&self, source: &mut dyn SectionedFile, section: &Section, files: &Files) -> Result<Clip, Failure> {
        let (limits, control) = self.bounds;
        let of_source = |error: FormatError| Failure::from(error).in_part("source");
        let bytes = source.section(section.read.clone(), control).map_err(of_source)?;
        let mut warnings = Reporter::new();
        let mut budget = Budget::new(limits, control);
        let format = files.source.format;
        let mut scene = formats::read_within(&bytes, format, &mut budget, &mut warnings).map_err(of_source)?;
        // A file that is understood in another way here than at its beginning would move another figure.
        let code = "positions_from_offsets";
        let is_told = |reporter: &Reporter| reporter.warnings().iter().any(|warning| warning.code == code);
        let is_like_first = scene.skeleton == files.source.scene.skeleton && is_told(&warnings) == is_told(&files.source.warnings);
        let clip = if scene.clips.is_empty() { None } else { Some(scene.clips.swap_remove(0)) };
        match clip.filter(|clip| is_like_first && clip.frame_count() == section.read.len()) {
            Some(clip) => Ok(clip),
            None => {
                let detail = format!("from frame {} on the file reads as another skeleton than before", section.read.start);
                let failure = Failure::new(FailureCode::AssetMalformed, detail).in_part("source");
                Err(failure.with_hint("cut the clip into shorter ones, each in a file of its own"))
            }
        }
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
            return Err(failure.with_hint("ask for a GLB or a BVH without compression, or cut the clip into shorter ones"));
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
