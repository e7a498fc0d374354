//! Whether a drawing that is seen from the side faces left: where the body has turned around, and has done so for a while.

use super::{BodyMotion, Plane};

/// A body that faces more than this away from where it began has turned around.
const TURNED_FROM_DEGREES: f64 = 100.0;
/// It has turned back when it faces less than this away.
const TURNED_BACK_DEGREES: f64 = 80.0;
/// Turns that last less are none.
const MIN_SECONDS: f64 = 0.3;

/// For each frame whether the drawing is mirrored. One that is seen from the front never is.
pub(super) fn mirrored(motion: &BodyMotion, plane: Plane) -> Vec<bool> {
    if plane == Plane::Frontal {
        return vec![false; motion.frames()];
    }
    let mut is_turned = false;
    let turned: Vec<bool> = motion
        .forwards
        .iter()
        .map(|forward| {
            let away = forward.x.clamp(-1.0, 1.0).acos().to_degrees();
            is_turned = away > if is_turned { TURNED_BACK_DEGREES } else { TURNED_FROM_DEGREES };
            is_turned
        })
        .collect();
    lasting(&turned, (MIN_SECONDS / motion.frame_time).round().max(1.0) as usize)
}

/// The same without runs that are shorter than so many frames.
pub(super) fn lasting(states: &[bool], least: usize) -> Vec<bool> {
    let mut kept = Vec::with_capacity(states.len());
    for run in states.chunk_by(|one, other| one == other) {
        let before = kept.last().copied();
        let state = if run.len() < least { before.unwrap_or(run[0]) } else { run[0] };
        kept.resize(kept.len() + run.len(), state);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lasts_less_is_left_out() {
        let states = [false, false, true, false, false, true, true, true, false];
        assert_eq!(lasting(&states, 2), [false, false, false, false, false, true, true, true, true]);
    }
}
