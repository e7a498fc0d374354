//! The lines of lined and squared paper, which reach over the whole picture and would tie the figure to its edges.

use super::bits::Bits;

/// Part of a picture's width that a line of the paper covers.
const COVERED: f64 = 0.6;
/// Lines from which on paper counts as lined.
const MIN_LINES: usize = 4;
/// Part of the other side that they are spread over.
const SPREAD: f64 = 0.35;
/// Slopes that are tried to both sides: up to three degrees.
const SLOPES: i32 = 26;
const SLOPE: f64 = 0.002;
/// How far from its line a pixel may lie, in pixels.
const NEAR: i64 = 3;

/// Takes lines of the paper out of strokes. Gives how many there were.
pub(super) fn take_lines(strokes: &mut Bits) -> usize {
    let across = take_across(strokes, MIN_LINES, COVERED);
    let mut turned = turned(strokes);
    // Paper that is lined may have a margin: a single line from top to bottom.
    let (least, covered) = if across > 0 { (1, 0.85) } else { (MIN_LINES, COVERED) };
    let down = take_across(&mut turned, least, covered);
    if down > 0 {
        *strokes = self::turned(&turned);
    }
    across + down
}

fn turned(bits: &Bits) -> Bits {
    let (width, height) = (bits.height, bits.width);
    Bits::of(width, height, |pixel| bits.cells[pixel % width * bits.width + pixel / width])
}

/// Takes lines from left to right out.
fn take_across(strokes: &mut Bits, least: usize, covered: f64) -> usize {
    let (width, height) = (strokes.width, strokes.height);
    let pixels: Vec<[usize; 2]> = (0..strokes.cells.len())
        .filter(|&pixel| strokes.cells[pixel] && (pixel % width).is_multiple_of(2))
        .map(|pixel| [pixel % width, pixel / width])
        .collect();
    let mut best: Option<(u64, f64, Vec<u32>)> = None;
    for step in -SLOPES..=SLOPES {
        let slope = f64::from(step) * SLOPE;
        let counts = counts_along(&pixels, slope, [width, height]);
        let sharpness = counts.iter().map(|&count| u64::from(count).pow(2)).sum();
        if best.as_ref().is_none_or(|best| sharpness > best.0) {
            best = Some((sharpness, slope, counts));
        }
    }
    let Some((_, slope, counts)) = best else { return 0 };
    let lines = peaks(&counts, (covered * width.div_ceil(2) as f64) as u32);
    let spread = lines.last().zip(lines.first()).map_or(0, |(last, first)| last - first);
    if lines.len() < least || (least > 1 && (spread as f64) < SPREAD * height as f64) {
        return 0;
    }
    for line in &lines {
        take_line(strokes, *line as f64 - margin(width), slope);
    }
    lines.len()
}

/// Room for lines that begin above the picture.
fn margin(width: usize) -> f64 {
    (f64::from(SLOPES) * SLOPE * width as f64).ceil()
}

/// How many pixels lie on each line of a slope.
fn counts_along(pixels: &[[usize; 2]], slope: f64, [width, height]: [usize; 2]) -> Vec<u32> {
    let margin = margin(width);
    let mut counts = vec![0; height + 2 * margin as usize + 2];
    for &[column, row] in pixels {
        let line = row as f64 - slope * column as f64 + margin;
        counts[line.round() as usize] += 1;
    }
    counts
}

/// Lines on which more than that many pixels lie, of neighbors only the one with most.
fn peaks(counts: &[u32], least: u32) -> Vec<usize> {
    let near = 2 * NEAR as usize;
    let is_peak = |at: usize| {
        let around = &counts[at.saturating_sub(near)..(at + near + 1).min(counts.len())];
        counts[at] >= least.max(1) && around.iter().all(|&count| count <= counts[at])
    };
    let mut found: Vec<usize> = Vec::new();
    for at in (0..counts.len()).filter(|&at| is_peak(at)) {
        if found.last().is_none_or(|&last| at > last + near) {
            found.push(at);
        }
    }
    found
}

/// Takes one line out, where nothing that is drawn crosses it.
fn take_line(strokes: &mut Bits, begin: f64, slope: f64) {
    let (width, height) = (strokes.width, strokes.height as i64);
    let runs: Vec<Option<[i64; 2]>> = (0..width as i64)
        .map(|column| {
            let middle = (begin + slope * column as f64).round() as i64;
            let row = (0..=NEAR).flat_map(|far| [middle - far, middle + far]).find(|&row| strokes.has(column, row))?;
            let first = (0..row).rev().take_while(|&row| strokes.has(column, row)).count() as i64;
            let last = (row + 1..height).take_while(|&row| strokes.has(column, row)).count() as i64;
            Some([row - first, row + last])
        })
        .collect();
    let mut lengths: Vec<i64> = runs.iter().flatten().map(|[first, last]| last - first + 1).collect();
    lengths.sort_unstable();
    let usual = lengths.get(lengths.len() / 2).copied().unwrap_or(0);
    for (column, run) in runs.iter().enumerate() {
        if let Some([first, last]) = *run
            && last - first < usual * 2
        {
            (first..=last).for_each(|row| strokes.cells[row as usize * width + column] = false);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_paper_go_and_what_crosses_them_stays() {
        let mut strokes = Bits::filled(300, 200, false);
        for line in [20.0, 55.0, 90.0, 125.0, 160.0, 195.0] {
            strokes.draw_line([[0.0, line], [300.0, line - 8.0]], 2.0);
        }
        strokes.draw_line([[150.5, 30.0], [150.5, 170.0]], 6.0);
        let crossing = strokes.has(150, 90);
        assert_eq!(take_lines(&mut strokes), 6, "all of them");
        assert!(crossing && strokes.has(150, 90), "the stroke is whole");
        let left = strokes.count();
        assert!((800..1100).contains(&left), "{left} pixels are left of a stroke of 840");
    }

    #[test]
    fn the_arms_of_a_figure_are_no_paper() {
        let mut strokes = Bits::filled(300, 200, false);
        strokes.draw_line([[0.0, 60.0], [300.0, 60.0]], 4.0);
        strokes.draw_line([[150.0, 20.0], [150.0, 120.0]], 4.0);
        let before = strokes.clone();
        assert_eq!(take_lines(&mut strokes), 0);
        assert_eq!(strokes, before);
    }
}
