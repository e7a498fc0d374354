//! The direction in which points vary least.

use glam::DVec3;

/// The principal component with the smallest variance, by rotations after Jacobi.
pub(super) fn least_varying(points: &[DVec3]) -> DVec3 {
    let count = points.len().max(1) as f64;
    let mean = points.iter().sum::<DVec3>() / count;
    let mut matrix = [[0.0; 3]; 3];
    for point in points {
        let away = *point - mean;
        for row in 0..3 {
            for column in 0..3 {
                matrix[row][column] += away[row] * away[column];
            }
        }
    }
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..30 {
        for (one, other) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut matrix, &mut vectors, one, other);
        }
    }
    let least = (0..3).min_by(|&one, &other| matrix[one][one].total_cmp(&matrix[other][other])).unwrap_or(2);
    DVec3::new(vectors[0][least], vectors[1][least], vectors[2][least])
}

/// Makes the entry at `one`, `other` zero.
fn rotate(matrix: &mut [[f64; 3]; 3], vectors: &mut [[f64; 3]; 3], one: usize, other: usize) {
    if matrix[one][other] == 0.0 {
        return;
    }
    let ratio = (matrix[other][other] - matrix[one][one]) / (2.0 * matrix[one][other]);
    let tangent = ratio.signum() / (ratio.abs() + ratio.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    let sine = tangent * cosine;
    for row in matrix.iter_mut().chain(vectors.iter_mut()) {
        (row[one], row[other]) = (cosine * row[one] - sine * row[other], sine * row[one] + cosine * row[other]);
    }
    let (high, low) = (matrix[one], matrix[other]);
    matrix[one] = [0, 1, 2].map(|column| cosine * high[column] - sine * low[column]);
    matrix[other] = [0, 1, 2].map(|column| sine * high[column] + cosine * low[column]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flat_direction_of_a_cloud_is_found() {
        let across = DVec3::new(1.0, 2.0, -0.5).normalize();
        let (right, up) = across.any_orthonormal_pair();
        let points: Vec<DVec3> = (0..40)
            .map(|index| {
                let angle = f64::from(index);
                right * 3.0 * angle.sin() + up * 2.0 * angle.cos() + across * 0.1 * (angle * 1.7).sin()
            })
            .collect();
        assert!(least_varying(&points).dot(across).abs() > 0.999);
    }
}
