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
    /// Address and port to listen on; port 0 takes any free one
    plain listen: SocketAddr = "127.0.0.1:8080";
    /// Who must show a key or a token: 'keys' for everybody, 'none' for nobody; 'auto' for everybody where 'listen' can be reached from other machines or tokens are taken
    plain authentication: Authentication = "auto";
    /// Identity provider whose tokens (JWT) are taken beside keys, as they name it in 'iss'; without it, no tokens are taken
    plain token_issuer: String = "";
    /// What a token must name in 'aud' to be meant for this service; several with commas between them
    plain token_audience: Names = "";
    /// Where the issuer's public keys (a JWK set) are: an https URL or a file; without it, where '/.well-known/openid-configuration' of the issuer says
    plain token_keys: KeyPlace = "";
    /// In which ways tokens may be signed, with commas between them; all have a public key
    plain token_algorithms: TokenAlgorithms = "RS256,PS256,ES256,EdDSA";
    /// Claim of a token that says who calls
    plain token_principal_claim: String = "sub";
    /// Claim of a token that lists what it allows, as a text with spaces or a list; a JSON pointer such as '/realm_access/roles' finds nested ones
    plain token_scope_claim: String = "scope";
    /// What stands before 'read', 'write' and 'admin' in that list
    plain token_scope_prefix: String = "retargetd:";
    /// How far the clocks of the issuer and of the service may be apart
    plain token_leeway: Period = "30s" in 0..=600;
    /// How often the issuer's keys are fetched anew, so that those it has withdrawn are no longer taken
    plain token_keys_period: Period = "10m" in 0.05..=86_400;
    /// How long the issuer is left alone after a fetch, whatever keys tokens name
    plain token_keys_pause: Period = "10s" in 0.05..=3_600;
    /// Names by which browsers may reach the service where nobody has to show a key, such as 'retarget.lan', with commas between them; addresses and 'localhost' always do
    plain allowed_hosts: Names = "";
    /// Origins whose pages may call the service from a browser, such as 'https://studio.example', with commas between them; without any, none
    plain cors_origins: Origins = "";
    /// Whether the page is served with which people see, correct and decide: on or off
    plain studio: Switch = "on";
    /// Address and port on which probes and metrics are answered besides, without keys, also by a worker; without it, a worker listens nowhere
    plain probes_listen: Option<SocketAddr> = "";
    /// Folder for everything that must survive a restart; made when it is not there
    plain data: PathBuf = "retargetd-data";
    /// URL of the Postgres database that processes share; without it, a file in the data folder
    plain database: Secret = "";
    /// Where files are kept, as 's3://BUCKET/PREFIX' or 'file:///FOLDER'; without it, in the data folder
    plain blobs: String = "";
    /// Connections to the database of one process
    plain database_connections: u64 = "8" in 2..=1_000;
    /// Jobs that run in this process at the same time, or 'auto' for one per core; with 0, other processes run them. One more may run that is of no batch while jobs of batches run
    limit workers: Workers = "auto";
    /// How log lines are written: auto, text or json
    plain log_format: LogFormat = "auto";
    /// Which log lines are written, as 'level' or 'level,module=level'
    plain log: String = "info";

    /// Address of an OpenTelemetry collector that traces are sent to (OTLP over HTTP), such as 'http://127.0.0.1:4318'; without it, what OTEL_EXPORTER_OTLP_ENDPOINT says, else none are made
    plain otlp_endpoint: HttpUrl = "";

    /// Bytes of one uploaded file
    limit max_file_bytes: ByteSize = "256MiB" in 1..=1_099_511_627_776_u64;
    /// Bytes of one multipart request, all its parts together
    limit max_request_bytes: ByteSize = "512MiB" in 1..=4_398_046_511_104_u64;
    /// Bytes of one picture of a drawing, and of its mask
    limit max_picture_bytes: ByteSize = "32MiB" in 1_024..=1_073_741_824_u64;
    /// Bytes of a JSON request and of a retarget config
    limit max_document_bytes: ByteSize = "1MiB" in 1_024..=1_073_741_824_u64;
    /// Bytes that decoding one file may allocate
    limit max_decoded_bytes: ByteSize = "512MiB" in 1..=1_099_511_627_776_u64;
    /// Decoded bytes per encoded byte of a compressed part of a file
    limit max_decompression_ratio: u64 = "200" in 1..=1_000_000;
    /// Values in a JSON request, each number, text, list, object and so on counted by itself
    limit max_json_values: u64 = "100000" in 100..=100_000_000;
    /// Nesting of a JSON document
    limit max_json_depth: u64 = "64" in 1..=512;
    /// Nodes of one file
    limit max_nodes: u64 = "65536" in 1..=100_000_000;
    /// Joints below one another
    limit max_hierarchy_depth: u64 = "512" in 1..=65_536;
    /// Clips of one file
    limit max_clips: u64 = "256" in 1..=1_000_000;
    /// Key times of one clip
    limit max_frames_per_clip: u64 = "216000" in 1..=1_000_000_000;
    /// Nodes times key times, over all clips of one file
    limit max_samples: u64 = "50000000" in 1..=100_000_000_000_u64;

    /// Jobs that may wait for a worker
    limit max_queued_jobs: u64 = "256" in 1..=1_000_000;
    /// Jobs of batches that may wait for a worker, behind those and beside their number; a batch that is larger may wait alone
    limit max_queued_batch_jobs: u64 = "10000" in 1..=1_000_000;
    /// Items of one batch
    limit max_batch_items: u64 = "1000" in 1..=100_000;
    /// Bytes of the items of one batch, where each item has what the defaults, the matrix and its preset give it
    limit max_batch_bytes: ByteSize = "64MiB" in 1_024..=1_099_511_627_776_u64;
    /// Bytes of all inputs of the jobs that wait for a worker
    limit max_queued_bytes: ByteSize = "8GiB" in 1..=1_125_899_906_842_624_u64;
    /// Unfinished jobs that one principal may have, beside what all have together; with 0, only that counts
    limit max_principal_jobs: u64 = "0" in 0..=1_000_000;
    /// How long one job may run
    limit job_timeout: Period = "120s" in 1..=86_400;
    /// How often the process may die under a job before the job fails
    limit max_attempts: u64 = "3" in 1..=100;
    /// How often a job is tried again when files or records could not be reached
    limit max_retries: u64 = "3" in 0..=100;
    /// How long jobs on files under which processes died again and again are refused
    limit quarantine_period: Period = "1h" in 0..=31_536_000;
    /// Memory that running jobs may be thought to need together, or 'auto' for 60 % of what there is
    limit memory_budget: MemoryBudget = "auto" in 1_048_576..=1_125_899_906_842_624_u64;
    /// Where the engine reads files and works on them: 'process' for processes of its own, which files may bring down without harm to others; 'thread' for this one; 'inline' for the very task that has claimed the job, for looking into faults: nothing ends a job that takes too long
    plain isolation: Isolation = "process";
    /// Memory that one engine process may use, or 'auto' for 60 % of what there is
    limit process_memory: MemoryBudget = "auto" in 16_777_216..=1_125_899_906_842_624_u64;
    /// After how many jobs an engine process is replaced by a new one
    plain max_process_requests: u64 = "500" in 1..=1_000_000;
    /// How long a job is left to a worker that is not heard of; a worker tells three times in that time that it is there
    plain lease_period: Period = "6s" in 0.3..=3_600;
    /// Bytes of all files that one job may give
    limit max_output_bytes: ByteSize = "1GiB" in 1_024..=1_125_899_906_842_624_u64;
    /// Files that one job may give
    limit max_outputs_per_job: u64 = "8" in 1..=8;
    /// Labels of one job
    limit max_labels: u64 = "16" in 0..=1_000;
    /// Bytes of one label's name and of its value
    limit max_label_bytes: ByteSize = "256" in 1..=65_536;
    /// How long a one-shot request waits for its job unless it says otherwise
    limit default_wait: Period = "30s" in 0..=3_600;
    /// The longest wait that a request may ask for
    limit max_wait: Period = "30s" in 0..=3_600;
    /// Event streams that one principal may have open at one process
    limit max_event_streams: u64 = "64" in 0..=100_000;
    /// How long one event stream lasts before the caller is asked to come again
    limit event_stream_period: Period = "1h" in 0.05..=86_400;
    /// How often an event stream that has nothing to tell shows that it is there
    plain event_heartbeat: Period = "15s" in 0.05..=3_600;
    /// Entries of one page of a list
    limit max_page_items: u64 = "100" in 1..=1_000;

    /// Whether a job that computes what another one of the same caller has computed is given those results: on or off
    plain result_cache: Switch = "on";
    /// How long an uploaded file is kept
    limit asset_retention: Period = "7d" in 1..=315_360_000;
    /// How long a result is kept
    limit result_retention: Period = "24h" in 1..=315_360_000;
    /// How long the record of a finished job is kept
    limit job_retention: Period = "7d" in 1..=315_360_000;
    /// How long events are kept, for streams that are taken up again
    limit event_retention: Period = "24h" in 1..=315_360_000;
    /// Bytes of all stored files together
    limit max_stored_bytes: ByteSize = "64GiB" in 1..=1_125_899_906_842_624_u64;
    /// Bytes of the disk that files leave free, so that records can still be written
    plain reserved_disk: ByteSize = "64MiB" in 0..=1_125_899_906_842_624_u64;
    /// Rig templates of one's own; as many presets may be kept besides
    limit max_stored_documents: u64 = "256" in 0..=10_000;
    /// Bytes of one's own rig templates together, and as many of presets
    limit max_stored_document_bytes: ByteSize = "16MiB" in 1_024..=1_099_511_627_776_u64;
    /// Versions of rig templates and presets that one principal may have, with those that were replaced or removed and that kept jobs may name
    limit max_document_versions: u64 = "2000" in 1..=1_000_000;
    /// Jobs that are kept of one principal, ended ones among them; the oldest ended go first
    limit max_principal_records: u64 = "200000" in 1..=1_000_000_000;
    /// Bytes of the records of one principal: configs, reports, rigs and presets
    limit max_principal_record_bytes: ByteSize = "4GiB" in 1_048_576..=1_125_899_906_842_624_u64;
    /// Jobs that are kept of all principals together; the oldest ended go first
    limit max_records: u64 = "2000000" in 1..=1_000_000_000;
    /// Bytes of all records together
    limit max_record_bytes: ByteSize = "16GiB" in 1_048_576..=1_125_899_906_842_624_u64;
    /// How long a link to the file store is good that a download is sent to, where it is S3; 0s sends the bytes through the service
    plain download_link_period: Period = "0s" in 0..=86_400;
    /// How often what has expired is removed
    plain sweep_interval: Period = "60s" in 0.05..=86_400;

    /// Webhooks of one principal
    limit max_webhooks: u64 = "16" in 0..=1_000;
    /// How long the receiver of a webhook may take to answer
    limit webhook_timeout: Period = "15s" in 0.05..=120;
    /// After which times a delivery to a webhook that failed is tried again, one after the other, each a fifth shorter or longer by chance
    plain webhook_retries: Periods = "5s,5m,30m,2h,5h,10h,14h,20h";
    /// How long a webhook may fail before it is disabled
    limit webhook_failing_period: Period = "5d" in 0.05..=31_536_000;
    /// How long deliveries to webhooks are kept that were made or given up
    limit delivery_retention: Period = "7d" in 1..=315_360_000;
    /// Whether files may be given by URL, which the service then fetches: on or off
    plain url_input: Switch = "off";
    /// How long fetching one file may take in all
    limit url_input_timeout: Period = "60s" in 0.05..=3_600;
    /// Networks that may be talked to although they are not public, such as '10.0.0.0/8', with commas between them; plain http goes to these alone
    plain outbound_allow: Networks = "";
    /// Networks that are never talked to, whatever 'outbound-allow' says
    plain outbound_deny: Networks = "";

    /// Requests that are worked on at the same time
    limit max_concurrent_requests: u64 = "512" in 1..=100_000;
    /// Requests of one principal that are worked on at the same time, where callers show who they are
    limit max_principal_requests: u64 = "128" in 1..=100_000;
    /// Open connections; a few more are answered on, but only probes
    limit max_connections: u64 = "1024" in 1..=100_000;
    /// Open connections from one address; behind a proxy, all callers have its address
    limit max_peer_connections: u64 = "768" in 1..=100_000;
    /// Bytes of a request's headers
    limit max_header_bytes: ByteSize = "32KiB" in 8_192..=1_048_576;
    /// How long the headers of a request may take to arrive
    limit header_timeout: Period = "10s" in 0.05..=600;
    /// How long an upload may pause
    limit upload_idle_timeout: Period = "30s" in 0.05..=3_600;
    /// How long an upload may take in all
    limit upload_timeout: Period = "15m" in 0.05..=86_400;
    /// How long the reading of an answer may pause
    limit answer_idle_timeout: Period = "30s" in 0.05..=3_600;
    /// Bytes a second that a caller must send or read at least while the service waits for it, over the time that it may pause
    limit min_transfer_rate: ByteSize = "256" in 0..=1_073_741_824;

    /// Whether HTTP/2 is spoken without TLS with those who begin with it, such as proxies that are told to
    plain http2: Switch = "off";
    /// How long the service still takes requests after it was told to stop, for load balancers to notice
    plain drain_delay: Period = "0s" in 0..=600;
    /// How long running jobs may go on after the service was told to stop
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
