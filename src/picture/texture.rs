//! PNG and JPEG files to colors.

use zune_jpeg::zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions};

use super::{Picture, error::PictureError};

/// Textures are made smaller until neither side is longer.
const MAX_SIDE: usize = 1024;
/// Pixels of one image before it is made smaller.
const MAX_PIXELS: usize = 8192 * 8192;

/// Colors that repeat in both directions.
#[derive(Clone, Debug)]
pub(super) struct Texture {
    width: usize,
    height: usize,
    /// sRGB and opacity.
    pixels: Vec<[u8; 4]>,
}

impl Texture {
    /// Reads a PNG, a JPEG or a WebP.
    pub(super) fn read(bytes: &[u8]) -> Result<Self, PictureError> {
        let (width, height, pixels) = decode(bytes)?;
        let mut texture = Self { width, height, pixels };
        while texture.width.max(texture.height) > MAX_SIDE {
            texture = texture.halved();
        }
        Ok(texture)
    }

    /// The color at a place, from the nearest four pixels.
    pub(super) fn at(&self, u: f32, v: f32) -> [f32; 4] {
        let x = (u - u.floor()) * self.width as f32 - 0.5;
        let y = (v - v.floor()) * self.height as f32 - 0.5;
        let (left, top) = (x.floor(), y.floor());
        let (right_share, low_share) = (x - left, y - top);
        let wrap = |at: f32, size: usize| (at as i64).rem_euclid(size as i64) as usize;
        let columns = [wrap(left, self.width), wrap(left + 1.0, self.width)];
        let rows = [wrap(top, self.height), wrap(top + 1.0, self.height)];
        let pixel = |row: usize, column: usize| self.pixels[rows[row] * self.width + columns[column]].map(f32::from);
        let mix = |one: [f32; 4], other: [f32; 4], share: f32| {
            [0, 1, 2, 3].map(|part: usize| one[part] + (other[part] - one[part]) * share)
        };
        let high = mix(pixel(0, 0), pixel(0, 1), right_share);
        let low = mix(pixel(1, 0), pixel(1, 1), right_share);
        mix(high, low, low_share).map(|part| part * (1.0 / 255.0))
    }

    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut pixels = Vec::with_capacity(width * height);
        for row in 0..height {
            for column in 0..width {
                let rows = [row * 2, (row * 2 + 1).min(self.height - 1)];
                let columns = [column * 2, (column * 2 + 1).min(self.width - 1)];
                let mut sum = [0_u32; 4];
                for row in rows {
                    for column in columns {
                        let pixel = self.pixels[row * self.width + column];
                        sum.iter_mut().zip(pixel).for_each(|(sum, part)| *sum += u32::from(part));
                    }
                }
                pixels.push(sum.map(|part| (part / 4) as u8));
            }
        }
        Self { width, height, pixels }
    }
}

type Decoded = (usize, usize, Vec<[u8; 4]>);

fn check_size(width: usize, height: usize) -> Result<(), PictureError> {
    let pixels = width.checked_mul(height).filter(|pixels| *pixels > 0 && *pixels <= MAX_PIXELS);
    pixels.map(|_| ()).ok_or_else(|| PictureError::new(format!("an image of {width} by {height} pixels is too large")))
}

fn broken(error: impl std::fmt::Display) -> PictureError {
    PictureError::new(format!("the image cannot be decoded: {error}"))
}

fn decode(bytes: &[u8]) -> Result<Decoded, PictureError> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => png(bytes),
        [0xff, 0xd8, ..] => jpeg(bytes),
        [b'R', b'I', b'F', b'F', ..] => webp(bytes),
        _ => Err(PictureError::new("the image is neither PNG, JPEG nor WebP")),
    }
}

/// Reads a PNG, a JPEG or a WebP in its own size.
///
/// # Errors
///
/// Where it is none of them, or is broken.
pub fn read_picture(bytes: &[u8]) -> Result<Picture, PictureError> {
    let (width, height, pixels) = decode(bytes)?;
    Ok(Picture { width, height, pixels })
}

fn png(bytes: &[u8]) -> Result<Decoded, PictureError> {
    let mut decoder = png::Decoder::new_with_limits(std::io::Cursor::new(bytes), png::Limits { bytes: MAX_PIXELS * 4 });
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(broken)?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    check_size(width, height)?;
    let size = reader.output_buffer_size().ok_or_else(|| PictureError::new("the image is too large"))?;
    let mut buffer = vec![0; size];
    let frame = reader.next_frame(&mut buffer).map_err(broken)?;
    let samples = frame.color_type.samples();
    let row = frame.line_size;
    let pixel = |parts: &[u8]| match *parts {
        [gray] => [gray, gray, gray, 255],
        [gray, opacity] => [gray, gray, gray, opacity],
        [red, green, blue] => [red, green, blue, 255],
        [red, green, blue, opacity, ..] => [red, green, blue, opacity],
        [] => [0; 4],
    };
    let pixels = buffer.chunks_exact(row).take(height).flat_map(|row| row.chunks_exact(samples).take(width).map(pixel));
    Ok((width, height, pixels.collect()))
}

fn jpeg(bytes: &[u8]) -> Result<Decoded, PictureError> {
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(broken)?;
    let (width, height) = decoder.dimensions().ok_or_else(|| PictureError::new("the image has no size"))?;
    check_size(width, height)?;
    let pixels = decoder.decode().map_err(broken)?;
    Ok((width, height, pixels.chunks_exact(3).map(|parts| [parts[0], parts[1], parts[2], 255]).collect()))
}

fn webp(bytes: &[u8]) -> Result<Decoded, PictureError> {
    let mut decoder = image_webp::WebPDecoder::new(std::io::Cursor::new(bytes)).map_err(broken)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    check_size(width, height)?;
    let has_opacity = decoder.has_alpha();
    let size = decoder.output_buffer_size().ok_or_else(|| PictureError::new("the image is too large"))?;
    let mut buffer = vec![0; size];
    decoder.read_image(&mut buffer).map_err(broken)?;
    let pixels = match has_opacity {
        true => buffer.chunks_exact(4).map(|parts| [parts[0], parts[1], parts[2], parts[3]]).collect(),
        false => buffer.chunks_exact(3).map(|parts| [parts[0], parts[1], parts[2], 255]).collect(),
    };
    Ok((width, height, pixels))
}
