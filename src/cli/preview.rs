//! The `preview` subcommand: what a file looks like.

use std::{path::PathBuf, process::ExitCode, sync::Arc};

use clap::ValueEnum;

use crate::{
    engine::{self, Background, CameraKind, Follow, PreviewOptions, SheetSize, Style, View},
    formats::Limits,
    model::Control,
};

use super::{
    exit::{BAD_USAGE, Exit, say},
    files::{InputFile, StagedFiles, check_place},
    outputs::Overwriting,
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd preview`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The file to look at: any that can be read
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Where the picture goes; the ending picks the format: .png, .webp, .gif, .apng
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
    /// Width and height in pixels, as 512 or 640x360; of a sheet, those of each cell
    #[arg(long, value_name = "PIXELS", default_value = "512", value_parser = size)]
    size: [usize; 2],
    /// From where the figure is seen
    #[arg(long, value_enum, default_value = "three-quarter")]
    camera: CameraName,
    /// Whether the camera goes along with the figure
    #[arg(long, value_enum, default_value = "auto")]
    follow: FollowName,
    /// Turn the camera around the figure by so many degrees from the first frame to the last
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    turn: f64,
    /// Frames per second of what moves; default 15 for GIF, 30 otherwise
    #[arg(long)]
    fps: Option<f64>,
    /// Start and end of what is shown, in seconds, as 1.5,3
    #[arg(long, value_name = "START,END", value_parser = range)]
    range: Option<[f64; 2]>,
    /// A still at this second of the clip; default the middle
    #[arg(long, value_name = "SECONDS")]
    at: Option<f64>,
    /// A sheet of stills over the whole clip, as 4x3
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = sheet)]
    sheet: Option<SheetSize>,
    /// What is behind the figure
    #[arg(long, value_enum, default_value = "light")]
    background: BackgroundName,
    /// What of the figure is drawn
    #[arg(long, value_enum, default_value = "shaded")]
    style: StyleName,
    /// The clip that is shown; default the first that moves
    #[arg(long, value_name = "NAME")]
    clip: Option<String>,
    /// Write the time on the picture
    #[arg(long)]
    labels: bool,
    /// Draw no floor
    #[arg(long)]
    no_floor: bool,
    #[command(flatten)]
    overwriting: Overwriting,
}

/// The words of the command line for a choice of the engine.
macro_rules! names {
    ($(#[$doc:meta])* $name:ident of $choice:ident: $($variant:ident),+) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, ValueEnum)]
        enum $name {
            $($variant),+
        }

        impl From<$name> for $choice {
            fn from(name: $name) -> Self {
                match name {
                    $($name::$variant => Self::$variant),+
                }
            }
        }
    };
}

names!(CameraName of CameraKind: Front, ThreeQuarter, Side, Back, Top, Orbit);
names!(FollowName of Follow: Auto, Figure, Hold);
names!(BackgroundName of Background: Light, Dark, Transparent);
names!(StyleName of Style: Shaded, Skeleton, Both, Depth, Silhouette);

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    match preview(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

fn preview(arguments: &Arguments) -> Result<(), Exit> {
    let limits = Limits::default();
    check_place(&arguments.output)?;
    arguments.overwriting.check([arguments.file.as_path()], [arguments.output.as_path()])?;
    let ending = arguments.output.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    if engine::PictureFormat::of_ending(&ending, true).is_none() {
        let message = format!("output {}: the ending is that of no picture", arguments.output.display());
        return Err(Exit::new(BAD_USAGE, message, "end the name in .png, .webp, .gif or .apng"));
    }
    let options = PreviewOptions { view: arguments.view(), ending, clip: arguments.clip.clone() };
    if let Some((field, problem)) = options.view.problem() {
        return Err(Exit::new(
            BAD_USAGE,
            format!("{field}: {problem}"),
            "retargetd preview --help tells what is possible",
        ));
    }
    let file = InputFile::read("file", &arguments.file, &limits)?;
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let preview = engine::preview(file.as_named(), &options, &limits, &control)
        .map_err(|failure| Exit::from_failure(&failure, &format!("file {}", file.path.display())))?;
    for warning in &preview.warnings {
        say(format_args!("warning: {}: {}", warning.code, warning.detail));
    }
    StagedFiles::write_one(&arguments.output, &preview.bytes)?;
    let [width, height] = preview.size;
    let frames = if preview.frames == 1 { "a still".to_owned() } else { format!("{} frames", preview.frames) };
    say(format_args!("wrote {}: {width} by {height} pixels, {frames}", arguments.output.display()));
    Ok(())
}

impl Arguments {
    fn view(&self) -> View {
        View {
            size: self.size,
            camera: self.camera.into(),
            follow: self.follow.into(),
            turn_degrees: self.turn,
            fps: self.fps,
            range: self.range,
            at_seconds: self.at,
            background: self.background.into(),
            style: self.style.into(),
            sheet: self.sheet,
            labels: self.labels,
            floor: !self.no_floor,
        }
    }
}

/// Two whole numbers with an `x` between them.
fn pair(text: &str) -> Option<[usize; 2]> {
    let (one, other) = text.split_once(['x', 'X'])?;
    Some([one.trim().parse().ok()?, other.trim().parse().ok()?])
}

fn size(text: &str) -> Result<[usize; 2], String> {
    let square = text.parse().ok().map(|side| [side, side]);
    square.or_else(|| pair(text)).ok_or_else(|| "give pixels, as 512 or 640x360".to_owned())
}

fn sheet(text: &str) -> Result<SheetSize, String> {
    let counts = pair(text).ok_or_else(|| "give columns and rows, as 4x3".to_owned());
    counts.map(|[columns, rows]| SheetSize { columns, rows })
}

fn range(text: &str) -> Result<[f64; 2], String> {
    let parts: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    parts.and_then(|parts| parts.try_into().ok()).ok_or_else(|| "give two seconds, as 1.5,3".to_owned())
}
