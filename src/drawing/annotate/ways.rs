//! Ways within a figure: how far pixels are from each other where nothing leaves it, and ways that keep to the middle.

use std::{cmp::Ordering, collections::BinaryHeap};

use super::bits::Bits;

/// A pixel that has been reached; the nearest comes first, of equals the one with the lower index.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Reached {
    far: f64,
    pixel: u32,
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        other.far.total_cmp(&self.far).then(other.pixel.cmp(&self.pixel))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Distances from some pixels, and from which neighbor each was reached.
#[derive(Clone, Debug)]
pub(super) struct Ways {
    /// Infinite where no way leads to.
    pub(super) far: Vec<f64>,
    /// The pixel itself where a way begins.
    pub(super) from: Vec<u32>,
}

impl Ways {
    /// No way leads anywhere.
    pub(super) fn new(pixels: usize) -> Self {
        Self { far: vec![f64::INFINITY; pixels], from: vec![u32::MAX; pixels] }
    }

    /// Adds places where ways begin. `cost` is of a step onto a pixel, in lengths of the step.
    pub(super) fn begin(&mut self, bits: &Bits, starts: &[usize], cost: &dyn Fn(usize) -> f64) {
        let mut open = BinaryHeap::new();
        for &start in starts {
            if bits.cells[start] && self.far[start] > 0.0 {
                (self.far[start], self.from[start]) = (0.0, start as u32);
                open.push(Reached { far: 0.0, pixel: start as u32 });
            }
        }
        while let Some(Reached { far, pixel }) = open.pop() {
            let pixel = pixel as usize;
            if far > self.far[pixel] {
                continue;
            }
            let (row, column) = ((pixel / bits.width) as i64, (pixel % bits.width) as i64);
            for (down, right) in NEIGHBORS {
                if !bits.has(column + right, row + down) {
                    continue;
                }
                let neighbor = (row + down) as usize * bits.width + (column + right) as usize;
                let step = if down != 0 && right != 0 { std::f64::consts::SQRT_2 } else { 1.0 };
                let reached = far + step * cost(neighbor);
                if reached < self.far[neighbor] {
                    (self.far[neighbor], self.from[neighbor]) = (reached, pixel as u32);
                    open.push(Reached { far: reached, pixel: neighbor as u32 });
                }
            }
        }
    }

    /// The pixel that is farthest, of those that ways lead to.
    pub(super) fn farthest(&self) -> Option<(usize, f64)> {
        let reached = self.far.iter().copied().enumerate().filter(|(_, far)| far.is_finite());
        reached.max_by(|one, other| one.1.total_cmp(&other.1).then(other.0.cmp(&one.0)))
    }

    /// The pixels from one to where its way begins.
    pub(super) fn back(&self, pixel: usize) -> Vec<usize> {
        let mut way = vec![pixel];
        let mut here = pixel;
        while self.from[here] != u32::MAX && self.from[here] as usize != here && way.len() <= self.from.len() {
            here = self.from[here] as usize;
            way.push(here);
        }
        way
    }
}

const NEIGHBORS: [(i64, i64); 8] = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_go_around_corners() {
        let mut bits = Bits::filled(20, 20, false);
        bits.draw_line([[2.5, 2.5], [2.5, 17.5]], 1.0);
        bits.draw_line([[2.5, 17.5], [17.5, 17.5]], 1.0);
        let start = 2 * 20 + 2;
        let mut ways = Ways::new(400);
        ways.begin(&bits, &[start], &|_| 1.0);
        let (end, far) = ways.farthest().expect("a pixel");
        assert!(end / 20 >= 17 && end % 20 >= 17, "the other end, not the nearest by air");
        assert!((27.0..31.0).contains(&far), "{far}");
        let way = ways.back(end);
        assert_eq!((way[0], way[way.len() - 1]), (end, start), "from end to start");
        ways.begin(&bits, &[end], &|_| 1.0);
        assert!(ways.farthest().is_some_and(|(_, far)| far < 16.0), "what is far from both is in the corner");
    }
}
