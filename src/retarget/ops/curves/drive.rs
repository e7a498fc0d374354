//! A number that is animated beside the joints, on its way into the result.

use crate::retarget::ops::schedule::Schedule;

/// One curve of the result.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveDrive {
    /// Its name in the result.
    pub name: String,
    /// Index of what it follows among the source's [`morphs`](crate::model::Scene::morphs).
    pub source: usize,
    /// Pairs of a value and what it becomes, by rising value; empty where values stay as they are.
    pub points: Vec<[f64; 2]>,
    /// Factor after that.
    pub gain: f64,
    /// What is added then.
    pub offset: f64,
    /// Least and most that comes out.
    pub clamp: [f64; 2],
    /// How much of it there is, and when.
    pub schedule: Schedule,
}

impl CurveDrive {
    /// One that follows the source as it is.
    #[must_use]
    pub const fn unchanged(name: String, source: usize, schedule: Schedule) -> Self {
        Self { name, source, points: Vec::new(), gain: 1.0, offset: 0.0, clamp: [f64::MIN, f64::MAX], schedule }
    }

    /// What a value of the source becomes.
    #[must_use]
    pub fn value(&self, source: f64) -> f64 {
        (self.remapped(source) * self.gain + self.offset).clamp(self.clamp[0], self.clamp[1])
    }

    fn remapped(&self, value: f64) -> f64 {
        let after = self.points.partition_point(|point| point[0] <= value);
        match (after.checked_sub(1).map(|before| self.points[before]), self.points.get(after)) {
            (Some(before), Some(after)) => {
                before[1] + (after[1] - before[1]) * (value - before[0]) / (after[0] - before[0])
            }
            (Some(end), None) => end[1],
            (None, Some(end)) => end[1],
            (None, None) => value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive() -> CurveDrive {
        CurveDrive::unchanged("lock".into(), 0, Schedule::always())
    }

    #[test]
    fn a_value_stays_as_it_is_unless_a_row_says_otherwise() {
        assert_eq!(drive().value(-123.5), -123.5, "unchanged");
        let scaled = CurveDrive { gain: 2.0, offset: 1.0, clamp: [0.0, 10.0], ..drive() };
        assert_eq!([-3.0, 2.0, 20.0].map(|value| scaled.value(value)), [0.0, 5.0, 10.0], "gain, offset, bounds");
    }

    #[test]
    fn points_are_straight_between_and_even_beyond() {
        let bent = CurveDrive { points: vec![[0.0, 1.0], [10.0, 0.0], [20.0, 4.0]], ..drive() };
        let values = [-5.0, 0.0, 2.5, 10.0, 15.0, 20.0, 99.0].map(|value| bent.value(value));
        assert_eq!(values, [1.0, 1.0, 0.75, 0.0, 2.0, 4.0, 4.0], "by pieces");
        let first = CurveDrive { gain: 10.0, ..bent };
        assert_eq!(first.value(2.5), 7.5, "points first, then the gain");
    }
}
