//! The rotation that brings several directions onto others with the least squared error: Wahba's problem, solved by Davenport's
//! q-method (Wahba 1965; Davenport 1968; Horn 1987).

use std::array::from_fn;

use glam::{DMat3, DQuat, DVec3, DVec4};

/// Sweeps of the Jacobi iteration; four dimensions need about five.
const SWEEPS: usize = 16;

/// A direction and where it is to point, as unit vectors, with its weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction {
    pub(super) own: DVec3,
    pub(super) wanted: DVec3,
    pub(super) weight: f64,
}

/// The rotation for which the sum of `weight · |rotation · own − wanted|²` is least. What the directions leave open is as in `prior`,
/// which counts as three directions of the weight `prior_weight`.
pub(super) fn best_rotation(directions: &[Direction], prior: DQuat, prior_weight: f64) -> DQuat {
    let outer = |wanted: DVec3, own: DVec3| DMat3::from_cols(wanted * own.x, wanted * own.y, wanted * own.z);
    let mut attitude = DMat3::from_quat(prior) * prior_weight;
    for direction in directions {
        attitude += outer(direction.wanted, direction.own) * direction.weight;
    }
    let [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]] = attitude.to_cols_array_2d();
    let matrix = [
        [xx - yy - zz, xy + yx, xz + zx, zy - yz],
        [xy + yx, yy - xx - zz, yz + zy, xz - zx],
        [xz + zx, yz + zy, zz - xx - yy, yx - xy],
        [zy - yz, xz - zx, yx - xy, xx + yy + zz],
    ];
    let found = DQuat::from_vec4(largest_eigenvector(matrix));
    if found.is_finite() && found.length() > 0.5 { found.normalize() } else { prior }
}

/// The eigenvector of the largest eigenvalue of a symmetric matrix, by Jacobi rotations.
fn largest_eigenvector(mut matrix: [[f64; 4]; 4]) -> DVec4 {
    let mut vectors = [[0.0; 4]; 4];
    (0..4).for_each(|index| vectors[index][index] = 1.0);
    for _ in 0..SWEEPS {
        for (row, column) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            if matrix[row][column].abs() > 1e-300 {
                rotate(&mut matrix, &mut vectors, row, column);
            }
        }
    }
    let best = (0..4).max_by(|one, other| matrix[*one][*one].total_cmp(&matrix[*other][*other])).unwrap_or(3);
    DVec4::new(vectors[0][best], vectors[1][best], vectors[2][best], vectors[3][best])
}

/// One Jacobi rotation, which makes an element off the diagonal zero.
fn rotate(matrix: &mut [[f64; 4]; 4], vectors: &mut [[f64; 4]; 4], row: usize, column: usize) {
    let theta = (matrix[column][column] - matrix[row][row]) / (2.0 * matrix[row][column]);
    let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let cosine = tangent.hypot(1.0).recip();
    let sine = tangent * cosine;
    for line in matrix.iter_mut().chain(vectors.iter_mut()) {
        let (one, other) = (line[row], line[column]);
        line[row] = cosine * one - sine * other;
        line[column] = sine * one + cosine * other;
    }
    let (one, other) = (matrix[row], matrix[column]);
    matrix[row] = from_fn(|index| cosine * one[index] - sine * other[index]);
    matrix[column] = from_fn(|index| sine * one[index] + cosine * other[index]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_brought_where_they_are_wanted() {
        for (axis, angle) in [(DVec3::new(1.0, 2.0, -0.5), 0.4), (DVec3::Z, 3.1), (DVec3::new(-1.0, 0.1, 0.3), -2.0)] {
            let turn = DQuat::from_axis_angle(axis.normalize(), angle);
            let directions = [DVec3::X, DVec3::new(0.6, 0.8, 0.0), DVec3::NEG_Z].map(|own| Direction {
                own,
                wanted: turn * own,
                weight: 0.3,
            });
            let found = best_rotation(&directions, DQuat::IDENTITY, 1e-12);
            assert!(found.angle_between(turn) < 1e-6, "{angle}: {}", found.angle_between(turn));
        }
    }

    #[test]
    fn what_is_open_is_as_before() {
        let prior = DQuat::from_rotation_y(0.7);
        let along = [Direction { own: DVec3::Y, wanted: DVec3::Y, weight: 1.0 }];
        assert!(best_rotation(&along, prior, 1e-6).angle_between(prior) < 1e-6, "the turn about the direction stays");
        assert!(best_rotation(&[], prior, 1.0).angle_between(prior) < 1e-9, "nothing is wanted");
    }
}
