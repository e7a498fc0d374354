//! The `retarget` subcommand: one clip onto one character, or a folder of clips, without a server.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use crate::{engine, model::Control, telemetry::monotonic_seconds};

use super::{
    exit::Exit,
    inputs::OntoPaths,
    limits::LimitArguments,
    long_clip::LongClip,
    outputs::OutputArguments,
    rows::Ended,
    verdict::Judged,
    watch::{ProgressWatch, cancel_on_interrupt},
};

/// Arguments of `retargetd retarget`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The file with the animation; '-' is standard input
    #[arg(long, value_name = "FILE", required_unless_present = "batch")]
    source: Option<PathBuf>,
    /// Many files with animations instead of one: a folder, or a text with one path on each line. In the names of outputs, {name} stands for
    /// the name of each
    #[arg(long, value_name = "FOLDER", conflicts_with = "source")]
    pub(super) batch: Option<PathBuf>,
    #[command(flatten)]
    onto: OntoPaths,
    /// Work through the clip in sections of some minutes, so that memory does not grow with its length; from a GLB or BVH to a GLB or BVH.
    /// Clips that are longer than the limits are worked through so without being asked for
    #[arg(long, conflicts_with = "batch")]
    sections: bool,
    #[command(flatten)]
    pub(super) outputs: OutputArguments,
    #[command(flatten)]
    limits: LimitArguments,
}

/// One clip; of many, `batch::run` sees to it.
pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    // The parser asks for it where there is no batch.
    let Some(source) = &arguments.source else { return Ok(()) };
    let formats = arguments.outputs.check(arguments.onto.paths_with(source))?;
    let limits = arguments.limits.limits;
    if let Some(long) = LongClip::open(source, &limits, arguments.sections)? {
        let others = arguments.onto.read_others(source, &limits)?;
        if let Some(long) = long.with(&others, &formats, source)? {
            return long.retarget(&others, &arguments.onto, (&arguments.outputs, &formats), &limits);
        }
    }
    let (files, knowledge) = arguments.onto.read(source, &limits)?;

    let control = Arc::new(Control::with_clock(monotonic_seconds));
    cancel_on_interrupt(&control);
    let watch = ProgressWatch::start(&control, arguments.outputs.destinations.progress);
    let result = engine::retarget_with(&files.inputs(&formats.distinct), &knowledge, &limits, &control);
    drop(watch);
    let outcome = result.map_err(|failure| files.exit(&failure))?;
    arguments.outputs.finish(&outcome, &formats, &control)?;
    let (counts, seconds) = (&outcome.report.counts, outcome.report.timings.total_seconds);
    let joints = format!("{} of {} target joints driven", counts.driven_joints, counts.target_joints);
    arguments.outputs.judge(&outcome, &format!("{} frames, {joints}, {seconds:.2} s", counts.frames))
}

/// One clip of a batch; its results are called after it.
pub(super) fn retarget_one(arguments: &Arguments, source: &Path, name: &str) -> Result<Ended, Exit> {
    let limits = arguments.limits.limits;
    let formats = arguments.outputs.formats()?;
    let (files, knowledge) = arguments.onto.read(source, &limits)?;
    let control = Control::with_clock(monotonic_seconds);
    let outcome = engine::retarget_with(&files.inputs(&formats.distinct), &knowledge, &limits, &control)
        .map_err(|failure| files.exit(&failure))?;
    let inputs: Vec<&Path> = arguments.onto.paths_with(source).collect();
    arguments.outputs.finish_clip(&outcome, name, &inputs, &control)?;
    Ok(Ended { judged: Judged::of(&outcome), warnings: outcome.report.warnings.len() as u64 })
}
