//! Which pair of legs of one creature drives which of another that has more or fewer.
//!
//! Rows of legs are counted from the front: a quadruped has two, an insect three, a spider four. Front goes to front and hind to
//! hind, what is between in proportion; a row drives one other at most, so that no two legs of a side step as one.

use super::{
    recognition::{Role, Side},
    rig::Rig,
    rig_memory::Question,
};

/// Whether a role is a whole leg of an animal.
pub(crate) fn is_whole_leg(role: &str) -> bool {
    role.parse::<Role>().is_ok_and(|role| role.part.is_whole_leg())
}

/// The pairs of legs of an animal from the front, by the role of the left one; nothing for bodies on two legs.
pub(crate) fn leg_rows(rig: &Rig<'_>) -> Vec<Role> {
    rig.recall(WhichRowsOfLegs, |_| find_leg_rows(rig))
}

/// Which rows of legs does it have?
#[derive(PartialEq)]
struct WhichRowsOfLegs;

impl Question for WhichRowsOfLegs {
    type Answer = Vec<Role>;
}

fn find_leg_rows(rig: &Rig<'_>) -> Vec<Role> {
    let roles = rig.roles.keys().filter(|role| is_whole_leg(role)).filter_map(|role| role.parse::<Role>().ok());
    let mut rows: Vec<Role> = roles.map(|role| Role { side: Side::Left, ..role }).collect();
    rows.sort_unstable();
    rows.dedup();
    rows
}

/// The leg of the source that drives a leg of the target, where one of the two has more than four.
pub(crate) fn driving_leg(source: &Rig<'_>, target: &Rig<'_>, leg: Role) -> Option<Role> {
    let (from, to) = (leg_rows(source), leg_rows(target));
    let row = to.iter().position(|row| *row == Role { side: Side::Left, ..leg })?;
    let driving = from.get(driving_row(from.len(), to.len(), row)?)?;
    Some(Role { side: leg.side, ..*driving })
}

/// The row of the source for a row of the target. Nothing where the target has more rows and this one is left over.
fn driving_row(source_rows: usize, target_rows: usize, row: usize) -> Option<usize> {
    let (fewer, more) = (source_rows.min(target_rows), source_rows.max(target_rows));
    if fewer < 2 || more == fewer {
        return (row < source_rows).then_some(row);
    }
    // Where the rows of the smaller side lie among those of the larger one, to the nearest.
    let place = |row: usize| (2 * row * (more - 1) + fewer - 1) / (2 * (fewer - 1));
    if source_rows > target_rows { Some(place(row)) } else { (0..fewer).find(|from| place(*from) == row) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn front_goes_to_front_and_hind_to_hind() {
        let rows = |from: usize, to: usize| (0..to).map(|row| driving_row(from, to, row)).collect::<Vec<_>>();
        assert_eq!(rows(3, 3), [Some(0), Some(1), Some(2)], "equal");
        assert_eq!(rows(2, 3), [Some(0), None, Some(1)], "a quadruped leaves the middle legs of an insect alone");
        assert_eq!(rows(3, 2), [Some(0), Some(2)], "and the other way round");
        assert_eq!(rows(4, 3), [Some(0), Some(2), Some(3)], "a spider onto an insect");
        assert_eq!(rows(3, 4), [Some(0), None, Some(1), Some(2)], "an insect onto a spider");
        assert_eq!(rows(0, 3), [None; 3], "nothing onto something");
        for (from, to) in [(2, 9), (9, 2), (5, 17), (17, 5)] {
            let mut used: Vec<usize> = rows(from, to).into_iter().flatten().collect();
            assert_eq!((used[0], used[used.len() - 1]), (0, from - 1), "{from} onto {to}: both ends");
            assert!(used.is_sorted(), "{from} onto {to}: in order");
            used.dedup();
            assert_eq!(used.len(), from.min(to), "{from} onto {to}: each once");
        }
    }
}
