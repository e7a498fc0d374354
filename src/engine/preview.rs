//! What a file looks like: the figure and its motion as a picture, alone or beside that of another file.

use crate::{
    formats::{Format, Limits},
    model::{Clip, Control, Phase, Reporter, Scene},
    picture::{
        Background, Cast, FilmError, Layout, Picture, PictureError, PictureFormat, Reel, Sheet, SheetSize, Sight, View,
        render,
    },
    rig::{Rig, RigSpec},
};

use super::{
    Failure, FailureCode, NamedBytes, WarningView,
    files::load,
    flat,
    shown::{Shown, in_picture},
};

/// A picture of a file.
#[derive(Clone, Debug)]
pub struct Preview {
    /// The picture, encoded.
    pub bytes: Vec<u8>,
    /// What it is encoded as.
    pub format: PictureFormat,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// How many frames it has.
    pub frames: usize,
    /// Where each frame, or each cell of a sheet, was seen from.
    pub sights: Vec<Sight>,
    /// Guesses and losses.
    pub warnings: Vec<WarningView>,
}

/// What of a file is wanted as what.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PreviewOptions {
    /// How it is seen.
    pub view: View,
    /// The ending of the file that is wanted: `png`, `webp`, `gif`, `apng` or `mp4`.
    pub ending: String,
    /// The name of the clip; without one, the first that moves.
    pub clip: Option<String>,
}

/// Whether a file of a format can be drawn: what can be read can, and what is a picture already.
#[must_use]
pub fn is_drawable(format: &str) -> bool {
    let is_picture = |format: Format| format.info().is_picture && format != Format::Mp4;
    has_figure(format) || Format::from_name(format).is_some_and(is_picture)
}

/// Whether a result of that format has a figure that can be drawn, and is not a picture itself.
#[must_use]
pub fn has_figure(format: &str) -> bool {
    Format::from_name(format).is_some_and(|format| format.info().reads)
}

impl PreviewOptions {
    /// As the page of a batch shows an item: small, and moving.
    #[must_use]
    pub fn of_batch() -> Self {
        let view = View { size: [192, 192], fps: Some(12.0), ..View::default() };
        Self { view, ending: "webp".to_owned(), clip: None }
    }

    /// As a report shows a result: a row of frames.
    #[must_use]
    pub fn of_report() -> Self {
        let sheet = Some(Sheet::Even(SheetSize { columns: 6, rows: 1 }));
        let view = View { sheet, size: [160, 240], labels: true, ..View::default() };
        Self { view, ending: "png".to_owned(), clip: None }
    }
}

/// Draws a file: the mesh, or where it has none, a body of capsules; in its clip, or where it has none, at rest.
///
/// # Errors
/// When the file cannot be read, holds nothing that can be seen, or the view asks for what cannot be done.
pub fn preview(
    file: NamedBytes<'_>,
    options: &PreviewOptions,
    limits: &Limits,
    control: &Control,
) -> Result<Preview, Failure> {
    drawn(file, None, options, limits, control)
}

/// Draws two files that are to be compared: beside one another, or the first as a ghost over the second, as the layout says; at one
/// scale, and at the same time of their clips.
///
/// # Errors
/// As those of [`preview`].
pub fn compare(
    first: NamedBytes<'_>,
    second: NamedBytes<'_>,
    options: &PreviewOptions,
    limits: &Limits,
    control: &Control,
) -> Result<Preview, Failure> {
    let layout = if options.view.layout == Layout::Single { Layout::SideBySide } else { options.view.layout };
    let view = View { layout, ..options.view.clone() };
    drawn(second, Some(first), &PreviewOptions { view, ..options.clone() }, limits, control)
}

fn drawn(
    file: NamedBytes<'_>,
    beside: Option<NamedBytes<'_>>,
    options: &PreviewOptions,
    limits: &Limits,
    control: &Control,
) -> Result<Preview, Failure> {
    if let Some((field, problem)) = options.view.problem() {
        return Err(Failure::new(FailureCode::InvalidValue, format!("{field}: {problem}")));
    }
    if let Some(picture) = flat::picture_of(file, limits, control)?.filter(|_| beside.is_none()) {
        return flat_preview(&picture, options, control);
    }
    let mut reporter = Reporter::new();
    let loaded = load(file, "source", limits, control, &mut reporter)?;
    let other = beside.map(|file| load(file, "source", limits, control, &mut reporter)).transpose()?;
    let clip = chosen(&loaded.scene, options.clip.as_deref())?;
    let format =
        PictureFormat::of_ending(&options.ending, clip.is_some() && !options.view.is_still()).ok_or_else(|| {
            let detail = format!("'{}' is not a picture format that can be written", options.ending);
            Failure::new(FailureCode::UnsupportedFormat, detail).with_hint("use png, webp, gif, apng or mp4")
        })?;
    check_built(format)?;
    control.enter(Phase::Write, 1);
    let rig = rig_of(&loaded.scene);
    let shown = Shown::new(file.name, &loaded.scene, rig.as_ref(), clip, (limits, control), &mut reporter)?;
    let other_rig = other.as_ref().and_then(|other| rig_of(&other.scene));
    let companion = match (&other, beside) {
        (Some(other), Some(file)) => {
            let clip = other.scene.clips.iter().find(|clip| clip.is_animated());
            Some(Shown::new(file.name, &other.scene, other_rig.as_ref(), clip, (limits, control), &mut reporter)?)
        }
        _ => None,
    };
    let companion = companion.as_ref().map(Shown::subject);
    let cast = Cast { main: &shown.subject(), companion: companion.as_ref(), marks: None };
    let film = render(&cast, &options.view, format, control).map_err(failed)?;
    let warnings = reporter.into_warnings().into_iter().map(WarningView::from).collect();
    Ok(Preview { bytes: film.bytes, format, size: film.size, frames: film.frames, sights: film.sights, warnings })
}

pub(super) fn failed(error: FilmError) -> Failure {
    match error {
        FilmError::Picture(error) => in_picture(error),
        FilmError::Canceled(canceled) => canceled.into(),
    }
}

/// The clip of that name; without one, the first that moves.
pub(super) fn chosen<'a>(scene: &'a Scene, name: Option<&str>) -> Result<Option<&'a Clip>, Failure> {
    let Some(name) = name else { return Ok(scene.clips.iter().find(|clip| clip.is_animated())) };
    let found = scene.clips.iter().find(|clip| clip.name() == name).ok_or_else(|| {
        let names = scene.clips.iter().map(Clip::name).collect::<Vec<_>>().join(", ");
        Failure::new(FailureCode::UnknownName, format!("there is no clip '{name}'"))
            .with_hint(format!("the file has: {names}"))
    })?;
    Ok(Some(found))
}

/// What is known of a scene as a rig.
pub(super) fn rig_of(scene: &Scene) -> Option<Rig<'_>> {
    if scene.skeleton.is_empty() {
        return None;
    }
    Rig::new("source", scene, None, &RigSpec::default(), &mut Reporter::new()).ok()
}

/// Whether this build writes such pictures.
///
/// # Errors
/// Where it was built without the feature that it takes.
pub(super) fn check_built(format: PictureFormat) -> Result<(), Failure> {
    let Some(feature) = format.missing_feature() else { return Ok(()) };
    let detail = format!("{} is not written by this build, which is without the feature '{feature}'", format.ending());
    let hint = format!("use webp, gif or apng, or build it with --features {feature}");
    Err(Failure::new(FailureCode::UnsupportedFormat, detail).with_hint(hint))
}

/// A picture in the size and the format that is asked for, in the middle of its background.
///
/// # Errors
/// When it cannot be encoded.
fn flat_preview(picture: &Picture, options: &PreviewOptions, control: &Control) -> Result<Preview, Failure> {
    control.enter(Phase::Write, 1);
    let [width, height] = options.view.size;
    let background = match options.view.background {
        Background::Light => [236, 236, 236, 255],
        Background::Dark => [32, 33, 36, 255],
        Background::Transparent => [0; 4],
    };
    let mut shown = Picture::filled(width, height, background);
    let scale = (width as f64 / picture.width as f64).min(height as f64 / picture.height as f64);
    let size = [picture.width, picture.height].map(|side| ((side as f64 * scale) as usize).max(1));
    let (left, top) = (width.saturating_sub(size[0]) / 2, height.saturating_sub(size[1]) / 2);
    for row in 0..size[1].min(height) {
        for column in 0..size[0].min(width) {
            let color = mean(picture, [column, row], size);
            let pixel = &mut shown.pixels[(top + row) * width + left + column];
            let share = u32::from(color[3]);
            if pixel[3] == 0 {
                *pixel = color;
                continue;
            }
            for (part, new) in pixel[..3].iter_mut().zip(color) {
                *part = ((u32::from(new) * share + u32::from(*part) * (255 - share) + 127) / 255) as u8;
            }
        }
    }
    let format = PictureFormat::of_ending(&options.ending, false).ok_or_else(|| {
        Failure::new(
            FailureCode::UnsupportedFormat,
            format!("'{}' is not a picture format that can be written", options.ending),
        )
    })?;
    check_built(format)?;
    let failed = |error: PictureError| Failure::new(FailureCode::Internal, error.to_string());
    let bytes = if format.moves() {
        let ground = Picture::filled(width, height, background);
        let (mut reel, shutter) = Reel::new(format, &ground, 1.0, 1, |_| shown.clone()).map_err(failed)?;
        reel.add(vec![shutter.shot(&shown, [0, 0, width, height])]).map_err(failed)?;
        reel.finish().map_err(failed)?
    } else {
        shown.to_still(format).map_err(failed)?
    };
    Ok(Preview { bytes, format, size: [width, height], frames: 1, sights: Vec::new(), warnings: Vec::new() })
}

/// The mean color of what a pixel of another size covers, by opacity.
fn mean(picture: &Picture, [column, row]: [usize; 2], size: [usize; 2]) -> [u8; 4] {
    let range = |at: usize, of: usize, all: usize| {
        let begin = at * all / of;
        begin..((at + 1) * all / of).clamp(begin + 1, all.max(begin + 1))
    };
    let (mut sums, mut count) = ([0_u64; 4], 0);
    for row in range(row, size[1], picture.height) {
        for column in range(column, size[0], picture.width) {
            let color = picture.pixels[row * picture.width + column];
            let opacity = u64::from(color[3]);
            (0..3).for_each(|part| sums[part] += u64::from(color[part]) * opacity);
            sums[3] += opacity;
            count += 1;
        }
    }
    let part = |sum: u64| (sum / sums[3].max(1)) as u8;
    [part(sums[0]), part(sums[1]), part(sums[2]), (sums[3] / count.max(1)) as u8]
}
