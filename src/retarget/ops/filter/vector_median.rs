//! The median: a spike goes, and a step stays as steep as it is.
//!
//! The median of rotations is the one among them from which the others are turned least in sum (the vector median of Astola, Haavisto
//! and Neuvo, 1990, with angles as distances). Of rotations about one axis that is the ordinary median, and it is always one that was there.

use glam::DQuat;

/// `reach` frames to each side are looked at; toward the ends as many as there are to both.
pub(in crate::retarget) fn vector_median(rotations: &[DQuat], reach: usize) -> Vec<DQuat> {
    let last = rotations.len().saturating_sub(1);
    let median = |frame: usize| {
        let reach = reach.min(frame).min(last - frame);
        let near = &rotations[frame - reach..=frame + reach];
        let turned = |one: &DQuat| -> f64 { near.iter().map(|other| one.angle_between(*other)).sum() };
        // Of several that are as good, the frame itself, or else the first.
        let own = (rotations[frame], turned(&rotations[frame]));
        near.iter().fold(own, |best, one| {
            let turned = turned(one);
            if turned < best.1 - 1e-9 { (*one, turned) } else { best }
        })
    };
    (0..rotations.len()).map(|frame| median(frame).0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(degrees: &[f64]) -> Vec<DQuat> {
        degrees.iter().map(|degrees| DQuat::from_rotation_x(degrees.to_radians())).collect()
    }

    fn filtered(degrees: &[f64], reach: usize) -> Vec<f64> {
        let found = vector_median(&turned(degrees), reach);
        found.iter().map(|one| (2.0 * one.x.atan2(one.w).to_degrees()).round()).collect()
    }

    #[test]
    fn spikes_vanish_and_steps_stay() {
        assert_eq!(filtered(&[0.0, 5.0, 10.0, 90.0, 20.0, 25.0, 30.0], 1), [0.0, 5.0, 10.0, 20.0, 25.0, 25.0, 30.0]);
        let step = [10.0, 10.0, 10.0, 60.0, 60.0, 60.0];
        assert_eq!(filtered(&step, 2), step, "as steep as it was");
        let two = [0.0, 0.0, 0.0, 80.0, -70.0, 0.0, 0.0, 0.0];
        assert_eq!(filtered(&two, 2), [0.0; 8], "two frames");
        let ramp: Vec<f64> = (0..12).map(|frame| f64::from(frame) * 7.0).collect();
        assert_eq!(filtered(&ramp, 3), ramp, "what goes on steadily stays, up to the ends");
    }
}
