//! The grid and the shadow that a figure stands on.

use glam::{Vec2, Vec3};

use super::{camera::Camera, rounding::floor};

/// Cells of the shadow along each side.
const CELLS: usize = 128;
/// The shadow reaches this far around the figure, in its heights.
const REACH: f32 = 1.1;
/// What is higher above the floor than this share of the figure's height casts no shadow.
const SHADED: f32 = 0.35;
/// How far the grid is seen, in heights of the figure.
const SEEN: f32 = 0.95;

/// A floor under a figure of some height, with what it darkens at one frame.
#[derive(Clone, Debug)]
pub(super) struct Floor {
    pub(super) level: f32,
    middle: Vec2,
    height: f32,
    /// From one line of the grid to the next.
    step: f32,
    shadow: Vec<f32>,
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
        Self { level, middle, height, step, shadow }
    }

    /// Gray and opacity of the floor where a pixel sees it, each from 0 to 1; nothing where it does not.
    pub(super) fn seen_at(&self, camera: &Camera, x: f32, y: f32, is_dark: bool) -> Option<(f32, f32)> {
        let ray = camera.ray(x, y);
        let down = camera.eye.y - self.level;
        if ray.y >= 0.0 || down <= 0.0 {
            return None;
        }
        let distance = down / -ray.y;
        let place = camera.eye + ray * distance;
        let at = Vec2::new(place.x, place.z);
        let fade = 1.0 - at.distance(self.middle) / (SEEN * self.height);
        if fade <= 0.0 {
            return None;
        }
        let fade = (fade * 1.6).min(1.0);
        // A pixel is as wide on the floor as it is far away, and longer the flatter it is looked at.
        let slope = -ray.y / ray.length();
        let pixel = distance * camera.pixel();
        let width = 0.006 * self.height;
        let line = |value: f32, pixel: f32| {
            let off = (value / self.step + 0.5 - floor(value / self.step + 0.5) - 0.5).abs() * self.step;
            let covered = ((width + pixel) * 0.5 - off) / pixel;
            covered.clamp(0.0, (width / pixel).min(1.0))
        };
        let long = pixel / slope.max(0.05);
        let lines = line(at.x, pixel.max(long * ray.x.abs())).max(line(at.y, pixel.max(long * ray.z.abs())));
        let grid = 0.36 * lines * fade;
        let shadow = 0.55 * self.shadow_at(at);
        let opacity = 1.0 - (1.0 - grid) * (1.0 - shadow);
        let gray = if is_dark { 0.62 } else { 0.45 };
        let gray = if opacity > 0.0 { gray * grid * (1.0 - shadow) / opacity } else { 0.0 };
        Some((gray, opacity))
    }

    fn shadow_at(&self, at: Vec2) -> f32 {
        let cell = 2.0 * REACH * self.height / CELLS as f32;
        let at = (at - self.middle) / cell + CELLS as f32 * 0.5 - 0.5;
        let (left, top) = (floor(at.x), floor(at.y));
        let inside = |value: f32| (0.0..CELLS as f32 - 1.0).contains(&value);
        if !inside(left) || !inside(top) {
            return 0.0;
        }
        let (across, down) = (at.x - left, at.y - top);
        let (column, row) = (left as usize, top as usize);
        let cell = |row: usize, column: usize| self.shadow[row * CELLS + column];
        let high = cell(row, column) * (1.0 - across) + cell(row, column + 1) * across;
        let low = cell(row + 1, column) * (1.0 - across) + cell(row + 1, column + 1) * across;
        high * (1.0 - down) + low * down
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
