//! Sending spans to a collector, as OTLP over HTTP.

use std::{
    future::Future,
    pin::Pin,
    sync::{
        OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use bytes::Bytes;
use opentelemetry::{KeyValue, trace::TracerProvider as _};
use opentelemetry_http::{HttpClient, HttpError, Request, Response};
use opentelemetry_otlp::{ExporterBuildError, Protocol, SpanExporter, WithExportConfig, WithHttpConfig};
use opentelemetry_sdk::{
    Resource,
    resource::EnvResourceDetector,
    trace::{SdkTracer, SdkTracerProvider},
};
use tokio::runtime::Handle;

/// How long one batch may take to be sent.
const TIMEOUT: Duration = Duration::from_secs(5);
/// How long the end of the process waits for the last batches.
const LAST_WAIT: Duration = Duration::from_secs(3);
/// Where collectors take spans, below their address.
const PATH: &str = "/v1/traces";

static STARTED: OnceLock<Exporting> = OnceLock::new();

#[derive(Debug)]
struct Exporting {
    provider: SdkTracerProvider,
    tracer: SdkTracer,
}

/// Why no traces can be sent.
#[derive(Debug, thiserror::Error)]
#[error("traces cannot be sent to '{endpoint}': {reason}; --otlp-endpoint names it")]
pub struct TracesError {
    /// The collector.
    pub endpoint: String,
    /// Why.
    pub reason: String,
}

/// Starts sending spans to the collector at that address, such as `http://127.0.0.1:4318`; nothing where there is no address. A process has
/// one collector: a second call changes nothing. To be called on a runtime, which does the sending.
///
/// Headers for the collector, what all spans say of this process, how many of them wait and which traces are sampled are taken from the
/// variables that OpenTelemetry has for that (`OTEL_EXPORTER_OTLP_HEADERS`, `OTEL_RESOURCE_ATTRIBUTES`, `OTEL_BSP_…`,
/// `OTEL_TRACES_SAMPLER`).
///
/// # Errors
/// When the address is none.
pub fn start_traces(endpoint: &str, role: &'static str) -> Result<(), TracesError> {
    if endpoint.is_empty() || STARTED.get().is_some() {
        return Ok(());
    }
    let failed = |reason: String| TracesError { endpoint: endpoint.to_owned(), reason };
    let client = Client::new().map_err(|error| failed(error.to_string()))?;
    let exporter = exporter(endpoint, client).map_err(|error| failed(error.to_string()))?;
    let resource = Resource::builder_empty()
        .with_attributes([
            KeyValue::new("service.name", "retargetd"),
            KeyValue::new("service.version", env!("CARGO_PKG_VERSION")),
            KeyValue::new("process.pid", i64::from(std::process::id())),
            KeyValue::new("retargetd.role", role),
        ])
        .with_detector(Box::new(EnvResourceDetector::new()));
    let provider = SdkTracerProvider::builder().with_resource(resource.build()).with_batch_exporter(exporter).build();
    let tracer = provider.tracer("retargetd");
    // Where two start at the same time, the first one stays.
    let _ = STARTED.set(Exporting { provider, tracer });
    Ok(())
}

fn exporter(endpoint: &str, client: Client) -> Result<SpanExporter, ExporterBuildError> {
    let address = endpoint.trim_end_matches('/');
    let address = address.strip_suffix(PATH).unwrap_or(address);
    SpanExporter::builder()
        .with_http()
        .with_http_client(client)
        .with_protocol(Protocol::HttpBinary)
        .with_endpoint(format!("{address}{PATH}"))
        .with_timeout(TIMEOUT)
        .build()
}

/// Sends what is left, for a while that is bounded. Spans that end later are lost.
pub async fn stop_traces() {
    let Some(exporting) = STARTED.get() else { return };
    let provider = exporting.provider.clone();
    // What the collector does not take is dropped, which has been said already.
    let _ = tokio::task::spawn_blocking(move || provider.shutdown_with_timeout(LAST_WAIT)).await;
}

/// What makes spans; `None` where traces are off.
pub(super) fn tracer() -> Option<&'static SdkTracer> {
    STARTED.get().map(|exporting| &exporting.tracer)
}

/// Sends batches on the runtime of the service, since they come from a thread that has none.
#[derive(Debug)]
struct Client {
    client: reqwest::Client,
    runtime: Handle,
    is_failing: AtomicBool,
}

impl Client {
    fn new() -> Result<Self, reqwest::Error> {
        let client = reqwest::Client::builder().timeout(TIMEOUT).build()?;
        Ok(Self { client, runtime: Handle::current(), is_failing: AtomicBool::new(false) })
    }

    async fn send(&self, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
        let (client, request) = (self.client.clone(), reqwest::Request::try_from(request)?);
        let sent = self.runtime.spawn(async move {
            let answer = client.execute(request).await?;
            let (status, headers) = (answer.status(), answer.headers().clone());
            Ok::<_, reqwest::Error>((status, headers, answer.bytes().await?))
        });
        let (status, headers, body) = sent.await??;
        let mut response = Response::new(body);
        (*response.status_mut(), *response.headers_mut()) = (status, headers);
        Ok(response)
    }

    /// Says once that spans are lost, and once that they are no longer.
    fn tell(&self, failure: Option<String>) {
        let was_failing = self.is_failing.swap(failure.is_some(), Ordering::Relaxed);
        match failure {
            Some(reason) if !was_failing => tracing::warn!(reason, "the collector takes no traces; they are dropped"),
            None if was_failing => tracing::info!("the collector takes traces again"),
            _ => {}
        }
    }
}

impl HttpClient for Client {
    fn send_bytes<'a, 'b>(
        &'a self,
        request: Request<Bytes>,
    ) -> Pin<Box<dyn Future<Output = Result<Response<Bytes>, HttpError>> + Send + 'b>>
    where
        'a: 'b,
        Self: 'b,
    {
        Box::pin(async move {
            let sent = self.send(request).await;
            self.tell(match &sent {
                Ok(answer) if answer.status().is_success() => None,
                Ok(answer) => Some(answer.status().to_string()),
                Err(error) => Some(error.to_string()),
            });
            sent
        })
    }
}
