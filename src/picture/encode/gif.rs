//! GIF: one palette for all frames, and of each frame only what differs from the one before.

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::super::{Picture, error::PictureError};
use super::{
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
    /// What the last frame shows, in colors of the palette.
    before: Option<Vec<u8>>,
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

    /// A picture in colors of the palette.
    pub(in crate::picture) fn shown(&self, picture: &Picture) -> Vec<u8> {
        let nearest = |bucket: usize| *self.nearest[bucket].get_or_init(|| nearest(&self.colors, middle(bucket)));
        // Most pixels are as the one before.
        let mut last = ([0; 4], NOTHING);
        let color = |pixel: &[u8; 4]| {
            if *pixel != last.0 {
                last = (*pixel, if pixel[3] < 128 { NOTHING } else { nearest(bucket(*pixel)) });
            }
            last.1
        };
        picture.pixels.iter().map(color).collect()
    }
}

impl Writer {
    pub(super) fn new(size: [usize; 2], fps: f64, is_transparent: bool) -> Self {
        Self { size, fps, is_transparent, palette: Arc::new(Palette::empty()), frame: 0, before: None, encoder: None }
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
        self.add_shown(pictures.par_iter().map(|picture| self.palette.shown(picture)).collect())
    }

    /// Adds frames in colors of the palette: each is packed when it is known what the one before it shows.
    pub(super) fn add_shown(&mut self, shown: Vec<Vec<u8>>) -> Result<(), PictureError> {
        let count = shown.len();
        let frames: Vec<::gif::Frame<'_>> = if self.is_transparent {
            // None of them knows the one before it.
            let numbered = shown.into_par_iter().enumerate();
            numbered.map(|(index, shown)| self.packed(self.frame + index, shown).0).collect()
        } else {
            let mut frames = Vec::with_capacity(shown.len());
            for (index, shown) in shown.into_iter().enumerate() {
                let (frame, shown) = self.packed(self.frame + index, shown);
                frames.push(frame);
                self.before = Some(shown);
            }
            frames
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

    /// A frame of what differs from the one before, and all that is shown then. A pixel whose color is nearly that which it has already may stay,
    /// as what stays takes next to nothing; others may become a color that is nearly theirs. They never drift: each is compared with what is to be
    /// shown, not with what was.
    fn packed(&self, number: usize, wanted: Vec<u8>) -> (::gif::Frame<'static>, Vec<u8>) {
        let [width, height] = self.size;
        let before = self.before.as_deref();
        let stays = |at: usize| match before {
            Some(before) => self.palette.changing.of(before[at])[usize::from(wanted[at])] < Costs::TOO_MUCH,
            None => wanted[at] == NOTHING,
        };
        // Where the frame before is taken away, there is nothing around the figure already.
        let is_whole = before.is_none() && !self.is_transparent;
        let changed = if is_whole { Some([0, 0, width, height]) } else { moved(width, height, stays) };
        let [left, top, right, bottom] = changed.unwrap_or([0, 0, 1, 1]);
        let places = (top..bottom).flat_map(|row| row * width + left..row * width + right);
        let own: Vec<u8> = places.clone().map(|at| wanted[at]).collect();
        let mut pixels: Vec<u8> = places.clone().map(|at| if stays(at) { NOTHING } else { wanted[at] }).collect();
        // In place of what may stay, its new color or one that is near it will do as well.
        let Palette { changing, staying, .. } = &*self.palette;
        let buffer = lzw::pack(&mut pixels, |at, color| match color {
            NOTHING => staying.of(own[at]),
            _ => changing.of(color),
        });
        let mut shown = before.map_or_else(|| vec![NOTHING; width * height], <[u8]>::to_vec);
        for (at, color) in places.zip(pixels).filter(|(_, color)| *color != NOTHING) {
            shown[at] = color;
        }
        // In hundredths of a second; those of all frames add up to the exact length.
        let begins = |frame: usize| (frame as f64 * 100.0 / self.fps).round() as u64;
        let frame = ::gif::Frame {
            delay: u16::try_from(begins(number + 1) - begins(number)).unwrap_or(u16::MAX),
            dispose: if self.is_transparent { ::gif::DisposalMethod::Background } else { ::gif::DisposalMethod::Keep },
            transparent: Some(NOTHING),
            left: left as u16,
            top: top as u16,
            width: (right - left) as u16,
            height: (bottom - top) as u16,
            buffer: buffer.into(),
            ..::gif::Frame::default()
        };
        (frame, shown)
    }

    pub(super) fn finish(self) -> Result<Vec<u8>, PictureError> {
        let encoder = self.encoder.ok_or_else(|| PictureError::new("there are no frames"))?;
        encoder.into_inner().map_err(refused)
    }
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
        let wanted: Vec<Vec<u8>> = frames.iter().map(|frame| writer.palette.shown(frame)).collect();
        let mut shown = Vec::new();
        for (number, wanted) in wanted.iter().enumerate() {
            let (_, now) = writer.packed(number, wanted.clone());
            writer.before = Some(now.clone());
            shown.push(now);
        }
        let color = |index: u8| writer.palette.colors[usize::from(index)];
        for (shown, wanted) in shown.iter().zip(&wanted) {
            assert!(distance(color(shown[0]), color(wanted[0])) <= NEAR);
        }
        let changes = |frames: &[Vec<u8>]| frames.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(changes(&shown) < changes(&wanted), "{} changes of {}", changes(&shown), changes(&wanted));
    }
}
