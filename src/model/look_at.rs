//! What the shapes with which a face looks aside mean, in angles.

/// How a file turns looks into weights of shapes. The default is ARKit's: a shape at 1 looks as far as eyes can.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookAt {
    /// Whether the file moves its eyes by shapes, and not by joints.
    pub by_shapes: bool,
    /// Toward the nose.
    pub inner: LookRange,
    /// Away from it.
    pub outer: LookRange,
    /// Upward.
    pub up: LookRange,
    /// Downward.
    pub down: LookRange,
}

/// An angle and the weight of the shape that looks so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookRange {
    /// Degrees, above 0; looks beyond it count as this.
    pub most_degrees: f64,
    /// The weight there, above 0.
    pub weight: f64,
}

impl Default for LookAt {
    fn default() -> Self {
        let range = |most_degrees| LookRange { most_degrees, weight: 1.0 };
        Self { by_shapes: false, inner: range(30.0), outer: range(30.0), up: range(25.0), down: range(30.0) }
    }
}

impl LookRange {
    /// The weight for an angle in radians; 0 for one to the other side.
    #[must_use]
    pub fn weight(&self, angle: f64) -> f64 {
        (angle.to_degrees() / self.most_degrees).clamp(0.0, 1.0) * self.weight
    }

    /// The angle in radians that a weight stands for.
    #[must_use]
    pub fn angle(&self, weight: f64) -> f64 {
        ((weight / self.weight).clamp(0.0, 1.0) * self.most_degrees).to_radians()
    }
}
