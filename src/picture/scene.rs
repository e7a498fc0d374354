//! One picture of one frame: the figure, the light on it, the floor below it, and what is behind.

use std::ops::Range;

use glam::{Mat4, Quat, Vec2, Vec3, Vec4};

use crate::model::{Clip, Skeleton, Transform};

use super::{
    Picture,
    camera::Camera,
    figure::{Figure, Posed},
    floor::Floor,
    raster::{Brush, Corner, Raster, SAMPLES},
    view::{Background, Style},
};

/// Light from everywhere.
const AMBIENT: f32 = 0.36;
/// Light from above the left shoulder of the viewer, and a weaker one from the right.
const KEY: f32 = 0.5;
const FILL: f32 = 0.14;
/// The share of light that is lost where a surface turns out of sight.
const RIM: f32 = 0.35;

/// What is below the floor, linear.
const SUNK: Vec3 = Vec3::new(1.0, 0.05, 0.04);

/// So few triangles are drawn sooner than it is known where they are hidden.
const FEW: usize = 500;

/// A figure that moves, as pictures need it.
#[derive(Clone, Debug)]
pub struct Subject<'a> {
    /// What it is called where several are shown.
    pub name: String,
    /// Its surfaces; of a figure without a mesh, capsules.
    pub figure: &'a Figure,
    /// Capsules along its bones.
    pub bones: &'a Figure,
    /// Its joints.
    pub skeleton: &'a Skeleton,
    /// What it does; nothing of a figure at rest.
    pub clip: Option<&'a Clip>,
    /// The weights of its morphs where nothing animates them.
    pub rest_weights: Vec<f32>,
    /// Its joints that are always in the picture.
    pub shown_joints: Vec<usize>,
    /// The joint that a camera goes along with.
    pub root: Option<usize>,
    /// From the space of its scene to that of the picture: +Y up, +Z front.
    pub picture_from_scene: Mat4,
    /// Units of its scene that are a meter, where that is known.
    pub units_per_meter: Option<f32>,
    /// The height of its floor in the space of the picture; nothing where the lowest point that it shows is the floor.
    pub floor: Option<f32>,
}

impl Subject<'_> {
    /// When its clip begins and ends, in seconds.
    pub(super) fn span(&self) -> [f64; 2] {
        let times = self.clip.map_or(&[][..], |clip| clip.times_seconds());
        [times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(0.0)]
    }

    /// Matrices of all joints at a time of the clip, in the space of the picture.
    pub(super) fn joints(&self, seconds: f64) -> Vec<Mat4> {
        let locals = self.locals(seconds);
        let mut joints: Vec<Mat4> = Vec::with_capacity(locals.len());
        for (index, local) in locals.iter().enumerate() {
            let above = self.skeleton.parent(index).map_or(self.picture_from_scene, |parent| joints[parent]);
            joints.push(above * local);
        }
        joints
    }

    /// The weights of all morphs at a time.
    pub(super) fn morph_weights(&self, seconds: f64) -> Vec<f32> {
        let mut weights = self.rest_weights.clone();
        let Some(clip) = self.clip else { return weights };
        let (frame, next, share) = between(clip.times_seconds(), seconds);
        for track in clip.morphs() {
            let Some(weight) = weights.get_mut(track.morph) else { continue };
            let [one, other] = [frame, next].map(|frame| track.weights.at(frame, *weight));
            *weight = one + (other - one) * share as f32;
        }
        weights
    }

    /// `parent_from_joint` of all joints at a time.
    fn locals(&self, seconds: f64) -> Vec<Mat4> {
        let rest = self.skeleton.joints().iter().map(|joint| joint.rest);
        let Some(clip) = self.clip else { return rest.map(|rest| matrix(&rest)).collect() };
        let (frame, next, share) = between(clip.times_seconds(), seconds);
        let tracks = rest.zip(clip.joints());
        let local = |(rest, tracks): (Transform, &crate::model::JointTracks)| {
            let translation = [frame, next].map(|at| tracks.translation.at(at, rest.translation.as_vec3()));
            let rotation = [frame, next].map(|at| tracks.rotation.at(at, rest.rotation.as_quat()).normalize());
            let scale = [frame, next].map(|at| tracks.scale.at(at, rest.scale.as_vec3()));
            let share = share as f32;
            Mat4::from_scale_rotation_translation(
                scale[0].lerp(scale[1], share),
                Quat::slerp(rotation[0], rotation[1], share),
                translation[0].lerp(translation[1], share),
            )
        };
        tracks.map(local).collect()
    }
}

fn matrix(transform: &Transform) -> Mat4 {
    transform.to_matrix().as_mat4()
}

/// The frames before and after a time, and how far it is from one to the next.
fn between(times: &[f64], seconds: f64) -> (usize, usize, f64) {
    let last = times.len().saturating_sub(1);
    let next = times.partition_point(|time| *time <= seconds).min(last);
    let frame = if times.get(next).is_some_and(|time| *time <= seconds) { next } else { next.saturating_sub(1) };
    let span = times[next] - times[frame];
    let share = if span > 0.0 { ((seconds - times[frame]) / span).clamp(0.0, 1.0) } else { 0.0 };
    (frame, next, share)
}

/// What a picture is made with, used again from one to the next.
pub(super) struct Studio {
    raster: Raster,
    posed: Posed,
    corners: Vec<Corner>,
    /// Triangles of a surface that are drawn when all others of it are.
    later: Vec<[u32; 3]>,
    size: [usize; 2],
    /// A picture that the next one is drawn over.
    spare: Option<Picture>,
}

/// What is in one picture.
pub(super) struct Shot {
    pub(super) camera: Camera,
    pub(super) style: Style,
    pub(super) background: Background,
    /// Where the floor is drawn: its level, its middle, the height of the figure and the step of the grid.
    pub(super) floor: Option<(f32, Vec3, f32, f32)>,
    /// What is lower than this is red.
    pub(super) sunk_below: Option<f32>,
}

impl Studio {
    pub(super) fn new(size: [usize; 2]) -> Self {
        Self {
            raster: Raster::new(size),
            posed: Posed::default(),
            corners: Vec::new(),
            later: Vec::new(),
            size,
            spare: None,
        }
    }

    /// Draws the next picture over one that is not needed any more, where there is one.
    pub(super) fn draw_over(&mut self, spare: Option<Picture>) {
        self.spare = spare.or_else(|| self.spare.take());
    }

    /// One picture of a subject at a time of its clip.
    pub(super) fn shoot(&mut self, subject: &Subject<'_>, seconds: f64, shot: &Shot) -> Picture {
        let (joints, weights) = (subject.joints(seconds), subject.morph_weights(seconds));
        let camera = shot.camera.enlarged(SAMPLES as f32);
        self.raster.clear();
        let is_mesh = shot.style != Style::Skeleton;
        if is_mesh {
            subject.figure.pose(&joints, &weights, &mut self.posed);
            self.draw(subject.figure, &camera, shot.style, shot.sunk_below);
        }
        let floor = shot.floor.map(|(level, middle, height, step)| {
            if !is_mesh {
                subject.bones.pose(&joints, &weights, &mut self.posed);
            }
            Floor::new(level, middle, height, step, &self.posed.positions)
        });
        if matches!(shot.style, Style::Skeleton | Style::Both) {
            if shot.style == Style::Both {
                // Bones shine through: they are nearer than all of the mesh, and the mesh is dimmed.
                self.raster.forget_depths();
                self.raster.dim(110);
            }
            subject.bones.pose(&joints, &weights, &mut self.posed);
            self.draw(subject.bones, &camera, Style::Shaded, shot.sunk_below);
        }
        self.develop(shot, floor.as_ref())
    }

    fn draw(&mut self, figure: &Figure, camera: &Camera, style: Style, sunk_below: Option<f32>) {
        let (right, back) = (camera.right(), camera.back());
        let up = back.cross(right);
        let key = (back * 0.55 + up * 0.7 - right * 0.45).normalize();
        let fill = (back * 0.5 + up * 0.1 + right * 0.85).normalize();
        let (far, span) = if style == Style::Depth { self.depths(camera) } else { (0.0, 1.0) };
        let mut drawn = figure.drawn();
        drawn.sort_by_key(|surface| surface.opacity < 1.0);
        for surface in drawn {
            let texture = surface.texture.filter(|_| !matches!(style, Style::Depth | Style::Silhouette));
            let brush = Brush {
                texture,
                cut_out_below: surface.cut_out_below,
                opacity: if style == Style::Silhouette { 1.0 } else { surface.opacity },
                is_encoded: texture.is_none() && style != Style::Depth,
            };
            let count = surface.indices.iter().max().map_or(0, |most| *most as usize + 1);
            self.corners.clear();
            for vertex in 0..count {
                let place = self.posed.positions[surface.first + vertex];
                let normal = self.posed.normals[surface.first + vertex].normalize_or_zero();
                let seen = camera.see(place);
                let toward = (camera.eye - place).normalize_or_zero();
                let color = match style {
                    Style::Silhouette => Vec4::ONE,
                    Style::Depth => Vec3::splat(((far - seen.z) / span).clamp(0.03, 1.0)).extend(1.0),
                    _ => {
                        // Both sides of a triangle are lit as the one that is seen.
                        let facing = normal.dot(toward);
                        let normal = if facing < 0.0 { -normal } else { normal };
                        let light = AMBIENT + KEY * normal.dot(key).max(0.0) + FILL * normal.dot(fill).max(0.0);
                        if sunk_below.is_some_and(|level| place.y < level) {
                            (SUNK * light.max(0.6)).extend(1.0)
                        } else {
                            let own = surface.colors.get(vertex).copied().unwrap_or(Vec4::ONE) * surface.base_color;
                            (own.truncate() * (light * rim(facing.abs()))).extend(own.w)
                        }
                    }
                };
                let color =
                    if brush.is_encoded { self.raster.encoded(color.truncate()).extend(color.w) } else { color };
                let texture_coordinate = surface.texture_coordinates.get(vertex).copied().unwrap_or(Vec2::ZERO);
                self.corners.push(Corner::new(camera, seen, texture_coordinate, color));
            }
            self.triangles(camera, surface.indices, &brush);
        }
    }

    /// Draws triangles between the corners: those that face the camera first, since they hide most of the others, which then need no color.
    fn triangles(&mut self, camera: &Camera, indices: &[u32], brush: &Brush<'_>) {
        self.later.clear();
        let is_opaque = brush.opacity >= 1.0;
        for triangle in indices.as_chunks::<3>().0 {
            let corners = triangle.map(|corner| &self.corners[corner as usize]);
            if is_opaque && Corner::is_turned_away(corners) {
                self.later.push(*triangle);
            } else {
                self.raster.triangle(camera, corners, brush);
            }
        }
        if self.later.len() > FEW {
            self.raster.find_hidden_tiles();
        }
        for triangle in &self.later {
            self.raster.triangle(camera, triangle.map(|corner| &self.corners[corner as usize]), brush);
        }
    }

    /// The largest distance of what is posed, and how far it is from the smallest.
    fn depths(&self, camera: &Camera) -> (f32, f32) {
        let depths = self.posed.positions.iter().map(|place| camera.see(*place).z);
        let (near, far) = depths.fold((f32::INFINITY, 0.0_f32), |(near, far), depth| (near.min(depth), far.max(depth)));
        (far, (far - near).max(1e-6))
    }

    /// Samples to pixels, over the floor and the background.
    fn develop(&mut self, shot: &Shot, floor: Option<&Floor>) -> Picture {
        let [width, height] = self.size;
        let is_dark = shot.background == Background::Dark || matches!(shot.style, Style::Depth | Style::Silhouette);
        let base: [f32; 4] = match (shot.style, shot.background) {
            (_, Background::Transparent) => [0.0; 4],
            (Style::Depth | Style::Silhouette, _) => [0.0, 0.0, 0.0, 255.0],
            (_, Background::Light) => [236.0, 238.0, 241.0, 255.0],
            (_, Background::Dark) => [38.0, 41.0, 46.0, 255.0],
        };
        let nothing = base.map(|part| (part + 0.5) as u8);
        let [left, top, right, bottom] = self.raster.touched_pixels();
        let mut pixels = self.spare.take().map(|spare| spare.pixels).unwrap_or_default();
        pixels.clear();
        pixels.reserve_exact(width * height);
        for row in 0..height {
            pixels.resize((row + 1) * width, nothing);
            let drawn = if (top..bottom).contains(&row) { left..right } else { 0..0 };
            let strip = floor.and_then(|floor| floor.strip(&shot.camera, row, width, is_dark));
            let floored = strip.as_ref().map_or(0..0, |strip| strip.columns.clone());
            let line = &mut pixels[row * width..];
            for column in hull(&drawn, &floored) {
                let samples = if drawn.contains(&column) { self.raster.samples(column, row) } else { NO_SAMPLES };
                let opacity: u32 = samples.iter().map(|sample| u32::from(sample[3])).sum();
                let sum = |part: usize| samples.iter().map(|sample| u32::from(sample[part])).sum::<u32>();
                if opacity == 255 * NO_SAMPLES.len() as u32 {
                    let mean =
                        |part: usize| ((sum(part) + NO_SAMPLES.len() as u32 / 2) / NO_SAMPLES.len() as u32) as u8;
                    line[column] = [mean(0), mean(1), mean(2), 255];
                    continue;
                }
                let seen = strip.as_ref().and_then(|strip| strip.seen_at(column));
                if opacity == 0 && seen.is_none_or(|(_, opacity)| opacity <= 0.0) {
                    continue;
                }
                let under = seen.map_or(base, |(gray, opacity)| over([gray * 255.0; 3], opacity, base));
                let color = if opacity > 0 { shared(&samples, opacity) } else { [0.0; 3] };
                let there = opacity as f32 / (255 * NO_SAMPLES.len()) as f32;
                line[column] = over(color, there, under).map(|part| (part + 0.5) as u8);
            }
        }
        Picture { width, height, pixels }
    }
}

const NO_SAMPLES: [[u8; 4]; SAMPLES * SAMPLES] = [[0; 4]; SAMPLES * SAMPLES];

/// The mean color of samples by their opacities, which are so much together.
fn shared(samples: &[[u8; 4]], opacity: u32) -> [f32; 3] {
    let sum = |part: usize| samples.iter().map(|sample| u32::from(sample[part]) * u32::from(sample[3])).sum::<u32>();
    [0, 1, 2].map(|part| sum(part) as f32 / opacity as f32)
}

/// The smallest range that holds two others.
fn hull(one: &Range<usize>, other: &Range<usize>) -> Range<usize> {
    match (one.is_empty(), other.is_empty()) {
        (true, _) => other.clone(),
        (_, true) => one.clone(),
        _ => one.start.min(other.start)..one.end.max(other.end),
    }
}

/// The share of light that is left where a surface is seen at an angle, by the cosine of that to its normal: what is as bright as the background
/// has an outline.
fn rim(facing: f32) -> f32 {
    1.0 - RIM * (1.0 - facing.min(1.0)).powi(2)
}

/// A color of some opacity over another; the opacity of the latter and of the result is 0 to 255.
fn over(color: [f32; 3], opacity: f32, under: [f32; 4]) -> [f32; 4] {
    if under[3] >= 255.0 {
        let mix = |part: usize| under[part] + (color[part] - under[part]) * opacity;
        return [mix(0), mix(1), mix(2), 255.0];
    }
    let behind = under[3] / 255.0 * (1.0 - opacity);
    let together = opacity + behind;
    if together <= 0.0 {
        return [0.0; 4];
    }
    let mix = |part: usize| (color[part] * opacity + under[part] * behind) / together;
    [mix(0), mix(1), mix(2), together * 255.0]
}
