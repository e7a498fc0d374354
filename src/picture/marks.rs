//! What a report found, drawn into a picture: rings around the joints that are blamed, feet in the color of their contact, and a strip with
//! values over time.

use glam::Vec2;

use super::{Picture, text};

/// A ring is shown for so long before and after its frame.
const RING_SECONDS: f64 = 0.25;
/// Texts of rings on one picture.
const MAX_TEXTS: usize = 4;

/// How good something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Grade {
    /// As it should be.
    Good,
    /// Worth a look.
    Doubtful,
    /// Visibly wrong.
    Bad,
}

impl Grade {
    const fn color(self) -> [u8; 3] {
        match self {
            Self::Good => [34, 160, 76],
            Self::Doubtful => [226, 138, 8],
            Self::Bad => [214, 40, 40],
        }
    }
}

/// A joint that is blamed at a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Ring {
    /// Index in the skeleton.
    pub joint: usize,
    /// When.
    pub seconds: f64,
    /// How bad it is.
    pub grade: Grade,
    /// What for, in a few words.
    pub text: String,
}

/// A joint that touches the floor for a while.
#[derive(Clone, Debug, PartialEq)]
pub struct Touch {
    /// Index in the skeleton.
    pub joint: usize,
    /// From when to when.
    pub seconds: [f64; 2],
    /// How well it stands.
    pub grade: Grade,
}

/// A value over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strip {
    /// What it is.
    pub text: String,
    /// Rising.
    pub times_seconds: Vec<f64>,
    /// One for each time; more is worse.
    pub values: Vec<f64>,
}

/// Everything that is marked, the worst first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    /// Joints that are blamed.
    pub rings: Vec<Ring>,
    /// Joints that touch the floor.
    pub touches: Vec<Touch>,
    /// What is shown along the lower edge.
    pub strip: Option<Strip>,
}

impl Marks {
    /// The times of the worst frames, rising, each once.
    pub(super) fn worst_times(&self, most: usize) -> Vec<f64> {
        let mut times: Vec<f64> = Vec::new();
        for ring in &self.rings {
            if times.len() < most && times.iter().all(|time| (time - ring.seconds).abs() > 1e-6) {
                times.push(ring.seconds);
            }
        }
        times.sort_by(f64::total_cmp);
        times
    }

    /// Draws what is to be seen at a time of a clip that goes from one time to another. `place` says where a joint is, in pixels.
    pub(super) fn draw(
        &self,
        picture: &mut Picture,
        seconds: f64,
        [first, last]: [f64; 2],
        place: impl Fn(usize) -> Option<Vec2>,
    ) {
        let shorter = picture.width.min(picture.height) as f32;
        let size = (picture.height / 256).max(1);
        for touch in &self.touches {
            if (touch.seconds[0]..=touch.seconds[1]).contains(&seconds)
                && let Some(at) = place(touch.joint)
            {
                circle(picture, at, shorter * 0.012 + 1.0, None, touch.grade.color());
            }
        }
        let shown = self.rings.iter().filter(|ring| (ring.seconds - seconds).abs() <= RING_SECONDS);
        let mut top = 16 * size;
        for ring in shown.take(MAX_TEXTS) {
            if let Some(at) = place(ring.joint) {
                circle(picture, at, shorter * 0.045 + 2.0, Some(shorter * 0.006 + 1.0), ring.grade.color());
            }
            for line in text::lines(&ring.text, picture.width.saturating_sub(12 * size), size) {
                text::write(picture, &line, [6 * size, top], size, ring.grade.color());
                top += 10 * size;
            }
        }
        if let Some(strip) = &self.strip {
            self.draw_strip(picture, strip, seconds, [first, last]);
        }
    }

    fn draw_strip(&self, picture: &mut Picture, strip: &Strip, seconds: f64, [first, last]: [f64; 2]) {
        let (width, height) = (picture.width as i64, picture.height as i64);
        let high = (height / 14).clamp(10, 60);
        let top = height - high;
        for row in top..height {
            for column in 0..width {
                picture.dot(column, row, [20, 23, 28], 0.78);
            }
        }
        let span = (last - first).max(1e-9);
        let column_of = |time: f64| (((time - first) / span).clamp(0.0, 1.0) * (width - 1) as f64).round() as i64;
        let most = strip.values.iter().copied().filter(|value| value.is_finite()).fold(0.0, f64::max);
        if most > 0.0 {
            for (index, value) in strip.values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
                let until = strip.times_seconds.get(index + 1).copied().unwrap_or(last);
                let tall = (value.max(0.0) / most * (high - 3) as f64).round() as i64;
                for column in column_of(strip.times_seconds[index])..=column_of(until) {
                    (height - 1 - tall..height).for_each(|row| picture.dot(column, row, [120, 150, 190], 0.8));
                }
            }
        }
        for ring in self.rings.iter().rev() {
            let column = column_of(ring.seconds);
            for row in top..height {
                [0, 1].into_iter().for_each(|by| picture.dot(column + by, row, ring.grade.color(), 1.0));
            }
        }
        (top..height).for_each(|row| picture.dot(column_of(seconds), row, [255; 3], 1.0));
        let size = (picture.height / 512).max(1);
        text::write(picture, &strip.text, [3 * size, top as usize + 2], size, [235; 3]);
    }
}

/// A disc, or a ring that is so wide.
fn circle(picture: &mut Picture, at: Vec2, radius: f32, width: Option<f32>, color: [u8; 3]) {
    let reach = radius + 2.0;
    let (low, high) = ((at - reach).floor(), (at + reach).ceil());
    if !low.is_finite() || !high.is_finite() || low.abs().max_element() > 1e6 {
        return;
    }
    for row in low.y as i64..=high.y as i64 {
        for column in low.x as i64..=high.x as i64 {
            let off = Vec2::new(column as f32 + 0.5, row as f32 + 0.5).distance(at);
            let inside = match width {
                Some(width) => width * 0.5 - (off - radius).abs(),
                None => radius - off,
            };
            let share = (inside + 0.5).clamp(0.0, 1.0);
            if share > 0.0 {
                picture.dot(column, row, color, share);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marked(marks: &Marks, seconds: f64) -> Picture {
        let mut picture = Picture::filled(200, 200, [0, 0, 0, 255]);
        marks.draw(&mut picture, seconds, [0.0, 2.0], |joint| Some(Vec2::new(50.0 + joint as f32, 120.0)));
        picture
    }

    #[test]
    fn a_ring_lies_around_its_joint_at_its_time() {
        let ring = Ring { joint: 30, seconds: 1.0, grade: Grade::Bad, text: String::new() };
        let marks = Marks { rings: vec![ring], ..Marks::default() };
        let picture = marked(&marks, 1.1);
        let red: Vec<Vec2> = (0..200 * 200)
            .filter(|index| picture.pixels[*index][0] > 128)
            .map(|index| Vec2::new((index % 200) as f32, (index / 200) as f32) + 0.5)
            .collect();
        assert!(red.len() > 20, "it is there");
        let middle = red.iter().copied().sum::<Vec2>() / red.len() as f32;
        assert!(middle.distance(Vec2::new(80.0, 120.0)) < 1.0, "around the joint: {middle}");
        assert_eq!(marked(&marks, 1.5).pixels, Picture::filled(200, 200, [0, 0, 0, 255]).pixels, "and not for ever");
    }

    #[test]
    fn the_worst_frames_are_told_once_and_in_their_order() {
        let ring = |seconds: f64| Ring { joint: 0, seconds, grade: Grade::Doubtful, text: String::new() };
        let marks = Marks { rings: [1.5, 0.5, 1.5, 0.2].map(ring).to_vec(), ..Marks::default() };
        assert_eq!(marks.worst_times(2), [0.5, 1.5], "the first ones are the worst");
    }

    #[test]
    fn a_foot_that_touches_has_the_color_of_its_contact() {
        let touch = Touch { joint: 0, seconds: [0.5, 1.0], grade: Grade::Good };
        let marks = Marks { touches: vec![touch], ..Marks::default() };
        assert_eq!(marked(&marks, 0.7).pixels[120 * 200 + 50][..3], Grade::Good.color(), "while it does");
        assert_eq!(marked(&marks, 1.2).pixels[120 * 200 + 50][..3], [0; 3], "and not after");
    }
}
