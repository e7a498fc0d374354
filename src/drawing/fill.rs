//! Triangles of a drawing onto a picture.

use glam::DVec2;

use crate::picture::Picture;

/// Opacities below this are left out; the others replace what is there.
const CUT_OUT_BELOW: f64 = 0.1 * 255.0;

/// A corner of a triangle: on the picture and on the texture, both in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) seen: DVec2,
    pub(super) texel: DVec2,
}

/// Draws a triangle. A pixel belongs to the triangle that its middle is in, so neighbors neither overlap nor leave gaps.
pub(super) fn triangle(picture: &mut Picture, texture: &Picture, corners: [Corner; 3]) {
    let [one, two, three] = corners.map(|corner| corner.seen);
    let area = (two - one).perp_dot(three - one);
    if area.abs() < 1e-9 || !area.is_finite() {
        return;
    }
    let low = one.min(two).min(three);
    let high = one.max(two).max(three);
    let pixels = |at: f64, most: usize| (at - 0.5).ceil().clamp(0.0, most as f64) as usize;
    // The texture's place is linear in the picture's.
    let along = [(two - one, corners[1].texel - corners[0].texel), (three - one, corners[2].texel - corners[0].texel)];
    let right = (along[0].1 * along[1].0.y - along[1].1 * along[0].0.y) / area;
    let down = (along[1].1 * along[0].0.x - along[0].1 * along[1].0.x) / area;
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
        if from > to {
            continue;
        }
        let columns = pixels(from, picture.width)..pixels(to, picture.width);
        let start = DVec2::new(columns.start as f64 + 0.5, middle) - one;
        let mut texel = corners[0].texel + right * start.x + down * start.y;
        let width = picture.width;
        for pixel in &mut picture.pixels[row * width..][columns] {
            if let Some(color) = sample(texture, texel) {
                *pixel = color;
            }
            texel += right;
        }
    }
}

/// The color at a place, from the nearest four pixels, by their opacity.
fn sample(texture: &Picture, texel: DVec2) -> Option<[u8; 4]> {
    let (x, y) = (texel.x - 0.5, texel.y - 0.5);
    let (left, top) = (x.floor(), y.floor());
    let (right_share, low_share) = (x - left, y - top);
    let mut sums = [0.0; 4];
    for (row, row_share) in [(top, 1.0 - low_share), (top + 1.0, low_share)] {
        for (column, column_share) in [(left, 1.0 - right_share), (left + 1.0, right_share)] {
            let is_in = row >= 0.0 && column >= 0.0 && row < texture.height as f64 && column < texture.width as f64;
            if is_in {
                let color = texture.pixels[row as usize * texture.width + column as usize];
                let weight = row_share * column_share * f64::from(color[3]);
                sums[3] += weight;
                (0..3).for_each(|part| sums[part] += weight * f64::from(color[part]));
            }
        }
    }
    (sums[3] >= CUT_OUT_BELOW).then(|| {
        let part = |sum: f64| (sum / sums[3] + 0.5) as u8;
        [part(sums[0]), part(sums[1]), part(sums[2]), (sums[3] + 0.5) as u8]
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
        triangle(&mut picture, &texture, [one, two, three]);
        let half = picture.pixels.iter().filter(|pixel| pixel[3] > 0).count();
        let mut other = Picture::filled(20, 20, [0; 4]);
        triangle(&mut other, &texture, [one, three, four]);
        let both = picture.pixels.iter().zip(&other.pixels).filter(|(one, other)| one[3] > 0 && other[3] > 0).count();
        assert!(half > 50);
        assert_eq!(both, 0);
    }
}
