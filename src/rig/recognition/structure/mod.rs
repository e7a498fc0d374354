//! What the shape of a skeleton says, with all names ignored.
//!
//! Pairs of limbs that mirror one another bone by bone ([`twins`]) are seen as legs and arms by their proportions ([`limb`])
//! and by how they hang from a trunk ([`figure`]); what lies between and above them is the spine, the neck and the head
//! ([`trunk`]). Where the whole skeleton is mirrored at one plane ([`plane`]), six and more legs are seen ([`crawler`]), and wings and
//! further necks ([`appendages`]). A body whose limbs are not all there is not seen: shape alone never invents one.

mod appendages;
mod bodies;
mod crawler;
mod evidence;
mod face;
mod figure;
mod hand;
mod limb;
mod plane;
mod shape;
mod trunk;
mod twins;
mod winged;

use std::collections::BTreeMap;

use glam::DVec3;

pub(super) use self::limb::Segments;
use self::{
    appendages::{Animal, add_appendages},
    bodies::{Level, Limbs, Upright},
    crawler::{Crawler, find_crawler},
    face::{Directions, add_face},
    figure::{Figure, MIN_EVIDENCE, find_figure},
    hand::find_fingers,
    limb::{ARM, LEG, Proportions, all_segments},
    plane::{Plane, find_plane},
    shape::Shape,
    trunk::{Ends, Trunk, find_animal_trunk, find_trunk},
    twins::Pair,
    winged::{Winged, find_winged},
};
use super::{Part, RigKind, Role, Side, facing::upright};

/// What the shape says of a role.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Place {
    /// From the body outward.
    pub joints: Vec<usize>,
    /// How much they look like it, from 0 to 1.
    pub geometry: f64,
    /// Another joint that they could start with.
    pub alternative: Option<usize>,
}

/// An arm or a leg with every way of seeing it.
#[derive(Clone, Debug)]
pub(super) struct SeenLimb {
    pub side: Side,
    pub is_leg: bool,
    /// From the body outward.
    pub joints: Vec<usize>,
    /// Where those are.
    points: Vec<DVec3>,
    /// Where the joint is that the limb hangs from.
    center: DVec3,
    /// The ways of seeing upper segment, lower segment and end in it, best first.
    pub ways: Vec<Segments>,
    /// Whether what hangs from the end are single toes or fingers.
    pub fans: Vec<bool>,
}

impl SeenLimb {
    /// How much a limb that lacks one of its three joints looks like one: two long bones are about as long as one another.
    pub(super) fn two_bones(&self, segments: [Option<usize>; 3]) -> f64 {
        let (start, middle, end) = match segments {
            [None, Some(lower), Some(end)] => (self.center, self.points[lower], self.points[end]),
            [Some(_), Some(lower), None] if lower + 1 >= self.points.len() => return 0.7,
            [Some(upper), Some(lower), None] => {
                (self.points[upper], self.points[lower], self.points[self.points.len() - 1])
            }
            _ => return 0.5,
        };
        let ratio = (start.distance(middle) / middle.distance(end).max(1e-12)).max(1e-6).ln();
        (-(ratio / 0.6).powi(2)).exp().max(0.3)
    }
}

/// A body, as its shape says.
#[derive(Clone, Debug)]
pub(super) struct Anatomy {
    /// Biped or quadruped; other for bodies on more legs.
    pub kind: RigKind,
    pub places: BTreeMap<Role, Place>,
    /// How much speaks for it, from 0 to 1.
    pub score: f64,
    /// Arms and legs of upright bodies.
    pub limbs: Vec<SeenLimb>,
    /// Whether something shows which way the body faces, and by that which side is left.
    pub facing_known: bool,
}

impl Anatomy {
    /// Whether it is a body although no name says so. Less is enough to bear witness for names.
    pub(super) fn stands_alone(&self) -> bool {
        self.score >= STANDS_ALONE
    }

    /// Whether it stands on six and more legs.
    pub(super) fn is_crawler(&self) -> bool {
        self.places.keys().any(|role| role.part == Part::Leg)
    }
}

/// A foot or knee that is out of line by less than this share of the leg does not say where front is.
const MIN_FORWARD: f64 = 0.02;
/// Knees say surely where front is only when they bend by this share of the legs: many figures rest with knees that are a little
/// overstretched.
const SURE_KNEES: f64 = 0.06;
/// What is less like a body needs names beside it. Few random trees of mirrored branches come as near.
const STANDS_ALONE: f64 = 0.26;
/// The surest that shape alone is.
const SUREST: f64 = 0.88;
/// The surest that shape is of one of two joints.
pub(super) const GUESS: f64 = 0.79;

/// Finds the body among the joints in `members`. `parents` come before their children.
pub(super) fn find_anatomy(parents: &[Option<usize>], positions: &[DVec3], members: &[bool]) -> Option<Anatomy> {
    let shape = Shape::new(parents, positions, members);
    if shape.span <= 0.0 {
        return None;
    }
    let plane = find_plane(&shape);
    let crawler = plane.as_ref().and_then(|plane| find_crawler(&shape, plane));
    let crawler = crawler.filter(|crawler| crawler.score > MIN_EVIDENCE);
    let figure = find_figure(&shape);
    let score = figure.as_ref().map_or(0.0, Figure::score);
    if let Some((crawler, plane)) = crawler.filter(|crawler| crawler.score >= score).zip(plane.as_ref()) {
        return Some(describe_crawler(&shape, plane, &crawler));
    }
    let winged = plane.as_ref().and_then(|plane| find_winged(&shape, plane));
    if let Some(winged) = winged.filter(|winged| winged.score > score.max(MIN_EVIDENCE)) {
        return Some(describe_winged(&shape, &winged));
    }
    let whole = figure.map(|figure| describe(&shape, plane.as_ref(), &figure));
    // Limbs that hang from one node above the body are seen only when they are joined to it.
    let bridged = || {
        let bridged = shape.bridged()?;
        let figure = find_figure(&bridged)?;
        Some(describe(&bridged, None, &figure))
    };
    // Control joints of an animator's rig lie beside the body and hide it.
    let alone = || {
        let core = shape.core(parents)?;
        let figure = find_figure(&core)?.less_likely(BESIDE_CONTROLS);
        Some(describe(&core, None, &figure))
    };
    let seen = whole.or_else(bridged);
    if seen.as_ref().is_some_and(Anatomy::stands_alone) {
        return seen;
    }
    let least = seen.as_ref().map_or(0.0, |seen| seen.score);
    alone().filter(|alone| alone.score > least).or(seen)
}

/// How likely a body is that is seen only when everything beside it is left out.
const BESIDE_CONTROLS: f64 = 0.8;

/// Scores between which a body becomes clear; those of upright bodies are higher, since the limbs count less beside the rest.
const CLEAR: [f64; 2] = [0.05, 0.5];
const CLEAR_UPRIGHT: [f64; 2] = [0.15, 0.65];

/// What is left of being sure where little speaks for a body.
fn clearness(score: f64, [low, high]: [f64; 2]) -> f64 {
    0.45 + 0.55 * bodies::step(score, low, high)
}

fn describe(shape: &Shape<'_>, plane: Option<&Plane>, figure: &Figure) -> Anatomy {
    match figure {
        Figure::Upright(upright) => describe_upright(shape, upright),
        Figure::Level(level) => describe_level(shape, plane, level),
    }
}

/// The places so far.
#[derive(Default)]
struct Places(BTreeMap<Role, Place>);

impl Places {
    fn set(&mut self, role: Role, joints: Vec<usize>, geometry: f64, alternative: Option<usize>) {
        if !joints.is_empty() {
            let alternative = alternative.filter(|joint| *joint != joints[0]);
            self.0.insert(role, Place { joints, geometry, alternative });
        }
    }
}

fn describe_upright(shape: &Shape<'_>, body: &Upright) -> Anatomy {
    let up = upright(body.trunk.normalize_or_zero());
    let height = body.trunk.length();
    let (forward, facing_known) = forward_of_legs(shape, &body.legs, up);
    let sides = sides_of(shape, body, up, forward);
    let mut places = Places::default();
    let sure = SUREST.min(0.55 + 0.4 * body.score.sqrt()) * clearness(body.score, CLEAR_UPRIGHT);
    // Where nothing shows which way the body faces, either side may be the left one.
    let sure_of_sides = if facing_known { sure } else { sure.min(GUESS) };
    for (side, way) in [Side::Left, Side::Right].into_iter().zip(sides) {
        describe_leg(shape, &body.legs, way, side, sure_of_sides, &mut places);
        describe_arm(shape, &body.arms, way, side, sure_of_sides, &mut places);
    }
    let starts = [0, 1].map(|side| body.arms.pair.ways[side][body.arms.best.upper]);
    let shoulders = shape.positions[starts[0]].midpoint(shape.positions[starts[1]]);
    let across = (shape.positions[starts[0]] - shape.positions[starts[1]]).normalize_or_zero();
    let limbs: Vec<usize> =
        [&body.arms, &body.legs].iter().flat_map(|limbs| &limbs.pair.ways).map(|way| way[0]).collect();
    let ends = Ends { pelvis: body.pelvis, chest: body.arms.pair.center, limbs: &limbs, tips: body.legs.has_tips() };
    let trunk = find_trunk(shape, ends, shoulders, up, across, height);
    // Where a joint with nothing beside it lies above the pelvis, either may be what carries the body.
    let carrier = shape.parent[body.pelvis].filter(|above| shape.children[*above].len() == 1);
    let sure_of_trunk = if carrier.is_some() { sure.min(GUESS) } else { sure };
    places.set(Role::center(Part::Pelvis), vec![body.pelvis], sure_of_trunk, carrier);
    places.set(Role::center(Part::Spine), trunk.spine, sure_of_trunk, None);
    places.set(Role::center(Part::Neck), trunk.neck.clone(), sure - 0.1, None);
    let head_alternative = trunk.neck.last().copied();
    places.set(Role::center(Part::Head), trunk.head.into_iter().collect(), sure - 0.1, head_alternative);
    if let Some((head, forward)) = trunk.head.zip(forward) {
        add_face(shape, head, Directions { up, forward, left: up.cross(forward) }, sure - 0.2, &mut places);
    }
    let limbs = seen_limbs(shape, body, sides);
    let (kind, score) = (RigKind::Biped, body.score);
    Anatomy { kind, places: places.0, score, limbs, facing_known }
}

/// Arms and legs with every way of seeing them; `sides` says which of the two ways is the left one.
fn seen_limbs(shape: &Shape<'_>, body: &Upright, sides: [usize; 2]) -> Vec<SeenLimb> {
    let mut seen = Vec::new();
    let kinds: [(&Limbs, Proportions, bool); 2] = [(&body.arms, ARM, false), (&body.legs, LEG, true)];
    for (limbs, proportions, is_leg) in kinds {
        let ways = all_segments(shape, &limbs.pair, proportions);
        for (side, way) in Side::BOTH.into_iter().zip(sides) {
            let joints = limbs.pair.ways[way].clone();
            seen.push(SeenLimb {
                side,
                is_leg,
                points: joints.iter().map(|joint| shape.positions[*joint]).collect(),
                center: shape.positions[limbs.pair.center],
                ways: ways.clone(),
                fans: joints.iter().map(|joint| shape.children[*joint].len() > 2).collect(),
                joints,
            });
        }
    }
    seen
}

/// Where front is: where the feet point, else where the knees do; and whether that is more than a guess.
fn forward_of_legs(shape: &Shape<'_>, legs: &Limbs, up: DVec3) -> (Option<DVec3>, bool) {
    let position = |side: usize, place: usize| shape.positions[legs.pair.ways[side][place]];
    let across = {
        let between = position(0, legs.best.upper) - position(1, legs.best.upper);
        (between - between.dot(up) * up).normalize_or_zero()
    };
    let level = |step: DVec3| step - step.dot(up) * up - step.dot(across) * across;
    let (mut feet, mut knees, mut length) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for side in 0..2 {
        let (hip, knee) = (position(side, legs.best.upper), position(side, legs.best.lower));
        let ankle = position(side, legs.best.end);
        length += hip.distance(knee) + knee.distance(ankle);
        let beyond = legs.pair.ways[side].iter().skip(legs.best.end + 1).map(|joint| shape.positions[*joint] - ankle);
        feet += beyond.map(level).max_by(|one, other| one.length().total_cmp(&other.length())).unwrap_or(DVec3::ZERO);
        let leg = (ankle - hip).normalize_or_zero();
        let off = knee - hip;
        knees += level(off - off.dot(leg) * leg);
    }
    let shows = |step: DVec3, least: f64| step.length() > least * length;
    let step = [feet, knees].into_iter().find(|step| shows(*step, MIN_FORWARD));
    (step.and_then(DVec3::try_normalize), shows(feet, MIN_FORWARD) || shows(knees, SURE_KNEES))
}

/// Which of the two ways of each pair is the left one, and which the right.
fn sides_of(shape: &Shape<'_>, body: &Upright, up: DVec3, forward: Option<DVec3>) -> [usize; 2] {
    // Without anything that points forward: as if the body faced the front of our space.
    let forward = forward.unwrap_or(if up.y.abs() > 0.5 { DVec3::Z } else { DVec3::NEG_Y });
    let left = up.cross(forward);
    let start = |side: usize| {
        let leg = shape.positions[body.legs.pair.ways[side][body.legs.best.upper]];
        let arm = shape.positions[body.arms.pair.ways[side][body.arms.best.upper]];
        (leg + arm).dot(left)
    };
    if start(0) >= start(1) { [0, 1] } else { [1, 0] }
}

fn describe_leg(shape: &Shape<'_>, legs: &Limbs, way: usize, side: Side, sure: f64, places: &mut Places) {
    let joints = &legs.pair.ways[way];
    let best = legs.best;
    let other = |place: fn(&limb::Segments) -> usize| legs.second.as_ref().map(|second| joints[place(second)]);
    let role = |part: Part| Role::new(side, part);
    places.set(role(Part::Thigh), joints[best.upper..best.lower].to_vec(), sure, other(|second| second.upper));
    places.set(role(Part::Shin), joints[best.lower..best.end].to_vec(), sure, other(|second| second.lower));
    places.set(role(Part::Foot), vec![joints[best.end]], sure, other(|second| second.end));
    // A foot with single toes has no joint at its ball.
    let has_toes = shape.children[joints[best.end]].len() > 2;
    if let Some(toe) = joints.get(best.end + 1).filter(|_| !has_toes) {
        places.set(role(Part::Toe), vec![*toe], sure - 0.15, joints.get(best.end + 2).copied());
    }
}

fn describe_arm(shape: &Shape<'_>, arms: &Limbs, way: usize, side: Side, sure: f64, places: &mut Places) {
    let joints = &arms.pair.ways[way];
    let best = arms.best;
    let other = |place: fn(&limb::Segments) -> usize| arms.second.as_ref().map(|second| joints[place(second)]);
    let role = |part: Part| Role::new(side, part);
    places.set(role(Part::Clavicle), joints[..best.upper.min(1)].to_vec(), sure - 0.05, None);
    places.set(role(Part::UpperArm), joints[best.upper..best.lower].to_vec(), sure, other(|second| second.upper));
    places.set(role(Part::Forearm), joints[best.lower..best.end].to_vec(), sure, other(|second| second.lower));
    places.set(role(Part::Hand), vec![joints[best.end]], sure, other(|second| second.end));
    // The palm may lie between the wrist and the fingers.
    let fan = joints[best.end..].iter().take(2).find(|joint| shape.children[**joint].len() > 2);
    for (part, finger) in fan.map(|joint| find_fingers(shape, *joint)).unwrap_or_default() {
        places.set(role(part), finger, sure - 0.2, None);
    }
}

fn describe_level(shape: &Shape<'_>, plane: Option<&Plane>, body: &Level) -> Anatomy {
    let up = upright(-body.down);
    let forward = body.trunk - body.trunk.dot(up) * up;
    let left = up.cross(forward.normalize_or_zero());
    let mut places = Places::default();
    let sure = SUREST.min(0.5 + 0.35 * body.score.sqrt()) * clearness(body.score, CLEAR);
    let at = |way: &[usize]| way.iter().map(|joint| shape.positions[*joint].dot(left)).sum::<f64>();
    for (part, pair) in [(Part::HindLeg, &body.hind), (Part::FrontLeg, &body.front)] {
        let [one, other] = &pair.ways;
        let (left_way, right_way) = if at(one) >= at(other) { (one, other) } else { (other, one) };
        places.set(Role::new(Side::Left, part), left_way.clone(), sure, None);
        places.set(Role::new(Side::Right, part), right_way.clone(), sure, None);
    }
    let limbs: Vec<usize> = [&body.hind, &body.front].iter().flat_map(|pair| &pair.ways).map(|way| way[0]).collect();
    let height = body.trunk.length();
    // Necks of animals rise forward.
    let to_head = (up + forward.normalize_or_zero()).normalize_or_zero();
    let ends = Ends { pelvis: body.pelvis, chest: body.front.center, limbs: &limbs, tips: false };
    let trunk = find_animal_trunk(shape, ends, to_head, left);
    if let Some(plane) = plane {
        let legs: Vec<usize> =
            [&body.hind, &body.front].into_iter().flat_map(|pair| &pair.ways).flatten().copied().collect();
        let leg_length = body.hind.ways[0].iter().skip(1).map(|joint| shape.length[*joint]).sum();
        let (pelvis, chest) = (body.pelvis, body.front.center);
        let animal =
            Animal { trunk: &trunk, pelvis, chest, legs: &legs, leg_length, up, forward: forward.normalize_or_zero() };
        add_appendages(shape, plane, &animal, sure, &mut places);
    }
    let forward = forward.normalize_or_zero();
    set_trunk(shape, &mut places, body.pelvis, trunk, Directions { up, forward, left }, sure);
    let back = -forward.normalize_or_zero();
    let tail = shape.children[body.pelvis].iter().copied().find(|joint| {
        let bone = shape.positions[*joint] - shape.positions[body.pelvis];
        !limbs.contains(joint) && bone.normalize_or_zero().dot(back) > 0.3 && shape.reach[*joint] > 0.2 * height
    });
    if let Some(tail) = tail {
        let mut joints = vec![tail];
        while let Some(next) = joints.last().and_then(|joint| shape.children[*joint].first().copied()) {
            joints.push(next);
        }
        places.set(Role::center(Part::Tail), joints, sure - 0.1, None);
    }
    let (kind, score) = (RigKind::Quadruped, body.score);
    Anatomy { kind, places: places.0, score, limbs: Vec::new(), facing_known: true }
}

fn set_trunk(shape: &Shape<'_>, places: &mut Places, pelvis: usize, trunk: Trunk, directions: Directions, sure: f64) {
    if let Some(head) = trunk.head {
        add_face(shape, head, directions, sure - 0.25, places);
    }
    places.set(Role::center(Part::Pelvis), vec![pelvis], sure, None);
    places.set(Role::center(Part::Spine), trunk.spine, sure - 0.05, None);
    places.set(Role::center(Part::Neck), trunk.neck, sure - 0.15, None);
    places.set(Role::center(Part::Head), trunk.head.into_iter().collect(), sure - 0.15, None);
}

fn describe_crawler(shape: &Shape<'_>, plane: &Plane, body: &Crawler) -> Anatomy {
    let mut places = Places::default();
    let sure = SUREST.min(0.5 + 0.35 * body.score.sqrt()) * clearness(body.score, CLEAR);
    for (index, ways) in body.legs.iter().enumerate() {
        let Ok(number) = u8::try_from(index + 1) else { break };
        for (side, way) in Side::BOTH.into_iter().zip(ways) {
            places.set(Role::numbered(side, Part::Leg, number), way.clone(), sure, None);
        }
    }
    let legs: Vec<usize> = body.legs.iter().flatten().flatten().copied().collect();
    let longest = body.legs.iter().map(|[way, _]| way.iter().skip(1).map(|joint| shape.length[*joint]).sum());
    let animal = Animal {
        trunk: &body.trunk,
        pelvis: body.pelvis,
        chest: body.chest,
        legs: &legs,
        leg_length: longest.fold(0.0, f64::max),
        up: body.up,
        forward: body.forward,
    };
    add_appendages(shape, plane, &animal, sure, &mut places);
    places.set(Role::center(Part::Tail), body.tail.clone(), sure - 0.1, None);
    let directions = Directions { up: body.up, forward: body.forward, left: body.up.cross(body.forward) };
    set_trunk(shape, &mut places, body.pelvis, body.trunk.clone(), directions, sure);
    let (kind, score) = (RigKind::Other, body.score);
    Anatomy { kind, places: places.0, score, limbs: Vec::new(), facing_known: body.facing_known }
}

fn describe_winged(shape: &Shape<'_>, body: &Winged) -> Anatomy {
    let mut places = Places::default();
    let sure = SUREST.min(0.5 + 0.35 * body.score.sqrt()) * clearness(body.score, CLEAR);
    let left = body.up.cross(body.forward);
    let is_left = |pair: &Pair| {
        let at = |side: usize| pair.ways[side].iter().map(|joint| shape.positions[*joint].dot(left)).sum::<f64>();
        at(0) > at(1)
    };
    let ways = |pair: &Pair| if is_left(pair) { [0, 1] } else { [1, 0] };
    for (side, way) in Side::BOTH.into_iter().zip(ways(&body.legs.pair)) {
        describe_leg(shape, &body.legs, way, side, sure, &mut places);
    }
    for (side, way) in Side::BOTH.into_iter().zip(ways(&body.wings)) {
        places.set(Role::new(side, Part::Wing), body.wings.ways[way].clone(), sure, None);
    }
    places.set(Role::center(Part::Tail), body.tail.clone(), sure - 0.1, None);
    let directions = Directions { up: body.up, forward: body.forward, left };
    set_trunk(shape, &mut places, body.pelvis, body.trunk.clone(), directions, sure);
    let (kind, score) = (RigKind::Biped, body.score);
    Anatomy { kind, places: places.0, score, limbs: Vec::new(), facing_known: true }
}
