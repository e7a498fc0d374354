//! Batches: many jobs in one request, each with an end of its own.

use std::time::Duration;

use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

use super::support::{BVH, PATIENCE, Service, form, header, json as read, problem, taken};

const NOWHERE: &str = "ast_00000000000000000000000000";

fn item(asset: &str, word: &str) -> Value {
    json!({"source": {"asset": asset}, "target": {"asset": asset}, "config": {"say": word}})
}

async fn ask(service: &Service, body: &Value) -> Value {
    let answer = service.post("/v1/batches", body).await;
    assert_eq!(answer.status(), StatusCode::ACCEPTED, "taken on");
    let location = header(&answer, "location").to_owned();
    let batch = read(answer).await;
    assert_eq!(location, format!("/v1/batches/{}", id_of(&batch)), "where it is");
    batch
}

fn id_of(batch: &Value) -> String {
    batch["id"].as_str().expect("an id").to_owned()
}

async fn look(service: &Service, id: &str) -> Value {
    read(service.get(&format!("/v1/batches/{id}")).await).await
}

async fn post(service: &Service, path: &str) -> reqwest::Response {
    service.client.post(service.at(path)).send().await.expect("an answer")
}

async fn cancel(service: &Service, id: &str) -> reqwest::Response {
    post(service, &format!("/v1/batches/{id}/cancel")).await
}

async fn retry_failed(service: &Service, id: &str) -> reqwest::Response {
    post(service, &format!("/v1/batches/{id}/retry-failed")).await
}

/// The batch when all its jobs have ended.
async fn ended(service: &Service, id: &str) -> Value {
    let wait = service.client.get(service.at(&format!("/v1/batches/{id}"))).header("prefer", "wait=30");
    let batch = read(wait.send().await.expect("an answer")).await;
    assert!(batch["finished_at"].is_string() && batch["expires_at"].is_string(), "it has ended: {batch}");
    batch
}

/// The jobs of a batch, all pages of them, in pages of three.
async fn jobs_of(service: &Service, id: &str, filter: &str) -> Vec<Value> {
    let (mut jobs, mut cursor) = (Vec::new(), String::new());
    loop {
        let page = read(service.get(&format!("/v1/batches/{id}/jobs?limit=3{filter}{cursor}")).await).await;
        jobs.extend(page["items"].as_array().expect("a page").clone());
        let Some(next) = page["next_cursor"].as_str() else { return jobs };
        cursor = format!("&cursor={next}");
    }
}

fn counts(batch: &Value) -> [u64; 3] {
    ["succeeded", "failed", "canceled"].map(|state| batch["counts"][state].as_u64().expect("a count"))
}

fn codes(jobs: &[Value]) -> Vec<&str> {
    jobs.iter().map(|job| job["problem"]["code"].as_str().unwrap_or("")).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn every_item_has_an_end_of_its_own_and_what_failed_is_asked_for_again() {
    let service = Service::start(&[("workers", "2")]).await;
    let asset = service.upload(BVH).await;
    let mut items: Vec<Value> = ["a", "refuse", "b", "c", "panic", "d"].map(|word| item(&asset, word)).into();
    items.push(item(NOWHERE, "e"));
    items.push(json!({"source": {"asset": asset}, "target": {"asset": asset}, "preset": "plain_fkk"}));
    let asked = ask(&service, &json!({"items": items, "labels": {"reel": "7"}})).await;
    let id = id_of(&asked);
    assert_eq!((&asked["items"], &asked["labels"]["reel"]), (&json!(8), &json!("7")), "as asked: {asked}");
    let batch = ended(&service, &id).await;
    assert_eq!((batch["state"].as_str(), counts(&batch)), (Some("failed"), [4, 4, 0]), "{batch}");
    assert_eq!(batch["progress"], json!({"done": 8, "total": 8}), "all have ended");

    let jobs = jobs_of(&service, &id, "").await;
    let numbers: Vec<u64> = jobs.iter().filter_map(|job| job["batch_item"].as_u64()).collect();
    assert_eq!(numbers, (0..8).collect::<Vec<_>>(), "in the order of the items");
    assert!(jobs.iter().all(|job| job["batch"] == id.as_str()), "of this batch");
    let failed = jobs_of(&service, &id, "&state=failed").await;
    assert_eq!(codes(&failed), ["no_animation", "internal", "unknown_asset", "unknown_preset"], "each says why");
    assert_eq!(failed[2]["problem"]["errors"][0]["pointer"], "/source/asset", "where: {}", failed[2]);
    assert_eq!(failed[3]["problem"]["errors"][0]["did_you_mean"][0], "plain_fk", "what it may be: {}", failed[3]);

    let answer = retry_failed(&service, &id).await;
    assert_eq!(answer.status(), StatusCode::ACCEPTED, "new jobs");
    assert_eq!(read(answer).await["retried"], 4, "the failed ones only");
    let batch = ended(&service, &id).await;
    assert_eq!((counts(&batch), &batch["retried"]), ([4, 4, 0], &json!(4)), "an item counts once: {batch}");
    let again = jobs_of(&service, &id, "&state=failed").await;
    for (older, newer) in failed.iter().zip(&again) {
        assert_eq!((&newer["retry_of"], &newer["batch_item"]), (&older["id"], &older["batch_item"]), "in its place");
    }
    let kept = service.client.put(service.at("/v1/presets/plain_fkk")).json(&json!({"align": "off"}));
    assert!(kept.send().await.expect("an answer").status().is_success(), "the preset is there now");
    retry_failed(&service, &id).await;
    assert_eq!(counts(&ended(&service, &id).await), [5, 3, 0], "so the item with it succeeds");

    let next = id_of(&ask(&service, &json!({"items": [item(&asset, "a")]})).await);
    let page = read(service.get("/v1/batches?limit=1").await).await;
    assert_eq!(page["items"][0]["id"], next.as_str(), "newest first");
    let cursor = page["next_cursor"].as_str().expect("there is more");
    let page = read(service.get(&format!("/v1/batches?cursor={cursor}")).await).await;
    assert_eq!((&page["items"][0]["id"], &page["next_cursor"]), (&json!(id), &Value::Null), "then the older");
    assert_eq!(ended(&service, &next).await["state"], "succeeded", "all did");
    assert_eq!(retry_failed(&service, &next).await.status(), StatusCode::OK, "nothing had failed");

    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_goes_with_the_last_of_its_jobs() {
    let service = Service::start(&[("sweep_interval", "50ms")]).await;
    let asset = service.upload(BVH).await;
    let id = id_of(&ask(&service, &json!({"items": [item(&asset, "a"), item(NOWHERE, "b")]})).await);
    ended(&service, &id).await;
    service.clock.advance(Duration::from_secs(8 * 86_400));
    let gone = async {
        while service.get(&format!("/v1/batches/{id}")).await.status() != StatusCode::NOT_FOUND {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(PATIENCE, gone).await.expect("it is removed");
    assert_eq!(read(service.get("/v1/batches").await).await["items"], json!([]), "nor is it listed");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn all_or_none_and_only_looking() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let items = json!([item(&asset, "a"), item(NOWHERE, "b"), item(&asset, "c")]);
    let atomic = json!({"items": items, "atomic": true});
    let refused = problem(service.post("/v1/batches", &atomic).await, 422, "unknown_asset").await;
    assert_eq!(refused["errors"][0]["pointer"], "/items/1/source/asset", "which: {refused}");
    let check = json!({"items": items, "validate_only": true});
    let checked = service.post("/v1/batches", &check).await;
    assert_eq!(checked.status(), StatusCode::OK, "it was only looked at");
    let checked = read(checked).await;
    assert_eq!((&checked["items"], &checked["bad_items"][0]["item"]), (&json!(3), &json!(1)), "{checked}");
    assert_eq!(checked["bad_items"][0]["problem"]["code"], "unknown_asset", "why: {checked}");
    let unreadable = json!({"items": [item(&asset, "a"), {"source": {"asset": 7}}, {"sauce": {}}]});
    let refused = problem(service.post("/v1/batches", &unreadable).await, 422, "invalid_value").await;
    let pointers: Vec<&Value> = refused["errors"].as_array().expect("a list").iter().map(|e| &e["pointer"]).collect();
    assert_eq!(pointers, ["/items/1/source/asset", "/items/2/sauce"], "everything that cannot be read");
    for list in ["/v1/batches", "/v1/jobs"] {
        assert_eq!(read(service.get(list).await).await["items"], json!([]), "nothing was asked for");
    }
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_same_word_is_the_same_batch() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let ask = async |word: &str| {
        let body = json!({"items": [item(&asset, word)]});
        let request =
            service.client.request(Method::POST, service.at("/v1/batches")).header("idempotency-key", "monday");
        request.json(&body).send().await.expect("an answer")
    };
    let (first, second) = (ask("a").await, ask("a").await);
    assert_eq!((header(&first, "idempotent-replayed"), header(&second, "idempotent-replayed")), ("", "true"), "said");
    let (first, second) = (read(first).await, read(second).await);
    assert_eq!(first["id"], second["id"], "one batch");
    let refused = problem(ask("b").await, 422, "idempotency_key_reused").await;
    assert!(refused["detail"].as_str().is_some_and(|text| text.contains(&id_of(&first))), "which: {refused}");
    assert_eq!(jobs_of(&service, &id_of(&first), "").await.len(), 1, "one job");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_failure_stops_the_rest_where_that_was_asked_for() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let items = ["a", "refuse", "b", "c"].map(|word| item(&asset, word));
    let id = id_of(&ask(&service, &json!({"items": items, "on_error": "stop"})).await);
    let batch = ended(&service, &id).await;
    assert_eq!((batch["state"].as_str(), counts(&batch)), (Some("failed"), [1, 1, 2]), "{batch}");
    let jobs = jobs_of(&service, &id, "").await;
    assert_eq!(codes(&jobs), ["", "no_animation", "batch_stopped", "batch_stopped"], "each says why");
    assert_eq!(read(retry_failed(&service, &id).await).await["retried"], 3, "those that did not run, too");
    ended(&service, &id).await;

    let items = [item(&asset, "a"), item(NOWHERE, "b")];
    let batch = ended(&service, &id_of(&ask(&service, &json!({"items": items, "on_error": "stop"})).await)).await;
    assert_eq!(counts(&batch), [0, 1, 1], "what is known to fail stops it before it begins: {batch}");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_is_canceled_half_way() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let items = ["a", "wait", "b", "c"].map(|word| item(&asset, word));
    let id = id_of(&ask(&service, &json!({"items": items})).await);
    let running = async {
        while look(&service, &id).await["counts"]["succeeded"] != 1 {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    tokio::time::timeout(PATIENCE, running).await.expect("the first succeeds");
    let canceled = cancel(&service, &id).await;
    assert_eq!(canceled.status(), StatusCode::OK, "at once");
    assert_eq!(read(canceled).await["counts"]["queued"], 0, "nothing waits any more");
    let batch = ended(&service, &id).await;
    assert_eq!((batch["state"].as_str(), counts(&batch)), (Some("canceled"), [1, 0, 3]), "{batch}");
    assert_eq!(read(cancel(&service, &id).await).await["state"], "canceled", "any number of times");
    assert_eq!(retry_failed(&service, &id).await.status(), StatusCode::OK, "what was canceled has not failed");
    let again = post(&service, &format!("/v1/batches/{id}/retry-failed?canceled=true")).await;
    assert!(read(again).await["retried"].as_u64() > Some(0), "but it can be asked for again");
    cancel(&service, &id).await;
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn batches_are_bounded_and_leave_room_for_single_jobs() {
    let settings =
        [("workers", "0"), ("max_queued_jobs", "1"), ("max_queued_batch_jobs", "5"), ("max_batch_items", "4")];
    let service = Service::start(&settings).await;
    let asset = service.upload(BVH).await;
    let batch = |count: usize| json!({"defaults": item(&asset, "a"), "items": vec![json!({}); count]});
    let refused = problem(service.post("/v1/batches", &batch(5)).await, 422, "invalid_value").await;
    assert_eq!((&refused["limit"], &refused["maximum"]), (&json!("batch_items"), &json!(4)), "which limit: {refused}");
    ask(&service, &batch(4)).await;
    let refused = problem(service.post("/v1/batches", &batch(2)).await, 429, "queue_full").await;
    assert_eq!(refused["limit"], "queued_batch_jobs", "which limit: {refused}");
    let single = read(service.job(&asset, "a").await).await;
    assert_eq!(single["queue_position"], 1, "before all jobs of batches: {single}");
    ask(&service, &batch(1)).await;
    problem(service.job(&asset, "a").await, 429, "queue_full").await;
    service.stop().await;

    let service = Service::start(&[("workers", "0"), ("max_principal_jobs", "3"), ("max_batch_bytes", "1KiB")]).await;
    let asset = service.upload(BVH).await;
    let items = json!({"defaults": item(&asset, "a"), "items": vec![json!({}); 4]});
    problem(service.post("/v1/batches", &items).await, 429, "quota_reached").await;
    let large = json!({"defaults": item(&asset, &"a".repeat(400)), "items": vec![json!({}); 3]});
    let refused = problem(service.post("/v1/batches", &large).await, 413, "body_too_large").await;
    assert_eq!(refused["limit"], "batch_bytes", "what the defaults become: {refused}");
    service.stop().await;
}

/// Files that differ in nothing but what they are called and what is in them.
async fn named(service: &Service, name: &str, bytes: &str) -> String {
    let path = service.at(&format!("/v1/assets?filename={name}"));
    taken(service.client.post(path).body(bytes.to_owned()).send().await.expect("an answer")).await
}

#[tokio::test(flavor = "multi_thread")]
async fn the_results_come_as_one_archive_whatever_failed() {
    let service = Service::start(&[("workers", "2")]).await;
    let walk = named(&service, "walk.bvh", BVH).await;
    let (hero, other) = (format!("{BVH}hero"), format!("{BVH}other"));
    let targets = [named(&service, "Hero.glb", &hero).await, named(&service, "other.glb", &other).await];
    let hostile = named(&service, "..%2F..%2Fcon%3A.bvh", &format!("{BVH}x")).await;
    let one = |source: &str, target: &str| json!({"source": {"asset": source}, "target": {"asset": target}});
    let mut items = vec![one(&walk, &targets[0]), one(&walk, &targets[1]), one(&hostile, &targets[0])];
    items.extend([item(&walk, "refuse"), item(&walk, "a"), item(NOWHERE, "a")]);
    for name in ["Take", "take", "manifest"] {
        items.push(json!({"source": {"asset": walk}, "target": {"asset": walk}, "labels": {"name": name}}));
    }
    items[8]["output"] = json!(["glb", "json"]);
    let id = id_of(&ask(&service, &json!({"items": items, "labels": {"reel": "7"}})).await);
    assert_eq!(counts(&ended(&service, &id).await), [7, 2, 0], "two of them failed");

    let answer = service.get(&format!("/v1/batches/{id}/archive")).await;
    assert_eq!(header(&answer, "content-type"), "application/zip", "what it is");
    assert_eq!(
        header(&answer, "content-disposition"),
        format!("attachment; filename=\"{id}.zip\""),
        "what it is called"
    );
    let bytes = answer.bytes().await.expect("all of it");
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).expect("an archive");
    let names: Vec<String> = archive.file_names().map(|name| name.expect("text").into_owned()).collect();
    let expected = [
        "manifest.json",
        "Hero/walk.glb",
        "other/walk.glb",
        "Hero/con_.glb",
        "walk.glb",
        "Take.glb",
        "take-2.glb",
        "manifest.glb",
        "manifest-2.json",
        "index.html",
    ];
    assert_eq!(names, expected, "in the order of the items, each once, all in their folders");
    let mut text = |name: &str| {
        let mut text = String::new();
        let read = std::io::Read::read_to_string(&mut archive.by_name(name).expect("is there"), &mut text);
        read.expect("whole, by its checksum");
        text
    };
    assert_eq!((text("Hero/walk.glb"), text("other/walk.glb")), (hero, other), "the results");
    let manifest: Value = serde_json::from_str(&text("manifest.json")).expect("JSON");
    assert_eq!((&manifest["batch"], &manifest["labels"]["reel"]), (&json!(id), &json!("7")), "of what: {manifest}");
    let items = manifest["items"].as_array().expect("items");
    let codes: Vec<&str> = items.iter().map(|item| item["problem"]["code"].as_str().unwrap_or("")).collect();
    assert_eq!(codes, ["", "", "", "no_animation", "", "unknown_asset", "", "", ""], "what became of each");
    assert_eq!(items[8]["files"][1]["name"], "manifest-2.json", "which files are its: {}", items[8]);
    assert_eq!(items[3]["files"], json!([]), "none");
    problem(service.get("/v1/batches/bat_00000000000000000000000000/archive").await, 404, "not_found").await;
    service.stop().await;
}

/// A batch that has the only worker, for ever, keeps nobody else from anything; and the spare place is one, not many.
#[tokio::test(flavor = "multi_thread")]
async fn a_batch_delays_nobody_else() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let batch = json!({"defaults": item(&asset, "wait"), "items": vec![json!({}); 1000]});
    let id = id_of(&ask(&service, &batch).await);
    let has_begun = async {
        while look(&service, &id).await["counts"]["running"] != 1 {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    tokio::time::timeout(PATIENCE, has_begun).await.expect("it begins");
    let single = id_of(&read(service.job(&asset, "a").await).await);
    service.until(&single, "succeeded").await;
    let one_shot = service.client.post(service.at("/v1/retarget")).multipart(form(&[("source", BVH), ("target", BVH)]));
    assert_eq!(one_shot.send().await.expect("an answer").status(), StatusCode::OK, "a one-shot is answered");

    let (first, second) = (service.job(&asset, "wait").await, service.job(&asset, "a").await);
    let (first, second) = (id_of(&read(first).await), id_of(&read(second).await));
    service.until(&first, "running").await;
    tokio::time::sleep(Duration::from_millis(100)).await;
    assert_eq!(read(service.get(&format!("/v1/jobs/{second}")).await).await["state"], "queued", "one at a time");
    service.client.post(service.at(&format!("/v1/jobs/{first}/cancel"))).send().await.expect("an answer");
    service.until(&second, "succeeded").await;
    let canceled = read(cancel(&service, &id).await).await;
    assert_eq!(
        canceled["counts"]["canceled"].as_u64().unwrap_or(0) + canceled["counts"]["canceling"].as_u64().unwrap_or(0),
        1000,
        "at once: {canceled}"
    );
    ended(&service, &id).await;
    service.stop().await;
}

/// Each item names the versions of the caller's own rigs, so they count for each.
#[tokio::test(flavor = "multi_thread")]
async fn rigs_of_the_callers_own_count_for_every_item() {
    let service = Service::start(&[("max_batch_bytes", "4096")]).await;
    let asset = service.upload(BVH).await;
    let file = json!({"asset": asset});
    let items: Vec<Value> = (0..20).map(|_| json!({"source": file, "target": file})).collect();
    let ask = async || service.post("/v1/batches", &json!({"items": items})).await;
    assert_eq!(ask().await.status(), StatusCode::ACCEPTED, "nothing but files");
    let rig = json!({"kind": "biped", "roles": {"pelvis": ["huefte"], "head": ["kopf"]}});
    for number in 0..10 {
        let path = service.at(&format!("/v1/rigs/hero-{number}"));
        let kept = service.client.put(path).json(&rig).send().await.expect("an answer");
        assert!(kept.status().is_success(), "a rig is kept: {}", kept.text().await.unwrap_or_default());
    }
    let refused = problem(ask().await, 413, "body_too_large").await;
    assert_eq!(refused["limit"], "batch_bytes", "which limit: {refused}");
    service.stop().await;
}

/// An item that cannot run fails as soon as the batch is made; that nothing has begun to run is told all the same.
#[tokio::test(flavor = "multi_thread")]
async fn a_batch_waits_until_one_of_its_jobs_runs() {
    let service = Service::start(&[("workers", "0")]).await;
    let asset = service.upload(BVH).await;
    let batch = ask(&service, &json!({"items": [item(NOWHERE, "a"), item(&asset, "b")]})).await;
    assert_eq!((batch["counts"]["failed"].as_u64(), batch["counts"]["queued"].as_u64()), (Some(1), Some(1)), "{batch}");
    assert_eq!(batch["state"], "queued", "none of its jobs has started: {batch}");
    service.stop().await;
}
