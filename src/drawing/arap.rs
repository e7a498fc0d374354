//! A mesh that keeps its shape as far as its pins let it (T. Igarashi and Y. Igarashi, "Implementing As-Rigid-As-Possible Shape
//! Manipulation and Surface Flattening", Journal of Graphics, GPU, and Game Tools 14(1), 2009).
//!
//! The first of the two solves is linear in the pins, so its part in the turns of the edges is computed once; a frame is one product
//! and one back-substitution.

use std::collections::BTreeSet;

use glam::DVec2;

use super::{
    DrawingError,
    complex::{Complex, Entry},
    elimination,
    factors::{Factors, Hermitian},
};

/// Weight of a pin against an edge.
const PIN_WEIGHT: f64 = 1000.0;
/// Vertices of one mesh.
pub(super) const MAX_VERTICES: usize = 20_000;

/// How exactly matrices are formed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Double precision.
    Double,
    /// Rows, their products and the coordinates of pins are rounded to single precision, as *Animated Drawings* does. With pins a
    /// thousand times as heavy as edges this moves hands and feet visibly.
    Single,
}

impl Precision {
    fn round<E: Entry>(self, value: E) -> E {
        if self == Self::Single { value.single() } else { value }
    }
}

/// A pin: three vertices and their shares.
pub(super) type Pin = [(usize, f64); 3];

/// A mesh with pins, ready for frames.
#[derive(Clone, Debug)]
pub struct Arap {
    /// For each point that was to be a pin, whether it lies in the mesh.
    pub is_pinned: Vec<bool>,
    pins: Vec<Pin>,
    edges: Vec<(usize, usize)>,
    /// The edges at rest.
    rest: Vec<Complex>,
    /// For each edge and pin the pin's part in the turn of the edge.
    turns: Vec<Complex>,
    factors: Factors<f64>,
    /// For each vertex its place in the factors.
    places: Vec<usize>,
    precision: Precision,
}

impl Arap {
    /// Prepares a mesh. Points outside of it do not become pins.
    ///
    /// # Errors
    ///
    /// Where a triangle names a vertex that does not exist, the mesh is too large, or no point lies in it.
    pub fn new(
        vertices: &[DVec2],
        triangles: &[[usize; 3]],
        points: &[DVec2],
        precision: Precision,
    ) -> Result<Self, DrawingError> {
        if vertices.len() > MAX_VERTICES || triangles.iter().flatten().any(|&corner| corner >= vertices.len()) {
            let detail = format!("{} vertices, or a triangle of vertices that do not exist", vertices.len());
            return Err(DrawingError::new("mesh", detail, format!("keep to {MAX_VERTICES} vertices")));
        }
        let found: Vec<Option<Pin>> = points.iter().map(|&point| pin(vertices, triangles, point, precision)).collect();
        let pins: Vec<Pin> = found.iter().flatten().copied().collect();
        if pins.is_empty() {
            return Err(DrawingError::new("mesh", "no joint lies in the mesh", "move the joints into the drawing"));
        }
        let neighbors = neighbors(vertices.len(), triangles);
        let edges: Vec<(usize, usize)> = (0..vertices.len())
            .flat_map(|one| neighbors[one].iter().filter(move |&&other| one < other).map(move |&other| (one, other)))
            .collect();
        let rest: Vec<Complex> = edges.iter().map(|&(one, other)| Complex(vertices[other] - vertices[one])).collect();
        let places = elimination::order(&neighbors);
        let turn_rows: Vec<Vec<(usize, Complex)>> =
            edges.iter().map(|&edge| turn_row(edge, vertices, &neighbors)).collect();
        let is_single = precision == Precision::Single;
        let weighted = |pin: &Pin| pin.map(|(vertex, share)| (vertex, precision.round(PIN_WEIGHT * share)));

        let second: Vec<Vec<(usize, f64)>> =
            edges.iter().map(|&(one, other)| vec![(one, -1.0), (other, 1.0)]).collect();
        let second_pins: Vec<Vec<(usize, f64)>> = pins.iter().map(|pin| weighted(pin).to_vec()).collect();
        let factors = Factors::new(&Hermitian::of_rows(&[&second, &second_pins], &places, is_single));

        let first = edges.iter().zip(&rest).zip(&turn_rows);
        let first: Vec<Vec<(usize, Complex)>> =
            first.map(|((&edge, &along), row)| stretch_row(edge, along, row, precision)).collect();
        let first_pins: Vec<Vec<(usize, Complex)>> = pins
            .iter()
            .map(|pin| weighted(pin).map(|(vertex, weight)| (vertex, Complex::new(weight, 0.0))).to_vec())
            .collect();
        let first = Factors::new(&Hermitian::of_rows(&[&first, &first_pins], &places, is_single));
        let mut turns = vec![Complex::default(); edges.len() * pins.len()];
        let mut solved = vec![Complex::default(); vertices.len()];
        for (index, pin) in pins.iter().enumerate() {
            solved.fill(Complex::default());
            for (vertex, weight) in weighted(pin) {
                solved[places[vertex]] += Complex::new(weight * PIN_WEIGHT, 0.0);
            }
            first.solve(&mut solved);
            for (edge, row) in turn_rows.iter().enumerate() {
                let sum = &mut turns[edge * pins.len() + index];
                row.iter().for_each(|&(vertex, share)| *sum += share * solved[places[vertex]]);
            }
        }
        let is_pinned = found.iter().map(Option::is_some).collect();
        Ok(Self { is_pinned, pins, edges, rest, turns, factors, places, precision })
    }

    /// Memory for [`Self::deform`].
    #[must_use]
    pub fn workspace(&self) -> ArapWorkspace {
        ArapWorkspace {
            targets: Vec::with_capacity(self.pins.len()),
            unknowns: vec![Complex::default(); self.places.len()],
        }
    }

    /// Where the vertices are when the points, all of those given to [`Self::new`], are at `points`.
    pub fn deform(&self, points: &[DVec2], workspace: &mut ArapWorkspace, vertices: &mut [DVec2]) {
        let ArapWorkspace { targets, unknowns } = workspace;
        targets.clear();
        targets.extend(points.iter().zip(&self.is_pinned).filter(|(_, is)| **is).map(|(&point, _)| Complex(point)));
        unknowns.fill(Complex::default());
        let turns = self.turns.chunks_exact(targets.len());
        for ((&(one, other), &along), parts) in self.edges.iter().zip(&self.rest).zip(turns) {
            let mut turn = Complex::default();
            for (&part, &target) in parts.iter().zip(targets.iter()) {
                turn += part * target;
            }
            let turned = turn.unit() * along;
            unknowns[self.places[one]] -= turned;
            unknowns[self.places[other]] += turned;
        }
        for (pin, target) in self.pins.iter().zip(targets.iter()) {
            for &(vertex, share) in pin {
                let weight = self.precision.round(PIN_WEIGHT * share) * PIN_WEIGHT;
                unknowns[self.places[vertex]] += target.scaled(weight);
            }
        }
        self.factors.solve(unknowns);
        for (vertex, &place) in vertices.iter_mut().zip(&self.places) {
            *vertex = unknowns[place].0;
        }
    }
}

/// What [`Arap::deform`] works in.
#[derive(Clone, Debug)]
pub struct ArapWorkspace {
    targets: Vec<Complex>,
    unknowns: Vec<Complex>,
}

/// For each vertex those that share a triangle with it, in order.
pub(super) fn neighbors(count: usize, triangles: &[[usize; 3]]) -> Vec<Vec<usize>> {
    let mut neighbors = vec![BTreeSet::new(); count];
    for &[one, two, three] in triangles {
        for (from, to) in [(one, two), (two, three), (three, one)] {
            if from != to {
                neighbors[from].insert(to);
                neighbors[to].insert(from);
            }
        }
    }
    neighbors.into_iter().map(|set| set.into_iter().collect()).collect()
}

/// The turn and stretch of an edge as shares of the places of the vertices around it: what fits their way from rest with the least
/// squares.
fn turn_row((one, other): (usize, usize), vertices: &[DVec2], neighbors: &[Vec<usize>]) -> Vec<(usize, Complex)> {
    let around = neighbors[one].iter().copied();
    let around = around.filter(|&vertex| vertex == other || neighbors[other].binary_search(&vertex).is_ok());
    let mut row: Vec<(usize, Complex)> =
        around.map(|vertex| (vertex, Complex(vertices[vertex] - vertices[one]).conjugate())).collect();
    let sum: f64 = row.iter().map(|(_, share)| share.square()).sum();
    let mut own = Complex::default();
    for (_, share) in &mut row {
        *share = share.scaled(if sum > 0.0 { 1.0 / sum } else { 0.0 });
        own -= *share;
    }
    row.push((one, own));
    row
}

/// What an edge is away from its own turn and stretch.
fn stretch_row(
    (one, other): (usize, usize),
    along: Complex,
    turn: &[(usize, Complex)],
    precision: Precision,
) -> Vec<(usize, Complex)> {
    let row = turn.iter().map(|&(vertex, share)| {
        let own = f64::from(u8::from(vertex == other)) - f64::from(u8::from(vertex == one));
        (vertex, precision.round(Complex::new(own, 0.0) - share * along))
    });
    row.collect()
}

/// The first triangle that a point lies in, and the shares of its corners.
pub(super) fn pin(vertices: &[DVec2], triangles: &[[usize; 3]], point: DVec2, precision: Precision) -> Option<Pin> {
    let round = |value: f64| precision.round(value);
    let dot = |one: [f64; 2], other: [f64; 2]| round(round(one[0] * other[0]) + round(one[1] * other[1]));
    let away = |to: DVec2, from: DVec2| [round(round(to.x) - round(from.x)), round(round(to.y) - round(from.y))];
    triangles.iter().find_map(|&[a, b, c]| {
        let (ab, ac) = (away(vertices[b], vertices[a]), away(vertices[c], vertices[a]));
        let ap = away(point, vertices[a]);
        let (d00, d01, d11, d20, d21) = (dot(ab, ab), dot(ab, ac), dot(ac, ac), dot(ap, ab), dot(ap, ac));
        let area = round(round(d00 * d11) - round(d01 * d01));
        let second = round(round(round(d11 * d20) - round(d01 * d21)) / area);
        let third = round(round(round(d00 * d21) - round(d01 * d20)) / area);
        let first = round(round(1.0 - second) - third);
        let is_inside = area > 0.0 && first >= 0.0 && second >= 0.0 && third >= 0.0;
        is_inside.then_some([(a, first), (b, second), (c, third)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet() -> (Vec<DVec2>, Vec<[usize; 3]>) {
        let vertices =
            (0..63).map(|index| DVec2::new(f64::from(index % 9) / 9.0, f64::from(index / 9) / 9.1)).collect();
        let squares = (0..6).flat_map(|row| (0..8).map(move |column| row * 9 + column));
        let triangles = squares.flat_map(|low| [[low, low + 1, low + 10], [low, low + 10, low + 9]]).collect();
        (vertices, triangles)
    }

    #[test]
    fn pins_that_turn_and_move_together_take_the_mesh_with_them() {
        let (vertices, triangles) = sheet();
        let points = [DVec2::new(0.1, 0.1), DVec2::new(0.7, 0.3), DVec2::new(0.4, 0.5), DVec2::new(3.0, 3.0)];
        let arap = Arap::new(&vertices, &triangles, &points, Precision::Double).expect("a mesh with pins");
        assert_eq!(arap.is_pinned, [true, true, true, false]);
        let moved = |point: DVec2| DVec2::from_angle(0.7).rotate(point) + DVec2::new(2.0, -1.0);
        let mut deformed = vec![DVec2::ZERO; vertices.len()];
        arap.deform(&points.map(moved), &mut arap.workspace(), &mut deformed);
        for (vertex, deformed) in vertices.iter().zip(&deformed) {
            assert!(moved(*vertex).distance(*deformed) < 1e-9);
        }
    }

    #[test]
    fn a_bend_keeps_the_pins_and_the_middle_between_them() {
        let (vertices, triangles) = sheet();
        let points = [DVec2::new(0.05, 0.3), DVec2::new(0.45, 0.3), DVec2::new(0.85, 0.3)];
        let arap = Arap::new(&vertices, &triangles, &points, Precision::Double).expect("a mesh with pins");
        let bent = [points[0], points[1], points[1] + DVec2::from_angle(1.2) * 0.4];
        let mut deformed = vec![DVec2::ZERO; vertices.len()];
        arap.deform(&bent, &mut arap.workspace(), &mut deformed);
        for (pin, wanted) in arap.pins.iter().zip(bent) {
            let place: DVec2 = pin.iter().map(|&(vertex, share)| deformed[vertex] * share).sum();
            assert!(place.distance(wanted) < 1e-5, "{place} {wanted}");
        }
    }

    /// Least squares by Gaussian elimination of the normal equations: rows of shares by unknown, each with what it is to be.
    fn dense(count: usize, rows: &[(Vec<(usize, f64)>, f64)]) -> Vec<f64> {
        let mut matrix = vec![vec![0.0; count + 1]; count];
        for (row, wanted) in rows {
            for &(one, left) in row {
                row.iter().for_each(|&(other, right)| matrix[one][other] += left * right);
                matrix[one][count] += left * wanted;
            }
        }
        for column in 0..count {
            let best = (column..count).max_by(|a, b| matrix[*a][column].abs().total_cmp(&matrix[*b][column].abs()));
            matrix.swap(column, best.expect("a row"));
            let pivot = matrix[column].clone();
            for row in &mut matrix[column + 1..] {
                let share = row[column] / pivot[column];
                row.iter_mut().zip(&pivot).skip(column).for_each(|(value, above)| *value -= share * above);
            }
        }
        let mut solved = vec![0.0; count];
        for row in (0..count).rev() {
            let sum: f64 = (row + 1..count).map(|column| matrix[row][column] * solved[column]).sum();
            solved[row] = (matrix[row][count] - sum) / matrix[row][row];
        }
        solved
    }

    /// The paper's two steps in real numbers: x and y of a vertex are two unknowns of the first, and the second is solved for each.
    fn by_the_paper(vertices: &[DVec2], triangles: &[[usize; 3]], pins: &[(Pin, DVec2)]) -> Vec<DVec2> {
        let neighbors = neighbors(vertices.len(), triangles);
        let pinned = |rows: &mut Vec<(Vec<(usize, f64)>, f64)>, unknown: &dyn Fn(usize) -> usize, axis: usize| {
            for (pin, target) in pins {
                let row = pin.iter().map(|&(vertex, share)| (unknown(vertex), PIN_WEIGHT * share)).collect();
                rows.push((row, PIN_WEIGHT * target[axis]));
            }
        };
        let mut edges: Vec<(usize, usize, Vec<usize>)> = Vec::new();
        for one in 0..vertices.len() {
            for &other in neighbors[one].iter().filter(|other| one < **other) {
                let wings = neighbors[one].iter().copied().filter(|wing| neighbors[other].contains(wing));
                edges.push((one, other, std::iter::once(other).chain(wings).collect()));
            }
        }
        let mut rows = Vec::new();
        for (one, other, around) in &edges {
            // Cosine and sine, each as shares of the unknowns: what turns and stretches the way to those around from rest with the least squares.
            let ways: Vec<DVec2> = around.iter().map(|vertex| vertices[*vertex] - vertices[*one]).collect();
            let sum: f64 = ways.iter().map(|way| way.length_squared()).sum();
            let (mut cosine, mut sine) = (Vec::new(), Vec::new());
            for (&vertex, way) in around.iter().zip(&ways) {
                for (end, sign) in [(vertex, 1.0), (*one, -1.0)] {
                    cosine.extend([(2 * end, sign * way.x / sum), (2 * end + 1, sign * way.y / sum)]);
                    sine.extend([(2 * end, -sign * way.y / sum), (2 * end + 1, sign * way.x / sum)]);
                }
            }
            let along = vertices[*other] - vertices[*one];
            for (axis, [by_cosine, by_sine]) in [[along.x, -along.y], [along.y, along.x]].into_iter().enumerate() {
                let mut row = vec![(2 * other + axis, 1.0), (2 * one + axis, -1.0)];
                row.extend(cosine.iter().map(|(unknown, share)| (*unknown, -share * by_cosine)));
                row.extend(sine.iter().map(|(unknown, share)| (*unknown, -share * by_sine)));
                rows.push((row, 0.0));
            }
        }
        (0..2).for_each(|axis| pinned(&mut rows, &|vertex| 2 * vertex + axis, axis));
        let first = dense(2 * vertices.len(), &rows);
        let first: Vec<DVec2> = first.as_chunks::<2>().0.iter().map(|[x, y]| DVec2::new(*x, *y)).collect();
        let turned = |(one, other, around): &(usize, usize, Vec<usize>)| {
            let (mut cosine, mut sine) = (0.0, 0.0);
            for &vertex in around {
                let (rest, now) = (vertices[vertex] - vertices[*one], first[vertex] - first[*one]);
                cosine += rest.dot(now);
                sine += rest.perp_dot(now);
            }
            DVec2::new(cosine, sine).normalize().rotate(vertices[*other] - vertices[*one])
        };
        let axes = [0, 1].map(|axis| {
            let row = |edge: &(usize, usize, Vec<usize>)| (vec![(edge.1, 1.0), (edge.0, -1.0)], turned(edge)[axis]);
            let mut rows: Vec<(Vec<(usize, f64)>, f64)> = edges.iter().map(row).collect();
            pinned(&mut rows, &|vertex| vertex, axis);
            dense(vertices.len(), &rows)
        });
        axes[0].iter().zip(&axes[1]).map(|(x, y)| DVec2::new(*x, *y)).collect()
    }

    #[test]
    fn it_is_what_a_dense_solve_of_the_paper_s_equations_gives() {
        let (vertices, triangles) = sheet();
        let points = [DVec2::new(0.05, 0.3), DVec2::new(0.45, 0.3), DVec2::new(0.85, 0.3), DVec2::new(0.45, 0.6)];
        let arap = Arap::new(&vertices, &triangles, &points, Precision::Double).expect("a mesh with pins");
        for angle in [0.4, 1.2, 2.5] {
            let mut bent = points;
            bent[2] = points[1] + DVec2::from_angle(angle) * 0.4;
            bent[3] += DVec2::new(0.1, 0.05);
            let mut deformed = vec![DVec2::ZERO; vertices.len()];
            arap.deform(&bent, &mut arap.workspace(), &mut deformed);
            let pins: Vec<(Pin, DVec2)> = arap.pins.iter().copied().zip(bent).collect();
            let wanted = by_the_paper(&vertices, &triangles, &pins);
            let worst = deformed.iter().zip(wanted).map(|(one, other)| one.distance(other)).fold(0.0, f64::max);
            assert!(worst < 1e-9, "{worst} at {angle}");
        }
    }
}
