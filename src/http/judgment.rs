//! What an answer with a file says of its quality: `Verdict`, `Verdict-Reason` and `Coverage`.

use axum::http::{HeaderName, HeaderValue};

use super::download::ascii;
use crate::jobs::Judgment;

/// The headers of a judgment; none where nothing was measured.
pub(super) fn headers(judgment: Option<&Judgment>) -> impl Iterator<Item = (HeaderName, HeaderValue)> {
    let named = |name: &'static str, text: String| (HeaderName::from_static(name), ascii(text));
    let of = judgment.into_iter().flat_map(move |judgment| {
        let verdict = named("verdict", judgment.verdict.name().to_owned());
        let reason = named("verdict-reason", judgment.reason.chars().map(plain).collect());
        let coverage = judgment.coverage.map(|coverage| named("coverage", coverage.to_string()));
        [Some(verdict), Some(reason), coverage].into_iter().flatten()
    });
    of.collect::<Vec<_>>().into_iter()
}

/// Names of joints may hold anything; headers hold visible ASCII alone.
const fn plain(character: char) -> char {
    match character {
        ' '..='~' => character,
        _ => '?',
    }
}
