//! Exact small cases of the two codecs.

use crate::{
    formats::{Budget, ErrorKind, Limits},
    model::Control,
};

use super::{arrays::Values, json};
use crate::formats::numpy::npy;

fn array(description: &str, order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut text = format!("{{'descr': '{description}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
    text.insert_str(text.len() - 1, "  ");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.extend(data);
    bytes
}

fn decode(description: &str, order: &str, shape: &str, data: &[u8]) -> Vec<f64> {
    let bytes = array(description, order, shape, data);
    let mut reader = bytes.as_slice();
    let header = npy::read_header(&mut reader, "key").expect("a valid header");
    let numbers = npy::numbers(&header, reader, "key").expect("numbers");
    match numbers.values {
        Values::Single(values) => values.into_iter().map(f64::from).collect(),
        Values::Double(values) => values,
    }
}

#[test]
fn every_element_type_is_decoded() {
    assert_eq!(decode("<f4", "False", "(2,)", &[0, 0, 128, 63, 0, 0, 0, 192]), [1.0, -2.0], "single");
    assert_eq!(decode(">f8", "False", "(1,)", &1.5_f64.to_be_bytes()), [1.5], "double, big-endian");
    assert_eq!(
        decode("<f2", "False", "(4,)", &[0, 0x3c, 0, 0xc0, 1, 0, 0xff, 0x7b]),
        [1.0, -2.0, 2_f64.powi(-24), 65504.0],
        "half"
    );
    assert_eq!(decode("|i1", "False", "(2,)", &[0xff, 5]), [-1.0, 5.0], "bytes with a sign");
    assert_eq!(decode(">i2", "False", "(1,)", &[0xff, 0xfe]), [-2.0], "short, big-endian");
    assert_eq!(decode("<i8", "False", "(1,)", &(-7_i64).to_le_bytes()), [-7.0], "long");
    assert_eq!(decode("<u4", "False", "(1,)", &[0xff; 4]), [4_294_967_295.0], "unsigned");
    assert_eq!(decode("|b1", "False", "(2,)", &[0, 1]), [0.0, 1.0], "truth");
    assert_eq!(decode("<i4", "False", "()", &7_i32.to_le_bytes()), [7.0], "no dimension");
}

#[test]
fn column_major_order_is_turned() {
    let columns = [1, 4, 2, 5, 3, 6];
    assert_eq!(decode("|u1", "True", "(2, 3)", &columns), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "two rows of three");
}

#[test]
fn text_is_decoded() {
    let units: Vec<u8> = ['é', '\0', 'a', 'b'].iter().flat_map(|letter| u32::from(*letter).to_be_bytes()).collect();
    for (description, data, expected) in [(">U2", units.as_slice(), ["é", "ab"]), ("|S2", b"x\0yz", ["x", "yz"])] {
        let bytes = array(description, "False", "(2,)", data);
        let mut reader = bytes.as_slice();
        let header = npy::read_header(&mut reader, "key").expect("a valid header");
        assert_eq!(npy::strings(&header, reader, "key").expect("text"), expected, "{description}");
    }
}

#[test]
fn what_is_no_plain_array_is_refused() {
    let kind = |bytes: &[u8]| npy::read_header(&mut &*bytes, "key").expect_err("refused").kind;
    assert_eq!(kind(&array("|O", "False", "(1,)", b"")), ErrorKind::UnsupportedFeature, "pickled objects");
    assert_eq!(kind(&array("<c8", "False", "(1,)", b"")), ErrorKind::UnsupportedFeature, "complex numbers");
    assert_eq!(kind(&array("<é8", "False", "(1,)", b"")), ErrorKind::UnsupportedFeature, "no such type");
    assert_eq!(kind(&array("<f4", "False", "(-1,)", b"")), ErrorKind::Malformed, "a negative length");
    assert_eq!(kind(&array("<f4", "Maybe", "(1,)", b"")), ErrorKind::Malformed, "no truth value");
    assert_eq!(kind(b"\x93NUMPY\x02\x00\xff\xff\xff\xff"), ErrorKind::Malformed, "a header of four gigabytes");
    assert_eq!(kind(b"\x93NUM"), ErrorKind::Malformed, "cut short");
}

#[test]
fn a_written_header_is_aligned_and_reads_back() {
    for shape in [vec![], vec![3], vec![2, 65, 4]] {
        let mut bytes = Vec::new();
        npy::write_header(&mut bytes, "<f4", &shape);
        assert_eq!(bytes.len() % 64, 0, "data begin at a multiple of 64");
        let header = npy::read_header(&mut bytes.as_slice(), "key").expect("our own header");
        assert_eq!(header.shape, shape, "the shape");
        assert_eq!(header.header_bytes, bytes.len() as u64, "its length");
    }
}

#[test]
fn json_is_paid_for_while_it_is_read() {
    let numbers = vec!["0"; 20_000].join(",");
    let text = format!("{{\"times\": [{numbers}]}}");
    let limits = Limits { decoded_bytes: 100_000, ..Limits::default() };
    let control = Control::new();
    let error = json::read(text.as_bytes(), &mut Budget::new(&limits, &control)).expect_err("160 kB of numbers");
    assert!(matches!(error.kind, ErrorKind::LimitExceeded { .. }), "the real reason, not serde's: {error:?}");
    control.cancel();
    let error = json::read(text.as_bytes(), &mut Budget::new(&limits, &control)).expect_err("canceled");
    assert_eq!(error.kind, ErrorKind::Canceled, "a long list hears of it");
}
