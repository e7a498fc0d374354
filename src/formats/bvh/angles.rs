//! Sine and cosine of the angles of a file: millions of them, which are what reading takes longest for.

use std::f64::consts::FRAC_2_PI;

/// A quarter turn in 33 bits, of which twenty bits of multiples are exact.
const QUARTER_TURN: f64 = f64::from_bits(0x3ff9_21fb_5440_0000);
/// What that lacks of a quarter turn.
const QUARTER_TURN_REST: f64 = 6.077_100_506_506_192e-11;
/// Numbers far below it, added to it, become whole ones in its lowest bits.
const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// Beyond as many quarter turns, taking them off loses digits.
const MAX_QUARTER_TURNS: f64 = 1e5;
/// Taylor coefficients 1/3!, 1/5!, …: on an eighth of a turn what is left out is below a double's precision.
const SINE: [f64; 8] = [
    -1.0 / 6.0,
    1.0 / 120.0,
    -1.0 / 5_040.0,
    1.0 / 362_880.0,
    -1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 1_307_674_368_000.0,
    1.0 / 355_687_428_096_000.0,
];
/// 1/2!, 1/4!, …
const COSINE: [f64; 8] = [
    -1.0 / 2.0,
    1.0 / 24.0,
    -1.0 / 720.0,
    1.0 / 40_320.0,
    -1.0 / 3_628_800.0,
    1.0 / 479_001_600.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 20_922_789_888_000.0,
];

/// Sine and cosine of an angle, within 4e-16. Made of additions and multiplications alone, so that every machine gives the same.
#[inline(always)]
fn sin_cos(radians: f64) -> (f64, f64) {
    let rounded = radians * FRAC_2_PI + ROUNDING;
    let quarters = rounded - ROUNDING;
    let rest = (radians - quarters * QUARTER_TURN) - quarters * QUARTER_TURN_REST;
    // Pairs of terms, and pairs of those: a machine works on all at once that do not wait for one another.
    let square = rest * rest;
    let (fourth, eighth) = (square * square, square * square * (square * square));
    let pair = |terms: &[f64], index: usize| terms[index] + terms[index + 1] * square;
    let fours = |terms: &[f64], index: usize| pair(terms, index) + pair(terms, index + 2) * fourth;
    let sine = rest + rest * square * (fours(&SINE, 0) + fours(&SINE, 4) * eighth);
    let cosine = 1.0 + square * (fours(&COSINE, 0) + fours(&COSINE, 4) * eighth);
    // The quarter turns that were taken off come back as an exchange and as signs, without a jump.
    let quarter = rounded.to_bits();
    let is_odd = quarter & 1 == 1;
    let (first, second) = if is_odd { (cosine, sine) } else { (sine, cosine) };
    let signed = |value: f64, is_negative: u64| f64::from_bits(value.to_bits() ^ ((is_negative & 1) << 63));
    (signed(first, quarter >> 1), signed(second, (quarter >> 1) ^ quarter))
}

/// Sines and cosines of angles.
pub(super) fn sines_and_cosines<const N: usize>(radians: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    let quarters = radians.iter().fold(0.0_f64, |most, radians| most.max(radians.abs())) * FRAC_2_PI;
    if quarters > MAX_QUARTER_TURNS || radians.iter().any(|radians| radians.is_nan()) {
        for index in 0..N {
            (sines[index], cosines[index]) = radians[index].sin_cos();
            if (radians[index] * FRAC_2_PI).abs() <= MAX_QUARTER_TURNS {
                (sines[index], cosines[index]) = sin_cos(radians[index]);
            }
        }
        return (sines, cosines);
    }
    for index in 0..N {
        (sines[index], cosines[index]) = sin_cos(radians[index]);
    }
    (sines, cosines)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn assert_is_that_of_the_standard_library(radians: f64) {
        // Each result is that of its own angle, whatever the others are.
        let (sines, cosines) = sines_and_cosines(&[radians, 0.5, 1e9]);
        let alone = sines_and_cosines(&[radians]);
        let ours = (sines[0], cosines[0]);
        let bits = |(sine, cosine): (f64, f64)| [sine.to_bits(), cosine.to_bits()];
        assert_eq!(bits(ours), bits((alone.0[0], alone.1[0])), "{radians}");
        let theirs = radians.sin_cos();
        let near = |one: f64, other: f64| (one - other).abs() < 4e-16;
        assert!(near(ours.0, theirs.0) && near(ours.1, theirs.1), "{radians}: {ours:?} and {theirs:?}");
    }

    #[test]
    fn every_eighth_of_a_turn_and_its_neighbors() {
        for eighths in -40..=40 {
            let radians = f64::from(eighths) * std::f64::consts::FRAC_PI_4;
            for near in [radians.next_down(), radians, radians.next_up()] {
                assert_is_that_of_the_standard_library(near);
            }
        }
        assert_eq!(sines_and_cosines(&[0.0]), ([0.0], [1.0]), "exactly");
        assert!(sines_and_cosines(&[f64::NAN]).0[0].is_nan(), "no number");
    }

    proptest! {
        #[test]
        fn any_angle(radians in -1e4..1e4_f64, many in -1e12..1e12_f64) {
            assert_is_that_of_the_standard_library(radians);
            assert_is_that_of_the_standard_library(many);
        }
    }
}
