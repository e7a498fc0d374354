//! Paper and a pen: drawings in many styles, made by code.

use retargetd::picture::Picture;

/// A sheet that is drawn on.
#[derive(Clone)]
pub(crate) struct Canvas {
    pub(crate) picture: Picture,
    /// What the pen draws with.
    pub(crate) ink: [u8; 4],
    /// Half of the width of its strokes, in pixels.
    pub(crate) radius: f64,
    random: u32,
}

pub(crate) const PAPER: [u8; 4] = [243, 240, 232, 255];
const INK: [u8; 4] = [40, 38, 52, 255];

impl Canvas {
    pub(crate) fn new(width: usize, height: usize, radius: f64) -> Self {
        Self { picture: Picture::filled(width, height, PAPER), ink: INK, radius, random: 12_345 }
    }

    /// A number from -1 to 1.
    fn random(&mut self) -> f64 {
        self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.random >> 8) / f64::from(1_u32 << 23) - 1.0
    }

    fn dot(&mut self, [x, y]: [f64; 2]) {
        let radius = self.radius;
        let pixels =
            |at: f64, most: usize| (at - radius).max(0.0) as usize..((at + radius + 1.0).max(0.0) as usize).min(most);
        for row in pixels(y, self.picture.height) {
            for column in pixels(x, self.picture.width) {
                if (column as f64 + 0.5 - x).hypot(row as f64 + 0.5 - y) <= radius {
                    self.picture.pixels[row * self.picture.width + column] = self.ink;
                }
            }
        }
    }

    /// A stroke from place to place.
    pub(crate) fn stroke(&mut self, places: &[[f64; 2]]) {
        for pair in places.windows(2) {
            let steps = ((pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]) * 1.5 / (self.radius / 6.0).max(1.0))
                .ceil()
                .max(1.0) as usize;
            for step in 0..=steps {
                let share = step as f64 / steps as f64;
                self.dot([0, 1].map(|axis: usize| pair[0][axis] + (pair[1][axis] - pair[0][axis]) * share));
            }
        }
    }

    /// A part of an ellipse, of which 0 to 1 is a whole turn clockwise from the right.
    pub(crate) fn arc(&mut self, [x, y]: [f64; 2], [wide, high]: [f64; 2], [from, to]: [f64; 2]) {
        let places: Vec<[f64; 2]> = (0..=60)
            .map(|step| (from + (to - from) * f64::from(step) / 60.0) * std::f64::consts::TAU)
            .map(|angle| [x + wide * angle.cos(), y + high * angle.sin()])
            .collect();
        self.stroke(&places);
    }

    pub(crate) fn ellipse(&mut self, middle: [f64; 2], radii: [f64; 2]) {
        self.arc(middle, radii, [0.0, 1.0]);
    }

    pub(crate) fn closed(&mut self, places: &[[f64; 2]]) {
        self.stroke(places);
        self.stroke(&[places[places.len() - 1], places[0]]);
    }

    /// A filled disc-swept line: a limb of that half width.
    pub(crate) fn limb(&mut self, places: &[[f64; 2]], half_width: f64, color: [u8; 4]) {
        let before = (self.radius, self.ink);
        (self.radius, self.ink) = (half_width, color);
        self.stroke(places);
        (self.radius, self.ink) = before;
    }

    pub(crate) fn blob(&mut self, [x, y]: [f64; 2], [wide, high]: [f64; 2], color: [u8; 4]) {
        for row in 0..self.picture.height {
            for column in 0..self.picture.width {
                let [right, down] = [(column as f64 + 0.5 - x) / wide, (row as f64 + 0.5 - y) / high];
                if right * right + down * down <= 1.0 {
                    self.picture.pixels[row * self.picture.width + column] = color;
                }
            }
        }
    }

    /// The outline of everything that has that color, in ink; what it encloses becomes paper.
    pub(crate) fn outline(&mut self, color: [u8; 4]) {
        let (width, height) = (self.picture.width, self.picture.height);
        let is_in: Vec<bool> = self.picture.pixels.iter().map(|&pixel| pixel == color).collect();
        self.picture.pixels.iter_mut().zip(&is_in).filter(|(_, is_in)| **is_in).for_each(|(pixel, _)| *pixel = PAPER);
        for row in 1..height - 1 {
            for column in 1..width - 1 {
                let at = row * width + column;
                if is_in[at] && [at - 1, at + 1, at - width, at + width].iter().any(|&beside| !is_in[beside]) {
                    self.dot([column as f64 + 0.5, row as f64 + 0.5]);
                }
            }
        }
    }

    /// Rubs out a disc.
    pub(crate) fn rub(&mut self, middle: [f64; 2], radius: f64) {
        self.limb(&[middle, middle], radius, PAPER);
    }

    /// Lines of the paper, under what is drawn.
    pub(crate) fn rule(&mut self, apart: f64, slope: f64) {
        let (width, height) = (self.picture.width, self.picture.height);
        for row in 0..height {
            for column in 0..width {
                let line = (row as f64 + slope * column as f64).rem_euclid(apart);
                let pixel = &mut self.picture.pixels[row * width + column];
                if line < 2.0 && *pixel == PAPER {
                    *pixel = [150, 170, 215, 255];
                }
            }
        }
    }

    /// Grain of that many grays, and light that falls from one side.
    pub(crate) fn weather(&mut self, grays: f64, shade: f64) {
        let (width, height) = (self.picture.width, self.picture.height);
        for row in 0..height {
            for column in 0..width {
                // The sum of three is nearly normal.
                let grain = (self.random() + self.random() + self.random()) * grays;
                let light = 1.0 - shade * (column as f64 / width as f64 + row as f64 / height as f64) / 2.0;
                let pixel = &mut self.picture.pixels[row * width + column];
                (0..3).for_each(|part| pixel[part] = (f64::from(pixel[part]) * light + grain).clamp(0.0, 255.0) as u8);
            }
        }
    }

    /// Paper becomes transparent.
    pub(crate) fn cut_out(&mut self) {
        self.picture.pixels.iter_mut().filter(|pixel| **pixel == PAPER).for_each(|pixel| *pixel = [0; 4]);
    }

    /// The negative.
    pub(crate) fn invert(&mut self) {
        self.picture.pixels.iter_mut().for_each(|pixel| (0..3).for_each(|part| pixel[part] = 255 - pixel[part]));
    }
}
