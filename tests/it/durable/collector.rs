//! A collector of traces inside the test: takes OTLP over HTTP and keeps every span.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use axum::{Router, body::Bytes, routing::post};
use opentelemetry_proto::tonic::{
    collector::trace::v1::ExportTraceServiceRequest,
    common::v1::{KeyValue, any_value::Value},
};
use prost::Message as _;
use tokio::{net::TcpListener, task::JoinHandle};

use crate::support::hexadecimal;

/// A span as it was sent, with the facts of its process among its own.
#[derive(Clone, Debug)]
pub(super) struct SeenSpan {
    pub(super) name: String,
    pub(super) trace: String,
    pub(super) id: String,
    pub(super) parent: String,
    /// When it began and ended, in nanoseconds.
    pub(super) times: (u64, u64),
    pub(super) is_failed: bool,
    pub(super) facts: BTreeMap<String, String>,
}

/// One that listens until it is dropped.
pub(super) struct Collector {
    pub(super) url: String,
    seen: Arc<Mutex<Vec<SeenSpan>>>,
    task: JoinHandle<()>,
}

impl Drop for Collector {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Collector {
    pub(super) async fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let url = format!("http://{}", listener.local_addr().expect("an address"));
        let seen = Arc::new(Mutex::new(Vec::new()));
        let keep = Arc::clone(&seen);
        let router = Router::new().route(
            "/v1/traces",
            post(async move |body: Bytes| {
                let request = ExportTraceServiceRequest::decode(body).expect("protobuf");
                keep.lock().expect("unbroken").extend(spans(request));
            }),
        );
        let task = tokio::spawn(async move { axum::serve(listener, router).await.expect("serves") });
        Self { url, seen, task }
    }

    /// Every span so far, by when they began.
    pub(super) fn spans(&self) -> Vec<SeenSpan> {
        let mut spans = self.seen.lock().expect("unbroken").clone();
        spans.sort_by_key(|span| span.times);
        spans
    }
}

fn spans(request: ExportTraceServiceRequest) -> Vec<SeenSpan> {
    let mut seen = Vec::new();
    for resource in request.resource_spans {
        let process = facts(resource.resource.unwrap_or_default().attributes);
        for span in resource.scope_spans.into_iter().flat_map(|scope| scope.spans) {
            seen.push(SeenSpan {
                name: span.name,
                trace: hexadecimal(&span.trace_id),
                id: hexadecimal(&span.span_id),
                parent: hexadecimal(&span.parent_span_id),
                times: (span.start_time_unix_nano, span.end_time_unix_nano),
                is_failed: span.status.is_some_and(|status| status.code == 2),
                facts: facts(span.attributes).into_iter().chain(process.clone()).collect(),
            });
        }
    }
    seen
}

fn facts(attributes: Vec<KeyValue>) -> BTreeMap<String, String> {
    let text = |value: Option<Value>| match value {
        Some(Value::StringValue(text)) => text,
        Some(Value::IntValue(number)) => number.to_string(),
        other => format!("{other:?}"),
    };
    attributes.into_iter().map(|fact| (fact.key, text(fact.value.and_then(|value| value.value)))).collect()
}
