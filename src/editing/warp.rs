//! A rising curve through pairs of times.

use crate::model::hermite;

/// A curve through points that rise in both coordinates; it rises everywhere, and goes on with slope 1 outside them.
///
/// Cubic Hermite with the tangents of Fritsch and Carlson (1980), in the harmonic form that keeps it monotone.
pub(super) struct Warp {
    points: Vec<[f64; 2]>,
    slopes: Vec<f64>,
}

impl Warp {
    /// Nothing when there is no point, or the points are not finite and rising.
    pub(super) fn new(points: &[[f64; 2]]) -> Option<Self> {
        let rises = |pair: &[[f64; 2]]| pair[0][0] < pair[1][0] && pair[0][1] < pair[1][1];
        let finite = points.iter().flatten().all(|value| value.is_finite());
        if points.is_empty() || !finite || !points.windows(2).all(rises) {
            return None;
        }
        let secants: Vec<f64> =
            points.windows(2).map(|pair| (pair[1][1] - pair[0][1]) / (pair[1][0] - pair[0][0])).collect();
        let slope = |index: usize| match (index.checked_sub(1).map(|before| secants[before]), secants.get(index)) {
            (Some(before), Some(after)) => 2.0 * before * after / (before + after),
            (Some(only), None) => only,
            (None, Some(only)) => *only,
            (None, None) => 1.0,
        };
        let slopes = (0..points.len()).map(slope).collect();
        Some(Self { points: points.to_vec(), slopes })
    }

    /// Where a time goes.
    pub(super) fn at(&self, time: f64) -> f64 {
        let after = self.points.partition_point(|point| point[0] <= time);
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        if after == 0 {
            return first[1] + time - first[0];
        }
        let Some([next_from, next_to]) = self.points.get(after).copied() else { return last[1] + time - last[0] };
        let [from, to] = self.points[after - 1];
        let width = next_from - from;
        let slopes = [self.slopes[after - 1] * width, self.slopes[after] * width];
        hermite((time - from) / width, [to, next_to], slopes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goes_through_its_points_and_rises() {
        let warp = Warp::new(&[[0.0, 0.0], [1.0, 3.0], [2.0, 3.1], [4.0, 9.0]]).expect("rising");
        for (time, wanted) in [(-1.0, -1.0), (0.0, 0.0), (1.0, 3.0), (2.0, 3.1), (4.0, 9.0), (5.0, 10.0)] {
            assert!((warp.at(time) - wanted).abs() < 1e-12, "{time} goes to {}", warp.at(time));
        }
        let values: Vec<f64> = (0..=4000).map(|step| warp.at(f64::from(step) * 1e-3)).collect();
        assert!(values.windows(2).all(|pair| pair[0] < pair[1]), "it never turns back");
    }

    #[test]
    fn a_straight_line_stays_one() {
        let warp = Warp::new(&[[0.0, 1.0], [2.0, 2.0], [4.0, 3.0]]).expect("rising");
        assert!((warp.at(3.0) - 2.5).abs() < 1e-12, "half as fast");
        assert!(Warp::new(&[[0.0, 1.0], [1.0, 0.5]]).is_none(), "time cannot run backward");
    }
}
