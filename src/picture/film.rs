//! Many pictures: stills, sheets of stills, and what moves.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Mutex, PoisonError},
};

use rayon::prelude::*;

use crate::model::{Canceled, Control};

use super::{
    Picture,
    camera::Sight,
    cast::Cast,
    encode::{Frame, Motion, PictureFormat, frames_learned_from},
    error::PictureError,
    scene::{Studio, Subject},
    stage::Stage,
    view::{Background, CameraKind, Layout, MAX_WORST, Sheet, SheetWord, Style, View},
};

/// Frames of one moving picture.
const MAX_FRAMES: usize = 1800;
/// Pixels of all frames of one moving picture.
const MAX_PIXELS: usize = 1_000_000_000;
/// Pixels of frames that are kept until it is their turn.
const MAX_PIXELS_KEPT: usize = 1 << 21;
/// Frames that one thread draws while those before are encoded: at least, and at most where they are small until then. The more there are, the
/// less do threads wait for one another.
const FRAMES_AT_ONCE: [usize; 2] = [2, 8];
/// Milliseconds for which a moving picture of a figure that does not move is shown.
const STILL_SECONDS: f64 = 2.0;

/// The file that a view asks for.
#[derive(Clone, Debug)]
pub struct Film {
    /// The encoded file.
    pub bytes: Vec<u8>,
    /// In pixels.
    pub size: [usize; 2],
    /// How many frames it has.
    pub frames: usize,
    /// Where each frame, or each cell of a sheet, was seen from.
    pub sights: Vec<Sight>,
}

/// Why there is no film.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FilmError {
    /// It cannot be drawn.
    Picture(PictureError),
    /// The work was canceled.
    Canceled(Canceled),
}

impl From<PictureError> for FilmError {
    fn from(error: PictureError) -> Self {
        Self::Picture(error)
    }
}

impl From<Canceled> for FilmError {
    fn from(canceled: Canceled) -> Self {
        Self::Canceled(canceled)
    }
}

/// Draws what a view asks for, and encodes it. Frames are drawn in parallel and encoded in their order.
///
/// # Errors
/// When there is nothing to be seen, more is asked for than is drawn, or the work is canceled.
pub fn render(cast: &Cast<'_>, view: &View, format: PictureFormat, control: &Control) -> Result<Film, FilmError> {
    check(cast, view)?;
    let times = times(cast, view, format);
    let stage = Stage::new(cast, view, &times);
    let size = stage.size();
    if times.len() > MAX_FRAMES || times.len() * size[0] * size[1] > MAX_PIXELS {
        let detail = format!(
            "{} frames of {} by {} pixels are too many; shorten the range, lower the frames per second or make it smaller",
            times.len(),
            size[0],
            size[1]
        );
        return Err(PictureError::new(detail).into());
    }
    let studios = Studios::new(view.size);
    let shoot =
        |index: usize| control.check().map(|()| studios.lend(|studio| stage.picture(studio, times[index], index)));
    if !format.moves() {
        let picture = sheet(each((0..times.len()).collect(), &shoot)?, view.sheet);
        let size = [picture.width, picture.height];
        return Ok(Film { bytes: format.still(&picture)?, size, frames: 1, sights: stage.sights() });
    }
    let fps = fps(view, format);
    let motion = Motion::new(format, size, fps, times.len(), view.background == Background::Transparent)?;
    let bytes = moving(motion, times.len(), size[0] * size[1], &shoot, &studios, control)?;
    Ok(Film { bytes, size, frames: times.len(), sights: stage.sights() })
}

/// Does something for each of some frames, in parallel.
fn each<T: Send>(
    indices: Vec<usize>,
    work: &(impl Fn(usize) -> Result<T, Canceled> + Sync),
) -> Result<Vec<T>, Canceled> {
    indices.into_par_iter().with_max_len(1).map(work).collect()
}

/// Draws frames of so many pixels and encodes them, a few at a time.
fn moving(
    mut motion: Motion,
    count: usize,
    pixels: usize,
    shoot: &(impl Fn(usize) -> Result<Picture, Canceled> + Sync),
    studios: &Studios,
    control: &Control,
) -> Result<Vec<u8>, FilmError> {
    // The palette of a GIF comes from a few frames of all of it. Where they are not too large, they are drawn once only.
    let mut pictures: Vec<(usize, Picture)> = Vec::new();
    if motion.wants_palette() {
        let indices: BTreeSet<usize> = frames_learned_from(count).into_iter().collect();
        let learned = each(indices.iter().copied().collect(), shoot)?;
        motion.learn(&learned);
        if learned.iter().map(|picture| picture.pixels.len()).sum::<usize>() <= MAX_PIXELS_KEPT {
            pictures = indices.into_iter().zip(learned).collect();
        }
    }
    let preparation = motion.preparation();
    let mut learned: BTreeMap<usize, Frame> =
        pictures.into_iter().map(|(index, picture)| (index, preparation.frame(picture).0)).collect();
    let frame = |index: usize| {
        let (frame, spare) = preparation.frame(shoot(index)?);
        studios.keep(spare);
        Ok(frame)
    };
    let threads = rayon::current_num_threads().max(1);
    let [few, many] = FRAMES_AT_ONCE;
    let at_once = if preparation.is_compact() { (MAX_PIXELS_KEPT / pixels.max(1)).clamp(few, many) } else { few };
    let (mut drawn, mut begin): (Vec<Frame>, usize) = (Vec::new(), 0);
    while begin < count {
        control.check()?;
        // Fewer and fewer, since one thread encodes the last of them alone.
        let indices = begin..(begin + ((count - begin) / 2).clamp(threads, at_once * threads)).min(count);
        begin = indices.end;
        let missing: Vec<usize> = indices.clone().filter(|index| !learned.contains_key(index)).collect();
        // What is drawn is encoded while the next is.
        let before = std::mem::take(&mut drawn);
        let (encoded, next) = rayon::join(|| motion.add_frames(before), || each(missing, &frame));
        studios.keep(encoded?);
        let mut next = next?.into_iter();
        drawn = indices.filter_map(|index| learned.remove(&index).or_else(|| next.next())).collect();
    }
    motion.add_frames(drawn)?;
    Ok(motion.finish()?)
}

/// What pictures are made with, which is large: there are as many as are drawn at the same time.
struct Studios {
    size: [usize; 2],
    free: Mutex<Vec<Studio>>,
    /// Pictures that are not needed any more, to be drawn over: they are large as well.
    spare: Mutex<Vec<Picture>>,
}

impl Studios {
    const fn new(size: [usize; 2]) -> Self {
        Self { size, free: Mutex::new(Vec::new()), spare: Mutex::new(Vec::new()) }
    }

    /// Keeps pictures to be drawn over.
    fn keep(&self, pictures: impl IntoIterator<Item = Picture>) {
        self.spare.lock().unwrap_or_else(PoisonError::into_inner).extend(pictures);
    }

    fn lend<T>(&self, work: impl FnOnce(&mut Studio) -> T) -> T {
        let free = self.free.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut studio = free.unwrap_or_else(|| Studio::new(self.size));
        studio.draw_over(self.spare.lock().unwrap_or_else(PoisonError::into_inner).pop());
        let made = work(&mut studio);
        self.free.lock().unwrap_or_else(PoisonError::into_inner).push(studio);
        made
    }
}

/// Whether there is something to be seen of all that the view asks for.
fn check(cast: &Cast<'_>, view: &View) -> Result<(), PictureError> {
    if let Some((field, problem)) = view.problem() {
        return Err(PictureError::new(format!("{field}: {problem}")));
    }
    let [_, end] = cast.main.span();
    if let Some([start, _]) = view.range.filter(|[start, _]| *start > end && end > 0.0) {
        return Err(PictureError::new(format!("range: it begins at {start} s, after the clip's end at {end:.3} s")));
    }
    let is_nothing = |subject: &Subject<'_>| {
        let seen = if view.style == Style::Skeleton { subject.bones } else { subject.figure };
        seen.is_empty()
    };
    if view.layout != Layout::Single && cast.companion.is_none() {
        return Err(PictureError::new("layout: there is nothing that this could be compared with"));
    }
    if view.sheet == Some(Sheet::Word(SheetWord::Worst)) && cast.marks.is_none() {
        return Err(PictureError::new("sheet: nothing was measured that could be worst"));
    }
    let companion = cast.companion.filter(|_| view.layout != Layout::Single);
    if [Some(cast.main), companion].into_iter().flatten().any(is_nothing) {
        return Err(PictureError::new("there is neither a mesh nor a skeleton that could be seen"));
    }
    Ok(())
}

fn fps(view: &View, format: PictureFormat) -> f64 {
    view.fps.unwrap_or(if format == PictureFormat::Gif { 15.0 } else { 30.0 })
}

/// The seconds of the clip that are shown.
fn times(cast: &Cast<'_>, view: &View, format: PictureFormat) -> Vec<f64> {
    let [first, last] = cast.main.span();
    let [start, end] = view.range.unwrap_or([first, last]).map(|time| time.clamp(first, last));
    let spread = |count: usize| {
        let share = |index: usize| if count > 1 { index as f64 / (count - 1) as f64 } else { 0.5 };
        (0..count).map(|index| start + (end - start) * share(index)).collect::<Vec<f64>>()
    };
    match (format.moves(), view.sheet) {
        (false, Some(Sheet::Even(sheet))) => spread(sheet.columns * sheet.rows),
        (false, Some(Sheet::Word(SheetWord::Worst))) => {
            let worst = cast.marks.map(|marks| marks.worst_times(MAX_WORST)).unwrap_or_default();
            if worst.is_empty() { spread(1) } else { worst }
        }
        (false, None) => vec![view.at_seconds.map_or_else(|| f64::midpoint(start, end), |at| at.clamp(first, last))],
        (true, _) => {
            let fps = fps(view, format);
            let is_turning = view.turn_degrees != 0.0 || view.camera == CameraKind::Orbit;
            let lasts = if end > start || !is_turning { end - start } else { STILL_SECONDS };
            let count = ((lasts * fps).round() as usize).max(1);
            (0..count).map(|frame| (start + frame as f64 / fps).min(end)).collect()
        }
    }
}

fn sheet(mut pictures: Vec<Picture>, layout: Option<Sheet>) -> Picture {
    let columns = match layout {
        _ if pictures.len() == 1 => return pictures.swap_remove(0),
        Some(Sheet::Even(size)) => size.columns,
        Some(Sheet::Word(SheetWord::Worst)) | None => (pictures.len() as f64).sqrt().ceil() as usize,
    };
    let (width, height) = (pictures[0].width, pictures[0].height);
    let mut whole = Picture::filled(width * columns, height * pictures.len().div_ceil(columns), [0; 4]);
    for (index, picture) in pictures.iter().enumerate() {
        whole.paste(picture, index % columns * width, index / columns * height);
    }
    whole
}
