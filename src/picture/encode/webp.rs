//! WebP: one picture without loss, or several that move, with as little loss as is not seen.
//!
//! The container is that of the specification: `RIFF` with a `VP8X` header, an `ANIM` chunk, and one `ANMF` chunk for each frame, which
//! holds a frame's own image chunk. Of a frame only the smallest rectangle is there that holds what it and the frame before have changed.

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
    // Bits go to what is smooth, where loss is seen first.
    config.sns_strength = 80;
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
const QUALITY: f32 = 52.0;
/// Pixels: loss stays within a block of 16 and what is smoothed at its edges.
const LOSS_REACHES: usize = 20;

type Part = [usize; 4];

/// Frames of one moving picture.
pub(in crate::picture) struct Writer {
    size: [usize; 2],
    fps: f64,
    frame: usize,
    before: Option<Picture>,
    /// What the last frame changed: left, top, right and bottom.
    changed: Part,
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
        Self { size, fps, frame: 0, before: None, changed: [0, 0, size[0], size[1]], chunks: Vec::new() }
    }

    /// Adds frames: each knows the one before it, so all are encoded at the same time.
    pub(super) fn add(&mut self, pictures: &[Picture]) -> Result<(), PictureError> {
        let before = |index: usize| match index.checked_sub(1) {
            Some(before) => pictures.get(before),
            None => self.before.as_ref(),
        };
        let changed: Vec<Part> =
            (0..pictures.len()).into_par_iter().map(|index| self.changed(before(index), &pictures[index])).collect();
        let encode = |index: usize| {
            let before = index.checked_sub(1).map_or(self.changed, |before| changed[before]);
            self.chunk(self.frame + index, drawn(before, changed[index], self.size), &pictures[index])
        };
        let chunks = (0..pictures.len()).into_par_iter().map(encode).collect::<Result<Vec<_>, _>>()?;
        self.changed = changed.last().copied().unwrap_or(self.changed);
        chunks.iter().for_each(|chunk| append(&mut self.chunks, *b"ANMF", chunk));
        self.frame += pictures.len();
        self.before = pictures.last().cloned().or_else(|| self.before.take());
        Ok(())
    }

    /// What differs from the frame before.
    fn changed(&self, before: Option<&Picture>, picture: &Picture) -> Part {
        before.map_or([0, 0, self.size[0], self.size[1]], |before| {
            let changed = super::gif::changed(&before.pixels, &picture.pixels, picture.width);
            changed.unwrap_or([0, 0, 1, 1])
        })
    }

    /// The chunk of a frame: a part of the picture.
    fn chunk(&self, number: usize, part: Part, picture: &Picture) -> Result<Vec<u8>, PictureError> {
        let [left, top, right, bottom] = part;
        let (width, height) = (right - left, bottom - top);
        let mut shown = Picture::filled(width, height, [0; 4]);
        for row in 0..height {
            let from = &picture.pixels[(top + row) * picture.width + left..][..width];
            shown.pixels[row * width..][..width].copy_from_slice(from);
        }
        let image = lossy(&shown)?;
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

/// The part of a frame that is drawn. What the frame before changed is drawn again, so that what its loss left around it goes.
fn drawn(before: Part, now: Part, size: [usize; 2]) -> Part {
    let low = |side: usize| before[side].min(now[side]).saturating_sub(LOSS_REACHES);
    let high = |side: usize| (before[2 + side].max(now[2 + side]) + LOSS_REACHES).min(size[side]);
    // Places of frames are even.
    [low(0) & !1, low(1) & !1, high(0), high(1)]
}

fn append(file: &mut Vec<u8>, name: [u8; 4], content: &[u8]) {
    file.extend_from_slice(&name);
    file.extend_from_slice(&(content.len() as u32).to_le_bytes());
    file.extend_from_slice(content);
    if content.len() % 2 == 1 {
        file.push(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Loss spreads around what is drawn, over the part that is encoded: it goes with what it came from.
    #[test]
    fn what_loss_left_beside_a_figure_goes_with_it() {
        let plain = Picture::filled(128, 128, [236, 238, 241, 255]);
        let with = |rows: std::ops::Range<usize>, picture: &Picture, color: [u8; 4]| {
            let mut picture = picture.clone();
            rows.clone().for_each(|row| picture.pixels[row * 128 + rows.start..row * 128 + rows.end].fill(color));
            picture
        };
        let far = with(100..104, &plain, [20, 20, 20, 255]);
        let both = with(21..40, &far, [200, 30, 20, 255]);
        let mut writer = Writer::new([128, 128], 10.0);
        writer.add(&[plain, both, far]).expect("encoded");
        let mut decoder = image_webp::WebPDecoder::new(std::io::Cursor::new(writer.finish())).expect("a WebP");
        let mut shown = vec![0; decoder.output_buffer_size().expect("a size")];
        for _ in 0..3 {
            decoder.read_frame(&mut shown).expect("a frame");
        }
        let parts = shown.len() / (128 * 128);
        let gray = |column: usize, row: usize| i32::from(shown[(row * 128 + column) * parts + 1]);
        let places = (10..60).flat_map(|row| (10..60).map(move |column| (column, row)));
        let worst = places.map(|(column, row)| ((gray(column, row) - 238).abs(), column, row)).max().expect("pixels");
        assert!(worst.0 <= 3, "off by, at column and row: {worst:?}");
    }
}
