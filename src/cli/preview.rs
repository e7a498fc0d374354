//! The `preview` subcommand: what a file looks like.

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

/// Arguments of `retargetd preview`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The file to show, of any readable format
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Output picture; the extension selects the format: .png, .webp, .gif, .apng, .mp4
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    view: ViewArguments,
    /// The clip to show; default the first that moves
    #[arg(long, value_name = "NAME")]
    clip: Option<String>,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    limits: LimitArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    use_small_pages();
    let limits = arguments.limits.limits;
    check_place(&arguments.output)?;
    arguments.overwriting.check([arguments.file.as_path()], [arguments.output.as_path()])?;
    let ending = view::ending(&arguments.output)?;
    let view = arguments.view.view(Layout::Single)?;
    let options = PreviewOptions { view, ending, clip: arguments.clip.clone() };
    let file = InputFile::read("file", &arguments.file, &limits)?;
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let preview = engine::preview(file.as_named(), &options, &limits, &control)
        .map_err(|failure| Exit::from_failure(&failure, &format!("file {}", file.path.display())))?;
    view::write(&arguments.output, &preview)
}
