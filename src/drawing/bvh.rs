//! A BVH file to the places of its joints.
//!
//! Read as *Animated Drawings* reads it: the first three channels of the root are its place, its offset is not used, channels of
//! position of other joints are not used, and an End Site is a joint.

use glam::{DMat3, DVec3};

use super::DrawingError;

/// Joints of one file.
const MAX_JOINTS: usize = 4096;

/// A joint of a motion file.
#[derive(Clone, Debug)]
struct Joint {
    parent: Option<usize>,
    offset: DVec3,
    /// The channels; those of a position are `None`.
    channels: Vec<Option<DVec3>>,
}

/// A motion file: a hierarchy, and numbers for each frame.
#[derive(Clone, Debug)]
pub struct MotionFile {
    /// The names of the joints, parents first.
    pub joint_names: Vec<String>,
    joints: Vec<Joint>,
    /// Seconds between frames.
    pub frame_time: f64,
    /// How many frames there are.
    pub frames: usize,
    columns: usize,
    values: Vec<f64>,
}

struct Words<'text> {
    words: Vec<(usize, &'text str)>,
    at: usize,
}

impl<'text> Words<'text> {
    fn new(text: &'text str) -> Self {
        let lines = text.lines().enumerate();
        let words = lines.flat_map(|(line, text)| text.split_whitespace().map(move |word| (line + 1, word)));
        Self { words: words.collect(), at: 0 }
    }

    fn error(&self, detail: impl Into<String>) -> DrawingError {
        let line = self.words.get(self.at).or(self.words.last()).map_or(1, |word| word.0);
        DrawingError::new(format!("line {line}"), detail, "give a BVH file")
    }

    fn peek(&self) -> &'text str {
        self.words.get(self.at).map_or("", |word| word.1)
    }

    fn next(&mut self) -> &'text str {
        let word = self.peek();
        self.at += 1;
        word
    }

    fn expect(&mut self, wanted: &str) -> Result<(), DrawingError> {
        if self.peek().eq_ignore_ascii_case(wanted) {
            self.at += 1;
            return Ok(());
        }
        Err(self.error(format!("{:?} stands where {wanted} is due", self.peek())))
    }

    fn number(&mut self) -> Result<f64, DrawingError> {
        match self.peek().parse::<f64>() {
            Ok(number) if number.is_finite() => {
                self.at += 1;
                Ok(number)
            }
            _ => Err(self.error(format!("{:?} is not a number", self.peek()))),
        }
    }

    fn count(&mut self) -> Result<usize, DrawingError> {
        let count = self.peek().parse().map_err(|_| self.error(format!("{:?} is not a count", self.peek())))?;
        self.at += 1;
        Ok(count)
    }
}

impl MotionFile {
    /// Reads a BVH file.
    ///
    /// # Errors
    ///
    /// With the line of what is wrong.
    pub fn read(text: &str) -> Result<Self, DrawingError> {
        let mut words = Words::new(text);
        let mut file =
            Self { joint_names: vec![], joints: vec![], frame_time: 0.0, frames: 0, columns: 0, values: vec![] };
        words.expect("HIERARCHY")?;
        file.read_hierarchy(&mut words)?;
        words.expect("MOTION")?;
        words.expect("Frames:")?;
        file.frames = words.count()?;
        words.expect("Frame")?;
        words.expect("Time:")?;
        file.frame_time = words.number()?;
        file.columns = file.joints.iter().map(|joint| joint.channels.len()).sum();
        let due = file.frames.checked_mul(file.columns);
        if file.frames == 0 || due.is_none_or(|due| due > words.words.len() - words.at.min(words.words.len())) {
            return Err(words.error(format!("there are not {} frames of {} numbers", file.frames, file.columns)));
        }
        file.values = (0..due.unwrap_or_default()).map(|_| words.number()).collect::<Result<_, _>>()?;
        Ok(file)
    }

    fn read_hierarchy(&mut self, words: &mut Words<'_>) -> Result<(), DrawingError> {
        let mut open: Vec<usize> = Vec::new();
        loop {
            let name = match words.next().to_ascii_uppercase().as_str() {
                "ROOT" if self.joints.is_empty() => name_until_brace(words),
                "JOINT" if !open.is_empty() => name_until_brace(words),
                "END" if !open.is_empty() => {
                    words.expect("Site")?;
                    words.expect("{")?;
                    "End Site".to_owned()
                }
                "}" if !open.is_empty() => {
                    open.pop();
                    if open.is_empty() {
                        return Ok(());
                    }
                    continue;
                }
                _ => {
                    words.at -= 1;
                    return Err(words.error(format!("{:?} stands where a joint is due", words.peek())));
                }
            };
            if self.joints.len() == MAX_JOINTS {
                return Err(words.error(format!("more than {MAX_JOINTS} joints")));
            }
            let joint = read_joint(words, open.last().copied())?;
            open.push(self.joints.len());
            self.joints.push(joint);
            self.joint_names.push(name);
        }
    }

    /// The places of all joints at a frame, in the axes and lengths of the file.
    #[must_use]
    pub fn places(&self, frame: usize) -> Vec<DVec3> {
        let mut values = self.values[frame * self.columns..(frame + 1) * self.columns].iter();
        let mut places: Vec<DVec3> = Vec::with_capacity(self.joints.len());
        let mut turns: Vec<DMat3> = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            let mut local = DMat3::IDENTITY;
            let mut moved = DVec3::ZERO;
            for (index, channel) in joint.channels.iter().enumerate() {
                let value = values.next().copied().unwrap_or_default();
                match channel {
                    Some(axis) => local *= DMat3::from_axis_angle(*axis, value.to_radians()),
                    None if index < 3 => moved[index] = value,
                    None => {}
                }
            }
            let (place, turn) = match joint.parent {
                Some(parent) => (places[parent] + turns[parent] * joint.offset, turns[parent] * local),
                None => (moved, local),
            };
            places.push(place);
            turns.push(turn);
        }
        places
    }
}

fn name_until_brace(words: &mut Words<'_>) -> String {
    let mut name = words.next().to_owned();
    while !matches!(words.peek(), "{" | "") {
        name.push(' ');
        name.push_str(words.next());
    }
    words.at += 1;
    name
}

fn read_joint(words: &mut Words<'_>, parent: Option<usize>) -> Result<Joint, DrawingError> {
    words.expect("OFFSET")?;
    let offset = DVec3::new(words.number()?, words.number()?, words.number()?);
    let mut channels = Vec::new();
    if words.peek().eq_ignore_ascii_case("CHANNELS") {
        words.at += 1;
        for _ in 0..words.count()?.min(6) {
            let channel = words.next().to_ascii_lowercase();
            channels.push(match channel.as_str() {
                "xrotation" => Some(DVec3::X),
                "yrotation" => Some(DVec3::Y),
                "zrotation" => Some(DVec3::Z),
                "xposition" | "yposition" | "zposition" => None,
                _ => return Err(words.error(format!("{channel:?} is not a channel"))),
            });
        }
    }
    Ok(Joint { parent, offset, channels })
}
