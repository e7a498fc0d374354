//! Which points of a foot can be its lowest.

use std::collections::BTreeSet;

use glam::{DQuat, DVec3};

use super::SupportPoint;

/// Degrees by which a direction is off straight down.
const TILTS: [f64; 7] = [8.0, 16.0, 25.0, 35.0, 45.0, 60.0, 75.0];
/// Directions about straight down at every tilt.
const AZIMUTHS: u32 = 12;
/// Distances that are compared at once.
const LANES: usize = 8;
/// Degrees by which toes are bent up, and by which the shin leans forward and to the left.
const BENDS: [Bend; 9] = [
    Bend::of_toes(0.0),
    Bend::of_toes(12.0),
    Bend::of_toes(25.0),
    Bend::of_toes(40.0),
    Bend::of_toes(55.0),
    Bend::of_shin(35.0, 0.0),
    Bend::of_shin(-35.0, 0.0),
    Bend::of_shin(0.0, 20.0),
    Bend::of_shin(0.0, -20.0),
];
/// Points that are lower than those found by less than this share of a leg are passed over.
const LITTLE: f64 = 5e-4;

/// How a foot is bent at its joints; degrees.
#[derive(Clone, Copy)]
struct Bend {
    /// Up.
    toes: f64,
    /// How the shin leans.
    shin_forward: f64,
    shin_left: f64,
}

impl Bend {
    const fn of_toes(toes: f64) -> Self {
        Self { toes, shin_forward: 0.0, shin_left: 0.0 }
    }

    const fn of_shin(shin_forward: f64, shin_left: f64) -> Self {
        Self { toes: 0.0, shin_forward, shin_left }
    }

    fn bends_toes(self) -> bool {
        self.toes != 0.0
    }

    fn bends_shin(self) -> bool {
        self.shin_forward != 0.0 || self.shin_left != 0.0
    }
}

/// How a foot lies at rest, in the ankle's axes; unit vectors.
pub(super) struct FootFrame {
    pub(super) down: DVec3,
    pub(super) front: DVec3,
    pub(super) left: DVec3,
    /// From the ankle to the joint about which toes bend, where there is one.
    pub(super) ball: Option<DVec3>,
}

impl FootFrame {
    /// Straight down tilted by so many degrees toward a side of the foot: 0 toward the front, 90 toward the left.
    pub(super) fn direction(&self, tilt: f64, azimuth: f64) -> DVec3 {
        let (tilt, azimuth) = (tilt.to_radians(), azimuth.to_radians());
        let aside = self.front * azimuth.cos() + self.left * azimuth.sin();
        self.down * tilt.cos() + aside * tilt.sin()
    }

    /// All directions that may point down.
    fn directions(&self) -> Vec<DVec3> {
        let about = |tilt: f64| {
            (0..AZIMUTHS).map(move |index| self.direction(tilt, 360.0 / f64::from(AZIMUTHS) * f64::from(index)))
        };
        [self.down].into_iter().chain(TILTS.into_iter().flat_map(about)).collect()
    }

    /// Where points are when toes and shin are bent.
    fn bent(&self, points: &[SupportPoint], bend: Bend) -> Vec<DVec3> {
        let turn = |degrees: f64, axis: DVec3| DQuat::from_axis_angle(axis, degrees.to_radians());
        let toes = turn(bend.toes, -self.left);
        let shin = turn(bend.shin_forward, self.left) * turn(bend.shin_left, -self.front);
        let place = |point: &SupportPoint| {
            let mut place = point.from_end;
            if let Some(ball) = self.ball.filter(|_| point.toes > 0.0) {
                place += (ball + toes * (point.from_end - ball) - point.from_end) * point.toes;
            }
            if point.shin > 0.0 {
                place += (shin * point.from_end - point.from_end) * point.shin;
            }
            place
        };
        points.iter().map(place).collect()
    }
}

/// The points that are extreme in a direction that may point down, in their order: as few as are as deep as all but for half a millimeter at a
/// leg of 1 m.
pub(super) fn extreme(points: &[SupportPoint], frame: &FootFrame, leg: f64) -> Vec<SupportPoint> {
    let (mut found, mut distances) = (BTreeSet::new(), Vec::with_capacity(points.len()));
    let directions = frame.directions();
    let has_toes = frame.ball.is_some() && points.iter().any(|point| point.toes > 0.0);
    let has_shin = points.iter().any(|point| point.shin > 0.0);
    // What nothing hangs on bends nothing.
    for bend in BENDS.into_iter().filter(|bend| (has_toes || !bend.bends_toes()) && (has_shin || !bend.bends_shin())) {
        let places = Columns::of(&frame.bent(points, bend));
        for direction in &directions {
            let Some(farthest) = places.first_farthest(*direction, &mut distances) else { continue };
            let known = found.iter().map(|index: &usize| distances[*index]).fold(f64::NEG_INFINITY, f64::max);
            if distances[farthest] - known > LITTLE * leg {
                found.insert(farthest);
            }
        }
    }
    found.into_iter().map(|index| points[index]).collect()
}

/// Places by coordinate, so that several are compared at once.
#[derive(Debug, Default)]
struct Columns {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

impl Columns {
    fn of(places: &[DVec3]) -> Self {
        let column = |pick: fn(&DVec3) -> f64| places.iter().map(pick).collect();
        Self { x: column(|place| place.x), y: column(|place| place.y), z: column(|place| place.z) }
    }

    /// The first of those that are farthest in a direction. `distances` is room for one number for each.
    fn first_farthest(&self, direction: DVec3, distances: &mut Vec<f64>) -> Option<usize> {
        let places = self.x.iter().zip(&self.y).zip(&self.z);
        distances.clear();
        distances.extend(places.map(|((x, y), z)| x * direction.x + y * direction.y + z * direction.z));
        let farther = |most: f64, one: f64| if one > most { one } else { most };
        let mut most = [f64::NEG_INFINITY; LANES];
        let lanes = distances.chunks_exact(LANES);
        let rest = lanes.remainder();
        for lane in lanes {
            most.iter_mut().zip(lane).for_each(|(most, one)| *most = farther(*most, *one));
        }
        let farthest = most.into_iter().chain(rest.iter().copied()).fold(f64::NEG_INFINITY, farther);
        distances.iter().position(|distance| *distance == farthest)
    }
}

/// The point that is extreme in a direction.
pub(super) fn farthest(points: &[SupportPoint], direction: DVec3) -> Option<DVec3> {
    points.iter().map(|point| point.from_end).max_by(|one, other| one.dot(direction).total_cmp(&other.dot(direction)))
}
