//! What somebody wants to see.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The longest side of a picture, in pixels.
pub const MAX_SIDE: usize = 1920;

/// Frames on a sheet of the worst.
pub(super) const MAX_WORST: usize = 12;

/// How a figure is seen. Every field is optional.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct View {
    /// Width and height of one picture in pixels, 16 to 1920; of a sheet, that of each of its cells.
    pub size: [usize; 2],
    /// From where the figure is seen.
    pub camera: CameraKind,
    /// Whether the camera goes along with the figure.
    pub follow: Follow,
    /// How far the camera turns around the figure from the first frame to the last, in degrees.
    pub turn_degrees: f64,
    /// Frames per second of what moves, 1 to 60. Default: 15 for GIF, 30 otherwise.
    pub fps: Option<f64>,
    /// The seconds of the clip that are shown, start and end; what is beyond the clip's end is left out, and a range that begins there is
    /// refused. Default: all.
    pub range: Option<[f64; 2]>,
    /// The second of the clip that a still shows. Default: the middle.
    pub at_seconds: Option<f64>,
    /// What is behind the figure.
    pub background: Background,
    /// What of the figure is drawn.
    pub style: Style,
    /// A sheet of several frames in one still: columns and rows, evenly spread over the clip; or `worst`, those where the measures of a
    /// result that do not pass are worst.
    pub sheet: Option<Sheet>,
    /// Where a result has something to be compared with: whether that is shown beside it or through it, at the same time. Both are seen
    /// at one scale; where one is more than 1.25 times as tall as the other, what it is compared with is shown as tall as the result, and a picture
    /// beside the other says at how many percent.
    pub layout: Layout,
    /// Whether what the report found is drawn into the picture of a result: rings around the joints that measures blame, feet in the color
    /// of their contact, red where the figure is below the floor, and the values over time.
    pub marks: bool,
    /// Whether the time is written on the picture.
    pub labels: bool,
    /// Whether the floor is drawn, with the shadow on it.
    pub floor: bool,
}

impl Default for View {
    fn default() -> Self {
        Self {
            size: [512, 512],
            camera: CameraKind::ThreeQuarter,
            follow: Follow::Auto,
            turn_degrees: 0.0,
            fps: None,
            range: None,
            at_seconds: None,
            background: Background::Light,
            style: Style::Shaded,
            sheet: None,
            layout: Layout::Single,
            marks: false,
            labels: false,
            floor: true,
        }
    }
}

/// From where a figure is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CameraKind {
    /// From ahead of it.
    Front,
    /// From ahead and to its left.
    ThreeQuarter,
    /// From its left.
    Side,
    /// From behind it.
    Back,
    /// From above it.
    Top,
    /// Once around it, from the first frame to the last.
    Orbit,
}

/// Whether the camera goes along with a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Follow {
    /// It does where the figure leaves its place.
    Auto,
    /// It does.
    Figure,
    /// It stays where it sees the whole path.
    Hold,
}

/// What is behind a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Background {
    /// A light gray.
    Light,
    /// A dark gray.
    Dark,
    /// Nothing.
    Transparent,
}

/// What of a figure is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Style {
    /// Its mesh; where it has none, capsules along its bones.
    Shaded,
    /// Capsules along its bones.
    Skeleton,
    /// Its mesh, which lets its bones shine through.
    Both,
    /// How near it is: the nearer, the lighter.
    Depth,
    /// Its outline, filled with white.
    Silhouette,
}

/// What is shown together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// The result alone.
    Single,
    /// What it was made from on the left, the result on the right.
    SideBySide,
    /// What it was made from as a ghost over the result.
    Overlay,
}

/// Which frames are on a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"worst\" or an object with columns and rows")]
pub enum Sheet {
    /// A word.
    Word(SheetWord),
    /// So many, evenly spread over the clip.
    Even(SheetSize),
}

/// Which frames are on a sheet, in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SheetWord {
    /// Those where measures are worst; of a result that passes, its middle.
    Worst,
}

/// How many frames a sheet has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SheetSize {
    /// Side by side, 1 to 16.
    pub columns: usize,
    /// Below each other, 1 to 16.
    pub rows: usize,
}

impl View {
    /// Whether it asks for one picture, also where the format could show motion.
    #[must_use]
    pub const fn is_still(&self) -> bool {
        self.sheet.is_some() || self.at_seconds.is_some()
    }

    /// Of at most how many frames its stills consist.
    #[must_use]
    pub fn cells(&self) -> usize {
        match self.sheet {
            Some(Sheet::Even(size)) => size.columns * size.rows,
            Some(Sheet::Word(SheetWord::Worst)) => MAX_WORST,
            None => 1,
        }
    }

    /// What is wrong with a view: the field and what it has to be.
    #[must_use]
    pub fn problem(&self) -> Option<(&'static str, String)> {
        let sides = self.size.iter().all(|side| (16..=MAX_SIDE).contains(side));
        let is_between = |value: f64, from: f64, to: f64| (from..=to).contains(&value);
        if !sides {
            return Some(("size", format!("both sides are 16 to {MAX_SIDE} pixels")));
        }
        if self.fps.is_some_and(|fps| !is_between(fps, 1.0, 60.0)) {
            return Some(("fps", "it is 1 to 60".to_owned()));
        }
        if !is_between(self.turn_degrees, -3600.0, 3600.0) {
            return Some(("turn_degrees", "it is -3600 to 3600".to_owned()));
        }
        if self.range.is_some_and(|[start, end]| !(start >= 0.0 && end >= start && end.is_finite())) {
            return Some(("range", "it is a start of 0 or more and an end that is no earlier, in seconds".to_owned()));
        }
        if self.at_seconds.is_some_and(|at| !(at >= 0.0 && at.is_finite())) {
            return Some(("at_seconds", "it is 0 or more".to_owned()));
        }
        let counts = |sheet: SheetSize| [sheet.columns, sheet.rows].iter().all(|count| (1..=16).contains(count));
        let even = match self.sheet {
            Some(Sheet::Even(size)) => Some(size),
            Some(Sheet::Word(SheetWord::Worst)) | None => None,
        };
        if even.is_some_and(|sheet| !counts(sheet)) {
            return Some(("sheet", "columns and rows are 1 to 16 each".to_owned()));
        }
        let wide = if self.layout == Layout::SideBySide { 2 } else { 1 };
        let fits = |sheet: SheetSize| wide * sheet.columns * self.size[0] <= 8192 && sheet.rows * self.size[1] <= 8192;
        if even.is_some_and(|sheet| !fits(sheet)) {
            return Some((
                "sheet",
                "the whole sheet is at most 8192 pixels wide and high; make its cells smaller".to_owned(),
            ));
        }
        None
    }
}
