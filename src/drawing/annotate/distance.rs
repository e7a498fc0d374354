//! How far each pixel of a figure is from its edge.

use super::bits::Bits;

/// The distance from each pixel to the nearest one that is not the figure's, in pixels; beyond the picture nothing is.
///
/// By parabolas along columns and then along rows (Felzenszwalb and Huttenlocher, 2012).
pub(super) fn distances(bits: &Bits) -> Vec<f64> {
    let (width, height) = (bits.width, bits.height);
    let far = ((width + height + 2) as f64).powi(2);
    let mut squares: Vec<f64> = bits.cells.iter().map(|&is_in| if is_in { far } else { 0.0 }).collect();
    let mut line = vec![0.0; width.max(height) + 2];
    let mut hull = Hull::new(line.len());
    for column in 0..width {
        line[0] = 0.0;
        (0..height).for_each(|row| line[row + 1] = squares[row * width + column]);
        line[height + 1] = 0.0;
        hull.lower(&line[..height + 2], |row, square| {
            if (1..=height).contains(&row) {
                squares[(row - 1) * width + column] = square;
            }
        });
    }
    for row in 0..height {
        line[0] = 0.0;
        line[1..=width].copy_from_slice(&squares[row * width..][..width]);
        line[width + 1] = 0.0;
        let out = &mut squares[row * width..][..width];
        hull.lower(&line[..width + 2], |column, square| {
            if (1..=width).contains(&column) {
                out[column - 1] = square.sqrt();
            }
        });
    }
    squares
}

/// Parabolas that are lowest somewhere.
struct Hull {
    middles: Vec<usize>,
    begins: Vec<f64>,
}

impl Hull {
    fn new(size: usize) -> Self {
        Self { middles: vec![0; size], begins: vec![0.0; size + 1] }
    }

    /// The lowest of all parabolas that stand on the values of a line, at each of its places.
    fn lower(&mut self, line: &[f64], mut set: impl FnMut(usize, f64)) {
        let mut last = 0;
        self.middles[0] = 0;
        (self.begins[0], self.begins[1]) = (f64::NEG_INFINITY, f64::INFINITY);
        for place in 1..line.len() {
            let begin = loop {
                let other = self.middles[last];
                let [here, there] = [place, other].map(|at| line[at] + (at * at) as f64);
                let begin = (here - there) / (2.0 * (place - other) as f64);
                if begin > self.begins[last] || last == 0 {
                    break begin;
                }
                last -= 1;
            };
            last += 1;
            self.middles[last] = place;
            (self.begins[last], self.begins[last + 1]) = (begin, f64::INFINITY);
        }
        let mut current = 0;
        for place in 0..line.len() {
            while self.begins[current + 1] < place as f64 {
                current += 1;
            }
            let middle = self.middles[current];
            set(place, line[middle] + (place.abs_diff(middle) as f64).powi(2));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_a_search_through_all_pixels() {
        let mut bits = Bits::filled(40, 30, false);
        bits.draw_disc([15.0, 14.0], 11.0);
        bits.draw_line([[20.0, 20.0], [39.5, 29.5]], 4.0);
        let found = distances(&bits);
        for row in 0..30_i64 {
            for column in 0..40_i64 {
                let mut nearest = f64::INFINITY;
                for (other_row, other_column) in (-1..=30).flat_map(|row| (-1..=40).map(move |column| (row, column))) {
                    if !bits.has(other_column, other_row) {
                        nearest = nearest.min(((column - other_column) as f64).hypot((row - other_row) as f64));
                    }
                }
                let found = found[row as usize * 40 + column as usize];
                assert!((found - nearest).abs() < 1e-9, "at {column}, {row}: {found} and {nearest}");
            }
        }
    }
}
