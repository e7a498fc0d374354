//! Triangles of a drawing onto a picture.

use glam::DVec2;

use crate::picture::Picture;

/// Opacities below this are left out; the others replace what is there.
const CUT_OUT_BELOW: f64 = 0.1 * 255.0;

/// What becomes of a pixel that is drawn over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Blend {
    /// It is replaced, or left where the new one has hardly any opacity.
    Replace,
    /// It shines through where the new one is not opaque.
    Over,
}

/// A corner of a triangle: on the picture and on the texture, both in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) seen: DVec2,
    pub(super) texel: DVec2,
}

/// Draws a triangle. A pixel belongs to the triangle that its middle is in, so neighbors neither overlap nor leave gaps.
pub(super) fn triangle(picture: &mut Picture, texture: &Picture, corners: [Corner; 3], blend: Blend) {
    let [one, two, three] = corners.map(|corner| corner.seen);
    let area = (two - one).perp_dot(three - one);
    // The texture's place is linear in the picture's.
    let along = [(two - one, corners[1].texel - corners[0].texel), (three - one, corners[2].texel - corners[0].texel)];
    let right = (along[0].1 * along[1].0.y - along[1].1 * along[0].0.y) / area;
    let down = (along[1].1 * along[0].0.x - along[0].1 * along[1].0.x) / area;
    spans(picture, [one, two, three], |first, pixels| {
        let start = first - one;
        let mut texel = corners[0].texel + right * start.x + down * start.y;
        for pixel in pixels {
            match blend {
                Blend::Replace => {
                    if let Some(color) = sample(texture, texel).filter(|color| f64::from(color[3]) >= CUT_OUT_BELOW) {
                        *pixel = color;
                    }
                }
                Blend::Over => {
                    if let Some(color) = sample(texture, texel) {
                        over(pixel, color);
                    }
                }
            }
            texel += right;
        }
    });
}

/// Draws a triangle in one color.
pub(super) fn flat(picture: &mut Picture, color: &[u8; 4], corners: [Corner; 3]) {
    spans(picture, corners.map(|corner| corner.seen), |_, pixels| pixels.fill(*color));
}

/// The runs of pixels whose middles are in a triangle, with the middle of the first of each.
fn spans(picture: &mut Picture, [one, two, three]: [DVec2; 3], mut draw: impl FnMut(DVec2, &mut [[u8; 4]])) {
    let area = (two - one).perp_dot(three - one);
    if area.abs() < 1e-9 || !area.is_finite() {
        return;
    }
    let low = one.min(two).min(three);
    let high = one.max(two).max(three);
    let pixels = |at: f64, most: usize| (at - 0.5).ceil().clamp(0.0, most as f64) as usize;
    for row in pixels(low.y, picture.height)..pixels(high.y, picture.height) {
        let middle = row as f64 + 0.5;
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for (start, end) in [(one, two), (two, three), (three, one)] {
            // Both triangles of an edge compute the crossing from the same end.
            let (start, end) = if start.y <= end.y { (start, end) } else { (end, start) };
            if start.y <= middle && middle < end.y {
                let at = start.x + (end.x - start.x) * ((middle - start.y) / (end.y - start.y));
                (from, to) = (from.min(at), to.max(at));
            }
        }
        let columns = pixels(from, picture.width)..pixels(to, picture.width);
        if from <= to && !columns.is_empty() {
            let first = DVec2::new(columns.start as f64 + 0.5, middle);
            let width = picture.width;
            draw(first, &mut picture.pixels[row * width..][columns]);
        }
    }
}

/// Lays a color over a pixel.
fn over(pixel: &mut [u8; 4], color: [u8; 4]) {
    if color[3] == 255 || pixel[3] == 0 {
        *pixel = color;
        return;
    }
    let (share, under) = (u32::from(color[3]), u32::from(pixel[3]));
    let rest = under * (255 - share);
    let whole = share * 255 + rest;
    if whole == 0 {
        return;
    }
    for (part, new) in pixel[..3].iter_mut().zip(color) {
        *part = ((u32::from(new) * share * 255 + u32::from(*part) * rest + whole / 2) / whole) as u8;
    }
    pixel[3] = ((whole + 127) / 255) as u8;
}

/// The color at a place, from the nearest four pixels, by their opacity; nothing where all of them have none.
fn sample(texture: &Picture, texel: DVec2) -> Option<[u8; 4]> {
    let (x, y) = (texel.x * 256.0 - 128.0, texel.y * 256.0 - 128.0);
    let (x, y) = (x.floor() as i64, y.floor() as i64);
    let (left, top) = (x >> 8, y >> 8);
    let (right_share, low_share) = ((x & 255) as u32, (y & 255) as u32);
    let mut sums = [0_u32; 4];
    let (width, height) = (texture.width as i64, texture.height as i64);
    for (row, row_share) in [(top, 256 - low_share), (top + 1, low_share)] {
        if row < 0 || row >= height {
            continue;
        }
        for (column, column_share) in [(left, 256 - right_share), (left + 1, right_share)] {
            if column < 0 || column >= width {
                continue;
            }
            let color = texture.pixels[(row * width + column) as usize];
            // At most 255 * 2^16 altogether.
            let weight = row_share * column_share * u32::from(color[3]);
            let coarse = weight >> 8;
            sums[3] += weight >> 8;
            (0..3).for_each(|part| sums[part] += (coarse * u32::from(color[part])) >> 8);
        }
    }
    let opacity = (sums[3] + 128) >> 8;
    (opacity > 0).then(|| {
        let part = |sum: u32| (((sum << 8) + sums[3] / 2) / sums[3].max(1)).min(255) as u8;
        [part(sums[0]), part(sums[1]), part(sums[2]), opacity.min(255) as u8]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_halves_of_a_square_cover_it_once() {
        let texture = Picture::filled(8, 8, [10, 20, 30, 255]);
        let mut picture = Picture::filled(20, 20, [0; 4]);
        let corner = |x: f64, y: f64| Corner { seen: DVec2::new(x, y), texel: DVec2::new(2.0, 2.0) };
        let [one, two, three, four] = [corner(3.3, 3.0), corner(15.2, 4.1), corner(14.0, 16.0), corner(2.5, 15.5)];
        triangle(&mut picture, &texture, [one, two, three], Blend::Replace);
        let half = picture.pixels.iter().filter(|pixel| pixel[3] > 0).count();
        let mut other = Picture::filled(20, 20, [0; 4]);
        triangle(&mut other, &texture, [one, three, four], Blend::Replace);
        let both = picture.pixels.iter().zip(&other.pixels).filter(|(one, other)| one[3] > 0 && other[3] > 0).count();
        assert!(half > 50);
        assert_eq!(both, 0);
    }
}
