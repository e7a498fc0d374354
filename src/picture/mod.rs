//! Seeing: a figure and its motion as pictures, with no GPU, no browser and no other program.
//!
//! | file | what it answers |
//! | --- | --- |
//! | `view` | what somebody wants to see: size, camera, frames, style |
//! | `error` | why there is no picture |
//! | `figure` | where the vertices of a figure are at a frame, and how light falls on them |
//! | `capsules` | what a skeleton without a mesh looks like |
//! | `texture` | PNG and JPEG files to colors |
//! | `image`, `orientation` | PNG, JPEG and WebP files to pixels, turned as their camera was held |
//! | `camera` | where the picture is seen from, so that the whole figure is in it |
//! | `rounding` | what the innermost loops round with |
//! | `raster` | triangles to samples, nearest in front |
//! | `floor` | the grid and the shadow that a figure stands on |
//! | `text` | letters on a picture |
//! | `cast` | who is in a picture |
//! | `marks` | what a report found, drawn into a picture |
//! | `stage` | where figures stand, and which cameras see them, one or two at a time |
//! | `scene` | one picture of one frame, all of the above together |
//! | `film` | many pictures: sheets, turntables and clips |
//! | `reel` | pictures that others made, to a moving picture |
//! | `encode` | pictures to PNG, APNG, WebP, GIF and MP4 files |
//!
//! Everything is `f32` in a fixed order and no frame knows of another, so the same input gives the same bytes for any number of threads.
//!
//! Must never know: rigs, roles, formats of animation, the file system, the clock. What it needs of them is handed in.

mod camera;
mod capsules;
mod cast;
pub mod encode;
mod error;
mod figure;
mod film;
mod floor;
mod image;
mod marks;
mod orientation;
mod raster;
mod reel;
mod rounding;
mod scene;
mod stage;
mod text;
mod texture;
mod view;

pub use camera::Sight;
pub use capsules::{Bone, capsules};
pub use cast::Cast;
pub use encode::PictureFormat;
pub use error::PictureError;
pub use figure::Figure;
pub use film::{Film, FilmError, render};
pub use image::{Upright, plain_image, read_picture, read_upright};
pub use marks::{Grade, Marks, Ring, Strip, Touch};
pub use reel::{Reel, Shot, Shutter};
pub use scene::Subject;
pub use view::{Background, CameraKind, Follow, Layout, MAX_SIDE, Sheet, SheetSize, SheetWord, Style, View};

/// A picture as a PNG file.
///
/// # Errors
/// Where it cannot be encoded.
pub fn write_png(picture: &Picture) -> Result<Vec<u8>, PictureError> {
    PictureFormat::Png.still(picture)
}

/// A picture of red, green, blue and opacity, 8 bits each, sRGB, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// In pixels.
    pub width: usize,
    /// In pixels.
    pub height: usize,
    /// `width * height` pixels.
    pub pixels: Vec<[u8; 4]>,
}

impl Picture {
    /// A picture of one color.
    #[must_use]
    pub fn filled(width: usize, height: usize, color: [u8; 4]) -> Self {
        Self { width, height, pixels: vec![color; width * height] }
    }

    /// Shows a ghost in blue, and only faintly where the figure of this picture is, which is given alone as well.
    pub(crate) fn haunt(&mut self, ghost: &Self, figure: &Self) {
        const BESIDE: f32 = 0.6;
        const OVER: f32 = 0.14;
        const BLUE: [f32; 3] = [60.0, 120.0, 235.0];
        for (index, ghost) in ghost.pixels.iter().enumerate().filter(|(_, ghost)| ghost[3] > 0) {
            let covered = f32::from(figure.pixels[index][3]) / 255.0;
            let share = f32::from(ghost[3]) / 255.0 * (BESIDE + (OVER - BESIDE) * covered);
            let light = ghost[..3].iter().map(|part| f32::from(*part)).sum::<f32>() / (3.0 * 255.0);
            let color = BLUE.map(|part| (part * (0.5 + 0.7 * light)).min(255.0) as u8);
            let width = self.width;
            self.dot((index % width) as i64, (index / width) as i64, color, share);
        }
    }

    /// Mixes a color into a pixel; outside of the picture there is none.
    pub(crate) fn dot(&mut self, column: i64, row: i64, color: [u8; 3], share: f32) {
        let inside = |value: i64, most: usize| usize::try_from(value).ok().filter(|value| *value < most);
        let Some((column, row)) = inside(column, self.width).zip(inside(row, self.height)) else { return };
        let pixel = &mut self.pixels[row * self.width + column];
        for (under, over) in pixel.iter_mut().zip(color) {
            *under = (f32::from(*under) * (1.0 - share) + f32::from(over) * share + 0.5) as u8;
        }
        pixel[3] = (f32::from(pixel[3]) + (255.0 - f32::from(pixel[3])) * share + 0.5) as u8;
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    ///
    /// Where it cannot be encoded.
    pub fn to_png(&self) -> Result<Vec<u8>, PictureError> {
        self.to_still(PictureFormat::Png)
    }

    /// The picture as a still: WebP where that is asked for, else PNG.
    ///
    /// # Errors
    ///
    /// Where it cannot be encoded.
    pub fn to_still(&self, format: PictureFormat) -> Result<Vec<u8>, PictureError> {
        format.still(self)
    }

    /// Puts another picture over this one; what is outside is left out.
    pub fn paste(&mut self, other: &Self, left: usize, top: usize) {
        for row in 0..other.height.min(self.height.saturating_sub(top)) {
            let count = other.width.min(self.width.saturating_sub(left));
            let from = &other.pixels[row * other.width..][..count];
            self.pixels[(top + row) * self.width + left..][..count].copy_from_slice(from);
        }
    }
}
