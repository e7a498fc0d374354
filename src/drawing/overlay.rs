//! What is drawn over a drawing and under it: bones, meshes, parts in colors, a floor.

use glam::{DVec2, DVec3};

use crate::picture::Picture;

use super::{ViewSection, viewpoint::Viewpoint};

/// Which parts of a drawing are drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    pub(super) texture: bool,
    pub(super) colors: bool,
    pub(super) mesh: bool,
    pub(super) rig: bool,
}

impl Shown {
    pub(super) fn of(view: &ViewSection) -> Self {
        Self {
            texture: view.draw_ad_txtr,
            colors: view.draw_ad_color,
            mesh: view.draw_ad_mesh_lines,
            rig: view.draw_ad_rig,
        }
    }
}

const BLACK: [u8; 4] = [0, 0, 0, 255];

/// The color of a joint's part: the same for the same joint, and unlike that of its neighbors.
pub(super) fn color_of(joint: usize) -> [u8; 4] {
    // Steps of the golden angle around the circle of hues.
    let hue = (joint as f64 * 0.618_034).fract() * 6.0;
    let part = |shift: f64| {
        let at = (hue + shift).rem_euclid(6.0);
        (255.0 * (0.25 + 0.7 * (2.0 - (at - 3.0).abs()).clamp(0.0, 1.0))) as u8
    };
    [part(3.0), part(1.0), part(5.0), 255]
}

/// A line of one pixel.
pub(super) fn line(from: DVec2, to: DVec2, picture: &mut Picture) {
    let size = DVec2::new(picture.width as f64, picture.height as f64);
    let is_near = |place: DVec2| place.is_finite() && place.abs().max_element() < 16.0 * size.max_element();
    if !is_near(from) || !is_near(to) {
        return;
    }
    let steps = (to - from).abs().max_element().ceil().max(1.0);
    for step in 0..=steps as usize {
        let at = from.lerp(to, step as f64 / steps).floor();
        if at.x >= 0.0 && at.y >= 0.0 && at.x < size.x && at.y < size.y {
            picture.pixels[at.y as usize * picture.width + at.x as usize] = BLACK;
        }
    }
}

/// The edges of a triangle.
pub(super) fn outline(corners: [Option<DVec2>; 3], picture: &mut Picture) {
    if let [Some(one), Some(two), Some(three)] = corners {
        [(one, two), (two, three), (three, one)].into_iter().for_each(|(from, to)| line(from, to, picture));
    }
}

/// A black square of that half side, of one pixel at least.
pub(super) fn dot(at: DVec2, half: f64, picture: &mut Picture) {
    let half = half.clamp(0.5, picture.width.max(picture.height) as f64);
    let range = |at: f64, most: usize| {
        let low = (at - half).round().clamp(0.0, most as f64) as usize;
        low..((at + half).round().clamp(0.0, most as f64) as usize)
    };
    for row in range(at.y, picture.height) {
        let width = picture.width;
        picture.pixels[row * width..][range(at.x, width)].fill(BLACK);
    }
}

/// Tiles of one unit at the height of 0, white and gray, evenly lit.
pub fn draw_floor(view: &ViewSection, picture: &mut Picture) {
    /// Tiles are centered on whole numbers between these.
    const TILES: std::ops::RangeInclusive<f64> = -5.5..=4.5;
    const SHADES: [f64; 2] = [255.0, 76.5];
    let viewpoint = Viewpoint::new(view);
    let width = picture.width;
    for (index, pixel) in picture.pixels.iter_mut().enumerate() {
        let (mut sum, mut hits) = (0.0, 0.0);
        // Four samples a pixel, so that far tiles do not flicker.
        for (right, down) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
            let at = DVec2::new((index % width) as f64 + right, (index / width) as f64 + down);
            let Some(DVec3 { x, z, .. }) = viewpoint.on_floor(at) else { continue };
            if TILES.contains(&x) && TILES.contains(&z) {
                let is_odd = ((x + 0.5).floor() + (z + 0.5).floor()).rem_euclid(2.0) as usize;
                sum += SHADES[is_odd];
                hits += 1.0;
            }
        }
        if hits > 0.0 {
            let (shade, share) = (sum / hits, hits / 4.0);
            let opacity = f64::from(pixel[3]) / 255.0;
            let whole = share + opacity * (1.0 - share);
            for part in &mut pixel[..3] {
                let mixed = shade * share + f64::from(*part) * opacity * (1.0 - share);
                *part = (mixed / whole + 0.5) as u8;
            }
            pixel[3] = (whole * 255.0 + 0.5) as u8;
        }
    }
}
