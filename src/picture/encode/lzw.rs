//! The compression of GIF, where a pixel may be any of several colors: it becomes the one that makes the file smaller.

const CLEAR: u16 = 256;
const END: u16 = 257;
const FIRST: u16 = 258;
const CODES: usize = 4096;
const NONE: u16 = u16::MAX;

/// What it costs to show a color in place of another one, 0 for the best; [`Costs::TOO_MUCH`] where it cannot be shown.
pub(super) struct Costs(Vec<[u16; 256]>);

impl Costs {
    pub(super) const TOO_MUCH: u16 = u16::MAX;

    /// Of no colors.
    pub(super) const fn none() -> Self {
        Self(Vec::new())
    }

    /// As a function of the wanted color and of the one that is shown says.
    pub(super) fn new(cost: impl Fn(u8, u8) -> Option<u16>) -> Self {
        let row = |wanted| std::array::from_fn(|shown| cost(wanted, shown as u8).unwrap_or(Self::TOO_MUCH));
        Self((0..=u8::MAX).map(row).collect())
    }

    /// Where a color is wanted, by the one that is shown.
    #[inline]
    pub(super) fn of(&self, wanted: u8) -> &[u16; 256] {
        &self.0[usize::from(wanted)]
    }
}

/// A string of colors that was seen: one that is shorter and a color.
#[derive(Clone, Copy)]
struct Seen {
    /// The latest string that is longer by one color.
    first_longer: u16,
    /// The one before this that is longer than the same by one color.
    next: u16,
    color: u8,
}

struct Strings {
    seen: Vec<Seen>,
    count: u16,
}

impl Strings {
    fn new() -> Self {
        let seen = |code| Seen { first_longer: NONE, next: NONE, color: code as u8 };
        Self { seen: (0..CODES).map(seen).collect(), count: FIRST }
    }

    fn clear(&mut self) {
        self.seen.iter_mut().for_each(|seen| seen.first_longer = NONE);
        self.count = FIRST;
    }

    /// The string that is longer by a color that costs least, and that color; nothing where there is none that may be.
    #[inline]
    fn longer(&self, string: u16, costs: &[u16; 256]) -> Option<(u16, u8)> {
        let (mut best, mut least) = (None, Costs::TOO_MUCH);
        let mut code = self.seen[usize::from(string)].first_longer;
        while let Some(seen) = self.seen.get(usize::from(code)) {
            let cost = costs[usize::from(seen.color)];
            if cost < least {
                (best, least) = (Some((code, seen.color)), cost);
                if cost == 0 {
                    break;
                }
            }
            code = seen.next;
        }
        best
    }

    fn add(&mut self, string: u16, color: u8) {
        let shorter = &mut self.seen[usize::from(string)];
        let next = std::mem::replace(&mut shorter.first_longer, self.count);
        self.seen[usize::from(self.count)] = Seen { first_longer: NONE, next, color };
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

/// Packs pixels as GIF has them, the size of the smallest code first. `costs` gives those of a pixel by its place and its own color; pixels become
/// what is shown.
pub(super) fn pack<'a>(pixels: &mut [u8], costs: impl Fn(usize, u8) -> &'a [u16; 256]) -> Vec<u8> {
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
        if let Some((longer, color)) = strings.longer(string, costs(at, own)) {
            (*pixel, string) = (color, longer);
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
            let exact = Costs::new(|wanted, shown| (wanted == shown).then_some(0));
            let packed = pack(&mut shown, |_, own| exact.of(own));
            assert_eq!(shown, pixels, "no other color may be shown");
            assert_eq!(read(2, packed, count), pixels, "{count} pixels of {colors} colors");
        }
    }

    #[test]
    fn near_colors_make_it_smaller() {
        let pixels = noise(64_000, 16);
        let costs = |most: u16| {
            Costs::new(move |wanted, shown| Some(u16::from(wanted.abs_diff(shown))).filter(|cost| *cost <= most))
        };
        let sizes = [0, 1, 2].map(|most| {
            let (costs, mut shown) = (costs(most), pixels.clone());
            let packed = pack(&mut shown, |_, own| costs.of(own));
            let worst = shown.iter().zip(&pixels).map(|(shown, own)| shown.abs_diff(*own)).max();
            assert!(worst.is_some_and(|worst| u16::from(worst) <= most), "{worst:?} where {most} may be");
            let count = packed.len();
            assert_eq!(read(2, packed, pixels.len()), shown, "what is said to be shown");
            count
        });
        assert!(sizes[1] * 10 < sizes[0] * 8 && sizes[2] < sizes[1], "{sizes:?}");
    }
}
