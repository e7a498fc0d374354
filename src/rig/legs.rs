//! Which joints of two animals' legs belong together when one has more of them.
//!
//! Legs have three or four segments, a shoulder blade or none, and toes or none; equal shares of their lengths are then other
//! bones. What belongs together lies alike in the standing animal: as high above the floor and as far in front of the paw.

use glam::DVec2;

use super::{leg_rows::is_whole_leg, rig::Rig};

/// What leaving out a joint between two that belong together costs, as a share of the body's height: better a scapula or a toe
/// is left out than an elbow.
const GAP: f64 = 0.06;
/// What has more joints is no leg.
const MAX_JOINTS: usize = 64;

/// The joints of two legs that belong together, from the body outward: all of the shorter leg, and as many of the longer one.
pub(super) fn corresponding(
    source: &Rig<'_>,
    source_leg: &[usize],
    target: &Rig<'_>,
    target_leg: &[usize],
) -> (Vec<usize>, Vec<usize>) {
    let both = (source_leg.to_vec(), target_leg.to_vec());
    let is_leg = |leg: &[usize]| (1..=MAX_JOINTS).contains(&leg.len());
    if source_leg.len() == target_leg.len() || !is_leg(source_leg) || !is_leg(target_leg) {
        return both;
    }
    let (source_places, target_places) = (places(source, source_leg), places(target, target_leg));
    let (Some(source_places), Some(target_places)) = (source_places, target_places) else { return both };
    let chosen = |joints: &[usize], wanted: &[usize]| wanted.iter().map(|position| joints[*position]).collect();
    if source_leg.len() < target_leg.len() {
        let wanted = choose(&source_places, &target_places);
        (source_leg.to_vec(), chosen(target_leg, &wanted))
    } else {
        let wanted = choose(&target_places, &source_places);
        (chosen(source_leg, &wanted), target_leg.to_vec())
    }
}

/// Where the joints of a leg are: in front of its last joint and above the floor, in heights of the pelvis. Nothing for an
/// animal without a height.
fn places(rig: &Rig<'_>, leg: &[usize]) -> Option<Vec<DVec2>> {
    let place = |joint: usize| rig.canonical_from_scene * rig.rest.transforms()[joint].translation;
    let legs = rig.roles.iter().filter(|(role, _)| is_whole_leg(role));
    let floor = legs.flat_map(|(_, joints)| joints).map(|&joint| place(joint).y).fold(f64::INFINITY, f64::min);
    let height = place(*rig.role("pelvis").first()?).y - floor;
    let paw = place(*leg.last()?).z;
    let relative = |joint: &usize| DVec2::new(place(*joint).z - paw, place(*joint).y - floor) / height;
    (height > 0.0).then(|| leg.iter().map(relative).collect())
}

/// For every place of the shorter leg, the one of the longer leg that belongs to it: in order, and as near as can be.
fn choose(shorter: &[DVec2], longer: &[DVec2]) -> Vec<usize> {
    // best[k][m]: what it costs to lay the first k + 1 places so that the last of them is at m, and where the one before is.
    let mut best: Vec<Vec<(f64, usize)>> = Vec::with_capacity(shorter.len());
    for (k, place) in shorter.iter().enumerate() {
        let row = longer.iter().enumerate().map(|(m, other)| {
            let own = place.distance(*other);
            let Some(above) = k.checked_sub(1).map(|above| &best[above]) else { return (own, 0) };
            let with_gap = |before: usize| (above[before].0 + GAP * (m - before - 1) as f64, before);
            let before = (0..m).map(with_gap).min_by(|first, second| first.0.total_cmp(&second.0));
            before.map_or((f64::INFINITY, 0), |(cost, before)| (cost + own, before))
        });
        let row = row.collect();
        best.push(row);
    }
    let last = |row: &Vec<(f64, usize)>| (0..row.len()).min_by(|a, b| row[*a].0.total_cmp(&row[*b].0)).unwrap_or(0);
    let mut chosen = vec![best.last().map_or(0, last)];
    for row in best.iter().skip(1).rev() {
        let at = chosen[chosen.len() - 1];
        chosen.push(row[at].1);
    }
    chosen.reverse();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leg_without_shoulder_blade_and_toes_finds_elbow_and_wrist() {
        let short = [DVec2::new(0.0, 1.14), DVec2::new(-0.02, 0.6), DVec2::new(0.0, 0.16)];
        let long = [(-0.29, 1.09), (0.09, 0.82), (-0.04, 0.46), (-0.03, 0.12), (0.0, 0.04)].map(DVec2::from);
        assert_eq!(choose(&short, &long), [1, 2, 3], "upper leg, elbow, wrist");
    }

    #[test]
    fn equal_places_belong_together() {
        let places = [(0.0, 1.0), (0.1, 0.7), (-0.1, 0.3), (0.0, 0.1), (0.0, 0.0)].map(DVec2::from);
        assert_eq!(choose(&places[1..4], &places), [1, 2, 3], "those in the middle");
        assert_eq!(choose(&[places[0], places[4]], &places), [0, 4], "both ends, whatever is between");
    }
}
