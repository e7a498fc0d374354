//! Savitzky and Golay's filter: about each frame, the polynomial over time that meets the frames near it best, and its value there.
//!
//! What is fitted are the turns that lead from the frame itself to those near it, as vectors along their axes; with few degrees between
//! frames they are as good as numbers. Uneven key times are fitted as they are. Toward the ends only as many frames are looked at as there
//! are to both sides: polynomials through frames to one side swing far out.

use std::ops::Range;

use glam::{DQuat, DVec3};

/// Highest degree of a polynomial; the spec allows no higher.
const MAX_DEGREE: usize = 5;
const MAX_TERMS: usize = MAX_DEGREE + 1;
/// Beyond so much turning from the frame, in radians, a turn and the rest of the circle look the same.
const MAX_TURN: f64 = 4.5;

/// Rotations are unit, and each on the hemisphere of the one before. `reach` frames to each side are looked at.
pub(in crate::retarget) fn local_polynomial(
    rotations: &[DQuat],
    times: &[f64],
    reach: usize,
    degree: usize,
) -> Vec<DQuat> {
    let smooth = |frame| {
        let near = window(rotations, frame, reach);
        let value = at_center(&times[near.clone()], times[frame], degree.min(MAX_DEGREE), |other| {
            turn_between(rotations[frame], rotations[near.start + other])
        });
        (rotations[frame] * DQuat::from_scaled_axis(value)).normalize()
    };
    (0..rotations.len()).map(smooth).collect()
}

/// The frames to look at, of which none is turned too far.
fn window(rotations: &[DQuat], frame: usize, reach: usize) -> Range<usize> {
    let reach = reach.min(frame).min(rotations.len() - 1 - frame);
    let wanted = frame - reach..frame + reach + 1;
    let is_near = |other: &usize| {
        let path = if *other < frame { &rotations[*other..=frame] } else { &rotations[frame..=*other] };
        path.windows(2).map(|pair| pair[0].angle_between(pair[1])).sum::<f64>() < MAX_TURN
    };
    let before = (wanted.start..frame).rev().take_while(is_near).last().unwrap_or(frame);
    let after = (frame + 1..wanted.end).take_while(is_near).last().unwrap_or(frame);
    before..after + 1
}

/// The turn from one rotation to another, about the axes of the first: of two that give the same, the one that their signs mean.
fn turn_between(from: DQuat, to: DQuat) -> DVec3 {
    let turn = from.conjugate() * to;
    let axis = DVec3::new(turn.x, turn.y, turn.z);
    let sine = axis.length();
    if sine > 0.0 { axis * (2.0 * sine.atan2(turn.w) / sine) } else { DVec3::ZERO }
}

/// The value at `center` of the polynomial that meets the values at these times best.
fn at_center(times: &[f64], center: f64, degree: usize, value: impl Fn(usize) -> DVec3) -> DVec3 {
    let terms = (degree + 1).min(times.len());
    let farthest = times.iter().map(|time| (time - center).abs()).fold(0.0, f64::max);
    let powers = |time: f64| {
        let mut powers = [1.0; MAX_TERMS];
        for term in 1..MAX_TERMS {
            powers[term] = powers[term - 1] * (time - center) / farthest;
        }
        powers
    };
    if terms < 2 {
        return DVec3::ZERO;
    }
    // Least squares: (XᵀX) u = e₀ gives the weights X u with which the values make the constant term.
    let mut matrix = [[0.0; MAX_TERMS]; MAX_TERMS];
    for time in times {
        let powers = powers(*time);
        for row in 0..terms {
            for column in 0..terms {
                matrix[row][column] += powers[row] * powers[column];
            }
        }
    }
    let Some(solved) = first_unit_solved(matrix, terms) else { return DVec3::ZERO };
    let weight =
        |time: f64| powers(time).iter().zip(&solved).take(terms).map(|(power, share)| power * share).sum::<f64>();
    times.iter().enumerate().map(|(index, time)| value(index) * weight(*time)).sum()
}

/// `u` of `matrix · u = (1, 0, …)`, for a symmetric positive definite matrix; nothing where times are so near each other that it is none.
fn first_unit_solved(mut matrix: [[f64; MAX_TERMS]; MAX_TERMS], terms: usize) -> Option<[f64; MAX_TERMS]> {
    let mut right = [0.0; MAX_TERMS];
    right[0] = 1.0;
    for pivot in 0..terms {
        if matrix[pivot][pivot] < 1e-12 {
            return None;
        }
        for row in pivot + 1..terms {
            let factor = matrix[row][pivot] / matrix[pivot][pivot];
            let (above, below) = matrix.split_at_mut(row);
            for (entry, above) in below[0].iter_mut().zip(&above[pivot]).take(terms).skip(pivot) {
                *entry -= factor * above;
            }
            right[row] -= factor * right[pivot];
        }
    }
    for row in (0..terms).rev() {
        for column in row + 1..terms {
            right[row] -= matrix[row][column] * right[column];
        }
        right[row] /= matrix[row][row];
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_of_the_degree_passes_unchanged() {
        // Key times that are uneven, and a turn that is a cubic of time, at the ends as well.
        let times: Vec<f64> = (0..40).map(|frame| f64::from(frame) * 0.03 + f64::from(frame % 3) * 0.007).collect();
        let axis = DVec3::new(0.48, 0.6, 0.64);
        let turn = |time: &f64| DQuat::from_axis_angle(axis, 1.0 - 2.0 * time + 3.0 * time * time - time.powi(3));
        let rotations: Vec<DQuat> = times.iter().map(turn).collect();
        let worst = |degree: usize| {
            let filtered = local_polynomial(&rotations, &times, 4, degree);
            filtered.iter().zip(&rotations).map(|(ours, own)| (*ours - *own).length()).fold(0.0, f64::max)
        };
        assert!(worst(3) < 1e-9, "a cubic: {}", worst(3));
        assert!(worst(5) < 1e-9, "what can more can do less: {}", worst(5));
        assert!(worst(1) > 1e-3, "straight lines cannot: {}", worst(1));
    }

    #[test]
    fn weights_are_those_of_the_published_table() {
        // Savitzky and Golay 1964, quadratic of seven points: (−2, 3, 6, 7, 6, 3, −2) / 21.
        let times: Vec<f64> = (0..7).map(f64::from).collect();
        for (at, wanted) in [-2.0, 3.0, 6.0, 7.0, 6.0, 3.0, -2.0].into_iter().enumerate() {
            let one = |other: usize| if other == at { DVec3::X } else { DVec3::ZERO };
            let weight = at_center(&times, 3.0, 2, one).x;
            assert!((weight - wanted / 21.0).abs() < 1e-12, "point {at}: {weight}");
        }
    }
}
