//! The files of a job, read from the store.

use std::collections::BTreeMap;

use bytes::Bytes;

use super::{Files, Question};
use crate::{
    engine::{Failure, FailureCode, NamedBytes, PoseChoice},
    store::{InputRole, JobRequest, JobTask, Store, StoreError},
};

/// The bytes of a job's files, by what they are to it.
#[derive(Debug)]
pub(super) struct InputBytes(BTreeMap<InputRole, Bytes>);

impl InputBytes {
    /// Reads the files of a job.
    ///
    /// # Errors
    /// When the store fails.
    pub(super) async fn read(store: &Store, request: &JobRequest) -> Result<Self, StoreError> {
        let mut bytes = BTreeMap::new();
        for (role, input) in &request.inputs {
            bytes.insert(*role, store.blobs().read(&input.sha256).await?);
        }
        Ok(Self(bytes))
    }

    pub(super) const fn new(bytes: BTreeMap<InputRole, Bytes>) -> Self {
        Self(bytes)
    }

    /// As the engine takes them. `request` is the one that they were read for.
    pub(super) fn files<'a>(&'a self, request: &'a JobRequest) -> Files<'a> {
        let find = |role: InputRole| {
            Some(NamedBytes { name: &request.inputs.get(&role)?.file_name, bytes: self.0.get(&role)? })
        };
        let config = request.config.as_ref();
        Files {
            source: find(InputRole::Source),
            target: find(InputRole::Target),
            source_rest: find(InputRole::SourceRest),
            target_rest: find(InputRole::TargetRest),
            scene: find(InputRole::Scene),
            config: config.map(|config| NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() }),
        }
    }
}

/// The engine's question that a job asks.
///
/// # Errors
/// When no pose has the name that the job has.
pub(super) fn question(task: &JobTask) -> Result<Question, Failure> {
    let choice = |to: &String| {
        serde_json::from_value::<PoseChoice>(to.as_str().into())
            .map_err(|_| Failure::new(FailureCode::InvalidValue, format!("no pose is called '{to}'")))
    };
    Ok(match task {
        JobTask::Retarget => Question::Retarget,
        JobTask::Edit => Question::Edit,
        JobTask::Draw => Question::Draw,
        JobTask::Pose { to } => Question::Pose { to: to.as_ref().map(choice).transpose()? },
    })
}
