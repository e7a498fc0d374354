//! Seeing: a figure and its motion as pictures, with no GPU, no browser and no other program.
//!
//! | file | what it answers |
//! | --- | --- |
//! | `view` | what somebody wants to see: size, camera, frames, style |
//! | `error` | why there is no picture |
//! | `figure` | where the vertices of a figure are at a frame, and how light falls on them |
//! | `capsules` | what a skeleton without a mesh looks like |
//! | `texture` | PNG and JPEG files to colors |
//! | `camera` | where the picture is seen from, so that the whole figure is in it |
//! | `raster` | triangles to samples, nearest in front |
//! | `floor` | the grid and the shadow that a figure stands on |
//! | `text` | letters on a picture |
//! | `scene` | one picture of one frame, all of the above together |
//! | `film` | many pictures: sheets, turntables and clips |
//! | `reel` | pictures that others made, to a moving picture |
//! | `encode` | pictures to PNG, APNG, WebP and GIF files |
//!
//! Everything is `f32` in a fixed order and no frame knows of another, so the same input gives the same bytes for any number of threads.
//!
//! Must never know: rigs, roles, formats of animation, the file system, the clock. What it needs of them is handed in.

mod camera;
mod capsules;
pub mod encode;
mod error;
mod figure;
mod film;
mod floor;
mod raster;
mod reel;
mod scene;
mod text;
mod texture;
mod view;

pub use capsules::{Bone, capsules};
pub use encode::PictureFormat;
pub use error::PictureError;
pub use figure::Figure;
pub use film::{Film, FilmError, render};
pub use reel::Reel;
pub use scene::Subject;
pub use texture::read_picture;
pub use view::{Background, CameraKind, Follow, MAX_SIDE, SheetSize, Style, View};

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

    /// Puts another picture over this one; what is outside is left out.
    pub fn paste(&mut self, other: &Self, left: usize, top: usize) {
        for row in 0..other.height.min(self.height.saturating_sub(top)) {
            let count = other.width.min(self.width.saturating_sub(left));
            let from = &other.pixels[row * other.width..][..count];
            self.pixels[(top + row) * self.width + left..][..count].copy_from_slice(from);
        }
    }
}
