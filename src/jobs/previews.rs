//! What files look like: pictures that are drawn when they are asked for.

use bytes::Bytes;
use sha2::{Digest, Sha256};

use super::{Engine, EngineRequest, Files, Jobs, Question, Refusal, hexadecimal, looks::Look, memory};
use crate::{
    engine::{Control, DisplayOptions, Failure, Knowledge, Limits, NamedBytes, PreviewOptions},
    store::{AssetRecord, Principal, ResultRecord},
};

/// Memory for each pixel of a picture: its samples, its frames that wait to be encoded, and what they are encoded to.
const BYTES_PER_PIXEL: u64 = 160;

/// Memory for the textures of a file that is decoded for viewers.
const TEXTURE_BYTES: u64 = 64 << 20;

/// A stored file that a picture is wanted of.
#[derive(Clone, Debug)]
pub struct Pictured {
    principal: Principal,
    sha256: String,
    bytes: u64,
    file_name: String,
    format: String,
}

impl From<AssetRecord> for Pictured {
    fn from(asset: AssetRecord) -> Self {
        let AssetRecord { principal, sha256, bytes, file_name, format, .. } = asset;
        Self { principal, sha256, bytes, file_name, format }
    }
}

impl Pictured {
    /// A result, which belongs to whoever asks for it.
    #[must_use]
    pub fn of_result(principal: Principal, result: ResultRecord) -> Self {
        let ResultRecord { sha256, bytes, file_name, format, .. } = result;
        Self { principal, sha256, bytes, file_name, format }
    }

    /// The digest of everything that a picture depends on; the same for the same picture.
    #[must_use]
    pub fn key(&self, options: &impl serde::Serialize) -> String {
        let options = serde_json::to_string(options).unwrap_or_default();
        let version = env!("CARGO_PKG_VERSION");
        hexadecimal(&Sha256::digest(format!("{version} {} {} {options}", self.sha256, self.format)))
    }
}

impl Jobs {
    /// The picture of a file, encoded.
    ///
    /// # Errors
    /// When the file cannot be read or shows nothing, or there is no room to draw it.
    pub async fn preview(&self, file: &Pictured, options: PreviewOptions) -> Result<Bytes, Refusal> {
        let key = file.key(&options);
        let [width, height] = options.view.size.map(|side| side as u64);
        let cells = options.view.cells() as u64;
        let memory_bytes = memory::of_job([memory::of_unknown_file(file.bytes)].into_iter(), 1.0)
            .saturating_add(width * height * cells.max(4) * BYTES_PER_PIXEL);
        let look = Look { owner: &file.principal, thread: "preview", what: "drawing the file", memory_bytes };
        self.drawn(file, key, look, Question::Preview(Box::new(options))).await
    }

    /// A file as a plain GLB for viewers.
    ///
    /// # Errors
    /// When the file cannot be read, has no such clip, or there is no room to decode it.
    pub async fn display(&self, file: &Pictured, options: DisplayOptions) -> Result<Bytes, Refusal> {
        let key = file.key(&options);
        let textures = if options.mesh { TEXTURE_BYTES } else { 0 };
        let memory_bytes =
            memory::of_job([memory::of_unknown_file(file.bytes)].into_iter(), 1.0).saturating_add(textures);
        let look = Look { owner: &file.principal, thread: "display", what: "decoding the file", memory_bytes };
        self.drawn(file, key, look, Question::Display(Box::new(options))).await
    }

    /// What is kept under the key, else the engine's answer, which is kept then.
    async fn drawn(&self, file: &Pictured, key: String, look: Look<'_>, question: Question) -> Result<Bytes, Refusal> {
        if let Some(picture) = self.0.pictures.find(&key) {
            return Ok(picture);
        }
        let load = async { Ok(self.0.store.blobs().read(&file.sha256).await?) };
        let name = file.file_name.clone();
        let work = move |bytes: &Bytes, engine: &dyn Engine, limits: &Limits, control: &Control| {
            draw(NamedBytes { name: &name, bytes }, question, (engine, limits), control)
        };
        let picture = Bytes::from(self.look(look, load, work).await?);
        self.0.pictures.add(key, picture.clone());
        Ok(picture)
    }
}

fn draw(
    file: NamedBytes<'_>,
    question: Question,
    (engine, limits): (&dyn Engine, &Limits),
    control: &Control,
) -> Result<Vec<u8>, Failure> {
    let knowledge = Knowledge::default();
    let files = Files { source: Some(file), ..Files::default() };
    engine.ask(&EngineRequest { question, files, formats: &[], knowledge: &knowledge, limits }, control)?.picture()
}
