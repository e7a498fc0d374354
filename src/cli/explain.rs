//! The `explain` subcommand: why a joint of the result is turned as it is at one frame.

use std::sync::Arc;

use crate::{
    engine::{self, Question},
    model::Control,
};

use super::{
    exit::{Exit, print, to_json},
    inputs::InputPaths,
    limits::LimitArguments,
    manner::speaks_json,
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd explain`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    inputs: InputPaths,
    /// The frame, from 0
    #[arg(long, value_name = "N")]
    frame: usize,
    /// The joint of the target, by name or #<node index>
    #[arg(long, value_name = "NAME")]
    joint: String,
    #[command(flatten)]
    limits: LimitArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    let limits = arguments.limits.limits;
    let (files, knowledge) = arguments.inputs.read(&limits)?;
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let question = Question { frame: arguments.frame, joint: &arguments.joint };
    let explanation = engine::explain(&files.inputs(&[]), &question, &knowledge, &limits, &control)
        .map_err(|failure| with_flags(files.exit(&failure)))?;
    if speaks_json() {
        return print(&format!("{}\n", to_json(&explanation)?.trim_end()));
    }
    print(&explanation.to_string())
}

/// What the question is called here, where no document has it.
fn with_flags(exit: Exit) -> Exit {
    let message = ["frame", "joint"].into_iter().fold(exit.message, |message, field| {
        message.strip_prefix(&format!("/{field}: ")).map(|rest| format!("--{field}: {rest}")).unwrap_or(message)
    });
    Exit { message, ..exit }
}
