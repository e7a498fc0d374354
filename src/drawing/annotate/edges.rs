//! What surrounds the paper in a photograph: the table that it lies on, and its own edge.

use super::bits::Bits;

/// By how many grays of 255 something is darker than paper.
const DARKER: f32 = 45.0;
/// Part of the pixels of a line that are darker, from which on the line is not on the paper.
const BUSY: f64 = 0.42;
/// How wide such a strip is at least and at most, as shares of the side.
const WIDTHS: [f64; 2] = [0.03, 0.4];
/// How much of a sheet and of the quadrangle of its four corners is common to both.
const SHEET: f64 = 0.9;
/// Part of the picture that a sheet takes at least.
const SHEET_SHARE: f64 = 0.12;
/// How far from the edge of the sheet nothing counts as drawn on it, as a share of its side.
const SHEET_EDGE: f64 = 0.03;

/// Takes strokes out of strips along the edges of a picture that are darker than the paper in most places. Gives how many strips there were.
pub(super) fn take_surroundings(strokes: &mut Bits, gray: &[f32]) -> usize {
    let (width, height) = (strokes.width, strokes.height);
    let mut counts = [0_usize; 256];
    gray.iter().for_each(|&gray| counts[gray as usize] += 1);
    let mut brighter = 0;
    let paper = counts.iter().rposition(|count| {
        brighter += count;
        brighter * 3 >= gray.len()
    });
    let dark = paper.unwrap_or(255) as f32 - DARKER;
    let mut rows = vec![0_usize; height];
    let mut columns = vec![0_usize; width];
    for (pixel, _) in gray.iter().enumerate().filter(|(_, gray)| **gray < dark) {
        rows[pixel / width] += 1;
        columns[pixel % width] += 1;
    }
    let [top, bottom] = [strip(rows.iter(), width), strip(rows.iter().rev(), width)];
    let [left, right] = [strip(columns.iter(), height), strip(columns.iter().rev(), height)];
    for (pixel, is_in) in strokes.cells.iter_mut().enumerate() {
        let (row, column) = (pixel / width, pixel % width);
        *is_in &= row >= top && row + bottom < height && column >= left && column + right < width;
    }
    [top, bottom, left, right].into_iter().filter(|&strip| strip > 0).count()
}

/// How many lines from an edge on are dark.
fn strip<'a>(lines: impl ExactSizeIterator<Item = &'a usize>, length: usize) -> usize {
    let most = (lines.len() as f64 * WIDTHS[1]) as usize;
    let least = (lines.len() as f64 * WIDTHS[0]).max(4.0) as usize;
    let mut sum = 0;
    let mut width = 0;
    for (index, &count) in lines.take(most).enumerate() {
        sum += count;
        let is_busy = sum as f64 > BUSY * ((index + 1) * length) as f64;
        if !is_busy && index > least {
            break;
        }
        // The strip ends with its last dark line, and takes the edge of the paper along.
        if is_busy && count as f64 > 0.7 * BUSY * length as f64 {
            width = index + 1;
        }
    }
    if width >= least { width + least / 2 } else { 0 }
}

/// What is drawn on a sheet of paper, where that is what a figure is: it fills the quadrangle of its four corners.
pub(super) fn drawn_on_sheet(figure: &Bits, strokes: &Bits) -> Option<Bits> {
    let area = figure.count() as f64;
    if area < SHEET_SHARE * figure.cells.len() as f64 {
        return None;
    }
    let pixels = (0..figure.cells.len()).filter(|&pixel| figure.cells[pixel]);
    let places = pixels.map(|pixel| [(pixel % figure.width) as f64, (pixel / figure.width) as f64]);
    // The corners of a sheet that is turned by less than half a right angle.
    let mut corners = [[0.0; 2]; 4];
    let mut extremes = [f64::NEG_INFINITY; 4];
    for [x, y] in places {
        for (corner, (extreme, value)) in extremes.iter_mut().zip([-x - y, x - y, x + y, y - x]).enumerate() {
            if value > *extreme {
                (*extreme, corners[corner]) = (value, [x, y]);
            }
        }
    }
    let side = |corner: usize, [x, y]: [f64; 2]| {
        let [from, to] = [corners[corner], corners[(corner + 1) % 4]];
        (to[0] - from[0]) * (y - from[1]) - (to[1] - from[1]) * (x - from[0])
    };
    let is_within = |pixel: usize| {
        let place = [(pixel % figure.width) as f64, (pixel / figure.width) as f64];
        (0..4).all(|corner| side(corner, place) >= 0.0)
    };
    let within: Vec<usize> = (0..figure.cells.len()).filter(|&pixel| is_within(pixel)).collect();
    let common = within.iter().filter(|&&pixel| figure.cells[pixel]).count() as f64;
    if common < SHEET * (area + within.len() as f64 - common) {
        return None;
    }
    let edge = (SHEET_EDGE * area.sqrt()).max(3.0) as usize;
    let inner = figure.shrunk(edge);
    Some(Bits::of(figure.width, figure.height, |pixel| inner.cells[pixel] && strokes.cells[pixel]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_below_the_paper_is_left_out_and_feet_are_not() {
        let mut strokes = Bits::filled(200, 200, false);
        strokes.draw_line([[100.0, 60.0], [100.0, 199.0]], 6.0);
        let drawn = strokes.clone();
        let mut gray: Vec<f32> = strokes.cells.iter().map(|&is_in| if is_in { 30.0 } else { 220.0 }).collect();
        assert_eq!(take_surroundings(&mut strokes, &gray), 0);
        assert_eq!(strokes, drawn, "a line is no table");
        (165 * 200..40_000).filter(|pixel| pixel % 3 > 0).for_each(|pixel| gray[pixel] = 90.0);
        assert_eq!(take_surroundings(&mut strokes, &gray), 1);
        assert!(strokes.has(100, 100) && !strokes.has(100, 190), "what is drawn stays, the table goes");
    }

    #[test]
    fn a_sheet_is_told_from_a_figure() {
        let mut sheet = Bits::filled(200, 200, false);
        for step in 0..120 {
            sheet.draw_line([[40.0, 30.0 + f64::from(step)], [160.0, 38.0 + f64::from(step)]], 2.0);
        }
        let mut strokes = Bits::filled(200, 200, false);
        strokes.draw_line([[100.0, 60.0], [100.0, 130.0]], 4.0);
        let drawn = strokes.count();
        strokes.draw_line([[40.0, 30.0], [160.0, 38.0]], 4.0);
        let found = drawn_on_sheet(&sheet, &strokes).expect("a sheet");
        assert_eq!(found.count(), drawn, "what is drawn on it, without its edge");
        let mut figure = Bits::filled(200, 200, false);
        figure.draw_disc([100.0, 100.0], 80.0);
        assert!(drawn_on_sheet(&figure, &strokes).is_none(), "a disc is no sheet");
    }
}
