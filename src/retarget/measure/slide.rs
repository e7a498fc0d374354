//! How far a foot travels over the floor while it stands.

use glam::DVec2;

/// Times of frames are off by less.
const ROUNDING_SECONDS: f64 = 1e-6;

/// How far a point travels by steps, each with the time at its end: the longest way within a second, or how far it is from begin to end, whichever
/// is more. The noise of a capture adds up to centimeters over a foot that stands for long, and nobody sees it.
pub(super) fn travel(steps: &[(f64, DVec2)]) -> f64 {
    let (mut first, mut way, mut longest) = (0, 0.0, 0.0_f64);
    for (seconds, step) in steps {
        way += step.length();
        while seconds - steps[first].0 > 1.0 - ROUNDING_SECONDS {
            way -= steps[first].1.length();
            first += 1;
        }
        longest = longest.max(way);
    }
    longest.max(steps.iter().map(|(_, step)| *step).sum::<DVec2>().length())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walked(count: usize, step: impl Fn(usize) -> DVec2) -> f64 {
        travel(&(0..count).map(|frame| ((frame + 1) as f64 / 60.0, step(frame))).collect::<Vec<_>>())
    }

    #[test]
    fn noise_does_not_add_up_and_drift_does() {
        let shake = |size: f64| move |frame: usize| DVec2::new(if frame.is_multiple_of(2) { size } else { -size }, 0.0);
        let [second, ten] = [60, 600].map(|count| walked(count, shake(0.0001)));
        assert!(
            (second - 0.006).abs() < 1e-9 && (ten - second).abs() < 1e-9,
            "{second} m within a second, {ten} m in ten"
        );
        let drift = walked(600, |_| DVec2::new(0.0, 0.04 / 600.0));
        assert!((drift - 0.04).abs() < 1e-9, "{drift} m from begin to end");
        let there_and_back = walked(20, |frame| DVec2::new(if frame < 10 { 0.002 } else { -0.002 }, 0.0));
        assert!((there_and_back - 0.04).abs() < 1e-9, "{there_and_back} m there and back");
        assert!(walked(0, |_| DVec2::ONE).abs() < f64::EPSILON, "no step");
    }
}
