//! What feet stand on above or below the floor: stairs, slopes, captures that drift. Where the source's feet stand on it, so should the
//! target's, as much higher as its legs are longer.

use super::{
    contacts::{Standing, intervals},
    foot_points::{FootPoint, Traced},
    motion::{Both, Compared},
    statistics::percentile,
};
use crate::retarget::{
    raised_ground::{FootHeights, over_floors, own_floors, raised_ground},
    stages::temporal::{smoothed, speeds},
};

/// Standard deviation of the smoothing before speeds are taken.
const NOISE_SECONDS: f64 = 0.025;
/// A foot that stands no higher and no lower is on the floor, in legs.
const FLOOR_LEGS: f64 = 0.04;
/// A clip whose lowest ground is farther from the floor goes down from it, in legs.
const MAX_FLOOR_LEGS: f64 = 0.1;
/// The ground below a foot that stands is as high as the foot is in the middle of about so long a time: feet roll, and ground does not.
const MIDDLE_SECONDS: f64 = 0.5;

/// The ground under the feet of the source where that is raised, foot by foot: how high it is, meters; not a number where a foot is on the floor
/// or in the air. `hips` are the slots of theirs, left and right. Nothing where no foot ever stands above the floor, or the figure has no two feet.
pub(super) fn under_source(
    points: &[FootPoint],
    hips: [usize; 2],
    standing: &[Both<Standing>],
    compared: &Compared,
    leg: f64,
) -> Option<Vec<(String, Vec<f64>)>> {
    let bearing = || points.iter().zip(standing).filter(|(point, _)| point.bears);
    let mut feet: Vec<&FootPoint> = Vec::new();
    for (point, _) in bearing() {
        match feet.iter_mut().find(|foot| foot.part == point.part) {
            Some(foot) => *foot = point,
            None => feet.push(point),
        }
    }
    let [left, right] = feet[..] else { return None };
    let level = |foot: &FootPoint| {
        let of_foot = bearing().filter(|(point, _)| point.part == foot.part);
        of_foot.map(|(_, standing)| standing.source.level).fold(f64::INFINITY, f64::min)
    };
    let floors = own_floors([left, right].map(level), leg);
    let height = |point: &FootPoint, frame: usize| compared.source.position(frame, point.slot).y;
    let frames = 0..compared.len();
    let above = [(left, floors[0]), (right, floors[1])].map(|(foot, floor)| {
        let of_foot = |frame: usize| {
            let of_foot = bearing().filter(|(point, _)| point.part == foot.part);
            of_foot.map(|(point, _)| height(point, frame)).fold(f64::INFINITY, f64::min) - floor
        };
        frames.clone().map(of_foot).collect::<Vec<f64>>()
    });
    let times = &compared.performed_seconds;
    // Whichever point it rests on: points are guessed below the joints of a foot, and one that is off sways as the foot rolls.
    let speed = [left, right].map(|foot| {
        let of_foot = bearing().filter(|(point, _)| point.part == foot.part);
        let speeds = of_foot.map(|(point, _)| {
            let places: Vec<_> = frames.clone().map(|frame| compared.source.position(frame, point.slot)).collect();
            speeds(&smoothed(&places, times, NOISE_SECONDS), times)
        });
        speeds.reduce(|one, other| one.into_iter().zip(other).map(|(one, other)| one.min(other)).collect())
    });
    let [Some(left_speed), Some(right_speed)] = speed else { return None };
    let speed = [left_speed, right_speed];
    let hip = [(left, hips[0]), (right, hips[1])].map(|(foot, hip)| {
        let over_foot = |frame: usize| compared.source.position(frame, hip).y - height(foot, frame);
        frames.clone().map(over_foot).collect::<Vec<f64>>()
    });
    let heights = [0, 1].map(|foot| FootHeights { above_floor: &above[foot], speeds: &speed[foot], hip: &hip[foot] });
    let grounds = over_floors(raised_ground(&heights, times, leg)?, floors);
    Some([left, right].into_iter().map(|foot| foot.part.clone()).zip(grounds).collect())
}

/// How high the ground under every foot is above the floor, where feet were found to stand above it: what the source's feet stand on, and
/// between that the lower of the ground behind and ahead. The target's is as high beside it as its feet stand on the whole: a config may
/// climb stairs of any size.
pub(super) fn find_grounds(traced: &mut [Traced<'_>], legs: &Both<f64>, times_seconds: &[f64]) {
    let mut parts: Vec<String> = traced.iter().map(|traced| traced.point.part.clone()).collect();
    parts.dedup();
    let feet: Vec<Foot> = parts.into_iter().map(|part| Foot::of(part, traced, times_seconds)).collect();
    let found = traced.iter().filter(|traced| traced.point.bears);
    let found = found.map(|traced| traced.standing.source.level - traced.levels.source).fold(f64::INFINITY, f64::min);
    let floor = if found.abs() < MAX_FLOOR_LEGS * legs.source { found } else { 0.0 };
    let is_floor = |height: f64| (height - floor).abs() <= FLOOR_LEGS * legs.source;
    let mut level: Vec<f64> = feet.iter().flat_map(|foot| &foot.stances).map(|stance| stance.middle).collect();
    level.retain(|height| is_floor(*height));
    let level = if level.is_empty() { floor } else { percentile(&mut level, 0.5) };
    let grounds: Vec<Vec<f64>> =
        feet.iter().map(|foot| foot.ground(|height| if is_floor(height) { 0.0 } else { height - level })).collect();
    let (mut product, mut square) = (0.0, 0.0);
    for (foot, ground) in feet.iter().zip(&grounds) {
        for stance in &foot.stances {
            let frames = stance.first..=stance.last;
            for (ground, target) in ground[frames.clone()].iter().zip(&foot.of_target[frames]) {
                product += ground * target;
                square += ground * ground;
            }
        }
    }
    let ratio = if square > 0.0 { (product / square).max(0.0) } else { legs.target / legs.source };
    for traced in traced {
        let index = feet.iter().position(|foot| foot.part == traced.point.part);
        traced.ground = index.map(|index| Both {
            source: grounds[index].clone(),
            target: grounds[index].iter().map(|height| height * ratio).collect(),
        });
    }
}

/// A foot of the source while it stands: first and last frame.
struct Stance {
    first: usize,
    last: usize,
    /// How high the ground is below it.
    heights: Vec<f64>,
    /// The one in the middle of them.
    middle: f64,
}

/// One foot.
struct Foot {
    part: String,
    stances: Vec<Stance>,
    /// Height of its lowest point on either side, frame by frame.
    of_source: Vec<f64>,
    of_target: Vec<f64>,
}

/// The median of the heights over half a second around each, within the stance.
fn running_middles(heights: &[f64], times_seconds: &[f64]) -> Vec<f64> {
    let (begin, end) = (times_seconds[0], times_seconds[times_seconds.len() - 1]);
    let middle = |time: &f64| {
        let from = (time - MIDDLE_SECONDS / 2.0).min(end - MIDDLE_SECONDS).max(begin);
        let first = times_seconds.partition_point(|time| *time < from);
        let last = times_seconds.partition_point(|time| *time <= from + MIDDLE_SECONDS).max(first + 1);
        percentile(&mut heights[first..last].to_vec(), 0.5)
    };
    times_seconds.iter().map(middle).collect()
}

impl Foot {
    fn of(part: String, traced: &[Traced<'_>], times_seconds: &[f64]) -> Self {
        let points: Vec<&Traced<'_>> = traced.iter().filter(|traced| traced.point.part == part).collect();
        let bearing = || points.iter().filter(|traced| traced.point.bears);
        let lowest = |is_target: bool| {
            let lowest =
                |frame: usize| bearing().map(|traced| traced.height(is_target, frame)).fold(f64::INFINITY, f64::min);
            (0..times_seconds.len()).map(lowest).collect::<Vec<f64>>()
        };
        let (of_source, of_target) = (lowest(false), lowest(true));
        let stands: Vec<bool> = (0..times_seconds.len())
            .map(|frame| bearing().any(|traced| traced.standing.source.stands[frame]))
            .collect();
        let stance = |(first, last): (usize, usize)| {
            let heights = running_middles(&of_source[first..=last], &times_seconds[first..=last]);
            Stance { first, last, middle: percentile(&mut heights.clone(), 0.5), heights }
        };
        Self { part, stances: intervals(&stands).into_iter().map(stance).collect(), of_source, of_target }
    }

    /// `above` says how high the ground is above the floor where the foot stands at a height.
    fn ground(&self, above: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut ground = vec![0.0; self.of_target.len()];
        for stance in &self.stances {
            let own = ground[stance.first..=stance.last].iter_mut().zip(&stance.heights);
            own.for_each(|(ground, height)| *ground = above(*height));
        }
        let mut behind: Option<&Stance> = None;
        for ahead in self.stances.iter().map(Some).chain([None]) {
            let begin = behind.map_or(0, |behind| behind.last + 1);
            let end = ahead.map_or(ground.len(), |ahead| ahead.first);
            let next_to = [behind.map(|behind| ground[behind.last]), ahead.map(|ahead| ground[ahead.first])];
            let lower = next_to.into_iter().flatten().reduce(f64::min).unwrap_or(0.0);
            let is_end = behind.is_none() || ahead.is_none();
            for (ground, height) in ground[begin..end].iter_mut().zip(&self.of_source[begin..end]) {
                // Where nothing says what comes next, a foot that goes below what it stood on goes on to lower ground.
                *ground = if is_end { lower.min(above(*height)) } else { lower };
            }
            behind = ahead;
        }
        ground
    }
}
