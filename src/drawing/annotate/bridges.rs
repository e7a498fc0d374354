//! Parts of a figure that do not touch it, such as hands that are drawn off the arm.

use super::{bits::Bits, components::Component};
use crate::model::Reporter;

/// Area of the smallest part, as a share of the figure's.
const SMALLEST: f64 = 0.02;
/// The widest gap, as a share of the figure's longer side.
const WIDEST: f64 = 0.05;
/// Parts that are joined at most: a picture of confetti has thousands.
const MAX_PARTS: usize = 24;
/// Area from which on what is farther away is another figure.
const ANOTHER: f64 = 0.5;
/// Thickness of a bridge, as a share of the figure's longer side.
const THICKNESS: f64 = 0.012;

/// The figure with all parts that are near, each joined by the shortest bridge.
pub(super) fn join_parts(figure: Bits, parts: &[Component], reporter: &mut Reporter) -> Bits {
    let Some([left, top, right, bottom]) = figure.bounds() else { return figure };
    let side = (right - left).max(bottom - top) as f64;
    let area = figure.count() as f64;
    let is_large = |part: &&Component| part.pixels.len() as f64 >= SMALLEST * area;
    let mut open: Vec<&Component> = parts.iter().filter(is_large).take(MAX_PARTS).collect();
    let mut joined = figure;
    let mut count = 0;
    let widest = (WIDEST * side).ceil() as usize;
    while let Some((index, bridge)) = nearest(&joined, &open, widest) {
        let part = open.swap_remove(index);
        part.pixels.iter().for_each(|&pixel| joined.cells[pixel as usize] = true);
        joined.draw_line(bridge, (THICKNESS * side).max(3.0));
        count += 1;
    }
    if count > 0 {
        let detail = format!("parts of the figure did not touch it ({count}); they were joined by short bridges");
        reporter.warn("parts_joined", "mask", detail, "draw the parts connected, or give a mask");
    }
    let others = open.iter().filter(|part| part.pixels.len() as f64 >= ANOTHER * area).count();
    if others > 0 {
        let detail = format!("other figures in the picture are left out ({others})");
        reporter.warn("other_figures", "image", detail, "cut the picture to the figure that you want, or give a mask");
    }
    joined
}

/// The part that is nearest to the figure, and a line between the two; nothing where none is near.
fn nearest(figure: &Bits, parts: &[&Component], widest: usize) -> Option<(usize, [[f64; 2]; 2])> {
    if parts.is_empty() {
        return None;
    }
    let (width, height) = (figure.width, figure.height);
    // For every pixel the part that it belongs to, counted from one.
    let mut part_of = vec![0_u32; figure.cells.len()];
    for (index, part) in parts.iter().enumerate() {
        part.pixels.iter().for_each(|&pixel| part_of[pixel as usize] = index as u32 + 1);
    }
    // From ring to ring around the figure; each pixel knows where in the figure it came from.
    let mut from = vec![u32::MAX; figure.cells.len()];
    let mut ring: Vec<u32> = (0..figure.cells.len() as u32).filter(|&pixel| figure.cells[pixel as usize]).collect();
    ring.iter().for_each(|&pixel| from[pixel as usize] = pixel);
    for _ in 0..widest {
        let mut next = Vec::new();
        let mut best: Option<(usize, usize, usize)> = None;
        for &pixel in &ring {
            let (row, column) = (pixel as usize / width, pixel as usize % width);
            for row in row.saturating_sub(1)..(row + 2).min(height) {
                for column in column.saturating_sub(1)..(column + 2).min(width) {
                    let neighbor = row * width + column;
                    if from[neighbor] == u32::MAX {
                        from[neighbor] = from[pixel as usize];
                        next.push(neighbor as u32);
                        if part_of[neighbor] > 0 {
                            let begin = from[neighbor] as usize;
                            let far = (neighbor % width).abs_diff(begin % width).pow(2)
                                + (neighbor / width).abs_diff(begin / width).pow(2);
                            if best.is_none_or(|best| far < best.0) {
                                best = Some((far, begin, neighbor));
                            }
                        }
                    }
                }
            }
        }
        if let Some((_, begin, end)) = best {
            let middle = |pixel: usize| [(pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5];
            return Some((part_of[end] as usize - 1, [middle(begin), middle(end)]));
        }
        ring = next;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::{super::components::components, *};

    #[test]
    fn a_hand_beside_an_arm_is_joined_and_a_cloud_is_not() {
        let mut picture = Bits::filled(200, 100, false);
        picture.draw_disc([50.0, 50.0], 30.0);
        picture.draw_disc([87.0, 50.0], 5.0);
        picture.draw_disc([160.0, 20.0], 25.0);
        let found = components(&picture, 1);
        let mut reporter = Reporter::new();
        let figure = found[0].bits(200, 100);
        let joined = join_parts(figure, &found[1..], &mut reporter);
        assert_eq!(components(&joined, 1).len(), 1, "one piece");
        let has_bridge = (40..60).any(|row| joined.has(80, row));
        assert!(joined.has(87, 50) && has_bridge && !joined.has(160, 20), "the hand, its bridge, no cloud");
        let codes: Vec<&str> = reporter.warnings().iter().map(|warning| warning.code).collect();
        assert_eq!(codes, ["parts_joined", "other_figures"]);
    }
}
