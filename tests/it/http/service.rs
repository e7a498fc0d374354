//! The service with an engine that does what it is told: routes, headers, states.

use std::time::Duration;

use reqwest::StatusCode;
use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use super::support::{BVH, Service, form, header, json as read, problem, taken};

#[tokio::test(flavor = "multi_thread")]
async fn files_in_file_out() {
    let service = Service::start(&[]).await;
    let parts = form(&[("config", "{}"), ("target", BVH), ("source", BVH)]);
    let answer = service.client.post(service.at("/v1/retarget")).multipart(parts).send().await.expect("an answer");
    assert_eq!(answer.status(), StatusCode::OK, "ended within the wait");
    assert_eq!(header(&answer, "content-type"), "model/gltf-binary", "GLB unless asked otherwise");
    assert!(header(&answer, "job-id").starts_with("job_"), "the job is told");
    assert!(header(&answer, "server-timing").contains("retarget;dur="), "timings are told");
    assert_eq!(header(&answer, "warnings-count"), "0", "warnings are counted");
    assert_eq!(
        header(&answer, "content-disposition"),
        "attachment; filename=\"source.glb\"",
        "a name to save it under"
    );
    assert_eq!(header(&answer, "etag").len(), 66, "the digest in quotes");
    let job = header(&answer, "job-id").to_owned();
    assert_eq!(answer.text().await.expect("a body"), BVH, "the bytes that the engine made");
    let config = read(service.get(&format!("/v1/jobs/{job}/config")).await).await;
    assert_eq!(config, json!({"version": 1}), "the resolved spec");
    let report = read(service.get(&format!("/v1/jobs/{job}/report")).await).await;
    assert!(report["timings"]["total_seconds"].is_number(), "the report: {report}");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn accept_and_prefer_are_heard() {
    let service = Service::start(&[]).await;
    let ask = |accept: &str, prefer: &str, config: &str| {
        let parts = form(&[("source", BVH), ("target", BVH), ("config", config)]);
        let request = service.client.post(service.at("/v1/retarget")).multipart(parts);
        request.header("accept", accept).header("prefer", prefer).send()
    };
    let npz = ask("application/x-npz", "", "{}").await.expect("an answer");
    assert_eq!(header(&npz, "content-type"), "application/x-npz", "as asked");
    problem(ask("video/quicktime", "", "{}").await.expect("an answer"), 406, "not_acceptable").await;
    let later = ask("*/*", "wait=0", "wait").await.expect("an answer");
    assert_eq!(later.status(), StatusCode::ACCEPTED, "it goes on without the caller");
    assert_eq!(header(&later, "preference-applied"), "wait=0", "heard");
    let location = header(&later, "location").to_owned();
    assert!(!header(&later, "retry-after").is_empty(), "when to look again");
    let canceled = service.post(&format!("{location}/cancel"), &json!({})).await;
    assert_eq!(canceled.status(), StatusCode::OK, "by its location");
    service.until(location.trim_start_matches("/v1/jobs/"), "canceled").await;
    let failed = ask("*/*", "", "refuse").await.expect("an answer");
    assert!(header(&failed, "job-id").starts_with("job_"), "also of a job that failed");
    assert_eq!(problem(failed, 422, "no_animation").await["part"], "source", "which file");
    problem(ask("*/*", "", "panic").await.expect("an answer"), 500, "internal").await;
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_queue_refuses_while_probes_and_cancel_work() {
    let service = Service::start(&[("max_queued_jobs", "1")]).await;
    let asset = service.upload(BVH).await;
    let running = taken(service.job(&asset, "wait").await).await;
    service.until(&running, "running").await;
    let queued = service.job(&asset, "wait").await;
    assert_eq!(queued.status(), StatusCode::ACCEPTED, "room for one");
    let queued = read(queued).await;
    assert_eq!(queued["queue_position"], 1, "it waits");
    let refused = service.job(&asset, "wait").await;
    assert!(!header(&refused, "retry-after").is_empty(), "when to try again");
    let refused = problem(refused, 429, "queue_full").await;
    assert_eq!((&refused["limit"], &refused["maximum"]), (&json!("queued_jobs"), &json!(1)), "which limit");
    assert_eq!(service.get("/livez").await.status(), StatusCode::OK, "busy is alive");
    assert_eq!(service.get("/readyz").await.status(), StatusCode::OK, "busy is ready");
    let in_use = service.client.delete(service.at(&format!("/v1/assets/{asset}"))).send().await.expect("an answer");
    problem(in_use, 409, "in_use").await;
    let running_one =
        service.client.delete(service.at(&format!("/v1/jobs/{running}"))).send().await.expect("an answer");
    problem(running_one, 409, "wrong_state").await;
    for id in [queued["id"].as_str().expect("an id"), &running] {
        service.post(&format!("/v1/jobs/{id}/cancel"), &json!({})).await;
        service.until(id, "canceled").await;
    }
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_caller_who_goes_away_stops_the_job() {
    let service = Service::start(&[]).await;
    let parts = form(&[("source", BVH), ("target", BVH), ("config", "wait")]);
    let request = service.client.post(service.at("/v1/retarget")).multipart(parts).send();
    let waiting = tokio::spawn(request);
    let id = loop {
        let jobs = read(service.get("/v1/jobs?state=running").await).await;
        if let Some(id) = jobs["items"][0]["id"].as_str() {
            break id.to_owned();
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    };
    waiting.abort();
    service.until(&id, "canceled").await;
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn results_have_ranges_and_never_change() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let body = json!({"source": {"asset": asset}, "target": {"asset": asset}, "output": ["glb", "npz"], "labels": {"shot": "010"}});
    let request = service.client.post(service.at("/v1/jobs")).json(&body).header("prefer", "wait=30");
    let job = read(request.send().await.expect("an answer")).await;
    assert_eq!((&job["state"], &job["labels"]["shot"]), (&json!("succeeded"), &json!("010")), "the job: {job}");
    assert_eq!(job["results"].as_array().map(Vec::len), Some(2), "one file per format: {job}");
    let content = job["results"][0]["content"].as_str().expect("a place").to_owned();
    let whole = service.get(&content).await;
    assert!(header(&whole, "cache-control").contains("immutable"), "may be cached");
    let tag = header(&whole, "etag").to_owned();
    assert_eq!(tag.trim_matches('"'), job["results"][0]["sha256"], "the tag is the digest");
    let with = |name: &'static str, value: String| service.client.get(service.at(&content)).header(name, value).send();
    let part = with("range", "bytes=0-8".to_owned()).await.expect("an answer");
    assert_eq!(part.status(), StatusCode::PARTIAL_CONTENT, "a part");
    assert_eq!(header(&part, "content-range"), format!("bytes 0-8/{}", BVH.len()), "which part");
    assert_eq!(part.text().await.expect("a body"), "HIERARCHY", "its bytes");
    let known = with("if-none-match", tag).await.expect("an answer");
    assert_eq!(known.status(), StatusCode::NOT_MODIFIED, "the caller has it");
    let outside = with("range", "bytes=9999-".to_owned()).await.expect("an answer");
    assert_eq!(header(&outside, "content-range"), format!("bytes */{}", BVH.len()), "how many there are");
    problem(outside, 416, "range_not_satisfiable").await;
    let head = service.client.head(service.at(&content)).send().await.expect("an answer");
    assert_eq!(header(&head, "content-length"), BVH.len().to_string(), "HEAD tells the size");
    service.clock.advance(Duration::from_secs(100 * 3600));
    problem(service.get(&content).await, 410, "expired").await;
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn lists_have_pages_and_filters() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    for _ in 0..5 {
        let id = taken(service.job(&asset, "fine").await).await;
        service.until(&id, "succeeded").await;
    }
    let mut seen = Vec::new();
    let mut path = "/v1/jobs?state=succeeded&limit=2".to_owned();
    loop {
        let page = read(service.get(&path).await).await;
        let items = page["items"].as_array().expect("items");
        seen.extend(items.iter().map(|job| job["id"].as_str().unwrap_or_default().to_owned()));
        let Some(cursor) = page["next_cursor"].as_str() else { break };
        problem(service.get(&format!("/v1/jobs?state=failed&cursor={cursor}")).await, 400, "malformed_request").await;
        path = format!("/v1/jobs?state=succeeded&limit=2&cursor={cursor}");
    }
    assert_eq!(seen.len(), 5, "all of them");
    assert!(seen.is_sorted_by(|a, b| a > b), "newest first, each once");
    problem(service.get("/v1/jobs?state=busy").await, 400, "malformed_request").await;
    problem(service.get("/v1/jobs?sort=up").await, 400, "malformed_request").await;
    let retried = service.post(&format!("/v1/jobs/{}/retry", seen[0]), &json!({})).await;
    assert_eq!(retried.status(), StatusCode::ACCEPTED, "a new job");
    let retried = read(retried).await;
    assert_eq!(retried["retry_of"], seen[0].as_str(), "of the old one");
    let deleted = service.client.delete(service.at(&format!("/v1/jobs/{}", seen[1]))).send().await.expect("an answer");
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT, "removed");
    problem(service.get(&format!("/v1/jobs/{}", seen[1])).await, 404, "not_found").await;
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_slow_upload_times_out_and_leaves_nothing() {
    let service = Service::start(&[("upload_idle_timeout", "200ms"), ("header_timeout", "300ms")]).await;
    let mut stream = tokio::net::TcpStream::connect(service.address()).await.expect("connects");
    let head = "POST /v1/assets HTTP/1.1\r\nhost: localhost\r\ncontent-length: 1000\r\n\r\nHIERARCHY";
    stream.write_all(head.as_bytes()).await.expect("writes");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.expect("an answer, then the end");
    assert!(answer.starts_with("HTTP/1.1 408") && answer.contains("upload_too_slow"), "too slow: {answer}");
    let files = |folder: &str| std::fs::read_dir(service.data.path().join(folder)).expect("a folder").count();
    for _ in 0..200 {
        if files("tmp") == 0 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    assert_eq!((files("tmp"), files("blobs")), (0, 0), "nothing is left");
    let mut silent = tokio::net::TcpStream::connect(service.address()).await.expect("connects");
    silent.write_all(b"GET / HTTP/1.1\r\n").await.expect("writes");
    let mut answer = Vec::new();
    silent.read_to_end(&mut answer).await.expect("the connection ends");
    assert_eq!(service.get("/livez").await.status(), StatusCode::OK, "the service goes on");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_is_refused_while_sending_hears_why() {
    const BODY: usize = 4 << 20;
    let service = Service::start(&[]).await;
    let mut stream = tokio::net::TcpStream::connect(service.address()).await.expect("connects");
    for attempt in ["first", "second on the same connection"] {
        let head = format!("POST /v1/poses?to=x HTTP/1.1\r\nhost: localhost\r\ncontent-length: {BODY}\r\n\r\n");
        stream.write_all(head.as_bytes()).await.expect("writes the head");
        let chunk = vec![b'x'; 64 << 10];
        for _ in 0..BODY / chunk.len() {
            stream.write_all(&chunk).await.expect("writes the body, which is refused, to its end");
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        let mut answer = vec![0; 4 << 10];
        let read = stream.read(&mut answer).await.expect("an answer");
        let answer = String::from_utf8_lossy(&answer[..read]);
        assert!(answer.starts_with("HTTP/1.1 400") && answer.contains("malformed_request"), "{attempt}: {answer}");
    }
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drain_lets_those_who_wait_go() {
    let service = Service::start(&[("grace_period", "0s"), ("drain_delay", "1s")]).await;
    let asset = service.upload(BVH).await;
    let id = taken(service.job(&asset, "wait").await).await;
    service.until(&id, "running").await;
    let waiting = service.client.get(service.at(&format!("/v1/jobs/{id}"))).header("prefer", "wait=30").send();
    let (url, client) = (service.url.clone(), service.client.clone());
    let during = async {
        loop {
            let ready = client.get(format!("{url}/readyz")).send().await.expect("an answer");
            if ready.status() != StatusCode::OK {
                let new = client.post(format!("{url}/v1/jobs")).json(&json!({})).send().await.expect("an answer");
                return (ready, new);
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    let ((ready, new), waited, ()) = tokio::join!(during, waiting, async {
        tokio::time::sleep(Duration::from_millis(50)).await;
        service.stop().await;
    });
    problem(ready, 503, "draining").await;
    assert!(!header(&new, "retry-after").is_empty(), "when to try again");
    problem(new, 503, "draining").await;
    assert_eq!(waited.expect("an answer").status(), StatusCode::OK, "the long poll ends with the job as it is");
}
