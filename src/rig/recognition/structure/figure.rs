//! Which pairs of limbs make up a body: legs and arms on an upright trunk, or four legs below a level one.

use glam::DVec3;

use super::{
    bodies::{Level, Limbs, Upright, step},
    evidence::{weigh_level, weigh_upright},
    limb::{ARM, LEG, Segments, segments},
    shape::Shape,
    twins::{Pair, find_pairs},
};

/// Less likely figures are none.
const MIN_SCORE: f64 = 0.06;
/// Nor are those that nothing beside their limbs speaks for. What is hardly more is no body by itself, but a witness for names.
pub(super) const MIN_EVIDENCE: f64 = 0.06;

/// What pairs of limbs make up.
#[derive(Clone, Debug)]
pub(super) enum Figure {
    Upright(Box<Upright>),
    Level(Box<Level>),
}

impl Figure {
    /// How likely it is, from 0 to 1.
    pub(super) fn score(&self) -> f64 {
        match self {
            Self::Upright(upright) => upright.score,
            Self::Level(level) => level.score,
        }
    }

    /// The same where less speaks for it.
    pub(super) fn less_likely(mut self, share: f64) -> Self {
        match &mut self {
            Self::Upright(upright) => upright.score *= share,
            Self::Level(level) => level.score *= share,
        }
        self
    }
}

/// The likeliest body.
pub(super) fn find_figure(shape: &Shape<'_>) -> Option<Figure> {
    let pairs = find_pairs(shape);
    let upright = find_upright(shape, &pairs);
    let level = find_level(shape, &pairs);
    match (upright, level) {
        (Some(upright), Some(level)) if level.score > upright.score => Some(Figure::Level(Box::new(level))),
        (Some(upright), _) => Some(Figure::Upright(Box::new(upright))),
        (None, level) => level.map(|level| Figure::Level(Box::new(level))),
    }
}

fn find_upright(shape: &Shape<'_>, pairs: &[Pair]) -> Option<Upright> {
    let seen = |pair: &Pair, proportions| {
        let ways = segments(shape, pair, proportions);
        ways.first().map(|best| Limbs { pair: pair.clone(), best: *best, second: ways.get(1).copied() })
    };
    let legs: Vec<Limbs> = pairs.iter().filter_map(|pair| seen(pair, LEG)).collect();
    let arms: Vec<Limbs> = pairs.iter().filter_map(|pair| seen(pair, ARM)).collect();
    let mut best: Option<Upright> = None;
    for leg in &legs {
        for arm in arms.iter().filter(|arm| arm.pair.ways[0][0] != leg.pair.ways[0][0]) {
            let Some(mut upright) = stand(shape, leg, arm, pairs).filter(|upright| upright.score > MIN_SCORE) else {
                continue;
            };
            upright.score = weigh_upright(shape, &upright);
            if upright.score > best.as_ref().map_or(MIN_EVIDENCE, |best| best.score) {
                best = Some(upright);
            }
        }
    }
    best
}

/// How much two pairs look like the legs and arms of one body.
fn stand(shape: &Shape<'_>, legs: &Limbs, arms: &Limbs, pairs: &[Pair]) -> Option<Upright> {
    let leg = Joints::of(shape, legs);
    let arm = Joints::of(shape, arms);
    let trunk = arm.upper() - leg.upper();
    let up = trunk.try_normalize()?;
    let (leg_length, arm_length) = (leg.length(), arm.length());
    let proportion = |value: f64, low: f64, high: f64| step(value, 0.6 * low, low) * step(-value, -1.6 * high, -high);
    let shares = proportion(trunk.length() / leg_length, 0.3, 2.5) * proportion(arm_length / leg_length, 0.4, 1.8);
    let legs_down = step(-leg.along(up), 0.4, 0.8);
    let arms_low = step(-arm.along(up), -0.95, -0.6).max(0.3);
    // The feet are lower than the hands.
    let (feet, hands) = (leg.end().dot(up), arm.end().dot(up));
    let on_ground = step(hands - feet, -0.1 * leg_length, 0.15 * leg_length);
    // People rest with straight legs, and with arms that are bent a little at most.
    let straight = step(leg.opening(), 1.7, 2.4) * step(arm.opening(), 1.0, 1.8);
    // Nothing else that comes in pairs is lower than the feet.
    let lowest = pairs.iter().map(|pair| ends(shape, pair).dot(up)).fold(f64::INFINITY, f64::min);
    let own = ends(shape, &legs.pair).dot(up).min(feet);
    let reaches = step(lowest - own, -0.3 * leg_length, -0.1 * leg_length);
    // Both pairs lie across the same plane.
    let across = leg.across().dot(arm.across());
    let facing = step(across.abs(), 0.3, 0.85);
    let pelvis = shape.common_ancestor(legs.pair.center, arms.pair.center)?;
    let (leg_depth, arm_depth) =
        (shape.depth[legs.pair.center] - shape.depth[pelvis], shape.depth[arms.pair.center] - shape.depth[pelvis]);
    let hung = match (leg_depth, arm_depth) {
        (_, 0) => 0.4,
        (0, _) => 1.0,
        (1, _) => 0.95,
        (2, _) => 0.85,
        _ => 0.5,
    };
    let score = shares
        * legs_down
        * arms_low
        * on_ground
        * straight
        * reaches
        * facing
        * hung
        * (legs.best.score * arms.best.score).sqrt();
    let arms = if across < 0.0 { Limbs { pair: arms.pair.turned(), ..arms.clone() } } else { arms.clone() };
    Some(Upright { legs: legs.clone(), arms, pelvis, trunk, score })
}

fn find_level(shape: &Shape<'_>, pairs: &[Pair]) -> Option<Level> {
    let mut best: Option<Level> = None;
    for hind in pairs {
        for front in pairs.iter().filter(|front| front.ways[0][0] != hind.ways[0][0]) {
            let Some(mut level) = stand_on_four(shape, hind, front).filter(|level| level.score > MIN_SCORE) else {
                continue;
            };
            level.score = weigh_level(shape, &level);
            // A third pair that stands on the same ground makes it a crawler, which is looked for by itself.
            let others =
                pairs.iter().filter(|pair| pair.ways[0][0] != hind.ways[0][0] && pair.ways[0][0] != front.ways[0][0]);
            let ground = ends(shape, hind).dot(level.down);
            let tall = (ends(shape, hind) - starts(shape, hind)).dot(level.down);
            let stands = |pair: &Pair| (ends(shape, pair).dot(level.down) - ground).abs() < 0.2 * tall;
            if others.filter(|pair| stands(pair)).count() == 0
                && level.score > best.as_ref().map_or(MIN_EVIDENCE, |best| best.score)
            {
                best = Some(level);
            }
        }
    }
    best
}

fn stand_on_four(shape: &Shape<'_>, hind: &Pair, front: &Pair) -> Option<Level> {
    // Hind legs hang from the pelvis, front legs from farther along the spine.
    let pelvis = shape.common_ancestor(hind.center, front.center)?;
    if shape.depth[front.center] < shape.depth[pelvis] + 2 || shape.depth[hind.center] > shape.depth[pelvis] + 2 {
        return None;
    }
    let long_enough = [hind, front].iter().all(|pair| pair.ways[0].len() > 2);
    // Shoulder blades may lie near the hips in the file; the paws stand where they stand.
    let trunk = ((starts(shape, front) - starts(shape, hind)) + (ends(shape, front) - ends(shape, hind))) / 2.0;
    let along = trunk.try_normalize()?;
    let (back, fore) = (ends(shape, hind) - starts(shape, hind), ends(shape, front) - starts(shape, front));
    let down = (back + fore).try_normalize()?;
    let alike = step(back.normalize_or_zero().dot(fore.normalize_or_zero()), 0.5, 0.8);
    let level = step(-along.dot(down).abs(), -0.6, -0.35);
    let ground = (ends(shape, front) - ends(shape, hind)).dot(down).abs() / back.length().max(fore.length());
    let on_ground = step(-ground, -0.35, -0.15);
    let trunk_share = trunk.length() / back.length();
    let share =
        step(trunk_share, 0.4, 0.7) * step(-trunk_share, -5.0, -3.0) * step(fore.length() / back.length(), 0.4, 0.6);
    let across = |pair: &Pair| between(shape, pair).try_normalize().unwrap_or(DVec3::ZERO);
    let (one, other) = (across(hind), across(front));
    let facing = step(one.dot(other).abs(), 0.3, 0.8);
    let score = if long_enough { alike * level * on_ground * share * facing } else { 0.0 };
    let front = if one.dot(other) < 0.0 { front.turned() } else { front.clone() };
    Some(Level { hind: hind.clone(), front, pelvis, down, trunk, score })
}

/// The middle between the sides where a pair starts.
fn starts(shape: &Shape<'_>, pair: &Pair) -> DVec3 {
    let [one, other] = &pair.ways;
    shape.positions[one[0]].midpoint(shape.positions[other[0]])
}

/// The middle between the sides where a pair ends.
fn ends(shape: &Shape<'_>, pair: &Pair) -> DVec3 {
    let [one, other] = [0, 1].map(|side| pair.ways[side].last().map_or(DVec3::ZERO, |joint| shape.positions[*joint]));
    one.midpoint(other)
}

/// From the second side to the first, over all joints.
fn between(shape: &Shape<'_>, pair: &Pair) -> DVec3 {
    let [one, other] = &pair.ways;
    let between = one.iter().zip(other).map(|(one, other)| shape.positions[*one] - shape.positions[*other]);
    between.fold(DVec3::ZERO, |sum, step| sum + step)
}

/// Where the three joints of both limbs are.
struct Joints {
    points: [[DVec3; 3]; 2],
}

impl Joints {
    fn of(shape: &Shape<'_>, limbs: &Limbs) -> Self {
        let Segments { upper, lower, end, .. } = limbs.best;
        let point = |side: usize, place: usize| shape.positions[limbs.pair.ways[side][place]];
        Self { points: [0, 1].map(|side| [upper, lower, end].map(|place| point(side, place))) }
    }

    fn upper(&self) -> DVec3 {
        self.points[0][0].midpoint(self.points[1][0])
    }

    fn end(&self) -> DVec3 {
        self.points[0][2].midpoint(self.points[1][2])
    }

    fn length(&self) -> f64 {
        let one = |points: &[DVec3; 3]| points[0].distance(points[1]) + points[1].distance(points[2]);
        f64::midpoint(one(&self.points[0]), one(&self.points[1]))
    }

    /// The cosine of the limbs against a direction, from their starts to their ends.
    fn along(&self, direction: DVec3) -> f64 {
        let one = |points: &[DVec3; 3]| (points[2] - points[0]).normalize_or_zero().dot(direction);
        f64::midpoint(one(&self.points[0]), one(&self.points[1]))
    }

    /// The angle at knee or elbow, in radians; π is straight.
    fn opening(&self) -> f64 {
        let one = |points: &[DVec3; 3]| (points[0] - points[1]).angle_between(points[2] - points[1]);
        f64::midpoint(one(&self.points[0]), one(&self.points[1]))
    }

    /// From the second side to the first. Where a limb starts tells best; where it ends depends on the pose.
    fn across(&self) -> DVec3 {
        let between = |place: usize| self.points[0][place] - self.points[1][place];
        (between(0) * 2.0 + between(1) + between(2)).normalize_or_zero()
    }
}
