//! The results of a batch as one zip archive, made while it is sent: nothing of it is kept, and little of it is in memory at a time.
//!
//! The first member is `manifest.json`, which says of every item what became of it and which files are its. The last is `index.html`, which
//! shows the same to people, with a moving picture of each item where they are asked for. Files are stored as they are, not packed. An
//! archive that breaks off has no directory at its end, so no program takes it for whole.

mod manifest;
mod names;
mod zip_stream;

use std::{collections::VecDeque, io};

use bytes::Bytes;
use futures::{
    StreamExt,
    stream::{self, BoxStream},
};
use serde_json::Value;

use self::{manifest::Manifest, names::Names, zip_stream::ZipStream};
use crate::{
    engine::{self, PreviewOptions},
    jobs::{Jobs, Pictured, Refusal},
    store::{BatchId, ByteStream, JobRecord, JobState, Principal, ResultRecord},
};

/// Jobs that are looked up at a time.
const PAGE: usize = 100;

/// What an archive holds beside results.
#[derive(Clone, Copy, Debug)]
pub struct ArchiveContents {
    /// Whether there is a moving picture of each item.
    pub previews: bool,
    /// Makes `index.html` of the manifest, whose items have `preview`, the picture's name, where there is one.
    pub page: fn(&Value) -> String,
}

/// What one member of the archive holds.
enum Content {
    Text(Bytes),
    /// The blob of that digest.
    Blob(String),
    /// A picture of an item, drawn when it is its turn.
    Preview {
        item: usize,
        file: Box<Pictured>,
    },
    /// The page, which shows the pictures that could be drawn.
    Page,
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
    /// The manifest, with the names of the pictures that have been drawn.
    shown: Value,
    page: fn(&Value) -> String,
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
        contents: ArchiveContents,
    ) -> Result<BoxStream<'static, io::Result<Bytes>>, Refusal> {
        let batch = self.batch(owner, id).await?;
        let (mut manifest, mut entries) = (Manifest::of(&batch), Vec::new());
        let mut after = None;
        loop {
            let page = self.0.store.records().batch_jobs(id, (None, None), after, PAGE).await?;
            after = page.items.last().and_then(|job| Some(job.batch.as_ref()?.item));
            entries.extend(self.with_results_kept(page.items).await?);
            if !page.has_more {
                break;
            }
        }
        let mut names = Names::of(entries.iter().map(|(job, _)| job));
        let mut members = VecDeque::new();
        for (item, (job, results)) in entries.iter().enumerate() {
            let files: Vec<(String, &ResultRecord)> =
                results.iter().map(|result| (names.name(job, &result.file_name), result)).collect();
            manifest.add(job, &files);
            let drawn = files.iter().find(|(_, result)| contents.previews && engine::has_figure(&result.format));
            let preview = drawn.map(|(name, result)| Member {
                name: names.preview(name),
                bytes: 0,
                content: Content::Preview {
                    item,
                    file: Box::new(Pictured::of_result(owner.clone(), (*result).clone())),
                },
            });
            members.extend(files.into_iter().map(|(name, result)| Member {
                name,
                bytes: result.bytes,
                content: Content::Blob(result.sha256.clone()),
            }));
            members.extend(preview);
        }
        let shown = serde_json::to_value(&manifest).unwrap_or_default();
        let text = Bytes::from(manifest.text());
        let (name, bytes) = (names::MANIFEST.to_owned(), text.len() as u64);
        members.push_front(Member { name, bytes, content: Content::Text(text) });
        members.push_back(Member { name: names::PAGE.to_owned(), bytes: 0, content: Content::Page });
        let (zip, page) = (Some(ZipStream::default()), contents.page);
        let archive = Archive { jobs: self.clone(), zip, members, open: None, shown, page };
        Ok(stream::unfold(archive, Archive::next).boxed())
    }

    /// A picture of the first item of a batch that has a result which can be drawn: that result.
    ///
    /// # Errors
    /// When its owner has no such batch, or none of its items has such a result yet.
    pub async fn batch_pictured(&self, owner: &Principal, id: &BatchId) -> Result<Pictured, Refusal> {
        self.batch(owner, id).await?;
        let page = self.0.store.records().batch_jobs(id, (Some(JobState::Succeeded), None), None, PAGE).await?;
        let results = self.with_results_kept(page.items).await?.into_iter().flat_map(|(_, results)| results);
        let first = results.into_iter().find(|result| engine::is_drawable(&result.format));
        let not_found = || Refusal::NotFound { kind: "result that can be drawn in batch", id: id.to_string() };
        Ok(Pictured::of_result(owner.clone(), first.ok_or_else(not_found)?))
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
                self.begin(&mut zip, member).await?;
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

    /// Begins a member, and writes it where it is at hand. A picture that cannot be drawn is left out.
    async fn begin(&mut self, zip: &mut ZipStream, member: Member) -> io::Result<()> {
        let Member { name, bytes, content } = member;
        match content {
            Content::Text(text) => zip.add(&name, &text),
            Content::Page => zip.add(&name, (self.page)(&self.shown).as_bytes()),
            Content::Blob(sha256) => {
                zip.begin(&name, bytes)?;
                self.open = Some(self.jobs.content(&sha256, None).await.map_err(io::Error::other)?);
                Ok(())
            }
            Content::Preview { item, file } => match self.jobs.preview(&file, PreviewOptions::of_batch()).await {
                Ok(picture) => {
                    self.shown["items"][item]["preview"] = Value::String(name.clone());
                    zip.add(&name, &picture)
                }
                Err(refusal) => {
                    tracing::warn!(%refusal, name, "a picture of an archive was left out");
                    Ok(())
                }
            },
        }
    }
}
