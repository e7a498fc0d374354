//! What keeps a drawing from jumping: directions that are followed with as little haste as their projection deserves, and parts that change
//! places only when it is plain which one is nearer.

use glam::DVec2;

use super::projection::angle_degrees;

/// A bone that is seen shorter than this share of its length keeps its angle: it points at the viewer, and on to nowhere.
const SEEN_FROM: f64 = 0.15;
/// No bone turns faster, also where its projection turns around at once.
const FASTEST_DEGREES_PER_SECOND: f64 = 900.0;
/// For so long a part keeps its place after a change.
const KEPT_FOR_SECONDS: f64 = 0.5;
/// By this share of the body's reach a part has to be nearer than another to be drawn over it.
const NEARER_BY: f64 = 0.05;

/// Directions of one bone at all frames, as they are seen: the shorter the bone is seen, the less the frame counts. They become those that
/// are nearest to them while they change little: the minimum of `sum |u[t] - d[t]|^2 + k sum |u[t+1] - u[t]|^2`, found exactly (Whittaker,
/// "On a New Method of Graduation", 1923, with differences of the first order).
pub(super) fn damp(directions: &mut [DVec2], frame_time: f64, over_seconds: f64) {
    let count = directions.len();
    let weight = (over_seconds / frame_time).powi(2);
    // One row of the tridiagonal system after the other, then back.
    let mut factors = vec![0.0; count];
    for index in 0..count {
        let neighbors = usize::from(index > 0) + usize::from(index + 1 < count);
        let diagonal = 1.0 + weight * neighbors as f64;
        let (factor_before, before) = match index.checked_sub(1) {
            Some(before) => (factors[before], directions[before]),
            None => (0.0, DVec2::ZERO),
        };
        let rest = diagonal - weight * factor_before;
        factors[index] = weight / rest;
        directions[index] = (directions[index] + weight * before) / rest;
    }
    for index in (0..count.saturating_sub(1)).rev() {
        let after = directions[index + 1];
        directions[index] += factors[index] * after;
    }
}

/// The angles of one bone at all frames, 0 to 360 degrees, by its damped directions.
pub(super) fn followed(directions: &[DVec2], frame_time: f64) -> Vec<f64> {
    let most = fastest_turn(frame_time);
    let first = directions.iter().find(|direction| direction.length() >= SEEN_FROM).or(directions.first());
    let mut angle = first.map_or(0.0, |direction| angle_degrees(*direction));
    let mut follow = |direction: &DVec2| {
        if direction.length() >= SEEN_FROM {
            angle = no_faster(angle, angle_degrees(*direction), most);
        }
        angle
    };
    directions.iter().map(&mut follow).collect()
}

/// By so many degrees a bone turns from one frame to the next, at most.
pub(super) fn fastest_turn(frame_time: f64) -> f64 {
    FASTEST_DEGREES_PER_SECOND * frame_time
}

/// An angle that is turned to another by so many degrees at most.
pub(super) fn no_faster(from: f64, to: f64, most: f64) -> f64 {
    let turn = (to - from + 180.0).rem_euclid(360.0) - 180.0;
    (from + turn.clamp(-most, most)).rem_euclid(360.0)
}

/// For each frame the groups from the farthest to the nearest, by their depths at all frames. Two groups change places where one is nearer
/// by a margin, and no group changes its place twice within half a second.
pub(super) fn steady_order(depths: &[f64], groups: usize, reach: f64, frame_time: f64) -> Vec<usize> {
    let margin = NEARER_BY * reach;
    let kept_for = (KEPT_FOR_SECONDS / frame_time).ceil() as usize;
    let mut order: Vec<usize> = (0..groups).collect();
    let mut changed: Vec<Option<usize>> = vec![None; groups];
    let mut all = Vec::with_capacity(depths.len());
    for (frame, depths) in depths.chunks_exact(groups.max(1)).enumerate() {
        if frame == 0 {
            order.sort_by(|&one, &other| depths[one].total_cmp(&depths[other]));
        }
        let is_free = |changed: &[Option<usize>], group: usize| changed[group].is_none_or(|at| frame >= at + kept_for);
        for place in 1..groups {
            let [below, above] = [order[place - 1], order[place]];
            let is_wrong = depths[below] > depths[above] + margin;
            if frame > 0 && is_wrong && is_free(&changed, below) && is_free(&changed, above) {
                order.swap(place - 1, place);
                changed[below] = Some(frame);
                changed[above] = Some(frame);
            }
        }
        all.extend_from_slice(&order);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_change_stays_and_what_is_short_counts_little() {
        let mut same = [DVec2::new(0.6, 0.8); 9];
        damp(&mut same, 1.0 / 30.0, 0.06);
        assert!(same.iter().all(|direction| direction.distance(DVec2::new(0.6, 0.8)) < 1e-12), "{same:?}");
        // For one frame the bone points at the viewer, and a little to the wrong side.
        let mut dip = [DVec2::X; 9];
        dip[4] = DVec2::new(-0.05, 0.0);
        damp(&mut dip, 1.0 / 30.0, 0.06);
        assert!(dip.iter().all(|direction| direction.x > 0.5), "it does not turn around: {dip:?}");
    }

    #[test]
    fn a_bone_that_turns_around_at_once_takes_its_time() {
        let directions = [DVec2::Y, DVec2::new(0.1, 0.0), -DVec2::Y, -DVec2::Y, -DVec2::Y];
        let angles = followed(&directions, 0.1);
        let expected = [0.0, 0.0, 270.0, 180.0, 180.0];
        assert!(angles.iter().zip(expected).all(|(one, other)| (one - other).abs() < 1e-9), "{angles:?}");
    }

    #[test]
    fn the_damped_directions_are_the_minimum() {
        let given = [DVec2::X, DVec2::Y, -DVec2::X, DVec2::ZERO, DVec2::Y];
        let (frame_time, mut found) = (1.0 / 30.0, given);
        damp(&mut found, frame_time, 0.06);
        let weight = (0.06 / frame_time).powi(2);
        for (index, direction) in found.iter().enumerate() {
            let mut slope = *direction - given[index];
            for neighbor in [index.checked_sub(1), Some(index + 1)].into_iter().flatten() {
                if let Some(other) = found.get(neighbor) {
                    slope += weight * (*direction - *other);
                }
            }
            assert!(slope.length() < 1e-12, "frame {index}: {slope}");
        }
    }

    #[test]
    fn parts_change_places_seldom_and_by_a_margin() {
        // The first passes the second slowly, then trembles around it.
        let way =
            |frame: usize| if frame < 20 { frame as f64 * 0.02 - 0.2 } else { 0.3 * (-1.0_f64).powi(frame as i32) };
        let depths: Vec<f64> = (0..60).flat_map(|frame| [way(frame), 0.0]).collect();
        let order = steady_order(&depths, 2, 1.0, 1.0 / 30.0);
        assert_eq!(order[..2], [0, 1], "as the first frame has them");
        assert_eq!(order[2 * 12..][..2], [0, 1], "nearer by less than the margin");
        assert_eq!(order[2 * 13..][..2], [1, 0], "nearer by more");
        let changes =
            order.chunks_exact(2).zip(order.chunks_exact(2).skip(1)).filter(|(one, other)| one != other).count();
        assert!(changes <= 4, "at most two a second: {changes}");
    }
}
