//! GIF: one palette for all frames, and of each frame only what differs from the one before.

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::super::{Picture, error::PictureError};
use super::{
    Area,
    lzw::{self, Costs},
    refused,
};

/// Colors are told apart by this many bits of red, green and blue each.
const BITS: u32 = 5;
const BUCKETS: usize = 1 << (3 * BITS);
/// Colors of the palette; one more is nothing.
const COLORS: usize = 255;
const NOTHING: u8 = 255;
/// Colors that differ by no more are shown as one where a pixel has the other already, or where that makes the file smaller: gray by 8.5 of 255.
const NEAR: i32 = 730;
/// Pixels that the palette is taken from.
const LEARNED: usize = 1 << 20;

/// The colors of all frames.
pub(in crate::picture) struct Palette {
    colors: Vec<[u8; 3]>,
    /// The color that is nearest to each bucket, of those that have been asked for.
    nearest: Vec<OnceLock<u8>>,
    /// Of what is shown in place of a color.
    changing: Costs,
    /// The same for a pixel that may stay as it is.
    staying: Costs,
}

/// Frames of one moving picture.
pub(in crate::picture) struct Writer {
    size: [usize; 2],
    fps: f64,
    is_transparent: bool,
    palette: Arc<Palette>,
    frame: usize,
    /// What is there where nothing is drawn, in colors of the palette; where that is not known, frames are whole.
    ground: Vec<u8>,
    /// What the last frame shows, in colors of the palette.
    before: Option<Vec<u8>>,
    /// Where that is not the ground.
    drawn: Area,
    encoder: Option<::gif::Encoder<Vec<u8>>>,
}

impl Palette {
    const fn empty() -> Self {
        Self { colors: Vec::new(), nearest: Vec::new(), changing: Costs::none(), staying: Costs::none() }
    }

    /// By median cut over the colors of some frames.
    pub(in crate::picture) fn of(pictures: &[Picture]) -> Self {
        let mut sums = vec![[0_u32; 4]; BUCKETS];
        let pixels: usize = pictures.iter().map(|picture| picture.pixels.len()).sum();
        // Not of every second column, as it would be with even steps.
        let step = pixels.div_ceil(LEARNED) | 1;
        for picture in pictures {
            for pixel in picture.pixels.iter().step_by(step).filter(|pixel| pixel[3] >= 128) {
                let sum = &mut sums[bucket(*pixel)];
                (0..3).for_each(|part| sum[part] += u32::from(pixel[part]));
                sum[3] += 1;
            }
        }
        let colors: Counted =
            sums.iter().enumerate().filter(|(_, sum)| sum[3] > 0).map(|(bucket, sum)| (bucket, sum[3])).collect();
        let mut palette: Vec<[u8; 3]> = median_cut(colors).iter().map(|part| mean(part, &sums)).collect();
        palette.resize(COLORS, [0; 3]);
        let near = |wanted: u8, shown: u8| {
            let [wanted, shown] = [wanted, shown].map(|color| palette.get(usize::from(color)));
            let distance = distance(*wanted?, *shown?);
            u16::try_from(distance + 1).ok().filter(|_| distance <= NEAR)
        };
        Self {
            changing: Costs::new(|wanted, shown| if shown == wanted { Some(0) } else { near(wanted, shown) }),
            staying: Costs::new(|wanted, shown| if shown == NOTHING { Some(0) } else { near(wanted, shown) }),
            nearest: (0..BUCKETS).map(|_| OnceLock::new()).collect(),
            colors: palette,
        }
    }

    /// An area of a picture in colors of the palette.
    pub(in crate::picture) fn patch(&self, picture: &Picture, area: Area) -> Patch {
        let nearest = |bucket: usize| *self.nearest[bucket].get_or_init(|| nearest(&self.colors, middle(bucket)));
        // Most pixels are as the one before.
        let mut last = ([0; 4], NOTHING);
        let [left, top, right, bottom] = area;
        let mut colors = Vec::with_capacity((right - left) * (bottom - top));
        for row in top..bottom {
            colors.extend(picture.pixels[row * picture.width..][left..right].iter().map(|pixel| {
                if *pixel != last.0 {
                    last = (*pixel, if pixel[3] < 128 { NOTHING } else { nearest(bucket(*pixel)) });
                }
                last.1
            }));
        }
        Patch { area, colors }
    }
}

/// An area of a picture in colors of the palette.
pub(in crate::picture) struct Patch {
    area: Area,
    colors: Vec<u8>,
}

impl Patch {
    /// What of it is not nothing; one pixel where there is none.
    fn trimmed(self) -> Self {
        let [left, top, right, bottom] = self.area;
        let width = right - left;
        let Some([first, high, last, low]) = moved(width, bottom - top, |at| self.colors[at] == NOTHING) else {
            return Self { area: [0, 0, 1, 1], colors: vec![NOTHING] };
        };
        let rows = (high..low).flat_map(|row| &self.colors[row * width..][first..last]);
        Self { area: [left + first, top + high, left + last, top + low], colors: rows.copied().collect() }
    }
}

impl Writer {
    pub(super) fn new(size: [usize; 2], fps: f64, is_transparent: bool) -> Self {
        let palette = Arc::new(Palette::empty());
        let drawn = [0, 0, size[0], size[1]];
        Self { size, fps, is_transparent, palette, frame: 0, ground: Vec::new(), before: None, drawn, encoder: None }
    }

    /// Begins on a ground. Says whether frames need not be whole.
    pub(super) fn begin_on(&mut self, ground: &Picture) -> bool {
        self.ground = self.palette.patch(ground, [0, 0, self.size[0], self.size[1]]).colors;
        // Where the frame before is taken away, so is the ground.
        !self.is_transparent || self.ground.iter().all(|color| *color == NOTHING)
    }

    /// The colors of all frames.
    pub(super) fn palette(&self) -> Arc<Palette> {
        Arc::clone(&self.palette)
    }

    /// Shows all frames in these colors.
    pub(super) fn use_palette(&mut self, palette: Arc<Palette>) {
        self.palette = palette;
    }

    /// Adds frames: their colors are looked up at the same time.
    pub(super) fn add(&mut self, pictures: &[Picture]) -> Result<(), PictureError> {
        let whole = [0, 0, self.size[0], self.size[1]];
        self.add_patches(pictures.par_iter().map(|picture| self.palette.patch(picture, whole)).collect())
    }

    /// Adds frames in colors of the palette: each is packed when it is known what the one before it shows.
    pub(super) fn add_patches(&mut self, patches: Vec<Patch>) -> Result<(), PictureError> {
        let count = patches.len();
        let frames: Vec<::gif::Frame<'_>> = if self.is_transparent {
            // None of them knows the one before it.
            let numbered = patches.into_par_iter().enumerate();
            numbered.map(|(index, patch)| self.packed_alone(self.frame + index, patch)).collect()
        } else {
            let numbered = patches.into_iter().enumerate();
            numbered.map(|(index, patch)| self.packed(self.frame + index, &patch)).collect()
        };
        if self.encoder.is_none() {
            let mut palette = self.palette.colors.as_flattened().to_vec();
            palette.extend_from_slice(&[0; 3]);
            let [width, height] = self.size.map(|side| side as u16);
            let mut encoder = ::gif::Encoder::new(Vec::new(), width, height, &palette).map_err(refused)?;
            encoder.set_repeat(::gif::Repeat::Infinite).map_err(refused)?;
            self.encoder = Some(encoder);
        }
        if let Some(encoder) = &mut self.encoder {
            frames.iter().try_for_each(|frame| encoder.write_lzw_pre_encoded_frame(frame)).map_err(refused)?;
        }
        self.frame += count;
        Ok(())
    }

    /// A frame of all that is not nothing: the frame before is taken away.
    fn packed_alone(&self, number: usize, patch: Patch) -> ::gif::Frame<'static> {
        let Patch { area, mut colors } = patch.trimmed();
        let buffer = lzw::pack(&mut colors, |_, color| self.palette.changing.of(color));
        self.framed(number, area, buffer)
    }

    /// A frame of what differs from the one before. A pixel whose color is nearly that which it has already may stay,
    /// as what stays takes next to nothing; others may become a color that is nearly theirs. They never drift: each is compared with what is to be
    /// shown, not with what was.
    fn packed(&mut self, number: usize, patch: &Patch) -> ::gif::Frame<'static> {
        let [width, height] = self.size;
        // Outside of what is drawn now or was drawn before, the ground stays.
        let area = match &self.before {
            Some(_) => around(self.drawn, patch.area),
            None => [0, 0, width, height],
        };
        let is_empty = area[0] >= area[2] || area[1] >= area[3];
        let area = if is_empty { [0, 0, 1, 1] } else { area };
        self.drawn = patch.area;
        let mut wanted = cut(&self.ground, width, area);
        let across = patch.area[2] - patch.area[0];
        for (row, colors) in patch.colors.chunks(across.max(1)).enumerate() {
            let at = (patch.area[1] + row - area[1]) * (area[2] - area[0]) + patch.area[0] - area[0];
            wanted[at..at + across].copy_from_slice(colors);
        }
        let Palette { changing, staying, .. } = &*self.palette;
        let (inside, own, mut pixels) = match &self.before {
            None => (area, wanted.clone(), wanted),
            Some(before) => {
                let before = cut(before, width, area);
                let stays = |at: usize| changing.of(before[at])[usize::from(wanted[at])] < Costs::TOO_MUCH;
                let across = area[2] - area[0];
                let inside = moved(across, area[3] - area[1], stays).unwrap_or([0, 0, 1, 1]);
                let own = cut(&wanted, across, inside);
                let places = (inside[1]..inside[3]).flat_map(|row| row * across + inside[0]..row * across + inside[2]);
                let pixels = places.zip(&own).map(|(at, own)| if stays(at) { NOTHING } else { *own }).collect();
                ([area[0] + inside[0], area[1] + inside[1], area[0] + inside[2], area[1] + inside[3]], own, pixels)
            }
        };
        // In place of what may stay, its new color or one that is near it will do as well.
        let buffer = lzw::pack(&mut pixels, |at, color| match color {
            NOTHING => staying.of(own[at]),
            _ => changing.of(color),
        });
        let shown = self.before.get_or_insert_with(|| vec![NOTHING; width * height]);
        for (row, colors) in (inside[1]..inside[3]).zip(pixels.chunks(inside[2] - inside[0])) {
            let row = &mut shown[row * width..][inside[0]..inside[2]];
            row.iter_mut()
                .zip(colors)
                .filter(|(_, color)| **color != NOTHING)
                .for_each(|(shown, color)| *shown = *color);
        }
        self.framed(number, inside, buffer)
    }

    /// Packed pixels as a frame.
    fn framed(&self, number: usize, [left, top, right, bottom]: Area, buffer: Vec<u8>) -> ::gif::Frame<'static> {
        // In hundredths of a second; those of all frames add up to the exact length.
        let begins = |frame: usize| (frame as f64 * 100.0 / self.fps).round() as u64;
        ::gif::Frame {
            delay: u16::try_from(begins(number + 1) - begins(number)).unwrap_or(u16::MAX),
            dispose: if self.is_transparent { ::gif::DisposalMethod::Background } else { ::gif::DisposalMethod::Keep },
            transparent: Some(NOTHING),
            left: left as u16,
            top: top as u16,
            width: (right - left) as u16,
            height: (bottom - top) as u16,
            buffer: buffer.into(),
            ..::gif::Frame::default()
        }
    }

    pub(super) fn finish(self) -> Result<Vec<u8>, PictureError> {
        let encoder = self.encoder.ok_or_else(|| PictureError::new("there are no frames"))?;
        encoder.into_inner().map_err(refused)
    }
}

/// The smallest area with two in it.
fn around(one: Area, other: Area) -> Area {
    [one[0].min(other[0]), one[1].min(other[1]), one[2].max(other[2]), one[3].max(other[3])]
}

/// An area of a picture of that width; nothing of it where there is no picture.
fn cut(pixels: &[u8], width: usize, [left, top, right, bottom]: Area) -> Vec<u8> {
    if pixels.is_empty() {
        return vec![NOTHING; (right - left) * (bottom - top)];
    }
    (top..bottom).flat_map(|row| &pixels[row * width..][left..right]).copied().collect()
}

/// The smallest rectangle outside of which all pixels stay as they are: left, top, right and bottom; nothing where all do.
fn moved(width: usize, height: usize, stays: impl Fn(usize) -> bool) -> Option<[usize; 4]> {
    let mut found: Option<[usize; 4]> = None;
    for row in 0..height {
        let moves = |column: &usize| !stays(row * width + column);
        let Some(first) = (0..width).find(moves) else { continue };
        let last = (first..width).rfind(moves).unwrap_or(first) + 1;
        let [left, top, right, _] = found.unwrap_or([first, row, last, row]);
        found = Some([left.min(first), top, right.max(last), row + 1]);
    }
    found
}

/// The smallest rectangle in which two pictures differ: left, top, right and bottom; nothing where they are the same.
pub(super) fn changed<P: PartialEq>(before: &[P], now: &[P], width: usize) -> Option<[usize; 4]> {
    let height = now.len() / width.max(1);
    let rows = |row: usize| &now[row * width..][..width];
    let rows_before = |row: usize| &before[row * width..][..width];
    let differs = |row: &usize| rows(*row) != rows_before(*row);
    let top = (0..height).find(differs)?;
    let bottom = (top..height).rfind(differs)? + 1;
    let (mut left, mut right) = (width, 0);
    for row in top..bottom {
        let pairs = || rows(row).iter().zip(rows_before(row));
        if let Some(first) = pairs().position(|(one, other)| one != other) {
            left = left.min(first);
            let last = pairs().rposition(|(one, other)| one != other).unwrap_or(first);
            right = right.max(last + 1);
        }
    }
    Some([left, top, right, bottom])
}

fn bucket(pixel: [u8; 4]) -> usize {
    let part = |part: u8| usize::from(part) >> (8 - BITS);
    part(pixel[0]) << (2 * BITS) | part(pixel[1]) << BITS | part(pixel[2])
}

/// The middle of a bucket.
fn middle(bucket: usize) -> [u8; 3] {
    let part = |shift: u32| ((bucket >> shift & ((1 << BITS) - 1)) << (8 - BITS)) as u8 + (1 << (7 - BITS));
    [part(2 * BITS), part(BITS), part(0)]
}

type Counted = Vec<(usize, u32)>;

/// Buckets in as many groups as there are colors, halved where they are widest and fullest.
fn median_cut(colors: Counted) -> Vec<Counted> {
    let worth = |group: Counted| {
        let count: u64 = group.iter().map(|(_, count)| u64::from(*count)).sum();
        let (_, width) = widest(&group);
        // Colors of buckets beside one another may as well be one: bands of them are packed better than finer ones.
        let width = if width <= 1 << (8 - BITS) { 0 } else { u64::from(width) };
        (width * width * count.isqrt().max(1), group)
    };
    let mut groups = vec![worth(colors)];
    groups.retain(|(_, group)| !group.is_empty());
    while groups.len() < COLORS {
        let most = groups.iter().enumerate().max_by_key(|(_, (worth, _))| *worth);
        let Some((index, _)) = most.filter(|(_, (worth, _))| *worth > 0) else { break };
        let (_, mut group) = groups.swap_remove(index);
        let (part, _) = widest(&group);
        group.sort_by_key(|(bucket, _)| (middle(*bucket)[part], *bucket));
        let half: u64 = group.iter().map(|(_, count)| u64::from(*count)).sum::<u64>() / 2;
        let mut sum = 0;
        let at = group.iter().position(|(_, count)| {
            sum += u64::from(*count);
            sum > half
        });
        let at = at.unwrap_or(1).clamp(1, group.len() - 1);
        let rest = group.split_off(at);
        groups.extend([worth(group), worth(rest)]);
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// The part of a color in which a group is widest, and how wide.
fn widest(group: &Counted) -> (usize, u8) {
    let width = |part: usize| {
        let values = || group.iter().map(|(bucket, _)| middle(*bucket)[part]);
        values().max().unwrap_or(0) - values().min().unwrap_or(0)
    };
    [(1, width(1)), (0, width(0)), (2, width(2))].into_iter().max_by_key(|(_, width)| *width).unwrap_or((1, 0))
}

fn mean(group: &Counted, sums: &[[u32; 4]]) -> [u8; 3] {
    let sum = |part: usize| group.iter().map(|(bucket, _)| u64::from(sums[*bucket][part])).sum::<u64>();
    [0, 1, 2].map(|part| (sum(part) / sum(3).max(1)) as u8)
}

/// How different two colors look: the weighted sum of the squares of what their parts differ by.
fn distance(one: [u8; 3], other: [u8; 3]) -> i32 {
    let weights = [3, 6, 1];
    (0..3).map(|part| weights[part] * (i32::from(one[part]) - i32::from(other[part])).pow(2)).sum()
}

fn nearest(palette: &[[u8; 3]], color: [u8; 3]) -> u8 {
    palette.iter().enumerate().min_by_key(|(_, other)| distance(**other, color)).map_or(0, |(index, _)| index as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_hardly_changes_stays_and_never_drifts() {
        // A blue that rises with each frame: each is near the one before, and the last is far from the first.
        let frames: Vec<Picture> =
            (0..12).map(|frame| Picture::filled(4, 4, [100, 100, 100 + 8 * frame, 255])).collect();
        let mut writer = Writer::new([4, 4], 10.0, false);
        writer.use_palette(Arc::new(Palette::of(&frames)));
        let whole = [0, 0, 4, 4];
        let wanted: Vec<Vec<u8>> = frames.iter().map(|frame| writer.palette.patch(frame, whole).colors).collect();
        let mut shown = Vec::new();
        for (number, wanted) in wanted.iter().enumerate() {
            writer.packed(number, &Patch { area: whole, colors: wanted.clone() });
            shown.push(writer.before.clone().expect("what is shown"));
        }
        let color = |index: u8| writer.palette.colors[usize::from(index)];
        for (shown, wanted) in shown.iter().zip(&wanted) {
            assert!(distance(color(shown[0]), color(wanted[0])) <= NEAR);
        }
        let changes = |frames: &[Vec<u8>]| frames.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(changes(&shown) < changes(&wanted), "{} changes of {}", changes(&shown), changes(&wanted));
    }
}
