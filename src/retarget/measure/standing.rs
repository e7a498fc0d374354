//! When the points of feet stand, on both sides.

use glam::DVec3;

use super::{
    contacts::{Standing, find_standing, find_standing_at, find_standing_on},
    foot_points::{Feet, FootPoint},
    motion::{Both, Compared},
    raised_ground::under_source,
    running_floor::{over_floor, running_floors},
};

/// Feet of a figure that stands at rest and never comes nearer to that floor, in legs, are in the air, however slow they are.
const AIRBORNE: f64 = 0.1;
/// Two feet that rest at heights that differ by more than this, in legs, do not both rest on the floor; the lower one does.
const LEVEL_AGREEMENT: f64 = 0.1;

/// Points of feet that rest on the floor are guessed to be so much higher than others at most, in legs.
const GUESSED: f64 = 0.05;

/// When points of feet stand, one after the other.
pub(super) struct Stood {
    pub(super) positions: Vec<Both<Vec<DVec3>>>,
    pub(super) standing: Vec<Both<Standing>>,
    /// How fast the floor runs below both figures, meters a second.
    pub(super) floors: Both<DVec3>,
    /// Whether feet of the source stand above the floor, too, as on stairs.
    pub(super) has_raised_ground: bool,
}

impl Feet {
    /// When the points of feet stand.
    pub(super) fn stand(&self, compared: &Compared) -> Stood {
        let positions: Vec<_> = self.points.iter().map(|point| point.positions(compared)).collect();
        let floors = running_floors(&self.points, &positions, &self.legs, &compared.performed_seconds);
        let mut standing: Vec<_> = self
            .points
            .iter()
            .zip(&positions)
            .map(|(point, both)| self.standing(point, both, &floors, compared))
            .collect();
        self.agree(&mut standing, &positions, &floors, compared);
        let is_airborne = self.is_airborne(&positions);
        for standing in &mut standing {
            if is_airborne.source {
                standing.source.never();
            }
            if is_airborne.target {
                standing.target.never();
            }
        }
        let is_level = floors.source == DVec3::ZERO && !is_airborne.source;
        let raised = self.hips.filter(|_| is_level);
        let raised = raised.and_then(|hips| under_source(&self.points, hips, &standing, compared, self.legs.source));
        if let Some(raised) = &raised {
            self.stand_on(raised, &mut standing, &positions, compared);
        }
        Stood { positions, standing, floors, has_raised_ground: raised.is_some() }
    }

    /// Whether the feet of each side are in the air all along.
    fn is_airborne(&self, positions: &[Both<Vec<DVec3>>]) -> Both<bool> {
        let lowest = |pick: fn(&Both<Vec<DVec3>>) -> &Vec<DVec3>| {
            let places = positions.iter().zip(&self.points).filter(|(_, point)| point.bears);
            let places = places.flat_map(|(both, _)| pick(both));
            places.map(|place| place.y).fold(f64::INFINITY, f64::min)
        };
        let is_high =
            |lowest: f64, floor: Option<f64>, leg: f64| floor.is_some_and(|floor| lowest - floor > AIRBORNE * leg);
        Both {
            source: is_high(lowest(|both| &both.source), self.sizes.source.floor, self.legs.source),
            target: is_high(lowest(|both| &both.target), self.sizes.target.floor, self.legs.target),
        }
    }

    /// A foot that is only ever slow in the air, as on one leg, stands on the floor of the other one if at all.
    fn agree(
        &self,
        standing: &mut [Both<Standing>],
        positions: &[Both<Vec<DVec3>>],
        floors: &Both<DVec3>,
        compared: &Compared,
    ) {
        let found: Vec<Both<f64>> = standing.iter().map(|both| both.map(|standing| standing.level)).collect();
        let agree = |standing: &mut Standing, lowest: f64, (positions, velocity): (&[DVec3], DVec3), leg: f64| {
            if standing.level - lowest > LEVEL_AGREEMENT * leg {
                let times = &compared.performed_seconds;
                *standing = find_standing_at(lowest, &over_floor(positions, velocity, times), times, leg);
            }
        };
        for ((standing, positions), point) in standing.iter_mut().zip(positions).zip(&self.points) {
            if !point.bears {
                continue;
            }
            let twins = found.iter().zip(&self.points).filter(|(_, twin)| twin.name == point.name);
            let (source, target) = twins.fold((f64::INFINITY, f64::INFINITY), |lowest, (level, _)| {
                (lowest.0.min(level.source), lowest.1.min(level.target))
            });
            agree(&mut standing.source, source, (&positions.source, floors.source), self.legs.source);
            agree(&mut standing.target, target, (&positions.target, floors.target), self.legs.target);
        }
    }

    /// When a point stands on each side, over floors that run so fast.
    fn standing(
        &self,
        point: &FootPoint,
        positions: &Both<Vec<DVec3>>,
        floors: &Both<DVec3>,
        compared: &Compared,
    ) -> Both<Standing> {
        let times = &compared.performed_seconds;
        let stand = |positions: &[DVec3], velocity: DVec3, leg: f64, floor: Option<f64>| {
            if point.bears || floor.is_none() {
                find_standing(&over_floor(positions, velocity, times), times, leg)
            } else {
                Standing { level: 0.0, stands: Vec::new(), is_still: Vec::new() }
            }
        };
        Both {
            source: stand(&positions.source, floors.source, self.legs.source, self.sizes.source.floor),
            target: stand(&positions.target, floors.target, self.legs.target, self.sizes.target.floor),
        }
    }

    /// Where feet stand on ground above the floor, too, foot by foot and frame by frame.
    fn stand_on(
        &self,
        raised: &[(String, Vec<f64>)],
        standing: &mut [Both<Standing>],
        positions: &[Both<Vec<DVec3>>],
        compared: &Compared,
    ) {
        let times = &compared.performed_seconds;
        let lowest = |pick: fn(&Both<Standing>) -> &Standing, standing: &[Both<Standing>]| {
            let bearing = self.points.iter().zip(standing).filter(|(point, _)| point.bears);
            bearing.map(|(_, standing)| pick(standing).level).fold(f64::INFINITY, f64::min)
        };
        let floors = [lowest(|both| &both.source, standing), lowest(|both| &both.target, standing)];
        for ((point, standing), positions) in self.points.iter().zip(standing).zip(positions) {
            let Some((_, ground)) = raised.iter().find(|(part, _)| point.bears && *part == point.part) else {
                continue;
            };
            let scale = self.legs.target / self.legs.source;
            let of_target: Vec<f64> = ground.iter().map(|height| floors[1] + (height - floors[0]) * scale).collect();
            let Both { source, target } = standing;
            *source = find_standing_on(source.level, ground, &positions.source, times, self.legs.source);
            *target = find_standing_on(target.level, &of_target, &positions.target, times, self.legs.target);
            // A point that never comes to the floor has been found to stand where it came to rest.
            for (standing, floor, leg) in [(source, floors[0], self.legs.source), (target, floors[1], self.legs.target)]
            {
                if standing.level - floor > GUESSED * leg {
                    standing.level = floor;
                }
            }
        }
    }
}
