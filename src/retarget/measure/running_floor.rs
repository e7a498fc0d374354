//! The floor below figures that walk on the spot: feet stand on it when they go along with it, and slide by what they do beside.

use std::borrow::Cow;

use glam::{DVec2, DVec3};

use super::{
    foot_points::{FootPoint, Traced},
    motion::Both,
};
use crate::retarget::{
    ops::ContactsOp,
    stages::temporal::speeds,
    treadmill::{FootWay, floor_velocity},
};

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
    // As slow as a contact begins by default, so that measures see the floor run where the op does.
    let resting_speed = ContactsOp::default().speed_on;
    let below = |pick: fn(&Both<Vec<DVec3>>) -> &Vec<DVec3>, leg: f64| {
        let places: Vec<&Vec<DVec3>> = feet.iter().map(|foot| pick(&positions[*foot])).collect();
        let speeds: Vec<Vec<f64>> = places.iter().map(|places| speeds(places, times_seconds)).collect();
        let ways: Vec<FootWay<'_>> =
            places.iter().zip(&speeds).map(|(places, speeds)| FootWay { places, speeds }).collect();
        floor_velocity(&ways, times_seconds, DVec3::Y, leg, resting_speed * leg)
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
    let (mut ways, mut seconds) = (Both::<DVec2>::default(), 0.0);
    for traced in traced.iter().filter(|traced| traced.point.bears) {
        let still = traced.standing.source.still_steps().into_iter().enumerate().filter(|(_, still)| *still);
        for (frame, _) in still {
            ways.source += traced.step(false, frame);
            ways.target += traced.step(true, frame);
            seconds += traced.compared.performed_seconds[frame + 1] - traced.compared.performed_seconds[frame];
        }
    }
    let mean = |way: &DVec2| if seconds > 0.0 { DVec3::new(way.x, 0.0, way.y) / seconds } else { DVec3::ZERO };
    ways.map(mean)
}

/// Where a point is as seen from a floor that runs or stands.
pub(super) fn over_floor<'p>(positions: &'p [DVec3], velocity: DVec3, times_seconds: &[f64]) -> Cow<'p, [DVec3]> {
    if velocity == DVec3::ZERO {
        return positions.into();
    }
    positions.iter().zip(times_seconds).map(|(position, time)| *position - velocity * *time).collect()
}
