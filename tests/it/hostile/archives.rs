//! Zip: bombs, members that lie, archives in archives, ways out of the archive.

use std::io::{Cursor, Write};

use serde_json::json;
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use super::{BEYOND_A_LIMIT, MALFORMED, UNSUPPORTED, case, try_all};

const LOCAL_HEADER_BYTES: usize = 30;

fn archive(members: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, bytes) in members {
        zip.start_file(*name, options).expect("a member");
        zip.write_all(bytes).expect("written into memory");
    }
    zip.finish().expect("an archive").into_inner()
}

/// Puts bytes at a place of every header of a kind.
fn patched(archive: &[u8], signature: &[u8; 4], offset: usize, with: &[u8]) -> Vec<u8> {
    let mut bytes = archive.to_vec();
    let places: Vec<usize> = (0..bytes.len() - 4).filter(|at| bytes[*at..].starts_with(signature)).collect();
    for place in places {
        bytes[place + offset..place + offset + with.len()].copy_from_slice(with);
    }
    bytes
}

/// Many names for one packed member: a directory of which every entry points to the first.
fn overlapping(names: usize) -> Vec<u8> {
    let uris: Vec<_> = (0..names).map(|index| json!({"uri": format!("{index:04}.bin"), "byteLength": 1})).collect();
    let document = json!({"asset": {"version": "2.0"}, "buffers": uris}).to_string();
    let plain = archive(&[("0000.bin", &vec![0; 4 << 20]), ("a.gltf", document.as_bytes())]);
    let directory = plain.windows(4).position(|window| window == b"PK\x01\x02").expect("a directory");
    let (members, directory) = plain.split_at(directory);
    let end = directory.windows(4).position(|window| window == b"PK\x05\x06").expect("an end");
    let (entries, end) = directory.split_at(end);
    let second = 4 + entries[4..].windows(4).position(|window| window == b"PK\x01\x02").expect("two members");
    let (first, model) = entries.split_at(second);
    let mut directory = model.to_vec();
    for index in 0..names {
        let mut entry = first.to_vec();
        entry[46..50].copy_from_slice(format!("{index:04}").as_bytes());
        directory.extend(entry);
    }
    let mut end = end.to_vec();
    let count = (names as u16 + 1).to_le_bytes();
    end[8..10].copy_from_slice(&count);
    end[10..12].copy_from_slice(&count);
    end[12..16].copy_from_slice(&(directory.len() as u32).to_le_bytes());
    [members, &directory, &end].concat()
}

#[test]
fn bombs() {
    let zeros = vec![0; 64 << 20];
    let bomb = archive(&[("walk.bvh", &zeros)]);
    let inner = archive(&[("inner.bvh", b"HIERARCHY ROOT a { OFFSET 0 0 0 }")]);
    let nested = archive(&[("inner.glb", &inner)]);
    let deeply = (0..20).fold(inner, |inner, _| archive(&[("inner.glb", &inner)]));
    try_all(&[
        case("a bomb.zip", bomb.clone(), BEYOND_A_LIMIT),
        case("a bomb in an archive.zip", archive(&[("bomb.glb", &bomb)]), UNSUPPORTED),
        case(
            "zeros.zip",
            archive(&[("walk.bvh", &zeros[..4 << 20])]),
            super::Wanted::Refused(retargetd::engine::FailureCode::UnsupportedFormat),
        ),
        case("an archive in an archive.zip", nested, UNSUPPORTED),
        case("twenty archives.zip", deeply, UNSUPPORTED),
        case("one member under many names.zip", overlapping(400), BEYOND_A_LIMIT),
    ]);
}

#[test]
fn lies() {
    const CENTRAL: &[u8; 4] = b"PK\x01\x02";
    const LOCAL: &[u8; 4] = b"PK\x03\x04";
    const END: &[u8; 4] = b"PK\x05\x06";
    let good = archive(&[("walk.bvh", b"HIERARCHY ROOT a { OFFSET 0 0 0 } ".repeat(20).as_slice())]);
    let many: Vec<String> = (0..5000).map(|index| format!("{index}.txt")).collect();
    let many: Vec<(&str, &[u8])> = many.iter().map(|name| (name.as_str(), &b""[..])).collect();
    let document =
        |uri: &str| json!({"asset": {"version": "2.0"}, "buffers": [{"uri": uri, "byteLength": 4}]}).to_string();
    let out = document("../../../etc/passwd");
    let elsewhere = document("https://example.org/a.bin");
    try_all(&[
        case("smaller than it is.zip", patched(&good, CENTRAL, 24, &8_u32.to_le_bytes()), MALFORMED),
        case("larger than it is.zip", patched(&good, CENTRAL, 24, &900_000_000_u32.to_le_bytes()), BEYOND_A_LIMIT),
        case("another checksum.zip", patched(&good, CENTRAL, 16, &[1, 2, 3, 4]), MALFORMED),
        case(
            "a method of nobody.zip",
            patched(&patched(&good, CENTRAL, 10, &[99, 0]), LOCAL, 8, &[99, 0]),
            UNSUPPORTED,
        ),
        case("behind a password.zip", patched(&patched(&good, CENTRAL, 8, &[1, 0]), LOCAL, 6, &[1, 0]), UNSUPPORTED),
        case("members past the end.zip", patched(&good, CENTRAL, 42, &u32::MAX.to_le_bytes()), MALFORMED),
        case("a directory past the end.zip", patched(&good, END, 16, &0x7fff_ffff_u32.to_le_bytes()), MALFORMED),
        case("many members.zip", archive(&many), MALFORMED),
        case("no member.zip", archive(&[]), MALFORMED),
        case("cut off.zip", &good[..LOCAL_HEADER_BYTES + 20], MALFORMED),
        case("out of the archive.zip", archive(&[("a/model.gltf", out.as_bytes())]), MALFORMED),
        case("elsewhere.zip", archive(&[("model.gltf", elsewhere.as_bytes())]), UNSUPPORTED),
        case("two models.zip", archive(&[("a.bvh", b"x"), ("b.glb", b"y")]), MALFORMED),
    ]);
}
