//! The `compare` subcommand: two files at the same time of their clips, at one scale or equally tall.

use std::{path::PathBuf, sync::Arc};

use crate::{
    engine::{self, Layout, PreviewOptions},
    jobs::use_small_pages,
    model::Control,
};

use super::{
    exit::Exit,
    files::{InputFile, check_place},
    limits::LimitArguments,
    outputs::Overwriting,
    view::{self, ViewArguments},
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd compare`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The file on the left, of any readable format
    #[arg(value_name = "FIRST")]
    first: PathBuf,
    /// The file on the right
    #[arg(value_name = "SECOND")]
    second: PathBuf,
    /// Output picture; the extension selects the format: .png, .webp, .gif, .apng, .mp4
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
    /// Show the first as a ghost over the second instead of side by side
    #[arg(long)]
    overlay: bool,
    #[command(flatten)]
    view: ViewArguments,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    limits: LimitArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    use_small_pages();
    let limits = arguments.limits.limits;
    check_place(&arguments.output)?;
    let inputs = [arguments.first.as_path(), arguments.second.as_path()];
    arguments.overwriting.check(inputs, [arguments.output.as_path()])?;
    let ending = view::ending(&arguments.output)?;
    let layout = if arguments.overlay { Layout::Overlay } else { Layout::SideBySide };
    let options = PreviewOptions { view: arguments.view.view(layout)?, ending, clip: None };
    let [first, second] =
        [InputFile::read("first", &arguments.first, &limits)?, InputFile::read("second", &arguments.second, &limits)?];
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let preview =
        engine::compare(first.as_named(), second.as_named(), &options, &limits, &control).map_err(|failure| {
            let files = format!("files {} and {}", first.path.display(), second.path.display());
            Exit::from_failure(&failure, &files)
        })?;
    view::write(&arguments.output, &preview)
}
