//! GIF: one palette for all frames, and of each frame only what differs from the one before.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::super::{Picture, error::PictureError};
use super::refused;

/// Colors are told apart by this many bits of red, green and blue each.
const BITS: u32 = 5;
const BUCKETS: usize = 1 << (3 * BITS);
/// Colors of the palette; one more is nothing.
const COLORS: usize = 255;
const NOTHING: u8 = 255;
/// Colors that differ by no more are shown as one where a pixel has the other already: gray by 5 of 255.
const NEAR: i32 = 250;

/// Frames of one moving picture.
pub(in crate::picture) struct Writer {
    size: [usize; 2],
    fps: f64,
    is_transparent: bool,
    palette: Vec<[u8; 3]>,
    /// The color of the palette that is nearest to each bucket, of those that have been asked for.
    nearest: Vec<OnceLock<u8>>,
    frame: usize,
    /// What the last frame shows, in colors of the palette.
    before: Option<Vec<u8>>,
    encoder: Option<::gif::Encoder<Vec<u8>>>,
}

impl Writer {
    pub(super) const fn new(size: [usize; 2], fps: f64, is_transparent: bool) -> Self {
        Self {
            size,
            fps,
            is_transparent,
            palette: Vec::new(),
            nearest: Vec::new(),
            frame: 0,
            before: None,
            encoder: None,
        }
    }

    /// The palette: by median cut over the colors of some frames.
    pub(super) fn learn(&mut self, pictures: &[Picture]) {
        let mut counts = vec![0_u32; BUCKETS];
        let mut sums = vec![[0_u64; 3]; BUCKETS];
        for pixel in pictures.iter().flat_map(|picture| &picture.pixels).filter(|pixel| pixel[3] >= 128) {
            let bucket = bucket(*pixel);
            counts[bucket] += 1;
            (0..3).for_each(|part| sums[bucket][part] += u64::from(pixel[part]));
        }
        let colors: Vec<(usize, u32)> = counts
            .iter()
            .enumerate()
            .filter(|(_, count)| **count > 0)
            .map(|(bucket, count)| (bucket, *count))
            .collect();
        self.palette = median_cut(colors).iter().map(|part| mean(part, &sums, &counts)).collect();
        self.palette.resize(COLORS, [0; 3]);
        self.nearest = (0..BUCKETS).map(|_| OnceLock::new()).collect();
    }

    /// Adds frames: each knows the one before it, so all are packed at the same time.
    pub(super) fn add(&mut self, pictures: &[Picture]) -> Result<(), PictureError> {
        let mut shown: Vec<Vec<u8>> = pictures.par_iter().map(|picture| self.in_palette(picture)).collect();
        if !self.is_transparent {
            self.keep_what_hardly_changes(&mut shown);
        }
        let before = |index: usize| match index.checked_sub(1) {
            Some(before) => shown.get(before),
            None => self.before.as_ref(),
        };
        let frames: Vec<::gif::Frame<'_>> = (0..shown.len())
            .into_par_iter()
            .map(|index| self.packed(self.frame + index, before(index).map(Vec::as_slice), &shown[index]))
            .collect();
        if self.encoder.is_none() {
            let mut palette = self.palette.as_flattened().to_vec();
            palette.extend_from_slice(&[0; 3]);
            let [width, height] = self.size.map(|side| side as u16);
            let mut encoder = ::gif::Encoder::new(Vec::new(), width, height, &palette).map_err(refused)?;
            encoder.set_repeat(::gif::Repeat::Infinite).map_err(refused)?;
            self.encoder = Some(encoder);
        }
        if let Some(encoder) = &mut self.encoder {
            frames.iter().try_for_each(|frame| encoder.write_lzw_pre_encoded_frame(frame)).map_err(refused)?;
        }
        self.frame += pictures.len();
        self.before = shown.into_iter().next_back().or_else(|| self.before.take());
        Ok(())
    }

    fn in_palette(&self, picture: &Picture) -> Vec<u8> {
        let nearest = |bucket: usize| *self.nearest[bucket].get_or_init(|| nearest(&self.palette, middle(bucket)));
        let color = |pixel: &[u8; 4]| if pixel[3] < 128 { NOTHING } else { nearest(bucket(*pixel)) };
        picture.pixels.iter().map(color).collect()
    }

    /// Pixels whose color is nearly that which they have already keep it, as what stays takes next to nothing. They never drift: each is
    /// compared with what is to be shown, not with what was.
    fn keep_what_hardly_changes(&self, shown: &mut [Vec<u8>]) {
        let is_near =
            |one: u8, other: u8| match (self.palette.get(usize::from(one)), self.palette.get(usize::from(other))) {
                (Some(one), Some(other)) => distance(*one, *other) <= NEAR,
                _ => false,
            };
        let near: Vec<bool> = (0..=u16::MAX).map(|pair| is_near((pair >> 8) as u8, pair as u8)).collect();
        for index in 0..shown.len() {
            let (done, rest) = shown.split_at_mut(index);
            let Some(before) = done.last().or(self.before.as_ref()) else { continue };
            for (now, before) in rest[0].iter_mut().zip(before) {
                if near[usize::from(*now) << 8 | usize::from(*before)] {
                    *now = *before;
                }
            }
        }
    }

    /// A frame of what differs from the one before.
    fn packed(&self, number: usize, before: Option<&[u8]>, shown: &[u8]) -> ::gif::Frame<'static> {
        let before = before.filter(|_| !self.is_transparent);
        let [width, height] = self.size;
        let [left, top, right, bottom] = match before {
            Some(before) => changed(before, shown, width).unwrap_or([0, 0, 1, 1]),
            None => [0, 0, width, height],
        };
        let mut indices = Vec::with_capacity((right - left) * (bottom - top));
        for row in top..bottom {
            let at = row * width + left..row * width + right;
            match before {
                Some(before) => {
                    let pairs = shown[at.clone()].iter().zip(&before[at]);
                    indices.extend(pairs.map(|(now, before)| if now == before { NOTHING } else { *now }));
                }
                None => indices.extend_from_slice(&shown[at]),
            }
        }
        // In hundredths of a second; those of all frames add up to the exact length.
        let begins = |frame: usize| (frame as f64 * 100.0 / self.fps).round() as u64;
        let mut frame = ::gif::Frame {
            delay: u16::try_from(begins(number + 1) - begins(number)).unwrap_or(u16::MAX),
            dispose: if self.is_transparent { ::gif::DisposalMethod::Background } else { ::gif::DisposalMethod::Keep },
            transparent: Some(NOTHING),
            left: left as u16,
            top: top as u16,
            width: (right - left) as u16,
            height: (bottom - top) as u16,
            buffer: indices.into(),
            ..::gif::Frame::default()
        };
        frame.make_lzw_pre_encoded();
        frame
    }

    pub(super) fn finish(self) -> Result<Vec<u8>, PictureError> {
        let encoder = self.encoder.ok_or_else(|| PictureError::new("there are no frames"))?;
        encoder.into_inner().map_err(refused)
    }
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
    let mut groups = vec![colors];
    groups.retain(|group| !group.is_empty());
    while groups.len() < COLORS {
        let worth = |group: &Counted| {
            let count: u64 = group.iter().map(|(_, count)| u64::from(*count)).sum();
            let (_, width) = widest(group);
            u64::from(width) * u64::from(width) * count.isqrt().max(1)
        };
        let Some((index, most)) =
            groups.iter().enumerate().map(|(index, group)| (index, worth(group))).max_by_key(|(_, most)| *most)
        else {
            break;
        };
        if most == 0 {
            break;
        }
        let mut group = groups.swap_remove(index);
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
        groups.extend([group, rest]);
    }
    groups
}

/// The part of a color in which a group is widest, and how wide.
fn widest(group: &Counted) -> (usize, u8) {
    let width = |part: usize| {
        let values = || group.iter().map(|(bucket, _)| middle(*bucket)[part]);
        values().max().unwrap_or(0) - values().min().unwrap_or(0)
    };
    [(1, width(1)), (0, width(0)), (2, width(2))].into_iter().max_by_key(|(_, width)| *width).unwrap_or((1, 0))
}

fn mean(group: &Counted, sums: &[[u64; 3]], counts: &[u32]) -> [u8; 3] {
    let count: u64 = group.iter().map(|(bucket, _)| u64::from(counts[*bucket])).sum();
    [0, 1, 2].map(|part: usize| {
        let sum: u64 = group.iter().map(|(bucket, _)| sums[*bucket][part]).sum();
        (sum / count.max(1)) as u8
    })
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
        writer.learn(&frames);
        let mut shown: Vec<Vec<u8>> = frames.iter().map(|frame| writer.in_palette(frame)).collect();
        let wanted = shown.clone();
        writer.keep_what_hardly_changes(&mut shown);
        let color = |index: u8| writer.palette[usize::from(index)];
        for (shown, wanted) in shown.iter().zip(&wanted) {
            assert!(distance(color(shown[0]), color(wanted[0])) <= NEAR);
        }
        let changes = |frames: &[Vec<u8>]| frames.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(changes(&shown) < changes(&wanted), "{} changes of {}", changes(&shown), changes(&wanted));
    }
}
