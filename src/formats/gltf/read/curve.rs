//! One channel as the file has it: its own keys and an interpolation; and its values at other times.

use std::{rc::Rc, slice};

use bytemuck::Pod;
use glam::{DQuat, Quat, Vec3};

/// Cubic segments longer than this are given keys in between.
const CUBIC_LONGEST_SECONDS: f64 = 1.0 / 30.0;
/// Distance of the keys that are put into a cubic segment.
const CUBIC_STEP_SECONDS: f64 = 1.0 / 60.0;
/// How long before a step the old value is held by a key of its own.
const STEP_LEAD_SECONDS: f64 = 1e-4;

/// Times between keys that are as close to a key, or to one another, are left out; less than the lead of a step.
const SAME_SECONDS: f32 = 5e-5;

/// Keys of several channels that are as close are one: exporters round the same frame differently. Some steps of an `f32` at a minute or
/// two, and less than the lead of a step.
const SAME_KEY_SECONDS: f32 = 2e-5;

/// How values between keys are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interpolation {
    Step,
    Linear,
    /// Three values per key: in-tangent, value, out-tangent; tangents are per second.
    Cubic,
}

impl Interpolation {
    /// How many values there are per key.
    pub(super) const fn values_per_key(self) -> usize {
        match self {
            Self::Step | Self::Linear => 1,
            Self::Cubic => 3,
        }
    }
}

/// Something that can be between two keys.
pub(super) trait Value: Pod + PartialEq {
    /// Between two values.
    fn linear(from: Self, to: Self, fraction: f64) -> Self;
    /// `a · wa + b · wb + c · wc + d · wd`
    fn weighted(terms: [(Self, f64); 4]) -> Self;
    /// Whether all components are zero.
    fn is_zero(self) -> bool;
    /// Whether two values differ by no more than rounding; exporters write constant tracks that way.
    fn is_about(self, other: Self) -> bool;
}

/// Relative for lengths and factors, in radians for rotations.
const ROUNDING: f64 = 1e-5;

impl Value for Vec3 {
    fn linear(from: Self, to: Self, fraction: f64) -> Self {
        let (from, to) = (from.as_dvec3(), to.as_dvec3());
        (from + (to - from) * fraction).as_vec3()
    }

    fn weighted(terms: [(Self, f64); 4]) -> Self {
        terms.iter().map(|(value, weight)| value.as_dvec3() * *weight).sum::<glam::DVec3>().as_vec3()
    }

    fn is_zero(self) -> bool {
        self == Self::ZERO
    }

    fn is_about(self, other: Self) -> bool {
        let (one, other) = (self.as_dvec3(), other.as_dvec3());
        one.distance(other) <= ROUNDING * one.length().max(other.length())
    }
}

impl Value for f32 {
    fn linear(from: Self, to: Self, fraction: f64) -> Self {
        let (from, to) = (f64::from(from), f64::from(to));
        (from + (to - from) * fraction) as Self
    }

    fn weighted(terms: [(Self, f64); 4]) -> Self {
        terms.iter().map(|(value, weight)| f64::from(*value) * weight).sum::<f64>() as Self
    }

    fn is_zero(self) -> bool {
        self == 0.0
    }

    fn is_about(self, other: Self) -> bool {
        f64::from((self - other).abs()) <= ROUNDING
    }
}

impl Value for Quat {
    /// The short way round.
    fn linear(from: Self, to: Self, fraction: f64) -> Self {
        from.as_dquat().slerp(to.as_dquat(), fraction).as_quat()
    }

    fn weighted(terms: [(Self, f64); 4]) -> Self {
        let sum = terms.iter().map(|(value, weight)| value.as_dquat() * *weight).fold(ZERO, |sum, term| sum + term);
        let length = sum.length();
        if length > f64::MIN_POSITIVE { (sum / length).as_quat() } else { terms[0].0 }
    }

    fn is_zero(self) -> bool {
        self.to_array() == [0.0; 4]
    }

    fn is_about(self, other: Self) -> bool {
        let (one, other) = (self.as_dquat(), other.as_dquat());
        // The chord of a small rotation is half its angle; both signs are one rotation.
        let chord = (one - other).length().min((one + other).length());
        chord <= ROUNDING / 2.0
    }
}

const ZERO: DQuat = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);

/// One channel. Times rise strictly, and there are [`Interpolation::values_per_key`] values for each.
#[derive(Clone, Debug)]
pub(super) struct Curve<T> {
    pub(super) times: Rc<Vec<f32>>,
    pub(super) values: Vec<T>,
    pub(super) interpolation: Interpolation,
}

impl<T: Value> Curve<T> {
    /// Times between the keys at which the curve must be sampled too, so that straight lines between samples come close to
    /// it. Nothing when there would be more than `most` of them: then the number of them is the error.
    pub(super) fn times_between_keys(&self, most: u64) -> Result<Vec<f32>, u64> {
        let mut between = Vec::new();
        for (key, pair) in self.times.windows(2).enumerate() {
            let (start, end) = (f64::from(pair[0]), f64::from(pair[1]));
            match self.interpolation {
                Interpolation::Linear => {}
                Interpolation::Step => {
                    if !self.values[key].is_about(self.values[key + 1]) {
                        let lead = ((end - STEP_LEAD_SECONDS) as f32).min(pair[1].next_down());
                        between.extend((lead > pair[0]).then_some(lead));
                    }
                }
                Interpolation::Cubic => {
                    // A frame at 30 per second, in f32, may be a little longer than a thirtieth.
                    if end - start <= CUBIC_LONGEST_SECONDS * 1.001 || self.is_flat(key) {
                        continue;
                    }
                    let parts = ((end - start) / CUBIC_STEP_SECONDS - 1e-3).ceil();
                    if parts + between.len() as f64 > most as f64 {
                        return Err(parts as u64);
                    }
                    let parts = parts as u64;
                    let time = |part: u64| (start + (end - start) * part as f64 / parts as f64) as f32;
                    between.extend((1..parts).map(time).filter(|time| pair[0] < *time && *time < pair[1]));
                }
            }
        }
        Ok(between)
    }

    /// Whether a cubic segment stays at one value.
    fn is_flat(&self, key: usize) -> bool {
        let at = |offset: usize| self.values[key * 3 + offset];
        at(1).is_about(at(4)) && at(2).is_zero() && at(3).is_zero()
    }

    /// Whether [`Curve::sampled`] moves its values, and takes no memory.
    fn moves_at(&self, times: &[f32]) -> bool {
        self.interpolation != Interpolation::Cubic && *times == **self.times
    }

    /// How many bytes [`Curve::sampled`] takes beside those of the curve.
    pub(super) fn bytes_at(&self, times: &[f32]) -> u64 {
        if self.moves_at(times) { 0 } else { (times.len() as u64).saturating_mul(size_of::<T>() as u64) }
    }

    /// The values at `times`, which rise. Before the first key and after the last, their values hold. Moves the values where
    /// the times are the curve's own.
    pub(super) fn sampled(self, times: &[f32]) -> Vec<T> {
        if self.moves_at(times) {
            return self.values;
        }
        match self.interpolation {
            Interpolation::Cubic if *times == **self.times => self.values.chunks_exact(3).map(|key| key[1]).collect(),
            _ => {
                let mut key = 0;
                times.iter().map(|time| self.at(*time, &mut key)).collect()
            }
        }
    }

    /// The value at a time; `key` is where the search begins, and is moved on.
    fn at(&self, time: f32, key: &mut usize) -> T {
        while self.times.get(*key + 1).is_some_and(|next| *next <= time) {
            *key += 1;
        }
        let (start, next) = (self.times[*key], self.times.get(*key + 1));
        let Some(next) = next.filter(|_| time > start) else { return self.value(*key) };
        let seconds = f64::from(*next) - f64::from(start);
        let fraction = (f64::from(time) - f64::from(start)) / seconds;
        match self.interpolation {
            Interpolation::Step => self.value(*key),
            Interpolation::Linear => T::linear(self.value(*key), self.value(*key + 1), fraction),
            Interpolation::Cubic => {
                let [square, cube] = [fraction * fraction, fraction * fraction * fraction];
                T::weighted([
                    (self.values[*key * 3 + 1], 2.0 * cube - 3.0 * square + 1.0),
                    (self.values[*key * 3 + 2], (cube - 2.0 * square + fraction) * seconds),
                    (self.values[*key * 3 + 4], 3.0 * square - 2.0 * cube),
                    (self.values[*key * 3 + 3], (cube - square) * seconds),
                ])
            }
        }
    }

    fn value(&self, key: usize) -> T {
        match self.interpolation {
            Interpolation::Step | Interpolation::Linear => self.values[key],
            Interpolation::Cubic => self.values[key * 3 + 1],
        }
    }

    /// The values at the keys, to be changed; tangents left out.
    pub(super) fn key_values_mut(&mut self) -> impl Iterator<Item = &mut T> {
        let (first, step) = match self.interpolation {
            Interpolation::Step | Interpolation::Linear => (0, 1),
            Interpolation::Cubic => (1, 3),
        };
        let values: slice::IterMut<'_, T> = self.values.iter_mut();
        values.skip(first).step_by(step)
    }
}

/// Sorted union of times that each rise; keys that differ by rounding are one, at the last of their times, where every one of them is
/// reached.
pub(super) fn union(all: &[Rc<Vec<f32>>], between: Vec<f32>) -> Vec<f32> {
    let mut union: Vec<f32> = all.first().map_or_else(Vec::new, |first| first.to_vec());
    let mut is_sorted = true;
    for times in all.iter().skip(1) {
        if union != **times {
            union.extend_from_slice(times);
            is_sorted = false;
        }
    }
    if is_sorted && between.is_empty() {
        return union;
    }
    // Runs that rise already are found and merged.
    union.sort_by(f32::total_cmp);
    let mut first = union.first().copied().unwrap_or_default();
    union.dedup_by(|later, kept| {
        let is_same = *later - first <= SAME_KEY_SECONDS;
        let changed = if is_same { kept } else { &mut first };
        *changed = *later;
        is_same
    });
    // Curves of equal keys are cut at the same times but for rounding: one sample does for all.
    let is_far = |time: f32, other: Option<&f32>| other.is_none_or(|other| (time - other).abs() > SAME_SECONDS);
    let mut between = between;
    between.sort_by(f32::total_cmp);
    between.dedup_by(|later, earlier| !is_far(*later, Some(&*earlier)));
    between.retain(|time| {
        let after = union.partition_point(|key| key < time);
        is_far(*time, union.get(after)) && is_far(*time, after.checked_sub(1).and_then(|before| union.get(before)))
    });
    union.extend(between);
    union.sort_by(f32::total_cmp);
    union
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(times: &[f32], values: Vec<Vec3>, interpolation: Interpolation) -> Curve<Vec3> {
        Curve { times: Rc::new(times.to_vec()), values, interpolation }
    }

    fn x(values: &[f32]) -> Vec<Vec3> {
        values.iter().map(|x| Vec3::new(*x, 0.0, 0.0)).collect()
    }

    #[test]
    fn ends_hold_and_keys_are_exact() {
        let linear = curve(&[1.0, 2.0], x(&[10.0, 20.0]), Interpolation::Linear);
        assert_eq!(linear.sampled(&[0.0, 1.0, 1.5, 2.0, 3.0]), x(&[10.0, 10.0, 15.0, 20.0, 20.0]), "linear");
        let step = curve(&[1.0, 2.0], x(&[10.0, 20.0]), Interpolation::Step);
        assert_eq!(step.sampled(&[0.0, 1.9, 2.0]), x(&[10.0, 10.0, 20.0]), "step");
    }

    #[test]
    fn cubic_is_hermite_with_tangents_per_second() {
        // x = t² on [0, 2]: tangents 0 and 4 per second.
        let cubic = curve(&[0.0, 2.0], x(&[0.0, 0.0, 0.0, 4.0, 4.0, 0.0]), Interpolation::Cubic);
        assert_eq!(cubic.clone().sampled(&[0.0, 0.5, 1.0, 2.0]), x(&[0.0, 0.25, 1.0, 4.0]), "a parabola");
        let between = cubic.times_between_keys(1000).expect("few");
        assert_eq!(between.len(), 119, "sixty per second, without the ends");
        assert_eq!(cubic.times_between_keys(100), Err(120), "too many");
    }

    #[test]
    fn keys_that_differ_by_rounding_are_one() {
        let [mut early, mut late] = [vec![0.0], vec![0.0]];
        for frame in 1..=90 {
            early.push(frame as f32 / 30.0);
            late.push((frame as f32 / 30.0).next_up());
        }
        let times = union(&[Rc::new(early), Rc::new(late.clone())], Vec::new());
        assert_eq!(times, late, "each at its last time, where a step has happened in every channel");
        let near = union(&[Rc::new(vec![0.0, 0.001]), Rc::new(vec![0.001 + 3e-5])], Vec::new());
        assert_eq!(near, [0.0, 0.001, 0.001 + 3e-5], "what lies apart stays so");
    }

    #[test]
    fn only_real_steps_get_a_lead() {
        let step = curve(&[0.0, 1.0, 2.0], x(&[1.0, 1.0, 2.0]), Interpolation::Step);
        assert_eq!(step.times_between_keys(10), Ok(vec![1.9999]), "the first two are equal");
        let late = curve(&[100_000.0, 100_000.01], x(&[1.0, 2.0]), Interpolation::Step);
        let between = late.times_between_keys(10).expect("few");
        assert!(between.iter().all(|time| *time > 100_000.0 && *time < 100_000.01), "inside even where f32 is coarse");
    }
}
