//! PNG: one picture, or several that move.

use super::super::{Picture, error::PictureError};
use super::refused;

/// A PNG of one picture.
pub(super) fn still(picture: &Picture) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.width as u32, picture.height as u32);
    set_up(&mut encoder);
    let mut writer = encoder.write_header().map_err(refused)?;
    writer.write_image_data(picture.pixels.as_flattened()).map_err(refused)?;
    writer.finish().map_err(refused)?;
    Ok(bytes)
}

fn set_up<W: std::io::Write>(encoder: &mut png::Encoder<'_, W>) {
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
}

/// Frames of one moving picture.
pub(in crate::picture) struct Writer {
    writer: png::Writer<Sink>,
    fps: f64,
    frame: usize,
    bytes: std::sync::Arc<std::sync::Mutex<Vec<u8>>>,
}

/// Bytes that can be read when the writer, which keeps what it writes to, has ended.
struct Sink(std::sync::Arc<std::sync::Mutex<Vec<u8>>>);

impl std::io::Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let mut all = self.0.lock().map_err(|_| std::io::Error::other("the picture was given up"))?;
        all.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Writer {
    pub(super) fn new([width, height]: [usize; 2], fps: f64, frames: usize) -> Result<Self, PictureError> {
        let bytes = std::sync::Arc::default();
        let mut encoder = png::Encoder::new(Sink(std::sync::Arc::clone(&bytes)), width as u32, height as u32);
        set_up(&mut encoder);
        encoder.set_animated(frames as u32, 0).map_err(refused)?;
        encoder.set_frame_delay(milliseconds(fps, 0), 1000).map_err(refused)?;
        Ok(Self { writer: encoder.write_header().map_err(refused)?, fps, frame: 0, bytes })
    }

    pub(super) fn add(&mut self, pictures: &[Picture]) -> Result<(), PictureError> {
        for picture in pictures {
            self.writer.set_frame_delay(milliseconds(self.fps, self.frame), 1000).map_err(refused)?;
            self.writer.write_image_data(picture.pixels.as_flattened()).map_err(refused)?;
            self.frame += 1;
        }
        Ok(())
    }

    pub(super) fn finish(self) -> Result<Vec<u8>, PictureError> {
        self.writer.finish().map_err(refused)?;
        let bytes = std::mem::take(&mut *self.bytes.lock().map_err(refused)?);
        Ok(bytes)
    }
}

/// How long a frame is shown, in whole milliseconds: readers keep no fractions of them, and those of all frames add up to the exact length.
fn milliseconds(fps: f64, frame: usize) -> u16 {
    let begins = |frame: usize| (frame as f64 * 1000.0 / fps).round();
    (begins(frame + 1) - begins(frame)) as u16
}
