//! The types that settings are validated into, and how each is written.

use std::{fmt, net::SocketAddr, path::PathBuf, time::Duration};

/// In what a setting's number is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// It is no number.
    None,
    /// Things.
    Count,
    /// Bytes.
    Bytes,
    /// Seconds.
    Seconds,
}

impl Unit {
    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Count => "count",
            Self::Bytes => "bytes",
            Self::Seconds => "seconds",
        }
    }
}

/// A type that a setting's text is validated into.
pub trait SettingValue: Sized {
    /// In what it is counted.
    const UNIT: Unit;
    /// A text that is accepted.
    const EXAMPLE: &'static str;

    /// Reads the text.
    ///
    /// # Errors
    /// A sentence that says what was expected.
    fn parse(text: &str) -> Result<Self, String>;

    /// The value as a number in [`Self::UNIT`]; `None` where it is no number.
    fn number(&self) -> Option<f64>;
}

impl SettingValue for u64 {
    const UNIT: Unit = Unit::Count;
    const EXAMPLE: &'static str = "100";

    fn parse(text: &str) -> Result<Self, String> {
        text.parse().map_err(|_| "expected a whole number that is not negative".to_owned())
    }

    fn number(&self) -> Option<f64> {
        Some(*self as f64)
    }
}

/// A number of bytes, written `512`, `64KiB`, `256MiB`, `8GiB` or with `KB`, `MB`, `GB` for powers of ten.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ByteSize(pub u64);

impl SettingValue for ByteSize {
    const UNIT: Unit = Unit::Bytes;
    const EXAMPLE: &'static str = "256MiB";

    fn parse(text: &str) -> Result<Self, String> {
        let expected = || "expected a number of bytes such as 65536, 64KiB, 256MiB or 8GiB".to_owned();
        let (number, unit) = split_unit(text);
        let factor: u64 = match unit {
            "" | "B" => 1,
            "KiB" => 1 << 10,
            "MiB" => 1 << 20,
            "GiB" => 1 << 30,
            "TiB" => 1 << 40,
            "KB" => 1_000,
            "MB" => 1_000_000,
            "GB" => 1_000_000_000,
            _ => return Err(expected()),
        };
        let number: u64 = number.parse().map_err(|_| expected())?;
        number.checked_mul(factor).map(Self).ok_or_else(expected)
    }

    fn number(&self) -> Option<f64> {
        Some(self.0 as f64)
    }
}

/// A length of time, written `500ms`, `30s`, `5m`, `24h` or `7d`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Period(pub Duration);

impl SettingValue for Period {
    const UNIT: Unit = Unit::Seconds;
    const EXAMPLE: &'static str = "30s";

    fn parse(text: &str) -> Result<Self, String> {
        let expected = || "expected a length of time such as 500ms, 30s, 5m, 24h or 7d".to_owned();
        let (number, unit) = split_unit(text);
        let milliseconds: u64 = match unit {
            "ms" => 1,
            "s" => 1_000,
            "m" => 60_000,
            "h" => 3_600_000,
            "d" => 86_400_000,
            _ => return Err(expected()),
        };
        let number: u64 = number.parse().map_err(|_| expected())?;
        number.checked_mul(milliseconds).map(|total| Self(Duration::from_millis(total))).ok_or_else(expected)
    }

    fn number(&self) -> Option<f64> {
        Some(self.0.as_secs_f64())
    }
}

/// Lengths of time, one after the other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Periods(pub Vec<Duration>);

impl SettingValue for Periods {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "5s,5m,2h";

    fn parse(text: &str) -> Result<Self, String> {
        let periods = listed(text).map(|text| Period::parse(text).map(|period| period.0)).collect::<Result<_, _>>();
        periods.map(Self).map_err(|expected| format!("{expected}, with commas between them"))
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

fn split_unit(text: &str) -> (&str, &str) {
    let end = text.find(|character: char| !character.is_ascii_digit()).unwrap_or(text.len());
    (&text[..end], text[end..].trim_start())
}

/// How many jobs run at the same time: a number, or `auto` for one per core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Workers(pub usize);

impl SettingValue for Workers {
    const UNIT: Unit = Unit::Count;
    const EXAMPLE: &'static str = "4";

    fn parse(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self(std::thread::available_parallelism().map_or(1, std::num::NonZero::get)));
        }
        text.parse().map(Self).map_err(|_| "expected 'auto' or a whole number".to_owned())
    }

    fn number(&self) -> Option<f64> {
        Some(self.0 as f64)
    }
}

impl SettingValue for SocketAddr {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "127.0.0.1:8080";

    fn parse(text: &str) -> Result<Self, String> {
        text.parse().map_err(|_| "expected an address and a port; 0.0.0.0 is every IPv4 interface".to_owned())
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

/// An address that may be left out.
impl SettingValue for Option<SocketAddr> {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "127.0.0.1:9090";

    fn parse(text: &str) -> Result<Self, String> {
        if text.is_empty() { Ok(None) } else { SocketAddr::parse(text).map(Some) }
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

impl SettingValue for PathBuf {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "/data";

    fn parse(text: &str) -> Result<Self, String> {
        if text.is_empty() { Err("expected a folder".to_owned()) } else { Ok(Self::from(text)) }
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

impl SettingValue for String {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "info,retargetd=debug";

    fn parse(text: &str) -> Result<Self, String> {
        Ok(text.to_owned())
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

/// The URL of something that speaks HTTP; may be left out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HttpUrl(pub String);

impl SettingValue for HttpUrl {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "http://127.0.0.1:4318";

    fn parse(text: &str) -> Result<Self, String> {
        let is_url = |url: &http::Uri| matches!(url.scheme_str(), Some("http" | "https")) && url.host().is_some();
        if text.is_empty() || text.parse().is_ok_and(|url| is_url(&url)) {
            return Ok(Self(text.to_owned()));
        }
        Err("expected a URL that begins with http:// or https://".to_owned())
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

/// A text that may have a password in it: never shown, neither in messages nor in logs.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct Secret(pub String);

impl fmt::Debug for Secret {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(if self.0.is_empty() { "none" } else { "hidden" })
    }
}

impl SettingValue for Secret {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "postgres://user:password@host/database";

    fn parse(text: &str) -> Result<Self, String> {
        Ok(Self(text.to_owned()))
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

/// A setting that is one of a few words; what is expected is said from the same list.
macro_rules! word_setting {
    ($type:ty, $example:literal, { $($word:literal => $value:expr),+ }) => {
        impl SettingValue for $type {
            const UNIT: Unit = Unit::None;
            const EXAMPLE: &'static str = $example;

            fn parse(text: &str) -> Result<Self, String> {
                match text {
                    $($word => Ok($value),)+
                    _ => Err(one_of(&[$($word),+])),
                }
            }

            fn number(&self) -> Option<f64> {
                None
            }
        }
    };
}

/// "expected a, b or c".
fn one_of(words: &[&str]) -> String {
    let (last, others) = words.split_last().unwrap_or((&"", &[]));
    format!("expected {} or {last}", others.join(", "))
}

/// Whether something is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Switch(pub bool);

word_setting!(Switch, "on", { "on" => Self(true), "off" => Self(false) });

/// Where the engine works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Isolation {
    /// In processes of its own.
    Process,
    /// In threads of the process that runs the jobs.
    Thread,
    /// In the task that has claimed the job. Nothing then ends a job that takes too long.
    Inline,
}

word_setting!(Isolation, "process", { "process" => Self::Process, "thread" => Self::Thread, "inline" => Self::Inline });

/// Who must show a key or a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Authentication {
    /// Everybody, where others than this machine can reach the service or tokens are taken; nobody elsewhere.
    Auto,
    /// Everybody.
    Keys,
    /// Nobody.
    None,
}

word_setting!(Authentication, "keys", { "auto" => Self::Auto, "keys" => Self::Keys, "none" => Self::None });

/// Origins of web pages, as browsers tell them: scheme, host and perhaps a port, and nothing behind.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origins(pub Vec<String>);

impl SettingValue for Origins {
    const UNIT: Unit = Unit::None;
    const EXAMPLE: &'static str = "https://studio.example,http://localhost:5173";

    fn parse(text: &str) -> Result<Self, String> {
        let origins: Vec<&str> = listed(text).collect();
        match origins.iter().find(|origin| !is_origin(origin)) {
            Some(_) => {
                Err("expected origins with commas between them: scheme, host and perhaps a port, no path and no '*'"
                    .to_owned())
            }
            None => Ok(Self(origins.into_iter().map(str::to_owned).collect())),
        }
    }

    fn number(&self) -> Option<f64> {
        None
    }
}

/// What stands between commas.
pub(super) fn listed(text: &str) -> impl Iterator<Item = &str> {
    text.split(',').map(str::trim).filter(|entry| !entry.is_empty())
}

fn is_origin(text: &str) -> bool {
    let host = ["https://", "http://"].into_iter().find_map(|scheme| text.strip_prefix(scheme));
    let is_known = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"-.:[]".contains(&byte);
    host.is_some_and(|host| !host.is_empty() && host.bytes().all(is_known))
}

/// How log lines are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogFormat {
    /// For people on a terminal, JSON otherwise.
    Auto,
    /// For people.
    Text,
    /// One JSON object per line.
    Json,
}

word_setting!(LogFormat, "json", { "auto" => Self::Auto, "text" => Self::Text, "json" => Self::Json });

impl fmt::Display for ByteSize {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (factor, unit) in [(1u64 << 40, "TiB"), (1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")] {
            if self.0 >= factor && self.0.is_multiple_of(factor) {
                return write!(formatter, "{} {unit}", self.0 / factor);
            }
        }
        write!(formatter, "{} bytes", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_periods_are_read_with_their_units() {
        for (text, bytes) in [("512", 512), ("64KiB", 65_536), ("1 MiB", 1 << 20), ("2GB", 2_000_000_000)] {
            assert_eq!(ByteSize::parse(text), Ok(ByteSize(bytes)), "{text}");
        }
        for (text, seconds) in [("1500ms", 1.5), ("30s", 30.0), ("5m", 300.0), ("7d", 604_800.0)] {
            assert_eq!(Period::parse(text).map(|period| period.0.as_secs_f64()), Ok(seconds), "{text}");
        }
    }

    #[test]
    fn periods_come_one_after_the_other() {
        let seconds = [5, 300, 7200].map(Duration::from_secs).to_vec();
        assert_eq!(Periods::parse("5s, 5m,2h"), Ok(Periods(seconds)), "in their order");
        assert_eq!(Periods::parse(""), Ok(Periods(Vec::new())), "none");
        assert!(
            Periods::parse("5s,soon").is_err_and(|expected| expected.ends_with("commas between them")),
            "one is none"
        );
    }

    #[test]
    fn origins_are_whole_and_nothing_more() {
        let read = Origins::parse("https://studio.example, http://localhost:5173").expect("two");
        assert_eq!(read.0, ["https://studio.example", "http://localhost:5173"], "each by itself");
        assert_eq!(Origins::parse(""), Ok(Origins::default()), "none");
        for text in ["*", "studio.example", "https://studio.example/", "https://", "https://Studio.example", "null"] {
            assert!(Origins::parse(text).is_err(), "{text:?}");
        }
    }

    #[test]
    fn a_url_has_its_scheme() {
        assert_eq!(HttpUrl::parse(""), Ok(HttpUrl::default()), "none");
        assert!(HttpUrl::parse("http://collector:4318").is_ok(), "with a port");
        for text in ["collector:4318", "http://", "ftp://collector", "/v1/traces"] {
            assert!(HttpUrl::parse(text).is_err(), "{text:?}");
        }
    }

    #[test]
    fn a_secret_is_not_shown() {
        let secret = Secret::parse("postgres://ann:sesame@db/clips").expect("any text");
        assert_eq!(format!("{secret:?}"), "hidden", "not even to developers");
    }

    #[test]
    fn what_is_no_size_or_period_is_refused() {
        for text in ["", "MiB", "-1", "1.5GiB", "1 parsec", "99999999999999999999", "18446744073709551615KiB"] {
            assert!(ByteSize::parse(text).is_err(), "size {text:?}");
            assert!(Period::parse(text).is_err(), "period {text:?}");
        }
        assert!(Period::parse("30").is_err(), "a period without a unit could be anything");
        assert_eq!(Workers::parse("0"), Ok(Workers(0)), "others do the work");
    }
}
