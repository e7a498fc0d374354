//! An order of a mesh's vertices that keeps the factors of its matrices sparse: nested dissection by place.

use glam::DVec2;

/// Parts of so many vertices are not divided.
const SMALL: usize = 24;

/// For each vertex its place in the order.
pub(super) fn order(places: &[DVec2], neighbors: &[Vec<usize>]) -> Vec<usize> {
    let mut order = Vec::with_capacity(places.len());
    let mut side = vec![0; places.len()];
    let mut mark = 0;
    // The parts that remain: vertices to divide, or a finished separator.
    let mut open = vec![((0..places.len()).collect::<Vec<_>>(), false)];
    while let Some((mut part, is_done)) = open.pop() {
        if is_done || part.len() <= SMALL {
            order.extend(part);
            continue;
        }
        let low = part.iter().fold(DVec2::MAX, |low, &vertex| low.min(places[vertex]));
        let high = part.iter().fold(DVec2::MIN, |high, &vertex| high.max(places[vertex]));
        let axis = usize::from((high - low).y > (high - low).x);
        part.sort_by(|&one, &other| places[one][axis].total_cmp(&places[other][axis]).then(one.cmp(&other)));
        let far = part.split_off(part.len() / 2);
        mark += 1;
        far.iter().for_each(|&vertex| side[vertex] = mark);
        let (between, near): (Vec<usize>, Vec<usize>) =
            part.into_iter().partition(|&vertex| neighbors[vertex].iter().any(|&other| side[other] == mark));
        open.push((between, true));
        open.push((far, false));
        open.push((near, false));
    }
    // The halves come before what separates them: the stack gives near, far, between.
    let mut at = vec![0; places.len()];
    order.iter().enumerate().for_each(|(place, &vertex)| at[vertex] = place);
    at
}
