//! How deep a source's feet go by themselves, which excuses the target's.

use super::{foot_points::Traced, statistics::percentile};

/// When each foot of the source stands, in the order in which the heights of feet are told.
pub(super) fn standing_of(traced: &[Traced<'_>]) -> Vec<Vec<bool>> {
    let mut feet: Vec<(&str, Vec<bool>)> = Vec::new();
    for traced in traced.iter().filter(|traced| traced.point.bears) {
        let stands = &traced.standing.source.stands;
        match feet.iter_mut().find(|(part, _)| *part == traced.point.part) {
            Some((_, foot)) => foot.iter_mut().zip(stands).for_each(|(foot, stands)| *foot |= stands),
            None => feet.push((&traced.point.part, stands.clone())),
        }
    }
    feet.into_iter().map(|(_, stands)| stands).collect()
}

/// How deep feet go by themselves. A clip whose feet stand below its floor is no excuse: what counts is how far a foot goes below where they
/// usually stand.
pub(super) fn own_depths(feet: &[Vec<f64>], standing: &[Vec<bool>]) -> Vec<f64> {
    let of_foot = |(heights, stands): (&Vec<f64>, &Vec<bool>)| {
        let standing = heights.iter().zip(stands).filter(|(_, stands)| **stands).map(|(height, _)| *height);
        standing.collect::<Vec<f64>>()
    };
    let mut stood: Vec<f64> = feet.iter().zip(standing).flat_map(of_foot).collect();
    let floor = if stood.is_empty() { 0.0 } else { percentile(&mut stood, 0.5).min(0.0) };
    feet.iter().flatten().map(|height| (floor - height).max(0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_foot_that_dips_is_as_deep_as_it_goes_below_where_feet_stand() {
        // One foot stands at a level; the other one swings through 8 cm below it, in a short clip for a sixth of the time.
        let clip = |level: f64| {
            let swing = |frame: usize| if (20..27).contains(&frame) { -8.0 } else { 4.0 };
            let feet = vec![vec![level; 42], (0..42).map(|frame| level + swing(frame)).collect()];
            (feet, vec![vec![true; 42], vec![false; 42]])
        };
        let deepest = |(feet, standing): &(Vec<Vec<f64>>, Vec<Vec<bool>>)| {
            own_depths(feet, standing).into_iter().fold(0.0, f64::max)
        };
        for level in [0.0, -3.0] {
            assert!((deepest(&clip(level)) - 8.0).abs() < 1e-12, "feet stand at {level}: {}", deepest(&clip(level)));
        }
        assert!((deepest(&clip(2.0)) - 6.0).abs() < 1e-12, "a clip above its floor excuses what is in the floor");
        let in_the_air = (vec![vec![-20.0; 42]; 2], vec![vec![false; 42]; 2]);
        assert!((deepest(&in_the_air) - 20.0).abs() < 1e-12, "whose feet never stand is deep as it is");
    }
}
