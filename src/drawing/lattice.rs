//! A mesh of the drawing: a lattice of squares over its mask. What of a square is not in the mask, the texture leaves out.

use std::collections::BTreeMap;

use glam::DVec2;

use crate::picture::Picture;

/// Parts of a square that the mask needs of it.
const MIN_SHARE: f64 = 0.02;

/// A mesh at rest.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// In sides of the padded drawing, x right and y up.
    pub(super) vertices: Vec<DVec2>,
    pub(super) triangles: Vec<[usize; 3]>,
}

impl Lattice {
    /// Covers the pixels of which `is_figure` holds with so many squares along the side of the padded drawing.
    pub(super) fn new(mask: &Picture, squares: f64, is_figure: impl Fn([u8; 4]) -> bool) -> Self {
        let side = mask.width.max(mask.height) as f64;
        let spacing = side / squares;
        let mut counts: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for (index, &pixel) in mask.pixels.iter().enumerate() {
            if is_figure(pixel) {
                let at = |pixel: usize| ((pixel as f64 + 0.5) / spacing) as usize;
                *counts.entry((at(index / mask.width), at(index % mask.width))).or_default() += 1;
            }
        }
        let mut lattice = Self { vertices: vec![], triangles: vec![] };
        let mut corners: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        let least = (MIN_SHARE * spacing * spacing).max(1.0) as usize;
        for (&(row, column), _) in counts.iter().filter(|(_, count)| **count >= least) {
            let mut corner = |row: usize, column: usize| {
                *corners.entry((row, column)).or_insert_with(|| {
                    let [x, down] = [column, row].map(|at| at as f64 * spacing);
                    lattice.vertices.push(DVec2::new(x / side, (mask.height as f64 - down) / side));
                    lattice.vertices.len() - 1
                })
            };
            let [one, two, three, four] =
                [corner(row, column), corner(row, column + 1), corner(row + 1, column + 1), corner(row + 1, column)];
            // Diagonals alternate, so that no direction is stiffer than others.
            let halves = if (row + column) % 2 == 0 {
                [[one, four, three], [one, three, two]]
            } else {
                [[one, four, two], [two, four, three]]
            };
            lattice.triangles.extend(halves);
        }
        lattice
    }
}
