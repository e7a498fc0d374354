//! Numbers with a shape, whatever they mean.

use crate::formats::FormatError;

use super::invalid;

/// Numbers in row-major order. The product of the shape is the number of values.
#[derive(Debug)]
pub(in crate::formats) struct NumberArray {
    pub(in crate::formats) shape: Vec<usize>,
    pub(in crate::formats) values: Values,
}

/// Values as precise as the file had them, up to double precision.
#[derive(Debug)]
pub(in crate::formats) enum Values {
    Single(Vec<f32>),
    Double(Vec<f64>),
}

impl NumberArray {
    /// The value at a flat, row-major index.
    pub(in crate::formats) fn value(&self, flat: usize) -> f64 {
        match &self.values {
            Values::Single(values) => f64::from(values[flat]),
            Values::Double(values) => values[flat],
        }
    }

    /// The row of `N` values that starts at `row · N`.
    pub(in crate::formats) fn row<const N: usize>(&self, row: usize) -> [f64; N] {
        std::array::from_fn(|column| self.value(row * N + column))
    }

    /// Refuses the first value that is not a finite number.
    pub(in crate::formats) fn require_finite(&self, key: &str) -> Result<(), FormatError> {
        let offending = match &self.values {
            Values::Single(values) => values.iter().position(|value| !value.is_finite()),
            // A double that overflows single precision is as useless to a track as an infinity.
            Values::Double(values) => values.iter().position(|value| !(*value as f32).is_finite()),
        };
        offending.map_or(Ok(()), |flat| {
            let place = format!("{key}{}", self.index_text(flat));
            Err(invalid(place, format!("the value {} is not a finite number", self.value(flat))))
        })
    }

    /// A flat index as the file's user would write it, such as `[12, 3, 0]`.
    pub(in crate::formats) fn index_text(&self, flat: usize) -> String {
        let mut indices = Vec::with_capacity(self.shape.len());
        let mut rest = flat;
        for length in self.shape.iter().rev() {
            let length = (*length).max(1);
            indices.push((rest % length).to_string());
            rest /= length;
        }
        indices.reverse();
        format!("[{}]", indices.join(", "))
    }
}
