//! The values of a clip at times between its keys.

use std::ops::{Add, Mul};

use glam::{Quat, Vec3, Vec4};

use crate::model::{JointContacts, JointTracks, MorphTrack, Track, rotation::near};

use super::schedule::Schedule;

/// Where a time lies among keys.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tap {
    /// The key before, or at it.
    key: usize,
    /// Share of the way to the next; 0 at the key itself.
    share: f32,
}

/// What every frame of a schedule is made of: found once, used for all tracks.
pub(super) struct Sampling {
    taps: Vec<Tap>,
    /// End of each frame's taps; several where a frame is an average.
    ends: Vec<usize>,
    /// Key times relative to the first.
    times: Vec<f32>,
    cubic: bool,
}

/// Shares below this, and above 1 minus it, are keys.
const AT_KEY: f64 = 1e-9;
/// A frame that stands for more than this many keys is an average.
const MAX_KEYS_PER_FRAME: f64 = 2.0 + 1e-3;
/// An average takes at most so many samples.
const MAX_TAPS: f64 = 255.0;

impl Sampling {
    /// `times_seconds` are the clip's keys. `fps` is given where frames are uniform and may have to be averages.
    pub(super) fn new(times_seconds: &[f64], schedule: &Schedule, fps: Option<f64>, cubic: bool) -> Self {
        let (first, last) = (times_seconds[0], times_seconds[times_seconds.len() - 1]);
        let step = (last - first) / (times_seconds.len() - 1).max(1) as f64;
        let (mut taps, mut ends) = (Vec::with_capacity(schedule.len()), Vec::with_capacity(schedule.len()));
        let moments = schedule.moments();
        for (index, moment) in moments.iter().enumerate() {
            let half = fps.map_or(0.0, |_| {
                let (before, after) = (moments[index.saturating_sub(1)], moments[(index + 1).min(moments.len() - 1)]);
                // What the frame stands for: half the way to either neighbor, as much of the clip on both sides.
                let reach = ((after.from - before.from).abs() / 2.0) / 2.0;
                reach.min(moment.from - first).min(last - moment.from)
            });
            if step > 0.0 && 2.0 * half > MAX_KEYS_PER_FRAME * step {
                let count = (2.0 * half / step).ceil().min(MAX_TAPS) as u32 | 1;
                let middle = f64::from(count - 1) / 2.0;
                let offset = |sample: u32| (f64::from(sample) - middle) / f64::from(count) * 2.0 * half;
                taps.extend((0..count).map(|sample| tap(times_seconds, moment.from + offset(sample))));
            } else {
                taps.push(tap(times_seconds, moment.from));
            }
            ends.push(taps.len());
        }
        let times = times_seconds.iter().map(|time| (time - first) as f32).collect();
        Self { taps, ends, times, cubic }
    }

    pub(super) fn joint(&self, tracks: &JointTracks) -> JointTracks {
        JointTracks {
            translation: self.track(&tracks.translation),
            rotation: self.track(&tracks.rotation),
            scale: self.track(&tracks.scale),
        }
    }

    /// The weights of morphs.
    pub(super) fn morphs(&self, tracks: &[MorphTrack]) -> Vec<MorphTrack> {
        tracks.iter().map(|track| MorphTrack { morph: track.morph, weights: self.track(&track.weights) }).collect()
    }

    /// Contacts: at each frame those of the nearest key, or of most of them where a frame is an average.
    pub(super) fn contacts(&self, tracks: &[JointContacts]) -> Vec<JointContacts> {
        let resampled = |track: &JointContacts| {
            let touches = |tap: &Tap| track.touches[tap.key + usize::from(tap.share >= 0.5)];
            let most = |taps: &[Tap]| taps.iter().filter(|tap| touches(tap)).count() * 2 > taps.len();
            let begins = std::iter::once(0).chain(self.ends.iter().copied());
            let frames = begins.zip(&self.ends).map(|(begin, end)| most(&self.taps[begin..*end]));
            JointContacts { joint: track.joint, touches: frames.collect() }
        };
        tracks.iter().map(resampled).collect()
    }

    fn track<T: Value>(&self, track: &Track<T>) -> Track<T> {
        let Track::Sampled(values) = track else { return track.clone() };
        let mut begin = 0;
        let mut before: Option<T> = None;
        let sampled = self.ends.iter().map(|end| {
            let taps = &self.taps[begin..*end];
            begin = *end;
            let value = match taps {
                [tap] => self.value(values, *tap),
                taps => T::mean(taps.iter().map(|tap| self.value(values, *tap))),
            };
            let value = before.map_or(value, |before| value.near(before));
            before = Some(value);
            value
        });
        Track::Sampled(sampled.collect())
    }

    fn value<T: Value>(&self, values: &[T], Tap { key, share }: Tap) -> T {
        if share == 0.0 {
            return values[key];
        }
        let (value, next) = (values[key], values[key + 1]);
        if !self.cubic {
            return value.between(next, share);
        }
        let width = self.times[key + 1] - self.times[key];
        let slope = |at: usize| {
            let (before, after) = (at.saturating_sub(1), (at + 1).min(values.len() - 1));
            let (start, end) = (values[before].near(value), values[after].near(value));
            (end.raw() + start.raw() * -1.0) * (width / (self.times[after] - self.times[before]))
        };
        let (u, rest) = (share, 1.0 - share);
        let sum = value.raw() * ((1.0 + 2.0 * u) * rest * rest)
            + slope(key) * (u * rest * rest)
            + next.near(value).raw() * (u * u * (3.0 - 2.0 * u))
            + slope(key + 1) * (-u * u * rest);
        T::from_raw(sum).unwrap_or(value)
    }
}

fn tap(times_seconds: &[f64], time: f64) -> Tap {
    let after = times_seconds.partition_point(|key| *key <= time);
    let Some(key) = after.checked_sub(1) else { return Tap { key: 0, share: 0.0 } };
    let Some(next) = times_seconds.get(after) else { return Tap { key, share: 0.0 } };
    let share = (time - times_seconds[key]) / (next - times_seconds[key]);
    match share {
        share if share < AT_KEY => Tap { key, share: 0.0 },
        share if share > 1.0 - AT_KEY => Tap { key: after, share: 0.0 },
        share => Tap { key, share: share as f32 },
    }
}

/// What a track may hold.
trait Value: Copy {
    type Raw: Copy + Add<Output = Self::Raw> + Mul<f32, Output = Self::Raw>;

    fn raw(self) -> Self::Raw;
    /// Nothing where the sum is no value: quaternions that cancel out.
    fn from_raw(raw: Self::Raw) -> Option<Self>;
    /// The same value, written as close to another as it can be.
    fn near(self, other: Self) -> Self;
    fn between(self, next: Self, share: f32) -> Self;

    /// The mean of at least one value.
    fn mean(mut values: impl Iterator<Item = Self> + Clone) -> Self {
        let count = values.clone().count().max(1);
        let first = values.next().expect("callers give at least one value");
        let sum = values.fold(first.raw(), |sum, value| sum + value.near(first).raw());
        Self::from_raw(sum * (1.0 / count as f32)).unwrap_or(first)
    }
}

impl Value for Vec3 {
    type Raw = Self;

    fn raw(self) -> Self {
        self
    }

    fn from_raw(raw: Self) -> Option<Self> {
        Some(raw)
    }

    fn near(self, _: Self) -> Self {
        self
    }

    fn between(self, next: Self, share: f32) -> Self {
        self.lerp(next, share)
    }
}

impl Value for f32 {
    type Raw = Self;

    fn raw(self) -> Self {
        self
    }

    fn from_raw(raw: Self) -> Option<Self> {
        Some(raw)
    }

    fn near(self, _: Self) -> Self {
        self
    }

    fn between(self, next: Self, share: f32) -> Self {
        self + (next - self) * share
    }
}

impl Value for Quat {
    type Raw = Vec4;

    fn raw(self) -> Vec4 {
        Vec4::from(self)
    }

    fn from_raw(raw: Vec4) -> Option<Self> {
        raw.try_normalize().map(Self::from_vec4)
    }

    fn near(self, other: Self) -> Self {
        near(self, other)
    }

    fn between(self, next: Self, share: f32) -> Self {
        self.slerp(next, share)
    }
}
