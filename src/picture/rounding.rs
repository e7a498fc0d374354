//! Rounding in the innermost loops.

/// The largest whole number that is not above a value of less than 2³¹. Without instructions beyond the usual, the one of the standard library is
/// a call, which takes longer than all else that is done for a small triangle.
#[inline]
pub(super) fn floor(value: f32) -> f32 {
    let toward_zero = value as i32 as f32;
    if toward_zero > value { toward_zero - 1.0 } else { toward_zero }
}

#[cfg(test)]
mod tests {
    use super::floor;

    #[test]
    fn it_is_the_one_of_the_standard_library() {
        for value in [0.0, -0.0, 0.5, -0.5, 1.0, -1.0, 1.999, -1.001, 16_777_216.0, -2_000_000_000.0] {
            assert_eq!(floor(value), f32::floor(value), "{value}");
        }
    }
}
