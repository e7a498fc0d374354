//! Arrays under names in an archive of NumPy's (`.npz`), whatever they mean.

use std::io::{Cursor, Write};

use zip::{CompressionMethod, ZipWriter, result::ZipError, write::SimpleFileOptions};

use crate::model::Control;

use super::{
    Budget, FormatError, Limits,
    numpy::{Archive, npy},
    zipped::zip_error,
};

/// What an array holds, row by row.
#[derive(Clone, Debug, PartialEq)]
pub enum Elements {
    /// Written as 32-bit floating point.
    Reals(Vec<f64>),
    /// Written as 32-bit integers.
    Integers(Vec<i32>),
    /// Written as text.
    Names(Vec<String>),
}

/// An array with its name and shape.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedArray {
    /// Its name, without an ending.
    pub name: String,
    /// The product is the number of elements.
    pub shape: Vec<usize>,
    /// What it holds.
    pub elements: Elements,
}

/// Writes an archive that is the same for the same arrays.
///
/// # Errors
///
/// Where the archive cannot be made.
pub fn write_arrays(arrays: &[NamedArray]) -> Result<Vec<u8>, FormatError> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for array in arrays {
        let mut member = Vec::new();
        match &array.elements {
            Elements::Reals(values) => {
                npy::write_header(&mut member, "<f4", &array.shape);
                member.extend(values.iter().flat_map(|value| (*value as f32).to_le_bytes()));
            }
            Elements::Integers(values) => {
                npy::write_header(&mut member, "<i4", &array.shape);
                member.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            }
            Elements::Names(names) => {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                member = npy::unicode_array(&names, &array.shape);
            }
        }
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .last_modified_time(zip::DateTime::default());
        zip.start_file(format!("{}.npy", array.name), options).map_err(|error| zip_error(&error, &array.name))?;
        zip.write_all(&member).map_err(|error| zip_error(&ZipError::Io(error), &array.name))?;
    }
    Ok(zip.finish().map_err(|error| zip_error(&error, "archive"))?.into_inner())
}

/// The shape of an array and its numbers, row by row.
pub type Numbers = (Vec<usize>, Vec<f64>);

/// Reads one array of numbers; `None` where the archive does not have it.
///
/// # Errors
///
/// Where the archive or the array cannot be read, or a value is not finite.
pub fn read_numbers(
    bytes: &[u8],
    name: &str,
    limits: &Limits,
    control: &Control,
) -> Result<Option<Numbers>, FormatError> {
    let mut budget = Budget::new(limits, control);
    let mut archive = Archive::open(bytes, &mut budget)?;
    let Some(index) = archive.keys().iter().position(|key| key == name) else { return Ok(None) };
    let array = archive.numbers(index)?;
    array.require_finite(name)?;
    let count = array.shape.iter().product();
    let values = (0..count).map(|flat| array.value(flat)).collect();
    Ok(Some((array.shape, values)))
}
