//! Pictures that others made, to a moving picture.

use rayon::prelude::*;

use super::{
    Picture, PictureError, PictureFormat,
    encode::{Motion, frames_learned_from},
};

/// A moving picture that frames are added to, in their order. It repeats for ever.
pub struct Reel(Motion);

impl std::fmt::Debug for Reel {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Reel")
    }
}

impl Reel {
    /// An empty one for so many frames. Where the format has a palette, it is taken from some of them, which `picture` gives.
    ///
    /// # Errors
    ///
    /// Where the format does not hold what is asked for.
    pub fn new(
        format: PictureFormat,
        size: [usize; 2],
        fps: f64,
        frames: usize,
        is_transparent: bool,
        picture: impl Fn(usize) -> Picture + Sync + Send,
    ) -> Result<Self, PictureError> {
        let mut motion = Motion::new(format, size, fps, frames, is_transparent)?;
        if motion.wants_palette() && frames > 0 {
            let pictures: Vec<Picture> = frames_learned_from(frames).into_par_iter().map(picture).collect();
            motion.learn(&pictures);
        }
        Ok(Self(motion))
    }

    /// Adds the next frames, which are encoded at the same time.
    ///
    /// # Errors
    ///
    /// Where it cannot be encoded.
    pub fn add(&mut self, pictures: &[Picture]) -> Result<(), PictureError> {
        self.0.add(pictures)
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
