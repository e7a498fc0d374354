//! Numbers of the plane, and what a factorization needs of numbers.

use std::ops::{Add, AddAssign, Mul, Sub, SubAssign};

use glam::DVec2;

/// A complex number: x is real, y imaginary.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Complex(pub(super) DVec2);

impl Complex {
    pub(super) fn new(real: f64, imaginary: f64) -> Self {
        Self(DVec2::new(real, imaginary))
    }

    /// The angle from the real axis, in radians.
    pub(super) fn angle(self) -> f64 {
        self.0.y.atan2(self.0.x)
    }

    /// Of length 1 in the same direction; 1 where there is none.
    pub(super) fn unit(self) -> Self {
        Self(self.0.try_normalize().unwrap_or(DVec2::X))
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Sub for Complex {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self(DVec2::new(self.0.x * other.0.x - self.0.y * other.0.y, self.0.x * other.0.y + self.0.y * other.0.x))
    }
}

impl AddAssign for Complex {
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}

impl SubAssign for Complex {
    fn sub_assign(&mut self, other: Self) {
        self.0 -= other.0;
    }
}

/// An entry of a Hermitian matrix, real or complex.
pub(super) trait Entry: Copy + Default + SubAssign + AddAssign + Mul<Output = Self> {
    fn conjugate(self) -> Self;
    /// The square of the absolute value.
    fn square(self) -> f64;
    fn real(self) -> f64;
    fn scaled(self, factor: f64) -> Self;
    /// The product with a complex number.
    fn times(self, other: Complex) -> Complex;
    /// Rounded to single precision.
    fn single(self) -> Self;
}

impl Entry for f64 {
    fn conjugate(self) -> Self {
        self
    }
    fn square(self) -> f64 {
        self * self
    }
    fn real(self) -> f64 {
        self
    }
    fn scaled(self, factor: f64) -> Self {
        self * factor
    }
    fn times(self, other: Complex) -> Complex {
        Complex(other.0 * self)
    }
    fn single(self) -> Self {
        Self::from(self as f32)
    }
}

impl Entry for Complex {
    fn conjugate(self) -> Self {
        Self::new(self.0.x, -self.0.y)
    }
    fn square(self) -> f64 {
        self.0.length_squared()
    }
    fn real(self) -> f64 {
        self.0.x
    }
    fn scaled(self, factor: f64) -> Self {
        Self(self.0 * factor)
    }
    fn times(self, other: Self) -> Self {
        self * other
    }
    fn single(self) -> Self {
        Self::new(self.0.x.single(), self.0.y.single())
    }
}
