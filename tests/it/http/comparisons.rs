//! `POST /v1/comparisons`, on the binary with the real engine.

use reqwest::{Client, Response};
use retargetd::samples;
use serde_json::{Value, json};

use super::support::{PATIENCE, ServiceProcess, json as read, problem, start_service, taken};

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

async fn result_of(server: &ServiceProcess, body: &Value) -> String {
    let job = client().post(format!("{}/v1/jobs", server.url)).header("prefer", "wait=60").json(body).send().await;
    let job = read(job.expect("an answer")).await;
    job["results"][0]["id"].as_str().unwrap_or_else(|| panic!("a result: {job}")).to_owned()
}

async fn compare(server: &ServiceProcess, first: &str, second: &str) -> Response {
    let body = json!({"first": {"result": first}, "second": {"result": second}});
    client().post(format!("{}/v1/comparisons", server.url)).json(&body).send().await.expect("an answer")
}

#[tokio::test(flavor = "multi_thread")]
async fn two_results_are_measured_against_each_other() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let mut assets = Vec::new();
    for (name, bytes) in [("walk.glb", samples::walk_clip()), ("mannequin.glb", samples::mannequin())] {
        let request = client().post(format!("{}/v1/assets?filename={name}", server.url)).body(bytes);
        assets.push(taken(request.send().await.expect("an answer")).await);
    }
    let ask = |config: Value| json!({"source": {"asset": assets[0]}, "target": {"asset": assets[1]}, "output": ["glb"], "config": config});
    let good = result_of(&server, &ask(json!({}))).await;
    let bad = result_of(&server, &ask(json!({"ops": [{"op": "pelvis"}, {"op": "fk", "rotation_alpha": 0.2}]}))).await;

    let answer = read(compare(&server, &bad, &good).await).await;
    assert_eq!((&answer["better"], &answer["second"]["result"]), (&json!("second"), &json!(good)), "{answer}");
    let direction = answer["metrics"].as_array().expect("metrics").iter().find(|of| of["name"] == "limb_direction");
    let direction = direction.unwrap_or_else(|| panic!("the metric: {answer}"));
    assert_eq!((&direction["better"], &direction["unit"]), (&json!("second"), &json!("degrees")), "{direction}");
    let (first, second) =
        (direction["first"].as_f64().expect("a value"), direction["second"].as_f64().expect("a value"));
    assert!((direction["difference"].as_f64().expect("a value") - (second - first)).abs() < 1e-9, "{direction}");
    let same = read(compare(&server, &good, &good).await).await;
    assert_eq!(same["better"], "neither", "as good as itself");

    let unmeasured = result_of(&server, &ask(json!({"report": "none"}))).await;
    let refused = problem(compare(&server, &good, &unmeasured).await, 422, "invalid_value").await;
    assert_eq!(refused["errors"][0]["pointer"], "/second/result", "which: {refused}");
    problem(compare(&server, "job_1", &good).await, 422, "invalid_value").await;
    problem(compare(&server, "res_01j9z3k8m0q4r6t8v0x2y4a6c8", &good).await, 404, "not_found").await;
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}
