//! The results of a batch as one zip archive, made while it is sent: nothing of it is kept, and little of it is in memory at a time.
//!
//! The first member is `manifest.json`, which says of every item what became of it and which files are its. Files are stored as they are,
//! not packed. An archive that breaks off has no directory at its end, so no program takes it for whole.

mod manifest;
mod names;
mod zip_stream;

use std::{collections::VecDeque, io};

use bytes::Bytes;
use futures::{
    StreamExt,
    stream::{self, BoxStream},
};

use self::{manifest::Manifest, names::Names, zip_stream::ZipStream};
use crate::{
    jobs::{Jobs, Refusal},
    store::{BatchId, ByteStream, JobRecord, Principal, ResultRecord},
};

/// Jobs that are looked up at a time.
const PAGE: usize = 100;

/// What one member of the archive holds.
enum Content {
    Text(Bytes),
    /// The blob of that digest.
    Blob(String),
}

struct Member {
    name: String,
    bytes: u64,
    content: Content,
}

/// An archive that is being made.
struct Archive {
    jobs: Jobs,
    /// Nothing when all of it has been given, or when it broke off.
    zip: Option<ZipStream>,
    members: VecDeque<Member>,
    open: Option<ByteStream>,
}

impl Jobs {
    /// The results of a batch that are there now, as a zip archive.
    ///
    /// # Errors
    /// When its owner has no such batch. What fails later breaks the stream off.
    pub async fn batch_archive(
        &self,
        owner: &Principal,
        id: &BatchId,
    ) -> Result<BoxStream<'static, io::Result<Bytes>>, Refusal> {
        let batch = self.batch(owner, id).await?;
        let (mut manifest, mut entries) = (Manifest::of(&batch), Vec::new());
        let mut after = None;
        loop {
            let page = self.0.store.records().batch_jobs(id, None, after, PAGE).await?;
            after = page.items.last().and_then(|job| Some(job.batch.as_ref()?.item));
            entries.extend(self.with_results_kept(page.items).await?);
            if !page.has_more {
                break;
            }
        }
        let mut names = Names::of(entries.iter().map(|(job, _)| job));
        let mut members = VecDeque::new();
        for (job, results) in &entries {
            let files: Vec<(String, &ResultRecord)> =
                results.iter().map(|result| (names.name(job, &result.file_name), result)).collect();
            manifest.add(job, &files);
            members.extend(files.into_iter().map(|(name, result)| Member {
                name,
                bytes: result.bytes,
                content: Content::Blob(result.sha256.clone()),
            }));
        }
        let text = Bytes::from(manifest.text());
        let (name, bytes) = (names::MANIFEST.to_owned(), text.len() as u64);
        members.push_front(Member { name, bytes, content: Content::Text(text) });
        let archive = Archive { jobs: self.clone(), zip: Some(ZipStream::default()), members, open: None };
        Ok(stream::unfold(archive, Archive::next).boxed())
    }

    /// Jobs with those of their results that have not expired. What is large and not needed is let go.
    async fn with_results_kept(&self, jobs: Vec<JobRecord>) -> Result<Vec<(JobRecord, Vec<ResultRecord>)>, Refusal> {
        let ids: Vec<_> = jobs.iter().map(|job| &job.id).collect();
        let (mut results, now) = (self.0.store.records().results_of(&ids).await?, self.0.clock.now());
        let with_results = |mut job: JobRecord| {
            let mut own = results.remove(&job.id).unwrap_or_default();
            own.retain(|result| result.expires_at > now);
            job.request.config = None;
            (job, own)
        };
        Ok(jobs.into_iter().map(with_results).collect())
    }
}

impl Archive {
    /// The next bytes; nothing after the last, or after what broke it off.
    async fn next(mut self) -> Option<(io::Result<Bytes>, Self)> {
        let zip = self.zip.take()?;
        match self.step(zip).await {
            Ok(bytes) => Some((Ok(bytes), self)),
            Err(error) => {
                tracing::error!(%error, "an archive broke off");
                Some((Err(error), self))
            }
        }
    }

    /// Goes on until there are bytes, and keeps `zip` unless it has ended.
    async fn step(&mut self, mut zip: ZipStream) -> io::Result<Bytes> {
        loop {
            if let Some(content) = &mut self.open {
                match content.next().await {
                    Some(chunk) => zip.write(&chunk.map_err(io::Error::other)?)?,
                    None => self.open = None,
                }
            } else if let Some(member) = self.members.pop_front() {
                zip.begin(&member.name, member.bytes)?;
                match member.content {
                    Content::Text(text) => zip.write(&text)?,
                    Content::Blob(sha256) => {
                        self.open = Some(self.jobs.content(&sha256, None).await.map_err(io::Error::other)?);
                    }
                }
            } else {
                return zip.finish();
            }
            let bytes = zip.take();
            if !bytes.is_empty() {
                self.zip = Some(zip);
                return Ok(bytes);
            }
        }
    }
}
