//! What files look like: pictures that are drawn when they are asked for.

use bytes::Bytes;
use sha2::{Digest, Sha256};

use super::{Engine, EngineRequest, Files, Jobs, Question, Refusal, hexadecimal, looks::Look, memory};
use crate::{
    engine::{Control, Failure, Knowledge, Limits, NamedBytes, PreviewOptions},
    store::{AssetRecord, Principal, ResultRecord},
};

/// Memory for each pixel of a picture: its samples, its frames that wait to be encoded, and what they are encoded to.
const BYTES_PER_PIXEL: u64 = 160;

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
    pub fn key(&self, options: &PreviewOptions) -> String {
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
        if let Some(picture) = self.0.pictures.find(&key) {
            return Ok(picture);
        }
        let [width, height] = options.view.size.map(|side| side as u64);
        let cells = options.view.cells() as u64;
        let memory_bytes = memory::of_job([memory::of_unknown_file(file.bytes)].into_iter(), 1.0)
            .saturating_add(width * height * cells.max(4) * BYTES_PER_PIXEL);
        let look = Look { owner: &file.principal, thread: "preview", what: "drawing the file", memory_bytes };
        let load = async { Ok(self.0.store.blobs().read(&file.sha256).await?) };
        let name = file.file_name.clone();
        let work = move |bytes: &Bytes, engine: &dyn Engine, limits: &Limits, control: &Control| {
            draw(NamedBytes { name: &name, bytes }, options, (engine, limits), control)
        };
        let picture = Bytes::from(self.look(look, load, work).await?);
        self.0.pictures.add(key, picture.clone());
        Ok(picture)
    }
}

fn draw(
    file: NamedBytes<'_>,
    options: PreviewOptions,
    (engine, limits): (&dyn Engine, &Limits),
    control: &Control,
) -> Result<Vec<u8>, Failure> {
    let knowledge = Knowledge::default();
    let files = Files { source: Some(file), ..Files::default() };
    let question = Question::Preview(Box::new(options));
    engine.ask(&EngineRequest { question, files, formats: &[], knowledge: &knowledge, limits }, control)?.picture()
}
