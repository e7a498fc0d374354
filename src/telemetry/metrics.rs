//! Every metric, in one place: name, kind, labels, meaning.

use std::{sync::OnceLock, time::Duration};

use metrics_exporter_prometheus::{BuildError, Matcher, PrometheusBuilder, PrometheusHandle};

/// What kind of number a metric is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MetricKind {
    /// Only grows.
    Counter,
    /// Goes up and down.
    Gauge,
    /// A distribution of seconds.
    Histogram,
}

macro_rules! metrics_table {
    ($( $variant:ident = $name:literal, $kind:ident, [$($label:literal),*], $help:literal; )+) => {
        /// The metrics.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Metric { $( #[doc = $help] $variant, )+ }

        impl Metric {
            /// All of them.
            pub const ALL: &'static [Self] = &[$( Self::$variant, )+];

            /// The name that monitoring sees. Never renamed.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $( Self::$variant => $name, )+ }
            }

            /// What kind of number it is.
            #[must_use]
            pub const fn kind(self) -> MetricKind {
                match self { $( Self::$variant => MetricKind::$kind, )+ }
            }

            /// The names of its labels, all of closed sets of values.
            #[must_use]
            pub const fn labels(self) -> &'static [&'static str] {
                match self { $( Self::$variant => &[$($label),*], )+ }
            }

            /// What it means.
            #[must_use]
            pub const fn help(self) -> &'static str {
                match self { $( Self::$variant => $help, )+ }
            }
        }
    };
}

metrics_table! {
    HttpRequests = "retargetd_http_requests_total", Counter, ["route", "method", "status"], "Requests answered";
    HttpRequestDuration = "retargetd_http_request_duration_seconds", Histogram, ["route", "method"], "Time until the head of the answer";
    HttpRequestsInFlight = "retargetd_http_requests_in_flight", Gauge, [], "Requests being worked on";
    AdmissionRejected = "retargetd_admission_rejected_total", Counter, ["reason"], "Work turned away because of load";
    JobsSubmitted = "retargetd_jobs_submitted_total", Counter, [], "Jobs taken on";
    BatchesSubmitted = "retargetd_batches_submitted_total", Counter, [], "Batches taken on";
    JobsFinished = "retargetd_jobs_finished_total", Counter, ["state", "code"], "Jobs that came to an end";
    Verdicts = "retargetd_verdicts_total", Counter, ["verdict"], "Jobs with results, by what their reports say of them";
    JobAttempts = "retargetd_job_attempts_total", Counter, [], "Starts of jobs";
    JobsQueued = "retargetd_jobs_queued", Gauge, [], "Jobs waiting for a worker";
    JobsOldestQueued = "retargetd_jobs_oldest_queued_seconds", Gauge, [], "How long the job has waited that has waited longest";
    JobsRunning = "retargetd_jobs_running", Gauge, [], "Jobs being worked on";
    JobsStuck = "retargetd_jobs_stuck", Gauge, [], "Jobs that ignore their deadline";
    WorkerSlots = "retargetd_worker_slots", Gauge, [], "Jobs that can run at the same time";
    EngineProcesses = "retargetd_engine_processes", Gauge, [], "Processes that the engine works in";
    EngineProcessesLost = "retargetd_engine_processes_lost_total", Counter, [], "Engine processes that died at work";
    EventStreams = "retargetd_event_streams", Gauge, [], "Event streams that are open";
    JobQueueWait = "retargetd_job_queue_wait_seconds", Histogram, [], "Time between submission and start";
    JobDuration = "retargetd_job_duration_seconds", Histogram, ["phase"], "Time of each phase of a job that succeeded";
    AssetBytesReceived = "retargetd_asset_bytes_received_total", Counter, [], "Bytes of uploaded files";
    StoredBytes = "retargetd_stored_bytes", Gauge, [], "Bytes of all stored files";
    LastJobFinished = "retargetd_last_job_finished_timestamp_seconds", Gauge, [], "When a job last came to an end";
    WebhookDeliveries = "retargetd_webhook_deliveries_total", Counter, ["result"], "Attempts to tell webhooks what happened";
    OutboundBlocked = "retargetd_outbound_blocked_total", Counter, ["reason"], "URLs of callers that lead where the service does not go";
    FreeDisk = "retargetd_free_disk_bytes", Gauge, [], "Bytes that are free on the disk of the data folder";
    DatabaseConnections = "retargetd_database_connections", Gauge, ["pool", "state"], "Open connections to the database, by what they are for, in use or idle";
    BuildInfo = "retargetd_build_info", Gauge, ["version"], "Always one";
}

impl Metric {
    /// Adds to a counter.
    pub fn count<const N: usize>(self, labels: [(&'static str, String); N], amount: u64) {
        metrics::counter!(self.name(), &labels[..]).increment(amount);
    }

    /// Adds to a gauge; `change` may be negative.
    pub fn change(self, change: f64) {
        metrics::gauge!(self.name()).increment(change);
    }

    /// Sets a gauge.
    pub fn set<const N: usize>(self, labels: [(&'static str, String); N], value: f64) {
        metrics::gauge!(self.name(), &labels[..]).set(value);
    }

    /// Adds an observation to a distribution.
    pub fn observe<const N: usize>(self, labels: [(&'static str, String); N], duration: Duration) {
        metrics::histogram!(self.name(), &labels[..]).record(duration.as_secs_f64());
    }
}

/// The numbers collected so far.
#[derive(Clone, Debug)]
pub struct Metrics(PrometheusHandle);

impl Metrics {
    /// Starts collecting. A process has one recorder: a second call gives the same one.
    ///
    /// # Errors
    /// When the recorder cannot be set up.
    pub fn start() -> Result<Self, BuildError> {
        static STARTED: OnceLock<PrometheusHandle> = OnceLock::new();
        if let Some(handle) = STARTED.get() {
            return Ok(Self(handle.clone()));
        }
        let buckets = [0.001, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 120.0];
        let builder =
            PrometheusBuilder::new().set_buckets_for_metric(Matcher::Suffix("_seconds".to_owned()), &buckets)?;
        let handle = STARTED.get_or_init(|| {
            let recorder = builder.build_recorder();
            let handle = recorder.handle();
            if metrics::set_global_recorder(recorder).is_ok() {
                describe();
            }
            handle
        });
        Ok(Self(handle.clone()))
    }

    /// The text that Prometheus reads.
    #[must_use]
    pub fn render(&self) -> String {
        self.0.run_upkeep();
        observe_process();
        self.0.render()
    }
}

/// Measures this process, where the system tells, under the names that every Prometheus knows.
#[cfg(target_os = "linux")]
fn observe_process() {
    /// Of processor time, in which the kernel tells it to programs.
    const TICKS_PER_SECOND: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Behind the name, which may have anything in it, fields are numbered from the state, which is 3.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let field = |number: usize| fields.get(number - 3).and_then(|field| field.parse::<f64>().ok()).unwrap_or(0.0);
    metrics::gauge!("process_cpu_seconds_total").set((field(14) + field(15)) / TICKS_PER_SECOND);
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let resident =
        status.lines().find_map(|line| line.strip_prefix("VmRSS:")?.split_whitespace().next()?.parse::<f64>().ok());
    if let Some(kibibytes) = resident {
        metrics::gauge!("process_resident_memory_bytes").set(kibibytes * 1024.0);
    }
    if let Ok(files) = std::fs::read_dir("/proc/self/fd") {
        metrics::gauge!("process_open_fds").set(files.count() as f64);
    }
}

#[cfg(not(target_os = "linux"))]
fn observe_process() {}

fn describe() {
    for metric in Metric::ALL {
        match metric.kind() {
            MetricKind::Counter => metrics::describe_counter!(metric.name(), metric.help()),
            MetricKind::Gauge => metrics::describe_gauge!(metric.name(), metric.help()),
            MetricKind::Histogram => metrics::describe_histogram!(metric.name(), metric.help()),
        }
    }
    // From the start, so that the first of anything is a step and not a new line.
    for metric in Metric::ALL.iter().filter(|metric| metric.labels().is_empty()) {
        match metric.kind() {
            MetricKind::Counter => metric.count([], 0),
            MetricKind::Gauge => metric.set([], 0.0),
            MetricKind::Histogram => {}
        }
    }
    for reason in ["queue_full", "quota", "records"] {
        Metric::AdmissionRejected.count([("reason", reason.to_owned())], 0);
    }
    for verdict in ["pass", "warn", "fail", "not_applicable"] {
        Metric::Verdicts.count([("verdict", verdict.to_owned())], 0);
    }
    for result in ["delivered", "retried", "given_up", "gone"] {
        Metric::WebhookDeliveries.count([("result", result.to_owned())], 0);
    }
    for reason in ["no_url", "scheme", "credentials", "denied", "loopback", "private", "link_local"] {
        Metric::OutboundBlocked.count([("reason", reason.to_owned())], 0);
    }
    for state in ["succeeded", "failed", "canceled"] {
        Metric::JobsFinished.count([("state", state.to_owned()), ("code", String::new())], 0);
    }
    Metric::BuildInfo.set([("version", env!("CARGO_PKG_VERSION").to_owned())], 1.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_labels_are_pinned() {
        let seen: Vec<String> =
            Metric::ALL.iter().map(|metric| format!("{}{{{}}}", metric.name(), metric.labels().join(","))).collect();
        let expected = [
            "retargetd_http_requests_total{route,method,status}",
            "retargetd_http_request_duration_seconds{route,method}",
            "retargetd_http_requests_in_flight{}",
            "retargetd_admission_rejected_total{reason}",
            "retargetd_jobs_submitted_total{}",
            "retargetd_batches_submitted_total{}",
            "retargetd_jobs_finished_total{state,code}",
            "retargetd_verdicts_total{verdict}",
            "retargetd_job_attempts_total{}",
            "retargetd_jobs_queued{}",
            "retargetd_jobs_oldest_queued_seconds{}",
            "retargetd_jobs_running{}",
            "retargetd_jobs_stuck{}",
            "retargetd_worker_slots{}",
            "retargetd_engine_processes{}",
            "retargetd_engine_processes_lost_total{}",
            "retargetd_event_streams{}",
            "retargetd_job_queue_wait_seconds{}",
            "retargetd_job_duration_seconds{phase}",
            "retargetd_asset_bytes_received_total{}",
            "retargetd_stored_bytes{}",
            "retargetd_last_job_finished_timestamp_seconds{}",
            "retargetd_webhook_deliveries_total{result}",
            "retargetd_outbound_blocked_total{reason}",
            "retargetd_free_disk_bytes{}",
            "retargetd_database_connections{pool,state}",
            "retargetd_build_info{version}",
        ];
        assert_eq!(seen, expected, "dashboards depend on these names");
    }

    #[test]
    fn what_is_counted_is_rendered() {
        let metrics = Metrics::start().expect("the recorder starts");
        Metric::AdmissionRejected.count([("reason", "test".to_owned())], 2);
        let text = Metrics::start().expect("a second start").render();
        for first in [
            "verdicts_total{verdict=\"fail\"}",
            "webhook_deliveries_total{result=\"given_up\"}",
            "outbound_blocked_total{reason=\"private\"}",
        ] {
            assert!(text.contains(first), "{first} is there before it happens: {text}");
        }
        assert!(text.contains("retargetd_admission_rejected_total{reason=\"test\"}"), "the counter is there: {text}");
        assert_eq!(metrics.render().is_empty(), text.is_empty(), "both are the same recorder");
    }
}
