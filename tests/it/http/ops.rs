//! The ops of a config over HTTP, with the real engine.

use reqwest::{Client, StatusCode, multipart};
use retargetd::samples;
use serde_json::{Value, json};

use super::support::{PATIENCE, ServiceProcess, json as read, problem, start_service};
use crate::cli::carried_curves::{values_of, with_a_property};

async fn post(server: &ServiceProcess, config: &Value) -> reqwest::Response {
    let files = [(samples::walk_clip(), "walk.glb"), (samples::mannequin(), "mannequin.glb")];
    post_files(server, files, config).await
}

/// Source and target.
async fn post_files(server: &ServiceProcess, files: [(Vec<u8>, &'static str); 2], config: &Value) -> reqwest::Response {
    let [source, target] = files.map(|(bytes, name)| multipart::Part::bytes(bytes).file_name(name));
    let form = multipart::Form::new().part("source", source).part("target", target).text("config", config.to_string());
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    let request = client.post(format!("{}/v1/retarget", server.url)).multipart(form);
    request.header("prefer", "wait=50").send().await.expect("an answer")
}

#[tokio::test(flavor = "multi_thread")]
async fn every_op_can_be_asked_for() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let config = json!({
        "output": {"format": "poses_json"},
        "ops": [
            {"op": "scale_source", "factor": 1.1},
            {"op": "pelvis", "scale": "limbs", "turn_offset": [0, 5, 0], "floor_constraint": 0.5, "alpha": [[0, 0.5], [1, 1]]},
            {"op": "fk", "rotation": "auto", "align_pole": 0.5, "alpha": [[0, 0.5], [1, 1]]},
            {"op": "contacts"},
            {"op": "ik"},
            {"op": "stride", "forward": 0.9},
            {"op": "plant"},
            {"op": "props", "grips": [{"within": 0.2}]},
            {"op": "joints", "rows": [{"source": "head", "target": "head", "rotation_gain": 0.5}]},
            {"op": "reach", "goals": [{"end": "left_hand", "depth": 6, "weight": 0.2}]},
            {"op": "arm_clearance", "depth": 0.02, "max_degrees": 20, "mask": ["left_arm"]},
            {"op": "hand_contact", "reach": 0.2, "mask": ["left_arm", "right_arm"]},
            {"op": "arm_spacing", "degrees": 4},
            {"op": "fingers", "curl": 0.5},
            {"op": "additive_pose", "degrees": {"neck": [0, 0, 3]}},
            {"op": "stretch_chain", "mask": ["left_arm"], "scale": 1.02},
            {"op": "pin", "pins": [{"joint": "upperarm_twist_01_l", "to": "upperarm_l", "position": false}]},
            {"op": "twist"},
            {"op": "limits"},
            {"op": "filter"},
            {"op": "root_motion"}
        ]
    });
    let answer = post(&server, &config).await;
    assert_eq!(answer.status(), StatusCode::OK, "{}", answer.text().await.unwrap_or_default());
    let poses = read(answer).await;
    let frames = poses["times"].as_array().expect("times").len();
    let finite = |value: &Value| value.as_array().expect("a list").iter().all(|value| value.as_f64().is_some());
    for channel in ["translations", "rotations"] {
        let rows = poses[channel].as_array().expect("frames");
        let all = rows.iter().flat_map(|row| row.as_array().expect("joints"));
        assert!(
            rows.len() == frames && all.clone().count() > 0 && all.into_iter().all(finite),
            "{channel} are numbers"
        );
    }
    let joints: Vec<&str> =
        poses["contact_joints"].as_array().expect("names").iter().filter_map(Value::as_str).collect();
    assert!(joints.contains(&"foot_l") && joints.contains(&"ball_r"), "what touches: {joints:?}");
    let contacts = poses["contacts"].as_array().expect("frames");
    assert_eq!(contacts.len(), frames, "one row for each frame");
    let left = joints.iter().position(|joint| *joint == "foot_l").expect("it is there");
    let touching = contacts.iter().filter(|row| row[left].as_bool().expect("true or false")).count();
    assert!((20..100).contains(&touching), "a walk's foot stands about half of the time: {touching} of {frames}");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_an_op_names_must_exist() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let config = json!({"ops": [{"op": "joints", "rows": [{"source": "hed", "target": "head"}]}]});
    let refused = problem(post(&server, &config).await, 422, "unknown_joint").await;
    assert_eq!(refused["errors"][0]["pointer"], "/ops/0/rows/0/source", "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn custom_properties_go_along() {
    let Some(file) = with_a_property() else { return };
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let config = |row: Value| json!({"output": {"format": "poses_json"}, "ops": [{"op": "fk"}, {"op": "curves", "rows": [row]}]});
    let files = || [(file.clone().into_bytes(), "source.fbx"), (file.clone().into_bytes(), "target.fbx")];
    let answer = post_files(&server, files(), &config(json!({"source": "grip", "target": "hold", "gain": 10}))).await;
    assert_eq!(answer.status(), StatusCode::OK, "{}", answer.text().await.unwrap_or_default());
    let hold = values_of(&read(answer).await, "hold").expect("the curve");
    assert!((hold[19] - 19.0).abs() < 1e-4, "ten times as much: {hold:?}");
    let refused = post_files(&server, files(), &config(json!({"source": "gripp"}))).await;
    let refused = problem(refused, 422, "unknown_name").await;
    assert_eq!(refused["errors"][0]["pointer"], "/ops/1/rows/0/source", "{refused}");
}
