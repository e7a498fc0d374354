//! What the service says of itself, and the bytes that it gives back.

use retargetd::{
    config::Settings,
    engine::{FindingCode, Format, drawing_limits, template_schema},
    retarget::spec_schema,
};
use serde_json::json;

use super::support::{BVH, Service, header, json, problem};

#[tokio::test]
async fn a_full_store_names_its_limit() {
    let service = Service::start(&[("max_stored_bytes", "30")]).await;
    service.upload(BVH).await;
    let path = service.at("/v1/assets?filename=more.bvh");
    let answer = service.client.post(path).body(format!("{BVH}more")).send().await.expect("an answer");
    let refused = problem(answer, 507, "storage_full").await;
    assert_eq!((&refused["limit"], &refused["maximum"]), (&json!("stored_bytes"), &json!(30)), "{refused}");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn version_limits_formats_and_schema_are_those_of_the_code() {
    let service = Service::start(&[("max_file_bytes", "12345")]).await;
    let version = json(service.get("/version").await).await;
    assert_eq!(version, json!({"name": "retargetd", "version": env!("CARGO_PKG_VERSION")}), "what runs");

    let limits = json(service.get("/v1/limits").await).await;
    let limits = limits["limits"].as_array().expect("a list");
    let settings = Settings::TABLE.iter().filter(|setting| setting.is_limit).count();
    // Those of drawings, and of a picture that is sent by itself, cannot be set.
    assert_eq!(limits.len(), settings + drawing_limits().len() + 1, "every limit");
    let file = limits.iter().find(|limit| limit["name"] == "file_bytes").expect("one on files");
    assert_eq!((&file["value"], &file["unit"]), (&json!(12345), &json!("bytes")), "as it was set");

    let formats = json(service.get("/v1/formats").await).await;
    let names: Vec<&str> =
        formats["formats"].as_array().expect("a list").iter().filter_map(|format| format["name"].as_str()).collect();
    assert_eq!(names, Format::ALL.map(|format| format.info().name), "every format");

    let schema = json(service.get("/v1/schemas/retarget-spec").await).await;
    assert_eq!(&schema, spec_schema(), "the schema that configs are read by");
    let schema = json(service.get("/v1/schemas/rig-template").await).await;
    assert_eq!(&schema, template_schema(), "the schema that rig templates are read by");
    let findings = json(service.get("/v1/findings").await).await;
    let codes: Vec<&str> = findings["findings"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|finding| finding["code"].as_str())
        .collect();
    let known: Vec<&str> = FindingCode::ALL.iter().map(|code| code.name()).collect();
    assert_eq!(codes, known, "every finding");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_are_text_that_prometheus_reads() {
    let service = Service::start(&[]).await;
    service.get("/livez").await;
    let answer = service.get("/metrics").await;
    assert!(header(&answer, "content-type").starts_with("text/plain"), "the type that Prometheus expects");
    let text = answer.text().await.expect("text");
    let samples: Vec<&str> = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty()).collect();
    assert!(samples.len() > 3, "there are samples: {text}");
    for sample in samples {
        let value = sample.rsplit(' ').next().and_then(|value| value.parse::<f64>().ok());
        let is_known = ["retargetd_", "process_"].iter().any(|prefix| sample.starts_with(prefix));
        assert!(is_known && value.is_some(), "a name of ours or of every process, and a number: {sample}");
    }
    for name in ["retargetd_jobs_submitted_total 0", "retargetd_engine_processes_lost_total 0", "process_open_fds "] {
        assert!(text.contains(name.split(' ').next().unwrap_or(name)), "'{name}' is there from the start: {text}");
    }
    for pool in ["reads", "writes", "locks", "leases"] {
        let in_use = format!("retargetd_database_connections{{pool=\"{pool}\",state=\"in_use\"}}");
        assert!(text.contains(&in_use), "connections of '{pool}' are counted: {text}");
    }
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn content_comes_back_as_it_was() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let content = service.get(&format!("/v1/assets/{asset}/content")).await;
    assert_eq!(content.text().await.expect("text"), BVH, "the bytes that were uploaded");
    let job = json(service.job(&asset, "nothing").await).await;
    let job = service.until(job["id"].as_str().expect("an id"), "succeeded").await;
    let result = job["results"][0]["id"].as_str().expect("a result");
    let content = service.get(&format!("/v1/results/{result}/content")).await;
    assert_eq!(header(&content, "content-type"), "model/gltf-binary", "the type of a GLB");
    assert_eq!(content.text().await.expect("text"), BVH, "what the engine made of them");
    service.stop().await;
}
