//! Asking for jobs, beyond the job itself: checks without a job, lists, quotas, and pages of other origins.

use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

use super::support::{BVH, Service, header, json as read, problem, taken};

#[tokio::test(flavor = "multi_thread")]
async fn validate_only_checks_and_asks_for_nothing() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let mut body = json!({"source": {"asset": asset}, "target": {"asset": asset}, "validate_only": true});
    let checked = service.client.post(service.at("/v1/jobs")).header("idempotency-key", "a").json(&body).send().await;
    let checked = checked.expect("an answer");
    assert_eq!(checked.status(), StatusCode::OK, "nothing was taken on");
    let checked = read(checked).await;
    assert_eq!(checked["target_bytes"], BVH.len(), "what the job would do: {checked}");
    assert_eq!(checked["inputs"]["source"]["asset"], asset.as_str(), "with what");
    assert_eq!(read(service.get("/v1/jobs").await).await["items"], json!([]), "there is no job");

    body["output"] = json!(["xyz"]);
    problem(service.post("/v1/jobs", &body).await, 422, "invalid_value").await;
    body["output"] = json!([]);
    body["source"] = json!({"asset": "ast_00000000000000000000000000"});
    problem(service.post("/v1/jobs", &body).await, 422, "unknown_asset").await;
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_are_listed_by_what_they_are() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let ask = async |labels: Value, config: Value| {
        let body = json!({"source": {"asset": asset}, "target": {"asset": asset}, "labels": labels, "config": config});
        let answer = service.client.post(service.at("/v1/jobs")).header("prefer", "wait=30").json(&body);
        read(answer.send().await.expect("an answer")).await
    };
    let first = ask(json!({"shot": "012"}), json!({})).await;
    let edit = ask(json!({"shot": "012"}), json!({"task": "edit"})).await;
    let failed = ask(json!({"shot": "013"}), json!({"pose": {"to": "t"}, "say": "refuse"})).await;
    assert_eq!((&first["kind"], &edit["kind"], &failed["kind"]), (&json!("retarget"), &json!("edit"), &json!("pose")));
    let ids = |page: &Value| -> Vec<Value> {
        page["items"].as_array().expect("a list").iter().map(|job| job["id"].clone()).collect()
    };
    let list = async |query: &str| read(service.get(&format!("/v1/jobs?{query}")).await).await;
    let (first, edit, failed) = (first["id"].clone(), edit["id"].clone(), failed["id"].clone());
    assert_eq!(ids(&list("label=shot=012").await), [edit.clone(), first.clone()], "by label");
    assert_eq!(ids(&list("label=shot%3D013&state=failed").await), [failed], "by label and state");
    assert_eq!(ids(&list("kind=edit").await), std::slice::from_ref(&edit), "by kind");
    assert_eq!(ids(&list("since=2020-01-01T00:00:00Z").await).len(), 3, "since long ago");
    assert_eq!(ids(&list("since=2120-01-01T00:00:00Z").await).len(), 0, "since tomorrow");

    let page = list("label=shot=012&limit=1").await;
    let cursor = page["next_cursor"].as_str().expect("there is more");
    assert_eq!(ids(&page), [edit], "the newest");
    assert_eq!(ids(&list(&format!("label=shot=012&limit=1&cursor={cursor}")).await), [first], "then the other");
    let other = service.get(&format!("/v1/jobs?label=shot=013&limit=1&cursor={cursor}")).await;
    problem(other, 400, "malformed_request").await;
    for wrong in ["state=done", "kind=dance", "label=shot", "since=yesterday", "labels=a=b"] {
        problem(service.get(&format!("/v1/jobs?{wrong}")).await, 400, "malformed_request").await;
    }
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn quotas_are_told_before_they_are_reached() {
    let service = Service::start(&[("max_principal_jobs", "2"), ("grace_period", "1s")]).await;
    let asset = service.upload(BVH).await;
    let first = service.job(&asset, "wait").await;
    assert_eq!(header(&first, "ratelimit-policy"), "\"jobs\";q=2;qu=\"unfinished-jobs\"", "the quota");
    assert_eq!(header(&first, "ratelimit"), "\"jobs\";r=1", "what is left");
    let first = taken(first).await;
    assert_eq!(header(&service.job(&asset, "wait").await, "ratelimit"), "\"jobs\";r=0", "nothing");
    let refused = service.job(&asset, "nothing").await;
    assert_eq!(header(&refused, "retry-after"), "2", "when to come again");
    let refused = problem(refused, 429, "quota_reached").await;
    assert_eq!((&refused["limit"], &refused["maximum"]), (&json!("principal_jobs"), &json!(2)), "which limit");
    let parts = ["source", "target"].map(|role| (role, BVH.replace("OFFSET", "OFFSET ")));
    let form = parts.into_iter().fold(reqwest::multipart::Form::new(), |form, (role, text)| {
        form.part(role, reqwest::multipart::Part::text(text).file_name("new.bvh"))
    });
    let refused = service.client.post(service.at("/v1/retarget")).multipart(form).send().await.expect("an answer");
    problem(refused, 429, "quota_reached").await;
    let usage = read(service.get("/v1/usage").await).await;
    assert_eq!(usage["unfinished_jobs"], json!({"count": 2, "maximum": 2}), "the same in numbers: {usage}");
    assert_eq!(
        usage["assets"],
        json!({"count": 1, "bytes": BVH.len()}),
        "of a one-shot that is refused, no file is kept: {usage}"
    );
    assert_eq!(usage["principal"], "anonymous", "whose that is");
    service.client.post(service.at(&format!("/v1/jobs/{first}/cancel"))).send().await.expect("an answer");
    service.until(&first, "canceled").await;
    assert_eq!(service.job(&asset, "nothing").await.status(), StatusCode::ACCEPTED, "there is room again");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_of_named_origins_may_call_and_no_others() {
    let own = "https://studio.example";
    let service = Service::start(&[("cors_origins", own), ("authentication", "keys")]).await;
    let beforehand = async |service: &Service, origin: &str| {
        let request = service.client.request(Method::OPTIONS, service.at("/v1/jobs")).header("origin", origin);
        let request = request.header("access-control-request-method", "POST");
        request
            .header("access-control-request-headers", "authorization,idempotency-key")
            .send()
            .await
            .expect("an answer")
    };
    let asked = beforehand(&service, own).await;
    assert_eq!(asked.status(), StatusCode::OK, "without a key, as browsers ask");
    assert_eq!(header(&asked, "access-control-allow-origin"), own, "this one may");
    assert!(header(&asked, "access-control-allow-headers").contains("idempotency-key"), "with what it sends");
    assert_eq!(header(&asked, "access-control-allow-credentials"), "", "never with cookies");
    let other = beforehand(&service, "https://elsewhere.example").await;
    assert_eq!(header(&other, "access-control-allow-origin"), "", "others may not");
    let refused = service.client.get(service.at("/v1/jobs")).header("origin", own).send().await.expect("an answer");
    assert_eq!(header(&refused, "access-control-allow-origin"), own, "problems can be read too");
    assert!(header(&refused, "access-control-expose-headers").contains("job-id"), "and our headers");
    problem(refused, 401, "unauthenticated").await;
    service.stop().await;

    let service = Service::start(&[]).await;
    let asked = beforehand(&service, own).await;
    assert_eq!(header(&asked, "access-control-allow-origin"), "", "nobody, unless the operator says so");
    service.stop().await;
}
