//! Sparse Hermitian matrices and their factors L D Lᴴ, row by row (T. Davis, "Algorithm 849: A Concise Sparse Cholesky
//! Factorization Package", ACM Transactions on Mathematical Software 31, 2005).

use std::collections::BTreeMap;

use super::complex::{Complex, Entry};

/// A Hermitian matrix: for each column its entries in and above the diagonal, by row.
#[derive(Clone, Debug)]
pub(super) struct Hermitian<E> {
    columns: Vec<BTreeMap<usize, E>>,
}

impl<E: Entry> Hermitian<E> {
    /// Aᴴ A of the rows of A, numbered by `places`. Where sums are rounded to single precision, each block of rows is summed by
    /// itself first, as libraries of linear algebra do: with weights as far apart as those of pins and edges the result depends on it.
    pub(super) fn of_rows(blocks: &[&[Vec<(usize, E)>]], places: &[usize], is_single: bool) -> Self {
        let round = |value: E| if is_single { value.single() } else { value };
        let mut columns = vec![BTreeMap::new(); places.len()];
        for block in blocks {
            let mut sums = vec![BTreeMap::new(); places.len()];
            for row in *block {
                for &(one, left) in row {
                    for &(other, right) in row {
                        let (at, to) = (places[one], places[other]);
                        if at <= to {
                            let sum: &mut E = sums[to].entry(at).or_default();
                            *sum += left.conjugate() * right;
                            *sum = round(*sum);
                        }
                    }
                }
            }
            for (column, sums) in columns.iter_mut().zip(sums) {
                for (row, sum) in sums {
                    let entry: &mut E = column.entry(row).or_default();
                    *entry += sum;
                    *entry = round(*entry);
                }
            }
        }
        Self { columns }
    }
}

/// The factors of a matrix.
#[derive(Clone, Debug)]
pub(super) struct Factors<E> {
    starts: Vec<usize>,
    /// For each column its rows below the diagonal.
    entries: Vec<(u32, E)>,
    /// One over the diagonal; 0 for an unknown that nothing determines.
    inverse: Vec<f64>,
}

const NONE: usize = usize::MAX;
/// Below this share of the largest entry, a pivot determines nothing.
const EMPTY: f64 = 1e-18;

impl<E: Entry> Factors<E> {
    pub(super) fn new(matrix: &Hermitian<E>) -> Self {
        let count = matrix.columns.len();
        let (parents, counts) = elimination_tree(matrix);
        let mut starts = vec![0; count + 1];
        for column in 0..count {
            starts[column + 1] = starts[column] + counts[column];
        }
        let mut factors = Self { entries: vec![(0, E::default()); starts[count]], starts, inverse: vec![] };
        let mut filled = vec![0; count];
        let mut work = vec![E::default(); count];
        let mut seen = vec![NONE; count];
        let mut pattern = vec![0; count];
        for column in 0..count {
            let mut top = count;
            seen[column] = column;
            for (&row, &value) in &matrix.columns[column] {
                work[row] = value;
                let mut length = 0;
                let mut at = row;
                while seen[at] != column {
                    pattern[length] = at;
                    length += 1;
                    seen[at] = column;
                    at = parents[at];
                }
                top -= length;
                pattern.copy_within(0..length, top);
            }
            let mut diagonal = std::mem::take(&mut work[column]).real();
            let largest = diagonal;
            for &at in &pattern[top..] {
                let value = std::mem::take(&mut work[at]);
                let start = factors.starts[at];
                for &(row, lower) in &factors.entries[start..start + filled[at]] {
                    work[row as usize] -= lower * value;
                }
                diagonal -= value.square() * factors.inverse[at];
                factors.entries[start + filled[at]] = (column as u32, value.conjugate().scaled(factors.inverse[at]));
                filled[at] += 1;
            }
            factors.inverse.push(if diagonal.abs() > EMPTY * largest.abs() { 1.0 / diagonal } else { 0.0 });
        }
        factors
    }

    /// Solves in place.
    pub(super) fn solve(&self, unknowns: &mut [Complex]) {
        for column in 0..unknowns.len() {
            let value = unknowns[column];
            for &(row, lower) in &self.entries[self.starts[column]..self.starts[column + 1]] {
                unknowns[row as usize] -= lower.times(value);
            }
        }
        for column in (0..unknowns.len()).rev() {
            // Two sums, since each step of one waits for the step before.
            let mut sums = [Complex::default(); 2];
            let pairs = self.entries[self.starts[column]..self.starts[column + 1]].chunks(2);
            for pair in pairs {
                for (sum, &(row, lower)) in sums.iter_mut().zip(pair) {
                    *sum += lower.conjugate().times(unknowns[row as usize]);
                }
            }
            unknowns[column] = unknowns[column].scaled(self.inverse[column]) - (sums[0] + sums[1]);
        }
    }
}

/// For each column its parent, and how many entries its factor has below the diagonal.
fn elimination_tree<E>(matrix: &Hermitian<E>) -> (Vec<usize>, Vec<usize>) {
    let count = matrix.columns.len();
    let (mut parents, mut counts, mut seen) = (vec![NONE; count], vec![0; count], vec![NONE; count]);
    for column in 0..count {
        seen[column] = column;
        for &row in matrix.columns[column].keys() {
            let mut at = row;
            while seen[at] != column {
                if parents[at] == NONE {
                    parents[at] = column;
                }
                counts[at] += 1;
                seen[at] = column;
                at = parents[at];
            }
        }
    }
    (parents, counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_complex_system_is_solved() {
        let rows: Vec<Vec<(usize, Complex)>> = (0..12)
            .map(|row| {
                let entry =
                    |column: usize| Complex::new((row * column + 1) as f64 % 5.0 - 2.0, (row + column) as f64 % 3.0);
                [row % 6, (row + 1) % 6, (row * 2 + 3) % 6].map(|column| (column, entry(column))).to_vec()
            })
            .collect();
        let rows: Vec<Vec<(usize, Complex)>> = rows
            .into_iter()
            .enumerate()
            .map(|(row, mut entries)| {
                entries.push((row % 6, Complex::new(3.0, 0.0)));
                entries
            })
            .collect();
        let wanted: Vec<Complex> = (0..6).map(|index| Complex::new(index as f64, 2.0 - index as f64)).collect();
        let mut right = [Complex::default(); 6];
        for row in &rows {
            let mut product = Complex::default();
            row.iter().for_each(|&(column, entry)| product += entry * wanted[column]);
            row.iter().for_each(|&(column, entry)| right[column] += entry.conjugate() * product);
        }
        let places = [3, 1, 5, 0, 2, 4];
        let factors = Factors::new(&Hermitian::of_rows(&[&rows], &places, false));
        let mut unknowns = vec![Complex::default(); 6];
        (0..6).for_each(|index| unknowns[places[index]] = right[index]);
        factors.solve(&mut unknowns);
        for (index, wanted) in wanted.iter().enumerate() {
            assert!((unknowns[places[index]] - *wanted).square() < 1e-18, "{index}");
        }
    }
}
