//! The table of settings, and the struct that it becomes.

use std::{fmt, net::SocketAddr, path::PathBuf};

use super::{
    memory::MemoryBudget,
    networks::Networks,
    tokens::{KeyPlace, Names, TokenAlgorithms},
    value::{
        Authentication, ByteSize, HttpUrl, Isolation, LogFormat, Origins, Period, Periods, Secret, SettingValue,
        Switch, Unit, Workers,
    },
};

/// What is known about a setting before it has a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Its name, in snake case; flag and environment variable follow from it.
    pub name: &'static str,
    /// The text that stands when nobody says otherwise.
    pub default: &'static str,
    /// What it decides.
    pub help: &'static str,
    /// Whether it bounds what users may ask for, so that users are told of it.
    pub is_limit: bool,
    /// In what it is counted.
    pub unit: Unit,
}

impl Setting {
    /// The flag, such as `--max-file-bytes`.
    #[must_use]
    pub fn flag(&self) -> String {
        format!("--{}", self.name.replace('_', "-"))
    }

    /// The environment variable, such as `RETARGETD_MAX_FILE_BYTES`.
    #[must_use]
    pub fn variable(&self) -> String {
        format!("RETARGETD_{}", self.name.to_ascii_uppercase())
    }

    /// What is wrong with it, as an error.
    pub(super) fn error(&self, seen: String, expected: String, example: &'static str) -> SettingError {
        SettingError { flag: self.flag(), variable: self.variable(), seen, expected, example }
    }

    /// The name of the limit that it sets: its own without `max_`.
    #[must_use]
    pub fn limit_name(&self) -> &'static str {
        self.name.strip_prefix("max_").unwrap_or(self.name)
    }
}

/// A limit and its value, as users are told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitView {
    /// The setting that it comes from.
    pub setting: &'static Setting,
    /// Its value, in the setting's unit.
    pub value: f64,
}

/// One setting that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingError {
    /// The flag.
    pub flag: String,
    /// The environment variable.
    pub variable: String,
    /// What was seen.
    pub seen: String,
    /// What was expected.
    pub expected: String,
    /// A text that would do.
    pub example: &'static str,
}

/// Everything that is wrong with the settings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingErrors(pub Vec<SettingError>);

impl std::error::Error for SettingErrors {}

impl fmt::Display for SettingErrors {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} of the settings cannot be used:", self.0.len())?;
        for error in &self.0 {
            let SettingError { flag, variable, seen, expected, example } = error;
            write!(formatter, "\n  {flag} ({variable}) is '{seen}': {expected}; for example {example}")?;
        }
        Ok(())
    }
}

/// Makes the struct, the table and the reading from one list, so that none of them can be forgotten.
macro_rules! settings {
    ($( $(#[doc = $help:literal])+ $kind:ident $name:ident: $type:ty = $default:literal $(in $low:literal..=$high:literal)?; )+) => {
        /// Every setting, validated.
        #[derive(Clone, Debug, PartialEq, Eq)]
        pub struct Settings {
            $( $(#[doc = $help])+ pub $name: $type, )+
        }

        impl Settings {
            /// Every setting, in the order of the documentation.
            pub const TABLE: &'static [Setting] = &[
                $( Setting {
                    name: stringify!($name),
                    default: $default,
                    help: concat!($($help),+),
                    is_limit: settings!(@is_limit $kind),
                    unit: <$type as SettingValue>::UNIT,
                }, )+
            ];

            /// Validates. `look_up` gives the text of a setting, or `None` where the default stands.
            ///
            /// # Errors
            /// All settings that cannot be used, at once.
            pub fn read(look_up: impl Fn(&Setting) -> Option<String>) -> Result<Self, SettingErrors> {
                let mut errors = Vec::new();
                let mut table = Self::TABLE.iter();
                $( let $name: Option<$type> = {
                    let setting = table.next().expect("the table has one row per field");
                    read_one(setting, &look_up, settings!(@bounds $($low, $high)?), &mut errors)
                }; )+
                match ($($name,)+) {
                    ($(Some($name),)+) if errors.is_empty() => {
                        let settings = Self { $($name,)+ };
                        let contradictions = settings.contradictions();
                        if contradictions.is_empty() { Ok(settings) } else { Err(SettingErrors(contradictions)) }
                    }
                    _ => Err(SettingErrors(errors)),
                }
            }

            /// The settings that bound what users may ask for.
            #[must_use]
            pub fn limits(&self) -> Vec<LimitView> {
                let numbers = [$( self.$name.number(), )+];
                let rows = Self::TABLE.iter().zip(numbers);
                rows.filter_map(|(setting, number)| {
                    let value = number.filter(|_| setting.is_limit)?;
                    Some(LimitView { setting, value })
                })
                .collect()
            }
        }
    };
    (@is_limit limit) => { true };
    (@is_limit plain) => { false };
    (@bounds) => { (f64::NEG_INFINITY, f64::INFINITY) };
    (@bounds $low:literal, $high:literal) => { ($low as f64, $high as f64) };
}

settings! {
    /// Address and port to listen on; port 0 picks a free port
    plain listen: SocketAddr = "127.0.0.1:8080";
    /// Authentication: 'keys' requires a key or token from every caller, 'none' from no caller; 'auto' requires one if 'listen' is reachable from other machines or tokens are accepted
    plain authentication: Authentication = "auto";
    /// Identity provider whose tokens (JWT) are accepted besides keys, as named in their 'iss' claim; if empty, no tokens are accepted
    plain token_issuer: String = "";
    /// Audiences of this service, comma-separated; a token must name one of them in 'aud'
    plain token_audience: Names = "";
    /// Location of the issuer's public keys (a JWK set): an https URL or a file; if empty, it is looked up in '/.well-known/openid-configuration' of the issuer
    plain token_keys: KeyPlace = "";
    /// Accepted signature algorithms of tokens, comma-separated; only public-key algorithms
    plain token_algorithms: TokenAlgorithms = "RS256,PS256,ES256,EdDSA";
    /// Token claim that identifies the caller
    plain token_principal_claim: String = "sub";
    /// Token claim that lists scopes, as a space-separated string or an array; a JSON pointer such as '/realm_access/roles' selects a nested claim
    plain token_scope_claim: String = "scope";
    /// Prefix of 'read', 'write' and 'admin' in that claim
    plain token_scope_prefix: String = "retargetd:";
    /// Maximum difference between the clocks of the issuer and of the service
    plain token_leeway: Period = "30s" in 0..=600;
    /// Interval at which the issuer's keys are refreshed, so that withdrawn keys are no longer accepted
    plain token_keys_period: Period = "10m" in 0.05..=86_400;
    /// Minimum time between two fetches of the issuer's keys, even if a token names an unknown key
    plain token_keys_pause: Period = "10s" in 0.05..=3_600;
    /// Host names under which browsers may use the service without authentication, such as 'retarget.lan', comma-separated; IP addresses and 'localhost' are always allowed
    plain allowed_hosts: Names = "";
    /// Origins whose pages may call the service from a browser (CORS), such as 'https://studio.example', comma-separated; if empty, none
    plain cors_origins: Origins = "";
    /// Whether the page is served with which people see, correct and decide: on or off
    plain studio: Switch = "on";
    /// ONNX file of a pose model that finds the joints of drawings, in builds with the feature pose-model; if empty, they are found without one
    plain pose_model: String = "";
    /// Additional address and port for probes and metrics, without authentication; also available in a worker, which listens nowhere if this is empty
    plain probes_listen: Option<SocketAddr> = "";
    /// Folder for everything that must survive a restart; created if missing
    plain data: PathBuf = "retargetd-data";
    /// URL of the Postgres database that processes share; if empty, a SQLite file in the data folder
    plain database: Secret = "";
    /// Location of stored files, 's3://BUCKET/PREFIX' or 'file:///FOLDER'; if empty, the data folder
    plain blobs: String = "";
    /// Database connections of one process
    plain database_connections: u64 = "8" in 2..=1_000;
    /// Jobs that this process runs concurrently, or 'auto' for one per core; 0 leaves all jobs to other processes. While batch jobs run, one additional job outside of batches may run
    limit workers: Workers = "auto";
    /// Log format: auto, text or json
    plain log_format: LogFormat = "auto";
    /// Log filter, 'level' or 'level,module=level'
    plain log: String = "info";

    /// OpenTelemetry collector that receives traces (OTLP over HTTP), such as 'http://127.0.0.1:4318'; if empty, the value of OTEL_EXPORTER_OTLP_ENDPOINT, else no traces are made
    plain otlp_endpoint: HttpUrl = "";

    /// Bytes of one uploaded file
    limit max_file_bytes: ByteSize = "256MiB" in 1..=1_099_511_627_776_u64;
    /// Bytes of one multipart request, all parts together
    limit max_request_bytes: ByteSize = "512MiB" in 1..=4_398_046_511_104_u64;
    /// Bytes of one picture of a drawing, and of its mask
    limit max_picture_bytes: ByteSize = "32MiB" in 1_024..=1_073_741_824_u64;
    /// Bytes of a JSON request and of a retarget config
    limit max_document_bytes: ByteSize = "1MiB" in 1_024..=1_073_741_824_u64;
    /// Bytes that decoding one file may allocate
    limit max_decoded_bytes: ByteSize = "512MiB" in 1..=1_099_511_627_776_u64;
    /// Decoded bytes per encoded byte of a compressed part of a file
    limit max_decompression_ratio: u64 = "200" in 1..=1_000_000;
    /// Values in a JSON request; every number, string, array and object counts
    limit max_json_values: u64 = "100000" in 100..=100_000_000;
    /// Nesting depth of a JSON document
    limit max_json_depth: u64 = "64" in 1..=512;
    /// Nodes of one file
    limit max_nodes: u64 = "65536" in 1..=100_000_000;
    /// Depth of a joint hierarchy
    limit max_hierarchy_depth: u64 = "512" in 1..=65_536;
    /// Clips of one file
    limit max_clips: u64 = "256" in 1..=1_000_000;
    /// Key times of one clip
    limit max_frames_per_clip: u64 = "216000" in 1..=1_000_000_000;
    /// Nodes times key times, over all clips of one file
    limit max_samples: u64 = "50000000" in 1..=100_000_000_000_u64;

    /// Jobs that may wait for a worker
    limit max_queued_jobs: u64 = "256" in 1..=1_000_000;
    /// Batch jobs that may wait for a worker, after the others and not counted among them; a larger batch may wait if it is the only one
    limit max_queued_batch_jobs: u64 = "10000" in 1..=1_000_000;
    /// Items of one batch
    limit max_batch_items: u64 = "1000" in 1..=100_000;
    /// Bytes of all items of one batch, after defaults, matrix and presets are applied
    limit max_batch_bytes: ByteSize = "64MiB" in 1_024..=1_099_511_627_776_u64;
    /// Bytes of all inputs of waiting jobs
    limit max_queued_bytes: ByteSize = "8GiB" in 1..=1_125_899_906_842_624_u64;
    /// Unfinished jobs of one principal; 0 for no limit of its own
    limit max_principal_jobs: u64 = "0" in 0..=1_000_000;
    /// Maximum run time of one job
    limit job_timeout: Period = "120s" in 1..=86_400;
    /// Attempts per job if its engine process dies
    limit max_attempts: u64 = "3" in 1..=100;
    /// Retries per job if files or records could not be reached
    limit max_retries: u64 = "3" in 0..=100;
    /// Time for which jobs on files that repeatedly crashed engine processes are refused
    limit quarantine_period: Period = "1h" in 0..=31_536_000;
    /// Total estimated memory of running jobs, or 'auto' for 60 % of the available memory
    limit memory_budget: MemoryBudget = "auto" in 1_048_576..=1_125_899_906_842_624_u64;
    /// Isolation of the engine: 'process' runs jobs in separate processes, so that a crash affects one job only; 'thread' runs them in this process; 'inline' runs them in the task that claimed the job, for debugging: timeouts are not enforced
    plain isolation: Isolation = "process";
    /// Memory limit of one engine process, or 'auto' for 60 % of the available memory
    limit process_memory: MemoryBudget = "auto" in 16_777_216..=1_125_899_906_842_624_u64;
    /// Jobs after which an engine process is replaced
    plain max_process_requests: u64 = "500" in 1..=1_000_000;
    /// Lease of a job; a worker renews it every third of this period
    plain lease_period: Period = "6s" in 0.3..=3_600;
    /// Bytes of all outputs of one job
    limit max_output_bytes: ByteSize = "1GiB" in 1_024..=1_125_899_906_842_624_u64;
    /// Outputs of one job
    limit max_outputs_per_job: u64 = "8" in 1..=8;
    /// Labels of one job
    limit max_labels: u64 = "16" in 0..=1_000;
    /// Bytes of a label's name, and of its value
    limit max_label_bytes: ByteSize = "256" in 1..=65_536;
    /// Default time for which a one-shot request waits for its job
    limit default_wait: Period = "30s" in 0..=3_600;
    /// Maximum wait that a request may ask for
    limit max_wait: Period = "30s" in 0..=3_600;
    /// Open event streams of one principal per process
    limit max_event_streams: u64 = "64" in 0..=100_000;
    /// Time after which an event stream is closed and the client has to reconnect
    limit event_stream_period: Period = "1h" in 0.05..=86_400;
    /// Interval of heartbeats on idle event streams
    plain event_heartbeat: Period = "15s" in 0.05..=3_600;
    /// Entries of one page of a list
    limit max_page_items: u64 = "100" in 1..=1_000;

    /// Reuse of results if the same caller submits an identical job again: on or off
    plain result_cache: Switch = "on";
    /// Retention of uploaded files
    limit asset_retention: Period = "7d" in 1..=315_360_000;
    /// Retention of results
    limit result_retention: Period = "24h" in 1..=315_360_000;
    /// Retention of the records of finished jobs
    limit job_retention: Period = "7d" in 1..=315_360_000;
    /// Retention of events, for event streams that resume
    limit event_retention: Period = "24h" in 1..=315_360_000;
    /// Bytes of all stored files together
    limit max_stored_bytes: ByteSize = "64GiB" in 1..=1_125_899_906_842_624_u64;
    /// Disk space that stored files leave free, so that records can still be written
    plain reserved_disk: ByteSize = "64MiB" in 0..=1_125_899_906_842_624_u64;
    /// Stored rig templates of one principal; the same limit applies to presets
    limit max_stored_documents: u64 = "256" in 0..=10_000;
    /// Bytes of all rig templates of one principal; the same limit applies to presets
    limit max_stored_document_bytes: ByteSize = "16MiB" in 1_024..=1_099_511_627_776_u64;
    /// Versions of rig templates and presets of one principal, including replaced and removed ones that stored jobs may refer to
    limit max_document_versions: u64 = "2000" in 1..=1_000_000;
    /// Stored jobs of one principal, finished ones included; the oldest finished jobs are removed first
    limit max_principal_records: u64 = "200000" in 1..=1_000_000_000;
    /// Bytes of the records of one principal: configs, reports, rigs and presets
    limit max_principal_record_bytes: ByteSize = "4GiB" in 1_048_576..=1_125_899_906_842_624_u64;
    /// Stored jobs of all principals; the oldest finished jobs are removed first
    limit max_records: u64 = "2000000" in 1..=1_000_000_000;
    /// Bytes of all records together
    limit max_record_bytes: ByteSize = "16GiB" in 1_048_576..=1_125_899_906_842_624_u64;
    /// Validity of the S3 links that downloads are redirected to; 0s sends the bytes through the service instead
    plain download_link_period: Period = "0s" in 0..=86_400;
    /// Interval at which expired data is removed
    plain sweep_interval: Period = "60s" in 0.05..=86_400;

    /// Webhooks of one principal
    limit max_webhooks: u64 = "16" in 0..=1_000;
    /// Timeout of a webhook delivery
    limit webhook_timeout: Period = "15s" in 0.05..=120;
    /// Delays between retries of a failed webhook delivery, each with a jitter of 20 %
    plain webhook_retries: Periods = "5s,5m,30m,2h,5h,10h,14h,20h";
    /// Time of continuous failure after which a webhook is disabled
    limit webhook_failing_period: Period = "5d" in 0.05..=31_536_000;
    /// Retention of completed and abandoned webhook deliveries
    limit delivery_retention: Period = "7d" in 1..=315_360_000;
    /// Input files by URL, which the service fetches: on or off
    plain url_input: Switch = "off";
    /// Timeout of fetching one file
    limit url_input_timeout: Period = "60s" in 0.05..=3_600;
    /// Non-public networks that outbound requests may reach, such as '10.0.0.0/8', comma-separated; plain http is allowed to these networks only
    plain outbound_allow: Networks = "";
    /// Networks that outbound requests never reach; takes precedence over 'outbound-allow'
    plain outbound_deny: Networks = "";

    /// Concurrent requests
    limit max_concurrent_requests: u64 = "512" in 1..=100_000;
    /// Concurrent requests of one principal, where callers are authenticated
    limit max_principal_requests: u64 = "128" in 1..=100_000;
    /// Open connections; a few more are accepted for probes only
    limit max_connections: u64 = "1024" in 1..=100_000;
    /// Open connections from one address; behind a proxy, all callers share its address
    limit max_peer_connections: u64 = "768" in 1..=100_000;
    /// Bytes of a request's headers
    limit max_header_bytes: ByteSize = "32KiB" in 8_192..=1_048_576;
    /// Timeout of receiving the headers of a request
    limit header_timeout: Period = "10s" in 0.05..=600;
    /// Maximum pause within an upload
    limit upload_idle_timeout: Period = "30s" in 0.05..=3_600;
    /// Timeout of an upload
    limit upload_timeout: Period = "15m" in 0.05..=86_400;
    /// Maximum pause in reading a response
    limit answer_idle_timeout: Period = "30s" in 0.05..=3_600;
    /// Minimum transfer rate in bytes per second while the service waits for a caller, averaged over the maximum pause
    limit min_transfer_rate: ByteSize = "256" in 0..=1_073_741_824;

    /// Whether HTTP/2 is spoken without TLS with those who begin with it, such as proxies that are told to
    plain http2: Switch = "off";
    /// How long the service still takes requests after it was told to stop, for load balancers to notice
    plain drain_delay: Period = "0s" in 0..=600;
    /// Time for which running jobs may continue after a stop signal
    plain grace_period: Period = "25s" in 0..=3_600;
}

fn read_one<T: SettingValue>(
    setting: &Setting,
    look_up: &impl Fn(&Setting) -> Option<String>,
    (low, high): (f64, f64),
    errors: &mut Vec<SettingError>,
) -> Option<T> {
    let seen = look_up(setting).unwrap_or_else(|| setting.default.to_owned());
    let parsed = T::parse(seen.trim()).and_then(|value| match value.number() {
        Some(number) if number < low || number > high => {
            Err(format!("must be from {low} to {high} {}", setting.unit.name()))
        }
        _ => Ok(value),
    });
    match parsed {
        Ok(value) => Some(value),
        Err(expected) => {
            errors.push(setting.error(seen, expected, T::EXAMPLE));
            None
        }
    }
}

impl Settings {
    /// Whether callers must show a key or a token.
    #[must_use]
    pub fn asks_who_calls(&self) -> bool {
        match self.authentication {
            Authentication::Keys => true,
            Authentication::None => false,
            Authentication::Auto => !self.listen.ip().is_loopback() || self.takes_tokens(),
        }
    }

    /// Whether tokens of an identity provider are taken.
    #[must_use]
    pub const fn takes_tokens(&self) -> bool {
        !self.token_issuer.is_empty()
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::read(|_| None).expect("a test reads every default")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_default_is_valid_and_every_number_among_the_limits() {
        let settings = Settings::default();
        assert_eq!(settings.max_file_bytes, ByteSize(256 << 20), "a default");
        let limits = settings.limits();
        assert!(limits.iter().all(|limit| limit.setting.unit != Unit::None), "limits are numbers");
        assert_eq!(limits.len(), Settings::TABLE.iter().filter(|row| row.is_limit).count(), "none is lost");
    }

    #[test]
    fn everything_wrong_is_said_at_once() {
        let wrong = |setting: &Setting| match setting.name {
            "listen" => Some("localhost".to_owned()),
            "max_file_bytes" => Some("lots".to_owned()),
            "job_timeout" => Some("9999d".to_owned()),
            _ => None,
        };
        let errors = Settings::read(wrong).expect_err("three are wrong");
        assert_eq!(errors.0.len(), 3, "{errors}");
        let text = errors.to_string();
        assert!(text.contains("--max-file-bytes (RETARGETD_MAX_FILE_BYTES) is 'lots'"), "names flag and value: {text}");
        assert!(text.contains("must be from 1 to 86400 seconds"), "names the bounds: {text}");
    }

    #[test]
    fn who_can_be_reached_from_elsewhere_asks_who_calls() {
        let asks = |listen: &str, authentication: &str| {
            let text = |setting: &Setting| match setting.name {
                "listen" => Some(listen.to_owned()),
                "authentication" => Some(authentication.to_owned()),
                _ => None,
            };
            Settings::read(text).expect("both can be used").asks_who_calls()
        };
        assert!(!asks("127.0.0.1:1", "auto") && !asks("[::1]:1", "auto"), "only this machine");
        assert!(asks("0.0.0.0:1", "auto") && asks("[::]:1", "auto") && asks("10.0.0.1:1", "auto"), "others too");
        assert!(asks("127.0.0.1:1", "keys") && !asks("0.0.0.0:1", "none"), "who says so has it so");
    }

    #[test]
    fn names_are_unique() {
        let mut names: Vec<_> = Settings::TABLE.iter().map(Setting::limit_name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Settings::TABLE.len(), "limit names are names of settings without 'max_'");
    }
}
