//! Walks on the spot: the floor runs below the figure, and a foot that stands goes along with it.

use glam::DVec3;

/// Feet are near the floor within this height above the lowest that they come, for a leg of 1 m.
const NEAR_METERS: f64 = 0.04;
/// A floor that stands has feet at rest in more than this share of the time in which they are near it.
const MAX_RESTING_SHARE: f64 = 0.15;
/// A floor that runs has feet near it go along with it for this share of the time at least.
const MIN_CARRIED_SHARE: f64 = 0.5;
/// A figure on the spot gets nowhere: over the clip its feet go by less than this share of what the floor does.
const MAX_TRAVEL_SHARE: f64 = 0.2;
/// So long a way of the floor, for a leg of 1 m, is more than a foot that slips once.
const MIN_WAY_METERS: f64 = 1.0;
/// Frames near the floor; fewer say nothing.
const MIN_FRAMES: usize = 8;

/// What is known of a point of a foot.
pub(in crate::retarget) struct FootWay<'a> {
    /// Where it is, smoothed.
    pub(in crate::retarget) places: &'a [DVec3],
    pub(in crate::retarget) speeds: &'a [f64],
}

/// The velocity of the floor below a figure that walks on the spot; nothing where the floor stands. In units per second; `scale` is what a meter is
/// at a leg of 1 m, `resting_speed` the speed below which a point may begin to touch.
///
/// It is the median of the velocities of feet that are near the floor, where half of them agree with it.
pub(in crate::retarget) fn floor_velocity(
    feet: &[FootWay<'_>],
    times: &[f64],
    up: DVec3,
    scale: f64,
    resting_speed: f64,
) -> Option<DVec3> {
    let near: Vec<Vec<usize>> = feet.iter().map(|foot| near_floor(foot.places, up, NEAR_METERS * scale)).collect();
    let count: usize = near.iter().map(Vec::len).sum();
    let resting = feet.iter().zip(&near).flat_map(|(foot, near)| near.iter().map(|frame| foot.speeds[*frame]));
    let resting = resting.filter(|speed| *speed < resting_speed).count();
    if feet.len() < 2 || count < MIN_FRAMES || resting as f64 > MAX_RESTING_SHARE * count as f64 {
        return None;
    }
    let horizontal = |way: DVec3| way - up * way.dot(up);
    let velocity = |foot: &FootWay<'_>, frame: usize| {
        let (before, after) = (frame.saturating_sub(1), (frame + 1).min(times.len() - 1));
        horizontal(foot.places[after] - foot.places[before]) / (times[after] - times[before]).max(f64::MIN_POSITIVE)
    };
    let velocities: Vec<DVec3> =
        feet.iter().zip(&near).flat_map(|(foot, near)| near.iter().map(|frame| velocity(foot, *frame))).collect();
    let floor = DVec3::from_array([0, 1, 2].map(|axis| median(velocities.iter().map(|velocity| velocity[axis]))));
    let speed = floor.length();
    let carried =
        velocities.iter().filter(|velocity| velocity.distance(floor) < resting_speed.max(0.35 * speed)).count();
    let duration = times[times.len() - 1] - times[0];
    let way = speed * duration;
    let is_on_spot = feet.iter().all(|foot| {
        let travel = horizontal(foot.places[times.len() - 1] - foot.places[0]);
        travel.dot(floor) / speed.max(f64::MIN_POSITIVE) < MAX_TRAVEL_SHARE * way
    });
    let is_floor = speed > resting_speed
        && way > MIN_WAY_METERS * scale
        && carried as f64 >= MIN_CARRIED_SHARE * count as f64
        && is_on_spot;
    is_floor.then_some(floor)
}

/// The frames in which a point is near the lowest place that it comes to.
fn near_floor(places: &[DVec3], up: DVec3, reach: f64) -> Vec<usize> {
    let lowest = places.iter().map(|place| place.dot(up)).fold(f64::INFINITY, f64::min);
    (0..places.len()).filter(|frame| places[*frame].dot(up) - lowest < reach).collect()
}

/// Of at least one number.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
