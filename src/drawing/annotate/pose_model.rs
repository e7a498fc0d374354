//! Joints that a pose model finds: what the model looks like, what it is shown, and what its answer says.
//!
//! It is a top-down model as they are trained on the 17 points of COCO: one figure fills its picture, and for each point the answer says how likely
//! it is where, as a map (`1 x 17 x height x width`) or along both axes (SimCC: `1 x 17 x columns` and `1 x 17 x rows`).

use glam::DVec2;

use crate::{model::Control, picture::Picture};

use super::{
    joints::Joint,
    pose_answer::{Answer, PoseModelError, unusable},
};

/// Bytes of a model's file.
pub const MAX_MODEL_BYTES: usize = 512 << 20;
/// The longest side of the picture that a model is shown.
const MAX_SIDE: usize = 1024;
/// Width and height where the model leaves them open.
const USUAL_SIZE: [usize; 2] = [192, 256];
/// Seconds that a model may take for a picture.
const MAX_SECONDS: f64 = 20.0;
/// Scores from here on count.
const SURE_FROM: f64 = 0.3;
/// The figure is shown with so much room around it, as such models are trained.
const ROOM: f64 = 1.25;
/// Mean and deviation of red, green and blue in the pictures that such models are trained on.
const MEAN: [f64; 3] = [123.675, 116.28, 103.53];
const DEVIATION: [f64; 3] = [58.395, 57.12, 57.375];
/// Points of COCO.
const POINTS: usize = 17;

/// A model that finds the joints of a figure.
#[derive(Debug)]
pub struct PoseModel {
    network: Network,
    /// Width and height of the picture that it is shown.
    size: [usize; 2],
}

#[cfg(feature = "pose-model")]
use super::pose_network::Network;

/// What runs models where none is built in.
#[cfg(not(feature = "pose-model"))]
#[derive(Debug)]
struct Network;

#[cfg(not(feature = "pose-model"))]
impl Network {
    fn read(_: Vec<u8>) -> Result<(Self, [Option<usize>; 4]), PoseModelError> {
        Err(PoseModelError::NotBuilt)
    }

    fn ask(&self, _: [usize; 4], _: Vec<f32>) -> Result<Vec<Answer>, PoseModelError> {
        Err(PoseModelError::NotBuilt)
    }
}

impl PoseModel {
    /// Reads an ONNX file.
    ///
    /// # Errors
    ///
    /// Where it is none, too large, or its input is not that of a pose model.
    pub fn read(bytes: Vec<u8>) -> Result<Self, PoseModelError> {
        if bytes.len() > MAX_MODEL_BYTES {
            let detail = format!("the file has {} bytes; {MAX_MODEL_BYTES} are the most", bytes.len());
            return Err(unusable(detail, "give a smaller model"));
        }
        let (network, [pictures, channels, height, width]) = Network::read(bytes)?;
        let size = [width.unwrap_or(USUAL_SIZE[0]), height.unwrap_or(USUAL_SIZE[1])];
        if pictures.unwrap_or(1) != 1 || channels.unwrap_or(3) != 3 {
            return Err(unusable(
                "its input is not one picture of three colors",
                "export it with an input of 1 x 3 x height x width",
            ));
        }
        if size.iter().any(|side| !(16..=MAX_SIDE).contains(side)) {
            let detail = format!("it wants pictures of {} by {} pixels", size[0], size[1]);
            return Err(unusable(detail, "export it with sides of 16 to 1024 pixels"));
        }
        Ok(Self { network, size })
    }

    /// Asks it about an empty picture, so that what is wrong with it is said at once.
    ///
    /// # Errors
    ///
    /// Where it is too slow, or its answers are not those of a pose model.
    pub fn try_out(&self, control: &Control) -> Result<(), PoseModelError> {
        self.points(&Picture::filled(64, 64, [255; 4]), control).map(|_| ())
    }

    /// The joints of a human figure that fills a picture, as far as the model is sure of them, in pixels of the picture.
    pub(super) fn joints(&self, picture: &Picture, control: &Control) -> Result<Vec<Joint>, PoseModelError> {
        Ok(joints(&self.points(picture, control)?))
    }

    /// The points of COCO, each with its score.
    fn points(&self, picture: &Picture, control: &Control) -> Result<Vec<(DVec2, f64)>, PoseModelError> {
        control.check()?;
        let sight = Sight::new([picture.width, picture.height], self.size);
        let [width, height] = self.size;
        let begin = control.seconds();
        let answers = self.network.ask([1, 3, height, width], sight.colors(picture))?;
        control.check()?;
        let seconds = control.seconds() - begin;
        if seconds > MAX_SECONDS {
            let detail = format!("it takes {seconds:.0} seconds for a picture; {MAX_SECONDS} are the most");
            return Err(unusable(detail, "give a smaller model"));
        }
        let points = decoded(&answers)?;
        let size = DVec2::new(width as f64, height as f64);
        Ok(points.into_iter().map(|(share, score)| (sight.in_picture(share * size), score)).collect())
    }
}

/// How a picture lies in what the model is shown: in its middle, with room around it.
struct Sight {
    picture: DVec2,
    size: [usize; 2],
    /// Pixels of the model's picture for each of the picture.
    scale: f64,
}

impl Sight {
    fn new([width, height]: [usize; 2], size: [usize; 2]) -> Self {
        let picture = DVec2::new(width as f64, height as f64);
        let scale = (size[0] as f64 / picture.x).min(size[1] as f64 / picture.y) / ROOM;
        Self { picture, size, scale }
    }

    fn in_picture(&self, at: DVec2) -> DVec2 {
        (at - DVec2::new(self.size[0] as f64, self.size[1] as f64) / 2.0) / self.scale + self.picture / 2.0
    }

    /// All red, then all green, then all blue, as such models are trained: over white, black beyond the picture.
    fn colors(&self, picture: &Picture) -> Vec<f32> {
        let [width, height] = self.size;
        // Strokes are thin: each pixel is the mean of all that it covers.
        let steps = (1.0 / self.scale).ceil().clamp(1.0, 16.0) as usize;
        let mut planes = vec![0.0; 3 * width * height];
        for row in 0..height {
            for column in 0..width {
                let mut sums = [0.0; 3];
                for step in 0..steps * steps {
                    let within = DVec2::new((step % steps) as f64 + 0.5, (step / steps) as f64 + 0.5) / steps as f64;
                    let at = self.in_picture(DVec2::new(column as f64, row as f64) + within);
                    if at.cmplt(DVec2::ZERO).any() || at.cmpge(self.picture).any() {
                        continue;
                    }
                    let [color @ .., opacity] = picture.pixels[at.y as usize * picture.width + at.x as usize];
                    let opacity = f64::from(opacity) / 255.0;
                    (0..3).for_each(|part| sums[part] += f64::from(color[part]) * opacity + 255.0 * (1.0 - opacity));
                }
                for part in 0..3 {
                    let color = sums[part] / (steps * steps) as f64;
                    planes[(part * height + row) * width + column] = ((color - MEAN[part]) / DEVIATION[part]) as f32;
                }
            }
        }
        planes
    }
}

/// For each point of COCO its place, as shares of width and height, and its score.
fn decoded(answers: &[Answer]) -> Result<Vec<(DVec2, f64)>, PoseModelError> {
    if answers.iter().any(|(_, numbers)| numbers.iter().any(|number| !number.is_finite())) {
        return Err(unusable("it answers with numbers that are none", "export it again; its weights may be broken"));
    }
    for (shape, numbers) in answers {
        if let [1, POINTS, height, width] = shape[..]
            && height >= 2
            && width >= 2
        {
            return Ok(numbers.chunks_exact(height * width).map(|map| of_map(map, width)).collect());
        }
    }
    if let [(across, columns), (down, rows), ..] = answers
        && let ([1, POINTS, width], [1, POINTS, height]) = (&across[..], &down[..])
        && *width >= 2
        && *height >= 2
    {
        let pairs = columns.chunks_exact(*width).zip(rows.chunks_exact(*height));
        let point = |(columns, rows): (&[f32], &[f32])| {
            let ((x, one), (y, other)) = (highest(columns), highest(rows));
            let share = DVec2::new((x as f64 + 0.5) / *width as f64, (y as f64 + 0.5) / *height as f64);
            (share, one.min(other).clamp(0.0, 1.0))
        };
        return Ok(pairs.map(point).collect());
    }
    let shapes: Vec<String> = answers.iter().map(|(shape, _)| format!("{shape:?}")).collect();
    let detail = format!("its answers have the shapes {}", shapes.join(", "));
    Err(unusable(detail, "give a model with maps of 1 x 17 x height x width, or SimCC of 1 x 17 x columns and rows"))
}

/// The place and the value of the highest number.
fn highest(numbers: &[f32]) -> (usize, f64) {
    let best = numbers.iter().enumerate().fold(
        (0, f32::MIN),
        |best, (at, number)| {
            if *number > best.1 { (at, *number) } else { best }
        },
    );
    (best.0, f64::from(best.1))
}

/// The highest place of a map, a quarter of a pixel towards its higher neighbors, as shares of its sides.
fn of_map(map: &[f32], width: usize) -> (DVec2, f64) {
    let height = map.len() / width;
    let (at, score) = highest(map);
    let (column, row) = (at % width, at / width);
    let lean = |before: Option<usize>, after: Option<usize>| match (before, after) {
        (Some(before), Some(after)) if map[after] > map[before] => 0.25,
        (Some(before), Some(after)) if map[after] < map[before] => -0.25,
        _ => 0.0,
    };
    let across = lean((column > 0).then(|| at - 1), (column + 1 < width).then_some(at + 1));
    let down = lean((row > 0).then(|| at - width), (row + 1 < height).then_some(at + width));
    let place = DVec2::new(column as f64 + 0.5 + across, row as f64 + 0.5 + down);
    (place / DVec2::new(width as f64, height as f64), score.clamp(0.0, 1.0))
}

/// The joints of a drawing that points of COCO are; those of the trunk lie between two.
fn joints(points: &[(DVec2, f64)]) -> Vec<Joint> {
    const OF_POINTS: [(&str, &str, [usize; 2]); 16] = [
        ("root", "", [11, 12]),
        ("hip", "root", [11, 12]),
        ("torso", "hip", [5, 6]),
        ("neck", "torso", [0, 0]),
        ("right_shoulder", "torso", [6, 6]),
        ("right_elbow", "right_shoulder", [8, 8]),
        ("right_hand", "right_elbow", [10, 10]),
        ("left_shoulder", "torso", [5, 5]),
        ("left_elbow", "left_shoulder", [7, 7]),
        ("left_hand", "left_elbow", [9, 9]),
        ("right_hip", "root", [12, 12]),
        ("right_knee", "right_hip", [14, 14]),
        ("right_foot", "right_knee", [16, 16]),
        ("left_hip", "root", [11, 11]),
        ("left_knee", "left_hip", [13, 13]),
        ("left_foot", "left_knee", [15, 15]),
    ];
    let joint = |(name, parent, [one, other]): (&str, &str, [usize; 2])| {
        let (one, other) = (points[one], points[other]);
        let score = one.1.min(other.1);
        (score >= SURE_FROM).then(|| Joint::new(name, parent, one.0.midpoint(other.0), score))
    };
    OF_POINTS.into_iter().filter_map(joint).collect()
}

/// Joints of a figure: all of it.
pub(super) const ALL_JOINTS: usize = 16;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_place_of_a_map_leans_to_its_higher_neighbor() {
        let mut map = vec![0.0; 20];
        (map[7], map[8], map[12]) = (0.9, 0.5, 0.2);
        let (share, score) = of_map(&map, 5);
        assert!((score - 0.9).abs() < 1e-6);
        assert!(share.abs_diff_eq(DVec2::new(2.75 / 5.0, 1.75 / 4.0), 1e-12), "{share}");
    }

    #[test]
    fn a_picture_lies_in_the_middle_of_what_the_model_is_shown() {
        let sight = Sight::new([100, 50], [192, 256]);
        assert!(sight.in_picture(DVec2::new(96.0, 128.0)).abs_diff_eq(DVec2::new(50.0, 25.0), 1e-9));
        let colors = sight.colors(&Picture::filled(100, 50, [0, 0, 0, 0]));
        let at = |row: usize, column: usize| f64::from(colors[row * 192 + column]);
        assert!((at(128, 96) - (255.0 - MEAN[0]) / DEVIATION[0]).abs() < 1e-5, "over white");
        assert!((at(2, 2) + MEAN[0] / DEVIATION[0]).abs() < 1e-5, "black beyond");
    }

    #[test]
    fn answers_of_other_shapes_are_refused() {
        let maps = vec![0.5; POINTS * 4];
        assert!(decoded(&[(vec![1, POINTS, 2, 2], maps.clone())]).is_ok());
        assert!(decoded(&[(vec![1, POINTS, 4], maps.clone()), (vec![1, POINTS, 4], maps.clone())]).is_ok());
        for (shape, numbers) in [(vec![1, 68], maps), (vec![1, POINTS, 2, 2], vec![f32::NAN; POINTS * 4])] {
            assert!(matches!(decoded(&[(shape, numbers)]), Err(PoseModelError::Unusable(_))));
        }
    }
}
