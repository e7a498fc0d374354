//! How a camera was held, as its pictures say in their Exif block.

use super::Picture;

/// How pixels are turned and mirrored to stand as they were seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Orientation {
    /// Quarter turns clockwise.
    quarters: u8,
    /// Whether left and right change places before that.
    is_mirrored: bool,
}

impl Orientation {
    /// What an Exif block says. One that cannot be read says nothing: the picture is taken as it is.
    pub(super) fn of_exif(block: Option<&[u8]>) -> Self {
        let Some(block) = block else { return Self::default() };
        let block = block.strip_prefix(b"Exif\0\0").unwrap_or(block);
        let read = exif::Reader::new().read_raw(block.to_vec()).ok();
        let field = read.as_ref().and_then(|read| read.get_field(exif::Tag::Orientation, exif::In::PRIMARY));
        let (quarters, is_mirrored) = match field.and_then(|field| field.value.get_uint(0)) {
            Some(2) => (0, true),
            Some(3) => (2, false),
            Some(4) => (2, true),
            Some(5) => (3, true),
            Some(6) => (1, false),
            Some(7) => (1, true),
            Some(8) => (3, false),
            _ => (0, false),
        };
        Self { quarters, is_mirrored }
    }

    /// Whether width and height change places.
    pub(super) const fn is_on_side(self) -> bool {
        self.quarters % 2 == 1
    }

    /// The picture as it was seen.
    pub(super) fn upright(self, picture: Picture) -> Picture {
        if self == Self::default() {
            return picture;
        }
        let Picture { width, height, pixels } = picture;
        let [wide, high] = if self.is_on_side() { [height, width] } else { [width, height] };
        let pixel = |index: usize| {
            let (row, column) = (index / wide, index % wide);
            // Where the pixel comes from, before the turn.
            let (down, right) = match self.quarters {
                0 => (row, column),
                1 => (height - 1 - column, row),
                2 => (height - 1 - row, width - 1 - column),
                _ => (column, width - 1 - row),
            };
            pixels[down * width + if self.is_mirrored { width - 1 - right } else { right }]
        };
        Picture { width: wide, height: high, pixels: (0..wide * high).map(pixel).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A big-endian Exif block with one field.
    fn block(orientation: u8) -> Vec<u8> {
        let mut block = b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
        block.extend([orientation, 0, 0, 0, 0, 0, 0]);
        block
    }

    #[test]
    fn pictures_stand_as_they_were_seen() {
        // 1 2 3
        // 4 5 6
        let picture = Picture { width: 3, height: 2, pixels: (1..=6).map(|gray| [gray; 4]).collect() };
        let wanted: [(u8, usize, [u8; 6]); 8] = [
            (1, 3, [1, 2, 3, 4, 5, 6]),
            (2, 3, [3, 2, 1, 6, 5, 4]),
            (3, 3, [6, 5, 4, 3, 2, 1]),
            (4, 3, [4, 5, 6, 1, 2, 3]),
            (5, 2, [1, 4, 2, 5, 3, 6]),
            (6, 2, [4, 1, 5, 2, 6, 3]),
            (7, 2, [6, 3, 5, 2, 4, 1]),
            (8, 2, [3, 6, 2, 5, 1, 4]),
        ];
        for (orientation, width, grays) in wanted {
            let found = Orientation::of_exif(Some(&block(orientation)));
            let upright = found.upright(picture.clone());
            let seen: Vec<u8> = upright.pixels.iter().map(|pixel| pixel[0]).collect();
            assert_eq!((upright.width, &*seen), (width, &grays[..]), "orientation {orientation}");
        }
    }

    #[test]
    fn a_broken_block_says_nothing() {
        for block in [&b""[..], b"Exif\0\0", b"MM\0\x2a\xff\xff\xff\xff", &block(9), &block(6)[..12]] {
            assert_eq!(Orientation::of_exif(Some(block)), Orientation::default(), "{block:?}");
        }
    }
}
