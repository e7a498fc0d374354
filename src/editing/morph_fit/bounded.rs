//! Least squares within bounds.

/// Changes of a weight by less are none.
const SETTLED: f64 = 1e-7;
const MAX_SWEEPS: usize = 500;

/// The `x` within the bounds for which `½ xᵀ·matrix·x − right·x` is least.
///
/// By coordinate descent from the bound nearest to zero, which finds the one minimum of a positive definite matrix; entries whose
/// diagonal is not positive stay there. `matrix` is symmetric, row by row.
pub(super) fn least_within(matrix: &[f64], right: &[f64], bounds: [f64; 2]) -> Vec<f64> {
    let count = right.len();
    let mut x = vec![0.0_f64.clamp(bounds[0], bounds[1]); count];
    for _ in 0..MAX_SWEEPS {
        let mut largest_change: f64 = 0.0;
        for index in 0..count {
            let row = &matrix[index * count..(index + 1) * count];
            if row[index] <= 0.0 {
                continue;
            }
            let slope: f64 = row.iter().zip(&x).map(|(entry, x)| entry * x).sum::<f64>() - right[index];
            let better = (x[index] - slope / row[index]).clamp(bounds[0], bounds[1]);
            largest_change = largest_change.max((better - x[index]).abs());
            x[index] = better;
        }
        if largest_change < SETTLED {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_minimum_is_found_inside_and_at_the_bounds() {
        let matrix = [2.0, 1.0, 1.0, 3.0];
        let near = |found: Vec<f64>, wanted: [f64; 2]| {
            assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?} for {wanted:?}");
        };
        // 2 x + y = 1.3, x + 3 y = 1.4.
        near(least_within(&matrix, &[1.3, 1.4], [0.0, 1.0]), [0.5, 0.3]);
        // Without bounds y would be −0.2; with y = 0 the best x is 0.8 / 2.
        near(least_within(&matrix, &[0.8, -0.1], [0.0, 1.0]), [0.4, 0.0]);
        near(least_within(&matrix, &[9.0, 1.0], [0.0, 1.0]), [1.0, 0.0]);
    }
}
