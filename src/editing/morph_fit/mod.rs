//! Weights of the target's shapes that move its face as the source's shapes move theirs, whatever either are called.
//!
//! For each point of the target's face its place on the source's is found ([`correspondence`]). With `A` the displacements there of the
//! target's shapes at 1, column by column, and `B` those of the source's, brought to the target's size, the weights `w` of a frame
//! whose source weights are `s` are those within the bounds for which `|A·w − B·s|² + ρ|w|²` is least ([`bounded`]). `AᵀA`, `AᵀB` and
//! `BᵀB` are all that a frame needs. (docs/algorithm/faces.md.)

mod bounded;
mod correspondence;

use glam::{DQuat, DVec3};

use crate::model::MorphMesh;

use bounded::least_within;
use correspondence::{Correspondence, correspondence};

/// A point that a shape moves by less than this share of its largest displacement stays where it is.
const MOVES_SHARE: f64 = 0.01;

/// How weights are solved for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitRule {
    /// Least and most of each weight.
    pub bounds: [f64; 2],
    /// What large weights cost, as a share of what a shape of average size moves.
    pub regularization: f64,
}

/// How two faces are laid over each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitQuality {
    /// Points of the target that have a place on the source.
    pub points: usize,
    /// Whether both meshes have the same points in the same order.
    pub is_same_topology: bool,
    /// How far apart corresponding points are on average, as a share of the size of the target's face.
    pub mean_distance_share: f64,
}

/// A face: all its meshes as one, looking along +Z.
#[derive(Clone, Debug)]
struct Face {
    positions: Vec<DVec3>,
    /// Points of each mesh.
    counts: Vec<usize>,
    /// Displacements of all points, by shape.
    shapes: Vec<Vec<DVec3>>,
    landmarks: Vec<(usize, DVec3)>,
}

impl Face {
    fn new(side: FitSide<'_>) -> Self {
        let FitSide { meshes, shapes, turn, landmarks } = side;
        let positions: Vec<DVec3> =
            meshes.iter().flat_map(|mesh| &mesh.positions).map(|position| turn * position.as_dvec3()).collect();
        let begins = meshes.iter().scan(0, |next, mesh| {
            let begin = *next;
            *next += mesh.positions.len();
            Some(begin)
        });
        let begins: Vec<usize> = begins.collect();
        let shape = |morphs: &Vec<usize>| {
            let mut displacements = vec![DVec3::ZERO; positions.len()];
            for (mesh, begin) in meshes.iter().zip(&begins) {
                let own = morphs.iter().filter_map(|morph| mesh.displacements.get(morph.checked_sub(mesh.first)?));
                for values in own {
                    for (sum, value) in displacements[*begin..].iter_mut().zip(values) {
                        *sum += turn * value.as_dvec3();
                    }
                }
            }
            displacements
        };
        let counts = meshes.iter().map(|mesh| mesh.positions.len()).collect();
        let shapes = shapes.iter().map(shape).collect();
        let landmarks = landmarks.iter().map(|(number, place)| (*number, turn * *place)).collect();
        Self { positions, counts, shapes, landmarks }
    }

    /// Points that some shape moves.
    fn moving(&self) -> Vec<usize> {
        let mut moves = vec![false; self.positions.len()];
        for shape in &self.shapes {
            let largest = shape.iter().map(|value| value.length()).fold(0.0, f64::max);
            for (moves, value) in moves.iter_mut().zip(shape) {
                *moves |= value.length() > MOVES_SHARE * largest;
            }
        }
        (0..moves.len()).filter(|point| moves[*point]).collect()
    }
}

/// One side of a fit.
#[derive(Clone, Copy, Debug)]
pub struct FitSide<'a> {
    /// Its meshes.
    pub meshes: &'a [MorphMesh],
    /// For each shape the morphs, by their index in the scene, that move together as one.
    pub shapes: &'a [Vec<usize>],
    /// Places that both faces have, such as the eyes: each by its number, in the scene. Two of them say where the faces lie and how large
    /// they are; else the points that move do.
    pub landmarks: &'a [(usize, DVec3)],
    /// Turns the scene to where +Y is up and +Z the way that the figure faces.
    pub turn: DQuat,
}

/// Two faces whose shapes stand for each other.
#[derive(Clone, Debug)]
pub struct MorphFit {
    /// `AᵀA`, row by row.
    own: Vec<f64>,
    /// `AᵀA + ρ`.
    matrix: Vec<f64>,
    /// `AᵀB`, row by row: a row for each of the target's shapes.
    shared: Vec<f64>,
    /// `BᵀB`, row by row.
    theirs: Vec<f64>,
    sources: usize,
    bounds: [f64; 2],
    /// How the faces are laid over each other.
    pub quality: FitQuality,
}

impl MorphFit {
    /// Lays the faces over each other; nothing where one of them has no point that moves, or they have none in common.
    #[must_use]
    pub fn new(source: FitSide<'_>, target: FitSide<'_>, rule: FitRule) -> Option<Self> {
        let [source, target] = [source, target].map(Face::new);
        let found = correspondence(&source, &target)?;
        let columns: Vec<Vec<DVec3>> =
            target.shapes.iter().map(|shape| found.pairs.iter().map(|(point, _)| shape[*point]).collect()).collect();
        let wanted: Vec<Vec<DVec3>> = source.shapes.iter().map(|shape| found.carried(shape)).collect();
        let own = products(&columns, &columns);
        let count = columns.len();
        let trace: f64 = (0..count).map(|index| own[index * count + index]).sum();
        let mut matrix = own.clone();
        for index in 0..count {
            // A shape that moves nothing here is not asked for.
            if own[index * count + index] > 0.0 {
                matrix[index * count + index] += rule.regularization * trace / count as f64;
            }
        }
        Some(Self {
            matrix,
            shared: products(&columns, &wanted),
            theirs: products(&wanted, &wanted),
            own,
            sources: wanted.len(),
            bounds: rule.bounds,
            quality: FitQuality {
                points: found.pairs.len(),
                is_same_topology: found.is_same_topology,
                mean_distance_share: found.mean_distance_share,
            },
        })
    }

    /// The weights of the target's shapes, for those of the source's.
    #[must_use]
    pub fn weights(&self, source: &[f64]) -> Vec<f64> {
        least_within(&self.matrix, &times(&self.shared, source), self.bounds)
    }

    /// What the target misses with these weights, and what there was to meet: sums of squares over the points.
    #[must_use]
    pub fn missed(&self, weights: &[f64], source: &[f64]) -> (f64, f64) {
        let all = dot(source, &times(&self.theirs, source));
        let met = dot(weights, &times(&self.own, weights)) - 2.0 * dot(weights, &times(&self.shared, source));
        ((met + all).max(0.0), all)
    }

    /// How many shapes the source has.
    #[must_use]
    pub const fn source_count(&self) -> usize {
        self.sources
    }
}

impl Correspondence {
    /// Displacements of the source at the target's points, in the target's size.
    fn carried(&self, shape: &[DVec3]) -> Vec<DVec3> {
        let at = |shares: &[(usize, f64)]| shares.iter().map(|(point, share)| shape[*point] * *share).sum::<DVec3>();
        self.pairs.iter().map(|(_, shares)| at(shares) * self.scale).collect()
    }
}

/// All products of columns with columns, row by row.
fn products(rows: &[Vec<DVec3>], columns: &[Vec<DVec3>]) -> Vec<f64> {
    let product = |row: &[DVec3], column: &[DVec3]| row.iter().zip(column).map(|(one, other)| one.dot(*other)).sum();
    rows.iter().flat_map(|row| columns.iter().map(move |column| product(row, column))).collect()
}

/// A matrix, row by row, times a vector.
fn times(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    matrix.chunks_exact(vector.len().max(1)).map(|row| dot(row, vector)).collect()
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

#[cfg(test)]
mod tests;
