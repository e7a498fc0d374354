//! The compression of GIF, where a pixel may be any of several colors: it becomes the one that makes the file smaller.

const CLEAR: u16 = 256;
const END: u16 = 257;
const FIRST: u16 = 258;
const CODES: usize = 4096;
const NONE: u16 = u16::MAX;

/// How far each color of a palette is from each other one; [`Distances::TOO_FAR`] where it cannot be shown instead.
pub(super) struct Distances(Vec<u16>);

impl Distances {
    pub(super) const TOO_FAR: u16 = u16::MAX;

    /// Of no colors.
    pub(super) const fn none() -> Self {
        Self(Vec::new())
    }

    /// As a function of two colors says.
    pub(super) fn new(distance: impl Fn(u8, u8) -> Option<u16>) -> Self {
        let all = (0..=u16::MAX).map(|pair| distance((pair >> 8) as u8, pair as u8).unwrap_or(Self::TOO_FAR));
        Self(all.collect())
    }

    #[inline]
    pub(super) fn between(&self, one: u8, other: u8) -> u16 {
        self.0[usize::from(one) << 8 | usize::from(other)]
    }
}

/// Strings of colors that were seen: each is one that is shorter and a color.
struct Strings {
    first_longer: Vec<u16>,
    next: Vec<u16>,
    color: Vec<u8>,
    count: u16,
}

impl Strings {
    fn new() -> Self {
        let color = (0..CODES).map(|code| code as u8).collect();
        Self { first_longer: vec![NONE; CODES], next: vec![NONE; CODES], color, count: FIRST }
    }

    fn clear(&mut self) {
        self.first_longer.fill(NONE);
        self.count = FIRST;
    }

    /// The string that is longer by a color that costs least; nothing where there is none that may be.
    #[inline]
    fn longer(&self, string: u16, cost: impl Fn(u8) -> u16) -> Option<u16> {
        let (mut best, mut least) = (None, Distances::TOO_FAR);
        let mut longer = self.first_longer[usize::from(string)];
        while longer != NONE {
            let cost = cost(self.color[usize::from(longer)]);
            if cost < least {
                (best, least) = (Some(longer), cost);
                if cost == 0 {
                    break;
                }
            }
            longer = self.next[usize::from(longer)];
        }
        best
    }

    fn add(&mut self, string: u16, color: u8) {
        let new = usize::from(self.count);
        self.color[new] = color;
        self.next[new] = self.first_longer[usize::from(string)];
        self.first_longer[usize::from(string)] = self.count;
        self.count += 1;
    }
}

/// Codes as bits, the lowest first.
struct Bits {
    bytes: Vec<u8>,
    waiting: u32,
    count: u32,
}

impl Bits {
    fn push(&mut self, code: u16, size: u32) {
        self.waiting |= u32::from(code) << self.count;
        self.count += size;
        while self.count >= 8 {
            self.bytes.push(self.waiting as u8);
            self.waiting >>= 8;
            self.count -= 8;
        }
    }

    fn finish(mut self) -> Vec<u8> {
        if self.count > 0 {
            self.bytes.push(self.waiting as u8);
        }
        self.bytes
    }
}

/// Packs pixels as GIF has them, the size of the smallest code first. `cost` says what it costs to show a color in place of a pixel's own, 0 for the
/// best of them; pixels become what is shown.
pub(super) fn pack(pixels: &mut [u8], cost: impl Fn(usize, u8, u8) -> u16) -> Vec<u8> {
    let mut bits = Bits { bytes: Vec::with_capacity(pixels.len() / 4 + 16), waiting: 0, count: 0 };
    bits.bytes.push(8);
    let (mut strings, mut size) = (Strings::new(), 9);
    bits.push(CLEAR, size);
    let mut string = NONE;
    for (at, pixel) in pixels.iter_mut().enumerate() {
        let own = *pixel;
        if string == NONE {
            string = u16::from(own);
            continue;
        }
        if let Some(longer) = strings.longer(string, |color| cost(at, own, color)) {
            *pixel = strings.color[usize::from(longer)];
            string = longer;
            continue;
        }
        bits.push(string, size);
        if usize::from(strings.count) < CODES {
            if u32::from(strings.count) == 1 << size {
                size += 1;
            }
            strings.add(string, own);
        } else {
            bits.push(CLEAR, size);
            strings.clear();
            size = 9;
        }
        string = u16::from(own);
    }
    if string != NONE {
        bits.push(string, size);
        // A reader adds a string here as everywhere.
        if u32::from(strings.count) == 1 << size && usize::from(strings.count) < CODES {
            size += 1;
        }
    }
    bits.push(END, size);
    bits.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a reader makes of a picture that consists of these bytes.
    fn read(width: usize, packed: Vec<u8>, count: usize) -> Vec<u8> {
        let palette: Vec<u8> = (0..=255).flat_map(|gray| [gray; 3]).collect();
        let mut encoder =
            ::gif::Encoder::new(Vec::new(), width as u16, (count / width) as u16, &palette).expect("a file");
        let (width, height) = (width as u16, (count / width) as u16);
        let frame = ::gif::Frame { width, height, buffer: packed.into(), ..::gif::Frame::default() };
        encoder.write_lzw_pre_encoded_frame(&frame).expect("a frame");
        let file = encoder.into_inner().expect("a file");
        let mut decoder = ::gif::DecodeOptions::new().read_info(&*file).expect("readable");
        decoder.read_next_frame().expect("readable").expect("a frame").buffer.to_vec()
    }

    /// Pixels in no order, so that all sizes of codes come, and the strings are forgotten several times.
    fn noise(count: usize, colors: u32) -> Vec<u8> {
        let mut state = 7_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 16) % colors) as u8
        };
        (0..count).map(|_| next()).collect()
    }

    #[test]
    fn every_reader_sees_what_was_packed() {
        for (count, colors) in [(64, 1), (64, 256), (510, 256), (512, 256), (768, 256), (64_000, 2), (64_000, 256)] {
            let pixels = noise(count, colors);
            let mut shown = pixels.clone();
            let packed = pack(&mut shown, |_, own, color| if own == color { 0 } else { Distances::TOO_FAR });
            assert_eq!(shown, pixels, "no other color may be shown");
            assert_eq!(read(2, packed, count), pixels, "{count} pixels of {colors} colors");
        }
    }

    #[test]
    fn near_colors_make_it_smaller() {
        let pixels = noise(64_000, 16);
        let distances = |most: u16| {
            Distances::new(move |one, other| Some(u16::from(one.abs_diff(other))).filter(|distance| *distance <= most))
        };
        let sizes = [0, 1, 2].map(|most| {
            let (distances, mut shown) = (distances(most), pixels.clone());
            let packed = pack(&mut shown, |_, own, color| distances.between(own, color));
            let worst = shown.iter().zip(&pixels).map(|(shown, own)| shown.abs_diff(*own)).max();
            assert!(worst.is_some_and(|worst| u16::from(worst) <= most), "{worst:?} where {most} may be");
            let count = packed.len();
            assert_eq!(read(2, packed, pixels.len()), shown, "what is said to be shown");
            count
        });
        assert!(sizes[1] * 10 < sizes[0] * 8 && sizes[2] < sizes[1], "{sizes:?}");
    }
}
