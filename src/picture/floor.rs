//! The grid and the shadow that a figure stands on.

use std::ops::Range;

use glam::{Vec2, Vec3};

use super::{camera::Camera, rounding::floor};

/// Cells of the shadow along each side.
const CELLS: usize = 128;
/// The shadow reaches this far around the figure, in its heights.
const REACH: f32 = 1.1;
/// What is higher above the floor than this share of the figure's height casts no shadow.
const SHADED: f32 = 0.35;
/// How far the grid is seen, in heights of the figure.
const SEEN: f32 = 0.65;

/// A floor under a figure of some height, with what it darkens at one frame.
#[derive(Clone, Debug)]
pub(super) struct Floor {
    pub(super) level: f32,
    middle: Vec2,
    height: f32,
    /// From one line of the grid to the next.
    step: f32,
    shadow: Vec<f32>,
    /// How many cells of the shadow there are in a unit.
    cells: f32,
    /// The corners of the smallest rectangle that holds the shadow, in cells: outside of it there is none.
    shaded: [Vec2; 2],
}

impl Floor {
    /// `height` is that of the figure, `step` the length from one line to the next.
    pub(super) fn new(level: f32, middle: Vec3, height: f32, step: f32, vertices: &[Vec3]) -> Self {
        let middle = Vec2::new(middle.x, middle.z);
        let mut dark = vec![0.0_f32; CELLS * CELLS];
        let cell = 2.0 * REACH * height / CELLS as f32;
        for vertex in vertices {
            let above = (vertex.y - level) / (SHADED * height);
            if above >= 1.0 {
                continue;
            }
            let at = (Vec2::new(vertex.x, vertex.z) - middle) / cell + CELLS as f32 * 0.5;
            let (column, row) = (floor(at.x), floor(at.y));
            let inside = |value: f32| (1.0..CELLS as f32 - 1.0).contains(&value);
            if inside(column) && inside(row) {
                let weight = (1.0 - above.max(0.0)).powi(2);
                let (column, row) = (column as usize, row as usize);
                for row in row - 1..=row + 1 {
                    for column in column - 1..=column + 1 {
                        let cell = &mut dark[row * CELLS + column];
                        *cell = cell.max(weight);
                    }
                }
            }
        }
        let shadow = blurred(&blurred(&dark));
        let dark = || (0..shadow.len()).filter(|cell| shadow[*cell] > 0.0);
        let place = |cell: usize| Vec2::new((cell % CELLS) as f32, (cell / CELLS) as f32);
        let low = dark().map(place).reduce(Vec2::min).unwrap_or_default() - 1.0;
        let high = dark().map(place).reduce(Vec2::max).unwrap_or_default() + 1.0;
        let shaded = [low.max(Vec2::ZERO), high.min(Vec2::splat(CELLS as f32 - 1.0))];
        Self { level, middle, height, step, shadow, cells: 1.0 / cell, shaded }
    }

    /// The floor as a row of a picture sees it, which has so many pixels; nothing where it does not.
    pub(super) fn strip(&self, camera: &Camera, row: usize, width: usize, is_dark: bool) -> Option<Strip<'_>> {
        // A camera is never tilted to a side: all of a row sees the floor at the same distance.
        let (begin, end) = (camera.ray(0.5, row as f32 + 0.5), camera.ray(1.5, row as f32 + 0.5));
        let down = camera.eye.y - self.level;
        if begin.y >= 0.0 || down <= 0.0 {
            return None;
        }
        let distance = down / -begin.y;
        let flat = |place: Vec3| Vec2::new(place.x, place.z);
        let first = flat(camera.eye + begin * distance) - self.middle;
        let step = flat(end - begin) * distance;
        // Where the way along the row is within the disk in which the floor is seen.
        let radius = SEEN * self.height;
        let (square, half) = (step.length_squared(), first.dot(step));
        let root = half * half - square * (first.length_squared() - radius * radius);
        if root.is_nan() || root <= 0.0 || square <= 0.0 {
            return None;
        }
        let edge = |sign: f32| ((sign * root.sqrt() - half) / square).clamp(-1.0, width as f32);
        let columns = (floor(edge(-1.0)).max(0.0) as usize)..(floor(edge(1.0)) + 2.0).clamp(0.0, width as f32) as usize;
        let pixel = distance * camera.pixel();
        let line = 0.006 * self.height;
        // A pixel is as wide on the floor as it is far away, and longer the flatter it is looked at.
        let long = pixel / (-begin.y).max(0.05);
        Some(Strip { floor: self, columns, first, step, ray: begin, ray_step: end - begin, pixel, long, line, is_dark })
    }

    fn shadow_at(&self, at: Vec2) -> f32 {
        let at = at * self.cells + (CELLS as f32 * 0.5 - 0.5);
        let [low, high] = self.shaded;
        if at.cmplt(low).any() || at.cmpge(high).any() {
            return 0.0;
        }
        let (left, top) = (floor(at.x), floor(at.y));
        let (across, down) = (at.x - left, at.y - top);
        let (column, row) = (left as usize, top as usize);
        let cell = |row: usize, column: usize| self.shadow[row * CELLS + column];
        let high = cell(row, column) * (1.0 - across) + cell(row, column + 1) * across;
        let low = cell(row + 1, column) * (1.0 - across) + cell(row + 1, column + 1) * across;
        high * (1.0 - down) + low * down
    }
}

/// The floor along a row of a picture.
pub(super) struct Strip<'a> {
    floor: &'a Floor,
    /// The pixels that may see it.
    pub(super) columns: Range<usize>,
    /// Where the first pixel of the row sees it, from the middle of the floor, and how much farther each pixel does.
    first: Vec2,
    step: Vec2,
    ray: Vec3,
    ray_step: Vec3,
    /// How wide and how long a pixel is there, and how wide a line of the grid is.
    pixel: f32,
    long: f32,
    line: f32,
    is_dark: bool,
}

impl Strip<'_> {
    /// Gray and opacity of the floor where a pixel sees it, each from 0 to 1; nothing where it does not.
    pub(super) fn seen_at(&self, column: usize) -> Option<(f32, f32)> {
        let off = self.first + self.step * column as f32;
        let fade = 1.0 - off.length() / (SEEN * self.floor.height);
        if fade <= 0.0 {
            return None;
        }
        let fade = (fade * 1.6).min(1.0);
        let at = self.floor.middle + off;
        let ray = self.ray + self.ray_step * column as f32;
        let width = |along: f32| self.pixel.max(self.long * along.abs());
        let lines = self.covered(at.x, width(ray.x)).max(self.covered(at.y, width(ray.z)));
        let grid = 0.27 * lines * fade;
        let shadow = 0.55 * self.floor.shadow_at(off);
        if grid + shadow <= 0.0 {
            return None;
        }
        let opacity = 1.0 - (1.0 - grid) * (1.0 - shadow);
        let gray = if self.is_dark { 0.62 } else { 0.45 };
        Some((gray * grid * (1.0 - shadow) / opacity, opacity))
    }

    /// The share of a pixel of some width that the nearest line covers.
    fn covered(&self, value: f32, pixel: f32) -> f32 {
        let steps = value / self.floor.step + 0.5;
        let off = (steps - floor(steps) - 0.5).abs() * self.floor.step;
        let room = (self.line + pixel) * 0.5 - off;
        if room <= 0.0 { 0.0 } else { (room / pixel).min(self.line / pixel).min(1.0) }
    }
}

/// The mean of five by five cells.
fn blurred(cells: &[f32]) -> Vec<f32> {
    let pass = |cells: &[f32], step: usize| -> Vec<f32> {
        let at = |index: usize, off: isize| {
            let place = (index / step % CELLS) as isize + off;
            if (0..CELLS as isize).contains(&place) {
                cells[(index as isize + off * step as isize) as usize]
            } else {
                0.0
            }
        };
        (0..cells.len()).map(|index| (-2..=2).map(|off| at(index, off)).sum::<f32>() / 5.0).collect()
    };
    pass(&pass(cells, 1), CELLS)
}
