//! Triangles of a deformed mesh that turned over are turned back by moving their corners as little as that takes: each one pushes its own
//! three corners apart until it has a small part of its area again, in turns, until none is left (after M. Müller et al., "Position Based
//! Dynamics", Journal of Visual Communication and Image Representation 18, 2007).

use glam::DVec2;

/// A triangle with less of its area than this at rest is pushed open.
const OPEN_BELOW: f64 = 0.02;
/// So much of its area it gets.
const OPENED_TO: f64 = 0.06;
/// A push moves a corner by so much of the length of an edge at rest at most.
const LONGEST_PUSH: f64 = 0.5;
/// Pushes for each triangle that was turned over at first, and in any case: a knot that does not come undone ends.
const PUSHES: [usize; 2] = [60, 400];

/// The triangles of a mesh with their areas at rest.
#[derive(Clone, Debug)]
pub(super) struct Untangling {
    triangles: Vec<[usize; 3]>,
    /// Twice the area of each at rest.
    areas: Vec<f64>,
    /// For each vertex its triangles.
    around: Vec<Vec<usize>>,
}

/// What [`Untangling::untangle`] works in.
#[derive(Clone, Debug, Default)]
pub(super) struct UntanglingWorkspace {
    open: std::collections::VecDeque<usize>,
    is_open: Vec<bool>,
}

/// Twice the area of a triangle, negative where it goes around clockwise.
pub(super) fn doubled_area(vertices: &[DVec2], &[one, two, three]: &[usize; 3]) -> f64 {
    (vertices[two] - vertices[one]).perp_dot(vertices[three] - vertices[one])
}

impl Untangling {
    /// Knows a mesh at rest.
    pub(super) fn new(vertices: &[DVec2], triangles: &[[usize; 3]]) -> Self {
        let mut around = vec![Vec::new(); vertices.len()];
        for (index, triangle) in triangles.iter().enumerate() {
            triangle.iter().for_each(|&vertex| around[vertex].push(index));
        }
        let areas = triangles.iter().map(|triangle| doubled_area(vertices, triangle)).collect();
        Self { triangles: triangles.to_vec(), areas, around }
    }

    /// How much of its area at rest a triangle has.
    fn share(&self, triangle: usize, vertices: &[DVec2]) -> f64 {
        doubled_area(vertices, &self.triangles[triangle]) / self.areas[triangle]
    }

    /// Turns back what turned over.
    pub(super) fn untangle(&self, vertices: &mut [DVec2], workspace: &mut UntanglingWorkspace) {
        let UntanglingWorkspace { open, is_open } = workspace;
        open.clear();
        open.extend((0..self.triangles.len()).filter(|&triangle| self.share(triangle, vertices) < OPEN_BELOW));
        if open.is_empty() {
            return;
        }
        is_open.clear();
        is_open.resize(self.triangles.len(), false);
        open.iter().for_each(|&triangle| is_open[triangle] = true);
        let mut left = open.len() * PUSHES[0] + PUSHES[1];
        while let Some(triangle) = open.pop_front() {
            is_open[triangle] = false;
            if self.share(triangle, vertices) >= OPEN_BELOW {
                continue;
            }
            self.push(triangle, vertices);
            left -= 1;
            if left == 0 {
                return;
            }
            for &vertex in &self.triangles[triangle] {
                for &other in &self.around[vertex] {
                    if !is_open[other] && self.share(other, vertices) < OPEN_BELOW {
                        is_open[other] = true;
                        open.push_back(other);
                    }
                }
            }
        }
    }

    /// Moves the corners of a triangle the shortest way to where it is open.
    fn push(&self, triangle: usize, vertices: &mut [DVec2]) {
        let corners = self.triangles[triangle];
        let rest = self.areas[triangle];
        let [one, two, three] = corners.map(|corner| vertices[corner]);
        // The area grows fastest where each corner goes straight away from the edge across.
        let ways = [(two - three).perp(), (three - one).perp(), (one - two).perp()].map(|way| -way * rest.signum());
        let steepness: f64 = ways.iter().map(|way| way.length_squared()).sum();
        let missing = rest.abs() * OPENED_TO - doubled_area(vertices, &corners) * rest.signum();
        let step = missing / steepness.max(rest.abs() * 1e-3);
        let longest = LONGEST_PUSH * rest.abs().sqrt();
        for (corner, way) in corners.into_iter().zip(ways) {
            vertices[corner] += (way * step).clamp_length_max(longest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_turned_over_is_turned_back_and_the_rest_stays() {
        let columns = 9;
        let rest: Vec<DVec2> = (0..columns * columns)
            .map(|index| DVec2::new((index % columns) as f64, (index / columns) as f64))
            .collect();
        let triangles: Vec<[usize; 3]> = (0..columns - 1)
            .flat_map(|row| (0..columns - 1).map(move |column| row * columns + column))
            .flat_map(|low| [[low, low + 1, low + columns + 1], [low + columns, low, low + columns + 1]])
            .collect();
        let untangling = Untangling::new(&rest, &triangles);
        let mut moved = rest.clone();
        // One inner vertex beyond its neighbor, and a corner folded in.
        moved[4 * columns + 4] += DVec2::new(1.7, 0.3);
        moved[0] = DVec2::new(1.2, 1.3);
        let before = moved.clone();
        untangling.untangle(&mut moved, &mut UntanglingWorkspace::default());
        let turned_over = (0..triangles.len()).filter(|&triangle| untangling.share(triangle, &moved) <= 0.0);
        assert_eq!(turned_over.count(), 0);
        for far in [8 * columns, 8 * columns + 8, 7 * columns + 1] {
            assert_eq!(before[far], moved[far], "what lies apart is left alone");
        }
        let mut still = rest.clone();
        untangling.untangle(&mut still, &mut UntanglingWorkspace::default());
        assert_eq!(still, rest);
    }
}
