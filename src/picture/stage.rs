//! Where figures stand, and which cameras see them: one figure, or two that do the same at the same time.

use glam::{Vec2, Vec3};

use super::{
    Picture,
    camera::{Camera, Direction, Sight},
    cast::Cast,
    figure::{Figure, Posed},
    marks::Marks,
    scene::{Shot, Studio, Subject},
    text,
    view::{Background, CameraKind, Follow, Layout, Style, View},
};

/// Frames that the camera is set up with.
const FITTED_FRAMES: usize = 24;
/// Vertices of each of them.
const FITTED_VERTICES: usize = 4000;
/// A figure that travels farther than this, in its heights, is followed.
const FOLLOWED: f32 = 1.2;
/// Two figures are seen at one scale unless one is more than so many times as tall as the other: then they are seen equally tall.
const MAX_RATIO: f32 = 1.25;
/// What is farther below the floor than this, in meters, is marked.
const SUNK_METERS: f32 = 0.005;

/// A figure, and where it goes.
struct Actor<'a> {
    subject: &'a Subject<'a>,
    /// Where the root is at each picture.
    roots: Vec<Vec3>,
    /// Where the camera goes along with it at each picture; nowhere where it does not follow.
    way: Vec<Vec3>,
    /// Where it stands, seen from what all figures have in common.
    origin: Vec3,
    /// Pictures that the camera is set up with, and points of the figure there.
    seen: Vec<(usize, Vec<Vec3>)>,
    /// The level of its floor.
    level: f32,
    height: f32,
    /// How many times as large as it is it is seen.
    shown_scale: f32,
}

impl<'a> Actor<'a> {
    fn new(subject: &'a Subject<'a>, view: &View, times: &[f64]) -> Self {
        let figure: &Figure = if view.style == Style::Skeleton { subject.bones } else { subject.figure };
        let root = |seconds: f64| {
            let joint = subject.root.or_else(|| subject.shown_joints.first().copied());
            let joints = subject.joints(seconds);
            joint.and_then(|joint| joints.get(joint)).map_or(Vec3::ZERO, |joint| joint.w_axis.truncate())
        };
        let count = FITTED_FRAMES.min(times.len());
        let stride = figure.vertex_count().div_ceil(FITTED_VERTICES).max(1);
        let mut posed = Posed::default();
        let mut seen: Vec<(usize, Vec<Vec3>)> = Vec::new();
        for index in (0..count).map(|place| place * (times.len() - 1) / (count - 1).max(1)) {
            let joints = subject.joints(times[index]);
            figure.pose(&joints, &subject.morph_weights(times[index]), &mut posed);
            let mut places: Vec<Vec3> = posed.positions.iter().copied().step_by(stride).collect();
            places.extend(subject.shown_joints.iter().map(|joint| joints[*joint].w_axis.truncate()));
            places.retain(|place| place.is_finite());
            seen.push((index, places));
        }
        let height = seen.iter().map(|(_, places)| extent(places).max_element()).fold(0.0, f32::max).max(1e-6);
        let lowest = || seen.iter().flat_map(|(_, places)| places).map(|place| place.y).fold(f32::INFINITY, f32::min);
        let level = subject.floor.unwrap_or_else(lowest);
        let roots: Vec<Vec3> = times.iter().map(|time| root(*time)).collect();
        Self {
            subject,
            way: vec![Vec3::ZERO; roots.len()],
            roots,
            origin: Vec3::ZERO,
            seen,
            level,
            height,
            shown_scale: 1.0,
        }
    }

    fn travels(&self) -> bool {
        extent(&self.roots).with_y(0.0).length() > FOLLOWED * self.height
    }

    /// Has the camera go along.
    fn follow(&mut self) {
        self.way = self.roots.iter().map(|place| (*place - self.roots[0]).with_y(0.0)).collect();
    }

    /// Has it stand where others do: at its first picture, on its floor.
    fn stand_with_others(&mut self) {
        self.origin = self.roots[0].with_y(self.level);
    }

    /// Where what all figures have in common is, for this one, at a picture.
    fn place(&self, index: usize) -> Vec3 {
        self.origin + self.way[index]
    }

    /// Its points as a camera sees them that goes along.
    fn points(&self) -> impl Iterator<Item = Vec3> {
        let shown = |index: usize, place: &Vec3| (*place - self.place(index)) * self.shown_scale;
        self.seen.iter().flat_map(move |(index, places)| places.iter().map(move |place| shown(*index, place)))
    }

    /// A camera of what all figures have in common, for this one at a picture.
    fn camera(&self, camera: &Camera, index: usize) -> Camera {
        camera.scaled(1.0 / self.shown_scale).moved(self.place(index))
    }

    /// What is written beside it.
    fn label(&self) -> String {
        let name = &self.subject.name;
        if (self.shown_scale - 1.0).abs() < f32::EPSILON {
            name.clone()
        } else {
            format!("{name}, {:.0} %", self.shown_scale * 100.0)
        }
    }
}

fn extent(places: &[Vec3]) -> Vec3 {
    let low = places.iter().copied().reduce(Vec3::min).unwrap_or_default();
    let high = places.iter().copied().reduce(Vec3::max).unwrap_or_default();
    high - low
}

/// What all pictures of a view have in common.
pub(super) struct Stage<'a> {
    view: &'a View,
    main: Actor<'a>,
    companion: Option<Actor<'a>>,
    marks: Option<&'a Marks>,
    /// The camera of each picture, without where the figure goes.
    cameras: Vec<Camera>,
    /// From one line of the floor to the next.
    step: f32,
}

impl<'a> Stage<'a> {
    pub(super) fn new(cast: &Cast<'a>, view: &'a View, times: &[f64]) -> Self {
        let mut main = Actor::new(cast.main, view, times);
        let companion = cast.companion.filter(|_| view.layout != Layout::Single);
        let mut companion = companion.map(|subject| Actor::new(subject, view, times));
        let is_followed = match view.follow {
            Follow::Auto => main.travels() || companion.as_ref().is_some_and(Actor::travels),
            Follow::Figure => true,
            Follow::Hold => false,
        };
        if is_followed {
            main.follow();
        }
        if let Some(companion) = &mut companion {
            main.stand_with_others();
            companion.stand_with_others();
            let ratio = main.height / companion.height;
            companion.shown_scale = if ratio.max(1.0 / ratio) > MAX_RATIO { ratio } else { 1.0 };
            match view.layout {
                // A ghost is seen where it is while the camera goes with the other.
                Layout::Overlay => companion.way = main.way.iter().map(|way| *way / companion.shown_scale).collect(),
                _ if is_followed => companion.follow(),
                _ => {}
            }
        }
        let points: Vec<Vec3> = main.points().chain(companion.iter().flat_map(Actor::points)).collect();
        let is_turning = view.turn_degrees != 0.0 || view.camera == CameraKind::Orbit;
        let cameras = if is_turning {
            turning(view, &points, times.len())
        } else {
            vec![Camera::fitting(Direction::of(view.camera, view.turn_degrees, 0.0), &points, view.size); times.len()]
        };
        let step = grid_step(cast.main, main.height);
        let marks = cast.marks.filter(|_| view.marks);
        Self { view, main, companion, marks, cameras, step }
    }

    /// Width and height of one picture, in pixels.
    pub(super) fn size(&self) -> [usize; 2] {
        let [width, height] = self.view.size;
        if self.is_side_by_side() { [2 * width, height] } else { [width, height] }
    }

    /// Where each picture is seen from.
    pub(super) fn sights(&self) -> Vec<Sight> {
        let sight = |(index, camera): (usize, &Camera)| {
            self.main.camera(camera, index).sight(&self.main.subject.picture_from_scene)
        };
        self.cameras.iter().enumerate().map(sight).collect()
    }

    fn is_side_by_side(&self) -> bool {
        self.companion.is_some() && self.view.layout == Layout::SideBySide
    }

    pub(super) fn picture(&self, studio: &mut Studio, seconds: f64, index: usize) -> Picture {
        let is_side_by_side = self.is_side_by_side();
        let mut picture = self.shoot(studio, &self.main, seconds, index);
        if let Some(companion) = self.companion.as_ref().filter(|_| !is_side_by_side) {
            let ghost = self.alone(studio, companion, seconds, index);
            let figure = self.alone(studio, &self.main, seconds, index);
            picture.haunt(&ghost, &figure);
        }
        self.mark(&mut picture, seconds, index);
        let Some(companion) = self.companion.as_ref().filter(|_| is_side_by_side) else { return picture };
        let mut other = self.shoot(studio, companion, seconds, index);
        for (picture, actor) in [(&mut other, companion), (&mut picture, &self.main)] {
            let size = (picture.height / 256).max(1);
            let top = picture.height.saturating_sub(12 * size + picture.height / 14);
            text::write(picture, &actor.label(), [6 * size, top], size, self.text_color());
        }
        let mut both = Picture::filled(2 * picture.width, picture.height, [0; 4]);
        both.paste(&other, 0, 0);
        both.paste(&picture, other.width, 0);
        both
    }

    /// A figure without what is around it.
    fn alone(&self, studio: &mut Studio, actor: &Actor<'_>, seconds: f64, index: usize) -> Picture {
        let shot = Shot {
            camera: actor.camera(&self.cameras[index], index),
            style: self.view.style,
            background: Background::Transparent,
            floor: None,
            sunk_below: None,
        };
        studio.shoot(actor.subject, seconds, &shot)
    }

    fn shoot(&self, studio: &mut Studio, actor: &Actor<'_>, seconds: f64, index: usize) -> Picture {
        let has_floor = self.view.floor && !matches!(self.view.style, Style::Depth | Style::Silhouette);
        let middle = actor.roots[index].with_y(actor.level);
        let is_main = std::ptr::eq(actor, &raw const self.main);
        let meter = actor.subject.units_per_meter.unwrap_or(actor.height / 1.7);
        let shot = Shot {
            camera: actor.camera(&self.cameras[index], index),
            style: self.view.style,
            background: self.view.background,
            floor: has_floor.then_some((actor.level, middle, actor.height, self.step)),
            sunk_below: (is_main && self.marks.is_some()).then_some(actor.level - SUNK_METERS * meter),
        };
        studio.shoot(actor.subject, seconds, &shot)
    }

    /// Writes and draws what belongs over the figure.
    fn mark(&self, picture: &mut Picture, seconds: f64, index: usize) {
        if self.view.labels {
            let size = (picture.height / 256).max(1);
            text::write(picture, &format!("{seconds:.2} s"), [6 * size, 6 * size], size, self.text_color());
        }
        if let Some(marks) = self.marks {
            let joints = self.main.subject.joints(seconds);
            let camera = self.main.camera(&self.cameras[index], index);
            marks.draw(picture, seconds, self.main.subject.span(), |joint| {
                let at = camera.project(joints.get(joint)?.w_axis.truncate());
                (at.z > camera.near).then(|| Vec2::new(at.x, at.y))
            });
        }
    }

    const fn text_color(&self) -> [u8; 3] {
        if matches!(self.view.background, Background::Dark) { [230; 3] } else { [60, 64, 70] }
    }
}

/// Half a meter for people; for what is far smaller or larger, a tenth or ten times as much.
fn grid_step(subject: &Subject<'_>, height: f32) -> f32 {
    let Some(units) = subject.units_per_meter else { return height / 3.5 };
    let mut step = 0.5 * units;
    while step > height {
        step *= 0.1;
    }
    while step < 0.05 * height {
        step *= 10.0;
    }
    step
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
