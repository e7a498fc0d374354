//! When a stage works, and how much.

use crate::rig::Schedule;

impl Schedule {
    /// The share of the stage's change at a frame: the alpha at its time, 0 outside of the frames.
    pub(in super::super) fn alpha_at(&self, frame: usize, seconds: f64) -> f64 {
        if frame < self.frames[0] || frame > self.frames[1] {
            return 0.0;
        }
        let after = self.alpha.partition_point(|key| key[0] <= seconds);
        let (Some(before), next) = (self.alpha[..after].last(), self.alpha.get(after)) else {
            return self.alpha.first().map_or(1.0, |key| key[1]);
        };
        let Some(next) = next else { return before[1] };
        before[1] + (next[1] - before[1]) * (seconds - before[0]) / (next[0] - before[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_is_linear_between_keys_and_nothing_outside_of_the_frames() {
        let schedule = Schedule { alpha: vec![[1.0, 0.0], [2.0, 1.0]], frames: [2, 50] };
        assert_eq!(schedule.alpha_at(10, 0.5), 0.0, "before the first key");
        assert_eq!(schedule.alpha_at(10, 1.25), 0.25, "between");
        assert_eq!(schedule.alpha_at(10, 9.0), 1.0, "after the last");
        assert_eq!(schedule.alpha_at(51, 9.0), 0.0, "outside of the frames");
        assert_eq!(schedule.alpha_at(1, 1.5), 0.0, "outside of the frames");
    }
}
