//! Results that are there already: taken, shown to be, and never somebody else's.

use std::time::Duration;

use retargetd::jobs::Scope;
use serde_json::{Value, json};

use super::support::{BVH, Service, form, header, json as read, taken};

/// Asks for a job on the same files and gives it when it has ended.
async fn ended(service: &Service, key: &str, config: &Value, headers: &[(&str, &str)]) -> Value {
    let upload = service.client.post(service.at("/v1/assets?filename=walk.bvh")).bearer_auth(key).body(BVH);
    let asset = taken(upload.send().await.expect("an answer")).await;
    let body = json!({"source": {"asset": asset}, "target": {"asset": asset}, "config": config});
    let request = service.client.post(service.at("/v1/jobs")).bearer_auth(key).header("prefer", "wait=30").json(&body);
    let request = headers.iter().fold(request, |request, (name, value)| request.header(*name, *value));
    let job = read(request.send().await.expect("an answer")).await;
    assert_eq!(job["state"], "succeeded", "it works: {job}");
    job
}

#[tokio::test(flavor = "multi_thread")]
async fn the_same_again_is_taken_from_what_is_there() {
    let service = Service::start(&[]).await;
    let (config, none) = (json!({"say": "nothing"}), [("x-nothing", "")]);
    let first = ended(&service, "", &config, &none).await;
    assert_eq!((&first["cache"], &first["cached_from"]), (&json!("miss"), &Value::Null), "computed");
    let second = ended(&service, "", &config, &none).await;
    assert_eq!((&second["cache"], &second["cached_from"]), (&json!("hit"), &first["id"]), "taken, and from where");
    let (one, other) = (&first["results"][0], &second["results"][0]);
    assert_eq!((&one["sha256"], &one["file_name"]), (&other["sha256"], &other["file_name"]), "the same file");
    assert_ne!(one["id"], other["id"], "each job has results of its own");
    for document in ["report", "config"] {
        let of = async |job: &Value| {
            service.get(&format!("/v1/jobs/{}/{document}", job["id"].as_str().expect("an id"))).await.text().await
        };
        assert_eq!(of(&first).await.ok(), of(&second).await.ok(), "the same {document}");
    }
    let changed = ended(&service, "", &json!({"say": "something"}), &none).await;
    assert_eq!(changed["cache"], "miss", "another config");
    let fresh = ended(&service, "", &config, &[("cache-control", "no-cache")]).await;
    assert_eq!(fresh["cache"], "miss", "as it was asked for");
    let id = second["id"].as_str().expect("an id");
    let again = read(service.client.post(service.at(&format!("/v1/jobs/{id}/retry"))).send().await.expect("ok")).await;
    let again = service.until(again["id"].as_str().expect("an id"), "succeeded").await;
    assert_eq!(again["cache"], "miss", "who asks again for what is there wants it computed");

    for job in [&first, &fresh, &again] {
        let path = format!("/v1/jobs/{}", job["id"].as_str().expect("an id"));
        service.client.delete(service.at(&path)).send().await.expect("an answer");
    }
    let content = service.get(other["content"].as_str().unwrap_or_else(|| panic!("content: {other}"))).await;
    assert_eq!(content.text().await.expect("text"), BVH, "it stays when those go that it came from");
    let third = ended(&service, "", &config, &none).await;
    assert_eq!(third["cached_from"], second["id"], "and can be taken from there");
    service.clock.advance(Duration::from_secs(25 * 3600));
    assert_eq!(ended(&service, "", &config, &none).await["cache"], "miss", "what has expired is not taken");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_shots_say_so_in_a_header() {
    let service = Service::start(&[]).await;
    let ask = async || {
        let request =
            service.client.post(service.at("/v1/retarget")).multipart(form(&[("source", BVH), ("target", BVH)]));
        request.send().await.expect("an answer")
    };
    let (first, second) = (ask().await, ask().await);
    assert_eq!(header(&first, "cache-status"), "retargetd; fwd=miss", "computed");
    assert_eq!(header(&second, "cache-status"), "retargetd; hit", "taken");
    assert_eq!(first.bytes().await.expect("bytes"), second.bytes().await.expect("bytes"), "the same bytes");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn nobody_is_given_what_others_have_computed() {
    let service = Service::start(&[("authentication", "keys")]).await;
    for name in ["ann", "bob"] {
        let key = service.key(name, &[Scope::Read, Scope::Write]).await;
        let job = ended(&service, key.reveal(), &json!({}), &[]).await;
        assert_eq!(job["cache"], "miss", "{name} has not asked for this before, whoever else has");
    }
    service.stop().await;

    let service = Service::start(&[("result_cache", "off")]).await;
    for _ in 0..2 {
        assert_eq!(ended(&service, "", &json!({}), &[]).await["cache"], Value::Null, "nothing is looked up");
    }
    service.stop().await;
}
