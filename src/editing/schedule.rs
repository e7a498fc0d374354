//! When each frame of the edited clip is, and which time of the clip it shows.
//!
//! All edits of time only change this list; values are looked at once, at the end. A frame that shows a key of the clip keeps its
//! values to the bit.

/// One frame to be: when it is, and what it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    /// Seconds from the edited clip's start.
    pub(super) at: f64,
    /// Seconds on the clip's own clock.
    pub(super) from: f64,
}

/// Frames to be, in time. Never empty; `at` rises, `from` may go any way.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Schedule {
    moments: Vec<Moment>,
}

/// Times nearer than this share of a frame are one time, where frames are laid anew.
const SAME_SHARE: f64 = 1e-6;
/// An end nearer than this share of a frame to a key is that key. Files keep times as `f32` or in few decimals, so that a key said to be
/// at 1.2 s is not quite there, and a frame that short has speeds that are rounding alone.
const END_SHARE: f64 = 0.01;

impl Schedule {
    /// The clip as it is, from 0.
    pub(super) fn new(times_seconds: &[f64]) -> Self {
        let start = times_seconds.first().copied().unwrap_or_default();
        let moment = |time: &f64| Moment { at: time - start, from: *time };
        Self { moments: times_seconds.iter().map(moment).collect() }
    }

    /// Frames at these times, each of which shows the time that is given for it.
    pub(super) fn showing(times_seconds: &[f64], shown: impl Fn(f64) -> f64) -> Self {
        let start = times_seconds.first().copied().unwrap_or_default();
        let moment = |time: &f64| Moment { at: time - start, from: shown(*time) };
        Self { moments: times_seconds.iter().map(moment).collect() }
    }

    pub(super) fn moments(&self) -> &[Moment] {
        &self.moments
    }

    pub(super) fn len(&self) -> usize {
        self.moments.len()
    }

    pub(super) fn duration(&self) -> f64 {
        self.moments[self.moments.len() - 1].at
    }

    /// From one time of the clip to another, with frames at both; `start` before `end`, or equal for a single frame. A key that is next
    /// to an end stands for it.
    ///
    /// Only for a schedule in which the clip still runs as it is.
    pub(super) fn crop(&mut self, start: f64, end: f64) {
        let slack = self.typical_step() * END_SHARE;
        let (start, end) = (self.snapped(start, slack), self.snapped(end, slack));
        let mut kept: Vec<Moment> = Vec::with_capacity(self.moments.len() + 2);
        kept.push(Moment { at: 0.0, from: start });
        let inside = |moment: &&Moment| moment.from > start + slack && moment.from < end - slack;
        kept.extend(self.moments.iter().filter(inside).map(|moment| Moment { at: moment.from - start, ..*moment }));
        if end > start + slack {
            kept.push(Moment { at: end - start, from: end });
        }
        self.moments = kept;
    }

    /// Every n-th frame and the last.
    pub(super) fn every(&mut self, step: usize) {
        let last = self.moments.len() - 1;
        let mut index = 0..;
        self.moments.retain(|_| index.next().is_some_and(|index| index % step == 0 || index == last));
    }

    /// Moves every frame in time; the first stays at 0. `to` must rise.
    pub(super) fn retime(&mut self, to: impl Fn(f64) -> f64) {
        let start = to(0.0);
        for moment in &mut self.moments {
            moment.at = to(moment.at) - start;
        }
    }

    pub(super) fn reverse(&mut self) {
        let duration = self.duration();
        self.moments.reverse();
        for moment in &mut self.moments {
            moment.at = duration - moment.at;
        }
    }

    pub(super) fn ping_pong(&mut self) {
        let duration = self.duration();
        let back = self.moments.iter().rev().skip(1).map(|moment| Moment { at: 2.0 * duration - moment.at, ..*moment });
        let back: Vec<Moment> = back.collect();
        self.moments.extend(back);
    }

    /// Stands still before the first and after the last frame.
    pub(super) fn hold(&mut self, before: f64, after: f64) {
        if before > 0.0 {
            let first = self.moments[0];
            self.moments.iter_mut().for_each(|moment| moment.at += before);
            self.moments.insert(0, first);
        }
        if after > 0.0 {
            let last = self.moments[self.moments.len() - 1];
            self.moments.push(Moment { at: last.at + after, ..last });
        }
    }

    /// How many frames [`Self::resample`] gives: round(duration · fps) + 1.
    pub(super) fn frames_at(&self, fps: f64) -> f64 {
        (self.duration() * fps).round() + 1.0
    }

    /// Uniform frames. Frame k is at k / fps; the last shows the end.
    pub(super) fn resample(&mut self, fps: f64) {
        // Callers keep it below their limit.
        let frames = self.frames_at(fps) as usize;
        let slack = SAME_SHARE / fps;
        let last = self.moments[self.moments.len() - 1].from;
        let mut next = 0;
        let shown = (0..frames).map(|frame| {
            let at = frame as f64 / fps;
            if frame + 1 == frames {
                return Moment { at, from: last };
            }
            while next + 1 < self.moments.len() && self.moments[next].at < at - slack {
                next += 1;
            }
            let after = self.moments[next];
            if next == 0 || (after.at - at).abs() <= slack || at > after.at {
                return Moment { at, from: after.from };
            }
            let before = self.moments[next - 1];
            let share = (at - before.at) / (after.at - before.at);
            Moment { at, from: before.from + (after.from - before.from) * share }
        });
        self.moments = shown.collect();
    }

    /// The duration of an average frame; 1 for a single one.
    fn typical_step(&self) -> f64 {
        let frames = self.moments.len();
        if frames < 2 { 1.0 } else { self.duration() / (frames - 1) as f64 }
    }

    /// The key at a time, where there is one.
    fn snapped(&self, time: f64, slack: f64) -> f64 {
        let after = self.moments.partition_point(|moment| moment.from < time);
        let near =
            [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|index| self.moments.get(index));
        near.map(|moment| moment.from).find(|key| (key - time).abs() <= slack).unwrap_or(time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(schedule: &Schedule) -> Vec<(f64, f64)> {
        let rounded = |value: f64| (value * 1e9).round() / 1e9;
        schedule.moments().iter().map(|moment| (rounded(moment.at), rounded(moment.from))).collect()
    }

    /// Five keys at a quarter of a second, the first at 1 s.
    fn schedule() -> Schedule {
        Schedule::new(&[1.0, 1.25, 1.5, 1.75, 2.0])
    }

    #[test]
    fn a_crop_has_frames_at_both_ends() {
        let mut cropped = schedule();
        cropped.crop(1.1, 1.75);
        assert_eq!(times(&cropped), [(0.0, 1.1), (0.15, 1.25), (0.4, 1.5), (0.65, 1.75)], "no key twice");
        cropped.crop(1.5, 1.5);
        assert_eq!(times(&cropped), [(0.0, 1.5)], "a single frame");
    }

    #[test]
    fn an_end_that_rounding_put_beside_a_key_is_the_key() {
        let keys: Vec<f64> = (0..=120).map(|frame| f64::from(frame as f32 / 30.0)).collect();
        for (start, end) in [(1.2, 3.4), (1.7, 2.3), (0.9, 3.1)] {
            let mut cropped = Schedule::new(&keys);
            cropped.crop(start, end);
            let steps = cropped.moments().windows(2).map(|pair| pair[1].at - pair[0].at);
            assert!(steps.into_iter().all(|step| (step * 30.0 - 1.0).abs() < 1e-4), "{start} to {end}: whole frames");
            assert!(cropped.moments().iter().all(|moment| keys.contains(&moment.from)), "{start} to {end}: keys");
        }
    }

    #[test]
    fn there_and_back_meet_once() {
        let mut schedule = schedule();
        schedule.every(2);
        assert_eq!(times(&schedule), [(0.0, 1.0), (0.5, 1.5), (1.0, 2.0)], "every other frame");
        schedule.ping_pong();
        let expected = [(0.0, 1.0), (0.5, 1.5), (1.0, 2.0), (1.5, 1.5), (2.0, 1.0)];
        assert_eq!(times(&schedule), expected, "the turning frame is there once");
        let forward = schedule.clone();
        schedule.reverse();
        assert_eq!(schedule, forward, "there and back is the same backward");
    }

    #[test]
    fn the_last_of_every_third_is_kept() {
        let mut schedule = schedule();
        schedule.every(3);
        assert_eq!(times(&schedule), [(0.0, 1.0), (0.75, 1.75), (1.0, 2.0)], "first, fourth, last");
    }

    #[test]
    fn frame_counts_follow_the_rule() {
        for (duration, fps, frames) in
            [(1.0, 30.0, 31), (1.0, 24.0, 25), (0.99, 30.0, 31), (0.98, 30.0, 30), (0.0, 30.0, 1)]
        {
            let mut schedule = Schedule::new(&if duration > 0.0 { vec![0.0, duration] } else { vec![0.0] });
            schedule.resample(fps);
            assert_eq!(schedule.len(), frames, "{duration} s at {fps}");
            let last = schedule.moments()[frames - 1];
            assert!((last.from - duration).abs() < 1e-12, "{duration} s at {fps}: the last frame shows the end");
            assert!((last.at - (frames - 1) as f64 / fps).abs() < 1e-12, "{duration} s at {fps}: on the grid");
        }
    }

    #[test]
    fn holding_stands_still() {
        let mut schedule = Schedule::new(&[0.0, 1.0]);
        schedule.hold(0.5, 0.25);
        schedule.resample(4.0);
        let shown: Vec<f64> = schedule.moments().iter().map(|moment| moment.from).collect();
        assert_eq!(shown, [0.0, 0.0, 0.0, 0.25, 0.5, 0.75, 1.0, 1.0], "half a second before, a quarter after");
    }
}
