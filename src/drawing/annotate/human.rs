//! A human figure in a shape: which tips are head, hands and feet, and where the joints between them are.

use glam::DVec2;

use super::{
    joints::{Fit, NoFit},
    shape::{Shape, Tip},
};

/// How far beside the axis counts as how far below the top, where a head is looked for.
const HEAD_BESIDE: f64 = 1.2;
/// Half of the width of a head, as a share of the height, from which on more does not make it more of a head.
const WIDE_HEAD: f64 = 0.11;
/// The narrowest head, as a share of the height, and of half of the width of the trunk.
const MIN_HEAD: f64 = 0.03;
const MIN_HEAD_OF_TRUNK: f64 = 0.28;
/// How near to the middle of the head the way of what hangs on it leads, in half widths of the head.
const HAIR: f64 = 0.65;
/// How far hands and feet stand out at least, as a share of the height.
const MIN_LIMB: f64 = 0.075;
/// How sure a figure has to be to be one.
pub(super) const MIN_SURE: f64 = 0.5;

/// What has been found of a figure.
pub(super) struct Found<'a> {
    pub(super) shape: &'a Shape,
    /// The right foot and the left one, as tips; the figure's own right is on the left of the picture.
    pub(super) feet: Option<[usize; 2]>,
    /// The middle of the head, and half of its width.
    pub(super) head: (DVec2, f64),
    /// The tip that the head is at; none where it is one with the trunk.
    pub(super) head_tip: Option<usize>,
    pub(super) hands: [Option<usize>; 2],
    /// The column of the trunk.
    pub(super) axis: f64,
}

/// Fits a human figure.
pub(super) fn fit(shape: &Shape) -> Result<Fit, NoFit> {
    let feet = feet(shape);
    let center = shape.place(shape.center);
    let axis = feet.map_or(center.x, |feet| {
        let middle = feet.iter().map(|&foot| tip_place(shape, foot).x).sum::<f64>() / 2.0;
        f64::midpoint(middle, center.x)
    });
    let head_tip = head_tip(shape, feet, axis);
    let head = head_tip.map_or((center, shape.depth[shape.center]), |tip| head_of(shape, tip, feet));
    let mut found = Found { shape, feet, head, head_tip, hands: [None; 2], axis };
    found.refuse_animals()?;
    found.hands = found.find_hands();
    if feet.is_none() && found.hands.iter().all(Option::is_none) {
        return Err(NoFit::new("neither arms nor legs stand out of it"));
    }
    found.joints()
}

fn tip_place(shape: &Shape, tip: usize) -> DVec2 {
    shape.place(shape.tips[tip].way[0])
}

/// The two tips that are most like feet: low, far from where they meet, as low as each other.
fn feet(shape: &Shape) -> Option<[usize; 2]> {
    let (top, height) = (shape.bounds[1], shape.height());
    let low = |tip: usize| (tip_place(shape, tip).y - top) / height;
    let center = (shape.place(shape.center).y - top) / height;
    let mut best: Option<(f64, [usize; 2])> = None;
    for one in 0..shape.tips.len() {
        for other in one + 1..shape.tips.len() {
            let [first, second] = [one, other].map(|tip| &shape.tips[tip].way[..]);
            let own = |way: &[usize], other: &[usize]| shape.length(&way[..shape.own(way, &[other])]) / height;
            let apart = own(first, second).min(own(second, first));
            if apart < MIN_LIMB || low(one).min(low(other)) < center {
                continue;
            }
            let score = 0.75 * (low(one) + low(other)) + 2.0 * apart.min(0.3) - (low(one) - low(other)).abs();
            if best.is_none_or(|best| score > best.0) {
                best = Some((score, [one, other]));
            }
        }
    }
    let (_, mut feet) = best?;
    feet.sort_by(|one, other| tip_place(shape, *one).x.total_cmp(&tip_place(shape, *other).x));
    Some(feet)
}

fn is_foot(feet: Option<[usize; 2]>, tip: usize) -> bool {
    feet.is_some_and(|feet| feet.contains(&tip))
}

/// The tip that is most like a head: high, above the trunk, wide.
fn head_tip(shape: &Shape, feet: Option<[usize; 2]>, axis: f64) -> Option<usize> {
    let (top, height) = (shape.bounds[1], shape.height());
    let trunk = shape.depth[shape.center];
    let cost = |&tip: &usize| {
        let place = tip_place(shape, tip);
        let (middle, half_width) = head_of(shape, tip, feet);
        let beside = f64::midpoint((place.x - axis).abs(), (middle.x - axis).abs());
        let wide = (half_width / height / WIDE_HEAD).min(1.0);
        (place.y - top) / height + HEAD_BESIDE * beside / height - 0.6 * wide
    };
    let can_be = |&tip: &usize| {
        let (middle, half_width) = head_of(shape, tip, feet);
        let is_above = middle.y < shape.place(shape.center).y && tip_place(shape, tip).y < middle.y + half_width;
        let is_wide = half_width > MIN_HEAD * height && half_width > MIN_HEAD_OF_TRUNK * trunk;
        !is_foot(feet, tip) && is_above && is_wide && shape.tips[tip].stands_out > MIN_LIMB * height
    };
    (0..shape.tips.len()).filter(can_be).min_by(|one, other| cost(one).total_cmp(&cost(other)))
}

/// The middle of the head that a tip belongs to, and half of its width: the first place on the way from the tip that is wide, and
/// behind which it becomes narrow.
fn head_of(shape: &Shape, tip: usize, feet: Option<[usize; 2]>) -> (DVec2, f64) {
    let way = &shape.tips[tip].way;
    let legs: Vec<&[usize]> = feet.iter().flatten().map(|&foot| &shape.tips[foot].way[..]).collect();
    let own = shape.own(way, &legs).max(2);
    let outer = &way[..(own * 2 / 3).max(1)];
    let depth = |index: usize| shape.depth[outer[index]];
    let widest = (0..outer.len()).map(depth).fold(0.0, f64::max);
    let mut best = 0;
    for index in 0..outer.len() {
        if depth(index) > depth(best) {
            best = index;
        } else if depth(best) >= 0.6 * widest && depth(index) < 0.75 * depth(best) {
            break;
        }
    }
    (shape.place(outer[best]), depth(best))
}

impl Found<'_> {
    /// Refuses what stands on several legs with its trunk lying.
    fn refuse_animals(&self) -> Result<(), NoFit> {
        let Self { shape, axis, .. } = self;
        let [core_width, core_height] = core(shape);
        let legs = shape.tips.iter().filter(|tip| stands(shape, tip)).count();
        let lies = core_width > 1.25 * core_height;
        let height = shape.height();
        let beside = (self.head.0.x - axis).abs();
        if lies && legs >= 3 {
            let detail =
                format!("its trunk lies, {:.1} times as long as high, on {legs} legs", core_width / core_height);
            return Err(NoFit::new(detail));
        }
        if lies && self.head_tip.is_some() && beside > 0.3 * height {
            return Err(NoFit::new("its trunk lies, and its head is at one end of it"));
        }
        Ok(())
    }

    /// The hand on each side: of the tips that are neither head nor feet the one that stands out farthest to that side.
    fn find_hands(&self) -> [Option<usize>; 2] {
        let Self { shape, feet, head, head_tip, axis, .. } = self;
        let height = shape.height();
        let low = self.crotch_row();
        let score = |tip: usize| {
            let way = &shape.tips[tip].way;
            let beside = (tip_place(shape, tip).x - axis).abs();
            let begins = shape.place(way[self.own(tip).min(way.len() - 1)]).y;
            let share = (begins - head.0.y) / (low - head.0.y).max(1.0);
            // What is as low as feet is hardly a hand.
            let low = (tip_place(shape, tip).y - shape.bounds[1]) / height - 0.85;
            (shape.tips[tip].stands_out + 0.7 * beside) / height - (share - 0.75).max(0.0) - 3.0 * low.max(0.0)
        };
        let can_be = |&tip: &usize| {
            let way = &shape.tips[tip].way;
            // What hangs on the head is hair or an ear, unless everything does.
            let is_hair =
                head_tip.is_some() && way.iter().any(|&pixel| shape.place(pixel).distance(head.0) < HAIR * head.1);
            let is_seen = shape.tips[tip].stands_out > MIN_LIMB * height;
            is_seen && !is_hair && !is_foot(*feet, tip) && Some(tip) != *head_tip && score(tip) > 0.12
        };
        [false, true].map(|is_left| {
            let on_side = |&tip: &usize| {
                let way = &shape.tips[tip].way;
                let own = &way[..self.own(tip).max(1)];
                let middle = own.iter().map(|&pixel| shape.place(pixel).x).sum::<f64>() / own.len() as f64;
                (middle > *axis) == is_left
            };
            let tips = (0..shape.tips.len()).filter(can_be).filter(on_side);
            tips.max_by(|&one, &other| score(one).total_cmp(&score(other)))
        })
    }

    /// How many pixels of a tip's way come before it meets those of head and feet.
    pub(super) fn own(&self, tip: usize) -> usize {
        let others = self.feet.iter().flatten().chain(&self.head_tip).chain(self.hands.iter().flatten());
        let others: Vec<&[usize]> =
            others.filter(|&&other| other != tip).map(|&other| &self.shape.tips[other].way[..]).collect();
        self.shape.own(&self.shape.tips[tip].way, &others)
    }

    /// The row where the legs part, as it is seen from below; where they do not, a third of the height above the lowest row.
    fn crotch_row(&self) -> f64 {
        self.crotch().map_or(self.shape.bounds[3] - self.shape.height() * 0.3, |crotch| crotch.y)
    }

    /// The highest place between the feet that is open to below.
    pub(super) fn crotch(&self) -> Option<DVec2> {
        let shape = self.shape;
        let [right, left] = self.feet?.map(|foot| tip_place(shape, foot));
        let bottom = shape.bounds[3] as usize;
        let columns = right.x.ceil() as usize..left.x as usize;
        let highest = columns.map(|column| {
            let open = (0..bottom).rev().take_while(|row| !shape.bits.cells[row * shape.bits.width + column]).count();
            DVec2::new(column as f64 + 0.5, (bottom - open) as f64)
        });
        let highest = highest.min_by(|one, other| one.y.total_cmp(&other.y))?;
        let lowest = right.y.min(left.y);
        (highest.y < lowest - 0.04 * shape.height()).then_some(highest)
    }

    /// How sure it is that this is a human figure at all.
    pub(super) fn whole_sure(&self) -> f64 {
        let shape = self.shape;
        let center = shape.place(shape.center);
        let tips = [1.0, 0.8, 0.45, 0.3][self.more_limbs().min(3)];
        let head = if self.head_tip.is_none() || self.head.0.y < center.y { 1.0 } else { 0.4 };
        let feet = self.feet.map_or(0.7, |feet| {
            let are_below = feet.iter().all(|&foot| tip_place(shape, foot).y > center.y);
            if are_below { 1.0 } else { 0.4 }
        });
        let beside = (self.head.0.x - self.axis).abs() / shape.height();
        let upright = (1.0 - 1.5 * (beside - 0.15).max(0.0)).max(0.2);
        let slim = (2.2 - shape.width() / shape.height()).clamp(0.3, 1.0);
        let hands = [1.0, 0.85, 0.7][self.hands.iter().filter(|hand| hand.is_none()).count()];
        tips * head * feet * upright * slim * hands
    }

    /// Limbs that a human figure does not have: tips that are none of its own and stand out nearly as far.
    fn more_limbs(&self) -> usize {
        let shape = self.shape;
        let used: Vec<usize> = self.feet.iter().flatten().chain(self.hands.iter().flatten()).copied().collect();
        let mut lengths: Vec<f64> = used.iter().map(|&tip| shape.tips[tip].stands_out).collect();
        lengths.sort_by(f64::total_cmp);
        let usual = lengths.get(lengths.len() / 2).copied().unwrap_or(0.0).max(0.15 * shape.height());
        let is_more = |&tip: &usize| {
            let way = &shape.tips[tip].way;
            let is_on_head = self.head_tip.is_some()
                && way.iter().any(|&pixel| shape.place(pixel).distance(self.head.0) < self.head.1);
            let is_long = shape.tips[tip].stands_out > 0.5 * usual;
            is_long && !is_on_head && !used.contains(&tip) && Some(tip) != self.head_tip
        };
        (0..shape.tips.len()).filter(is_more).count()
    }
}

/// Width and height of what is at least half as deep as the deepest place: head and trunk without limbs.
pub(super) fn core(shape: &Shape) -> [f64; 2] {
    let deepest = shape.depth.iter().copied().fold(0.0, f64::max);
    let core = super::bits::Bits::of(shape.bits.width, shape.bits.height, |pixel| shape.depth[pixel] >= 0.55 * deepest);
    let [left, top, right, bottom] = core.bounds().unwrap_or([0, 0, 1, 1]).map(|side| side as f64);
    // What is left out on each side is as deep as that.
    let more = 1.1 * deepest;
    [right - left + more, bottom - top + more]
}

/// Whether a tip stands on the ground, below where it begins.
pub(super) fn stands(shape: &Shape, tip: &Tip) -> bool {
    let place = shape.place(tip.way[0]);
    let inner = shape.along(&tip.way, 0.5);
    let down = place.y - inner.y;
    place.y > shape.bounds[1] + 0.72 * shape.height() && down > 0.7 * (place.x - inner.x).abs()
}
