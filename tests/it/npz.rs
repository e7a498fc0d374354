//! NumPy archives, read by other code than the project's.

use std::{
    collections::BTreeMap,
    io::{Cursor, Read},
};

/// The members of an archive.
pub(crate) struct Arrays(BTreeMap<String, Vec<u8>>);

pub(crate) fn read(bytes: &[u8]) -> Arrays {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).expect("an archive");
    let mut members = BTreeMap::new();
    for index in 0..archive.len() {
        let mut member = archive.by_index(index).expect("an entry");
        let name = member.name().expect("a name").trim_end_matches(".npy").to_owned();
        let mut content = Vec::new();
        member.read_to_end(&mut content).expect("an entry");
        members.insert(name, content);
    }
    Arrays(members)
}

impl Arrays {
    pub(crate) fn array(&self, key: &str) -> Array {
        Array::read(self.0.get(key).unwrap_or_else(|| panic!("there is {key}")))
    }

    /// The values of a member of whole numbers, 32 bits each.
    pub(crate) fn whole(&self, key: &str) -> Vec<i32> {
        let bytes = self.0.get(key).unwrap_or_else(|| panic!("there is {key}"));
        let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let number = |chunk: &[u8]| i32::from_le_bytes(chunk.try_into().expect("four"));
        bytes[10 + header..].chunks_exact(4).map(number).collect()
    }

    /// The shape and the values of a member of numbers.
    pub(crate) fn numbers(&self, key: &str) -> (Vec<usize>, Vec<f64>) {
        let Array { shape, values } = self.array(key);
        (shape, values)
    }
}

/// A C-ordered array of little-endian numbers out of a NumPy archive: as much as these files need.
#[derive(Clone, Debug)]
pub(crate) struct Array {
    pub(crate) shape: Vec<usize>,
    pub(crate) values: Vec<f64>,
}

impl Array {
    fn read(bytes: &[u8]) -> Self {
        let header_length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let header = std::str::from_utf8(&bytes[10..10 + header_length]).expect("a header");
        assert!(header.contains("'fortran_order': False"), "C order: {header}");
        let shape_text = header.split_once("'shape': (").and_then(|(_, rest)| rest.split_once(')')).expect("a shape").0;
        let data = &bytes[10 + header_length..];
        let values = if header.contains("'<f8'") {
            data.chunks_exact(8).map(|chunk| f64::from_le_bytes(chunk.try_into().expect("eight"))).collect()
        } else if header.contains("'<i4'") {
            data.chunks_exact(4).map(|chunk| f64::from(i32::from_le_bytes(chunk.try_into().expect("four")))).collect()
        } else if header.contains("'|b1'") {
            data.iter().map(|&byte| f64::from(byte)).collect()
        } else {
            assert!(header.contains("'<f4'"), "numbers: {header}");
            let single = |chunk: &[u8]| f64::from(f32::from_le_bytes(chunk.try_into().expect("four")));
            data.chunks_exact(4).map(single).collect()
        };
        let shape = shape_text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
        Self { shape, values }
    }

    pub(crate) fn row(&self, indices: &[usize]) -> &[f64] {
        let position = indices.iter().zip(&self.shape).fold(0, |position, (index, size)| position * size + index);
        let length = *self.shape.last().expect("a dimension");
        &self.values[position * length..(position + 1) * length]
    }
}
