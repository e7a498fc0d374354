//! The size that drawings are looked at in, so that widths in pixels mean the same in all of them.

use crate::picture::Picture;

/// Pixels of the longer side at most, as of *Animated Drawings*.
pub(super) const LARGEST: usize = 1000;
/// Pixels of the longer side at least; smaller pictures are magnified.
pub(super) const SMALLEST: usize = 300;

/// The picture in the size that it is looked at in.
pub(super) fn to_working_size(picture: &Picture) -> Picture {
    let long = picture.width.max(picture.height);
    let side = long.clamp(SMALLEST, LARGEST);
    if side == long {
        return picture.clone();
    }
    let sized = |pixels: usize| ((pixels as f64 * side as f64 / long as f64).round() as usize).max(1);
    let size = [sized(picture.width), sized(picture.height)];
    if side < long { averaged(picture, size) } else { magnified(picture, size) }
}

/// Smaller: each pixel is the mean of all that it covers, by opacity.
fn averaged(picture: &Picture, [width, height]: [usize; 2]) -> Picture {
    let spans = |from: usize, to: usize| -> Vec<Vec<(usize, f32)>> {
        let ratio = from as f64 / to as f64;
        let span = |at: usize| {
            let (begin, end) = (at as f64 * ratio, (at + 1) as f64 * ratio);
            let covered = (begin as usize)..(end.ceil() as usize).min(from);
            covered.map(|pixel| (pixel, (end.min(pixel as f64 + 1.0) - begin.max(pixel as f64)) as f32)).collect()
        };
        (0..to).map(span).collect()
    };
    let columns = spans(picture.width, width);
    let mut pixels = Vec::with_capacity(width * height);
    let mut sums = vec![[0.0_f32; 5]; width];
    for rows in spans(picture.height, height) {
        sums.fill([0.0; 5]);
        for (row, row_share) in rows {
            let line = &picture.pixels[row * picture.width..][..picture.width];
            for (sum, span) in sums.iter_mut().zip(&columns) {
                for &(column, share) in span {
                    add(sum, line[column], share * row_share);
                }
            }
        }
        pixels.extend(sums.iter().map(mean));
    }
    Picture { width, height, pixels }
}

/// Larger: each pixel lies between four.
fn magnified(picture: &Picture, [width, height]: [usize; 2]) -> Picture {
    let between = |at: usize, to: usize, from: usize| {
        let place = ((at as f32 + 0.5) * from as f32 / to as f32 - 0.5).clamp(0.0, (from - 1) as f32);
        let low = place as usize;
        [(low, 1.0 - place.fract()), ((low + 1).min(from - 1), place.fract())]
    };
    let pixel = |index: usize| {
        let mut sum = [0.0; 5];
        for (row, row_share) in between(index / width, height, picture.height) {
            for (column, share) in between(index % width, width, picture.width) {
                add(&mut sum, picture.pixels[row * picture.width + column], share * row_share);
            }
        }
        mean(&sum)
    };
    Picture { width, height, pixels: (0..width * height).map(pixel).collect() }
}

fn add(sum: &mut [f32; 5], pixel: [u8; 4], share: f32) {
    let opaque = share * f32::from(pixel[3]);
    (0..3).for_each(|part| sum[part] += opaque * f32::from(pixel[part]));
    sum[3] += opaque;
    sum[4] += share;
}

fn mean(sum: &[f32; 5]) -> [u8; 4] {
    let color = |part: usize| if sum[3] > 0.0 { (sum[part] / sum[3] + 0.5) as u8 } else { 0 };
    [color(0), color(1), color(2), (sum[3] / sum[4].max(1e-9) + 0.5) as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_come_into_the_range_and_keep_their_colors() {
        let large = Picture::filled(2500, 20, [10, 200, 30, 255]);
        let small = to_working_size(&large);
        assert_eq!((small.width, small.height, small.pixels[0]), (1000, 8, [10, 200, 30, 255]), "smaller");
        let tiny = Picture::filled(30, 60, [10, 200, 30, 128]);
        let large = to_working_size(&tiny);
        assert_eq!((large.width, large.height, large.pixels[5]), (150, 300, [10, 200, 30, 128]), "larger");
        let fits = Picture::filled(400, 500, [1, 2, 3, 255]);
        assert_eq!(to_working_size(&fits), fits, "as it is");
    }
}
