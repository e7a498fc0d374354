//! An order of a mesh's vertices that keeps the factors of its matrices sparse: always next is the vertex with the fewest neighbors among those that
//! remain, which become neighbors of one another (A. George and J. Liu, "The Evolution of the Minimum Degree Ordering Algorithm", SIAM Review 31,
//! 1989).

use std::collections::BTreeSet;

/// For each vertex its place in the order.
pub(super) fn order(neighbors: &[Vec<usize>]) -> Vec<usize> {
    let mut around: Vec<BTreeSet<usize>> = neighbors.iter().map(|own| own.iter().copied().collect()).collect();
    let mut waiting: BTreeSet<(usize, usize)> =
        around.iter().enumerate().map(|(vertex, around)| (around.len(), vertex)).collect();
    let mut places = vec![0; neighbors.len()];
    let mut place = 0;
    while let Some((_, vertex)) = waiting.pop_first() {
        places[vertex] = place;
        place += 1;
        let left = std::mem::take(&mut around[vertex]);
        for &one in &left {
            waiting.remove(&(around[one].len(), one));
            around[one].remove(&vertex);
            around[one].extend(left.iter().copied().filter(|other| *other != one));
            waiting.insert((around[one].len(), one));
        }
    }
    places
}
