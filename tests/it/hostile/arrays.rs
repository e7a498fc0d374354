//! Arrays of NumPy and of JSON: shapes, types and indices that lie.

use std::io::{Cursor, Write};

use serde_json::{Value, json};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use super::{BEYOND_A_LIMIT, MALFORMED, UNSUPPORTED, Wanted, case, try_all};

/// An array with this header, of the format's first or second version.
fn array(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    if version == 1 {
        bytes.extend((header.len() as u16).to_le_bytes());
    } else {
        bytes.extend((header.len() as u32).to_le_bytes());
    }
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn of(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    array(1, &format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n"), data)
}

fn archive(members: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, bytes) in members {
        zip.start_file(format!("{name}.npy"), options).expect("a member");
        zip.write_all(bytes).expect("written into memory");
    }
    zip.finish().expect("an archive").into_inner()
}

fn parameters(poses: Vec<u8>) -> Vec<u8> {
    archive(&[("poses", poses)])
}

#[test]
fn shapes_and_types() {
    let floats = |shape: &str, bytes: usize| of("<f4", shape, &vec![0; bytes]);
    let nested =
        format!("{{'descr': '<f4', 'shape': {}{}, 'fortran_order': False}}", "(".repeat(5000), ")".repeat(5000));
    let mut endless = b"\x93NUMPY\x02\0".to_vec();
    endless.extend(u32::MAX.to_le_bytes());
    try_all(&[
        case("beyond 64 bits.npy", floats("(4294967296, 4294967296, 4294967296)", 0), MALFORMED),
        case("terabytes.npy", floats("(1000000000000, 22, 3)", 0), BEYOND_A_LIMIT),
        case("more than is there.npy", floats("(100000, 22, 3)", 100), MALFORMED),
        case("below zero.npy", floats("(-1, 22, 3)", 0), MALFORMED),
        case("no frame.npy", floats("(0, 22, 3)", 0), MALFORMED),
        case("twenty dimensions.npy", floats("(1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1)", 4), MALFORMED),
        case("no shape.npy", of("<f4", "()", &[0; 4]), MALFORMED),
        case("a header of gibibytes.npy", endless, MALFORMED),
        case("a header that nests.npy", array(1, &nested, b""), MALFORMED),
        case("a pickle.npy", of("|O", "(1,)", b"\x80\x04cos\nsystem\n(S'true'\ntR."), UNSUPPORTED),
        case(
            "a record.npy",
            array(1, "{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (1,), }\n", &[0; 4]),
            UNSUPPORTED,
        ),
        case("text.npy", of("<U4000000000", "(1,)", b""), BEYOND_A_LIMIT),
        case("no number.npy", of("<f4", "(1, 22, 3)", &f32::NAN.to_le_bytes().repeat(66)), MALFORMED),
        case("without end.npy", of("<f8", "(1, 22, 3)", &f64::INFINITY.to_le_bytes().repeat(66)), MALFORMED),
        case("beyond single precision.npy", of("<f8", "(1, 22, 3)", &1e300_f64.to_le_bytes().repeat(66)), MALFORMED),
        case("in one place.npy", of("<f4", "(2, 22, 3)", &f32::MAX.to_le_bytes().repeat(132)), MALFORMED),
        case("a version of nobody.npy", array(9, "", b""), UNSUPPORTED),
    ]);
}

#[test]
fn archives_of_arrays() {
    let zeros = of("<f4", "(100000, 156)", &vec![0; 62_400_000]);
    let pickled = of("|O", "(1,)", b"\x80\x04cos\nsystem\n(S'true'\ntR.");
    let many: Vec<(String, Vec<u8>)> = (0..2000).map(|index| (format!("a{index}"), Vec::new())).collect();
    let many: Vec<(&str, Vec<u8>)> = many.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect();
    try_all(&[
        case("a bomb.npz", parameters(zeros), BEYOND_A_LIMIT),
        case("declared terabytes.npz", parameters(of("<f4", "(1000000000000, 156)", &[0; 64])), BEYOND_A_LIMIT),
        case("less than declared.npz", parameters(of("<f4", "(1000, 156)", &[0; 64])), MALFORMED),
        case("more than declared.npz", parameters(of("<f4", "(1, 156)", &[0; 640])), MALFORMED),
        case("a pickle.npz", parameters(pickled), UNSUPPORTED),
        case("many members.npz", archive(&many), MALFORMED),
        case("joints of no body.npz", parameters(of("<f4", "(1, 9)", &[0; 36])), MALFORMED),
        case("no number.npz", parameters(of("<f4", "(1, 156)", &f32::NAN.to_le_bytes().repeat(156))), MALFORMED),
        case("no array.npz", parameters(b"\x93NUMPY".to_vec()), MALFORMED),
    ]);
}

fn poses(members: Value) -> String {
    let mut poses = json!({"joint_names": ["a", "b"], "parents": [-1, 0], "rest_translations": [[0, 0, 0], [0, 1, 0]], "times": [0, 1],
                           "rotations": [[[0, 0, 0, 1], [0, 0, 0, 1]], [[0, 0, 0, 1], [0, 0, 0, 1]]]});
    if let (Value::Object(all), Value::Object(members)) = (&mut poses, members) {
        all.extend(members);
    }
    poses.to_string()
}

#[test]
fn poses_in_json() {
    let deep = |levels: usize| format!("{{\"joint_names\": [\"a\"], \"x\": {}", "[".repeat(levels));
    let zero = json!([[[0, 0, 0, 0], [0, 0, 0, 1]], [[0, 0, 0, 1], [0, 0, 0, 1]]]);
    let many = "\"a\",".repeat(100_000);
    try_all(&[
        case("deep.json", deep(1 << 20), MALFORMED),
        case(
            "deep in an array.json",
            "{\"joint_names\": [\"a\"], \"times\": ".to_owned() + &"[".repeat(1 << 20),
            MALFORMED,
        ),
        case("a circle.json", poses(json!({"parents": [1, 0]})), MALFORMED),
        case("its own parent.json", poses(json!({"parents": [0, 0]})), MALFORMED),
        case("a parent of nobody.json", poses(json!({"parents": [-1, 1e18]})), MALFORMED),
        case("half a parent.json", poses(json!({"parents": [-1, 0.5]})), MALFORMED),
        case("equal names.json", poses(json!({"joint_names": ["a", "a"]})), Wanted::Read),
        case("no rotation.json", poses(json!({"rotations": zero})), MALFORMED),
        case("times that stand.json", poses(json!({"times": [1, 1]})), MALFORMED),
        case("ages.json", poses(json!({"times": [0, 1e300]})), MALFORMED),
        case("no rate.json", poses(json!({"times": null, "meta": {"fps": 0}})), MALFORMED),
        case("an endless unit.json", poses(json!({"meta": {"unit": 1e308}})), Wanted::Read),
        case("axes of nobody.json", poses(json!({"meta": {"axes": "+y+y"}})), MALFORMED),
        case("uneven.json", poses(json!({"rest_translations": [[0, 0, 0], [0, 1]]})), MALFORMED),
        case("beyond doubles.json", poses(json!({})).replace("[0,1,0]", "[0,1e999,0]"), MALFORMED),
        case("contacts of nobody.json", poses(json!({"contact_joints": ["z"], "contacts": [[0], [1]]})), MALFORMED),
        case("100,000 joints.json", format!("{{\"joint_names\": [{many}\"b\"]}}"), BEYOND_A_LIMIT),
        case("one key twice.json", "{\"joint_names\": [\"a\"], \"joint_names\": [\"b\"]}", MALFORMED),
    ]);
}
