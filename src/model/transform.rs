//! Translation, rotation and scale, and how they compose.

use glam::{DMat4, DQuat, DVec3};

/// A translation, a rotation and a scale, applied to a point as `translation + rotation · (scale ∘ point)`.
///
/// Composition is component-wise in scale (`scale = parent.scale ∘ child.scale`), so a rotated non-uniform scale never
/// becomes shear. A matrix product would give shear there; for uniform scales the two agree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Meters, in the parent's space.
    pub translation: DVec3,
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Factors along the child's own axes.
    pub scale: DVec3,
}

impl Transform {
    /// The transform that changes nothing.
    pub const IDENTITY: Self = Self { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE };

    /// A pure translation.
    #[must_use]
    pub const fn from_translation(translation: DVec3) -> Self {
        Self { translation, ..Self::IDENTITY }
    }

    /// A pure rotation.
    #[must_use]
    pub const fn from_rotation(rotation: DQuat) -> Self {
        Self { rotation, ..Self::IDENTITY }
    }

    /// Moves a point out of this transform's space into the parent's.
    #[inline]
    #[must_use]
    pub fn transform_point(&self, point: DVec3) -> DVec3 {
        self.translation + self.rotation * (self.scale * point)
    }

    /// `grandparent_from_child = grandparent_from_parent.then_child(parent_from_child)`.
    #[inline]
    #[must_use]
    pub fn then_child(&self, parent_from_child: &Self) -> Self {
        Self {
            translation: self.transform_point(parent_from_child.translation),
            rotation: self.rotation * parent_from_child.rotation,
            scale: self.scale * parent_from_child.scale,
        }
    }

    /// `parent_from_child = grandparent_from_parent.relative(grandparent_from_child)`: the inverse of [`Self::then_child`].
    ///
    /// A scale component of zero has no inverse; it counts as one, so the result stays finite.
    #[must_use]
    pub fn relative(&self, grandparent_from_child: &Self) -> Self {
        let inverse_scale = inverse_scale(self.scale);
        let inverse_rotation = self.rotation.conjugate();
        Self {
            translation: inverse_rotation * (grandparent_from_child.translation - self.translation) * inverse_scale,
            rotation: inverse_rotation * grandparent_from_child.rotation,
            scale: grandparent_from_child.scale * inverse_scale,
        }
    }

    /// The same as a matrix.
    #[must_use]
    pub fn to_matrix(&self) -> DMat4 {
        DMat4::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }

    /// Splits a matrix; shear, which has no place here, is lost. Mirroring becomes a negative scale.
    #[must_use]
    pub fn from_matrix(matrix: &DMat4) -> Self {
        let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
        let rotation = if rotation.is_finite() { rotation.normalize() } else { DQuat::IDENTITY };
        Self { translation, rotation, scale }
    }

    /// Whether all ten numbers are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.translation.is_finite() && self.rotation.is_finite() && self.scale.is_finite()
    }
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

fn inverse_scale(scale: DVec3) -> DVec3 {
    let invert = |factor: f64| if factor == 0.0 { 1.0 } else { factor.recip() };
    DVec3::new(invert(scale.x), invert(scale.y), invert(scale.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> (Transform, Transform) {
        let parent = Transform {
            translation: DVec3::new(1.0, 2.0, 3.0),
            rotation: DQuat::from_rotation_z(0.7),
            scale: DVec3::splat(2.0),
        };
        let child = Transform {
            translation: DVec3::new(-0.5, 0.25, 4.0),
            rotation: DQuat::from_rotation_x(-1.1),
            scale: DVec3::new(0.5, 1.5, 1.0),
        };
        (parent, child)
    }

    #[test]
    fn relative_undoes_then_child() {
        let (parent, child) = sample();
        let back = parent.relative(&parent.then_child(&child));
        assert!((back.translation - child.translation).length() < 1e-12, "translation comes back");
        assert!(back.rotation.angle_between(child.rotation) < 1e-7, "rotation comes back");
        assert!((back.scale - child.scale).length() < 1e-12, "scale comes back");
    }

    #[test]
    fn uniform_scales_agree_with_matrices() {
        let (parent, mut child) = sample();
        child.scale = DVec3::splat(0.5);
        let composed = parent.then_child(&child).to_matrix();
        let product = parent.to_matrix() * child.to_matrix();
        assert!(composed.abs_diff_eq(product, 1e-12), "composition is the matrix product where there is no shear");
    }

    #[test]
    fn a_zero_scale_stays_finite() {
        let flat = Transform { scale: DVec3::new(1.0, 0.0, 1.0), ..Transform::IDENTITY };
        assert!(flat.relative(&Transform::IDENTITY).is_finite(), "no division by zero");
    }
}
