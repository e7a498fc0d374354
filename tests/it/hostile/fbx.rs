//! FBX: nodes, arrays and properties that lie, in binary and in text; times and connections beyond sense.

use super::{BEYOND_A_LIMIT, Case, MALFORMED, Wanted, case, try_all};

/// A binary file of version 7.4 with these records.
fn binary(records: &[u8]) -> Vec<u8> {
    let mut bytes = b"Kaydara FBX Binary  \0\x1a\0".to_vec();
    bytes.extend(7400_u32.to_le_bytes());
    bytes.extend(records);
    bytes
}

/// A record: where it ends, how many properties of how many bytes it has, its name, what follows.
fn record(end: u32, properties: u32, property_bytes: u32, name: &str, content: &[u8]) -> Vec<u8> {
    let mut bytes: Vec<u8> = [end, properties, property_bytes].iter().flat_map(|word| word.to_le_bytes()).collect();
    bytes.push(name.len() as u8);
    bytes.extend(name.as_bytes());
    bytes.extend(content);
    bytes
}

/// The header of an array of doubles that is packed with deflate.
fn packed_array(count: u32, packed_bytes: u32) -> Vec<u8> {
    let mut bytes = b"d".to_vec();
    for word in [count, 1, packed_bytes] {
        bytes.extend(word.to_le_bytes());
    }
    bytes
}

fn text(objects: &str, connections: &str) -> String {
    format!(
        "; FBX 7.4.0 project file\nFBXHeaderExtension:  {{\n FBXHeaderVersion: 1003\n FBXVersion: 7400\n}}\nObjects:  {{\n{objects}}}\n\
         Connections:  {{\n{connections}}}\n"
    )
}

fn limb(id: i64, members: &str) -> String {
    format!("Model: {id}, \"Model::j{id}\", \"LimbNode\" {{\n Version: 232\n Properties70: {{\n{members} }}\n}}\n")
}

#[test]
fn records() {
    const START: u32 = 27;
    let far = record(u32::MAX, 0, 0, "Objects", b"");
    let before = record(1, 0, 0, "Objects", b"");
    let many = record(START + 40, u32::MAX, 8, "Objects", &[0; 64]);
    let wide = record(START + 40, 1, u32::MAX, "Objects", &[0; 64]);
    let array = record(START + 60, 1, 13, "Objects", &packed_array(u32::MAX, 4));
    let packed = record(START + 60, 1, 13, "Objects", &packed_array(4, u32::MAX));
    let mut deep = Vec::new();
    for level in 0..20_000_u32 {
        deep.extend(record(START + (level + 1) * 14 + 1_000_000, 0, 0, "N", b""));
    }
    try_all(&[
        case("an end past the file.fbx", binary(&far), MALFORMED),
        case("an end before its begin.fbx", binary(&before), MALFORMED),
        case("four billion properties.fbx", binary(&many), MALFORMED),
        case("properties of gibibytes.fbx", binary(&wide), MALFORMED),
        case("an array of 32 GiB.fbx", binary(&array), MALFORMED),
        case("packed bytes past the end.fbx", binary(&packed), MALFORMED),
        case("records in records.fbx", binary(&deep), MALFORMED),
        case("a header alone.fbx", binary(b""), MALFORMED),
    ]);
}

#[test]
fn texts() {
    let head = text("", "");
    try_all(&[
        case("deep braces.fbx", head.clone() + &"A: {".repeat(200_000), MALFORMED),
        case("not closed.fbx", head + "A: \"", MALFORMED),
        case(
            "an array that lies.fbx",
            text(
                &(limb(1, "") + "Geometry: 2, \"Geometry::\", \"Mesh\" {\n Vertices: *4000000000 {\n a: 1\n }\n}\n"),
                "",
            ),
            Wanted::Read,
        ),
        case(
            "a translation beyond doubles.fbx",
            text(&limb(1, " P: \"Lcl Translation\", \"\", \"\", \"A\",1e999,0,0\n"), ""),
            Wanted::Read,
        ),
        case("a scale of zero.fbx", text(&limb(1, " P: \"Lcl Scaling\", \"\", \"\", \"A\",0,0,0\n"), ""), Wanted::Read),
        case(
            "an order of nobody.fbx",
            text(&limb(1, " P: \"RotationOrder\", \"enum\", \"\", \"\",99\n"), ""),
            Wanted::Read,
        ),
        case("one id twice.fbx", text(&(limb(1, "") + &limb(1, "")), "C: \"OO\",1,0\nC: \"OO\",1,0\n"), Wanted::Read),
        case("a circle.fbx", text(&(limb(1, "") + &limb(2, "")), "C: \"OO\",1,2\nC: \"OO\",2,1\n"), MALFORMED),
        case("its own parent.fbx", text(&limb(1, ""), "C: \"OO\",1,1\n"), MALFORMED),
        case("100,000 limbs.fbx", text(&(1..100_000).map(|id| limb(id, "")).collect::<String>(), ""), BEYOND_A_LIMIT),
    ]);
}

/// Curves of one joint's rotation at these times.
fn moved(ticks: &str, values: &str, count: usize, settings: &str) -> String {
    let curve = format!(
        "AnimationStack: 50, \"AnimStack::Take\", \"\" {{\n}}\nAnimationLayer: 51, \"AnimLayer::Base\", \"\" {{\n}}\n\
         AnimationCurveNode: 40, \"AnimCurveNode::R\", \"\" {{\n}}\nAnimationCurve: 41, \"AnimCurve::\", \"\" {{\n KeyVer: 4008\n \
         KeyTime: *{count} {{\n a: {ticks}\n }}\n KeyValueFloat: *{count} {{\n a: {values}\n }}\n KeyAttrFlags: *1 {{\n a: 8\n }}\n \
         KeyAttrDataFloat: *4 {{\n a: 0,0,0,0\n }}\n KeyAttrRefCount: *1 {{\n a: {count}\n }}\n}}\n"
    );
    let connections =
        "C: \"OO\",1,0\nC: \"OO\",51,50\nC: \"OO\",40,51\nC: \"OP\",40,1,\"Lcl Rotation\"\nC: \"OP\",41,40,\"d|X\"\n";
    let settings = format!("GlobalSettings:  {{\n Version: 1000\n Properties70:  {{\n{settings} }}\n}}\n");
    text(&(limb(1, "") + &curve), connections).replace("Objects:", &format!("{settings}Objects:"))
}

#[test]
fn times() {
    let rate = |rate: &str| {
        format!(
            " P: \"TimeMode\", \"enum\", \"\", \"\",14\n P: \"CustomFrameRate\", \"double\", \"Number\", \"\",{rate}\n"
        )
    };
    let stacks: String =
        (0..300).map(|id| format!("AnimationStack: {}, \"AnimStack::t{id}\", \"\" {{\n}}\n", 1000 + id)).collect();
    let cases: Vec<Case> = vec![
        case("ages apart.fbx", moved("-9223372036854775808,9223372036854775807", "0,270", 2, ""), Wanted::Read),
        case("a year.fbx", moved("0,1456528000000000000", "0,270", 2, ""), Wanted::Read),
        case("times that fall.fbx", moved("46186158000,0", "0,10", 2, ""), Wanted::Read),
        case("one time twice.fbx", moved("0,0", "0,10", 2, ""), Wanted::Read),
        case("an angle that is none.fbx", moved("0,46186158000", "0,nan", 2, ""), MALFORMED),
        case("an angle without end.fbx", moved("0,46186158000", "0,1e39", 2, ""), MALFORMED),
        case("a rate beyond measure.fbx", moved("0,46186158000", "0,270", 2, &rate("1e300")), Wanted::Read),
        case("no rate.fbx", moved("0,46186158000", "0,270", 2, &rate("0")), Wanted::Read),
        case("a million turns.fbx", moved("0,46186158000", "0,3.6e8", 2, ""), Wanted::Read),
        case("300 takes.fbx", text(&(limb(1, "") + &stacks), ""), BEYOND_A_LIMIT),
    ];
    try_all(&cases);
}
