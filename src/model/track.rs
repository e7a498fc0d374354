//! The values of one channel over the frames of a clip.

use std::ops::Range;

use glam::{DQuat, DVec3, Quat, Vec3};

/// One channel of one joint: a translation, a rotation or a scale.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Track<T> {
    /// Not animated: the joint's own rest value holds.
    #[default]
    Rest,
    /// Animated, with one value at all frames.
    Constant(T),
    /// One value per frame of the clip.
    Sampled(Vec<T>),
}

impl<T: Copy> Track<T> {
    /// The value at a frame, or `rest` where the channel is not animated.
    ///
    /// # Panics
    /// When the frame is past the end of a sampled track.
    #[must_use]
    pub fn at(&self, frame: usize, rest: T) -> T {
        match self {
            Self::Rest => rest,
            Self::Constant(value) => *value,
            Self::Sampled(values) => values[frame],
        }
    }

    /// The track with all of its values changed; one at rest stays so.
    #[must_use]
    pub fn map<U>(&self, change: impl Fn(T) -> U) -> Track<U> {
        match self {
            Self::Rest => Track::Rest,
            Self::Constant(value) => Track::Constant(change(*value)),
            Self::Sampled(values) => Track::Sampled(values.iter().map(|value| change(*value)).collect()),
        }
    }

    /// Whether the file animates this channel.
    #[must_use]
    pub const fn is_animated(&self) -> bool {
        !matches!(self, Self::Rest)
    }

    /// The number of samples, where there are any.
    #[must_use]
    pub const fn sample_count(&self) -> Option<usize> {
        match self {
            Self::Sampled(values) => Some(values.len()),
            Self::Rest | Self::Constant(_) => None,
        }
    }

    /// The track of some of the frames.
    ///
    /// # Panics
    /// When a frame is past the end of a sampled track.
    #[must_use]
    pub fn section(&self, frames: Range<usize>) -> Self {
        match self {
            Self::Rest => Self::Rest,
            Self::Constant(value) => Self::Constant(*value),
            Self::Sampled(values) => Self::Sampled(values[frames].to_vec()),
        }
    }

    /// The track of these frames, in their order.
    ///
    /// # Panics
    /// When a frame is past the end of a sampled track.
    #[must_use]
    pub fn of_frames(&self, frames: &[usize]) -> Self {
        match self {
            Self::Rest => Self::Rest,
            Self::Constant(value) => Self::Constant(*value),
            Self::Sampled(values) => Self::Sampled(frames.iter().map(|frame| values[*frame]).collect()),
        }
    }

    /// Makes a constant track into a sampled one.
    #[must_use]
    pub fn sampled(self, frames: usize) -> Self {
        match self {
            Self::Constant(value) => Self::Sampled(vec![value; frames]),
            other => other,
        }
    }

    /// Makes a sampled track whose values are all the same into a constant one.
    #[must_use]
    pub fn compacted(self) -> Self
    where
        T: PartialEq,
    {
        match self {
            Self::Sampled(values) if values.windows(2).all(|pair| pair[0] == pair[1]) => {
                values.first().map_or(Self::Rest, |first| Self::Constant(*first))
            }
            other => other,
        }
    }
}

impl Track<Vec3> {
    /// The value at a frame, to count with. A rest transform has all its digits, and keeps them.
    ///
    /// # Panics
    /// When the frame is past the end of a sampled track.
    #[must_use]
    pub fn wide_at(&self, frame: usize, rest: DVec3) -> DVec3 {
        match self {
            Self::Rest => rest,
            Self::Constant(value) => value.as_dvec3(),
            Self::Sampled(values) => values[frame].as_dvec3(),
        }
    }
}

impl Track<Quat> {
    /// The rotation at a frame likewise. One of a track is of unit length but for the rounding of its numbers.
    ///
    /// # Panics
    /// When the frame is past the end of a sampled track.
    #[must_use]
    pub fn wide_at(&self, frame: usize, rest: DQuat) -> DQuat {
        match self {
            Self::Rest => rest,
            Self::Constant(value) => value.as_dquat(),
            Self::Sampled(values) => values[frame].as_dquat(),
        }
    }

    /// The same rotations, each from the second on written on the hemisphere of the one before: q and −q are one rotation, but
    /// players interpolate the short way only between neighbors that lie together.
    #[must_use]
    pub fn on_one_hemisphere(mut self) -> Self {
        if let Self::Sampled(values) = &mut self {
            super::rotation::join_hemispheres(values);
        }
        self
    }
}
