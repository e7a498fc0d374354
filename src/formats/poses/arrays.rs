//! What both codecs decode into: named arrays of numbers, not yet understood.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::formats::FormatError;

/// The arrays of numbers in the layout, each with its number of dimensions and whether single precision is enough.
pub(super) const NUMBER_KEYS: [NumberKey; 8] = [
    NumberKey { name: "parents", rank: 1, single: false },
    NumberKey { name: "rest_translations", rank: 2, single: false },
    NumberKey { name: "rest_rotations", rank: 2, single: false },
    NumberKey { name: "rest_scales", rank: 2, single: false },
    NumberKey { name: "times", rank: 1, single: false },
    NumberKey { name: "translations", rank: 3, single: true },
    NumberKey { name: "rotations", rank: 3, single: true },
    NumberKey { name: "scales", rank: 3, single: true },
];

/// An array of numbers that the layout knows.
#[derive(Clone, Copy, Debug)]
pub(super) struct NumberKey {
    pub(super) name: &'static str,
    pub(super) rank: usize,
    /// Whether the model keeps these values in single precision anyway.
    pub(super) single: bool,
}

/// The arrays of one file.
#[derive(Debug, Default)]
pub(super) struct Arrays {
    pub(super) joint_names: Option<Vec<String>>,
    pub(super) numbers: BTreeMap<&'static str, NumberArray>,
    pub(super) meta: Meta,
    /// Keys of the file that were not decoded, in its order.
    pub(super) ignored: Vec<String>,
}

/// The `meta` string, parsed.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Meta {
    pub(super) name: Option<String>,
    pub(super) fps: Option<f64>,
    pub(super) axes: Option<String>,
    pub(super) unit: Option<f64>,
}

/// Numbers in row-major order. The product of the shape is the number of values.
#[derive(Debug)]
pub(super) struct NumberArray {
    pub(super) shape: Vec<usize>,
    pub(super) values: Values,
}

/// Values as precise as the file had them, up to double precision.
#[derive(Debug)]
pub(super) enum Values {
    Single(Vec<f32>),
    Double(Vec<f64>),
}

impl NumberArray {
    /// The value at a flat, row-major index.
    pub(super) fn value(&self, flat: usize) -> f64 {
        match &self.values {
            Values::Single(values) => f64::from(values[flat]),
            Values::Double(values) => values[flat],
        }
    }

    /// The row of `N` values that starts at `row · N`.
    pub(super) fn row<const N: usize>(&self, row: usize) -> [f64; N] {
        std::array::from_fn(|column| self.value(row * N + column))
    }

    /// Refuses the first value that is not a finite number.
    pub(super) fn require_finite(&self, key: &str) -> Result<(), FormatError> {
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
    pub(super) fn index_text(&self, flat: usize) -> String {
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

/// An array that breaks the rules of the layout.
pub(super) fn invalid(place: impl Into<String>, detail: impl Into<String>) -> FormatError {
    FormatError::malformed("arrays", place, detail)
        .with_hint("compare the file with the pose arrays layout in the documentation")
}
