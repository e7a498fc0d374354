//! The `Retry-After` header (RFC 9110, 10.2.3): how long somebody wants to be left alone.

use std::time::Duration;

use jiff::{Timestamp, fmt::rfc2822};

/// A number of seconds, or a date, from which what is left of the time until then is told.
pub(super) fn parse(text: &str, now: Timestamp) -> Option<Duration> {
    let text = text.trim();
    if let Ok(seconds) = text.parse::<u64>() {
        return Some(Duration::from_secs(seconds));
    }
    let until = rfc2822::DateTimeParser::new().parse_timestamp(text).ok()?;
    Some(Duration::try_from(until.duration_since(now)).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_are_read() {
        let now: Timestamp = "2015-10-21T07:27:30Z".parse().expect("a time");
        assert_eq!(parse("120", now), Some(Duration::from_secs(120)), "seconds");
        assert_eq!(parse("Wed, 21 Oct 2015 07:28:00 GMT", now), Some(Duration::from_secs(30)), "a date");
        assert_eq!(parse("Wed, 21 Oct 2015 07:00:00 GMT", now), Some(Duration::ZERO), "a date that is over");
        for nonsense in ["", "soon", "-1", "1.5"] {
            assert_eq!(parse(nonsense, now), None, "{nonsense:?}");
        }
    }
}
