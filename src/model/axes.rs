//! Up and front axes of a file, and the rotation into the canonical ones.

use std::{fmt, str::FromStr};

use glam::{DMat3, DQuat, DVec3};

/// An axis with a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignedAxis {
    /// +X
    PositiveX,
    /// −X
    NegativeX,
    /// +Y
    PositiveY,
    /// −Y
    NegativeY,
    /// +Z
    PositiveZ,
    /// −Z
    NegativeZ,
}

/// Which axes of a right-handed space are up and front. Written as two signed letters: `+y+z` is up +Y, front +Z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axes {
    up: SignedAxis,
    front: SignedAxis,
}

/// Why text is no pair of axes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{text}' is not a pair of axes: write up and front as two signed letters that differ, such as \"+y+z\"")]
pub struct AxesError {
    /// The text that was seen.
    pub text: String,
}

impl SignedAxis {
    const ALL: [(Self, &'static str); 6] = [
        (Self::PositiveX, "+x"),
        (Self::NegativeX, "-x"),
        (Self::PositiveY, "+y"),
        (Self::NegativeY, "-y"),
        (Self::PositiveZ, "+z"),
        (Self::NegativeZ, "-z"),
    ];

    /// The unit vector.
    #[must_use]
    pub const fn direction(self) -> DVec3 {
        match self {
            Self::PositiveX => DVec3::X,
            Self::NegativeX => DVec3::NEG_X,
            Self::PositiveY => DVec3::Y,
            Self::NegativeY => DVec3::NEG_Y,
            Self::PositiveZ => DVec3::Z,
            Self::NegativeZ => DVec3::NEG_Z,
        }
    }

    /// The axis that a direction is nearest to.
    #[must_use]
    pub fn nearest(direction: DVec3) -> Self {
        let mut best = (Self::PositiveX, f64::NEG_INFINITY);
        for (axis, _) in Self::ALL {
            let cosine = axis.direction().dot(direction);
            if cosine > best.1 {
                best = (axis, cosine);
            }
        }
        best.0
    }

    /// Two characters, such as `+y`.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(axis, _)| *axis == self).map_or("", |(_, name)| name)
    }
}

impl Axes {
    /// Our own space: +Y up, +Z front.
    pub const Y_UP_Z_FRONT: Self = Self { up: SignedAxis::PositiveY, front: SignedAxis::PositiveZ };
    /// +Z up, +Y front (x left).
    pub const Z_UP_Y_FRONT: Self = Self { up: SignedAxis::PositiveZ, front: SignedAxis::PositiveY };

    /// Up and front must lie on different axes.
    #[must_use]
    pub fn new(up: SignedAxis, front: SignedAxis) -> Option<Self> {
        (up.direction().dot(front.direction()) == 0.0).then_some(Self { up, front })
    }

    /// Which axis is up.
    #[must_use]
    pub const fn up(self) -> SignedAxis {
        self.up
    }

    /// Which axis is front.
    #[must_use]
    pub const fn front(self) -> SignedAxis {
        self.front
    }

    /// The rotation that takes this space to +Y up, +Z front.
    #[must_use]
    pub fn canonical_from_this(self) -> DQuat {
        let up = self.up.direction();
        let front = self.front.direction();
        let this_from_canonical = DMat3::from_cols(up.cross(front), up, front);
        DQuat::from_mat3(&this_from_canonical).conjugate()
    }
}

impl Default for Axes {
    fn default() -> Self {
        Self::Y_UP_Z_FRONT
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}{}", self.up.name(), self.front.name())
    }
}

impl FromStr for Axes {
    type Err = AxesError;

    fn from_str(text: &str) -> Result<Self, AxesError> {
        let error = || AxesError { text: text.to_owned() };
        let lower = text.trim().to_ascii_lowercase();
        let (up, front) = lower.split_at_checked(2).ok_or_else(error)?;
        let axis = |name: &str| SignedAxis::ALL.iter().find(|entry| entry.1 == name).map(|entry| entry.0);
        let (up, front) = (axis(up).ok_or_else(error)?, axis(front).ok_or_else(error)?);
        Self::new(up, front).ok_or_else(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_axes_lands_on_ours() {
        for (up, _) in SignedAxis::ALL {
            for (front, _) in SignedAxis::ALL {
                let Some(axes) = Axes::new(up, front) else { continue };
                let rotation = axes.canonical_from_this();
                assert!((rotation * up.direction() - DVec3::Y).length() < 1e-12, "{axes}: up");
                assert!((rotation * front.direction() - DVec3::Z).length() < 1e-12, "{axes}: front");
                assert_eq!(axes.to_string().parse(), Ok(axes), "text and back");
            }
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["", "+y", "+y+y", "yz", "+y-y", "+a+z", "é+y+z"] {
            assert!(text.parse::<Axes>().is_err(), "{text:?}");
        }
    }
}
