//! Mapping suggestions and config checks, with the real engine.

use reqwest::{Client, Response, StatusCode, multipart};
use retargetd::samples;
use serde_json::{Value, json};

use super::support::{PATIENCE, ServiceProcess, json as read, problem, start_service, taken};

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

async fn upload(server: &ServiceProcess, name: &str, bytes: Vec<u8>) -> String {
    let url = format!("{}/v1/assets?filename={name}", server.url);
    let answer = client().post(url).body(bytes).send().await.expect("an answer");
    taken(answer).await
}

async fn post(server: &ServiceProcess, path: &str, body: &Value) -> Response {
    client().post(format!("{}{path}", server.url)).json(body).send().await.expect("an answer")
}

fn form(config: Option<&'static str>) -> multipart::Form {
    let part = |bytes: Vec<u8>, name: &'static str| multipart::Part::bytes(bytes).file_name(name);
    let form = multipart::Form::new()
        .part("source", part(samples::walk_clip(), "walk.glb"))
        .part("target", part(samples::mannequin(), "mannequin.glb"));
    match config {
        Some(config) => form.part("config", part(config.into(), "config.json")),
        None => form,
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_suggestion_is_a_config_that_gives_the_same() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let source = upload(&server, "walk.glb", samples::walk_clip()).await;
    let target = upload(&server, "mannequin.glb", samples::mannequin()).await;
    let files = json!({"source": {"asset": source}, "target": {"asset": target}});
    let answer = post(&server, "/v1/mapping-suggestions", &files).await;
    assert_eq!(answer.status(), StatusCode::OK, "it can be mapped");
    let suggestion = read(answer).await;
    assert_eq!(suggestion["inputs"]["source"]["asset"], source.as_str(), "of which files");
    assert!(suggestion["counts"]["driven_joints"].as_u64() > Some(20), "{}", suggestion["counts"]);
    let by_form = client().post(format!("{}/v1/mapping-suggestions", server.url)).multipart(form(None));
    let by_form = read(by_form.send().await.expect("an answer")).await;
    assert_eq!(by_form, suggestion, "a form says the same, and the same bytes are the same assets");

    let mut digests = Vec::new();
    for config in [json!({}), suggestion["resolved_spec"].clone()] {
        let mut job = files.clone();
        job["config"] = config;
        let request = client().post(format!("{}/v1/jobs", server.url)).json(&job).header("prefer", "wait=30");
        let job = read(request.send().await.expect("an answer")).await;
        assert_eq!(job["state"], "succeeded", "{job}");
        digests.push(job["results"][0]["sha256"].clone());
    }
    assert_eq!(digests[0], digests[1], "the same bytes");
}

#[tokio::test(flavor = "multi_thread")]
async fn configs_are_checked_with_files_and_without() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let alone = post(&server, "/v1/config-checks", &json!({"config": {"align": "off"}})).await;
    assert_eq!(alone.status(), StatusCode::OK, "it can be read");
    assert_eq!(read(alone).await["spec"]["align"], "off", "as it is understood");
    let wrong = json!({"config": {"algn": "off", "ops": [{"op": "fkk"}]}});
    let wrong = problem(post(&server, "/v1/config-checks", &wrong).await, 422, "unknown_field").await;
    assert_eq!(wrong["errors"][0]["did_you_mean"], json!(["align"]), "the nearest name: {wrong}");
    assert_eq!(wrong["errors"][1]["pointer"], "/config/ops/0/op", "all at once: {wrong}");
    let half = json!({"config": {}, "source": {"asset": "ast_00000000000000000000000000"}});
    problem(post(&server, "/v1/config-checks", &half).await, 422, "missing_part").await;
    let gone = json!({"config": {}, "source": {"asset": "ast_00000000000000000000000000"},
        "target": {"asset": "ast_00000000000000000000000000"}});
    problem(post(&server, "/v1/config-checks", &gone).await, 422, "unknown_asset").await;

    let check = |config| client().post(format!("{}/v1/config-checks", server.url)).multipart(form(Some(config))).send();
    let fits = read(check(r#"{"ops": [{"op": "fk", "mask": ["left_arm"]}]}"#).await.expect("an answer")).await;
    let driven = fits["joints"].as_array().expect("a list").iter().filter(|joint| joint["driver"] == "chain").count();
    assert_eq!(driven, 3, "upper arm, forearm, hand");
    let misses = check(r#"{"source": {"root": "mixamorig:Hip"}}"#).await.expect("an answer");
    let misses = problem(misses, 422, "unknown_joint").await;
    assert_eq!(misses["errors"][0]["did_you_mean"][0], "mixamorig:Hips", "the nearest joint: {misses}");
    let alone = multipart::Form::new().part("config", multipart::Part::text("{}").file_name("config.json"));
    let alone = client().post(format!("{}/v1/config-checks", server.url)).multipart(alone).send();
    assert_eq!(alone.await.expect("an answer").status(), StatusCode::OK, "a form with a config alone");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_suggestion_tells_what_is_left_between_the_rest_poses_and_what_later_ops_change() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let config = r#"{"align": "off", "ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "ik", "mask": ["left_leg"]}]}"#;
    let url = format!("{}/v1/mapping-suggestions", server.url);
    let answer = client().post(&url).multipart(form(Some(config))).send().await.expect("an answer");
    let suggestion = read(answer).await;
    let ops = |joint: &str| {
        let joints = suggestion["joints"].as_array().expect("joints");
        joints.iter().find(|view| view["joint"] == joint).map(|view| view["ops"].clone())
    };
    for joint in ["thigh_l", "calf_l", "foot_l"] {
        assert_eq!(ops(joint), Some(json!(["ik"])), "{joint} is turned by it");
    }
    assert_eq!(ops("thigh_r"), Some(Value::Null), "the other leg is not");
    let degrees = |suggestion: &Value, role: &str| {
        let joints = suggestion["alignment"].as_array().expect("an alignment");
        let joint = joints.iter().find(|joint| joint["role"] == role).expect("the role");
        joint["direction_degrees"].as_f64().expect("a direction")
    };
    let apart = degrees(&suggestion, "left_upper_arm");
    assert!((apart - 45.0).abs() < 3.0, "an arm at the side of a T against one of an A: {apart}");
    let answer = client().post(&url).multipart(form(None)).send().await.expect("an answer");
    let aligned = degrees(&read(answer).await, "left_upper_arm");
    assert!(aligned < 0.1, "aligned: {aligned}");
}
