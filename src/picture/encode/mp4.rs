//! MP4: H.264 as OpenH264 encodes it.
//!
//! H.264 halves the resolution of colors, so both sides are even: an odd one is longer by a pixel, which repeats its neighbor. Colors are
//! those of BT.601 in the range of video (ITU-R BT.601-7, 2.5.3), which is said in the stream.

use muxide::api::{Muxer, MuxerBuilder, VideoCodec};
use openh264::{
    OpenH264API, Timestamp,
    encoder::{
        Complexity, Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, RateControlMode, UsageType,
        VuiConfig,
    },
    formats::YUVSource,
};
use rayon::prelude::*;

use super::super::{Picture, error::PictureError};
use super::{Area, refused};

/// The brightness of white.
const WHITE: u8 = 235;
/// The difference of what has no color.
const COLORLESS: u8 = 128;
/// Seconds from one frame that can be jumped to, to the next.
const SECONDS_BETWEEN_KEYS: f64 = 2.0;

/// Frames of one video.
pub(in crate::picture) struct Writer {
    encoder: Encoder,
    muxer: Muxer<Vec<u8>>,
    fps: f64,
    frame: usize,
}

/// Brightness of all pixels, then both colors of each four.
#[derive(Clone)]
pub(in crate::picture) struct Planes {
    size: [usize; 2],
    brightness: Vec<u8>,
    blue: Vec<u8>,
    red: Vec<u8>,
}

impl Writer {
    pub(super) fn new(size: [usize; 2], fps: f64) -> Result<Self, PictureError> {
        let [width, height] = size.map(even);
        let config = EncoderConfig::new()
            .usage_type(UsageType::CameraVideoRealTime)
            // Each frame is as good as the others: what is drawn takes few bits.
            .rate_control_mode(RateControlMode::Off)
            .max_frame_rate(FrameRate::from_hz(fps as f32))
            .skip_frames(false)
            .scene_change_detect(false)
            .complexity(Complexity::Low)
            // What does not change is found by itself; a search for it beforehand takes a fifth of the time and makes files no better.
            .background_detection(false)
            .intra_frame_period(IntraFramePeriod::from_num_frames((fps * SECONDS_BETWEEN_KEYS).ceil() as u32))
            // The bytes are the same on any machine.
            .num_threads(1)
            .vui(VuiConfig::bt601());
        let encoder = Encoder::with_api_config(OpenH264API::from_source(), config).map_err(refused)?;
        let muxer = MuxerBuilder::new(Vec::new())
            .video(VideoCodec::H264, width as u32, height as u32, fps)
            .with_fast_start(true)
            .build()
            .map_err(refused)?;
        Ok(Self { encoder, muxer, fps, frame: 0 })
    }

    /// Adds frames: each is told by what differs from the one before, so they are encoded one after the other.
    pub(super) fn add(&mut self, pictures: &[Picture]) -> Result<(), PictureError> {
        self.add_planes(&pictures.par_iter().map(Planes::of).collect::<Vec<_>>())
    }

    /// Adds frames in colors of video.
    pub(super) fn add_planes(&mut self, frames: &[Planes]) -> Result<(), PictureError> {
        for planes in frames {
            let seconds = self.frame as f64 / self.fps;
            let at = Timestamp::from_millis((seconds * 1000.0).round() as u64);
            let stream = self.encoder.encode_at(planes, at).map_err(refused)?;
            let is_key = matches!(stream.frame_type(), FrameType::IDR | FrameType::I);
            self.muxer.write_video(seconds, &stream.to_vec(), is_key).map_err(refused)?;
            self.frame += 1;
        }
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<Vec<u8>, PictureError> {
        self.muxer.finish_in_place().map_err(refused)?;
        Ok(self.muxer.into_writer())
    }
}

const fn even(side: usize) -> usize {
    side + side % 2
}

impl Planes {
    pub(super) fn of(picture: &Picture) -> Self {
        let size = [even(picture.width), even(picture.height)];
        // Where nothing is drawn, it is white.
        let mut planes = Self {
            size,
            brightness: vec![WHITE; size[0] * size[1]],
            blue: vec![COLORLESS; size[0] * size[1] / 4],
            red: vec![COLORLESS; size[0] * size[1] / 4],
        };
        planes.take(picture, [0, 0, picture.width, picture.height]);
        planes
    }

    /// These, with an area of a picture.
    pub(super) fn with(&self, picture: &Picture, area: Area) -> Self {
        let mut planes = self.clone();
        planes.take(picture, area);
        planes
    }

    /// Takes the colors of an area.
    fn take(&mut self, picture: &Picture, [left, top, right, bottom]: Area) {
        let size = self.size;
        let row_of = |row: usize| &picture.pixels[row.min(picture.height - 1) * picture.width..][..picture.width];
        for row in (top - top % 2..bottom).step_by(2) {
            let [upper, lower] = [row_of(row), row_of(row + 1)];
            for column in (left - left % 2..right).step_by(2) {
                let next = (column + 1).min(picture.width - 1);
                let four = [upper[column], upper[next], lower[column], lower[next]];
                if four.iter().all(|pixel| pixel[3] == 0) {
                    continue;
                }
                let colors = four.map(over_white);
                let at = row * size[0] + column;
                for (place, color) in [at, at + 1, at + size[0], at + size[0] + 1].into_iter().zip(colors) {
                    self.brightness[place] = brightness(color);
                }
                let sum = [0, 1, 2].map(|part: usize| colors.iter().map(|color| color[part]).sum());
                let place = row / 2 * (size[0] / 2) + column / 2;
                [self.blue[place], self.red[place]] = differences(sum);
            }
        }
    }
}

/// A color over white.
fn over_white([red, green, blue, opacity]: [u8; 4]) -> [i32; 3] {
    let (color, opacity) = ([red, green, blue].map(i32::from), i32::from(opacity));
    if opacity == 255 {
        return color;
    }
    color.map(|part| (part * opacity + 255 * (255 - opacity) + 127) / 255)
}

/// Y' of a color, 16 to 235, in whole 65,536ths.
fn brightness([red, green, blue]: [i32; 3]) -> u8 {
    ((16_829 * red + 33_039 * green + 6_416 * blue + (16 << 16) + (1 << 15)) >> 16) as u8
}

/// Cb and Cr of the mean of four colors, 16 to 240; their sum is given.
fn differences([red, green, blue]: [i32; 3]) -> [u8; 2] {
    let of = |weights: [i32; 3]| {
        let sum = weights[0] * red + weights[1] * green + weights[2] * blue;
        ((sum + (128 << 18) + (1 << 17)) >> 18) as u8
    };
    [of([-9_714, -19_070, 28_784]), of([28_784, -24_103, -4_681])]
}

impl YUVSource for Planes {
    fn dimensions(&self) -> (usize, usize) {
        (self.size[0], self.size[1])
    }

    fn strides(&self) -> (usize, usize, usize) {
        (self.size[0], self.size[0] / 2, self.size[0] / 2)
    }

    fn y(&self) -> &[u8] {
        &self.brightness
    }

    fn u(&self) -> &[u8] {
        &self.blue
    }

    fn v(&self) -> &[u8] {
        &self.red
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gray_has_no_color_and_ends_of_the_range_are_those_of_video() {
        for (gray, bright) in [(0, 16), (255, 235)] {
            assert_eq!(brightness([gray; 3]), bright);
            assert_eq!(differences([4 * gray; 3]), [128, 128]);
        }
        assert_eq!(
            [brightness([255, 0, 0]), differences([1020, 0, 0])[0], differences([1020, 0, 0])[1]],
            [81, 90, 240]
        );
    }

    #[test]
    fn odd_sides_repeat_their_last_pixels() {
        let mut picture = Picture::filled(3, 1, [0, 0, 0, 255]);
        picture.pixels[2] = [255, 255, 255, 255];
        let planes = Planes::of(&picture);
        assert_eq!(planes.size, [4, 2]);
        assert_eq!(planes.brightness, [16, 16, 235, 235, 16, 16, 235, 235]);
    }

    #[test]
    fn what_is_transparent_is_white() {
        assert!(Planes::of(&Picture::filled(2, 2, [0; 4])).brightness.iter().all(|bright| *bright == 235));
    }
}
