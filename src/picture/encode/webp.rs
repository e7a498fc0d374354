//! WebP: one picture without loss, or several that move, with as little loss as is not seen.
//!
//! The container is that of the specification: `RIFF` with a `VP8X` header, an `ANIM` chunk, and one `ANMF` chunk for each frame, which
//! holds a frame's own image chunk. Of a frame only the smallest rectangle that differs from the frame before is there.

use image_webp::{ColorType, WebPEncoder};
use rayon::prelude::*;

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

/// The chunks of a picture's image, and of its opacity where it is not opaque.
fn lossy(picture: &Picture) -> Result<Vec<u8>, PictureError> {
    let mut config =
        ::webp::WebPConfig::new().map_err(|()| PictureError::new("the WebP encoder is of another version"))?;
    config.quality = QUALITY;
    // The fastest of its searches but for two: the others take several times as long for a tenth of the bytes.
    config.method = 2;
    let (width, height) = (picture.width as u32, picture.height as u32);
    let file = ::webp::Encoder::from_rgba(picture.pixels.as_flattened(), width, height)
        .encode_advanced(&config)
        .map_err(|error| refused(format!("{error:?}")))?;
    let mut rest = &file[HEADER..];
    let mut chunks = Vec::with_capacity(file.len());
    while let Some((head, body)) = rest.split_at_checked(8) {
        let length = u32::from_le_bytes([head[4], head[5], head[6], head[7]]) as usize;
        let length = (length + length % 2).min(body.len());
        if &head[..4] != b"VP8X" {
            chunks.extend_from_slice(&rest[..8 + length]);
        }
        rest = &body[length..];
    }
    Ok(chunks)
}

/// Of 100.
const QUALITY: f32 = 60.0;

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

    /// Adds frames: each knows the one before it, so all are encoded at the same time.
    pub(super) fn add(&mut self, pictures: &[Picture]) -> Result<(), PictureError> {
        let before = |index: usize| match index.checked_sub(1) {
            Some(before) => pictures.get(before),
            None => self.before.as_ref(),
        };
        let encode = |index: usize| self.chunk(self.frame + index, before(index), &pictures[index]);
        let chunks = (0..pictures.len()).into_par_iter().map(encode).collect::<Result<Vec<_>, _>>()?;
        chunks.iter().for_each(|chunk| append(&mut self.chunks, *b"ANMF", chunk));
        self.frame += pictures.len();
        self.before = pictures.last().cloned().or_else(|| self.before.take());
        Ok(())
    }

    /// The chunk of a frame: what differs from the one before.
    fn chunk(&self, number: usize, before: Option<&Picture>, picture: &Picture) -> Result<Vec<u8>, PictureError> {
        let [left, top, right, bottom] = before.map_or([0, 0, self.size[0], self.size[1]], |before| {
            let changed = super::gif::changed(&before.pixels, &picture.pixels, picture.width);
            let [left, top, right, bottom] = changed.unwrap_or([0, 0, 1, 1]);
            // Places of frames are even.
            [left & !1, top & !1, right, bottom]
        });
        let (width, height) = (right - left, bottom - top);
        let mut part = Picture::filled(width, height, [0; 4]);
        for row in 0..height {
            let from = &picture.pixels[(top + row) * picture.width + left..][..width];
            part.pixels[row * width..][..width].copy_from_slice(from);
        }
        let image = lossy(&part)?;
        let lasts = begins_ms(number + 1, self.fps) - begins_ms(number, self.fps);
        let mut chunk = Vec::with_capacity(image.len() + 16);
        for number in [left / 2, top / 2, width - 1, height - 1, lasts as usize] {
            chunk.extend_from_slice(&(number as u32).to_le_bytes()[..3]);
        }
        chunk.push(REPLACES);
        chunk.extend_from_slice(&image);
        Ok(chunk)
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
