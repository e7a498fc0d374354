//! Points of the source that rest on something, and when.

use glam::DVec3;

/// What was found to touch.
#[derive(Clone, Debug, Default)]
pub(in crate::retarget) struct ContactPoints {
    pub(in crate::retarget) points: Vec<ContactPoint>,
    pub(in crate::retarget) is_touching: bool,
    /// Whether the figure walks on the spot, over a floor that runs.
    pub(in crate::retarget) does_floor_run: bool,
    /// Where feet stand above the floor, too, as on stairs: how high they stand over the source's floor where they stand on it, in its units.
    pub(in crate::retarget) level_below_raised_ground: Option<f64>,
}

/// Which point of a foot or a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::retarget) enum Part {
    /// The back of the heel, or the wrist.
    End,
    /// The ball of the foot.
    Ball,
    /// The tip of the toes.
    Tip,
}

impl Part {
    pub(in crate::retarget) const ALL: [Self; 3] = [Self::End, Self::Ball, Self::Tip];
}

/// A point of the source: where it is, and when it touches.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ContactPoint {
    /// Its name on the wire.
    pub(in crate::retarget) name: &'static str,
    /// Index of its limb.
    pub(in crate::retarget) limb: usize,
    pub(in crate::retarget) part: Part,
    /// Where it is, in plan space, frame by frame.
    pub(in crate::retarget) positions: Vec<DVec3>,
    pub(in crate::retarget) touches: Vec<bool>,
}

impl ContactPoints {
    pub(in crate::retarget) fn find(&self, limb: usize, part: Part) -> Option<&ContactPoint> {
        self.points.iter().find(|point| point.limb == limb && point.part == part)
    }

    /// Whether anything touches at any time.
    pub(in crate::retarget) fn is_anything_touching(&self) -> bool {
        self.is_touching
    }

    /// Whether any point of a limb touches.
    pub(in crate::retarget) fn touches(&self, limb: usize, frame: usize) -> bool {
        self.points.iter().any(|point| point.limb == limb && point.touches[frame])
    }
}
