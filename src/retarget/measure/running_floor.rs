//! The floor below figures that walk on the spot: feet stand on it when they go along with it, and slide by what they do beside.

use glam::{DVec2, DVec3};

use super::{
    foot_points::{FootPoint, Traced},
    motion::Both,
};
use crate::retarget::{
    stages::temporal::speeds,
    treadmill::{FootWay, floor_velocity},
};

/// A foot that is no faster may stand, in leg lengths per second. That below which a contact begins by default, so that measures see
/// the floor run where the op `contacts` does.
const RESTING_SPEED: f64 = 0.2;

/// How fast the floor runs below both figures, meters a second; zero where the source is not on the spot. Where the target's feet do not
/// say, it is the source's for its legs.
pub(super) fn running_floors(
    points: &[FootPoint],
    positions: &[Both<Vec<DVec3>>],
    legs: &Both<f64>,
    times_seconds: &[f64],
) -> Both<DVec3> {
    // Of each foot the point that leaves the floor last: its ball, else all that it has.
    let is_last = |index: usize| {
        let follows = |other: &FootPoint| other.bears && other.part == points[index].part;
        points[index].bears && !points[index + 1..].iter().any(follows)
    };
    let feet: Vec<usize> = (0..points.len()).filter(|index| is_last(*index)).collect();
    let below = |pick: fn(&Both<Vec<DVec3>>) -> &Vec<DVec3>, leg: f64| {
        let ways: Vec<Way<'_>> = feet.iter().map(|foot| Way::new(pick(&positions[*foot]), times_seconds)).collect();
        let ways: Vec<FootWay<'_>> = ways.iter().map(Way::of_foot).collect();
        floor_velocity(&ways, times_seconds, DVec3::Y, leg, RESTING_SPEED * leg)
    };
    let Some(source) = below(|both| &both.source, legs.source) else {
        return Both::default();
    };
    let target = below(|both| &both.target, legs.target);
    Both { source, target: target.unwrap_or(source * (legs.target / legs.source)) }
}

/// The same by what points of feet do while the source's stand: at no other speed do they slide less. Zero where none stands on a floor
/// that runs so fast.
pub(super) fn under_standing_feet(traced: &[Traced<'_>], floors: &Both<DVec3>) -> Both<DVec3> {
    if floors.source == DVec3::ZERO {
        return *floors;
    }
    let mean = |is_target: bool| {
        let (mut way, mut seconds) = (DVec2::ZERO, 0.0);
        for traced in traced.iter().filter(|traced| traced.point.bears) {
            let still = traced.standing.source.still_steps().into_iter().enumerate().filter(|(_, still)| *still);
            for (frame, _) in still {
                way += traced.step(is_target, frame);
                seconds += traced.times_seconds[frame + 1] - traced.times_seconds[frame];
            }
        }
        if seconds > 0.0 { DVec3::new(way.x, 0.0, way.y) / seconds } else { DVec3::ZERO }
    };
    Both { source: mean(false), target: mean(true) }
}

/// Where a point is as seen from a floor that runs.
pub(super) fn over_floor(positions: &[DVec3], velocity: DVec3, times_seconds: &[f64]) -> Vec<DVec3> {
    positions.iter().zip(times_seconds).map(|(position, time)| *position - velocity * *time).collect()
}

/// A point of a foot over the clip.
struct Way<'a> {
    places: &'a [DVec3],
    heights: Vec<f64>,
    speeds: Vec<f64>,
}

impl<'a> Way<'a> {
    fn new(places: &'a [DVec3], times_seconds: &[f64]) -> Self {
        Self { places, heights: places.iter().map(|place| place.y).collect(), speeds: speeds(places, times_seconds) }
    }

    fn of_foot(&self) -> FootWay<'_> {
        FootWay { places: self.places, heights: &self.heights, speeds: &self.speeds }
    }
}
