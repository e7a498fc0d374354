//! The texture of a drawing without what its mask leaves out, in the size in which it is drawn.

use glam::DVec2;

use crate::picture::Picture;

use super::{CharacterSpec, DrawingError, PlanarRig, lattice::Lattice};

/// Gray of a mask from which on a pixel is the figure's.
const FIGURE_FROM: u8 = 128;
/// A texture that is drawn smaller than this share of its size is made smaller first.
const SHRUNK_BELOW: f64 = 0.7;

/// A texture; what the mask leaves out has no opacity.
#[derive(Clone, Debug)]
pub(super) struct Cutout {
    pub(super) texture: Picture,
    /// By so much it was made smaller.
    pub(super) shrunk: usize,
}

/// Cuts the figure out, and makes its mesh. `scale` is how many pixels of the result a pixel of the texture takes, where the texture may be
/// made smaller for that.
///
/// # Errors
///
/// Where sizes do not fit, or the mask is empty.
pub(super) fn cut_out(
    spec: &CharacterSpec,
    [mut texture, mask]: [Picture; 2],
    scale: Option<f64>,
    mesh: impl Fn(&Picture, &dyn Fn([u8; 4]) -> bool) -> Lattice,
) -> Result<(Cutout, Lattice), DrawingError> {
    for (name, picture) in [("texture.png", &texture), ("mask.png", &mask)] {
        if [picture.width, picture.height] != [spec.width as usize, spec.height as usize] {
            let detail = format!("{name} has {} by {} pixels", picture.width, picture.height);
            let fix = format!("the config says {} by {}", spec.width, spec.height);
            return Err(DrawingError::new("width, height", detail, fix));
        }
    }
    for (pixel, &mask) in texture.pixels.iter_mut().zip(&mask.pixels) {
        if !is_figure(mask) {
            pixel[3] = 0;
        }
    }
    let mesh = mesh(&mask, &is_figure);
    if mesh.triangles.is_empty() {
        let fix = "paint the figure white in the mask, and all else black";
        return Err(DrawingError::new("mask", "nothing in the mask is the figure's", fix));
    }
    let shrunk = scale
        .filter(|scale| *scale < SHRUNK_BELOW && *scale > 0.0)
        .map_or(1, |scale| ((1.0 / scale).round() as usize).clamp(1, 64));
    Ok((Cutout { texture: smaller(texture, shrunk), shrunk }, mesh))
}

fn is_figure(pixel: [u8; 4]) -> bool {
    pixel[0] >= FIGURE_FROM && pixel[3] > 0
}

/// How many pixels of a mask are the figure's, and how many parts there are that do not touch one another.
#[must_use]
pub fn mask_parts(mask: &Picture) -> (usize, usize) {
    let mut is_left: Vec<bool> = mask.pixels.iter().map(|&pixel| is_figure(pixel)).collect();
    let pixels = is_left.iter().filter(|left| **left).count();
    let mut parts = 0;
    let mut open = Vec::new();
    for start in 0..is_left.len() {
        if !std::mem::take(&mut is_left[start]) {
            continue;
        }
        parts += 1;
        open.push(start);
        while let Some(at) = open.pop() {
            let (row, column) = (at / mask.width, at % mask.width);
            for row in row.saturating_sub(1)..(row + 2).min(mask.height) {
                for column in column.saturating_sub(1)..(column + 2).min(mask.width) {
                    let next = row * mask.width + column;
                    if std::mem::take(&mut is_left[next]) {
                        open.push(next);
                    }
                }
            }
        }
    }
    (pixels, parts)
}

/// The joints that no pixel of the mask lies under.
#[must_use]
pub fn joints_outside(mask: &Picture, spec: &CharacterSpec) -> Vec<String> {
    let is_in = |[x, y]: [f64; 2]| {
        let (column, row) = (x as usize, y as usize);
        column < mask.width && row < mask.height && is_figure(mask.pixels[row * mask.width + column])
    };
    spec.skeleton.iter().filter(|joint| !is_in(joint.loc)).map(|joint| joint.name.clone()).collect()
}

/// How far the figure of a mask goes beyond the joints, in sides of the drawing's square: from each of its pixels to the nearest joint.
#[must_use]
pub fn beyond_joints(mask: &Picture, rig: &PlanarRig) -> f64 {
    /// Rows and columns that are looked at: every so many.
    const STEP: usize = 4;
    let side = mask.width.max(mask.height) as f64;
    let mut most: f64 = 0.0;
    for row in (0..mask.height).step_by(STEP) {
        for column in (0..mask.width).step_by(STEP) {
            let pixel = mask.pixels[row * mask.width + column];
            if !is_figure(pixel) {
                continue;
            }
            let at = DVec2::new(column as f64, mask.height as f64 - row as f64) / side;
            let nearest = rig.rest.iter().map(|joint| joint.distance_squared(at)).fold(f64::MAX, f64::min);
            most = most.max(nearest);
        }
    }
    most.sqrt()
}

/// A picture whose pixels are the mean of squares of so many pixels, by their opacity.
fn smaller(picture: Picture, factor: usize) -> Picture {
    if factor <= 1 {
        return picture;
    }
    let (width, height) = (picture.width.div_ceil(factor), picture.height.div_ceil(factor));
    let mut small = Picture::filled(width, height, [0; 4]);
    for (index, pixel) in small.pixels.iter_mut().enumerate() {
        let (left, top) = (index % width * factor, index / width * factor);
        let mut sums = [0_u32; 4];
        for row in top..(top + factor).min(picture.height) {
            for color in &picture.pixels[row * picture.width..][left..(left + factor).min(picture.width)] {
                let opacity = u32::from(color[3]);
                (0..3).for_each(|part| sums[part] += u32::from(color[part]) * opacity);
                sums[3] += opacity;
            }
        }
        if sums[3] > 0 {
            let part = |sum: u32| ((sum + sums[3] / 2) / sums[3]) as u8;
            *pixel = [part(sums[0]), part(sums[1]), part(sums[2]), (sums[3] / (factor * factor) as u32) as u8];
        }
    }
    small
}
