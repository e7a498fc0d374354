//! A limb: where it begins on the trunk, where it bends and where it ends.

use glam::DVec2;

use super::shape::Shape;

/// Part of a limb that cannot be its root.
const BEFORE_ROOT: f64 = 0.25;
/// How much wider than the limb the trunk is where the limb begins.
const ROOT_WIDER: f64 = 1.45;
/// How far before that place the root is, in half widths of the limb.
const ROOT_BEFORE: f64 = 0.5;
/// How wide, of the limb's usual width, the place is where its last joint lies.
const END_WIDTH: f64 = 0.8;
/// How far before the end of the limb that joint lies at least, as a share of the limb.
const END_BEFORE: f64 = 0.06;
/// Parts of a limb between which it bends.
const BENDS: [f64; 2] = [0.35, 0.65];
/// How far from the straight line a bend is, as a share of the limb.
const BENT: f64 = 0.1;

/// A limb, in pixels of the shape.
#[derive(Clone, Debug)]
pub(super) struct Limb {
    /// The joint at its end, such as a hand.
    pub(super) end: DVec2,
    /// The joint in between.
    pub(super) bend: DVec2,
    /// Where it leaves the trunk.
    pub(super) root: DVec2,
    /// From end to root.
    pub(super) length: f64,
    /// Half of its usual width.
    pub(super) half_width: f64,
}

impl Limb {
    /// The limb along a way, of which the first `own` pixels are not shared with other limbs.
    pub(super) fn new(shape: &Shape, way: &[usize], own: usize) -> Self {
        let own = own.clamp(1, way.len());
        let half_width = shape.median_depth(&way[..own]).max(0.5);
        let from = (own as f64 * BEFORE_ROOT) as usize;
        let is_wide = |index: &usize| shape.depth[way[*index]] > ROOT_WIDER * half_width;
        let root = (from..own).find(is_wide).unwrap_or(own - 1);
        // The limb is wide already where it spreads into the trunk.
        let root = root - ((ROOT_BEFORE * half_width) as usize).min(root - from.min(root));
        Self::between(shape, way, root)
    }

    /// The limb along a way as far as a pixel of it.
    pub(super) fn between(shape: &Shape, way: &[usize], root: usize) -> Self {
        let limb = &way[..=root.min(way.len() - 1)];
        let half_width = shape.median_depth(limb).max(0.5);
        let is_end = |&pixel: &usize| shape.depth[pixel] >= END_WIDTH * half_width;
        let end = limb.iter().position(is_end).unwrap_or(0).min(limb.len() / 3);
        let end = end + (END_BEFORE * (limb.len() - end) as f64) as usize;
        let limb = &limb[end..];
        let place = |index: usize| shape.place(limb[index]);
        let (first, last) = (place(0), place(limb.len() - 1));
        Self { end: first, bend: bend(shape, limb), root: last, length: shape.length(limb), half_width }
    }
}

/// Where a limb is farthest from straight, and half way along it where it is straight.
fn bend(shape: &Shape, limb: &[usize]) -> DVec2 {
    let half = shape.along(limb, 0.5);
    let (Some(&first), Some(&last)) = (limb.first(), limb.last()) else { return half };
    let (first, chord) = (shape.place(first), shape.place(last) - shape.place(first));
    let off = |pixel: usize| chord.normalize_or_zero().perp_dot(shape.place(pixel) - first).abs();
    let [from, to] = BENDS.map(|share| (limb.len() as f64 * share) as usize);
    let bent = limb[from..to.max(from)].iter().max_by(|one, other| off(**one).total_cmp(&off(**other)));
    match bent {
        Some(&pixel) if off(pixel) > BENT * shape.length(limb) => shape.place(pixel),
        _ => half,
    }
}
