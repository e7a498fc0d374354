//! One array in NumPy's own file format: its header, its values. Knows neither the archive around it nor what it means.

use std::io::Read;

use crate::formats::FormatError;

use super::{NumberArray, Values, invalid};

/// A header longer than this describes no array of plain numbers or strings.
const MAX_HEADER_BYTES: u32 = 16 << 10;
const MAX_DIMENSIONS: usize = 8;

/// What the header says: element type, order, shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::formats) struct Header {
    element: Element,
    big_endian: bool,
    fortran_order: bool,
    pub(in crate::formats) shape: Vec<usize>,
    /// Bytes of the header itself, magic included.
    pub(in crate::formats) header_bytes: u64,
}

/// The plain element types; the number is the size in bytes, for strings in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Element {
    Bool,
    Signed(usize),
    Unsigned(usize),
    Float(usize),
    Unicode(usize),
    Bytes(usize),
}

impl Element {
    const fn size(self) -> usize {
        match self {
            Self::Bool => 1,
            Self::Signed(bytes) | Self::Unsigned(bytes) | Self::Float(bytes) | Self::Bytes(bytes) => bytes,
            Self::Unicode(characters) => characters.saturating_mul(4),
        }
    }
}

impl Header {
    /// Number of elements, or nothing when the product overflows.
    pub(in crate::formats) fn count(&self) -> Option<usize> {
        self.shape.iter().try_fold(1_usize, |count, length| count.checked_mul(*length))
    }

    /// Bytes of the elements, or nothing when the product overflows.
    pub(in crate::formats) fn data_bytes(&self) -> Option<usize> {
        self.count()?.checked_mul(self.element.size())
    }

    /// Bytes that the decoded elements take in memory, or nothing when the product overflows.
    pub(in crate::formats) fn decoded_bytes(&self) -> Option<usize> {
        let each = match self.element {
            Element::Float(4) => size_of::<f32>(),
            Element::Unicode(characters) => size_of::<String>().checked_add(characters.checked_mul(4)?)?,
            Element::Bytes(bytes) => size_of::<String>().checked_add(bytes)?,
            _ => size_of::<f64>(),
        };
        // Columns that lie one after another are copied into rows.
        let copies = if self.fortran_order { 2 } else { 1 };
        self.count()?.checked_mul(each)?.checked_mul(copies)
    }
}

/// Reads magic, version and header.
pub(in crate::formats) fn read_header(reader: &mut impl Read, key: &str) -> Result<Header, FormatError> {
    let mut prelude = [0; 8];
    fill(reader, &mut prelude, key)?;
    if !prelude.starts_with(b"\x93NUMPY") {
        return Err(invalid(key, "the member does not start with the magic number of a NumPy array"));
    }
    let (length, length_bytes) = match prelude[6] {
        1 => {
            let mut length = [0; 2];
            fill(reader, &mut length, key)?;
            (u32::from(u16::from_le_bytes(length)), 2)
        }
        2 | 3 => {
            let mut length = [0; 4];
            fill(reader, &mut length, key)?;
            (u32::from_le_bytes(length), 4)
        }
        version => return Err(unsupported(key, format!("version {version} of the NumPy array format"))),
    };
    if length > MAX_HEADER_BYTES {
        return Err(invalid(
            key,
            format!("the array header is {length} bytes long; at most {MAX_HEADER_BYTES} make sense"),
        ));
    }
    let mut text = vec![0; length as usize];
    fill(reader, &mut text, key)?;
    let text = String::from_utf8_lossy(&text);
    let mut header = parse(&text, key)?;
    header.header_bytes = (prelude.len() + length_bytes) as u64 + u64::from(length);
    Ok(header)
}

/// Decodes numbers into row-major order. `data` is exactly [`Header::data_bytes`] long.
pub(in crate::formats) fn numbers(header: &Header, data: &[u8], key: &str) -> Result<NumberArray, FormatError> {
    let size = header.element.size();
    let big = header.big_endian;
    let (element, values) = (header.element, data.chunks_exact(size.max(1)));
    let values = match element {
        Element::Float(4) => Values::Single(in_row_major(
            header,
            values.map(|bytes| f32::from_bits(unsigned(bytes, big) as u32)).collect(),
        )),
        Element::Unicode(_) | Element::Bytes(_) => {
            return Err(invalid(key, "the array holds text where numbers are needed"));
        }
        _ => Values::Double(in_row_major(header, values.map(|bytes| number(element, unsigned(bytes, big))).collect())),
    };
    Ok(NumberArray { shape: header.shape.clone(), values })
}

/// Decodes text. `data` is exactly [`Header::data_bytes`] long.
pub(in crate::formats) fn strings(header: &Header, data: &[u8], key: &str) -> Result<Vec<String>, FormatError> {
    let size = header.element.size();
    let count = header.count().unwrap_or(0);
    let mut strings = Vec::with_capacity(count);
    for index in 0..count {
        let bytes = &data[index * size..(index + 1) * size];
        let text = match header.element {
            Element::Unicode(_) => bytes
                .chunks_exact(4)
                .map(|unit| char::from_u32(unsigned(unit, header.big_endian) as u32))
                .collect::<Option<String>>(),
            Element::Bytes(_) => std::str::from_utf8(bytes).ok().map(str::to_owned),
            _ => return Err(invalid(key, "the array holds numbers where text is needed")),
        };
        let mut text = text.ok_or_else(|| invalid(format!("{key}[{index}]"), "the text is not Unicode"))?;
        text.truncate(text.trim_end_matches('\0').len());
        strings.push(text);
    }
    Ok(in_row_major(header, strings))
}

/// Appends magic, version 1 and a header for a little-endian, row-major array.
pub(in crate::formats) fn write_header(output: &mut Vec<u8>, description: &str, shape: &[usize]) {
    let lengths: Vec<String> = shape.iter().map(usize::to_string).collect();
    let shape =
        if let [only] = lengths.as_slice() { format!("({only},)") } else { format!("({})", lengths.join(", ")) };
    let mut text = format!("{{'descr': '{description}', 'fortran_order': False, 'shape': {shape}, }}");
    // The data must start at a multiple of 64 bytes, and the header ends with a line feed.
    let padding = (64 - (10 + text.len() + 1) % 64) % 64;
    text.extend(std::iter::repeat_n(' ', padding));
    text.push('\n');
    output.extend_from_slice(b"\x93NUMPY\x01\x00");
    output.extend_from_slice(&(text.len() as u16).to_le_bytes());
    output.extend_from_slice(text.as_bytes());
}

/// An array of text as NumPy's `<U`, wide enough for the longest.
pub(in crate::formats) fn unicode_array(texts: &[&str], shape: &[usize]) -> Vec<u8> {
    let width = texts.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1);
    let mut output = Vec::new();
    write_header(&mut output, &format!("<U{width}"), shape);
    for text in texts {
        let end = output.len() + width * 4;
        output.extend(text.chars().flat_map(|character| u32::from(character).to_le_bytes()));
        output.resize(end, 0);
    }
    output
}

fn fill(reader: &mut impl Read, buffer: &mut [u8], key: &str) -> Result<(), FormatError> {
    reader.read_exact(buffer).map_err(|error| invalid(key, format!("the array ends within its header: {error}")))
}

fn unsigned(bytes: &[u8], big_endian: bool) -> u64 {
    let join = |value: u64, byte: &u8| (value << 8) | u64::from(*byte);
    if big_endian { bytes.iter().fold(0, join) } else { bytes.iter().rev().fold(0, join) }
}

fn number(element: Element, bits: u64) -> f64 {
    match element {
        Element::Float(2) => f64::from(half(bits as u16)),
        Element::Float(_) => f64::from_bits(bits),
        Element::Signed(bytes) => {
            let unused = 64 - 8 * bytes as u32;
            ((bits << unused) as i64 >> unused) as f64
        }
        Element::Bool => f64::from(u8::from(bits != 0)),
        _ => bits as f64,
    }
}

/// Half precision, 1 + 5 + 10 bits.
fn half(bits: u16) -> f32 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let exponent = i32::from((bits >> 10) & 0x1f);
    let fraction = f32::from(bits & 0x3ff);
    match exponent {
        0 => sign * fraction * 2_f32.powi(-24),
        0x1f if fraction == 0.0 => sign * f32::INFINITY,
        0x1f => f32::NAN,
        _ => sign * (1.0 + fraction / 1024.0) * 2_f32.powi(exponent - 15),
    }
}

/// Column-major values into row-major order; row-major ones as they are.
fn in_row_major<T: Clone>(header: &Header, values: Vec<T>) -> Vec<T> {
    if !header.fortran_order || header.shape.len() < 2 || values.is_empty() {
        return values;
    }
    let strides: Vec<usize> = header
        .shape
        .iter()
        .scan(1, |stride, length| {
            let own = *stride;
            *stride *= length;
            Some(own)
        })
        .collect();
    let mut indices = vec![0; header.shape.len()];
    let mut sorted = Vec::with_capacity(values.len());
    for _ in 0..values.len() {
        let flat: usize = indices.iter().zip(&strides).map(|(index, stride)| index * stride).sum();
        sorted.push(values[flat].clone());
        for (index, length) in indices.iter_mut().zip(&header.shape).rev() {
            *index += 1;
            if *index < *length {
                break;
            }
            *index = 0;
        }
    }
    sorted
}

fn unsupported(key: &str, what: String) -> FormatError {
    FormatError::unsupported(
        "arrays",
        key,
        format!("{what} is not read"),
        "save the array with numpy.save as plain numbers or text",
    )
}

/// Parses the Python dictionary `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }`.
fn parse(text: &str, key: &str) -> Result<Header, FormatError> {
    let broken = || invalid(key, format!("the array header is not understood: {}", excerpt(text)));
    let inner = text.trim().strip_prefix('{').and_then(|text| text.strip_suffix('}')).ok_or_else(broken)?;
    let (mut element, mut fortran_order, mut shape) = (None, None, None);
    let mut rest = inner.trim_start();
    while !rest.is_empty() {
        let (name, after) = quoted(rest).ok_or_else(broken)?;
        rest = after.trim_start().strip_prefix(':').ok_or_else(broken)?.trim_start();
        match name {
            "descr" if rest.starts_with('[') => return Err(unsupported(key, "an array of records".into())),
            "descr" => {
                let (description, after) = quoted(rest).ok_or_else(broken)?;
                element = Some(element_of(description, key)?);
                rest = after;
            }
            "fortran_order" => {
                let (value, after) = if let Some(after) = rest.strip_prefix("True") {
                    (true, after)
                } else {
                    (false, rest.strip_prefix("False").ok_or_else(broken)?)
                };
                fortran_order = Some(value);
                rest = after;
            }
            "shape" => {
                let (tuple, after) = rest.strip_prefix('(').and_then(|rest| rest.split_once(')')).ok_or_else(broken)?;
                shape = Some(lengths(tuple).ok_or_else(broken)?);
                rest = after;
            }
            _ => return Err(broken()),
        }
        rest = rest.trim_start();
        rest = rest.strip_prefix(',').unwrap_or(rest).trim_start();
    }
    let (Some((element, big_endian)), Some(fortran_order), Some(shape)) = (element, fortran_order, shape) else {
        return Err(broken());
    };
    Ok(Header { element, big_endian, fortran_order, shape, header_bytes: 0 })
}

fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|first| matches!(first, '\'' | '"'))?;
    text[1..].split_once(quote)
}

fn lengths(tuple: &str) -> Option<Vec<usize>> {
    let tuple = tuple.trim();
    let tuple = tuple.strip_suffix(',').unwrap_or(tuple);
    if tuple.is_empty() {
        return Some(Vec::new());
    }
    // Python 2 wrote long integers with a trailing L.
    let lengths: Option<Vec<usize>> =
        tuple.split(',').map(|length| length.trim().trim_end_matches('L').parse().ok()).collect();
    lengths.filter(|lengths| lengths.len() <= MAX_DIMENSIONS)
}

fn element_of(description: &str, key: &str) -> Result<(Element, bool), FormatError> {
    let refused = || unsupported(key, format!("the element type '{}'", excerpt(description)));
    let (big_endian, kind) = match description.as_bytes().first() {
        Some(b'>') => (true, &description[1..]),
        Some(b'<' | b'|' | b'=') => (false, &description[1..]),
        _ => (false, description),
    };
    if kind.starts_with('O') {
        return Err(FormatError::unsupported(
            "arrays",
            key,
            "the array holds pickled Python objects, which are never decoded because they can run code",
            "save it as an array of plain numbers or text (dtype float32, int32 or str)",
        ));
    }
    let (letter, size) = kind.split_at_checked(1).ok_or_else(refused)?;
    let size: usize = size.parse().map_err(|_| refused())?;
    let element = match (letter, size) {
        ("b", 1) => Element::Bool,
        ("i", 1 | 2 | 4 | 8) => Element::Signed(size),
        ("u", 1 | 2 | 4 | 8) => Element::Unsigned(size),
        ("f", 2 | 4 | 8) => Element::Float(size),
        ("U", _) => Element::Unicode(size),
        ("S", _) => Element::Bytes(size),
        _ => return Err(refused()),
    };
    Ok((element, big_endian))
}

fn excerpt(text: &str) -> String {
    text.chars().take(120).collect()
}
