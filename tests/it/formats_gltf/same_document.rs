//! Whether an output has all that its target has: every part of the document, and every byte.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde_json::Value;

use crate::support::gltf_json;

const MESHOPT: &str = "EXT_meshopt_compression";
/// What compressed views are called.
const MESHOPT_NAMES: [&str; 2] = [MESHOPT, "KHR_meshopt_compression"];

/// The bytes of a document's views, compressed as they are: meshes, images, keys. Nothing for a view that has none.
fn view_bytes(file: &[u8]) -> Vec<Option<Vec<u8>>> {
    let json = gltf_json(file);
    let of_container = || {
        let text = u32::from_le_bytes(file[12..16].try_into().expect("four bytes")) as usize;
        file.get(20 + text + 8..).unwrap_or_default().to_vec()
    };
    let list = |name: &str| json[name].as_array().cloned().unwrap_or_default();
    let buffer = |buffer: &Value| match buffer["uri"].as_str() {
        Some(uri) => STANDARD.decode(uri.split_once(',').expect("a data URI").1).expect("base64"),
        None => of_container(),
    };
    let has_bytes =
        |(index, buffer): (usize, &Value)| buffer["uri"].is_string() || index == 0 && file.starts_with(b"glTF");
    let buffers: Vec<Option<Vec<u8>>> =
        list("buffers").iter().enumerate().map(|of| has_bytes(of).then(|| buffer(of.1))).collect();
    let view = |view: &Value| {
        let compressed = MESHOPT_NAMES.iter().map(|name| &view["extensions"][name]).find(|view| view.is_object());
        let number = |name: &str| compressed.unwrap_or(view)[name].as_u64().unwrap_or(0) as usize;
        let bytes = buffers.get(number("buffer"))?.as_ref()?;
        Some(bytes[number("byteOffset")..number("byteOffset") + number("byteLength")].to_vec())
    };
    list("bufferViews").iter().map(view).collect()
}

/// What a document's images are: the bytes of those in it, and all that is said of them but where their bytes are.
fn images(json: &Value, views: &[Option<Vec<u8>>]) -> Vec<(Option<Vec<u8>>, Value)> {
    let image = |image: &Value| {
        let mut image = image.clone();
        let view = image["bufferView"].as_u64().map(|view| views[view as usize].clone().expect("an image has bytes"));
        let data = image["uri"].as_str().and_then(|uri| uri.split_once(";base64,"));
        let data = data.map(|(_, text)| STANDARD.decode(text).expect("base64"));
        let bytes = view.or(data);
        let about = image.as_object_mut().expect("an object");
        about.retain(|key, _| bytes.is_none() || !["uri", "bufferView", "mimeType"].contains(&key.as_str()));
        (bytes, image)
    };
    json["images"].as_array().into_iter().flatten().map(image).collect()
}

/// All JSON but the parts that the writer must change is equal, what the old accessors and animations say too, and every byte that
/// they refer to.
pub(crate) fn assert_same_document(before: &[u8], after: &[u8], name: &str) {
    let (old, new) = (view_bytes(before), view_bytes(after));
    assert!(old.len() <= new.len() && old.iter().zip(&new).all(|(old, new)| old == new), "{name}: bytes of old views");
    let images = |file: &[u8]| images(&gltf_json(file), &view_bytes(file));
    assert_eq!(images(before), images(after), "{name}: images");
    let (mut before, mut after) = (gltf_json(before), gltf_json(after));
    let count = |json: &Value, key: &str| json[key].as_array().map_or(0, Vec::len);
    for key in ["nodes", "meshes", "materials", "images", "skins"] {
        assert_eq!(count(&before, key), count(&after, key), "{name}: number of {key}");
    }
    for (key, from) in [("accessors", 0), ("animations", 1)] {
        let (old, new) = (before[key].as_array().cloned(), after[key].as_array().cloned());
        let (old, new) = (old.unwrap_or_default(), new.unwrap_or_default());
        // Animations are all there or all dropped.
        let is_dropped = key == "animations" && new.len() == 1;
        assert!(is_dropped || old[..] == new[from..from + old.len()], "{name}: old {key}");
    }
    // The new animation may be compressed.
    for list in ["extensionsUsed", "extensionsRequired"] {
        let names = |json: &Value| json[list].as_array().cloned().unwrap_or_default();
        let added: Vec<Value> = names(&after).into_iter().filter(|name| !names(&before).contains(name)).collect();
        assert!(added.is_empty() || added == [MESHOPT], "{name}: {list}");
        assert!(names(&before).iter().all(|extension| names(&after).contains(extension)), "{name}: {list} stay");
    }
    for json in [&mut before, &mut after] {
        let object = json.as_object_mut().expect("an object");
        let written_anew =
            ["buffers", "bufferViews", "accessors", "animations", "images", "extensionsUsed", "extensionsRequired"];
        for key in written_anew {
            object.remove(key);
        }
        // What the output says of itself is its own.
        if let Some(extras) = json.pointer_mut("/asset/extras").and_then(Value::as_object_mut) {
            extras.remove("retargetd");
            if extras.is_empty() {
                json["asset"].as_object_mut().expect("an object").remove("extras");
            }
        }
        let object = json.as_object_mut().expect("an object");
        // An animated node cannot keep its matrix; that its transform is equal is tested by reading.
        for node in object.get_mut("nodes").and_then(Value::as_array_mut).into_iter().flatten() {
            let node = node.as_object_mut().expect("an object");
            for key in ["matrix", "translation", "rotation", "scale"] {
                node.remove(key);
            }
        }
    }
    assert_eq!(before, after, "{name}: the rest of the document");
}
