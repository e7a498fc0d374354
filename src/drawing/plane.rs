//! Onto which plane a group of joints is projected, and which angle a bone has there.

use glam::{DMat3, DVec2, DVec3};

use super::{
    config::{ProjectionGroup, ProjectionMethod},
    driver::Driver,
    error::DrawingError,
};

/// A plane that a body which faces +X is seen in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// From ahead: its normal is X.
    Frontal,
    /// From the side: its normal is Z.
    Sagittal,
}

impl Plane {
    /// The plane of a group.
    pub(super) fn of(group: &ProjectionGroup, place: &str, driver: &Driver) -> Result<Self, DrawingError> {
        Ok(match group.method {
            ProjectionMethod::Frontal => Self::Frontal,
            ProjectionMethod::Sagittal => Self::Sagittal,
            ProjectionMethod::Pca => {
                let joint =
                    |(index, name): (usize, &String)| driver.joint(format!("{place}/bvh_joint_names/{index}"), name);
                let joints = group.bvh_joint_names.iter().enumerate().map(joint).collect::<Result<Vec<_>, _>>()?;
                let places = driver.frames.iter().flat_map(|frame| joints.iter().map(|joint| frame.joints[*joint]));
                let least = least_direction(&places.collect::<Vec<_>>());
                if least.x.abs() > least.z.abs() { Self::Frontal } else { Self::Sagittal }
            }
        })
    }

    /// A direction as it is seen: right and up.
    pub(super) fn seen(self, direction: DVec3) -> DVec2 {
        match self {
            Self::Frontal => DVec2::new(-direction.z, direction.y),
            Self::Sagittal => DVec2::new(direction.x, direction.y),
        }
    }

    /// How near a place is; larger is nearer.
    pub(super) fn depth(self, place: DVec3) -> f64 {
        match self {
            Self::Frontal => place.x,
            Self::Sagittal => place.z,
        }
    }
}

/// The angle of a direction on a picture, in degrees counterclockwise from up, 0 to 360.
pub(super) fn angle_degrees(seen: DVec2) -> f64 {
    (seen.y.atan2(seen.x).to_degrees() - 90.0).rem_euclid(360.0)
}

/// The direction in which places differ least: the eigenvector of the smallest eigenvalue of their covariance, by Jacobi's method.
fn least_direction(places: &[DVec3]) -> DVec3 {
    let mean = places.iter().sum::<DVec3>() / places.len().max(1) as f64;
    let mut matrix = DMat3::ZERO;
    for place in places {
        let off = *place - mean;
        matrix += DMat3::from_cols(off * off.x, off * off.y, off * off.z);
    }
    let mut vectors = DMat3::IDENTITY;
    for _ in 0..32 {
        for (row, column) in [(0, 1), (0, 2), (1, 2)] {
            let off = matrix.col(column)[row];
            if off == 0.0 {
                continue;
            }
            let angle = 0.5 * (2.0 * off).atan2(matrix.col(column)[column] - matrix.col(row)[row]);
            let (sin, cos) = angle.sin_cos();
            let mut turn = [[0.0; 3]; 3];
            (0..3).for_each(|axis| turn[axis][axis] = 1.0);
            (turn[row][row], turn[column][column]) = (cos, cos);
            (turn[column][row], turn[row][column]) = (sin, -sin);
            let turn = DMat3::from_cols_array_2d(&turn);
            matrix = turn.transpose() * matrix * turn;
            vectors *= turn;
        }
    }
    let least = (0..3).min_by(|one, other| matrix.col(*one)[*one].total_cmp(&matrix.col(*other)[*other]));
    vectors.col(least.unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_counterclockwise_from_up() {
        let angle = |x: f64, y: f64| angle_degrees(DVec2::new(x, y));
        assert_eq!([angle(0.0, 1.0), angle(-1.0, 0.0), angle(0.0, -1.0), angle(1.0, 0.0)], [0.0, 90.0, 180.0, 270.0]);
    }

    #[test]
    fn the_direction_of_least_difference_is_found_whatever_way_it_lies() {
        let normal = DVec3::new(0.3, -0.5, 0.8).normalize();
        let (one, other) = normal.any_orthonormal_pair();
        let places: Vec<DVec3> = (0..200)
            .map(|index| {
                f64::from(index % 17) * one + f64::from(index % 11) * 0.6 * other + normal * 0.05 * f64::from(index % 3)
            })
            .collect();
        assert!(least_direction(&places).dot(normal).abs() > 0.999, "{}", least_direction(&places));
    }
}
