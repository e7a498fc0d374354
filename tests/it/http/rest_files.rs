//! Rest files over HTTP, with the real engine.

use reqwest::{Client, StatusCode, multipart};
use retargetd::samples;

use super::support::{PATIENCE, json as read, start_service};

fn form(rest: Vec<u8>, name: &'static str) -> multipart::Form {
    let part = |bytes: Vec<u8>, name: &'static str| multipart::Part::bytes(bytes).file_name(name);
    multipart::Form::new()
        .part("source", part(samples::walk_clip(), "walk.glb"))
        .part("target", part(samples::mannequin(), "mannequin.glb"))
        .part("target_rest", part(rest, name))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rest_file_is_matched_or_refused() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    let ask = async |rest: Vec<u8>, name| {
        let request = client.post(format!("{}/v1/jobs", server.url)).multipart(form(rest, name));
        request.header("prefer", "wait=30").send().await.expect("an answer")
    };
    let job = read(ask(samples::mannequin(), "mannequin.glb").await).await;
    let report =
        format!("{}{}", server.url, job["links"]["report"].as_str().unwrap_or_else(|| panic!("a report: {job}")));
    let report = read(client.get(report).send().await.expect("an answer")).await;
    let target = &report["rigs"]["target"];
    assert_eq!(target["rest_pose_from"], "upload", "{target}");
    assert!(target["rest_file"]["matched_by_name"].as_u64() > Some(60), "{target}");
    assert_eq!(report["measures"]["metrics"]["rest_residual"]["verdict"], "pass", "{report}");

    let bvh = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n\
               MOTION\nFrames: 1\nFrame Time: 0.03\n0 0 0\n";
    let request = client.post(format!("{}/v1/retarget", server.url)).multipart(form(bvh.into(), "one.bvh"));
    let refused = request.send().await.expect("an answer");
    assert_eq!(refused.status(), StatusCode::UNPROCESSABLE_ENTITY, "it does not fit");
    let problem = read(refused).await;
    assert_eq!(problem["code"], "skeleton_not_found", "{problem}");
    assert!(problem["detail"].as_str().is_some_and(|detail| detail.contains("rest file of the target")), "{problem}");
}
