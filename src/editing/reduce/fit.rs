//! Curves through the values of one track, with as few keys as may be.
//!
//! From each key the farthest frame is looked for up to which one piece of curve stays within what is allowed: a straight one, or a
//! cubic whose tangents are the least-squares ones for the frames between. Pieces begin and end on values of the track, so they do not
//! depend on each other, and taking the farthest one each time gives the fewest. Of both curves the one that takes less room is kept.

use glam::DVec4;

use crate::{model::hermite, retarget::KeyInterpolation};

/// A key is kept at least every so many frames, which keeps the search for keys short.
const LONGEST_PIECE: usize = 512;
/// Numbers per key besides the values: its time.
const TIME: usize = 1;

/// What the values of a track are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Vectors, in the first three components.
    Vector,
    /// Unit quaternions, each on the same hemisphere as the one before.
    Rotation,
}

/// The keys of one track.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Keys {
    pub(super) frames: Vec<usize>,
    /// One per frame that has a key.
    pub(super) values: Vec<DVec4>,
    /// Changes per second before and after each key; empty where the curve is linear.
    pub(super) tangents: Vec<[DVec4; 2]>,
}

/// One piece of a cubic: its tangents, as changes over the whole piece.
type Tangents = [DVec4; 2];

/// What a track may be off: a distance, of rotations that of a point 1 from the joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Allowed<'a> {
    pub(super) distance: f64,
    /// By how much finer it is in each frame; empty where it is the same in all.
    pub(super) finer: &'a [f64],
}

impl Allowed<'_> {
    pub(super) fn divided(self, by: f64) -> Self {
        Self { distance: self.distance / by, ..self }
    }

    fn at(&self, frame: usize) -> f64 {
        self.finer.get(frame).map_or(self.distance, |finer| self.distance / finer)
    }
}

/// The keys that are needed so that no frame is off by more than what is allowed. Without any allowance every frame is a key.
pub(super) fn fit(
    values: &[DVec4],
    times: &[f64],
    allowed: Allowed<'_>,
    kind: Kind,
    interpolation: KeyInterpolation,
) -> Keys {
    if allowed.distance <= 0.0 {
        return Keys { frames: (0..values.len()).collect(), values: values.to_vec(), tangents: Vec::new() };
    }
    if values.iter().enumerate().all(|(frame, value)| kind.error(*value, values[0]) <= allowed.at(frame)) {
        return Keys { frames: vec![0], values: vec![values[0]], tangents: Vec::new() };
    }
    let track = Samples { values, times, allowed, kind };
    match interpolation {
        KeyInterpolation::Linear => track.linear(),
        KeyInterpolation::Cubic => track.cubic(),
        KeyInterpolation::Auto => {
            let (linear, cubic) = (track.linear(), track.cubic());
            if track.room(&cubic) < track.room(&linear) { cubic } else { linear }
        }
    }
}

impl Kind {
    /// How far a value is from another one.
    pub(super) fn error(self, first: DVec4, second: DVec4) -> f64 {
        match self {
            Self::Vector => first.distance(second),
            Self::Rotation => {
                // |p − q| of unit quaternions is twice the sine of a quarter of the angle; the chord is twice the sine of half of it.
                let half = first.distance(second).min((first + second).length()) / 2.0;
                let half = half.min(std::f64::consts::FRAC_1_SQRT_2);
                4.0 * half * (1.0 - half * half).sqrt()
            }
        }
    }

    /// A value on the straight way, of rotations on the shortest arc, as readers find it.
    fn between(self, first: DVec4, second: DVec4, share: f64) -> DVec4 {
        match self {
            Self::Vector => first.lerp(second, share),
            Self::Rotation => {
                let [first, second] = [first, second].map(glam::DQuat::from_vec4);
                DVec4::from(first.slerp(second, share))
            }
        }
    }

    /// What a sum of values stands for.
    fn valid(self, sum: DVec4) -> DVec4 {
        match self {
            Self::Vector => sum,
            Self::Rotation => sum.normalize_or(DVec4::W),
        }
    }

    const fn width(self) -> usize {
        match self {
            Self::Vector => 3,
            Self::Rotation => 4,
        }
    }
}

struct Samples<'a> {
    values: &'a [DVec4],
    times: &'a [f64],
    allowed: Allowed<'a>,
    kind: Kind,
}

impl Samples<'_> {
    fn linear(&self) -> Keys {
        let pieces = self.pieces(|start, end| self.is_straight(start, end).then_some(()));
        let frames: Vec<usize> = std::iter::once(0).chain(pieces.into_iter().map(|(end, ())| end)).collect();
        Keys { values: frames.iter().map(|frame| self.values[*frame]).collect(), frames, tangents: Vec::new() }
    }

    fn cubic(&self) -> Keys {
        let pieces = self.pieces(|start, end| self.cubic_piece(start, end));
        let mut keys = Keys { frames: vec![0], values: vec![self.values[0]], tangents: vec![[DVec4::ZERO; 2]] };
        let mut start = 0;
        for (piece, (end, tangents)) in pieces.into_iter().enumerate() {
            let seconds = self.times[end] - self.times[start];
            keys.tangents[piece][1] = tangents[0] / seconds;
            keys.frames.push(end);
            keys.values.push(self.values[end]);
            keys.tangents.push([tangents[1] / seconds, DVec4::ZERO]);
            start = end;
        }
        keys
    }

    /// How many numbers the keys are.
    fn room(&self, keys: &Keys) -> usize {
        let values = if keys.tangents.is_empty() { 1 } else { 3 };
        keys.frames.len() * (TIME + values * self.kind.width())
    }

    /// The end of each piece, and what it is.
    fn pieces<P>(&self, piece: impl Fn(usize, usize) -> Option<P>) -> Vec<(usize, P)> {
        let last = self.values.len() - 1;
        let (mut start, mut found) = (0, Vec::new());
        while start < last {
            let most = (last - start).min(LONGEST_PIECE);
            // A piece from one frame to the next has nothing between them, and always fits.
            let (mut fits, mut too_far) = (0, most + 1);
            let mut best = None;
            let mut length = 1;
            while fits + 1 < too_far {
                match piece(start, start + length) {
                    Some(piece) => {
                        fits = length;
                        best = Some(piece);
                        length = if too_far > most { (length * 2).min(most) } else { fits.midpoint(too_far) };
                    }
                    None => {
                        too_far = length;
                        length = fits.midpoint(too_far);
                    }
                }
            }
            let Some(piece) = best else { break };
            start += fits;
            found.push((start, piece));
        }
        found
    }

    /// Where a frame lies on the way from one to another.
    fn share(&self, start: usize, end: usize, frame: usize) -> f64 {
        (self.times[frame] - self.times[start]) / (self.times[end] - self.times[start])
    }

    fn is_straight(&self, start: usize, end: usize) -> bool {
        (start + 1..end).all(|frame| {
            let value = self.kind.between(self.values[start], self.values[end], self.share(start, end, frame));
            self.kind.error(self.values[frame], value) <= self.allowed.at(frame)
        })
    }

    /// The tangents of the cubic between two frames; nothing where it is too far from a frame between them.
    fn cubic_piece(&self, start: usize, end: usize) -> Option<Tangents> {
        let ends = [self.values[start], self.values[end]];
        // Σ (A·m₀ + B·m₁ − r)² is least where [ΣAA ΣAB; ΣAB ΣBB] · [m₀; m₁] = [ΣA·r; ΣB·r].
        let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
        let (mut ar, mut br) = (DVec4::ZERO, DVec4::ZERO);
        for frame in start + 1..end {
            let share = self.share(start, end, frame);
            let (a, b) = (share * (1.0 - share).powi(2), -share * share * (1.0 - share));
            let missing = self.values[frame] - hermite(share, ends, [DVec4::ZERO; 2]);
            aa += a * a;
            ab += a * b;
            bb += b * b;
            ar += missing * a;
            br += missing * b;
        }
        // With a single frame between, many tangents fit: the smallest ones are taken.
        let ridge = 1e-9 * (aa + bb) + f64::MIN_POSITIVE;
        let (aa, bb) = (aa + ridge, bb + ridge);
        let volume = aa * bb - ab * ab;
        let tangents = if end == start + 1 {
            [ends[1] - ends[0]; 2]
        } else {
            [(ar * bb - br * ab) / volume, (br * aa - ar * ab) / volume]
        };
        let fits = (start + 1..end).all(|frame| {
            let value = self.kind.valid(hermite(self.share(start, end, frame), ends, tangents));
            self.kind.error(self.values[frame], value) <= self.allowed.at(frame)
        });
        fits.then_some(tangents)
    }
}

impl Keys {
    /// The value at each frame.
    pub(super) fn at_frames<'a>(&'a self, times: &'a [f64], kind: Kind) -> impl Iterator<Item = DVec4> + 'a {
        let mut piece = 0;
        (0..times.len()).map(move |frame| {
            while self.frames.get(piece + 1).is_some_and(|next| *next <= frame) {
                piece += 1;
            }
            let start = self.frames[piece];
            let Some(end) = self.frames.get(piece + 1).copied().filter(|_| frame != start) else {
                return self.values[piece];
            };
            let seconds = times[end] - times[start];
            let share = (times[frame] - times[start]) / seconds;
            let ends = [self.values[piece], self.values[piece + 1]];
            match self.tangents.get(piece..piece + 2) {
                Some([first, second]) => kind.valid(hermite(share, ends, [first[1] * seconds, second[0] * seconds])),
                _ => kind.between(ends[0], ends[1], share),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times() -> Vec<f64> {
        (0..=120).map(|frame| f64::from(frame) / 30.0).collect()
    }

    fn allowed(distance: f64) -> Allowed<'static> {
        Allowed { distance, finer: &[] }
    }

    fn worst(keys: &Keys, values: &[DVec4], times: &[f64], kind: Kind) -> f64 {
        keys.at_frames(times, kind).zip(values).map(|(ours, value)| kind.error(ours, *value)).fold(0.0, f64::max)
    }

    #[test]
    fn a_cubic_is_one_piece_and_a_corner_two_straight_ones() {
        let times = times();
        let cubic: Vec<DVec4> = times.iter().map(|t| DVec4::new(t * t * t - t, 2.0 * t, 1.0, 0.0)).collect();
        let keys = fit(&cubic, &times, allowed(1e-6), Kind::Vector, KeyInterpolation::Auto);
        assert_eq!((keys.frames.as_slice(), keys.tangents.len()), (&[0, 120][..], 2), "one cubic");
        assert!(worst(&keys, &cubic, &times, Kind::Vector) < 1e-6, "through all of its values");
        let corner: Vec<DVec4> = times.iter().map(|t| DVec4::X * (t - 2.0).abs()).collect();
        let keys = fit(&corner, &times, allowed(1e-6), Kind::Vector, KeyInterpolation::Auto);
        assert_eq!((keys.frames.as_slice(), keys.tangents.len()), (&[0, 60, 120][..], 0), "two straight pieces");
    }

    #[test]
    fn rotations_stay_within_what_is_allowed() {
        let times = times();
        let turn = |t: &f64| {
            let swing = glam::DQuat::from_rotation_x((t * 3.0).sin()) * glam::DQuat::from_rotation_y(t * 0.7);
            DVec4::from(swing)
        };
        let values: Vec<DVec4> = times.iter().map(turn).collect();
        let mut counts = Vec::new();
        for interpolation in [KeyInterpolation::Linear, KeyInterpolation::Cubic, KeyInterpolation::Auto] {
            let keys = fit(&values, &times, allowed(1e-3), Kind::Rotation, interpolation);
            let worst = worst(&keys, &values, &times, Kind::Rotation);
            assert!(worst <= 1e-3 + 1e-12, "{interpolation:?}: {worst}");
            counts.push(keys.frames.len());
        }
        assert!(counts[1] * 4 < counts[0], "cubics need far fewer keys than straight pieces: {counts:?}");
        assert_eq!(counts[2], counts[1], "and less room");
    }

    #[test]
    fn what_is_nearly_still_has_one_key_and_no_allowance_keeps_all() {
        let times = times();
        let values: Vec<DVec4> = times.iter().map(|t| DVec4::Y * (1.0 + 1e-4 * t.sin())).collect();
        assert_eq!(fit(&values, &times, allowed(1e-3), Kind::Vector, KeyInterpolation::Auto).frames, [0]);
        let all = fit(&values, &times, allowed(0.0), Kind::Vector, KeyInterpolation::Auto);
        assert_eq!((all.frames.len(), all.values.as_slice()), (121, values.as_slice()), "to the bit");
    }
}
