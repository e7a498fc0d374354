//! What a webhook is told, word by word.
//!
//! Everything about a job is what `GET /v1/jobs/{id}` says of it, under the same names: enough to know which job it is and what to fetch,
//! and no more.

use serde_json::{Value, json};

use crate::{
    jobs::FailureReason,
    store::{DeliveryEvent, DeliveryRecord, JobRecord, ResultRecord},
};

/// The body. `job` is the job that the event is of; what is gone by now can only be named.
pub(super) fn body(delivery: &DeliveryRecord, job: Option<(&JobRecord, &[ResultRecord])>) -> String {
    let data = match (&delivery.event, job) {
        (DeliveryEvent::Ping, _) => json!({"webhook": delivery.webhook}),
        (DeliveryEvent::JobEnded(..), Some((record, results))) => job_data(record, results),
        (DeliveryEvent::JobEnded(id, state), None) => json!({"id": id, "state": state.name()}),
    };
    json!({"type": delivery.event.name(), "timestamp": delivery.created_at.to_string(), "data": data}).to_string()
}

fn job_data(record: &JobRecord, results: &[ResultRecord]) -> Value {
    let result = |result: &ResultRecord| {
        json!({
            "id": result.id,
            "format": result.format,
            "file_name": result.file_name,
            "bytes": result.bytes,
            "sha256": result.sha256,
            "content": format!("/v1/results/{}/content", result.id),
        })
    };
    let mut data = json!({
        "id": record.id,
        "state": record.state.name(),
        "kind": record.kind().name(),
        "attempt": record.attempt,
        "created_at": record.created_at.to_string(),
        "labels": record.request.labels,
        "results": results.iter().map(result).collect::<Vec<_>>(),
        "warnings_count": record.warnings,
        "links": {"self": format!("/v1/jobs/{}", record.id)},
    });
    if let Some(judgment) = &record.judgment {
        data["verdict"] = judgment.verdict.name().into();
        data["verdict_reason"] = judgment.reason.as_str().into();
        if let Some(coverage) = judgment.coverage {
            data["coverage"] = coverage.into();
        }
    }
    let times = [("started_at", record.started_at), ("finished_at", record.finished_at)];
    for (name, time) in times.into_iter().chain([("expires_at", record.expires_at)]) {
        if let Some(time) = time {
            data[name] = time.to_string().into();
        }
    }
    if let Some(place) = &record.batch {
        (data["batch"], data["batch_item"]) = (place.batch.to_string().into(), place.item.into());
    }
    if let Some(before) = &record.retry_of {
        data["retry_of"] = before.to_string().into();
    }
    if let Some(failure) = &record.failure {
        data["problem"] = json!({"code": FailureReason::of(failure).name()});
    }
    data
}
