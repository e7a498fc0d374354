//! Pictures to files.

mod apng;
mod gif;
mod lzw;
#[cfg(feature = "mp4")]
mod mp4;
mod webp;

use std::sync::Arc;

use super::{Picture, error::PictureError};

/// The kinds of files that pictures are written to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// A still; lossless.
    Png,
    /// A still; lossless.
    WebpStill,
    /// Moves; lossy.
    Webp,
    /// Moves; 255 colors.
    Gif,
    /// Moves; lossless.
    Apng,
    /// Moves; lossy, and without opacity: what is transparent is white. Written where the crate is built with the feature `mp4`.
    Mp4,
}

impl PictureFormat {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Png, Self::WebpStill, Self::Webp, Self::Gif, Self::Apng, Self::Mp4];

    /// The format that a file's ending asks for. A WebP moves where what it shows does.
    #[must_use]
    pub fn of_ending(ending: &str, moves: bool) -> Option<Self> {
        match ending.to_ascii_lowercase().as_str() {
            "png" => Some(Self::Png),
            "webp" if moves => Some(Self::Webp),
            "webp" => Some(Self::WebpStill),
            "gif" => Some(Self::Gif),
            "apng" => Some(Self::Apng),
            "mp4" => Some(Self::Mp4),
            _ => None,
        }
    }

    /// Whether it has several frames.
    #[must_use]
    pub const fn moves(self) -> bool {
        matches!(self, Self::Webp | Self::Gif | Self::Apng | Self::Mp4)
    }

    /// The media type.
    #[must_use]
    pub const fn media_type(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::WebpStill | Self::Webp => "image/webp",
            Self::Gif => "image/gif",
            Self::Apng => "image/apng",
            Self::Mp4 => "video/mp4",
        }
    }

    /// The ending of a file's name.
    #[must_use]
    pub const fn ending(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::WebpStill | Self::Webp => "webp",
            Self::Gif => "gif",
            Self::Apng => "apng",
            Self::Mp4 => "mp4",
        }
    }

    /// The feature of the crate that it takes to write it, where this build is without.
    #[must_use]
    pub const fn missing_feature(self) -> Option<&'static str> {
        match self {
            Self::Mp4 if !cfg!(feature = "mp4") => Some("mp4"),
            _ => None,
        }
    }

    /// Encodes a still.
    pub(super) fn still(self, picture: &Picture) -> Result<Vec<u8>, PictureError> {
        match self {
            Self::WebpStill | Self::Webp => webp::still(picture),
            _ => apng::still(picture),
        }
    }
}

/// The frames, of so many, that a palette is taken from.
pub(super) fn frames_learned_from(frames: usize) -> Vec<usize> {
    (0..8).map(|place| place * (frames - 1) / 7).collect()
}

/// A part of a picture: left, top, right and bottom, the last two beyond its last pixels.
pub(super) type Area = [usize; 4];

/// A frame as its encoder takes it.
pub(super) enum Frame {
    /// As it was drawn.
    Colors(Picture),
    /// In colors of a palette, which is a quarter as large.
    InPalette(gif::Patch),
    /// In colors of video.
    #[cfg(feature = "mp4")]
    Planes(mp4::Planes),
}

/// Makes frames of pictures.
pub(super) enum Preparation {
    Colors,
    /// With whether parts of pictures are enough.
    Palette(Arc<gif::Palette>, bool),
    /// With what there is where nothing is drawn.
    #[cfg(feature = "mp4")]
    Planes(mp4::Planes),
}

impl Preparation {
    /// Whether a frame takes less room than its picture.
    pub(super) const fn is_compact(&self) -> bool {
        matches!(self, Self::Palette(..))
    }

    /// A frame, and the picture where that is not needed any more.
    pub(super) fn frame(&self, picture: Picture) -> (Frame, Option<Picture>) {
        match self {
            Self::Palette(palette, _) => {
                let whole = [0, 0, picture.width, picture.height];
                (Frame::InPalette(palette.patch(&picture, whole)), Some(picture))
            }
            _ => (Frame::Colors(picture), None),
        }
    }

    /// A frame of a picture that is, but for an area, as where nothing is drawn.
    pub(super) fn frame_of_part(&self, picture: &Picture, area: Area) -> Frame {
        match self {
            Self::Colors => Frame::Colors(picture.clone()),
            Self::Palette(palette, true) => Frame::InPalette(palette.patch(picture, area)),
            Self::Palette(palette, false) => {
                Frame::InPalette(palette.patch(picture, [0, 0, picture.width, picture.height]))
            }
            #[cfg(feature = "mp4")]
            Self::Planes(ground) => Frame::Planes(ground.with(picture, area)),
        }
    }
}

/// A moving picture that frames are added to, in their order. It repeats for ever.
pub(super) enum Motion {
    Apng(Box<apng::Writer>),
    Gif(Box<gif::Writer>),
    Webp(webp::Writer),
    #[cfg(feature = "mp4")]
    Mp4(Box<mp4::Writer>),
}

impl Motion {
    pub(super) fn new(
        format: PictureFormat,
        size: [usize; 2],
        fps: f64,
        frames: usize,
        is_transparent: bool,
    ) -> Result<Self, PictureError> {
        Ok(match format {
            PictureFormat::Gif => Self::Gif(Box::new(gif::Writer::new(size, fps, is_transparent))),
            PictureFormat::Webp => Self::Webp(webp::Writer::new(size, fps)),
            #[cfg(feature = "mp4")]
            PictureFormat::Mp4 => Self::Mp4(Box::new(mp4::Writer::new(size, fps)?)),
            #[cfg(not(feature = "mp4"))]
            PictureFormat::Mp4 => {
                return Err(PictureError::new("this build does not write MP4: it was made without the feature 'mp4'"));
            }
            _ => Self::Apng(Box::new(apng::Writer::new(size, fps, frames)?)),
        })
    }

    /// Whether [`Self::learn`] has to be called first.
    pub(super) const fn wants_palette(&self) -> bool {
        matches!(self, Self::Gif(_))
    }

    /// Takes the colors of all frames from some of them, where the format has a palette.
    pub(super) fn learn(&mut self, pictures: &[Picture]) {
        if let Self::Gif(writer) = self {
            writer.use_palette(Arc::new(gif::Palette::of(pictures)));
        }
    }

    /// What makes frames of pictures, which others may do while this adds those before.
    pub(super) fn preparation(&self) -> Preparation {
        match self {
            Self::Gif(writer) => Preparation::Palette(writer.palette(), false),
            _ => Preparation::Colors,
        }
    }

    /// The same where most of each picture is as the ground, on which nothing is drawn yet.
    pub(super) fn preparation_on(&mut self, ground: &Picture) -> Preparation {
        match self {
            Self::Gif(writer) => Preparation::Palette(writer.palette(), writer.begin_on(ground)),
            #[cfg(feature = "mp4")]
            Self::Mp4(_) => Preparation::Planes(mp4::Planes::of(ground)),
            _ => Preparation::Colors,
        }
    }

    /// Adds what [`Self::preparation`] has made of pictures, and gives the pictures back that are not needed any more.
    pub(super) fn add_frames(&mut self, frames: Vec<Frame>) -> Result<Vec<Picture>, PictureError> {
        let (mut pictures, mut patches) = (Vec::new(), Vec::new());
        #[cfg(feature = "mp4")]
        let mut planes = Vec::new();
        for frame in frames {
            match frame {
                Frame::Colors(picture) => pictures.push(picture),
                Frame::InPalette(patch) => patches.push(patch),
                #[cfg(feature = "mp4")]
                Frame::Planes(of_frame) => planes.push(of_frame),
            }
        }
        match self {
            Self::Gif(writer) => writer.add_patches(patches)?,
            #[cfg(feature = "mp4")]
            Self::Mp4(writer) if !planes.is_empty() => writer.add_planes(&planes)?,
            _ => self.add(&pictures)?,
        }
        Ok(pictures)
    }

    pub(super) fn add(&mut self, pictures: &[Picture]) -> Result<(), PictureError> {
        match self {
            Self::Apng(writer) => writer.add(pictures),
            Self::Gif(writer) => writer.add(pictures),
            Self::Webp(writer) => writer.add(pictures),
            #[cfg(feature = "mp4")]
            Self::Mp4(writer) => writer.add(pictures),
        }
    }

    pub(super) fn finish(self) -> Result<Vec<u8>, PictureError> {
        match self {
            Self::Apng(writer) => writer.finish(),
            Self::Gif(writer) => writer.finish(),
            Self::Webp(writer) => Ok(writer.finish()),
            #[cfg(feature = "mp4")]
            Self::Mp4(writer) => writer.finish(),
        }
    }
}

/// An encoder that did not take what it was given, which is a fault of ours.
fn refused(error: impl std::fmt::Display) -> PictureError {
    PictureError::new(format!("the picture cannot be encoded: {error}"))
}

/// The milliseconds at which a frame begins: those of all frames add up to the exact length.
fn begins_ms(frame: usize, fps: f64) -> u32 {
    (frame as f64 * 1000.0 / fps).round() as u32
}
