//! Pose models: small ONNX files, written byte by byte, that find marks by their colors. What needs models runs in builds that have them, as the
//! test command's does.

use std::{path::Path, process::Command};

use super::{
    canvas::Canvas,
    command::{run, said},
    png, styles,
};

/// Points of COCO that the models look for: left wrist by red, right wrist by green, left ankle by blue.
const MARKS: [(usize, &str, [f64; 3]); 3] =
    [(9, "left_hand", [1.0, -0.5, -0.5]), (10, "right_hand", [-0.5, 1.0, -0.5]), (15, "left_foot", [-0.5, -0.5, 1.0])];

fn number(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 128 {
        bytes.push(value as u8 | 128);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

/// A field of a protobuf message that has bytes.
fn bytes(field: u64, content: &[u8]) -> Vec<u8> {
    [number(field << 3 | 2), number(content.len() as u64), content.to_vec()].concat()
}

/// The same with a number.
fn whole(field: u64, value: u64) -> Vec<u8> {
    [number(field << 3), number(value)].concat()
}

fn tensor(name: &str, shape: &[u64], numbers: &[f32]) -> Vec<u8> {
    let shape = shape.iter().flat_map(|side| whole(1, *side)).collect();
    let raw: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    [shape, whole(2, 1), bytes(8, name.as_bytes()), bytes(9, &raw)].concat()
}

fn value(name: &str, shape: &[u64]) -> Vec<u8> {
    let sides: Vec<u8> = shape.iter().flat_map(|side| bytes(1, &whole(1, *side))).collect();
    let tensor = [whole(1, 1), bytes(2, &sides)].concat();
    [bytes(1, name.as_bytes()), bytes(2, &bytes(1, &tensor))].concat()
}

/// A model that makes maps of a picture of 192 by 256 pixels: in each, one pixel of 4 by 4 is the mean of a color, weighted.
fn model(points: u64, bias: f32) -> Vec<u8> {
    const MEAN: [f64; 3] = [123.675, 116.28, 103.53];
    const DEVIATION: [f64; 3] = [58.395, 57.12, 57.375];
    let (mut weights, mut biases) = (vec![0.0_f32; points as usize * 48], vec![bias; points as usize]);
    for (point, _, colors) in MARKS.into_iter().filter(|(point, ..)| (*point as u64) < points) {
        for (part, color) in colors.into_iter().enumerate() {
            let weight = (color * DEVIATION[part] / 255.0 / 16.0) as f32;
            weights[(point * 3 + part) * 16..][..16].fill(weight);
            biases[point] += (color * MEAN[part] / 255.0) as f32;
        }
    }
    let four_by_four = |name: &str| {
        let sides = [whole(8, 4), whole(8, 4)].concat();
        bytes(5, &[bytes(1, name.as_bytes()), sides, whole(20, 7)].concat())
    };
    let names = [bytes(1, b"picture"), bytes(1, b"weights"), bytes(1, b"biases"), bytes(2, b"maps")].concat();
    let node = [names, bytes(4, b"Conv"), four_by_four("kernel_shape"), four_by_four("strides")].concat();
    let graph = [
        bytes(1, &node),
        bytes(2, b"marks"),
        bytes(5, &tensor("weights", &[points, 3, 4, 4], &weights)),
        bytes(5, &tensor("biases", &[points], &biases)),
        bytes(11, &value("picture", &[1, 3, 256, 192])),
        bytes(12, &value("maps", &[1, points, 64, 48])),
    ];
    [whole(1, 8), bytes(7, &graph.concat()), bytes(8, &[bytes(1, b""), whole(2, 13)].concat())].concat()
}

/// A figure with marks beyond its left hand, its right hand and its left foot, and where their middles are.
fn marked() -> (Vec<u8>, [[f64; 2]; 3]) {
    let drawn = styles::stick_figure();
    let mut canvas: Canvas = drawn.canvas;
    let place = |name: &str| drawn.joints.iter().find(|(joint, _)| *joint == name).expect("a joint").1;
    let colors = [[250, 20, 20, 255], [20, 250, 20, 255], [20, 20, 250, 255]];
    let mut places = [[0.0; 2]; 3];
    for (index, (_, name, _)) in MARKS.into_iter().enumerate() {
        let [x, y] = place(name);
        let [dx, dy] = [[0.0, -8.0], [0.0, 8.0], [7.0, 0.0]][index];
        places[index] = [x + dx, y + dy];
        canvas.blob(places[index], [12.0, 12.0], colors[index]);
    }
    (png(&styles::Drawn { canvas, ..drawn }), places)
}

/// Files of a test: the picture, and models of which only the first is well.
fn written(folder: &Path) -> [[f64; 2]; 3] {
    let (picture, places) = marked();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("written");
    write("figure.png", &picture);
    write("marks.onnx", &model(17, 0.0));
    write("five.onnx", &model(5, 0.0));
    write("broken.onnx", &model(17, f32::NAN));
    write("text.onnx", b"this is no model");
    places
}

/// That marked joints are where the marks are, sure, and the others as they are found without a model.
#[cfg(feature = "pose-model")]
fn check(view: &serde_json::Value, without: &serde_json::Value, places: [[f64; 2]; 3]) {
    assert_eq!(view["joints_by_model"], 3, "{view}");
    let of = |view: &serde_json::Value, name: &str| {
        let joints = view["skeleton"].as_array().expect("joints");
        joints.iter().find(|joint| joint["name"] == name).expect("a joint").clone()
    };
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let height = number(&view["box"]["bottom"]) - number(&view["box"]["top"]);
    for ((_, name, _), place) in MARKS.into_iter().zip(places) {
        let joint = of(view, name);
        let at = [("left", 0), ("top", 1)]
            .map(|(side, axis)| number(&joint["loc"][axis]) / number(&view["scale"]) + number(&view["box"][side]));
        let off = (at[0] - place[0]).hypot(at[1] - place[1]);
        assert!(off < 0.025 * height, "{name} at {at:?}, marked at {place:?}");
        assert!(number(&joint["confidence"]) > 0.5, "{joint}");
    }
    for name in ["neck", "left_elbow", "right_knee", "right_foot"] {
        assert_eq!(of(view, name), of(without, name));
    }
}

#[cfg(feature = "pose-model")]
fn annotated(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    let output = run(folder, &[&["annotate", "figure.png", "--json"], arguments].concat());
    assert!(output.status.success(), "{}", said(&output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
#[cfg(not(feature = "pose-model"))]
fn a_build_without_models_says_how_to_get_one_that_has_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    written(folder.path());
    let output = run(folder.path(), &["annotate", "figure.png", "--json", "--pose-model", "marks.onnx"]);
    assert_eq!(output.status.code(), Some(3), "{}", said(&output));
    assert!(said(&output).contains("--features pose-model"), "{}", said(&output));
    let service = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["serve", "--listen", "127.0.0.1:0", "--data", "data", "--pose-model", "marks.onnx"])
        .current_dir(folder.path())
        .output()
        .expect("it starts");
    assert!(!service.status.success() && said(&service).contains("--features pose-model"), "{}", said(&service));
}

#[test]
#[cfg(feature = "pose-model")]
fn a_pose_model_finds_joints_from_the_command_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let places = written(folder.path());
    let without = annotated(folder.path(), &[]);
    assert!(without.get("joints_by_model").is_none(), "{without}");
    check(&annotated(folder.path(), &["--pose-model", "marks.onnx"]), &without, places);
    for (model, told) in [
        ("text.onnx", "no ONNX file"),
        ("five.onnx", "[1, 5, 64, 48]"),
        ("broken.onnx", "numbers that are none"),
        ("absent.onnx", "cannot be read"),
    ] {
        let output = run(folder.path(), &["annotate", "figure.png", "--json", "--pose-model", model]);
        assert_eq!(output.status.code(), Some(3), "{model}: {}", said(&output));
        let said = said(&output);
        assert!(said.contains(told) && said.contains(model) && said.contains("hint: "), "{said}");
    }
}

#[tokio::test]
#[cfg(feature = "pose-model")]
async fn a_pose_model_finds_joints_over_http() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let places = written(folder.path());
    let without = annotated(folder.path(), &[]);
    let serve = |model: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
        command.args(["serve", "--listen", "127.0.0.1:0", "--data", "data", "--pose-model", model]);
        command.current_dir(folder.path());
        command
    };
    let refused = serve("five.onnx").output().expect("it starts");
    assert!(!refused.status.success() && said(&refused).contains("five.onnx"), "{}", said(&refused));
    let service = crate::service_process::ServiceProcess::listening(&mut serve("marks.onnx"));
    let image = reqwest::multipart::Part::bytes(std::fs::read(folder.path().join("figure.png")).expect("there"));
    let form = reqwest::multipart::Form::new().part("image", image.file_name("figure.png"));
    let client = reqwest::Client::builder().timeout(std::time::Duration::from_secs(60)).build().expect("a client");
    let request = client.post(format!("{}/v1/drawing-annotations", service.url));
    let answer = request.header("accept", "application/json").multipart(form).send().await.expect("an answer");
    let text = answer.text().await.expect("a body");
    check(&serde_json::from_str(&text).expect("JSON"), &without, places);
}
