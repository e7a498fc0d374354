//! Images of a figure, to colors.

use super::{
    error::PictureError,
    image::{Pixels, decode},
    rounding::floor,
};

/// Colors that repeat in both directions.
#[derive(Clone, Debug)]
pub(super) struct Texture {
    width: usize,
    height: usize,
    /// sRGB and opacity.
    pixels: Vec<[u8; 4]>,
}

impl Texture {
    /// Reads a PNG, a JPEG or a WebP, and makes it smaller until neither side is longer than that.
    pub(super) fn read(bytes: &[u8], longest_side: usize) -> Result<Self, PictureError> {
        let Pixels { width, height, pixels, .. } = decode(bytes, Some(longest_side))?;
        Ok(Self { width, height, pixels })
    }

    /// The color at a place, from the nearest four pixels.
    pub(super) fn at(&self, u: f32, v: f32) -> [f32; 4] {
        let x = (u - floor(u)) * self.width as f32 - 0.5;
        let y = (v - floor(v)) * self.height as f32 - 0.5;
        let (left, top) = (floor(x), floor(y));
        let (right_share, low_share) = (x - left, y - top);
        let wrap = |at: f32, size: usize| (at as i64).rem_euclid(size as i64) as usize;
        let columns = [wrap(left, self.width), wrap(left + 1.0, self.width)];
        let rows = [wrap(top, self.height), wrap(top + 1.0, self.height)];
        let pixel = |row: usize, column: usize| self.pixels[rows[row] * self.width + columns[column]].map(f32::from);
        let mix = |one: [f32; 4], other: [f32; 4], share: f32| {
            [0, 1, 2, 3].map(|part: usize| one[part] + (other[part] - one[part]) * share)
        };
        let high = mix(pixel(0, 0), pixel(0, 1), right_share);
        let low = mix(pixel(1, 0), pixel(1, 1), right_share);
        mix(high, low, low_share).map(|part| part * (1.0 / 255.0))
    }
}
