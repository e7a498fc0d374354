//! Values over time, for plots: every frame in a full report, else the worst of each stretch.

use std::{collections::BTreeMap, ops::Range};

use serde::{Deserialize, Serialize};

use super::{
    metric::{Series, rounded},
    motion::Compared,
};

/// Values of a curve in a summary.
const MAX_VALUES: usize = 120;

/// Curves of one kind, one per limb, over common times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Curves {
    /// Unit of the values.
    pub unit: String,
    /// Times of the values; of a summary, where the stretch begins that a value is the worst of.
    pub times_seconds: Vec<f64>,
    /// Values by limb; null where there is nothing to say, such as the slide of a foot in the air.
    pub parts: BTreeMap<String, Vec<Option<f64>>>,
}

/// Which of several values stands for a stretch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Keep {
    Largest,
    Smallest,
}

impl Curves {
    pub(super) fn new(unit: &str, series: &[Series], compared: &Compared, keep: Keep, all: bool) -> Self {
        let stretches = stretches(compared.len(), if all { usize::MAX } else { MAX_VALUES });
        let values = |series: &Series| {
            let value = |stretch: &Range<usize>| {
                let finite = series.values[stretch.clone()].iter().copied().filter(|value| value.is_finite());
                match keep {
                    Keep::Largest => finite.max_by(f64::total_cmp),
                    Keep::Smallest => finite.min_by(f64::total_cmp),
                }
                .map(rounded)
            };
            (series.part.clone(), stretches.iter().map(value).collect())
        };
        Self {
            unit: unit.to_owned(),
            times_seconds: stretches.iter().map(|stretch| rounded(compared.times_seconds[stretch.start])).collect(),
            parts: series.iter().map(values).collect(),
        }
    }
}

fn stretches(count: usize, most: usize) -> Vec<Range<usize>> {
    let stretches = count.min(most);
    (0..stretches).map(|index| count * index / stretches..count * (index + 1) / stretches).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_cover_every_frame_once() {
        for (count, most) in [(0, 5), (3, 5), (5, 5), (17, 5), (1000, 120)] {
            let found = stretches(count, most);
            let covered: Vec<usize> = found.iter().cloned().flatten().collect();
            assert_eq!(covered, (0..count).collect::<Vec<_>>(), "{count} frames in {most}");
            assert!(found.len() <= most, "{count} frames in {most}");
        }
    }
}
