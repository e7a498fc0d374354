//! Pictures that others made, to a moving picture.

use rayon::prelude::*;

use super::{
    Picture, PictureError, PictureFormat,
    encode::{Area, Frame, Motion, Preparation, frames_learned_from},
};

/// A moving picture that frames are added to, in their order. It repeats for ever.
pub struct Reel(Motion);

/// What makes frames of pictures, which may be done for several at the same time.
pub struct Shutter(Preparation);

/// A frame that is ready for its reel.
pub struct Shot(Frame);

impl Shutter {
    /// A frame of a picture that is the ground but for an area: left, top, right and bottom.
    #[must_use]
    pub fn shot(&self, picture: &Picture, area: Area) -> Shot {
        Shot(self.0.frame_of_part(picture, area))
    }
}

impl Reel {
    /// An empty one for so many frames, and what makes them. Frames are drawn on the ground. Where the format has a palette, it is taken from
    /// some of them, which `picture` gives.
    ///
    /// # Errors
    ///
    /// Where the format does not hold what is asked for.
    pub fn new(
        format: PictureFormat,
        ground: &Picture,
        fps: f64,
        frames: usize,
        picture: impl Fn(usize) -> Picture + Sync + Send,
    ) -> Result<(Self, Shutter), PictureError> {
        let is_transparent = ground.pixels.iter().any(|pixel| pixel[3] < 255);
        let mut motion = Motion::new(format, [ground.width, ground.height], fps, frames, is_transparent)?;
        if motion.wants_palette() && frames > 0 {
            let pictures: Vec<Picture> = frames_learned_from(frames).into_par_iter().map(picture).collect();
            motion.learn(&pictures);
        }
        let shutter = Shutter(motion.preparation_on(ground));
        Ok((Self(motion), shutter))
    }

    /// Adds the next frames.
    ///
    /// # Errors
    ///
    /// Where it cannot be encoded.
    pub fn add(&mut self, shots: Vec<Shot>) -> Result<(), PictureError> {
        self.0.add_frames(shots.into_iter().map(|Shot(frame)| frame).collect()).map(|_| ())
    }

    /// The file.
    ///
    /// # Errors
    ///
    /// Where it cannot be encoded.
    pub fn finish(self) -> Result<Vec<u8>, PictureError> {
        self.0.finish()
    }
}

impl std::fmt::Debug for Reel {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Reel")
    }
}

impl std::fmt::Debug for Shutter {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Shutter")
    }
}

impl std::fmt::Debug for Shot {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Shot")
    }
}
