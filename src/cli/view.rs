//! How pictures are seen, as arguments of the command line.

use std::path::Path;

use clap::ValueEnum;
use serde_json::json;

use crate::engine::{
    self, Background, CameraKind, Follow, Layout, Preview, Sheet, SheetSize, Style, View, WarningView,
};

use super::{
    exit::{BAD_USAGE, Exit, report, say},
    files::StagedFiles,
};

/// How pictures are seen.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct ViewArguments {
    /// Width and height in pixels, such as 512 or 640x360; for a sheet, of each cell
    #[arg(long, value_name = "PIXELS", default_value = "512", value_parser = size)]
    size: [usize; 2],
    /// Camera position
    #[arg(long, value_enum, default_value = "three-quarter")]
    camera: CameraName,
    /// Whether the camera follows the figure
    #[arg(long, value_enum, default_value = "auto")]
    follow: FollowName,
    /// Degrees by which the camera orbits the figure from the first frame to the last
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    turn: f64,
    /// Frames per second of a moving picture; default 15 for GIF, 30 otherwise
    #[arg(long)]
    fps: Option<f64>,
    /// Start and end in seconds, such as 1.5,3
    #[arg(long, value_name = "START,END", value_parser = range)]
    range: Option<[f64; 2]>,
    /// Time of a still in seconds; default the middle of the clip
    #[arg(long, value_name = "SECONDS")]
    at: Option<f64>,
    /// A sheet of stills over the whole clip, such as 4x3
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = sheet)]
    sheet: Option<SheetSize>,
    /// Background
    #[arg(long, value_enum, default_value = "light")]
    background: BackgroundName,
    /// Drawing style
    #[arg(long, value_enum, default_value = "shaded")]
    style: StyleName,
    /// Draw the time on the picture
    #[arg(long)]
    labels: bool,
    /// Omit the floor
    #[arg(long)]
    no_floor: bool,
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

impl ViewArguments {
    /// The view, where it can be shown.
    pub(super) fn view(&self, layout: Layout) -> Result<View, Exit> {
        let view = self.unchecked(layout);
        match view.problem() {
            Some((field, problem)) => {
                let (flag, example) = flag_of(field);
                Err(Exit::new(BAD_USAGE, format!("{flag}: {problem}"), format!("for example {flag} {example}")))
            }
            None => Ok(view),
        }
    }

    fn unchecked(&self, layout: Layout) -> View {
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
            sheet: self.sheet.map(Sheet::Even),
            layout,
            marks: false,
            labels: self.labels,
            floor: !self.no_floor,
        }
    }
}

/// The flag that sets a field of a view, and a value of it.
fn flag_of(field: &str) -> (&'static str, &'static str) {
    match field {
        "size" => ("--size", "512, or --size 640x360"),
        "fps" => ("--fps", "30"),
        "turn_degrees" => ("--turn", "90"),
        "range" => ("--range", "1.5,3"),
        "at_seconds" => ("--at", "0.5"),
        _ => ("--sheet", "4x3"),
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

/// The ending of a picture's name.
pub(super) fn ending(output: &Path) -> Result<String, Exit> {
    let ending = output.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    if engine::PictureFormat::of_ending(&ending, true).is_none() {
        let message = format!("output {}: the ending is that of no picture", output.display());
        return Err(Exit::new(BAD_USAGE, message, "end the name in .png, .webp, .gif, .apng or .mp4"));
    }
    Ok(ending)
}

/// Writes a picture, and says what it is.
pub(super) fn write(output: &Path, preview: &Preview) -> Result<(), Exit> {
    for WarningView { code, detail, .. } in &preview.warnings {
        say(format_args!("warning: {code}: {detail}"));
    }
    StagedFiles::write_one(output, &preview.bytes)?;
    let [width, height] = preview.size;
    let frames = if preview.frames == 1 { "a still".to_owned() } else { format!("{} frames", preview.frames) };
    say(format_args!("wrote {}: {width} by {height} pixels, {frames}", output.display()));
    report(
        || json!({"output": output, "width": width, "height": height, "frames": preview.frames, "warnings": preview.warnings}),
    )
}
