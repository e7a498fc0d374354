//! Where the joints of a human figure are, once it is known which tips are head, hands and feet.

use glam::DVec2;

use super::{
    human::{Found, MIN_SURE},
    joints::{CORRECT, Fit, Joint, NoFit},
    limb::Limb,
    shape::Shape,
};
use crate::model::Reporter;

/// Part of the width above the legs that hips are apart from the middle.
const HIPS_APART: f64 = 0.25;
/// How far hips lie above the point where the legs part, as a share of the height.
const HIPS_ABOVE: f64 = 0.025;
/// How far a shoulder is raised at most, as a share of the height.
const RAISED: f64 = 0.08;
/// Half of the width from which on an arm has a shoulder of its own, as a share of the height; a thin one is a line from the trunk.
const THICK_ARM: f64 = 0.025;
/// How far down from the neck to the feet hips are at most.
const LOWEST_HIPS: f64 = 0.7;
/// How much wider a skirt is at its hem than at the waist, and where between them hips are.
const SKIRT: f64 = 1.4;
const HIPS_IN_SKIRT: f64 = 0.25;
/// How far down from neck to root shoulders are at most.
const LOWEST_SHOULDERS: f64 = 0.75;
/// How sure a joint can be that was not seen.
const GUESSED: f64 = 0.3;

impl Found<'_> {
    /// All joints.
    pub(super) fn joints(&self) -> Result<Fit, NoFit> {
        let mut notes = Reporter::new();
        let (hips, hips_sure) = self.hips();
        let legs = self.legs(hips, &mut notes);
        let mut arms = self.arms(hips, &mut notes);
        let sure = self.whole_sure();
        if sure < MIN_SURE {
            return Err(NoFit::new("what stands out of it is not placed like head, arms and legs"));
        }
        let root = (hips[0] + hips[1]) / 2.0;
        let shoulders = arms.each_ref().map(|arm| arm.places[0]);
        let mut torso = (shoulders[0] + shoulders[1]) / 2.0;
        let mut neck = self.head.0;
        // A head that is larger than the trunk has the center in it, and may still have shoulders below.
        let is_one = self.head_tip.is_none() && torso.y < self.head.0.y + 0.6 * self.head.1;
        if is_one {
            notes.warn(
                "figure_without_trunk",
                "joints",
                "head and trunk are one: the neck is put in its middle",
                CORRECT,
            );
            torso = self.head.0 + DVec2::new(0.0, 0.4 * self.head.1);
            neck = self.head.0 - DVec2::new(0.0, 0.15 * self.head.1);
        }
        // Arms that begin on the lower part of the trunk are rather something else.
        let share = (torso.y - neck.y) / (root.y - neck.y).max(1.0);
        if share > LOWEST_SHOULDERS {
            arms.iter_mut().for_each(|arm| arm.sure *= 0.4);
        }
        let arm_sure = f64::midpoint(arms[0].sure, arms[1].sure);
        let head_sure = if self.head_tip.is_some() { 1.0 } else { 0.6 };
        let joint = |name: &str, parent: &str, place: DVec2, own: f64| Joint::new(name, parent, place, own * sure);
        let mut joints = vec![
            joint("root", "", root, hips_sure),
            joint("hip", "root", root, hips_sure),
            joint("torso", "hip", torso, arm_sure),
            joint("neck", "torso", neck, head_sure),
        ];
        let sides = ["right", "left"];
        for (arm, side) in arms.iter().zip(sides) {
            let names = ["shoulder", "elbow", "hand"].map(|name| format!("{side}_{name}"));
            let parents = ["torso", &names[0], &names[1]];
            (0..3).for_each(|at| joints.push(joint(&names[at], parents[at], arm.places[at], arm.sure)));
        }
        for (leg, side) in legs.iter().zip(sides) {
            let names = ["hip", "knee", "foot"].map(|name| format!("{side}_{name}"));
            let parents = ["root", &names[0], &names[1]];
            let sure = [hips_sure, leg.sure, leg.sure];
            (0..3).for_each(|at| joints.push(joint(&names[at], parents[at], leg.places[at], sure[at])));
        }
        Ok(Fit { joints, notes })
    }

    /// The right hip and the left one, and how sure they are.
    fn hips(&self) -> ([DVec2; 2], f64) {
        let shape = self.shape;
        let height = shape.height();
        let (crotch, sure) = match (self.crotch(), self.feet) {
            (Some(crotch), _) => (crotch, 1.0),
            (None, Some([right, left])) => {
                // Feet that touch: where the ways part.
                let [right, left] = [right, left].map(|foot| &shape.tips[foot].way);
                let meet = right[shape.own(right, &[left]).min(right.len() - 1)];
                (shape.place(meet), 0.6)
            }
            (None, None) => (DVec2::new(self.axis, shape.bounds[3] - 0.3 * height), GUESSED),
        };
        let up = self.waist_above(crotch).unwrap_or(HIPS_ABOVE * height);
        let mut row = crotch.y - up;
        let mut sure = sure;
        let lowest = self.head.0.y + LOWEST_HIPS * (shape.bounds[3] - self.head.0.y);
        if row > lowest {
            // Legs that touch part far below the hips.
            (row, sure) = (lowest, f64::min(sure, 0.6));
        }
        let above = shape.place(shape.nearest(DVec2::new(crotch.x, row)));
        let [left, right] = self.reach(above);
        let middle = DVec2::new(above.x + (right - left) / 2.0, above.y);
        let apart = DVec2::new((left + right) * HIPS_APART, 0.0);
        ([middle - apart, middle + apart], sure)
    }

    /// How far the figure reaches to the left and to the right of a place.
    fn reach(&self, place: DVec2) -> [f64; 2] {
        let shape = self.shape;
        let most = 0.35 * shape.height();
        let row = place.y as i64;
        [-1, 1].map(|step: i64| {
            let mut far = 0;
            while f64::from(far as i32) < most && shape.bits.has(place.x as i64 + step * (far + 1), row) {
                far += 1;
            }
            far as f64 + 0.5
        })
    }

    /// How far hips are above the hem of a skirt, where the legs come out of one: it is much wider than the waist above it.
    fn waist_above(&self, hem: DVec2) -> Option<f64> {
        let width = |row: f64| {
            let place = DVec2::new(
                self.head.0.x + (hem.x - self.head.0.x) * ((row - self.head.0.y) / (hem.y - self.head.0.y)),
                row,
            );
            self.reach(place).iter().sum::<f64>()
        };
        let trunk = hem.y - self.head.0.y - self.head.1;
        let rows = (1..=5).map(|step| hem.y - trunk * 0.08 * f64::from(step));
        let narrow = rows.min_by(|&one, &other| width(one).total_cmp(&width(other)))?;
        let at_hem = width(hem.y - 0.03 * trunk);
        (trunk > 0.0 && at_hem > SKIRT * width(narrow))
            .then(|| ((1.0 - HIPS_IN_SKIRT) * (hem.y - narrow)).min(0.24 * trunk))
    }

    /// The right leg and the left one: hip, knee, foot.
    fn legs(&self, hips: [DVec2; 2], notes: &mut Reporter) -> [Bones; 2] {
        let shape = self.shape;
        let Some(feet) = self.feet else {
            notes.warn("joints_guessed", "joints", "no legs stand out: knees and feet are put below the hips", CORRECT);
            return hips.map(|hip| {
                let foot = DVec2::new(hip.x, shape.bounds[3] - 0.03 * shape.height());
                Bones::guessed(shape, [hip, hip.lerp(foot, 0.5), foot])
            });
        };
        let limbs = [0, 1].map(|side: usize| {
            let way = &shape.tips[feet[side]].way;
            let far = |index: &usize| shape.place(way[*index]).distance_squared(hips[side]);
            let root = (0..way.len()).min_by(|one, other| far(one).total_cmp(&far(other))).unwrap_or(way.len() - 1);
            Limb::between(shape, way, root.max(way.len().min(4) - 1))
        });
        let alike = alike(&limbs);
        [0, 1].map(|side| Bones { places: [hips[side], limbs[side].bend, limbs[side].end], sure: alike })
    }

    /// The right arm and the left one: shoulder, elbow, hand.
    fn arms(&self, hips: [DVec2; 2], notes: &mut Reporter) -> [Bones; 2] {
        let shape = self.shape;
        let limb = |tip: usize| {
            let limb = Limb::new(shape, &shape.tips[tip].way, self.own(tip));
            Limb { root: self.raised(limb.root, limb.half_width), ..limb }
        };
        let limbs = self.hands.map(|hand| hand.map(limb));
        let alike = match &limbs {
            [Some(right), Some(left)] => alike(&[right.clone(), left.clone()]),
            _ => 0.8,
        };
        let bones = |limb: &Limb| Bones { places: [limb.root, limb.bend, limb.end], sure: alike };
        let root = (hips[0] + hips[1]) / 2.0;
        let mirrored = |limb: &Limb| {
            let middle = self.head.0.lerp(root, 0.4);
            let across = |place: DVec2| DVec2::new(2.0 * middle.x - place.x, place.y);
            Bones::guessed(shape, [limb.root, limb.bend, limb.end].map(across))
        };
        let name = |side: usize| ["right", "left"][side];
        match &limbs {
            [Some(right), Some(left)] => [bones(right), bones(left)],
            [None, None] => {
                notes.warn("joints_guessed", "joints", "no arms stand out: they are put along the trunk", CORRECT);
                [-1.0, 1.0].map(|side| self.arm_on_trunk(root, side))
            }
            [one, other] => {
                let missing = usize::from(one.is_some());
                let detail =
                    format!("no {} arm stands out: it is put where the other one is, across the trunk", name(missing));
                notes.warn("joints_guessed", "joints", detail, CORRECT);
                match (one, other) {
                    (Some(seen), _) => [bones(seen), mirrored(seen)],
                    (_, Some(seen)) => [mirrored(seen), bones(seen)],
                    (None, None) => [-1.0, 1.0].map(|side| self.arm_on_trunk(root, side)),
                }
            }
        }
    }

    /// A shoulder that is as far below the outline as the arm is thick: ways lead into the trunk at the armpit.
    fn raised(&self, root: DVec2, half_width: f64) -> DVec2 {
        let shape = self.shape;
        if half_width < THICK_ARM * shape.height() {
            return root;
        }
        let highest = (root.y - RAISED * shape.height()).max(self.head.0.y + self.head.1);
        let top = (0..root.y as i64).rev().find(|&row| !shape.bits.has(root.x as i64, row)).unwrap_or(0);
        let wanted = (top as f64 + 1.0 + half_width).max(highest);
        DVec2::new(root.x, wanted.min(root.y))
    }

    /// An arm that does not stand out of the trunk: down its side.
    fn arm_on_trunk(&self, root: DVec2, side: f64) -> Bones {
        let shape = self.shape;
        let neck = self.head.0 + DVec2::new(0.0, self.head.1);
        let at = |share: f64| {
            let middle = neck.lerp(root, share);
            let row = (middle.y.max(0.0) as usize).min(shape.bits.height - 1) as i64;
            let mut column = middle.x;
            while shape.bits.has((column + side) as i64, row) {
                column += side;
            }
            DVec2::new(middle.x + (column - middle.x) * 0.75, middle.y)
        };
        Bones::guessed(shape, [at(0.2), at(0.6), at(1.0)])
    }
}

/// Three joints of a limb, from the trunk on.
struct Bones {
    places: [DVec2; 3],
    sure: f64,
}

impl Bones {
    /// Joints that were not seen: they are moved into the figure.
    fn guessed(shape: &Shape, places: [DVec2; 3]) -> Self {
        Self { places: places.map(|place| shape.place(shape.nearest(place))), sure: GUESSED }
    }
}

/// How much two limbs are alike in length and width.
fn alike([one, other]: &[Limb; 2]) -> f64 {
    let share = |one: f64, other: f64| 1.0 - (one - other).abs() / (one + other).max(1e-9);
    (share(one.length, other.length) * share(one.half_width, other.half_width).sqrt()).clamp(0.2, 1.0)
}
