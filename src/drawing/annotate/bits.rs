//! Pixels that belong to something, and those that do not.

/// One bit for each pixel, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Bits {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) cells: Vec<bool>,
}

impl Bits {
    /// All of one value.
    pub(super) fn filled(width: usize, height: usize, value: bool) -> Self {
        Self { width, height, cells: vec![value; width * height] }
    }

    /// The pixels of which `is_in` holds, by their index.
    pub(super) fn of(width: usize, height: usize, is_in: impl FnMut(usize) -> bool) -> Self {
        Self { width, height, cells: (0..width * height).map(is_in).collect() }
    }

    pub(super) fn count(&self) -> usize {
        self.cells.iter().filter(|&&is_in| is_in).count()
    }

    /// Whether a pixel belongs to it; none does beyond the picture.
    pub(super) fn has(&self, column: i64, row: i64) -> bool {
        let is_inside = column >= 0 && row >= 0 && column < self.width as i64 && row < self.height as i64;
        is_inside && self.cells[row as usize * self.width + column as usize]
    }

    /// Leftmost column, topmost row, and one beyond the rightmost column and the lowest row.
    pub(super) fn bounds(&self) -> Option<[usize; 4]> {
        let mut bounds: Option<[usize; 4]> = None;
        for (row, cells) in self.cells.chunks_exact(self.width).enumerate() {
            let first = cells.iter().position(|&is_in| is_in);
            let last = cells.iter().rposition(|&is_in| is_in);
            if let (Some(first), Some(last)) = (first, last) {
                let [left, top, right, _] = bounds.unwrap_or([first, row, last + 1, row + 1]);
                bounds = Some([left.min(first), top, right.max(last + 1), row + 1]);
            }
        }
        bounds
    }

    /// Grown by a square that reaches `radius` pixels to each side.
    pub(super) fn grown(&self, radius: usize) -> Self {
        self.swept(radius, |count, _| count > 0)
    }

    /// Shrunk by the same square; beyond the picture everything belongs to it, so that what touches its edge stays.
    pub(super) fn shrunk(&self, radius: usize) -> Self {
        self.swept(radius, |count, all| count == all)
    }

    /// Grown and shrunk again, which closes gaps of twice the radius.
    pub(super) fn closed(&self, radius: usize) -> Self {
        self.grown(radius).shrunk(radius)
    }

    /// Along rows and then along columns: what a window of pixels gives for how many of it are in, and how many it has.
    fn swept(&self, radius: usize, is_in: impl Fn(usize, usize) -> bool) -> Self {
        let mut swept = self.clone();
        sweep(&self.cells, &mut swept.cells, [self.height, self.width, self.width, 1], radius, &is_in);
        let rows = swept.cells.clone();
        sweep(&rows, &mut swept.cells, [self.width, self.height, 1, self.width], radius, &is_in);
        swept
    }

    /// The part of it in a box of a corner and a size.
    pub(super) fn cropped(&self, [left, top]: [usize; 2], [width, height]: [usize; 2]) -> Self {
        Self::of(width, height, |index| self.cells[(top + index / width) * self.width + left + index % width])
    }

    /// A pixel for each square of `factor` by `factor` of which one at least belongs to it.
    pub(super) fn reduced(&self, factor: usize) -> Self {
        let mut reduced = Self::filled(self.width.div_ceil(factor), self.height.div_ceil(factor), false);
        for (index, _) in self.cells.iter().enumerate().filter(|(_, is_in)| **is_in) {
            let (row, column) = (index / self.width / factor, index % self.width / factor);
            reduced.cells[row * reduced.width + column] = true;
        }
        reduced
    }

    /// Draws a line of a thickness.
    pub(super) fn draw_line(&mut self, [from, to]: [[f64; 2]; 2], thickness: f64) {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let steps = (length * 2.0).ceil().max(1.0);
        let radius = (thickness / 2.0).max(0.5);
        for step in 0..=steps as usize {
            let share = step as f64 / steps;
            let at = [0, 1].map(|axis: usize| from[axis] + (to[axis] - from[axis]) * share);
            self.draw_disc(at, radius);
        }
    }

    /// Draws a disc.
    pub(super) fn draw_disc(&mut self, [x, y]: [f64; 2], radius: f64) {
        let pixels =
            |at: f64, most: usize| (at.floor() - radius).max(0.0) as usize..((at + radius) as usize + 1).min(most);
        for row in pixels(y, self.height) {
            for column in pixels(x, self.width) {
                let [right, down] = [column as f64 + 0.5 - x, row as f64 + 0.5 - y];
                if right * right + down * down <= radius * radius + 0.25 {
                    self.cells[row * self.width + column] = true;
                }
            }
        }
    }
}

/// Sweeps a window along lines: `lines`, the pixels of each, and the steps in memory from line to line and from pixel to pixel.
fn sweep(
    from: &[bool],
    to: &mut [bool],
    [lines, pixels, line_step, pixel_step]: [usize; 4],
    radius: usize,
    is_in: &impl Fn(usize, usize) -> bool,
) {
    for line in 0..lines {
        let at = |pixel: usize| line * line_step + pixel * pixel_step;
        let mut count = (0..radius.min(pixels)).filter(|&pixel| from[at(pixel)]).count();
        for pixel in 0..pixels {
            if pixel + radius < pixels {
                count += usize::from(from[at(pixel + radius)]);
            }
            if pixel > radius {
                count -= usize::from(from[at(pixel - radius - 1)]);
            }
            let all = (pixel + radius + 1).min(pixels) - pixel.saturating_sub(radius);
            to[at(pixel)] = is_in(count, all);
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A picture of `#` on other characters.
    pub(in super::super) fn bits(rows: &[&str]) -> Bits {
        let text: Vec<u8> = rows.concat().into_bytes();
        Bits::of(rows[0].len(), rows.len(), |index| text[index] == b'#')
    }

    #[test]
    fn closing_fills_gaps_of_twice_the_radius_and_no_wider_ones() {
        let line =
            |middle: &str| bits(&["........", "........", "........", middle, "........", "........", "........"]);
        assert_eq!(line("##..####").grown(1).count(), 24, "three rows");
        assert_eq!(line("##..####").closed(1), line("########"), "two pixels are closed");
        assert_eq!(line("##...###").closed(1), line("##...###"), "three are not");
    }

    #[test]
    fn bounds_and_crops_are_those_of_the_pixels() {
        let dots = bits(&[".....", "..#..", "....#", "....."]);
        assert_eq!(dots.bounds(), Some([2, 1, 5, 3]), "one beyond the last");
        assert_eq!(dots.cropped([2, 1], [3, 2]).count(), 2, "both dots");
        assert_eq!(Bits::filled(3, 3, false).bounds(), None, "nothing");
        assert_eq!(dots.reduced(2), bits(&[".#.", "..#"]), "squares with a dot");
    }
}
