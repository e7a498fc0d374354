//! Feet that stand where they stand: the root goes as the standing feet let it, and legs are bent a little so that both stay.

use glam::DVec2;

use super::{contacts::runs, projection::angle_degrees};

/// Over so many seconds before and after a contact a foot comes to its place and leaves it.
const BLENDED_OVER_SECONDS: f64 = 0.15;
/// No leg is stretched beyond this share of its length.
const STRETCHED_AT_MOST: f64 = 0.9995;
/// No bone of a leg is turned by more.
const TURNED_AT_MOST_DEGREES: f64 = 25.0;

/// The way of the root that keeps standing feet where they are. `feet` are the places of each foot from the root, frame by frame;
/// `stands` says when each stands; `ways` is how the root would go by itself.
pub(super) fn planted_way(ways: &[DVec2], feet: &[Vec<DVec2>], stands: &[Vec<bool>]) -> Vec<DVec2> {
    let frames = ways.len();
    let mut at = ways.to_vec();
    for frame in 1..frames {
        let standing = (0..feet.len()).filter(|&foot| stands[foot][frame] && stands[foot][frame - 1]);
        let steps: Vec<f64> = standing.map(|foot| feet[foot][frame - 1].x - feet[foot][frame].x).collect();
        let own = ways[frame].x - ways[frame - 1].x;
        let step = if steps.is_empty() { own } else { steps.iter().sum::<f64>() / steps.len() as f64 };
        at[frame].x = at[frame - 1].x + step;
    }
    lift(&mut at, feet, stands);
    at
}

/// Moves the root up and down so that the lowest standing foot is on the ground.
fn lift(ways: &mut [DVec2], feet: &[Vec<DVec2>], stands: &[Vec<bool>]) {
    let lowest = |frame: usize| {
        let standing = (0..feet.len()).filter(|&foot| stands[foot][frame]);
        standing.map(|foot| feet[foot][frame].y).min_by(f64::total_cmp)
    };
    let on_ground: Vec<(usize, f64)> = (0..ways.len()).filter_map(|frame| Some((frame, lowest(frame)?))).collect();
    let Some(ground) = ground(ways, &on_ground) else { return };
    let lifts: Vec<(usize, f64)> =
        on_ground.iter().map(|&(frame, low)| (frame, ground - low - ways[frame].y)).collect();
    for (frame, way) in ways.iter_mut().enumerate() {
        let after = lifts.partition_point(|(other, _)| *other < frame);
        way.y += match (after.checked_sub(1).map(|before| lifts[before]), lifts.get(after)) {
            (_, Some((other, lift))) if *other == frame => *lift,
            (Some((from, one)), Some((to, other))) => {
                one + (other - one) * ((frame - from) as f64 / (to - from) as f64)
            }
            (Some((_, lift)), None) => lift,
            (None, Some((_, lift))) => *lift,
            (None, None) => 0.0,
        };
    }
}

/// The height of the ground: the middle of where the lowest standing feet would be.
fn ground(ways: &[DVec2], on_ground: &[(usize, f64)]) -> Option<f64> {
    let mut heights: Vec<f64> = on_ground.iter().map(|&(frame, low)| ways[frame].y + low).collect();
    heights.sort_by(f64::total_cmp);
    heights.get(heights.len() / 2).copied()
}

/// For each frame how far a foot is to be moved so that it stays where it was when a contact began, at the height of the ground.
pub(super) fn corrections(places: &[DVec2], stands: &[bool], ground: f64, frame_time: f64) -> Vec<DVec2> {
    let mut moved = vec![DVec2::ZERO; places.len()];
    let blend = (BLENDED_OVER_SECONDS / frame_time).ceil().max(1.0);
    for run in runs(stands) {
        let target = DVec2::new(places[run.start].x, ground);
        run.clone().for_each(|frame| moved[frame] = target - places[frame]);
        let (first, last) = (moved[run.start], moved[run.end - 1]);
        for away in 1..blend as usize {
            let share = 1.0 - away as f64 / blend;
            let share = share * share * (3.0 - 2.0 * share);
            if let Some(frame) = run.start.checked_sub(away).filter(|frame| !stands[*frame]) {
                moved[frame] += first * share;
            }
            let frame = run.end - 1 + away;
            if frame < places.len() && !stands[frame] {
                moved[frame] += last * share;
            }
        }
    }
    moved
}

/// The height that standing feet have, for [`corrections`].
pub(super) fn ground_of(places: &[Vec<DVec2>], stands: &[Vec<bool>]) -> Option<f64> {
    let standing = places.iter().zip(stands).flat_map(|(places, stands)| places.iter().zip(stands));
    let mut heights: Vec<f64> = standing.filter(|(_, stands)| **stands).map(|(place, _)| place.y).collect();
    heights.sort_by(f64::total_cmp);
    // Of two standing feet the lower one is on the ground.
    heights.get(heights.len() / 4).copied()
}

/// The angles of thigh and shin with which a leg reaches a place; the knee stays on its side. Nothing where the leg would turn by much.
pub(super) fn reached([hip, knee, foot]: [DVec2; 3], target: DVec2) -> Option<[f64; 2]> {
    let (thigh, shin) = (hip.distance(knee), knee.distance(foot));
    let most = (thigh + shin) * STRETCHED_AT_MOST;
    let least = (thigh - shin).abs() + (thigh + shin) * (1.0 - STRETCHED_AT_MOST);
    let way = target - hip;
    let distance = way.length().clamp(least, most.max(least));
    let along = way.try_normalize()?;
    let side = if (knee - hip).perp_dot(foot - hip) > 0.0 { -1.0 } else { 1.0 };
    let cosine = (thigh * thigh + distance * distance - shin * shin) / (2.0 * thigh * distance);
    let bend = cosine.clamp(-1.0, 1.0).acos() * side;
    let knee_to = hip + DVec2::from_angle(bend).rotate(along) * thigh;
    let foot_to = hip + along * distance;
    let angles = [angle_degrees(knee_to - hip), angle_degrees(foot_to - knee_to)];
    let before = [angle_degrees(knee - hip), angle_degrees(foot - knee)];
    let turned = |(one, other): (&f64, &f64)| ((one - other + 180.0).rem_euclid(360.0) - 180.0).abs();
    angles.iter().zip(&before).all(|pair| turned(pair) <= TURNED_AT_MOST_DEGREES).then_some(angles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leg_reaches_a_place_and_keeps_its_knee_on_its_side() {
        for knee in [DVec2::new(0.1, -0.5), DVec2::new(-0.1, -0.5)] {
            let leg = [DVec2::ZERO, knee, DVec2::new(0.0, -1.0)];
            let target = DVec2::new(0.05, -0.98);
            let [thigh, shin] = reached(leg, target).expect("it reaches");
            let toward = |degrees: f64| DVec2::from_angle((degrees + 90.0).to_radians());
            let knee_to = toward(thigh) * knee.length();
            let foot = knee_to + toward(shin) * knee.distance(leg[2]);
            assert!(foot.distance(target) < 1e-9, "{foot}");
            assert!(knee_to.x * knee.x > 0.0, "{knee_to}");
        }
    }

    #[test]
    fn the_root_goes_so_that_a_standing_foot_stays() {
        let feet = vec![vec![DVec2::new(0.0, -1.0), DVec2::new(-0.1, -0.9), DVec2::new(-0.3, -1.0)]];
        let ways = planted_way(&[DVec2::ZERO, DVec2::new(0.3, 0.0), DVec2::new(0.4, 0.0)], &feet, &[vec![true; 3]]);
        let places: Vec<DVec2> = ways.iter().zip(&feet[0]).map(|(way, foot)| *way + *foot).collect();
        assert!(places.iter().all(|place| place.distance(places[0]) < 1e-12), "{places:?}");
    }
}
