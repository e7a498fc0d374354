//! The values of a clip at times between its keys.

use std::ops::{Add, Mul};

use glam::{Quat, Vec3, Vec4};

use crate::model::{Clip, JointContacts, JointTracks, MorphTrack, Track, rotation::near};

use super::schedule::Schedule;

/// Where a time lies among keys.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tap {
    /// The key before, or at it.
    key: usize,
    /// Share of the way to the next; 0 at the key itself.
    share: f32,
    /// The time itself, in seconds.
    seconds: f64,
}

/// What every frame of a schedule is made of: found once, used for all tracks.
pub(super) struct Sampling {
    taps: Vec<Tap>,
    /// End of each frame's taps; several where a frame is an average.
    ends: Vec<usize>,
    /// Key times relative to the first.
    times: Vec<f32>,
    cubic: bool,
    /// What lies between the keys, where somebody knows that better.
    between: Option<Clip>,
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
        Self { taps, ends, times, cubic, between: None }
    }

    /// The times between keys that are looked at, rising.
    pub(super) fn times_between(&self) -> Vec<f64> {
        let between = self.taps.iter().filter(|tap| tap.share != 0.0);
        let mut times: Vec<f64> = between.map(|tap| tap.seconds).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The same with the values at [`Self::times_between`].
    pub(super) fn knowing(self, between: Option<Clip>) -> Self {
        Self { between, ..self }
    }

    pub(super) fn joint(&self, joint: usize, tracks: &JointTracks) -> JointTracks {
        let between = self.between.as_ref().map(|clip| &clip.joints()[joint]);
        JointTracks {
            translation: self.track(&tracks.translation, between.map(|tracks| &tracks.translation)),
            rotation: self.track(&tracks.rotation, between.map(|tracks| &tracks.rotation)),
            scale: self.track(&tracks.scale, between.map(|tracks| &tracks.scale)),
        }
    }

    /// The weights of morphs.
    pub(super) fn morphs(&self, tracks: &[MorphTrack]) -> Vec<MorphTrack> {
        let between = |morph: usize| self.between.as_ref()?.morphs().iter().find(|track| track.morph == morph);
        let resampled = |track: &MorphTrack| {
            let weights = self.track(&track.weights, between(track.morph).map(|track| &track.weights));
            MorphTrack { morph: track.morph, weights }
        };
        tracks.iter().map(resampled).collect()
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

    fn track<T: Value>(&self, track: &Track<T>, between: Option<&Track<T>>) -> Track<T> {
        let Track::Sampled(values) = track else { return track.clone() };
        let known = between.zip(self.between.as_ref().map(Clip::times_seconds));
        let value =
            |tap: &Tap| known.and_then(|known| known_value(known, tap)).unwrap_or_else(|| self.value(values, *tap));
        let mut begin = 0;
        let mut before: Option<T> = None;
        let sampled = self.ends.iter().map(|end| {
            let taps = &self.taps[begin..*end];
            begin = *end;
            let value = match taps {
                [tap] => value(tap),
                taps => T::mean(taps.iter().map(value)),
            };
            let value = before.map_or(value, |before| value.near(before));
            before = Some(value);
            value
        });
        Track::Sampled(sampled.collect())
    }

    fn value<T: Value>(&self, values: &[T], Tap { key, share, .. }: Tap) -> T {
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

/// The value between keys that is known.
fn known_value<T: Copy>((track, times_seconds): (&Track<T>, &[f64]), tap: &Tap) -> Option<T> {
    match track {
        _ if tap.share == 0.0 => None,
        Track::Rest => None,
        Track::Constant(value) => Some(*value),
        Track::Sampled(values) => {
            let frame = times_seconds.binary_search_by(|time| time.total_cmp(&tap.seconds)).ok()?;
            values.get(frame).copied()
        }
    }
}

fn tap(times_seconds: &[f64], seconds: f64) -> Tap {
    let at_key = |key| Tap { key, share: 0.0, seconds };
    let after = times_seconds.partition_point(|key| *key <= seconds);
    let Some(key) = after.checked_sub(1) else { return at_key(0) };
    let Some(next) = times_seconds.get(after) else { return at_key(key) };
    let share = (seconds - times_seconds[key]) / (next - times_seconds[key]);
    match share {
        share if share < AT_KEY => at_key(key),
        share if share > 1.0 - AT_KEY => at_key(after),
        share => Tap { key, share: share as f32, seconds },
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
