//! A config, typed or as text.

use crate::{
    engine::{Failure, FailureCode, NamedBytes},
    retarget::{RetargetSpec, parse_spec},
};

use super::Error;

/// What is to be done: a typed spec, or the text of a config.
#[derive(Clone, Debug)]
pub struct Config(Form);

#[derive(Clone, Debug)]
enum Form {
    Spec(Box<RetargetSpec>),
    Text(Vec<u8>),
}

impl Config {
    /// The config as text. A typed spec becomes text too, so that its values are checked by the same rules.
    pub(super) fn as_text(&self) -> Result<Self, Error> {
        let text = match &self.0 {
            Form::Text(text) => text.clone(),
            Form::Spec(spec) => serde_json::to_vec(spec).map_err(|error| {
                Failure::new(FailureCode::InvalidValue, format!("the spec cannot be written as JSON: {error}"))
                    .in_part("config")
            })?,
        };
        Ok(Self(Form::Text(text)))
    }

    /// The config as the file that the engine reads; empty for a typed spec, see [`Self::as_text`].
    pub(super) fn file(&self) -> NamedBytes<'_> {
        let bytes = match &self.0 {
            Form::Text(text) => text.as_slice(),
            Form::Spec(_) => &[],
        };
        NamedBytes { name: "config", bytes }
    }

    /// The spec, checked.
    pub(super) fn checked(&self) -> Result<RetargetSpec, Error> {
        let text = self.as_text()?;
        Ok(parse_spec(text.file().bytes).map_err(|error| Failure::from(error).in_part("config"))?)
    }
}

impl From<RetargetSpec> for Config {
    fn from(spec: RetargetSpec) -> Self {
        Self(Form::Spec(Box::new(spec)))
    }
}

impl From<&str> for Config {
    fn from(text: &str) -> Self {
        Self(Form::Text(text.as_bytes().to_vec()))
    }
}

impl From<Vec<u8>> for Config {
    fn from(text: Vec<u8>) -> Self {
        Self(Form::Text(text))
    }
}
