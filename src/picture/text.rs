//! Letters on a picture: capitals, digits and a few marks, five pixels wide and seven high.

use super::Picture;

/// Rows from the top, the leftmost pixel in the highest of five bits.
const GLYPHS: [(char, [u8; 7]); 46] = [
    ('0', [14, 17, 19, 21, 25, 17, 14]),
    ('1', [4, 12, 4, 4, 4, 4, 14]),
    ('2', [14, 17, 1, 6, 8, 16, 31]),
    ('3', [30, 1, 1, 14, 1, 1, 30]),
    ('4', [2, 6, 10, 18, 31, 2, 2]),
    ('5', [31, 16, 30, 1, 1, 17, 14]),
    ('6', [6, 8, 16, 30, 17, 17, 14]),
    ('7', [31, 1, 2, 4, 8, 8, 8]),
    ('8', [14, 17, 17, 14, 17, 17, 14]),
    ('9', [14, 17, 17, 15, 1, 2, 12]),
    ('A', [14, 17, 17, 31, 17, 17, 17]),
    ('B', [30, 17, 17, 30, 17, 17, 30]),
    ('C', [14, 17, 16, 16, 16, 17, 14]),
    ('D', [28, 18, 17, 17, 17, 18, 28]),
    ('E', [31, 16, 16, 30, 16, 16, 31]),
    ('F', [31, 16, 16, 30, 16, 16, 16]),
    ('G', [14, 17, 16, 23, 17, 17, 15]),
    ('H', [17, 17, 17, 31, 17, 17, 17]),
    ('I', [14, 4, 4, 4, 4, 4, 14]),
    ('J', [7, 2, 2, 2, 2, 18, 12]),
    ('K', [17, 18, 20, 24, 20, 18, 17]),
    ('L', [16, 16, 16, 16, 16, 16, 31]),
    ('M', [17, 27, 21, 21, 17, 17, 17]),
    ('N', [17, 25, 21, 19, 17, 17, 17]),
    ('O', [14, 17, 17, 17, 17, 17, 14]),
    ('P', [30, 17, 17, 30, 16, 16, 16]),
    ('Q', [14, 17, 17, 17, 21, 18, 13]),
    ('R', [30, 17, 17, 30, 20, 18, 17]),
    ('S', [15, 16, 16, 14, 1, 1, 30]),
    ('T', [31, 4, 4, 4, 4, 4, 4]),
    ('U', [17, 17, 17, 17, 17, 17, 14]),
    ('V', [17, 17, 17, 17, 17, 10, 4]),
    ('W', [17, 17, 17, 21, 21, 27, 17]),
    ('X', [17, 17, 10, 4, 10, 17, 17]),
    ('Y', [17, 17, 10, 4, 4, 4, 4]),
    ('Z', [31, 1, 2, 4, 8, 16, 31]),
    ('.', [0, 0, 0, 0, 0, 12, 12]),
    (',', [0, 0, 0, 0, 12, 4, 8]),
    (':', [0, 12, 12, 0, 12, 12, 0]),
    ('-', [0, 0, 0, 31, 0, 0, 0]),
    ('_', [0, 0, 0, 0, 0, 0, 31]),
    ('/', [1, 1, 2, 4, 8, 16, 16]),
    ('%', [25, 25, 2, 4, 8, 19, 19]),
    ('(', [2, 4, 8, 8, 8, 4, 2]),
    (')', [8, 4, 2, 2, 2, 4, 8]),
    ('?', [14, 17, 1, 2, 4, 0, 4]),
];

/// Pixels from one letter to the next, at size 1.
const ADVANCE: usize = 6;

/// A text in lines that are no wider than so many pixels, broken where there are spaces; a word that is wider has a line of its own.
pub(super) fn lines(text: &str, width: usize, size: usize) -> Vec<String> {
    let letters = width / (ADVANCE * size.max(1));
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut().filter(|line| line.chars().count() + 1 + word.chars().count() <= letters) {
            Some(line) => line.extend([" ", word]),
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Writes a text with its upper left corner at a place; each pixel of a letter is `size` pixels wide. Small letters become capitals, and what
/// is outside the picture is left out.
pub(super) fn write(picture: &mut Picture, text: &str, [left, top]: [usize; 2], size: usize, color: [u8; 3]) {
    for (index, letter) in text.chars().enumerate() {
        let letter = letter.to_ascii_uppercase();
        if letter == ' ' {
            continue;
        }
        let known = GLYPHS.iter().find(|(known, _)| *known == letter).or_else(|| GLYPHS.last());
        let Some((_, rows)) = known else { continue };
        for (row, bits) in rows.iter().enumerate() {
            for column in (0..5).filter(|column| bits >> (4 - column) & 1 == 1) {
                for dot in 0..size * size {
                    let x = left + (index * ADVANCE + column) * size + dot % size;
                    let y = top + row * size + dot / size;
                    if x < picture.width && y < picture.height {
                        picture.pixels[y * picture.width + x] = [color[0], color[1], color[2], 255];
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::lines;

    #[test]
    fn a_text_is_broken_where_it_would_not_fit() {
        let text = "LIMB DIRECTION 9.1 DEGREES, LEFT THIGH";
        assert_eq!(lines(text, 230, 1), [text], "38 letters of 6 pixels");
        assert_eq!(lines(text, 227, 1), ["LIMB DIRECTION 9.1 DEGREES, LEFT", "THIGH"]);
        assert_eq!(lines(text, 227, 2), ["LIMB DIRECTION 9.1", "DEGREES, LEFT", "THIGH"], "letters twice as wide");
        assert_eq!(lines("ABCDEF GH", 12, 1), ["ABCDEF", "GH"], "nothing is left out");
        assert!(lines("", 100, 1).is_empty());
    }
}
