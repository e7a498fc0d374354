//! However many jobs one caller asks for, and whatever becomes of them, their records have bounds: the oldest ended go, and where nothing has
//! ended, the refusal says which bound it is.

use serde_json::{Value, json};

use super::{
    studio::{CLIP, Customer, Place, edit_of},
    support::ServiceProcess,
};

/// A service with one of these bounds, a client of it and the file that its jobs are about.
async fn bounded(workers: &str, bound: [&str; 2]) -> (Place, ServiceProcess, Customer, String) {
    let place = Place::folder();
    let service = place.serve(&["--workers", workers, bound[0], bound[1]], &[]);
    let customer = Customer::new();
    let asset = customer.upload(&service.url, CLIP).await.expect("is taken");
    (place, service, customer, asset)
}

async fn post(url: &str, path: &str, body: &Value) -> (u16, Value) {
    let client = reqwest::Client::builder().no_proxy().build().expect("a client");
    let answer = client.post(format!("{url}{path}")).json(body).send().await.expect("an answer");
    (answer.status().as_u16(), answer.json().await.unwrap_or_default())
}

async fn kept(customer: &Customer, url: &str) -> usize {
    customer.list(url, "/v1/jobs").await.len()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_oldest_ended_jobs_make_room_for_new_ones() {
    for bound in ["--max-principal-records", "--max-records"] {
        let (_place, service, mut customer, asset) = bounded("1", [bound, "30"]).await;
        for number in 0..60 {
            assert!(customer.ask(&service.url, &asset).await, "{bound}: job {number} is taken");
            if number % 10 == 9 {
                let newest = customer.promised.last().expect("one").clone();
                while customer.job(&service.url, &newest).await.expect("is there")["state"] != "succeeded" {
                    tokio::time::sleep(std::time::Duration::from_millis(20)).await;
                }
            }
        }
        let first = format!("/v1/jobs/{}", customer.promised[0]);
        assert_eq!(customer.status(&service.url, &first).await, 404, "{bound}: the first has gone");
        let last = format!("/v1/jobs/{}", customer.promised[59]);
        assert_eq!(customer.status(&service.url, &last).await, 200, "{bound}: the last is there");
        assert!(kept(&customer, &service.url).await <= 30, "{bound}: no more than may be");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn where_nothing_has_ended_the_refusal_names_the_bound() {
    let (_place, service, customer, asset) = bounded("0", ["--max-principal-records", "5"]).await;
    for _ in 0..5 {
        assert_eq!(post(&service.url, "/v1/jobs", &edit_of(&asset)).await.0, 202, "there is room");
    }
    let (status, problem) = post(&service.url, "/v1/jobs", &edit_of(&asset)).await;
    assert_eq!(status, 429, "{problem}");
    assert!(problem.to_string().contains("principal_records"), "which bound it is: {problem}");
    assert_eq!(kept(&customer, &service.url).await, 5, "nothing has gone that waits");

    let (_place, service, _, asset) = bounded("0", ["--max-principal-record-bytes", "1MiB"]).await;
    let mut body = edit_of(&asset);
    body["labels"] = json!({});
    let mut refused = Value::Null;
    for number in 0..40 {
        body["config"]["output"] = json!({"clip_name": format!("{number}{}", "x".repeat(100_000))});
        let (status, problem) = post(&service.url, "/v1/jobs", &body).await;
        if status != 202 {
            refused = problem;
            break;
        }
    }
    assert!(refused.to_string().contains("principal_record_bytes"), "bytes are bounded, too: {refused}");
}

/// Neither what is canceled at once nor what cannot run ever waits, so no bound of the queue sees it.
#[tokio::test(flavor = "multi_thread")]
async fn what_never_runs_is_bounded_as_well() {
    let (_place, service, customer, asset) = bounded("0", ["--max-principal-records", "30"]).await;
    for _ in 0..60 {
        let (status, job) = post(&service.url, "/v1/jobs", &edit_of(&asset)).await;
        assert_eq!(status, 202, "{job}");
        customer.cancel(&service.url, job["id"].as_str().expect("an id")).await;
    }
    assert!(kept(&customer, &service.url).await <= 30, "canceled jobs go");
    let unknown = json!({"asset": "ast_00000000000000000000000000"});
    for _ in 0..5 {
        let items: Vec<Value> = (0..20).map(|_| json!({"source": unknown, "target": unknown})).collect();
        let (status, batch) = post(&service.url, "/v1/batches", &json!({"items": items})).await;
        assert_eq!(status, 202, "{batch}");
    }
    assert!(kept(&customer, &service.url).await <= 30, "failed items go");
    let batches = customer.list(&service.url, "/v1/batches").await.len();
    assert!(batches <= 2, "and their batches with them: {batches}");
}
