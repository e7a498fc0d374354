//! The `pose` subcommand: a character in a T pose, an A pose or the pose of another one, as a file.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use serde_json::json;

use crate::{
    engine::{self, Knowledge, PoseChoice, PoseInputs, Task},
    model::Control,
    telemetry::monotonic_seconds,
};

use super::{
    exit::{BAD_USAGE, Exit, FAILED, report, say},
    files::{InputFile, StagedFiles, check_place},
    limits::LimitArguments,
    outputs::{Overwriting, check_strict, output_format, tell_warnings},
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd pose`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The file with the character
    #[arg(long, value_name = "FILE")]
    input: PathBuf,
    /// The pose: 't', 'a', 'rest' (its own, with the config's edits), or a file whose rest pose it takes
    #[arg(long, value_name = "t|a|rest|FILE", default_value = "t")]
    to: String,
    /// The character in its rest pose, if its file does not contain it
    #[arg(long, value_name = "FILE")]
    rest: Option<PathBuf>,
    /// A retarget config (JSON or YAML); the character is its target
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Output file; the extension selects the format
    #[arg(long, value_name = "FILE")]
    output: PathBuf,
    /// Fail and write nothing if there is a warning; same as "strict": true in the config
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    limits: LimitArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    let format = output_format(&arguments.output)?;
    check_place(&arguments.output)?;
    let inputs = [Some(&arguments.input), arguments.rest.as_ref(), arguments.config.as_ref()];
    let inputs = inputs.into_iter().flatten().map(PathBuf::as_path).chain([Path::new(&arguments.to)]);
    arguments.overwriting.check(inputs, [arguments.output.as_path()])?;
    let limits = arguments.limits.limits;
    let input = InputFile::read("input", &arguments.input, &limits)?;
    let choices = [("t", PoseChoice::T), ("a", PoseChoice::A), ("rest", PoseChoice::Rest)];
    let choice = choices.into_iter().find(|(name, _)| *name == arguments.to);
    let model = match choice {
        Some(_) => None,
        None if Path::new(&arguments.to).exists() => Some(InputFile::read("to", Path::new(&arguments.to), &limits)?),
        None => {
            let message = format!("--to {}: this is neither t, a, rest nor a file that is there", arguments.to);
            return Err(Exit::new(BAD_USAGE, message, "use --to t, --to a, --to rest, or name a file"));
        }
    };
    let optional =
        |part: &str, path: &Option<PathBuf>| path.as_ref().map(|path| InputFile::read(part, path, &limits)).transpose();
    let (rest, config) = (optional("rest", &arguments.rest)?, optional("config", &arguments.config)?);
    let task = Task::Pose(PoseInputs {
        target: input.as_named(),
        target_rest: rest.as_ref().map(InputFile::as_named),
        source: model.as_ref().map(InputFile::as_named),
        source_rest: None,
        to: Some(choice.map_or(PoseChoice::Source, |(_, choice)| choice)),
        config: config.as_ref().map(InputFile::as_named),
        formats: &[format],
    });
    let control = Arc::new(Control::with_clock(monotonic_seconds));
    cancel_on_interrupt(&control);
    let outcome = engine::run(&task, &Knowledge::default(), &limits, &control).map_err(|failure| {
        let file = match failure.part {
            "source" => model.as_ref().map(|model| format!("to {}", model.path.display())),
            "target" => Some(format!("input {}", input.path.display())),
            "target_rest" => rest.as_ref().map(|rest| format!("rest {}", rest.path.display())),
            _ => None,
        };
        Exit::from_failure(&failure, &file.unwrap_or_else(|| failure.part.to_owned()))
    })?;
    tell_warnings(&outcome);
    check_strict(arguments.strict, &outcome)?;
    let output = outcome.outputs.first().ok_or_else(|| Exit::new(FAILED, "the engine gave no output", ""))?;
    let mut staged = StagedFiles::default();
    staged.add(&arguments.output, &output.bytes)?;
    control.check().map_err(|canceled| Exit::from_failure(&canceled.into(), ""))?;
    staged.commit()?;
    let (counts, facts) = (&outcome.report.counts, &outcome.report.rigs.target);
    say(format_args!(
        "wrote {}: {} of {} joints turned, from a rest pose of the kind {} ({})",
        arguments.output.display(),
        counts.driven_joints,
        counts.target_joints,
        facts.rest_pose,
        facts.rest_pose_from
    ));
    report(|| json!({"output": arguments.output, "counts": counts, "warnings": outcome.report.warnings}))
}
