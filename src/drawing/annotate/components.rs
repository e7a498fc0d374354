//! Pixels that hang together.

use super::bits::Bits;

/// A component of pixels, corners counted as neighbors.
#[derive(Clone, Debug)]
pub(super) struct Component {
    /// Indices of its pixels, in the order in which they were found.
    pub(super) pixels: Vec<u32>,
    /// Sums of its columns and rows.
    sums: [f64; 2],
    /// Pixels that lie on the edge of the picture.
    pub(super) on_edge: usize,
}

impl Component {
    /// Its middle in pixels.
    pub(super) fn middle(&self) -> [f64; 2] {
        self.sums.map(|sum| sum / self.pixels.len().max(1) as f64)
    }

    /// Its pixels alone.
    pub(super) fn bits(&self, width: usize, height: usize) -> Bits {
        let mut bits = Bits::filled(width, height, false);
        self.pixels.iter().for_each(|&pixel| bits.cells[pixel as usize] = true);
        bits
    }
}

/// The components of at least so many pixels, the largest first.
pub(super) fn components(bits: &Bits, least: usize) -> Vec<Component> {
    let mut seen = vec![false; bits.cells.len()];
    let mut found = Vec::new();
    for start in 0..bits.cells.len() {
        if bits.cells[start] && !seen[start] {
            let component = flood(bits, start, &mut seen);
            if component.pixels.len() >= least {
                found.push(component);
            }
        }
    }
    found.sort_by_key(|component| std::cmp::Reverse(component.pixels.len()));
    found
}

fn flood(bits: &Bits, start: usize, seen: &mut [bool]) -> Component {
    let (width, height) = (bits.width, bits.height);
    let mut component = Component { pixels: vec![start as u32], sums: [0.0; 2], on_edge: 0 };
    seen[start] = true;
    let mut next = 0;
    while next < component.pixels.len() {
        let pixel = component.pixels[next] as usize;
        let (row, column) = (pixel / width, pixel % width);
        next += 1;
        component.sums[0] += column as f64 + 0.5;
        component.sums[1] += row as f64 + 0.5;
        component.on_edge += usize::from(row == 0 || column == 0 || row + 1 == height || column + 1 == width);
        for row in row.saturating_sub(1)..(row + 2).min(height) {
            for column in column.saturating_sub(1)..(column + 2).min(width) {
                let neighbor = row * width + column;
                if bits.cells[neighbor] && !seen[neighbor] {
                    seen[neighbor] = true;
                    component.pixels.push(neighbor as u32);
                }
            }
        }
    }
    component
}

/// Itself with everything that it encloses: what no way over sides leads to from the edge of the picture.
pub(super) fn filled(bits: &Bits) -> Bits {
    let (width, height) = (bits.width, bits.height);
    let mut outside = vec![false; bits.cells.len()];
    let mut open: Vec<u32> = Vec::new();
    let edge = (0..width).flat_map(|column| [column, (height - 1) * width + column]);
    let edge = edge.chain((0..height).flat_map(|row| [row * width, row * width + width - 1]));
    for pixel in edge {
        if !bits.cells[pixel] && !outside[pixel] {
            outside[pixel] = true;
            open.push(pixel as u32);
        }
    }
    while let Some(pixel) = open.pop() {
        let pixel = pixel as usize;
        let (row, column) = (pixel / width, pixel % width);
        let neighbors = [
            (column > 0).then(|| pixel - 1),
            (column + 1 < width).then_some(pixel + 1),
            (row > 0).then(|| pixel - width),
            (row + 1 < height).then_some(pixel + width),
        ];
        for neighbor in neighbors.into_iter().flatten() {
            if !bits.cells[neighbor] && !outside[neighbor] {
                outside[neighbor] = true;
                open.push(neighbor as u32);
            }
        }
    }
    Bits::of(width, height, |pixel| !outside[pixel])
}

/// Without components of fewer pixels than that.
pub(super) fn without_specks(bits: &Bits, least: usize) -> Bits {
    let mut kept = Bits::filled(bits.width, bits.height, false);
    for component in components(bits, least) {
        component.pixels.iter().for_each(|&pixel| kept.cells[pixel as usize] = true);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::super::bits::tests::bits;
    use super::*;

    #[test]
    fn corners_join_and_the_largest_comes_first() {
        let found = components(&bits(&["#....", ".#..#", "....."]), 1);
        let sizes: Vec<usize> = found.iter().map(|component| component.pixels.len()).collect();
        assert_eq!(sizes, [2, 1], "two at a corner, and one");
        assert_eq!((found[0].middle(), found[0].on_edge), ([1.0, 1.0], 1), "between them; one is on the edge");
    }

    #[test]
    fn what_is_enclosed_is_filled_and_what_is_open_is_not() {
        assert_eq!(filled(&bits(&["###", "#.#", "###"])).count(), 9, "closed");
        assert_eq!(filled(&bits(&["###", "#.#", "#.#"])).count(), 7, "open below");
        assert_eq!(filled(&bits(&[".#.", "#.#", ".#."])).count(), 5, "no way leads over corners");
    }
}
