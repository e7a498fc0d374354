//! Rotations, points and scales of several frames at once.
//!
//! One value per frame in plain arrays, so that the compiler turns each loop below into vector instructions. The number of
//! lanes is a constant: results do not depend on the machine.

use glam::{DQuat, DVec3, DVec4, Mat4, Quat, Vec3, Vec4};

use crate::model::rotation::shared_twist;

/// Frames that are worked on at once.
pub(super) const LANES: usize = 16;

/// Frames whose components are exchanged at once when tracks are read or written; divides [`LANES`].
const GROUP: usize = 4;

/// One number per frame.
pub(super) type Lane = [f64; LANES];

/// One quaternion per frame.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct QuatLanes {
    pub(super) x: Lane,
    pub(super) y: Lane,
    pub(super) z: Lane,
    pub(super) w: Lane,
}

/// One vector per frame.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct VecLanes {
    pub(super) x: Lane,
    pub(super) y: Lane,
    pub(super) z: Lane,
}

impl QuatLanes {
    pub(super) const IDENTITY: Self = Self::splat_components(0.0, 0.0, 0.0, 1.0);

    #[inline(always)]
    const fn splat_components(x: f64, y: f64, z: f64, w: f64) -> Self {
        Self { x: [x; LANES], y: [y; LANES], z: [z; LANES], w: [w; LANES] }
    }

    #[inline(always)]
    pub(super) const fn splat(rotation: DQuat) -> Self {
        Self::splat_components(rotation.x, rotation.y, rotation.z, rotation.w)
    }

    /// Takes up to [`LANES`] samples; lanes past the end repeat the last one.
    #[inline(always)]
    pub(super) fn load(&mut self, samples: &[Quat]) {
        if let Ok(samples) = <&[Quat; LANES]>::try_from(samples) {
            for group in (0..LANES).step_by(GROUP) {
                let quat = |lane: usize| Vec4::from(samples[group + lane]);
                let turned = Mat4::from_cols(quat(0), quat(1), quat(2), quat(3)).transpose();
                let widen = |narrow: Vec4, wide: &mut Lane| {
                    narrow.as_dvec4().write_to_slice(&mut wide[group..group + GROUP]);
                };
                widen(turned.x_axis, &mut self.x);
                widen(turned.y_axis, &mut self.y);
                widen(turned.z_axis, &mut self.z);
                widen(turned.w_axis, &mut self.w);
            }
        } else {
            let last = samples.len().saturating_sub(1);
            for lane in 0..LANES {
                let sample = samples.get(lane.min(last)).copied().unwrap_or(Quat::IDENTITY);
                self.set(lane, sample.as_dquat());
            }
        }
    }

    /// Writes as many lanes as `samples` is long, each on the hemisphere of the one before; `before` is the last one of the
    /// previous call, and is brought up to date.
    #[inline(always)]
    pub(super) fn store(&self, samples: &mut [Quat], before: &mut Quat) {
        let mut narrow = [Quat::IDENTITY; LANES];
        for group in (0..LANES).step_by(GROUP) {
            let column = |wide: &Lane| DVec4::from_slice(&wide[group..group + GROUP]).as_vec4();
            let turned =
                Mat4::from_cols(column(&self.x), column(&self.y), column(&self.z), column(&self.w)).transpose();
            let columns = [turned.x_axis, turned.y_axis, turned.z_axis, turned.w_axis];
            for (lane, column) in columns.into_iter().enumerate() {
                narrow[group + lane] = Quat::from_vec4(column);
            }
        }
        // Products of continuous tracks are continuous, so neighbors nearly always lie together already.
        let mut together = narrow[0].dot(*before) >= 0.0;
        for lane in 1..LANES {
            let dot = |values: &Lane| values[lane] * values[lane - 1];
            together &= dot(&self.x) + dot(&self.y) + dot(&self.z) + dot(&self.w) >= 0.0;
        }
        if let (true, Ok(samples)) = (together, <&mut [Quat; LANES]>::try_from(&mut *samples)) {
            *samples = narrow;
            *before = narrow[LANES - 1];
            return;
        }
        for (sample, rotation) in samples.iter_mut().zip(narrow) {
            *sample = if rotation.dot(*before) < 0.0 { -rotation } else { rotation };
            *before = *sample;
        }
    }

    pub(super) fn set(&mut self, lane: usize, rotation: DQuat) {
        (self.x[lane], self.y[lane], self.z[lane], self.w[lane]) = rotation.into();
    }

    #[cfg(test)]
    pub(super) fn get(&self, lane: usize) -> DQuat {
        DQuat::from_xyzw(self.x[lane], self.y[lane], self.z[lane], self.w[lane])
    }

    /// Becomes `first * second`.
    #[inline(always)]
    pub(super) fn set_product(&mut self, first: &Self, second: &Self) {
        for lane in 0..LANES {
            let (ax, ay, az, aw) = (first.x[lane], first.y[lane], first.z[lane], first.w[lane]);
            let (bx, by, bz, bw) = (second.x[lane], second.y[lane], second.z[lane], second.w[lane]);
            self.x[lane] = aw * bx + ax * bw + ay * bz - az * by;
            self.y[lane] = aw * by - ax * bz + ay * bw + az * bx;
            self.z[lane] = aw * bz + ax * by - ay * bx + az * bw;
            self.w[lane] = aw * bw - ax * bx - ay * by - az * bz;
        }
    }

    /// Becomes `first * constant`.
    #[inline(always)]
    pub(super) fn set_product_with_constant(&mut self, first: &Self, constant: DQuat) {
        let (bx, by, bz, bw) = constant.into();
        for lane in 0..LANES {
            let (ax, ay, az, aw) = (first.x[lane], first.y[lane], first.z[lane], first.w[lane]);
            self.x[lane] = aw * bx + ax * bw + ay * bz - az * by;
            self.y[lane] = aw * by - ax * bz + ay * bw + az * bx;
            self.z[lane] = aw * bz + ax * by - ay * bx + az * bw;
            self.w[lane] = aw * bw - ax * bx - ay * by - az * bz;
        }
    }

    /// Becomes `constant * second`.
    #[inline(always)]
    pub(super) fn set_product_of_constant(&mut self, constant: DQuat, second: &Self) {
        let (ax, ay, az, aw) = constant.into();
        for lane in 0..LANES {
            let (bx, by, bz, bw) = (second.x[lane], second.y[lane], second.z[lane], second.w[lane]);
            self.x[lane] = aw * bx + ax * bw + ay * bz - az * by;
            self.y[lane] = aw * by - ax * bz + ay * bw + az * bx;
            self.z[lane] = aw * bz + ax * by - ay * bx + az * bw;
            self.w[lane] = aw * bw - ax * bx - ay * by - az * bz;
        }
    }

    /// Becomes `conjugate(first) * second`: the rotation of `second` as seen from `first`.
    #[inline(always)]
    pub(super) fn set_relative(&mut self, first: &Self, second: &Self) {
        for lane in 0..LANES {
            let (ax, ay, az, aw) = (first.x[lane], first.y[lane], first.z[lane], first.w[lane]);
            let (bx, by, bz, bw) = (second.x[lane], second.y[lane], second.z[lane], second.w[lane]);
            self.x[lane] = aw * bx - ax * bw - ay * bz + az * by;
            self.y[lane] = aw * by + ax * bz - ay * bw - az * bx;
            self.z[lane] = aw * bz - ax * by + ay * bx - az * bw;
            self.w[lane] = aw * bw + ax * bx + ay * by + az * bz;
        }
    }

    /// `self * other`.
    #[inline(always)]
    pub(super) fn times(&self, other: &Self) -> Self {
        let mut result = Self::IDENTITY;
        result.set_product(self, other);
        result
    }

    /// `self * constant`.
    #[inline(always)]
    pub(super) fn times_constant(&self, constant: DQuat) -> Self {
        let mut result = Self::IDENTITY;
        result.set_product_with_constant(self, constant);
        result
    }

    /// `conjugate(self) * other`: the rotation of `other` as seen from `self`.
    #[inline(always)]
    pub(super) fn conjugate_times(&self, other: &Self) -> Self {
        let mut result = Self::IDENTITY;
        result.set_relative(self, other);
        result
    }

    /// Brings quaternions that are unit ones but for rounding back to unit length, without a root or a division: two Newton
    /// steps for the inverse root, which leave a length that was off by a share e off by about e to the fourth. Says whether all
    /// lanes were about that long, and so are finite.
    #[inline(always)]
    pub(super) fn refine_length(&mut self) -> bool {
        let mut is_near = true;
        for lane in 0..LANES {
            let (x, y, z, w) = (self.x[lane], self.y[lane], self.z[lane], self.w[lane]);
            let square = x * x + y * y + z * z + w * w;
            is_near &= square <= 2.0;
            let first = 1.5 - 0.5 * square;
            let factor = first * (1.5 - 0.5 * square * first * first);
            self.x[lane] = x * factor;
            self.y[lane] = y * factor;
            self.z[lane] = z * factor;
            self.w[lane] = w * factor;
        }
        is_near
    }

    /// Unit length in every lane. Lanes of length zero become the identity.
    #[inline(always)]
    pub(super) fn normalized(&self) -> Self {
        let mut result = Self::IDENTITY;
        for lane in 0..LANES {
            let (x, y, z, w) = (self.x[lane], self.y[lane], self.z[lane], self.w[lane]);
            let square = x * x + y * y + z * z + w * w;
            let usable = square > 0.0;
            let factor = if usable { 1.0 / square.sqrt() } else { 0.0 };
            result.x[lane] = x * factor;
            result.y[lane] = y * factor;
            result.z[lane] = z * factor;
            result.w[lane] = if usable { w * factor } else { 1.0 };
        }
        result
    }

    /// Normalized linear interpolation the short way round: 0 gives `self`, 1 gives `other`.
    #[inline(always)]
    pub(super) fn blend(&self, other: &Self, fraction: f64) -> Self {
        let mut result = Self::IDENTITY;
        for lane in 0..LANES {
            let dot = self.x[lane] * other.x[lane]
                + self.y[lane] * other.y[lane]
                + self.z[lane] * other.z[lane]
                + self.w[lane] * other.w[lane];
            let theirs = if dot < 0.0 { -fraction } else { fraction };
            let ours = 1.0 - fraction;
            result.x[lane] = self.x[lane] * ours + other.x[lane] * theirs;
            result.y[lane] = self.y[lane] * ours + other.y[lane] * theirs;
            result.z[lane] = self.z[lane] * ours + other.z[lane] * theirs;
            result.w[lane] = self.w[lane] * ours + other.w[lane] * theirs;
        }
        result.normalized()
    }

    /// Spherical interpolation from a constant rotation, per lane; also beyond 0 and 1.
    #[inline(never)]
    pub(super) fn scaled_from(&self, from: DQuat, alpha: f64) -> Self {
        let mut result = *self;
        for lane in 0..LANES {
            let to = DQuat::from_xyzw(self.x[lane], self.y[lane], self.z[lane], self.w[lane]);
            let mut change = from.conjugate() * to;
            if change.w < 0.0 {
                change = -change;
            }
            let (axis, angle) = change.normalize().to_axis_angle();
            result.set(lane, from * DQuat::from_axis_angle(axis, angle * alpha));
        }
        result
    }

    /// A share of the twist about a unit axis, per lane: the turn about it that is left when everything else is taken away.
    ///
    /// Twists are told apart up to half a turn only, so that those that come near it count less and less ([`shared_twist`]).
    #[inline(never)]
    pub(super) fn twist_share(&self, axis: DVec3, share: f64) -> Self {
        let mut result = *self;
        for lane in 0..LANES {
            let along = DVec3::new(self.x[lane], self.y[lane], self.z[lane]).dot(axis);
            let (along, w) = if self.w[lane] < 0.0 { (-along, -self.w[lane]) } else { (along, self.w[lane]) };
            result.set(lane, DQuat::from_axis_angle(axis, shared_twist(2.0 * along.atan2(w)) * share));
        }
        result
    }

    /// Turns vectors.
    #[inline(always)]
    pub(super) fn rotate(&self, vectors: &VecLanes) -> VecLanes {
        let mut result = VecLanes::ZERO;
        for lane in 0..LANES {
            let (qx, qy, qz, qw) = (self.x[lane], self.y[lane], self.z[lane], self.w[lane]);
            let (vx, vy, vz) = (vectors.x[lane], vectors.y[lane], vectors.z[lane]);
            let (tx, ty, tz) = (2.0 * (qy * vz - qz * vy), 2.0 * (qz * vx - qx * vz), 2.0 * (qx * vy - qy * vx));
            result.x[lane] = vx + qw * tx + (qy * tz - qz * ty);
            result.y[lane] = vy + qw * ty + (qz * tx - qx * tz);
            result.z[lane] = vz + qw * tz + (qx * ty - qy * tx);
        }
        result
    }

    /// Turns vectors the other way.
    #[inline(always)]
    pub(super) fn rotate_back(&self, vectors: &VecLanes) -> VecLanes {
        self.conjugated().rotate(vectors)
    }

    #[inline(always)]
    pub(super) fn conjugated(&self) -> Self {
        let mut result = *self;
        for lane in 0..LANES {
            result.x[lane] = -self.x[lane];
            result.y[lane] = -self.y[lane];
            result.z[lane] = -self.z[lane];
        }
        result
    }
}

impl VecLanes {
    pub(super) const ZERO: Self = Self::splat(DVec3::ZERO);

    #[inline(always)]
    pub(super) const fn splat(vector: DVec3) -> Self {
        Self { x: [vector.x; LANES], y: [vector.y; LANES], z: [vector.z; LANES] }
    }

    /// Takes up to [`LANES`] samples; lanes past the end repeat the last one.
    #[inline(always)]
    pub(super) fn load(samples: &[Vec3]) -> Self {
        let mut result = Self::ZERO;
        let last = samples.len().saturating_sub(1);
        for lane in 0..LANES {
            let sample = samples.get(lane.min(last)).copied().unwrap_or(Vec3::ZERO);
            result.x[lane] = f64::from(sample.x);
            result.y[lane] = f64::from(sample.y);
            result.z[lane] = f64::from(sample.z);
        }
        result
    }

    /// Writes as many lanes as `samples` is long, and says whether they are finite.
    #[inline(always)]
    pub(super) fn store(&self, samples: &mut [Vec3]) -> bool {
        for (lane, sample) in samples.iter_mut().enumerate().take(LANES) {
            #[expect(clippy::cast_possible_truncation, reason = "tracks hold f32")]
            let component = |values: &Lane| values[lane] as f32;
            *sample = Vec3::new(component(&self.x), component(&self.y), component(&self.z));
        }
        samples.iter().all(|sample| sample.is_finite())
    }

    #[inline(always)]
    pub(super) fn zip(&self, other: &Self, combine: impl Fn(f64, f64) -> f64) -> Self {
        let mut result = Self::ZERO;
        for lane in 0..LANES {
            result.x[lane] = combine(self.x[lane], other.x[lane]);
            result.y[lane] = combine(self.y[lane], other.y[lane]);
            result.z[lane] = combine(self.z[lane], other.z[lane]);
        }
        result
    }

    pub(super) fn set(&mut self, lane: usize, vector: DVec3) {
        (self.x[lane], self.y[lane], self.z[lane]) = vector.into();
    }

    #[inline(always)]
    pub(super) const fn get(&self, lane: usize) -> DVec3 {
        DVec3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    #[inline(always)]
    pub(super) fn dot(&self, other: &Self) -> Lane {
        std::array::from_fn(|lane| {
            self.x[lane] * other.x[lane] + self.y[lane] * other.y[lane] + self.z[lane] * other.z[lane]
        })
    }

    /// How far the turn to another direction is within that of a cosine: above zero where it is, zero where there is no direction.
    #[inline(always)]
    pub(super) fn turn_margins(&self, other: &Self, min_cosine: f64) -> Lane {
        let (dots, own, others) = (self.dot(other), self.dot(self), other.dot(other));
        std::array::from_fn(|lane| dots[lane] - min_cosine * (own[lane] * others[lane]).sqrt())
    }

    /// The shortest turns to other directions, of use where the [margins](Self::turn_margins) for a cosine above −1 are above zero.
    #[inline(always)]
    pub(super) fn arcs_to(&self, other: &Self) -> QuatLanes {
        let (dots, own, others) = (self.dot(other), self.dot(self), other.dot(other));
        let mut arcs = QuatLanes::IDENTITY;
        for lane in 0..LANES {
            let (ax, ay, az) = (self.x[lane], self.y[lane], self.z[lane]);
            let (bx, by, bz) = (other.x[lane], other.y[lane], other.z[lane]);
            let w = (own[lane] * others[lane]).sqrt() + dots[lane];
            let (x, y, z) = (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx);
            let factor = 1.0 / (x * x + y * y + z * z + w * w).sqrt();
            (arcs.x[lane], arcs.y[lane]) = (x * factor, y * factor);
            (arcs.z[lane], arcs.w[lane]) = (z * factor, w * factor);
        }
        arcs
    }

    #[inline(always)]
    pub(super) fn plus(&self, other: &Self) -> Self {
        self.zip(other, |ours, theirs| ours + theirs)
    }

    #[inline(always)]
    pub(super) fn minus(&self, other: &Self) -> Self {
        self.zip(other, |ours, theirs| ours - theirs)
    }

    /// Component by component.
    #[inline(always)]
    pub(super) fn times(&self, other: &Self) -> Self {
        self.zip(other, |ours, theirs| ours * theirs)
    }

    /// Component by component; where the divisor is zero, the dividend stays.
    #[inline(always)]
    pub(super) fn over(&self, other: &Self) -> Self {
        self.zip(other, |ours, theirs| if theirs == 0.0 { ours } else { ours / theirs })
    }

    /// Linear interpolation: 0 gives `self`, 1 gives `other`.
    #[inline(always)]
    pub(super) fn blend(&self, other: &Self, fraction: f64) -> Self {
        self.zip(other, |ours, theirs| ours + (theirs - ours) * fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(seed: f64) -> DQuat {
        DQuat::from_xyzw(seed.sin(), (seed * 1.7).cos(), (seed * 0.3).sin(), 0.4 + seed.cos().abs()).normalize()
    }

    #[test]
    fn lanes_agree_with_single_values() {
        let (a, b, v) = (sample(0.3), sample(2.1), DVec3::new(0.2, -1.5, 3.0));
        let (left, right, vector) = (QuatLanes::splat(a), QuatLanes::splat(b), VecLanes::splat(v));
        let near = |lanes: QuatLanes, single: DQuat| (lanes.get(LANES - 1) - single).length() < 1e-14;
        assert!(near(left.times(&right), a * b), "product");
        assert!(near(left.times_constant(b), a * b), "product with a constant");
        assert!(near(left.conjugate_times(&right), a.conjugate() * b), "relative rotation");
        assert!(near(left.blend(&right, 0.0), a) && near(right.blend(&right, 0.5), b), "blend at its ends");
        assert!(near(left.scaled_from(b, 1.0), a) || near(left.scaled_from(b, 1.0), -a), "alpha one");
        assert!(near(left.scaled_from(b, 0.0), b), "alpha zero");
        let turned = left.rotate(&vector);
        let expected = a * v;
        assert!((turned.x[3] - expected.x).abs() < 1e-14 && (turned.z[3] - expected.z).abs() < 1e-14, "rotation");
        assert!((left.rotate_back(&turned).y[0] - v.y).abs() < 1e-14, "and back");
    }

    #[test]
    fn lengths_are_refined_and_hemispheres_kept() {
        let unit = sample(0.9);
        let mut lanes = QuatLanes::splat(unit * 1.001);
        lanes.refine_length();
        assert!((lanes.get(2).length() - 1.0).abs() < 1e-11, "length {}", lanes.get(2).length());
        let mut samples = [Quat::IDENTITY; 3];
        let mut before = -unit.as_quat();
        lanes.store(&mut samples, &mut before);
        assert!(samples.iter().all(|sample| sample.dot(-unit.as_quat()) > 0.99), "on the side of the one before");
    }

    #[test]
    fn short_loads_repeat_the_last_sample() {
        let samples = [Quat::IDENTITY, Quat::from_xyzw(1.0, 0.0, 0.0, 0.0)];
        let mut lanes = QuatLanes::IDENTITY;
        lanes.load(&samples);
        assert!(lanes.get(0).w == 1.0 && lanes.get(LANES - 1).x == 1.0, "last sample repeats");
    }
}
