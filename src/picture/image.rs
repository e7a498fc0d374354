//! PNG, JPEG and WebP files to pixels, within a bound on memory: an image that is made smaller is so as it is decoded, row by row where
//! its format allows.

use zune_jpeg::zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions};

use super::{Picture, PictureFormat, error::PictureError, orientation::Orientation};

/// Pixels of an image that is decoded row by row.
const MAX_PIXELS: usize = 1 << 28;
/// Pixels of an image that its decoder holds as a whole: JPEG, WebP, interlaced PNG, and what is wanted in its own size.
const MAX_PIXELS_AT_ONCE: usize = 1 << 25;

/// The longest side of a texture where there are few of them.
const MAX_SIDE: usize = 1024;
/// No texture is made smaller than that.
const MIN_SIDE: usize = 64;
/// Pixels of all textures of a figure together, as far as [`MIN_SIDE`] allows.
const MAX_PIXELS_OF_ALL: usize = 16 << 20;

/// The longest side that each of `count` textures may have, so that all of them together stay small. They are made smaller by whole factors.
pub(super) fn longest_side(count: usize) -> usize {
    let share = (MAX_PIXELS_OF_ALL / count.max(1)).isqrt();
    share.clamp(MIN_SIDE, MAX_SIDE)
}

/// A decoded image: sRGB and opacity, row by row from the top.
pub(super) struct Pixels {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<[u8; 4]>,
    /// Its own width and height.
    pub(super) whole: [usize; 2],
    /// What its camera says of how it was held, as of Exif.
    pub(super) orientation: Orientation,
}

/// Reads a PNG, a JPEG or a WebP in its own size.
///
/// # Errors
/// Where it is none of them, is broken, or has more than 33 million pixels.
pub fn read_picture(bytes: &[u8]) -> Result<Picture, PictureError> {
    let Pixels { width, height, pixels, .. } = decode(bytes, None)?;
    Ok(Picture { width, height, pixels })
}

/// An image as every viewer reads it: PNG or JPEG, and no side longer than its share of what `count` images may have, 1,024 pixels at most.
/// One that is so already stays as it is.
///
/// # Errors
/// Where it cannot be read.
pub fn plain_image(bytes: Vec<u8>, count: usize) -> Result<Vec<u8>, PictureError> {
    let longest_side = longest_side(count);
    let Pixels { width, height, pixels, .. } = decode(&bytes, Some(longest_side))?;
    let is_plain = matches!(bytes[..], [0x89, ..] | [0xff, ..]);
    if is_plain && own_size(&bytes) == Some((width, height)) {
        return Ok(bytes);
    }
    PictureFormat::Png.still(&Picture { width, height, pixels })
}

/// The size of a PNG or JPEG in pixels.
fn own_size(bytes: &[u8]) -> Option<(usize, usize)> {
    if let [0x89, ..] = bytes {
        let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().ok()?;
        return Some((reader.info().width as usize, reader.info().height as usize));
    }
    let mut decoder = zune_jpeg::JpegDecoder::new(ZCursor::new(bytes));
    decoder.decode_headers().ok()?;
    decoder.dimensions()
}

/// A picture as a person sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Upright {
    /// The pixels, turned as the camera was held, perhaps made smaller.
    pub picture: Picture,
    /// Width and height of the picture as it was given, turned.
    pub size: [usize; 2],
}

/// Reads a PNG, a JPEG or a WebP and turns it as its camera says that it was held; made smaller by a whole factor until neither side is
/// longer than that.
///
/// # Errors
/// Where it is none of them, is broken, or is too large.
pub fn read_upright(bytes: &[u8], longest_side: usize) -> Result<Upright, PictureError> {
    let Pixels { width, height, pixels, whole: [wide, high], orientation } = decode(bytes, Some(longest_side))?;
    let picture = orientation.upright(Picture { width, height, pixels });
    let size = if orientation.is_on_side() { [high, wide] } else { [wide, high] };
    Ok(Upright { picture, size })
}

/// Reads an image; where a longest side is given, made smaller by a whole factor until neither side is longer.
pub(super) fn decode(bytes: &[u8], longest_side: Option<usize>) -> Result<Pixels, PictureError> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => png(bytes, longest_side),
        [0xff, 0xd8, ..] => jpeg(bytes, longest_side),
        [b'R', b'I', b'F', b'F', ..] => webp(bytes, longest_side),
        [b'G', b'I', b'F', b'8', ..] => gif(bytes, longest_side),
        _ => Err(PictureError::new("the image is neither PNG, JPEG, WebP nor GIF")),
    }
}

fn broken(error: impl std::fmt::Display) -> PictureError {
    PictureError::new(format!("the image cannot be decoded: {error}"))
}

fn too_large(width: usize, height: usize, most: usize) -> PictureError {
    PictureError::new(format!("an image of {width} by {height} pixels is larger than the {most} pixels that are read"))
}

fn check_size(width: usize, height: usize, most: usize) -> Result<(), PictureError> {
    let pixels = width.checked_mul(height).filter(|pixels| (1..=most).contains(pixels));
    pixels.map(|_| ()).ok_or_else(|| too_large(width, height, most))
}

/// An image that is made smaller while its rows come: the mean of squares of so many pixels.
struct Shrinking {
    /// Of the image as it comes.
    width: usize,
    height: usize,
    /// Pixels on one side of a square.
    factor: usize,
    /// Red, green, blue and opacity of the squares that are being filled, and how many pixels each has.
    sums: Vec<[u32; 5]>,
    rows: usize,
    pixels: Vec<[u8; 4]>,
}

impl Shrinking {
    fn new(width: usize, height: usize, longest_side: Option<usize>) -> Self {
        let factor = longest_side.map_or(1, |side| width.max(height).div_ceil(side.max(1))).max(1);
        let size = [width.div_ceil(factor), height.div_ceil(factor)];
        let pixels = Vec::with_capacity(size[0] * size[1]);
        Self { width, height, factor, sums: vec![[0; 5]; size[0]], rows: 0, pixels }
    }

    /// Takes the next row: as many samples a pixel as that, of one byte each.
    fn row(&mut self, samples: &[u8], samples_per_pixel: usize) {
        if self.rows == self.height {
            return;
        }
        let row = samples.chunks_exact(samples_per_pixel).take(self.width).map(pixel);
        self.rows += 1;
        if self.factor == 1 {
            return self.pixels.extend(row);
        }
        for (column, pixel) in row.enumerate() {
            let sum = &mut self.sums[column / self.factor];
            sum.iter_mut().zip(pixel).for_each(|(sum, part)| *sum += u32::from(part));
            sum[4] += 1;
        }
        if self.rows.is_multiple_of(self.factor) || self.rows == self.height {
            let mean = |sum: &[u32; 5]| [0, 1, 2, 3].map(|part: usize| (sum[part] / sum[4].max(1)) as u8);
            self.pixels.extend(self.sums.iter().map(mean));
            self.sums.fill([0; 5]);
        }
    }

    /// All rows of an image that is there as a whole.
    fn rows(mut self, bytes: &[u8], samples_per_pixel: usize) -> Pixels {
        bytes.chunks_exact(self.width * samples_per_pixel).for_each(|row| self.row(row, samples_per_pixel));
        self.finish()
    }

    /// The image; rows that did not come are black.
    fn finish(mut self) -> Pixels {
        let (width, height) = (self.width.div_ceil(self.factor), self.height.div_ceil(self.factor));
        self.pixels.resize(width * height, [0, 0, 0, 255]);
        let whole = [self.width, self.height];
        Pixels { width, height, pixels: self.pixels, whole, orientation: Orientation::default() }
    }
}

/// Gray, gray with opacity, colors, or colors with opacity.
fn pixel(samples: &[u8]) -> [u8; 4] {
    match *samples {
        [gray] => [gray, gray, gray, 255],
        [gray, opacity] => [gray, gray, gray, opacity],
        [red, green, blue] => [red, green, blue, 255],
        [red, green, blue, opacity, ..] => [red, green, blue, opacity],
        [] => [0; 4],
    }
}

fn png(bytes: &[u8], longest_side: Option<usize>) -> Result<Pixels, PictureError> {
    let limits = png::Limits { bytes: MAX_PIXELS_AT_ONCE * 4 };
    let mut decoder = png::Decoder::new_with_limits(std::io::Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(broken)?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let by_rows = longest_side.is_some() && !reader.info().interlaced;
    check_size(width, height, if by_rows { MAX_PIXELS } else { MAX_PIXELS_AT_ONCE })?;
    let samples = reader.output_color_type().0.samples();
    let mut shrinking = Shrinking::new(width, height, longest_side);
    let orientation = Orientation::of_exif(reader.info().exif_metadata.as_deref());
    if by_rows {
        while let Some(row) = reader.next_row().map_err(broken)? {
            shrinking.row(row.data(), samples);
        }
        return Ok(Pixels { orientation, ..shrinking.finish() });
    }
    let size = reader.output_buffer_size().ok_or_else(|| too_large(width, height, MAX_PIXELS_AT_ONCE))?;
    let mut buffer = vec![0; size];
    reader.next_frame(&mut buffer).map_err(broken)?;
    Ok(Pixels { orientation, ..shrinking.rows(&buffer, samples) })
}

fn jpeg(bytes: &[u8], longest_side: Option<usize>) -> Result<Pixels, PictureError> {
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(broken)?;
    let (width, height) = decoder.dimensions().ok_or_else(|| PictureError::new("the image has no size"))?;
    check_size(width, height, MAX_PIXELS_AT_ONCE)?;
    let orientation = Orientation::of_exif(decoder.exif().map(Vec::as_slice));
    let pixels = Shrinking::new(width, height, longest_side).rows(&decoder.decode().map_err(broken)?, 3);
    Ok(Pixels { orientation, ..pixels })
}

fn webp(bytes: &[u8], longest_side: Option<usize>) -> Result<Pixels, PictureError> {
    let mut decoder = image_webp::WebPDecoder::new(std::io::Cursor::new(bytes)).map_err(broken)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    check_size(width, height, MAX_PIXELS_AT_ONCE)?;
    decoder.set_memory_limit(MAX_PIXELS_AT_ONCE * 8);
    let size = decoder.output_buffer_size().ok_or_else(|| too_large(width, height, MAX_PIXELS_AT_ONCE))?;
    // A block that cannot be read says nothing.
    let orientation = Orientation::of_exif(decoder.exif_metadata().ok().flatten().as_deref());
    let samples = if decoder.has_alpha() { 4 } else { 3 };
    let mut buffer = vec![0; size];
    decoder.read_image(&mut buffer).map_err(broken)?;
    let pixels = Shrinking::new(width, height, longest_side).rows(&buffer, samples);
    Ok(Pixels { orientation, ..pixels })
}

/// The first frame of a GIF.
fn gif(bytes: &[u8], longest_side: Option<usize>) -> Result<Pixels, PictureError> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).map_err(broken)?;
    let (width, height) = (usize::from(decoder.width()), usize::from(decoder.height()));
    check_size(width, height, MAX_PIXELS_AT_ONCE)?;
    let frame =
        decoder.read_next_frame().map_err(broken)?.ok_or_else(|| PictureError::new("the image has no frame"))?;
    let (left, top) = (usize::from(frame.left), usize::from(frame.top));
    let mut buffer = vec![0; width * height * 4];
    let rows = frame.buffer.chunks_exact(usize::from(frame.width).max(1) * 4);
    for (row, pixels) in rows.enumerate().take(height.saturating_sub(top)) {
        let count = (pixels.len() / 4).min(width.saturating_sub(left));
        buffer[((top + row) * width + left) * 4..][..count * 4].copy_from_slice(&pixels[..count * 4]);
    }
    Ok(Shrinking::new(width, height, longest_side).rows(&buffer, 4))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A PNG whose pixels tell where they are, or all of one gray.
    fn png_of(width: usize, height: usize, gray: Option<u8>) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_compression(png::Compression::Fast);
        let mut writer = encoder.write_header().expect("a header");
        let mut stream = writer.stream_writer().expect("a stream");
        for row in 0..height {
            let line: Vec<u8> = (0..width).map(|column| gray.unwrap_or((row * 10 + column) as u8)).collect();
            std::io::Write::write_all(&mut stream, &line).expect("a row");
        }
        stream.finish().expect("an end");
        writer.finish().expect("an end");
        bytes
    }

    #[test]
    fn an_image_is_made_smaller_by_the_mean_of_squares() {
        let bytes = png_of(5, 3, None);
        let whole = decode(&bytes, Some(5)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((whole.width, whole.height, whole.pixels[6]), (5, 3, [11, 11, 11, 255]), "as it is");
        let half = decode(&bytes, Some(3)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((half.width, half.height), (3, 2), "half, rounded up");
        let grays: Vec<u8> = half.pixels.iter().map(|pixel| pixel[0]).collect();
        // (0 + 1 + 10 + 11) / 4, ..., and at the edges of what is there.
        assert_eq!(grays, [5, 7, 9, 20, 22, 24], "means, rounded down");
    }

    /// A small PNG whose header tells another size.
    fn png_that_claims(width: u32, height: u32) -> Vec<u8> {
        const SIGNATURE_AND_LENGTH: usize = 12;
        let mut bytes = png_of(4, 4, Some(7));
        let header = SIGNATURE_AND_LENGTH..SIGNATURE_AND_LENGTH + 17;
        bytes[header.start + 4..][..4].copy_from_slice(&width.to_be_bytes());
        bytes[header.start + 8..][..4].copy_from_slice(&height.to_be_bytes());
        let mut sum = flate2::Crc::new();
        sum.update(&bytes[header.clone()]);
        bytes[header.end..][..4].copy_from_slice(&sum.sum().to_be_bytes());
        bytes
    }

    #[test]
    fn large_images_take_little_memory_and_larger_ones_are_refused() {
        let wide = decode(&png_of(2048, 1500, Some(7)), Some(64)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((wide.width, wide.height, wide.pixels[100][0]), (64, 47, 7), "row by row");
        assert!(wide.pixels.capacity() <= 64 * 64, "never there as a whole: {}", wide.pixels.capacity());
        let refused = |width, height, side| {
            decode(&png_that_claims(width, height), side).err().map(|error| error.to_string()).unwrap_or_default()
        };
        assert!(refused(16_384, 16_384, Some(64)).contains("cannot be decoded"), "as large as may be, and broken");
        assert!(refused(16_385, 16_384, Some(64)).contains("16385 by 16384"), "too large, and by how much");
        assert!(refused(8193, 4096, None).contains("33554432"), "in its own size it would be there as a whole");
    }
}
