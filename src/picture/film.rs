//! Many pictures: stills, sheets of stills, and what moves.

use glam::Vec3;
use rayon::prelude::*;

use crate::model::{Canceled, Control};

use super::{
    Picture,
    camera::{Camera, Direction},
    encode::{Motion, PictureFormat, frames_learned_from},
    error::PictureError,
    figure::{Figure, Posed},
    scene::{Shot, Studio, Subject},
    text,
    view::{Background, CameraKind, Follow, SheetSize, Style, View},
};

/// Frames of one moving picture.
const MAX_FRAMES: usize = 1800;
/// Pixels of all frames of one moving picture.
const MAX_PIXELS: usize = 1_000_000_000;
/// Frames that the camera is set up with.
const FITTED_FRAMES: usize = 24;
/// Vertices of each of them.
const FITTED_VERTICES: usize = 4000;
/// A figure that travels farther than this, in its heights, is followed.
const FOLLOWED: f32 = 1.2;
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
pub fn render(subject: &Subject<'_>, view: &View, format: PictureFormat, control: &Control) -> Result<Film, FilmError> {
    if let Some((field, problem)) = view.problem() {
        return Err(PictureError::new(format!("{field}: {problem}")).into());
    }
    let is_bones = view.style == Style::Skeleton;
    if (if is_bones { subject.bones } else { subject.figure }).is_empty() {
        return Err(PictureError::new("there is neither a mesh nor a skeleton that could be seen").into());
    }
    let times = times(subject, view, format);
    if times.len() > MAX_FRAMES || times.len() * view.size[0] * view.size[1] > MAX_PIXELS {
        let detail = format!(
            "{} frames of {} by {} pixels are too many; shorten the range, lower the frames per second or make it smaller",
            times.len(),
            view.size[0],
            view.size[1]
        );
        return Err(PictureError::new(detail).into());
    }
    let stage = Stage::new(subject, view, &times);
    let shoot = |studio: &mut Studio, index: usize| stage.picture(studio, &times, index);
    if !format.moves() {
        let pictures = (0..times.len())
            .into_par_iter()
            .map_init(|| Studio::new(view.size), |studio, index| control.check().map(|()| shoot(studio, index)))
            .collect::<Result<Vec<Picture>, Canceled>>()?;
        let picture = sheet(pictures, view.sheet);
        let size = [picture.width, picture.height];
        return Ok(Film { bytes: format.still(&picture)?, size, frames: 1 });
    }
    let fps = fps(view, format);
    let mut motion = Motion::new(format, view.size, fps, times.len(), view.background == Background::Transparent)?;
    // The palette of a GIF comes from a few frames of all of it.
    if motion.wants_palette() {
        let chosen = frames_learned_from(times.len());
        let pictures: Vec<Picture> =
            chosen.into_par_iter().map_init(|| Studio::new(view.size), |studio, index| shoot(studio, index)).collect();
        motion.learn(&pictures);
    }
    let chunk = 4 * rayon::current_num_threads().max(1);
    for begin in (0..times.len()).step_by(chunk) {
        control.check()?;
        let pictures: Vec<Picture> = (begin..(begin + chunk).min(times.len()))
            .into_par_iter()
            .map_init(|| Studio::new(view.size), |studio, index| shoot(studio, index))
            .collect();
        for picture in &pictures {
            motion.add(picture)?;
        }
    }
    Ok(Film { bytes: motion.finish()?, size: view.size, frames: times.len() })
}

fn fps(view: &View, format: PictureFormat) -> f64 {
    view.fps.unwrap_or(if format == PictureFormat::Gif { 15.0 } else { 30.0 })
}

/// The seconds of the clip that are shown.
fn times(subject: &Subject<'_>, view: &View, format: PictureFormat) -> Vec<f64> {
    let clip_times = subject.clip.map_or(&[][..], |clip| clip.times_seconds());
    let (first, last) = (clip_times.first().copied().unwrap_or(0.0), clip_times.last().copied().unwrap_or(0.0));
    let [start, end] = view.range.unwrap_or([first, last]).map(|time| time.clamp(first, last));
    let spread = |count: usize| {
        let share = |index: usize| if count > 1 { index as f64 / (count - 1) as f64 } else { 0.5 };
        (0..count).map(|index| start + (end - start) * share(index)).collect::<Vec<f64>>()
    };
    match (format.moves(), view.sheet) {
        (false, Some(sheet)) => spread(sheet.columns * sheet.rows),
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

/// What all pictures of a view have in common.
struct Stage<'a> {
    subject: &'a Subject<'a>,
    view: &'a View,
    /// The camera of each picture, without where the figure goes.
    cameras: Vec<Camera>,
    /// Where the figure is at each picture, where the camera follows it.
    path: Option<Vec<Vec3>>,
    /// Of the floor: its level, and where the figure stands at each picture.
    level: f32,
    middles: Vec<Vec3>,
    height: f32,
    step: f32,
}

impl<'a> Stage<'a> {
    fn new(subject: &'a Subject<'a>, view: &'a View, times: &[f64]) -> Self {
        let figure: &Figure = if view.style == Style::Skeleton { subject.bones } else { subject.figure };
        let root = |seconds: f64| {
            let joint = subject.root.or_else(|| subject.shown_joints.first().copied());
            let joints = subject.joints(seconds);
            joint.and_then(|joint| joints.get(joint)).map_or(Vec3::ZERO, |joint| joint.w_axis.truncate())
        };
        let chosen: Vec<usize> = {
            let count = FITTED_FRAMES.min(times.len());
            (0..count).map(|place| place * (times.len() - 1) / (count - 1).max(1)).collect()
        };
        let stride = figure.vertex_count().div_ceil(FITTED_VERTICES).max(1);
        let mut posed = Posed::default();
        let mut seen: Vec<(usize, Vec<Vec3>)> = Vec::new();
        for &index in &chosen {
            let joints = subject.joints(times[index]);
            figure.pose(&joints, &subject.morph_weights(times[index]), &mut posed);
            let mut places: Vec<Vec3> = posed.positions.iter().copied().step_by(stride).collect();
            places.extend(subject.shown_joints.iter().map(|joint| joints[*joint].w_axis.truncate()));
            places.retain(|place| place.is_finite());
            seen.push((index, places));
        }
        let all = || seen.iter().flat_map(|(_, places)| places.iter().copied());
        let extent = |places: &[Vec3]| {
            let low = places.iter().copied().reduce(Vec3::min).unwrap_or_default();
            let high = places.iter().copied().reduce(Vec3::max).unwrap_or_default();
            high - low
        };
        let height = seen.iter().map(|(_, places)| extent(places).max_element()).fold(0.0, f32::max).max(1e-6);
        let roots: Vec<Vec3> = times.iter().map(|time| root(*time)).collect();
        let travel = extent(&roots).with_y(0.0).length();
        let is_followed = match view.follow {
            Follow::Auto => travel > FOLLOWED * height,
            Follow::Figure => true,
            Follow::Hold => false,
        };
        let path: Option<Vec<Vec3>> =
            is_followed.then(|| roots.iter().map(|place| (*place - roots[0]).with_y(0.0)).collect());
        let points: Vec<Vec3> = match &path {
            Some(path) => {
                seen.iter().flat_map(|(index, places)| places.iter().map(|place| *place - path[*index])).collect()
            }
            None => all().collect(),
        };
        let level = subject.floor.unwrap_or_else(|| all().map(|place| place.y).fold(f32::INFINITY, f32::min));
        let progress = |index: usize| if times.len() > 1 { index as f64 / times.len() as f64 } else { 0.0 };
        let is_turning = view.turn_degrees != 0.0 || view.camera == CameraKind::Orbit;
        let camera = |index: usize| {
            let direction = Direction::of(view.camera, view.turn_degrees, progress(index));
            Camera::fitting(direction, &points, view.size)
        };
        let cameras: Vec<Camera> =
            if is_turning { turning(view, &points, times.len()) } else { vec![camera(0); times.len()] };
        let middles = roots.iter().map(|place| place.with_y(level)).collect();
        let step = subject.units_per_metre.map_or(height / 3.5, |units| {
            // Half a meter for people; for what is far smaller or larger, a tenth or ten times as much.
            let mut step = 0.5 * units;
            while step > height {
                step *= 0.1;
            }
            while step < 0.05 * height {
                step *= 10.0;
            }
            step
        });
        Self { subject, view, cameras, path, level, middles, height, step }
    }

    fn picture(&self, studio: &mut Studio, times: &[f64], index: usize) -> Picture {
        let by = self.path.as_ref().map_or(Vec3::ZERO, |path| path[index]);
        let has_floor = self.view.floor && !matches!(self.view.style, Style::Depth | Style::Silhouette);
        let shot = Shot {
            camera: self.cameras[index].moved(by),
            style: self.view.style,
            background: self.view.background,
            floor: has_floor.then_some((self.level, self.middles[index], self.height, self.step)),
        };
        let mut picture = studio.shoot(self.subject, times[index], &shot);
        if self.view.labels {
            let size = (picture.height / 256).max(1);
            let label = format!("{:.2} s", times[index]);
            let color = if self.view.background == Background::Dark { [230; 3] } else { [60, 64, 70] };
            text::write(&mut picture, &label, [6 * size, 6 * size], size, color);
        }
        picture
    }
}

/// Cameras that turn, all as far away as the farthest of them has to be.
fn turning(view: &View, points: &[Vec3], count: usize) -> Vec<Camera> {
    let low = points.iter().copied().reduce(Vec3::min).unwrap_or_default();
    let high = points.iter().copied().reduce(Vec3::max).unwrap_or_default();
    // What is seen of a figure that turns is what turns around its middle.
    let middle = (low + high) * 0.5;
    let radius = points.iter().map(|place| (*place - middle).with_y(0.0).length()).fold(0.0, f32::max);
    let mut around = Vec::new();
    for step in 0..16 {
        let (sin, cos) = (step as f32 / 16.0 * std::f32::consts::TAU).sin_cos();
        let off = Vec3::new(sin, 0.0, cos) * radius;
        around.extend([middle.with_y(low.y) + off, middle.with_y(high.y) + off * 0.6]);
    }
    let camera = |index: usize| {
        let direction = Direction::of(view.camera, view.turn_degrees, index as f64 / count as f64);
        Camera::fitting(direction, &around, view.size)
    };
    (0..count).map(camera).collect()
}

fn sheet(mut pictures: Vec<Picture>, layout: Option<SheetSize>) -> Picture {
    let Some(layout) = layout else { return pictures.swap_remove(0) };
    let (width, height) = (pictures[0].width, pictures[0].height);
    let mut whole = Picture::filled(width * layout.columns, height * layout.rows, [0; 4]);
    for (index, picture) in pictures.iter().enumerate() {
        whole.paste(picture, index % layout.columns * width, index / layout.columns * height);
    }
    whole
}
