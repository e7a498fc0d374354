//! `POST /v1/drawings`, drawings as targets of jobs and batches, and what is refused, on the binary with the real engine.

use reqwest::{Client, Response, StatusCode, multipart::Form, multipart::Part};
use retargetd::{
    formats::{Limits, unpack_files},
    model::Control,
    samples,
};
use serde_json::{Value, json};

use super::support::{PATIENCE, ServiceProcess, header, json as read, problem, start_service, taken};

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

/// A config that makes little work.
fn small(more: Value) -> Vec<u8> {
    let mut config = json!({
        "task": "draw", "edit": {"range": {"frames": [0, 5]}}, "view": {"size": [80, 80]},
    });
    for (name, value) in more.as_object().expect("an object") {
        config[name] = value.clone();
    }
    config.to_string().into_bytes()
}

async fn draw(server: &ServiceProcess, parts: &[(&'static str, Vec<u8>)], accept: &str) -> Response {
    let form = parts.iter().fold(Form::new(), |form, (name, bytes)| {
        let ending = match *name {
            "source" => "glb",
            "drawing" => "zip",
            "texture" | "mask" | "background" => "png",
            _ => "yaml",
        };
        form.part(*name, Part::bytes(bytes.clone()).file_name(format!("{name}.{ending}")))
    });
    let request = client().post(format!("{}/v1/drawings", server.url)).multipart(form);
    request.header("accept", accept).header("prefer", "wait=60").send().await.expect("an answer")
}

async fn upload(server: &ServiceProcess, name: &str, bytes: Vec<u8>) -> String {
    let request = client().post(format!("{}/v1/assets?filename={name}", server.url)).body(bytes);
    taken(request.send().await.expect("an asset")).await
}

/// The files of the sample drawing.
fn files() -> Vec<(String, Vec<u8>)> {
    unpack_files(&samples::drawing(), &["yaml", "png"], &Limits::default(), &Control::new()).expect("its files")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drawing_moves_in_every_format() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let (source, drawing) = (("source", samples::walk_clip()), ("drawing", samples::drawing()));
    let config = ("config", small(json!({})));
    let wanted: [(&str, &str, &[u8]); 7] = [
        ("*/*", "image/gif", b"GIF89a"),
        ("image/webp", "image/webp", b"RIFF"),
        ("image/apng", "image/apng", b"\x89PNG"),
        ("application/zip", "application/zip", b"PK"),
        ("model/gltf-binary", "model/gltf-binary", b"glTF"),
        ("application/x-npz", "application/x-npz", b"PK"),
        ("application/json", "application/json", b"{"),
    ];
    for (accept, media_type, begins) in wanted {
        let answer = draw(&server, &[source.clone(), drawing.clone(), config.clone()], accept).await;
        assert_eq!(answer.status(), StatusCode::OK, "{accept}");
        assert_eq!(header(&answer, "content-type"), media_type, "{accept}");
        assert!(matches!(header(&answer, "retarget-verdict"), "pass" | "warn" | "fail" | ""), "its verdict");
        let job = header(&answer, "job-id").to_owned();
        assert!(answer.bytes().await.expect("a file").starts_with(begins), "{accept}");
        let job = read(client().get(format!("{}/v1/jobs/{job}", server.url)).send().await.expect("a job")).await;
        assert_eq!(job["kind"], "draw", "{job}");
        assert!(matches!(job["verdict"].as_str(), Some("pass" | "warn")), "{job}");
    }
    // The three files by themselves, and the poses that come out of both ways are the same.
    let answer = draw(&server, &[source.clone(), drawing, config.clone()], "application/json").await;
    let whole = read(answer).await;
    let part = |name: &str| files().into_iter().find(|(own, _)| own.ends_with(name)).expect("a file").1;
    let parts = [
        source,
        ("character", part("char_cfg.yaml")),
        ("texture", part("texture.png")),
        ("mask", part("mask.png")),
        config,
    ];
    let apart = read(draw(&server, &parts, "application/json").await).await;
    assert_eq!(apart["rig_joint_xy"], whole["rig_joint_xy"], "however its files come");
    assert_eq!(whole["rig_joint_xy"].as_array().map(Vec::len), Some(6), "as many frames as were asked for");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drawing_is_an_asset_and_a_target_of_jobs_and_batches() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let (walk, drawing) = (
        upload(&server, "walk.glb", samples::walk_clip()).await,
        upload(&server, "child.zip", samples::drawing()).await,
    );
    let asset = read(client().get(format!("{}/v1/assets/{drawing}", server.url)).send().await.expect("an asset")).await;
    assert_eq!(asset["format"], "drawing", "{asset}");
    let skeleton = client().get(format!("{}/v1/assets/{drawing}/skeleton", server.url)).send().await.expect("joints");
    let skeleton = read(skeleton).await;
    assert_eq!(skeleton["rigs"][0]["joints"].as_array().map(Vec::len), Some(16), "{skeleton}");
    let picture = client().get(format!("{}/v1/assets/{drawing}/preview.png?size=64", server.url)).send().await;
    let picture = picture.expect("a picture");
    assert_eq!(picture.status(), StatusCode::OK, "what it looks like");
    assert!(picture.bytes().await.expect("a file").starts_with(b"\x89PNG"), "a still");

    let preset = json!({"task": "draw", "view": {"size": [64, 64]}});
    let kept = client().put(format!("{}/v1/presets/small_drawing", server.url)).json(&preset).send().await;
    assert!(kept.expect("a preset").status().is_success(), "a draw spec can be kept");
    let body = json!({
        "source": {"asset": walk}, "target": {"asset": drawing}, "output": ["gif", "glb", "poses2d_json"],
        "preset": "small_drawing", "config": {"edit": {"range": {"frames": [0, 3]}}},
    });
    let asked = client().post(format!("{}/v1/jobs", server.url)).header("prefer", "wait=60").json(&body).send().await;
    let job = read(asked.expect("a job")).await;
    assert_eq!((&job["state"], &job["kind"]), (&json!("succeeded"), &json!("draw")), "{job}");
    let formats: Vec<&Value> = job["results"].as_array().expect("results").iter().map(|one| &one["format"]).collect();
    assert_eq!(formats, [&json!("gif"), &json!("glb"), &json!("poses2d_json")]);
    let thumbnail = job["thumbnail"].as_str().expect("a thumbnail");
    let picture = client().get(format!("{}{thumbnail}", server.url)).send().await.expect("a picture");
    assert_eq!(picture.status(), StatusCode::OK, "what came out, small");
    let report = format!("{}/v1/jobs/{}/report", server.url, job["id"].as_str().expect("an id"));
    let report = read(client().get(report).send().await.expect("a report")).await;
    assert!(report["drawing"]["characters"][0]["measures"]["turned_over_percent"]["value"].is_number(), "{report}");

    let batch = json!({
        "matrix": {"sources": [{"asset": walk}], "targets": [{"asset": drawing}, {"asset": drawing, "labels": {"n": "2"}}]},
        "defaults": {"config": {"task": "draw", "edit": {"range": {"frames": [0, 2]}}, "view": {"size": [48, 48]}}},
    });
    let asked = client().post(format!("{}/v1/batches", server.url)).json(&batch).send().await.expect("a batch");
    let id = taken(asked).await;
    let state =
        async || read(client().get(format!("{}/v1/batches/{id}", server.url)).send().await.expect("a batch")).await;
    let mut batch = state().await;
    for _ in 0..300 {
        if batch["counts"]["succeeded"] == 2 || batch["counts"]["failed"].as_u64().unwrap_or(0) > 0 {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
        batch = state().await;
    }
    assert_eq!(batch["counts"]["succeeded"], 2, "clips onto drawings: {batch}");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

/// The picture of the sample drawing, cut out: what somebody draws and sends.
fn picture_alone() -> Vec<u8> {
    let part = |name: &str| files().into_iter().find(|(own, _)| own.ends_with(name)).expect("a file").1;
    let mut texture = retargetd::picture::read_picture(&part("texture.png")).expect("a texture");
    let mask = retargetd::picture::read_picture(&part("mask.png")).expect("a mask");
    for (pixel, mask) in texture.pixels.iter_mut().zip(&mask.pixels) {
        if mask[0] < 128 {
            pixel[3] = 0;
        }
    }
    retargetd::picture::write_png(&texture).expect("a picture")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_alone_moves_on_every_route() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let picture = picture_alone();
    let parts = [("source", samples::walk_clip()), ("drawing", picture.clone()), ("config", small(json!({})))];
    let answer = draw(&server, &parts, "image/gif").await;
    assert_eq!(answer.status(), StatusCode::OK);
    assert!(answer.bytes().await.expect("a file").starts_with(b"GIF89a"));

    let walk = upload(&server, "walk.glb", samples::walk_clip()).await;
    let drawing = upload(&server, "hero.png", picture).await;
    let asset = format!("{}/v1/assets/{drawing}", server.url);
    assert_eq!(read(client().get(&asset).send().await.expect("an asset")).await["format"], "drawing");
    let skeleton = read(client().get(format!("{asset}/skeleton")).send().await.expect("joints")).await;
    assert_eq!(skeleton["drawing"]["annotated"], "humanoid", "{skeleton}");
    assert_eq!(skeleton["rigs"][0]["joints"].as_array().map(Vec::len), Some(16), "{skeleton}");
    let shown = client().get(format!("{asset}/preview.png?size=64")).send().await.expect("a picture");
    assert_eq!(shown.status(), StatusCode::OK, "what it looks like");
    let content = client().get(format!("{asset}/content")).send().await.expect("the bytes");
    assert_eq!(header(&content, "content-type"), "image/png");

    let config = json!({"task": "draw", "edit": {"range": {"frames": [0, 2]}}, "view": {"size": [48, 48]}});
    let body = json!({"source": {"asset": walk}, "target": {"asset": drawing}, "config": config, "output": ["webp"]});
    let asked = client().post(format!("{}/v1/jobs", server.url)).header("prefer", "wait=60").json(&body).send().await;
    let job = read(asked.expect("a job")).await;
    assert_eq!((&job["state"], &job["kind"]), (&json!("succeeded"), &json!("draw")), "{job}");
    let batch = json!({
        "matrix": {"sources": [{"asset": walk}], "targets": [{"asset": drawing}]}, "defaults": {"config": config},
    });
    let asked = client().post(format!("{}/v1/batches", server.url)).json(&batch).send().await.expect("a batch");
    let id = taken(asked).await;
    let mut batch = json!(null);
    for _ in 0..300 {
        batch = read(client().get(format!("{}/v1/batches/{id}", server.url)).send().await.expect("a batch")).await;
        if batch["counts"]["succeeded"] == 1 || batch["counts"]["failed"] == 1 {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    }
    assert_eq!(batch["counts"]["succeeded"], 1, "{batch}");

    let blank = retargetd::picture::write_png(&retargetd::picture::Picture::filled(90, 90, [255; 4]));
    let parts = [("source", samples::walk_clip()), ("drawing", blank.expect("a picture"))];
    problem(draw(&server, &parts, "image/gif").await, 422, "figure_not_found").await;
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_wrong_with_a_drawing_is_told_with_its_place() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let source = ("source", samples::walk_clip());
    let with = |changed: &'static str, bytes: Vec<u8>| {
        let part = |name: &'static str, file: &str| {
            let own = files().into_iter().find(|(own, _)| own.ends_with(file)).expect("a file").1;
            (name, if name == changed { bytes.clone() } else { own })
        };
        [part("character", "char_cfg.yaml"), part("texture", "texture.png"), part("mask", "mask.png")]
    };
    let character = String::from_utf8(files()[0].1.clone()).expect("text");
    // Each line has the one before nine times.
    let nine = |name: &str| [name; 9].join(", ");
    let bomb = (1..14).fold(format!("l0: &l0 [{}]\n", nine("x")), |text, line| {
        format!("{text}l{line}: &l{line} [{}]\n", nine(&format!("*l{}", line - 1)))
    });
    let many: String = (0..3000).map(|n| format!("- {{loc: [1, 1], name: j{n}, parent: root}}\n")).collect::<String>();
    let cases: [(&str, Vec<u8>, &str); 9] = [
        ("character", character.replace("name: neck", &format!("name: {}", "n".repeat(5000))).into_bytes(), "skeleton"),
        ("character", character.replace("name: neck", "name: ''").into_bytes(), "skeleton"),
        ("character", character.replace("parent: torso", "parent: tors").into_bytes(), "skeleton"),
        ("character", character.replace("name: root", "name: rot").into_bytes(), "skeleton"),
        ("character", character.replace("width: 360", "width: 361").into_bytes(), "width, height"),
        ("character", bomb.into_bytes(), "char_cfg.yaml"),
        ("character", (character.clone() + &many).into_bytes(), "skeleton"),
        ("texture", b"no picture".to_vec(), "texture.png"),
        (
            "mask",
            files().into_iter().find(|(name, _)| name.ends_with("texture.png")).expect("it").1[..900].to_vec(),
            "mask.png",
        ),
    ];
    for (part, bytes, place) in cases {
        let [one, two, three] = with(part, bytes);
        let answer = draw(&server, &[source.clone(), one, two, three], "image/gif").await;
        assert_eq!(answer.status(), StatusCode::UNPROCESSABLE_ENTITY, "{part} at {place}");
        let told = read(answer).await;
        assert!(told["detail"].as_str().unwrap_or_default().contains(place), "{place} in {told}");
    }
    let drawing = ("drawing", samples::drawing());
    problem(draw(&server, std::slice::from_ref(&source), "*/*").await, 422, "missing_part").await;
    problem(draw(&server, std::slice::from_ref(&drawing), "*/*").await, 422, "missing_part").await;
    problem(draw(&server, &[source.clone(), drawing.clone(), ("mask", vec![1])], "*/*").await, 422, "unknown_part")
        .await;
    problem(draw(&server, &[source.clone(), ("texture", vec![1])], "*/*").await, 422, "missing_part").await;
    let config = ("config", br#"{"task": "draw", "project": {"dampin": 1}}"#.to_vec());
    let told =
        problem(draw(&server, &[source.clone(), drawing.clone(), config], "*/*").await, 422, "unknown_field").await;
    assert_eq!(told["errors"][0]["pointer"], "/project/dampin", "{told}");
    let large = ("config", br#"{"task": "draw", "view": {"size": [4000, 4000]}}"#.to_vec());
    let told = problem(draw(&server, &[source, drawing, large], "*/*").await, 422, "invalid_value").await;
    assert_eq!(told["errors"][0]["pointer"], "/view/size", "{told}");
    let limits = read(client().get(format!("{}/v1/limits", server.url)).send().await.expect("limits")).await;
    let names: Vec<&str> =
        limits["limits"].as_array().expect("a list").iter().filter_map(|one| one["name"].as_str()).collect();
    for name in ["drawing_pixels", "drawing_joints", "video_frames", "video_pixels"] {
        assert!(names.contains(&name), "{name} is told");
    }
    let schema =
        read(client().get(format!("{}/v1/schemas/draw-spec", server.url)).send().await.expect("a schema")).await;
    assert!(schema["properties"]["project"].is_object(), "{schema}");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}
