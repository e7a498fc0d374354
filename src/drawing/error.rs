//! What is wrong with a drawing or its configs.

use std::fmt;

/// What is wrong, where, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DrawingError {
    /// The field of the config, as `/bvh_projection_bodypart_groups/1/method`; empty where it is about a whole file.
    pub place: String,
    /// What is wrong.
    pub detail: String,
    /// What to do about it.
    pub hint: String,
}

impl DrawingError {
    pub(super) fn new(place: impl Into<String>, detail: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { place: place.into(), detail: detail.into(), hint: hint.into() }
    }

    /// A name that is not there, with the nearest one that is.
    pub(super) fn unknown<'a>(
        place: impl Into<String>,
        what: &str,
        name: &str,
        known: impl Iterator<Item = &'a str>,
    ) -> Self {
        let nearness = |other: &&str| strsim::normalized_damerau_levenshtein(name, other);
        let nearest = known.max_by(|one, other| nearness(one).total_cmp(&nearness(other)));
        let hint = nearest.map_or_else(String::new, |nearest| format!("did you mean '{nearest}'?"));
        Self::new(place, format!("there is no {what} '{name}'"), hint)
    }
}

impl fmt::Display for DrawingError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.place.is_empty() {
            return write!(formatter, "{}", self.detail);
        }
        write!(formatter, "{}: {}", self.place, self.detail)
    }
}

impl std::error::Error for DrawingError {}
