//! `Idempotency-Key`: who asks twice has one job.

use reqwest::{Response, StatusCode};
use serde_json::{Value, json};

use super::support::{BVH, Service, form, header, json as read, problem, taken};

async fn ask(service: &Service, word: &str, body: &Value) -> Response {
    service
        .client
        .post(service.at("/v1/jobs"))
        .header("idempotency-key", word)
        .json(body)
        .send()
        .await
        .expect("an answer")
}

#[tokio::test(flavor = "multi_thread")]
async fn who_asks_twice_has_one_job_also_when_the_queue_is_full() {
    let service = Service::start(&[("max_queued_jobs", "1"), ("grace_period", "1s")]).await;
    let asset = service.upload(BVH).await;
    let body = json!({"source": {"asset": asset}, "target": {"asset": asset}, "config": {"say": "wait"}});
    let first = ask(&service, "monday", &body).await;
    assert_eq!((first.status(), header(&first, "idempotent-replayed")), (StatusCode::ACCEPTED, ""), "taken on");
    let id = taken(first).await;
    service.until(&id, "running").await;
    assert_eq!(ask(&service, "tuesday", &body).await.status(), StatusCode::ACCEPTED, "another word is another job");
    problem(ask(&service, "wednesday", &body).await, 429, "queue_full").await;

    let again = ask(&service, "monday", &body).await;
    assert_eq!((again.status(), header(&again, "idempotent-replayed")), (StatusCode::ACCEPTED, "true"), "known");
    assert_eq!(read(again).await["id"], id.as_str(), "the same job, though the queue is full");
    let mut other = body.clone();
    other["labels"] = json!({"shot": "010"});
    let reused = problem(ask(&service, "monday", &other).await, 422, "idempotency_key_reused").await;
    assert!(reused["detail"].as_str().is_some_and(|detail| detail.contains(&id)), "which job: {reused}");
    problem(ask(&service, "two words", &body).await, 400, "malformed_request").await;

    let cancel = service.post(&format!("/v1/jobs/{id}/cancel"), &json!({})).await;
    assert_eq!(cancel.status(), StatusCode::OK, "canceled");
    service.until(&id, "canceled").await;
    assert_eq!(
        read(ask(&service, "monday", &body).await).await["state"],
        "canceled",
        "a word stays, whatever became of it"
    );
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_one_shot_that_broke_off_is_asked_for_again() {
    let service = Service::start(&[]).await;
    let one_shot = async |word: &str, config: &str| {
        let parts = form(&[("source", BVH), ("target", BVH), ("config", config)]);
        let request = service.client.post(service.at("/v1/retarget")).header("idempotency-key", word).multipart(parts);
        request.send().await.expect("an answer")
    };
    let first = one_shot("a", "{}").await;
    assert_eq!(first.status(), StatusCode::OK, "made");
    let job = header(&first, "job-id").to_owned();
    let again = one_shot("a", "{}").await;
    assert_eq!((again.status(), header(&again, "idempotent-replayed")), (StatusCode::OK, "true"), "not made again");
    assert_eq!(header(&again, "job-id"), job, "the same job");
    assert_eq!(again.bytes().await.expect("a file"), first.bytes().await.expect("a file"), "the same file");
    problem(one_shot("a", "{\"say\": \"other\"}").await, 422, "idempotency_key_reused").await;
    assert_ne!(header(&one_shot("b", "{}").await, "job-id"), job, "another word is another job");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn many_who_ask_at_the_same_time_have_one_job() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let body = json!({"source": {"asset": asset}, "target": {"asset": asset}});
    let answers = futures::future::join_all((0..64).map(|_| ask(&service, "rush", &body))).await;
    let mut ids = Vec::new();
    for answer in answers {
        assert!(answer.status().is_success(), "answered: {}", answer.status());
        ids.push(taken(answer).await);
    }
    ids.dedup();
    assert_eq!(ids.len(), 1, "one job for all");
    let jobs = read(service.get("/v1/jobs").await).await;
    assert_eq!(jobs["items"].as_array().map(Vec::len), Some(1), "and no other: {jobs}");
    service.stop().await;
}
