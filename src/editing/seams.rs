//! Where one motion takes another one's place in time, and how their jumps there die away.

use std::ops::Range;

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::model::{Track, rotation::near};

/// Where the layered values begin and end, and how their jumps die away.
pub(super) struct Seams<'a> {
    pub(super) times: &'a [f64],
    pub(super) inside: Range<usize>,
    pub(super) seconds: f64,
}

impl Seams<'_> {
    pub(super) fn vectors(&self, outside: impl Fn(usize) -> DVec3, inside: impl Fn(usize) -> DVec3) -> Track<Vec3> {
        let difference = |one: DVec3, other: DVec3| one - other;
        let (enter, leave) = self.offsets(&outside, &inside, difference);
        let value = |frame: usize| {
            let is_inside = self.inside.contains(&frame);
            let value = if is_inside { inside(frame) } else { outside(frame) };
            (value + self.left(frame, enter, leave)).as_vec3()
        };
        Track::Sampled((0..self.times.len()).map(value).collect())
    }

    pub(super) fn weights(&self, outside: impl Fn(usize) -> f64, inside: impl Fn(usize) -> f64) -> Track<f32> {
        let vector = |value: f64| DVec3::new(value, 0.0, 0.0);
        self.vectors(|frame| vector(outside(frame)), |frame| vector(inside(frame))).map(|value| value.x)
    }

    pub(super) fn rotations(&self, outside: impl Fn(usize) -> DQuat, inside: impl Fn(usize) -> DQuat) -> Track<Quat> {
        // Offsets are rotations on the left, as rotation vectors.
        let difference = |one: DQuat, other: DQuat| near(one * other.conjugate(), DQuat::IDENTITY).to_scaled_axis();
        let (enter, leave) = self.offsets(&outside, &inside, difference);
        let value = |frame: usize| {
            let is_inside = self.inside.contains(&frame);
            let value = if is_inside { inside(frame) } else { outside(frame) };
            match self.left(frame, enter, leave) {
                DVec3::ZERO => value.as_quat(),
                left => (DQuat::from_scaled_axis(left) * value).normalize().as_quat(),
            }
        };
        Track::Sampled((0..self.times.len()).map(value).collect()).on_one_hemisphere()
    }

    /// Jump and jump of speed at the seam in, and at the seam out; nothing where there is no seam.
    fn offsets<T: Copy>(
        &self,
        outside: &impl Fn(usize) -> T,
        inside: &impl Fn(usize) -> T,
        difference: impl Fn(T, T) -> DVec3,
    ) -> (Option<[DVec3; 2]>, Option<[DVec3; 2]>) {
        let (first, after) = (self.inside.start, self.inside.end);
        if self.seconds <= 0.0 {
            return (None, None);
        }
        let last_frame = self.times.len() - 1;
        let speed = |value: &dyn Fn(usize) -> T, from: usize, to: usize| {
            if from == to {
                DVec3::ZERO
            } else {
                difference(value(to), value(from)) / (self.times[to] - self.times[from])
            }
        };
        // How the old motion would have gone on, against how the new one does; each is looked at where it is.
        let jump =
            |old: &dyn Fn(usize) -> T, new: &dyn Fn(usize) -> T, frame: usize, old_from: usize, new_to: usize| {
                [difference(old(frame), new(frame)), speed(old, old_from, frame) - speed(new, frame, new_to)]
            };
        let last = after.saturating_sub(1);
        let enter = (first > 0 && first < after).then(|| jump(outside, inside, first, first - 1, last.min(first + 1)));
        let leave = (after > first && last < last_frame)
            .then(|| jump(inside, outside, last, first.max(last.saturating_sub(1)), last + 1));
        (enter, leave)
    }

    /// What is left of the jumps at a frame: a cubic from the jump and its speed to nothing.
    fn left(&self, frame: usize, enter: Option<[DVec3; 2]>, leave: Option<[DVec3; 2]>) -> DVec3 {
        let decay = |begin: usize, [offset, speed]: [DVec3; 2]| {
            let share = ((self.times[frame] - self.times[begin]) / self.seconds).clamp(0.0, 1.0);
            let rest = 1.0 - share;
            (offset * (1.0 + 2.0 * share) + speed * (self.seconds * share)) * (rest * rest)
        };
        if self.inside.contains(&frame) {
            return enter.map_or(DVec3::ZERO, |jump| decay(self.inside.start, jump));
        }
        if frame >= self.inside.end {
            return leave.map_or(DVec3::ZERO, |jump| decay(self.inside.end - 1, jump));
        }
        DVec3::ZERO
    }
}

/// Frames from the first at or after the begin to the last at or before the end.
pub(super) fn frames_inside(times: &[f64], begin: f64, end: f64) -> Range<usize> {
    /// Seconds that are the same time.
    const SAME: f64 = 1e-9;
    let first = times.partition_point(|time| *time < begin - SAME);
    let after = times.partition_point(|time| *time <= end + SAME);
    first..after.max(first)
}
