//! WebP: one picture, or several that move, without loss.
//!
//! The container is that of the specification: `RIFF` with a `VP8X` header, an `ANIM` chunk, and one `ANMF` chunk for each frame, which
//! holds a frame's own image chunk. Of a frame only the smallest rectangle that differs from the frame before is there.

use image_webp::{ColorType, WebPEncoder};

use super::super::{Picture, error::PictureError};
use super::{begins_ms, refused};

/// A WebP of one picture.
pub(super) fn still(picture: &Picture) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::new();
    let (width, height) = (picture.width as u32, picture.height as u32);
    WebPEncoder::new(&mut bytes)
        .encode(picture.pixels.as_flattened(), width, height, ColorType::Rgba8)
        .map_err(refused)?;
    Ok(bytes)
}

/// Frames of one moving picture.
pub(in crate::picture) struct Writer {
    size: [usize; 2],
    fps: f64,
    frame: usize,
    before: Option<Picture>,
    chunks: Vec<u8>,
}

/// Bytes of the header of a `RIFF` file before its first chunk.
const HEADER: usize = 12;
/// Flags of `VP8X`: it moves, and it has opacity.
const MOVES: u8 = 0x02;
const HAS_OPACITY: u8 = 0x10;
/// Flag of `ANMF`: a frame replaces what is below it instead of being laid over it.
const REPLACES: u8 = 0x02;

impl Writer {
    pub(super) const fn new(size: [usize; 2], fps: f64) -> Self {
        Self { size, fps, frame: 0, before: None, chunks: Vec::new() }
    }

    pub(super) fn add(&mut self, picture: &Picture) -> Result<(), PictureError> {
        let [left, top, right, bottom] = self.before.as_ref().map_or([0, 0, self.size[0], self.size[1]], |before| {
            let [left, top, right, bottom] = super::gif::changed(before, picture).unwrap_or([0, 0, 1, 1]);
            // Places of frames are even.
            [left & !1, top & !1, right, bottom]
        });
        let (width, height) = (right - left, bottom - top);
        let mut part = Picture::filled(width, height, [0; 4]);
        for row in 0..height {
            let from = &picture.pixels[(top + row) * picture.width + left..][..width];
            part.pixels[row * width..][..width].copy_from_slice(from);
        }
        let image = still(&part)?;
        let lasts = begins_ms(self.frame + 1, self.fps) - begins_ms(self.frame, self.fps);
        let mut chunk = Vec::with_capacity(image.len() + 16);
        for number in [left / 2, top / 2, width - 1, height - 1, lasts as usize] {
            chunk.extend_from_slice(&(number as u32).to_le_bytes()[..3]);
        }
        chunk.push(REPLACES);
        chunk.extend_from_slice(&image[HEADER..]);
        append(&mut self.chunks, *b"ANMF", &chunk);
        self.frame += 1;
        self.before = Some(picture.clone());
        Ok(())
    }

    pub(super) fn finish(self) -> Vec<u8> {
        let mut body = b"WEBP".to_vec();
        let mut header = vec![MOVES | HAS_OPACITY, 0, 0, 0];
        for side in self.size {
            header.extend_from_slice(&(side as u32 - 1).to_le_bytes()[..3]);
        }
        append(&mut body, *b"VP8X", &header);
        // No color behind it, and repeated for ever.
        append(&mut body, *b"ANIM", &[0; 6]);
        body.extend_from_slice(&self.chunks);
        let mut file = b"RIFF".to_vec();
        file.extend_from_slice(&(body.len() as u32).to_le_bytes());
        file.extend_from_slice(&body);
        file
    }
}

fn append(file: &mut Vec<u8>, name: [u8; 4], content: &[u8]) {
    file.extend_from_slice(&name);
    file.extend_from_slice(&(content.len() as u32).to_le_bytes());
    file.extend_from_slice(content);
    if content.len() % 2 == 1 {
        file.push(0);
    }
}
