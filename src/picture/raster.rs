//! Triangles to samples, the nearest in front.

use glam::{Vec2, Vec3, Vec4};

use super::{camera::Camera, rounding::floor, texture::Texture};

/// Samples of a picture along each of its sides, for each pixel.
pub(super) const SAMPLES: usize = 2;

/// Samples that are tested at the same time, in a row.
const LANES: usize = 4;
/// What is wider than this is looked at only where a row of it is.
const WIDE: usize = 16;
/// Samples along each side of a tile, of which the farthest is known.
const TILE: usize = 8;
/// More than what the distance of a sample is off from those of its corners by rounding.
const ROUNDING: f32 = 1.0 + 1e-5;

/// The samples of one picture.
#[derive(Debug)]
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
    /// One over the distance; 0 where there is nothing. Longer than there are samples, so that the last of them can be read in lanes.
    nearness: Vec<f32>,
    /// sRGB and how much of it is there.
    colors: Vec<[u8; 4]>,
    /// The least nearness of all samples of each tile when [`Raster::find_hidden_tiles`] was called; as samples only come nearer, there is none
    /// below it. Nothing where it was not.
    farthest: Vec<f32>,
    /// The smallest rectangle that holds all that was drawn: left, top, right, bottom.
    touched: [usize; 4],
    /// From 0 to 255.
    to_srgb: Vec<f32>,
    to_linear: [f32; 256],
}

/// A corner of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Red, green, blue and opacity, with the light that falls on it: linear, or for a brush with [`Brush::is_encoded`] of 0 to 255.
    pub(super) color: Vec4,
    /// In the axes of the camera: right, up, away.
    pub(super) seen: Vec3,
    pub(super) texture_coordinate: Vec2,
    /// Where it is on the picture, in samples, and one over the distance; means nothing where it is not ahead of the camera.
    at: Vec3,
}

impl Corner {
    pub(super) fn new(camera: &Camera, seen: Vec3, texture_coordinate: Vec2, color: Vec4) -> Self {
        let at = camera.on_picture(seen);
        Self { color, seen, texture_coordinate, at: Vec3::new(at.x, at.y, 1.0 / at.z) }
    }

    /// Whether a triangle goes around the other way on the picture than one of a file that is seen from its front.
    #[inline]
    pub(super) fn is_turned_away([a, b, c]: [&Self; 3]) -> bool {
        (b.at.x - a.at.x) * (c.at.y - a.at.y) - (b.at.y - a.at.y) * (c.at.x - a.at.x) > 0.0
    }
}

/// How a triangle is painted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Brush<'a> {
    pub(super) texture: Option<&'a Texture>,
    pub(super) cut_out_below: f32,
    pub(super) opacity: f32,
    /// Whether the colors of corners are sRGB already, which saves that for each sample. Not with a texture.
    pub(super) is_encoded: bool,
}

/// Steps of the table from linear light to sRGB.
const STEPS: usize = 4096;

impl Raster {
    /// Samples for a picture of that many pixels.
    pub(super) fn new([width, height]: [usize; 2]) -> Self {
        let (width, height) = (width * SAMPLES, height * SAMPLES);
        let encode = |linear: f32| {
            let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
            encoded * 255.0
        };
        let decode = |encoded: usize| {
            let encoded = encoded as f32 / 255.0;
            if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
        };
        Self {
            width,
            height,
            nearness: vec![0.0; width * height + LANES],
            colors: vec![[0; 4]; width * height],
            farthest: Vec::new(),
            touched: [width, height, 0, 0],
            to_srgb: (0..=STEPS).map(|step| encode(step as f32 / STEPS as f32)).collect(),
            to_linear: std::array::from_fn(decode),
        }
    }

    pub(super) fn clear(&mut self) {
        self.forget_depths();
        for row in self.touched_rows() {
            self.colors[row].fill([0; 4]);
        }
        self.touched = [self.width, self.height, 0, 0];
    }

    /// Has all that is drawn from now on be in front.
    pub(super) fn forget_depths(&mut self) {
        for row in self.touched_rows() {
            self.nearness[row].fill(0.0);
        }
        self.farthest.clear();
    }

    /// Looks up what each tile hides, so that triangles behind what is drawn so far need not be looked at sample by sample.
    pub(super) fn find_hidden_tiles(&mut self) {
        let (columns, rows) = self.tiles();
        self.farthest.clear();
        self.farthest.resize(columns * rows, 0.0);
        let [left, top, right, bottom] = self.touched;
        for row in top / TILE..bottom / TILE {
            for column in left / TILE..right / TILE {
                let lines = (row * TILE..(row + 1) * TILE)
                    .map(|line| &self.nearness[line * self.width + column * TILE..][..TILE]);
                let least = |line: &[f32]| line.iter().copied().fold(f32::INFINITY, f32::min);
                self.farthest[row * columns + column] = lines.map(least).fold(f32::INFINITY, f32::min);
            }
        }
    }

    /// How many tiles there are across and down.
    const fn tiles(&self) -> (usize, usize) {
        (self.width.div_ceil(TILE), self.height.div_ceil(TILE))
    }

    /// Whether all samples in a rectangle, right and bottom excluded, are known to be nearer than that.
    #[inline]
    fn is_hidden(&self, nearness: f32, [left, top, right, bottom]: [usize; 4]) -> bool {
        let (columns, _) = self.tiles();
        !self.farthest.is_empty()
            && (top / TILE..=(bottom - 1) / TILE).all(|row| {
                let tiles = &self.farthest[row * columns..][left / TILE..=(right - 1) / TILE];
                tiles.iter().all(|farthest| *farthest >= nearness)
            })
    }

    /// Gives all that is drawn so far some opacity.
    pub(super) fn dim(&mut self, opacity: u8) {
        for row in self.touched_rows() {
            self.colors[row].iter_mut().filter(|color| color[3] > 0).for_each(|color| color[3] = opacity);
        }
    }

    fn touched_rows(&self) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let ([left, top, right, bottom], width) = (self.touched, self.width);
        (top..bottom).map(move |row| row * width + left..row * width + right)
    }

    /// The pixels of the picture outside of which nothing is drawn: left, top, right, bottom.
    pub(super) fn touched_pixels(&self) -> [usize; 4] {
        let [left, top, right, bottom] = self.touched;
        [left / SAMPLES, top / SAMPLES, right.div_ceil(SAMPLES), bottom.div_ceil(SAMPLES)]
    }

    /// The samples of a pixel.
    #[inline]
    pub(super) fn samples(&self, column: usize, row: usize) -> [[u8; 4]; SAMPLES * SAMPLES] {
        let first = row * SAMPLES * self.width + column * SAMPLES;
        std::array::from_fn(|sample| self.colors[first + sample / SAMPLES * self.width + sample % SAMPLES])
    }

    /// sRGB of linear light, from 0 to 255.
    #[inline]
    pub(super) fn encoded(&self, color: Vec3) -> Vec3 {
        let part = |part: f32| self.to_srgb[(part.clamp(0.0, 1.0) * STEPS as f32) as usize];
        Vec3::new(part(color.x), part(color.y), part(color.z))
    }

    /// Draws a triangle, or what of it is ahead of the camera, which must have as many pixels as there are samples.
    pub(super) fn triangle(&mut self, camera: &Camera, corners: [&Corner; 3], brush: &Brush<'_>) {
        let ahead = corners.map(|corner| corner.seen.z > camera.near);
        if ahead == [true; 3] {
            self.fill(corners, brush);
        } else if ahead.contains(&true) {
            let mut kept: Vec<Corner> = Vec::with_capacity(4);
            for index in 0..3 {
                let (one, other) = (corners[index], corners[(index + 1) % 3]);
                if ahead[index] {
                    kept.push(*one);
                }
                if ahead[index] != ahead[(index + 1) % 3] {
                    kept.push(between(camera, one, other, (camera.near - one.seen.z) / (other.seen.z - one.seen.z)));
                }
            }
            for index in 2..kept.len() {
                self.fill([&kept[0], &kept[index - 1], &kept[index]], brush);
            }
        }
    }

    fn fill(&mut self, corners: [&Corner; 3], brush: &Brush<'_>) {
        let [a, b, c] = corners.map(|corner| corner.at);
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let [left, right] = covered(a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x), self.width);
        let [top, bottom] = covered(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), self.height);
        if left >= right || top >= bottom {
            return;
        }
        if self.is_hidden(a.z.max(b.z).max(c.z) * ROUNDING, [left, top, right, bottom]) {
            return;
        }
        let [begin, above, end, below] = self.touched;
        self.touched = [begin.min(left), above.min(top), end.max(right), below.max(bottom)];
        // The shares of b and of c: how they grow with each column and each row.
        let inverse = 1.0 / area;
        let (across_b, down_b) = ((c.y - a.y) * inverse, (a.x - c.x) * inverse);
        let (across_c, down_c) = ((a.y - b.y) * inverse, (b.x - a.x) * inverse);
        let lanes = Vec4::new(0.5, 1.5, 2.5, 3.5);
        for row in top..bottom {
            let y = row as f32 + 0.5 - a.y;
            let (row_b, row_c) = (y * down_b, y * down_c);
            let columns = if right - left > WIDE {
                let edges = [(across_b, row_b), (across_c, row_c), (-across_b - across_c, 1.0 - row_b - row_c)];
                inside(edges, a.x, left..right)
            } else {
                left..right
            };
            for column in columns.clone().step_by(LANES) {
                let x = Vec4::splat(column as f32 - a.x) + lanes;
                let share_b = x * across_b + Vec4::splat(row_b);
                let share_c = x * across_c + Vec4::splat(row_c);
                let share_a = Vec4::ONE - share_b - share_c;
                let near = share_a * a.z + share_b * b.z + share_c * c.z;
                let at = row * self.width + column;
                let is_inside = share_a.min(share_b).min(share_c).cmpge(Vec4::ZERO);
                let is_in_front = near.cmpgt(Vec4::from_slice(&self.nearness[at..at + LANES]));
                let mut found = (is_inside & is_in_front).bitmask();
                if found == 0 {
                    continue;
                }
                if column + LANES > columns.end {
                    found &= (1 << (columns.end - column)) - 1;
                }
                let shares = [share_a, share_b, share_c].map(|share| share.to_array());
                let near = near.to_array();
                while found != 0 {
                    let lane = found.trailing_zeros() as usize;
                    found &= found - 1;
                    let weights = Vec3::new(shares[0][lane] * a.z, shares[1][lane] * b.z, shares[2][lane] * c.z);
                    self.sample(at + lane, near[lane], weights / near[lane], corners, brush);
                }
            }
        }
    }

    /// Paints a sample that is nearer than what is there.
    #[inline]
    fn sample(&mut self, at: usize, near: f32, shares: Vec3, [a, b, c]: [&Corner; 3], brush: &Brush<'_>) {
        let mut color = a.color * shares.x + b.color * shares.y + c.color * shares.z;
        if let Some(texture) = brush.texture {
            let place =
                a.texture_coordinate * shares.x + b.texture_coordinate * shares.y + c.texture_coordinate * shares.z;
            let [red, green, blue, opacity] = texture.at(place.x, place.y);
            color *= Vec4::new(self.linear(red), self.linear(green), self.linear(blue), opacity);
        }
        if color.w < brush.cut_out_below {
            return;
        }
        let encoded = if brush.is_encoded { color.truncate() } else { self.encoded(color.truncate()) };
        let [red, green, blue] = (encoded + Vec3::splat(0.5)).to_array().map(|part| part as u8);
        if brush.opacity < 1.0 {
            let behind = self.colors[at];
            let mix =
                |new: u8, old: u8| (f32::from(new) * brush.opacity + f32::from(old) * (1.0 - brush.opacity)) as u8;
            let there = f32::from(behind[3]) / 255.0;
            let opacity = ((brush.opacity + there * (1.0 - brush.opacity)) * 255.0) as u8;
            let under = if behind[3] == 0 { [red, green, blue, 0] } else { behind };
            self.colors[at] = [mix(red, under[0]), mix(green, under[1]), mix(blue, under[2]), opacity];
            if behind[3] == 0 {
                self.nearness[at] = near;
            }
            return;
        }
        self.nearness[at] = near;
        self.colors[at] = [red, green, blue, 255];
    }

    fn linear(&self, encoded: f32) -> f32 {
        self.to_linear[(encoded * 255.0 + 0.5) as usize & 255]
    }
}

/// The first sample whose middle is not below a range, and the first beyond it.
#[inline]
fn covered(low: f32, high: f32, size: usize) -> [usize; 2] {
    let first = (-floor(-(low - 0.5).clamp(0.0, size as f32))) as usize;
    [first, (floor((high - 0.5).clamp(-1.0, size as f32 - 1.0)) + 1.0) as usize]
}

/// The columns, and some more, in which three lines from a place are not below zero; each is how much it rises with a column, and what it is at
/// the place.
fn inside(lines: [(f32, f32); 3], from: f32, columns: std::ops::Range<usize>) -> std::ops::Range<usize> {
    let (mut low, mut high) = (columns.start as f32, columns.end as f32);
    for (rise, at_start) in lines {
        let zero = from - at_start / rise;
        if rise > 0.0 {
            low = low.max(zero - 2.0);
        } else if rise < 0.0 {
            high = high.min(zero + 2.0);
        }
    }
    let end = columns.end.min(high.max(0.0) as usize);
    (low as usize).min(end)..end
}

fn between(camera: &Camera, one: &Corner, other: &Corner, share: f32) -> Corner {
    let texture_coordinate = one.texture_coordinate.lerp(other.texture_coordinate, share);
    Corner::new(camera, one.seen.lerp(other.seen, share), texture_coordinate, one.color.lerp(other.color, share))
}
