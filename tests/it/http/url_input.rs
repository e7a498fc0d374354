//! Files by URL: only where the operator wants it, and only from where anybody could have them.

use reqwest::{Response, StatusCode};
use serde_json::{Value, json};

use super::{
    receiver::{Receiver, Reply},
    support::{BVH, Service, json as read, problem},
};
use crate::support::sha256_of;

async fn fetch(service: &Service, body: &Value) -> Response {
    service.post("/v1/assets", body).await
}

async fn open() -> Service {
    let settings = [("url_input", "on"), ("outbound_allow", "127.0.0.0/8"), ("url_input_timeout", "1s")];
    Service::start(&[&settings[..], &[("max_file_bytes", "64KiB")]].concat()).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_is_fetched_as_if_it_had_been_uploaded() {
    let service = open().await;
    let uploaded = service.upload(BVH).await;
    let other = format!("{BVH}\n");
    let receiver = Receiver::start(&[
        Reply::File(BVH.to_owned()),
        Reply::Status(302, "location: /second"),
        Reply::Status(307, "location: third/walk.bvh?token=1"),
        Reply::File(other.clone()),
    ]);
    let known = fetch(&service, &json!({"url": receiver.url})).await;
    assert_eq!(known.status(), StatusCode::OK, "these bytes are here");
    assert_eq!(read(known).await["id"], uploaded.as_str(), "under their id");
    let digest = sha256_of(other.as_bytes());
    let fetched = fetch(&service, &json!({"url": receiver.url, "digest": digest})).await;
    assert_eq!(fetched.status(), StatusCode::CREATED, "new");
    let fetched = read(fetched).await;
    assert_eq!((&fetched["file_name"], &fetched["sha256"]), (&json!("walk.bvh"), &json!(digest)), "{fetched}");
    let paths: Vec<_> = receiver.heard().into_iter().map(|heard| heard.path).collect();
    assert_eq!(paths, ["/hook", "/hook", "/second", "/third/walk.bvh?token=1"], "where it was sent");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_must_not_be_fetched_leaves_nothing() {
    let service = open().await;
    let away = |status| Reply::Status(status, "location: /again");
    let receiver = Receiver::start(&[
        Reply::Status(302, "location: http://169.254.169.254/latest/meta-data"),
        Reply::Status(302, "location: file:///etc/passwd"),
        away(301),
        away(302),
        away(303),
        away(308),
        Reply::Status(404, ""),
        Reply::Status(302, ""),
        Reply::Silence,
        Reply::EndlessBody,
        Reply::File("x".repeat(100_000)),
        Reply::File("no model".to_owned()),
        Reply::File(BVH.to_owned()),
    ]);
    let zeros = "0".repeat(64);
    let plain = json!({"url": receiver.url});
    for (why, status, code) in [
        ("a redirect to metadata", 422, "forbidden_url"),
        ("a redirect to a file", 422, "forbidden_url"),
        ("four redirects", 502, "fetch_failed"),
        ("no file", 502, "fetch_failed"),
        ("a redirect to nowhere", 502, "fetch_failed"),
        ("silence", 502, "fetch_failed"),
        ("a file without end", 502, "fetch_failed"),
        ("too large", 413, "body_too_large"),
        ("no format", 415, "unsupported_format"),
    ] {
        let answer = fetch(&service, &plain).await;
        assert_eq!(answer.status().as_u16(), status, "{why}");
        problem(answer, status, code).await;
    }
    problem(fetch(&service, &json!({"url": receiver.url, "digest": zeros})).await, 400, "digest_mismatch").await;
    let nonsense =
        problem(fetch(&service, &json!({"url": receiver.url, "digest": "abc"})).await, 422, "invalid_value").await;
    assert_eq!(nonsense["errors"][0]["pointer"], "/digest", "where");
    problem(fetch(&service, &json!({"url": "https://10.0.0.1/walk.bvh"})).await, 422, "forbidden_url").await;
    problem(fetch(&service, &json!({"url": receiver.url, "headers": {}})).await, 422, "unknown_field").await;
    let blobs = std::fs::read_dir(service.data.path().join("blobs")).expect("a folder").count();
    assert_eq!(
        (blobs, read(service.get("/v1/assets").await).await["items"].clone()),
        (0, json!([])),
        "nothing was kept"
    );
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn nothing_is_fetched_unless_the_operator_says_so() {
    let service = Service::start(&[("outbound_allow", "127.0.0.0/8")]).await;
    let receiver = Receiver::start(&[]);
    problem(fetch(&service, &json!({"url": receiver.url})).await, 403, "url_input_off").await;
    assert!(receiver.heard().is_empty(), "nobody came");
    service.stop().await;
}
