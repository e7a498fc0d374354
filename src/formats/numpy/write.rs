//! Named arrays as a NumPy archive.

use std::io::{Cursor, Write};

use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use crate::formats::{FormatError, zipped::zip_error};

use super::{invalid, npy};

/// Numbers or names with a shape.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedArray {
    /// The key.
    pub name: String,
    /// Its product is the number of values.
    pub shape: Vec<usize>,
    /// In row-major order.
    pub values: ArrayValues,
}

/// Values of an array.
#[derive(Clone, Debug, PartialEq)]
pub enum ArrayValues {
    /// Single precision.
    Single(Vec<f32>),
    /// Whole numbers.
    Whole(Vec<i32>),
    /// True or false.
    Flags(Vec<bool>),
    /// Names.
    Names(Vec<String>),
}

/// Encodes arrays in their order; the same bytes for the same arrays.
///
/// # Errors
/// When the archive grows beyond what a zip archive holds.
pub fn write_arrays(arrays: &[NamedArray]) -> Result<Vec<u8>, FormatError> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for array in arrays {
        let mut member = Vec::new();
        match &array.values {
            ArrayValues::Single(values) => {
                npy::write_header(&mut member, "<f4", &array.shape);
                member.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            }
            ArrayValues::Whole(values) => {
                npy::write_header(&mut member, "<i4", &array.shape);
                member.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            }
            ArrayValues::Flags(values) => {
                npy::write_header(&mut member, "|b1", &array.shape);
                member.extend(values.iter().map(|value| u8::from(*value)));
            }
            ArrayValues::Names(names) => {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                member = npy::unicode_array(&names, &array.shape);
            }
        }
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .last_modified_time(zip::DateTime::default());
        zip.start_file(format!("{}.npy", array.name), options).map_err(|error| zip_error(&error, &array.name))?;
        zip.write_all(&member).map_err(|error| invalid(array.name.clone(), error.to_string()))?;
    }
    let written = zip.finish().map_err(|error| zip_error(&error, "archive"))?;
    Ok(written.into_inner())
}
