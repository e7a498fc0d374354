//! Triangles to samples, the nearest in front.

use glam::{Vec2, Vec3, Vec4};

use super::{camera::Camera, rounding::floor, texture::Texture};

/// Samples of a picture along each of its sides, for each pixel.
pub(super) const SAMPLES: usize = 2;

/// The samples of one picture.
#[derive(Debug)]
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
    /// One over the distance; 0 where there is nothing.
    pub(super) nearness: Vec<f32>,
    /// sRGB and how much of it is there.
    pub(super) colors: Vec<[u8; 4]>,
    to_srgb: Vec<u8>,
    to_linear: [f32; 256],
}

/// A corner of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// In the axes of the camera: right, up, away.
    pub(super) seen: Vec3,
    pub(super) texture_coordinate: Vec2,
    /// Linear color with the light that falls on it.
    pub(super) color: Vec4,
}

/// How a triangle is painted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Brush<'a> {
    pub(super) texture: Option<&'a Texture>,
    pub(super) cut_out_below: f32,
    pub(super) opacity: f32,
}

/// A corner on the picture.
#[derive(Clone, Copy, Debug)]
struct Shown {
    x: f32,
    y: f32,
    /// One over the distance.
    near: f32,
    texture_coordinate: Vec2,
    color: Vec4,
}

/// Steps of the table from linear light to sRGB.
const STEPS: usize = 4096;

impl Raster {
    /// Samples for a picture of that many pixels.
    pub(super) fn new([width, height]: [usize; 2]) -> Self {
        let (width, height) = (width * SAMPLES, height * SAMPLES);
        let encode = |linear: f32| {
            let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
            (encoded * 255.0 + 0.5) as u8
        };
        let decode = |encoded: usize| {
            let encoded = encoded as f32 / 255.0;
            if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
        };
        Self {
            width,
            height,
            nearness: vec![0.0; width * height],
            colors: vec![[0; 4]; width * height],
            to_srgb: (0..=STEPS).map(|step| encode(step as f32 / STEPS as f32)).collect(),
            to_linear: std::array::from_fn(decode),
        }
    }

    pub(super) fn clear(&mut self) {
        self.nearness.fill(0.0);
        self.colors.fill([0; 4]);
    }

    /// sRGB of linear light.
    pub(super) fn encoded(&self, color: Vec3) -> [u8; 3] {
        [color.x, color.y, color.z].map(|part| self.to_srgb[(part.clamp(0.0, 1.0) * STEPS as f32) as usize])
    }

    /// Draws a triangle, or what of it is ahead of the camera, which must have as many pixels as there are samples.
    pub(super) fn triangle(&mut self, camera: &Camera, corners: &[Corner; 3], brush: &Brush<'_>) {
        let ahead = corners.map(|corner| corner.seen.z > camera.near);
        if ahead == [true; 3] {
            self.fill(&corners.map(|corner| shown(camera, &corner)), brush);
        } else if ahead.contains(&true) {
            let mut kept: Vec<Corner> = Vec::with_capacity(4);
            for index in 0..3 {
                let (one, other) = (&corners[index], &corners[(index + 1) % 3]);
                if ahead[index] {
                    kept.push(*one);
                }
                if ahead[index] != ahead[(index + 1) % 3] {
                    kept.push(between(one, other, (camera.near - one.seen.z) / (other.seen.z - one.seen.z)));
                }
            }
            for index in 2..kept.len() {
                let triangle = [kept[0], kept[index - 1], kept[index]];
                self.fill(&triangle.map(|corner| shown(camera, &corner)), brush);
            }
        }
    }

    fn fill(&mut self, [a, b, c]: &[Shown; 3], brush: &Brush<'_>) {
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let low = |[a, b, c]: [f32; 3], size: usize| {
            let edge = a.min(b).min(c) - 0.5;
            (-floor(-edge.clamp(0.0, size as f32))) as usize
        };
        let high = |[a, b, c]: [f32; 3], size: usize| {
            let edge = a.max(b).max(c) - 0.5;
            (floor(edge.clamp(-1.0, size as f32 - 1.0)) + 1.0) as usize
        };
        let (left, right) = (low([a.x, b.x, c.x], self.width), high([a.x, b.x, c.x], self.width));
        let (top, bottom) = (low([a.y, b.y, c.y], self.height), high([a.y, b.y, c.y], self.height));
        let inverse = 1.0 / area;
        for row in top..bottom {
            let y = row as f32 + 0.5;
            let begin = row * self.width;
            for column in left..right {
                let x = column as f32 + 0.5;
                let share_b = ((x - a.x) * (c.y - a.y) - (y - a.y) * (c.x - a.x)) * inverse;
                let share_c = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) * inverse;
                let share_a = 1.0 - share_b - share_c;
                if share_a < 0.0 || share_b < 0.0 || share_c < 0.0 {
                    continue;
                }
                let near = share_a * a.near + share_b * b.near + share_c * c.near;
                let at = begin + column;
                if near <= self.nearness[at] {
                    continue;
                }
                let shares = Vec3::new(share_a * a.near, share_b * b.near, share_c * c.near) / near;
                let mut color = a.color * shares.x + b.color * shares.y + c.color * shares.z;
                if let Some(texture) = brush.texture {
                    let place = a.texture_coordinate * shares.x
                        + b.texture_coordinate * shares.y
                        + c.texture_coordinate * shares.z;
                    let [red, green, blue, opacity] = texture.at(place.x, place.y);
                    color *= Vec4::new(self.linear(red), self.linear(green), self.linear(blue), opacity);
                }
                if color.w < brush.cut_out_below {
                    continue;
                }
                let [red, green, blue] = self.encoded(color.truncate());
                if brush.opacity < 1.0 {
                    let behind = self.colors[at];
                    let mix = |new: u8, old: u8| {
                        (f32::from(new) * brush.opacity + f32::from(old) * (1.0 - brush.opacity)) as u8
                    };
                    let there = f32::from(behind[3]) / 255.0;
                    let opacity = ((brush.opacity + there * (1.0 - brush.opacity)) * 255.0) as u8;
                    let under = if behind[3] == 0 { [red, green, blue, 0] } else { behind };
                    self.colors[at] = [mix(red, under[0]), mix(green, under[1]), mix(blue, under[2]), opacity];
                    if behind[3] == 0 {
                        self.nearness[at] = near;
                    }
                    continue;
                }
                self.nearness[at] = near;
                self.colors[at] = [red, green, blue, 255];
            }
        }
    }

    fn linear(&self, encoded: f32) -> f32 {
        self.to_linear[(encoded * 255.0 + 0.5) as usize & 255]
    }
}

fn shown(camera: &Camera, corner: &Corner) -> Shown {
    let at = camera.on_picture(corner.seen);
    Shown { x: at.x, y: at.y, near: 1.0 / at.z, texture_coordinate: corner.texture_coordinate, color: corner.color }
}

fn between(one: &Corner, other: &Corner, share: f32) -> Corner {
    Corner {
        seen: one.seen.lerp(other.seen, share),
        texture_coordinate: one.texture_coordinate.lerp(other.texture_coordinate, share),
        color: one.color.lerp(other.color, share),
    }
}
