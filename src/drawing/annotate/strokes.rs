//! What of a picture is drawn: pixels that are darker than the paper around them, as *Animated Drawings* finds them.

use super::{bits::Bits, components::without_specks};
use crate::picture::Picture;

/// Reach of the mean that a pixel is compared with: the standard deviation of OpenCV's window of 115 pixels.
const AROUND: f64 = 17.6;
/// By how much a stroke is darker than that mean.
const DARKER: f32 = 8.0;
/// The same where nothing was found with it, for faint pencil.
const LITTLE_DARKER: f32 = 4.0;
/// Noise of a clean scan, as a standard deviation.
const QUIET: f32 = 3.0;
/// The same where strokes are hardly darker.
const QUIET_FOR_FAINT: f32 = 0.8;

/// Pixels that are darker than what is around them.
pub(super) struct Strokes {
    pub(super) bits: Bits,
    /// How bright each pixel is, 0 to 255; dark ones are drawn.
    pub(super) gray: Vec<f32>,
    /// Standard deviation of the noise of the paper.
    pub(super) noise: f32,
    /// Whether strokes are light on a dark ground.
    pub(super) is_light: bool,
}

/// The strokes of a picture; of a faint one, those that are hardly darker.
pub(super) fn strokes(picture: &Picture, is_faint: bool) -> Strokes {
    let (width, height) = (picture.width, picture.height);
    let (mut gray, is_light) = darkest(picture);
    let noise = noise(&gray, width, height);
    let mut threshold = if is_faint { LITTLE_DARKER } else { DARKER };
    let quiet = if is_faint { QUIET_FOR_FAINT } else { QUIET };
    if noise > quiet {
        // A blur of one pixel leaves about a quarter of the noise.
        gray = blurred(&gray, width, height, 1.2);
        threshold = threshold.max(noise * 1.2);
    }
    let mean = blurred(&gray, width, height, AROUND);
    let bits = Bits::of(width, height, |pixel| gray[pixel] <= mean[pixel] - threshold);
    // Grains that are left would grow into blots.
    let specks = if noise > quiet { 24 } else { 4 };
    Strokes { bits: without_specks(&bits, specks), gray, noise, is_light }
}

/// The darkest channel of each pixel over white; the picture is turned to its negative where its ground is dark.
fn darkest(picture: &Picture) -> (Vec<f32>, bool) {
    let over_white = |pixel: &[u8; 4]| {
        let opacity = f32::from(pixel[3]) / 255.0;
        [0, 1, 2].map(|part: usize| f32::from(pixel[part]) * opacity + 255.0 * (1.0 - opacity))
    };
    let (width, height) = (picture.width, picture.height);
    let mut edge: Vec<u8> = Vec::new();
    for (index, pixel) in picture.pixels.iter().enumerate() {
        let (row, column) = (index / width, index % width);
        if row == 0 || column == 0 || row + 1 == height || column + 1 == width {
            edge.push(over_white(pixel).into_iter().fold(0.0, f32::max) as u8);
        }
    }
    edge.sort_unstable();
    let is_light = edge.get(edge.len() / 2).is_some_and(|&median| median < 90);
    let gray = |pixel: &[u8; 4]| {
        let parts = over_white(pixel);
        if is_light { 255.0 - parts.into_iter().fold(0.0, f32::max) } else { parts.into_iter().fold(255.0, f32::min) }
    };
    (picture.pixels.iter().map(gray).collect(), is_light)
}

/// The standard deviation of the noise, by the median of second differences, which strokes hardly change (after Immerkaer, 1996).
fn noise(gray: &[f32], width: usize, height: usize) -> f32 {
    if width < 3 || height < 3 {
        return 0.0;
    }
    let mut counts = [0_usize; 1024];
    let step = if width * height > 250_000 { 2 } else { 1 };
    for row in (1..height - 1).step_by(step) {
        for column in (1..width - 1).step_by(step) {
            let at = |down: usize, right: usize| gray[(row + down - 1) * width + column + right - 1];
            let corners = at(0, 0) + at(0, 2) + at(2, 0) + at(2, 2);
            let sides = at(0, 1) + at(1, 0) + at(1, 2) + at(2, 1);
            let difference = (corners - 2.0 * sides + 4.0 * at(1, 1)).abs();
            counts[(difference as usize).min(1023)] += 1;
        }
    }
    let half = counts.iter().sum::<usize>() / 2;
    let mut sum = 0;
    let median = counts.iter().position(|count| {
        sum += count;
        sum > half
    });
    // The filter's own gain is 6; the median of the absolute value of a normal distribution is 0.6745 of its deviation.
    median.unwrap_or(0) as f32 / (6.0 * 0.6745)
}

/// Three means over windows, which together are a Gaussian as well as the eye can tell. Pixels of the edge go on beyond it.
fn blurred(gray: &[f32], width: usize, height: usize, deviation: f64) -> Vec<f32> {
    let mut blurred = gray.to_vec();
    let mut between = vec![0.0; gray.len()];
    for radius in radii(deviation) {
        average(&blurred, &mut between, [height, width, width, 1], radius);
        average(&between, &mut blurred, [width, height, 1, width], radius);
    }
    blurred
}

/// Radii of three windows whose variances add up to that of a Gaussian (after Wells, 1986).
fn radii(deviation: f64) -> [usize; 3] {
    let wanted = 12.0 * deviation * deviation;
    let mut low = ((wanted / 3.0 + 1.0).sqrt() as usize).max(1);
    low -= usize::from(low.is_multiple_of(2));
    let size = low as f64;
    let count =
        ((wanted - 3.0 * size * size - 12.0 * size - 9.0) / (-4.0 * size - 4.0)).round().clamp(0.0, 3.0) as usize;
    [0, 1, 2].map(|index| if index < count { low / 2 } else { low / 2 + 1 })
}

fn average(from: &[f32], to: &mut [f32], [lines, pixels, line_step, pixel_step]: [usize; 4], radius: usize) {
    let share = 1.0 / (2 * radius + 1) as f64;
    for line in 0..lines {
        let at = |pixel: i64| from[line * line_step + pixel.clamp(0, pixels as i64 - 1) as usize * pixel_step];
        let reach = radius as i64;
        let mut sum: f64 = (-reach..=reach).map(|pixel| f64::from(at(pixel))).sum();
        for pixel in 0..pixels {
            to[line * line_step + pixel * pixel_step] = (sum * share) as f32;
            let pixel = pixel as i64;
            sum += f64::from(at(pixel + reach + 1)) - f64::from(at(pixel - reach));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blur_keeps_the_mean_and_spreads_as_far_as_it_is_to() {
        let mut gray = vec![0.0; 101];
        gray[50] = 1.0;
        let spread = blurred(&gray, 101, 1, 6.0);
        let sum: f32 = spread.iter().sum();
        let variance: f32 = spread.iter().enumerate().map(|(at, value)| (at as f32 - 50.0).powi(2) * value).sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
        assert!((variance.sqrt() - 6.0).abs() < 0.2, "{}", variance.sqrt());
    }

    #[test]
    fn noise_is_told_from_strokes() {
        // A fixed sequence of numbers stands for noise: evenly spread over 24 grays, a deviation of 6.9.
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f32::from((state >> 24) as u8) / 255.0 * 24.0
        };
        let noisy: Vec<f32> = (0..10_000).map(|_| 180.0 + random()).collect();
        let found = noise(&noisy, 100, 100);
        assert!((5.5..8.5).contains(&found), "{found}");
        let drawn: Vec<f32> = (0..10_000).map(|pixel| if pixel % 100 == 50 { 20.0 } else { 200.0 }).collect();
        assert!(noise(&drawn, 100, 100) < 1.0, "a line is no noise");
    }
}
