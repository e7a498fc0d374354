//! Rigs and presets that users keep: versions, preconditions, limits, and that they take part.

use reqwest::{Response, StatusCode};
use retargetd::{engine, samples};
use serde_json::{Value, json};

use super::support::{BVH, Service, header, json as read, problem, start_service, taken};

async fn put(service: &Service, path: &str, body: &Value, condition: (&'static str, &str)) -> Response {
    let mut request = service.client.put(service.at(path)).json(body);
    if !condition.1.is_empty() {
        request = request.header(condition.0, condition.1);
    }
    request.send().await.expect("an answer")
}

async fn delete(service: &Service, path: &str, tag: &str) -> Response {
    let mut request = service.client.delete(service.at(path));
    if !tag.is_empty() {
        request = request.header("if-match", tag);
    }
    request.send().await.expect("an answer")
}

fn rig(pelvis: &str) -> Value {
    json!({"kind": "biped", "roles": {"pelvis": [pelvis], "head": ["kopf"]}})
}

const NOTHING: (&str, &str) = ("if-match", "");

#[tokio::test(flavor = "multi_thread")]
async fn documents_have_versions_and_tags() {
    let service = Service::start(&[]).await;
    for (kind, first, second) in
        [("rigs", rig("huefte"), rig("becken")), ("presets", json!({"align": "off"}), json!({"strict": true}))]
    {
        let path = format!("/v1/{kind}/mine");
        let created = put(&service, &path, &first, ("if-none-match", "*")).await;
        assert_eq!(created.status(), StatusCode::CREATED, "{kind}: new");
        assert_eq!((header(&created, "location"), header(&created, "document-version")), (&*path, "1"), "{kind}");
        let tag = header(&created, "etag").to_owned();
        assert_eq!(tag.len(), 66, "{kind}: the digest in quotes");
        problem(put(&service, &path, &second, ("if-none-match", "*")).await, 412, "precondition_failed").await;
        let again = put(&service, &path, &first, NOTHING).await;
        assert_eq!((again.status(), header(&again, "document-version")), (StatusCode::OK, "1"), "{kind}: the same");
        let stored = read(again).await;

        let changed = put(&service, &path, &second, ("if-match", &tag)).await;
        assert_eq!((changed.status(), header(&changed, "document-version")), (StatusCode::OK, "2"), "{kind}: changed");
        let new_tag = header(&changed, "etag").to_owned();
        problem(put(&service, &path, &first, ("if-match", &tag)).await, 412, "precondition_failed").await;
        assert_eq!(read(service.get(&format!("{path}?version=1")).await).await, stored, "{kind}: the old one");
        problem(service.get(&format!("{path}?version=7")).await, 404, "not_found").await;
        let other = service.client.get(service.at(&path)).header("if-match", &tag).send();
        problem(other.await.expect("an answer"), 412, "precondition_failed").await;
        let same = service.client.get(service.at(&path)).header("if-match", &new_tag).send();
        assert_eq!(same.await.expect("an answer").status(), StatusCode::OK, "the version that is there");
        let known = service.client.get(service.at(&path)).header("if-none-match", &new_tag).send();
        assert_eq!(known.await.expect("an answer").status(), StatusCode::NOT_MODIFIED, "{kind}: the caller has it");

        let list = read(service.get(&format!("/v1/{kind}")).await).await;
        let items = list["items"].as_array().expect("a list");
        let own = items.iter().find(|item| item["name"] == "mine").expect("ours");
        assert_eq!((&own["version"], &own["built_in"]), (&json!(2), &json!(false)), "{kind}: {own}");
        assert!(items.iter().any(|item| item["built_in"] == true), "{kind}: what comes with the program");

        problem(delete(&service, &path, &tag).await, 412, "precondition_failed").await;
        assert_eq!(delete(&service, &path, &new_tag).await.status(), StatusCode::NO_CONTENT, "{kind}: removed");
        problem(delete(&service, &path, "").await, 404, "not_found").await;
        problem(service.get(&path).await, 404, "not_found").await;
        let anew = put(&service, &path, &first, NOTHING).await;
        assert_eq!(header(&anew, "document-version"), "3", "{kind}: a version is never used twice");
    }
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_used_is_refused() {
    let service = Service::start(&[("max_stored_documents", "1")]).await;
    let wrong = json!({"kind": "biped", "roles": {"left_knee": ["a"]}, "color": "red"});
    let wrong = problem(put(&service, "/v1/rigs/mine", &wrong, NOTHING).await, 422, "unknown_field").await;
    assert_eq!(wrong["errors"][0]["pointer"], "/color", "where: {wrong}");
    let wrong = json!({"kind": "biped", "roles": {"left_shinn": ["a"]}});
    let wrong = problem(put(&service, "/v1/rigs/mine", &wrong, NOTHING).await, 422, "unknown_name").await;
    assert_eq!(wrong["errors"][0]["did_you_mean"][0], "left_shin", "the nearest: {wrong}");
    let mut other = rig("a");
    other["name"] = json!("other");
    problem(put(&service, "/v1/rigs/mine", &other, NOTHING).await, 422, "invalid_value").await;
    problem(put(&service, "/v1/presets/mine", &json!({"sorce": {}}), NOTHING).await, 422, "unknown_field").await;
    problem(put(&service, "/v1/presets/Not%20A%20Name", &json!({}), NOTHING).await, 422, "invalid_value").await;
    problem(put(&service, "/v1/presets/default", &json!({}), NOTHING).await, 409, "built_in").await;
    problem(delete(&service, "/v1/rigs/mixamo", "").await, 409, "built_in").await;
    assert_eq!(put(&service, "/v1/rigs/one", &rig("a"), NOTHING).await.status(), StatusCode::CREATED, "room for one");
    let full = problem(put(&service, "/v1/rigs/two", &rig("a"), NOTHING).await, 409, "too_many_documents").await;
    assert_eq!(full["limit"], "stored_documents", "which limit: {full}");
    assert_eq!(put(&service, "/v1/rigs/one", &rig("b"), NOTHING).await.status(), StatusCode::OK, "changing is no more");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_keep_what_they_were_asked_for_with() {
    let service = Service::start(&[]).await;
    put(&service, "/v1/presets/say", &json!({"align": "off", "source": {"root": "a"}}), NOTHING).await;
    put(&service, "/v1/rigs/mine", &rig("huefte"), NOTHING).await;
    let asset = service.upload(BVH).await;
    let files = json!({"source": {"asset": asset}, "target": {"asset": asset}});
    let mut body = files.clone();
    (body["preset"], body["config"]) = (json!("say"), json!({"source": {"ground": "b"}}));
    let job = read(service.post("/v1/jobs", &body).await).await;
    assert_eq!(job["preset"], json!({"name": "say", "version": 1}), "which preset: {job}");
    assert_eq!(job["rigs"], json!([{"name": "mine", "version": 1}]), "which rigs: {job}");
    let id = job["id"].as_str().expect("an id").to_owned();
    service.until(&id, "succeeded").await;

    put(&service, "/v1/rigs/mine", &rig("becken"), NOTHING).await;
    delete(&service, "/v1/presets/say", "").await;
    let retried = read(service.post(&format!("/v1/jobs/{id}/retry"), &json!({})).await).await;
    assert_eq!(retried["rigs"], job["rigs"], "the same again is the same");
    service.until(retried["id"].as_str().expect("an id"), "succeeded").await;
    let gone = problem(service.post("/v1/jobs", &body).await, 422, "unknown_preset").await;
    assert_eq!(gone["errors"][0]["pointer"], "/preset", "where: {gone}");
    body["preset"] = json!("plain_fkk");
    let misspelled = problem(service.post("/v1/jobs", &body).await, 422, "unknown_preset").await;
    assert_eq!(misspelled["errors"][0]["did_you_mean"], json!(["plain_fk"]), "the nearest: {misspelled}");
    service.stop().await;
}

/// The mannequin with names that nobody knows.
fn foreign() -> Vec<u8> {
    let names = [("pelvis", "knorx"), ("thigh", "zwem"), ("calf", "plok"), ("foot", "trib"), ("ball", "gnur")];
    let names =
        names.into_iter().chain([("clavicle", "fleb"), ("upperarm", "drus"), ("lowerarm", "hapf"), ("hand", "wilk")]);
    let names: Vec<(&str, &str)> = names.chain([("neck", "jorp"), ("head", "quam"), ("spine", "brev")]).collect();
    let bytes = samples::mannequin();
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let mut text = String::from_utf8(bytes[20..20 + length].to_vec()).expect("text");
    for (known, unknown) in names {
        text = text.replace(&format!("\"{known}"), &format!("\"{unknown}"));
    }
    while !text.len().is_multiple_of(4) {
        text.push(' ');
    }
    let mut glb = bytes[..12].to_vec();
    glb.extend((text.len() as u32).to_le_bytes());
    glb.extend(&bytes[16..20]);
    glb.extend(text.as_bytes());
    glb.extend(&bytes[20 + length..]);
    let total = (glb.len() as u32).to_le_bytes();
    glb[8..12].copy_from_slice(&total);
    glb
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rig_of_ones_own_is_recognized_from_then_on() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let client = reqwest::Client::builder().no_proxy().build().expect("a client");
    let url = format!("{}/v1/assets?filename=hero.glb", server.url);
    let asset = read(client.post(url).body(foreign()).send().await.expect("an answer")).await;
    let path = format!("{}{}", server.url, asset["skeleton"].as_str().expect("a place"));
    let before = read(client.get(&path).send().await.expect("an answer")).await;
    assert_ne!(before["rigs"][0]["recognised_as"], "our_hero", "nobody has taught it: {}", before["rigs"][0]["kind"]);

    let template = json!({
        "kind": "biped",
        "sides": [["l"], ["r"]],
        "roles": {
            "pelvis": ["knorx"], "spine": ["brev_01", "brev_02", "brev_03", "brev_04", "brev_05"], "neck": ["jorp_01", "jorp_02"],
            "head": ["quam"], "clavicle": ["fleb_{side}"], "upper_arm": ["drus_{side}"], "forearm": ["hapf_{side}"],
            "hand": ["wilk_{side}"], "thigh": ["zwem_{side}"], "shin": ["plok_{side}"], "foot": ["trib_{side}"],
            "toe": ["gnur_{side}"]
        }
    });
    let url = format!("{}/v1/rigs/our_hero", server.url);
    let kept = client.put(url).json(&template).send().await.expect("an answer");
    assert_eq!(kept.status(), StatusCode::CREATED, "{}", kept.text().await.expect("text"));
    let after = read(client.get(&path).send().await.expect("an answer")).await;
    assert_eq!(after["rigs"][0]["recognised_as"], "our_hero", "nothing stale is answered");
    assert_eq!(after["rigs"][0]["roles"]["left_forearm"], "hapf_l", "{}", after["rigs"][0]["roles"]);
    let source = format!("{}/v1/assets?filename=walk.glb", server.url);
    let source = read(client.post(source).body(samples::walk_clip()).send().await.expect("an answer")).await;
    let files = json!({"source": {"asset": source["id"]}, "target": {"asset": asset["id"]}});
    let url = format!("{}/v1/mapping-suggestions", server.url);
    let suggestion = read(client.post(url).json(&files).send().await.expect("an answer")).await;
    assert_eq!(suggestion["rigs"]["target"]["recognised_as"], "our_hero", "suggestions know it, too");
    let url = format!("{}/v1/jobs", server.url);
    let job = client.post(url).json(&files).header("prefer", "wait=30").send().await.expect("an answer");
    let job = read(job).await;
    assert_eq!((&job["state"], &job["rigs"][0]["name"]), (&json!("succeeded"), &json!("our_hero")), "{job}");
    let url = format!("{}/v1/jobs/{}/report", server.url, job["id"].as_str().expect("an id"));
    let report = read(client.get(url).send().await.expect("an answer")).await;
    assert_eq!(report["rigs"]["target"]["recognised_as"], "our_hero", "so does the job: {}", report["rigs"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn everything_built_in_can_be_read() {
    let service = Service::start(&[]).await;
    for path in ["/v1/rigs", "/v1/presets"] {
        let list = read(service.get(path).await).await;
        let items = list["items"].as_array().expect("a list");
        assert!(items.len() > 2 && items.iter().all(|item| item["built_in"] == true), "{path}: {list}");
    }
    for (kind, documents) in [("rigs", engine::built_in_rigs()), ("presets", engine::built_in_presets())] {
        for (name, document) in documents {
            let answer = service.get(&format!("/v1/{kind}/{name}")).await;
            assert!(header(&answer, "document-version").is_empty(), "{kind}/{name} has no version");
            assert_eq!(read(answer).await, document, "{kind}/{name}");
        }
    }
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rig_is_learned_from_an_uploaded_character() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let client = reqwest::Client::builder().no_proxy().build().expect("a client");
    let url = format!("{}/v1/assets?filename=mannequin.glb", server.url);
    let upload = client.post(url).body(samples::mannequin()).send().await.expect("an answer");
    let asset = taken(upload).await;
    let put = |body: Value| client.put(format!("{}/v1/rigs/hero", server.url)).json(&body).send();
    let kept = put(json!({ "asset": asset })).await.expect("an answer");
    assert_eq!(kept.status(), StatusCode::CREATED, "kept");
    let template = read(kept).await;
    assert_eq!(template["name"], "hero", "under the name of the request");
    assert_eq!(template["roles"]["left_forearm"], json!(["lowerarm_l"]), "{template}");
    let skeleton = format!("{}/v1/assets/{asset}/skeleton", server.url);
    let known = read(client.get(skeleton).send().await.expect("an answer")).await;
    assert_eq!(known["rigs"][0]["recognised_as"], "hero", "from then on it is known by that name");
    problem(put(json!({"asset": 7})).await.expect("an answer"), 422, "invalid_value").await;
    problem(put(json!({"asset": "asset_nowhere"})).await.expect("an answer"), 422, "invalid_value").await;
}
