//! Jobs whose files come with them.

use std::collections::BTreeMap;

use super::Awaiting;
use crate::{
    jobs::{Assets, NewJob, ReceivedFile, Refusal, Submitted, engine::InputBytes},
    store::{AssetId, InputRole, Principal},
};

/// The files that came with a request, by what they are to its job. Nothing is kept of them before the job is asked for.
#[derive(Debug, Default)]
pub struct ArrivedFiles {
    files: Vec<ReceivedFile>,
    /// Which of them. A file may be several things.
    places: BTreeMap<InputRole, usize>,
}

impl ArrivedFiles {
    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Whether a file is that.
    #[must_use]
    pub fn has(&self, role: InputRole) -> bool {
        self.places.contains_key(&role)
    }

    /// A further file.
    pub fn add(&mut self, role: InputRole, file: ReceivedFile) {
        self.places.insert(role, self.files.len());
        self.files.push(file);
    }

    /// What `of_files` has for each of the files, by what they are.
    fn by_role<T: Clone>(places: &BTreeMap<InputRole, usize>, of_files: &[T]) -> BTreeMap<InputRole, T> {
        places.iter().filter_map(|(role, place)| Some((*role, of_files.get(*place)?.clone()))).collect()
    }

    /// All their bytes, where all are small enough to be in memory.
    fn in_memory(&self) -> Option<InputBytes> {
        let bytes = self.files.iter().map(|file| file.blob.in_memory()).collect::<Option<Vec<_>>>()?;
        Some(InputBytes::new(Self::by_role(&self.places, &bytes)))
    }
}

impl Assets {
    /// Keeps the files of a request, all or none. Gives their ids by what they are.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn keep_arrived(
        &self,
        owner: &Principal,
        arrived: ArrivedFiles,
    ) -> Result<BTreeMap<InputRole, AssetId>, Refusal> {
        let ArrivedFiles { files, places } = arrived;
        let kept = self.keep_all(owner, files).await?;
        let ids: Vec<AssetId> = kept.into_iter().map(|(asset, _)| asset.id).collect();
        Ok(ArrivedFiles::by_role(&places, &ids))
    }

    /// Takes on a job whose files came with it and whose end somebody waits for. When this returns, files and job survive a crash; the
    /// work may have begun.
    ///
    /// # Errors
    /// As [`Jobs::submit`](crate::jobs::Jobs::submit). Of a job that is refused for load, no file is kept.
    pub async fn submit_awaited(
        &self,
        owner: &Principal,
        arrived: ArrivedFiles,
        new: NewJob,
    ) -> Result<(Submitted, Awaiting), Refusal> {
        let jobs = &self.jobs;
        // All that the job is about has been here before.
        if arrived.is_empty() {
            let submitted = jobs.submit(owner, new).await?;
            let awaiting = Awaiting::for_any(jobs, &submitted.job.id);
            return Ok((submitted, awaiting));
        }
        // What was asked for before is the job from then, which only the files' own ids tell.
        if new.idempotency_key.is_some() {
            let inputs = self.keep_arrived(owner, arrived).await?;
            let submitted = jobs.submit(owner, NewJob { inputs, ..new }).await?;
            let awaiting = Awaiting::for_any(jobs, &submitted.job.id);
            return Ok((submitted, awaiting));
        }
        let expected = self.jobs.asset_records_of(owner, &arrived.files);
        let inputs = ArrivedFiles::by_role(&arrived.places, &expected);
        let new = NewJob { inputs: inputs.into_iter().map(|(role, asset)| (role, asset.id)).collect(), ..new };
        let assets = expected.iter().map(|asset| (asset.id.clone(), asset.clone())).collect();
        let known = jobs.known_with(owner, std::slice::from_ref(&new), assets).await?;
        let admitted = jobs.admit(jobs.resolve_with(&known, owner, new)?).await?;
        let awaiting = Awaiting::for_new(jobs, &admitted.record, arrived.in_memory()).await;
        let _held = self.jobs.write_out(arrived.files).await?;
        Ok((jobs.add(admitted, &expected).await?, awaiting))
    }
}
