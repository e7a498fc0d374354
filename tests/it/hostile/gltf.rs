//! glTF: lengths, counts and products that lie, trees that are none, numbers that are none.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde_json::{Value, json};

use super::{BEYOND_A_LIMIT, Case, MALFORMED, UNSUPPORTED, Wanted, case, try_all};

const FLOAT: u32 = 5126;

fn document(members: Value) -> String {
    let mut document =
        json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"name": "a"}]});
    if let (Value::Object(all), Value::Object(members)) = (&mut document, members) {
        all.extend(members);
    }
    document.to_string()
}

/// An animation of the first node with these accessors for key times and values, over one view of 64 zero bytes.
fn animated(times: Value, values: Value) -> String {
    let uri = data_uri(&[0; 64]);
    document(json!({
        "buffers": [{"byteLength": 64, "uri": uri}], "bufferViews": [{"buffer": 0, "byteLength": 64}],
        "accessors": [times, values],
        "animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                        "samplers": [{"input": 0, "output": 1}]}]}))
}

fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", STANDARD.encode(bytes))
}

fn accessor(shape: &str, members: Value) -> Value {
    let mut accessor = json!({"componentType": FLOAT, "count": 1, "type": shape, "bufferView": 0});
    if let (Value::Object(all), Value::Object(members)) = (&mut accessor, members) {
        all.extend(members);
    }
    accessor
}

fn glb(length: u32, chunk: u32, kind: &[u8; 4], json: &str) -> Vec<u8> {
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend(length.to_le_bytes());
    bytes.extend(chunk.to_le_bytes());
    bytes.extend(kind);
    bytes.extend(json.as_bytes());
    bytes
}

#[test]
fn containers() {
    let json = document(json!({}));
    let length = json.len() as u32;
    try_all(&[
        case("four gibibytes.glb", glb(u32::MAX, length, b"JSON", &json), MALFORMED),
        case("shorter than its header.glb", glb(4, length, b"JSON", &json), MALFORMED),
        case("a chunk of four gibibytes.glb", glb(20 + length, u32::MAX, b"JSON", &json), MALFORMED),
        case("a chunk past the end.glb", glb(20 + length, length + 1, b"JSON", &json), MALFORMED),
        case("no document.glb", glb(20 + length, length, b"BIN\0", &json), MALFORMED),
        case("an empty document.glb", glb(20, 0, b"JSON", ""), MALFORMED),
        case("a header alone.glb", &b"glTF\x02\0\0\0"[..], MALFORMED),
        case("of another version.glb", &b"glTF\xff\xff\xff\xff\x0c\0\0\0"[..], UNSUPPORTED),
        case("deep.gltf", format!("{{\"asset\":{}", "[".repeat(1 << 20)), BEYOND_A_LIMIT),
        case("deep and closed.gltf", format!("{{\"a\":{}{}}}", "[".repeat(4000), "]".repeat(4000)), BEYOND_A_LIMIT),
        case("deep objects.gltf", "{\"a\":".repeat(1 << 18), BEYOND_A_LIMIT),
        case("not closed.gltf", "{\"asset\": \"", MALFORMED),
        case(
            "twenty million values.gltf",
            format!("{{\"asset\": {{\"version\": \"2.0\"}}, \"x\": [{}0]}}", "0,".repeat(20_000_000)),
            BEYOND_A_LIMIT,
        ),
    ]);
}

#[test]
fn buffers() {
    let buffers = |buffers: Value| document(json!({"buffers": buffers}));
    let meshopt = |count: u64, stride: u64| {
        let compressed =
            json!({"buffer": 1, "byteLength": 4, "byteStride": stride, "count": count, "mode": "ATTRIBUTES"});
        let fallback = json!({"EXT_meshopt_compression": {"fallback": true}});
        let mut document: Value =
            serde_json::from_str(&animated(accessor("SCALAR", json!({})), accessor("VEC3", json!({}))))
                .expect("a document");
        document["extensionsUsed"] = json!(["EXT_meshopt_compression"]);
        document["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
        document["buffers"] = json!([{"byteLength": 4_000_000_000_u64, "extensions": fallback}, {"byteLength": 4, "uri": data_uri(b"abcd")}]);
        document["bufferViews"] =
            json!([{"buffer": 0, "byteLength": count * stride, "extensions": {"EXT_meshopt_compression": compressed}}]);
        document.to_string()
    };
    try_all(&[
        case("an exbibyte.gltf", buffers(json!([{"byteLength": 1_u64 << 60, "uri": "data:,"}])), MALFORMED),
        case("below zero.gltf", buffers(json!([{"byteLength": -1, "uri": "data:,"}])), MALFORMED),
        case(
            "no base64.gltf",
            buffers(json!([{"byteLength": 3, "uri": "data:application/gltf-buffer;base64,????"}])),
            MALFORMED,
        ),
        case("another file.gltf", buffers(json!([{"byteLength": 3, "uri": "file:///etc/passwd"}])), UNSUPPORTED),
        case("meshopt of gibibytes.gltf", meshopt(200_000_000, 16), BEYOND_A_LIMIT),
        case("meshopt of a stride that is none.gltf", meshopt(4, 7), UNSUPPORTED),
        case("meshopt of nothing.gltf", meshopt(8, 16), MALFORMED),
    ]);
}

#[test]
fn accessors() {
    let small = || accessor("VEC3", json!({}));
    let of = |members: Value| animated(accessor("SCALAR", members), small());
    let sparse = |count: u64, kind: u32| json!({"count": 4, "sparse": {"count": count, "indices": {"bufferView": 0, "componentType": kind}, "values": {"bufferView": 0}}});
    let keys = |count: u64| {
        let times = json!({"componentType": FLOAT, "count": count, "type": "SCALAR"});
        animated(times, json!({"componentType": FLOAT, "count": count, "type": "VEC3"}))
    };
    try_all(&[
        case("four billion keys.gltf", keys(4_000_000_000), BEYOND_A_LIMIT),
        case("keys beyond counting.gltf", keys(u64::MAX), BEYOND_A_LIMIT),
        case("more than is there.gltf", of(json!({"count": 17})), MALFORMED),
        case("count times size beyond 64 bits.gltf", of(json!({"count": u64::MAX / 4})), BEYOND_A_LIMIT),
        case("an offset beyond 64 bits.gltf", of(json!({"byteOffset": u64::MAX})), MALFORMED),
        case("an offset past the end.gltf", of(json!({"byteOffset": 61})), MALFORMED),
        case("below zero.gltf", of(json!({"count": -1})), MALFORMED),
        case("a fraction.gltf", of(json!({"count": 1.5})), MALFORMED),
        case("none.gltf", of(json!({"count": 0})), MALFORMED),
        case("a type of nobody.gltf", of(json!({"type": "VEC9"})), MALFORMED),
        case("a component of nobody.gltf", of(json!({"componentType": 5124})), MALFORMED),
        case("more sparse than there are.gltf", of(sparse(4_000_000_000, 5125)), MALFORMED),
        case("sparse that does not rise.gltf", of(sparse(3, 5121)), MALFORMED),
        case("sparse at floats.gltf", of(sparse(1, FLOAT)), MALFORMED),
        case("a view that is not there.gltf", of(json!({"bufferView": 9})), MALFORMED),
    ]);
}

#[test]
fn trees() {
    let nodes = |nodes: Value| document(json!({"nodes": nodes}));
    let chain = |count: usize| {
        let node = |index: usize| if index + 1 < count { json!({"children": [index + 1]}) } else { json!({}) };
        nodes((0..count).map(node).collect())
    };
    let skin = |skin: Value| document(json!({"skins": [skin]}));
    let mut cases: Vec<Case> = vec![
        case("a node below itself.gltf", nodes(json!([{"children": [0]}])), MALFORMED),
        case("a circle.gltf", nodes(json!([{"children": [1]}, {"children": [2]}, {"children": [0]}])), MALFORMED),
        case("a circle beside the scene.gltf", nodes(json!([{}, {"children": [2]}, {"children": [1]}])), MALFORMED),
        case("two parents.gltf", nodes(json!([{"children": [1, 2]}, {"children": [2]}, {}])), MALFORMED),
        case("a child twice.gltf", nodes(json!([{"children": [1, 1]}, {}])), MALFORMED),
        case("a child of nobody.gltf", nodes(json!([{"children": [7]}])), MALFORMED),
        case("a chain of 600.gltf", chain(600), BEYOND_A_LIMIT),
        case("a chain of 60,000.gltf", chain(60_000), BEYOND_A_LIMIT),
        case("70,000 nodes.gltf", nodes(vec![json!({}); 70_000].into()), BEYOND_A_LIMIT),
        case(
            "300 clips.gltf",
            document(json!({"animations": vec![json!({"channels": [], "samplers": []}); 300]})),
            BEYOND_A_LIMIT,
        ),
        case("a skin of nobody.gltf", skin(json!({"joints": [5]})), MALFORMED),
        case("a skin of 100,000 joints.gltf", skin(json!({"joints": vec![0; 100_000]})), Wanted::Read),
        case("equal names.gltf", nodes(vec![json!({"name": "a"}); 2000].into()), Wanted::Read),
        case("needs something unheard of.gltf", document(json!({"extensionsRequired": ["X_unheard_of"]})), UNSUPPORTED),
    ];
    let channel = json!({"sampler": 0, "target": {"path": "translation"}});
    let noisy = json!({"animations": [{"channels": vec![channel; 50_000], "samplers": [{"input": 0, "output": 0}]}]});
    cases.push(case("50,000 warnings.gltf", document(noisy), Wanted::Read));
    try_all(&cases);
}

#[test]
fn numbers() {
    let node = |member: &str, numbers: &str| {
        format!(r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"{member}": {numbers}}}]}}"#)
    };
    let keys = |times: [f32; 2], values: [f32; 6]| {
        let bytes: Vec<u8> = times.iter().chain(&values).flat_map(|value| value.to_le_bytes()).collect();
        document(json!({
            "buffers": [{"byteLength": 32, "uri": data_uri(&bytes)}], "bufferViews": [{"buffer": 0, "byteLength": 32}],
            "accessors": [accessor("SCALAR", json!({"count": 2})), accessor("VEC3", json!({"count": 2, "byteOffset": 8}))],
            "animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                            "samplers": [{"input": 0, "output": 1}]}]}))
    };
    try_all(&[
        case("beyond doubles.gltf", node("translation", "[1e999, 0, 0]"), MALFORMED),
        case("too few.gltf", node("translation", "[1]"), MALFORMED),
        case("no rotation.gltf", node("rotation", "[0, 0, 0, 0]"), Wanted::Read),
        case("no matrix.gltf", node("matrix", "[0,0,0,0, 0,0,0,0, 0,0,0,0, 0,0,0,0]"), Wanted::Read),
        case("a time that is none.gltf", keys([0.0, f32::NAN], [0.0; 6]), MALFORMED),
        case("a time without end.gltf", keys([0.0, f32::INFINITY], [0.0; 6]), MALFORMED),
        case("times that fall.gltf", keys([1.0, 0.0], [0.0; 6]), MALFORMED),
        case("ages.gltf", keys([0.0, f32::MAX], [0.0; 6]), Wanted::Read),
        case("places that are none.gltf", keys([0.0, 1.0], [f32::NAN; 6]), MALFORMED),
        case("places without end.gltf", keys([0.0, 1.0], [f32::NEG_INFINITY; 6]), MALFORMED),
        case("places far away.gltf", keys([0.0, 1.0], [f32::MAX; 6]), Wanted::Read),
    ]);
}
