//! Numbers into text, with a fixed number of decimals. Knows no BVH.

use std::io::Write as _;

/// Whole numbers below this are exact as a double.
const LARGEST_EXACT: f64 = 9_007_199_254_740_992.0;

/// Appends a finite number, rounded to `decimals` places (at most 15); trailing zeros are left out.
pub(super) fn push_number(out: &mut Vec<u8>, value: f64, decimals: usize) {
    let factor = 10_u64.pow(decimals as u32);
    let scaled = (value.abs() * factor as f64).round();
    if scaled >= LARGEST_EXACT {
        // A vector does not refuse bytes.
        let _ = write!(out, "{value}");
        return;
    }
    let scaled = scaled as u64;
    if value < 0.0 && scaled > 0 {
        out.push(b'-');
    }
    let _ = write!(out, "{}", scaled / factor);
    let mut fraction = scaled % factor;
    if fraction == 0 {
        return;
    }
    let mut digits = [b'0'; 16];
    for digit in digits[..decimals].iter_mut().rev() {
        *digit = b'0' + (fraction % 10) as u8;
        fraction /= 10;
    }
    let length = digits[..decimals].iter().rposition(|digit| *digit != b'0').map_or(0, |last| last + 1);
    out.push(b'.');
    out.extend_from_slice(&digits[..length]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(value: f64, decimals: usize) -> String {
        let mut out = Vec::new();
        push_number(&mut out, value, decimals);
        String::from_utf8(out).expect("digits")
    }

    #[test]
    fn numbers_are_rounded_and_short() {
        for (value, decimals, expected) in [
            (0.0, 6, "0"),
            (-0.0, 6, "0"),
            (1.5, 6, "1.5"),
            (-0.000_000_4, 6, "0"),
            (-0.000_000_6, 6, "-0.000001"),
            (12.345_678_9, 4, "12.3457"),
            (0.050_5, 3, "0.051"),
            (99.999_9, 2, "100"),
            (7.0, 0, "7"),
            (1e20, 6, "100000000000000000000"),
        ] {
            assert_eq!(text(value, decimals), expected, "{value} with {decimals} decimals");
        }
    }
}
