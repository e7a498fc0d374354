//! The files of a job, read from the store.

use std::collections::BTreeMap;

use bytes::Bytes;

use super::{Jobs, Refusal};
use crate::{
    engine::{Format, Inputs, NamedBytes},
    store::{InputRole, JobRequest},
};

/// The bytes of a job's files, by what they are to it.
#[derive(Debug)]
pub(super) struct InputBytes(BTreeMap<InputRole, Bytes>);

impl Jobs {
    /// Reads the files of a job.
    ///
    /// # Errors
    /// When the store fails.
    pub(super) async fn read_inputs(&self, request: &JobRequest) -> Result<InputBytes, Refusal> {
        let mut bytes = BTreeMap::new();
        for (role, input) in request.inputs() {
            bytes.insert(role, self.0.store.blobs().read(&input.sha256).await?);
        }
        Ok(InputBytes(bytes))
    }
}

impl InputBytes {
    pub(super) const fn new(bytes: BTreeMap<InputRole, Bytes>) -> Self {
        Self(bytes)
    }

    /// As the engine takes them. `request` is the one that they were read for.
    pub(super) fn inputs<'a>(&'a self, request: &'a JobRequest, formats: &'a [Format]) -> Inputs<'a> {
        let find = |wanted: InputRole| {
            let (_, input) = request.inputs().find(|(role, _)| *role == wanted)?;
            Some(NamedBytes { name: &input.file_name, bytes: self.0.get(&wanted)? })
        };
        let empty = NamedBytes { name: "", bytes: &[] };
        let config = request.config.as_ref();
        Inputs {
            source: find(InputRole::Source).unwrap_or(empty),
            target: find(InputRole::Target).unwrap_or(empty),
            source_rest: find(InputRole::SourceRest),
            target_rest: find(InputRole::TargetRest),
            config: config.map(|config| NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() }),
            formats,
        }
    }
}
