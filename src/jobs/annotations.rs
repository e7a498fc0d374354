//! Mask and joints of drawings, for callers who wait for them. Nothing is kept: pictures come with the request and go with the answer.

use bytes::Bytes;

use super::{Answer, ArrivingPicture, Engine, EngineRequest, Files, Jobs, Question, Refusal, looks::Look, memory};
use crate::{
    engine::{Control, Failure, Knowledge, Limits, NamedBytes},
    store::Principal,
};

/// What decoding takes at most beside the file: the pixels of the largest picture that is read at once, as samples and as colors.
const DECODED_BYTES: u64 = 256 << 20;

/// A picture to be annotated.
#[derive(Debug)]
pub struct NewAnnotation {
    /// The picture.
    pub image: ArrivingPicture,
    /// Its mask.
    pub mask: Option<ArrivingPicture>,
    /// Name of the kind of body, or `auto`.
    pub rig: String,
}

impl Jobs {
    /// Begins a picture.
    #[must_use]
    pub fn begin_picture(&self, name: &str) -> ArrivingPicture {
        self.0.picture_room.begin(name, self.0.settings.max_picture_bytes.0)
    }

    /// Asks a pose model, the bytes of an ONNX file, about all drawings that are annotated from now on.
    pub fn use_pose_model(&self, bytes: Bytes) {
        // Only the first one is taken: there is one setting.
        let _ = self.0.pose_model.set(bytes);
    }

    /// What is found in a picture, as a JSON object.
    ///
    /// # Errors
    /// As [`crate::engine::annotate_drawing`].
    pub async fn annotate(&self, owner: &Principal, new: NewAnnotation) -> Result<serde_json::Value, Refusal> {
        self.look_at_drawing(owner, new, false, |answer| answer.document()).await
    }

    /// The folder of a character as a zip archive.
    ///
    /// # Errors
    /// As [`crate::engine::annotate_drawing`].
    pub async fn annotated_archive(&self, owner: &Principal, new: NewAnnotation) -> Result<Bytes, Refusal> {
        self.look_at_drawing(owner, new, true, |answer| answer.archive().map(Bytes::from)).await
    }

    async fn look_at_drawing<T: Send + 'static>(
        &self,
        owner: &Principal,
        new: NewAnnotation,
        as_archive: bool,
        read: impl FnOnce(Answer) -> Result<T, Failure> + Send + 'static,
    ) -> Result<T, Refusal> {
        let bytes = new.image.bytes.len() + new.mask.as_ref().map_or(0, |mask| mask.bytes.len());
        let model = self.0.pose_model.get().cloned();
        // Its file, its weights, and what it works in.
        let of_model = model.as_ref().map_or(0, |model| 3 * model.len() as u64);
        let memory_bytes = memory::of_job([bytes as u64, DECODED_BYTES, of_model].into_iter(), 1.0);
        let look = Look { owner, thread: "annotate", what: "annotating the drawing", memory_bytes };
        let work = move |new: &NewAnnotation, engine: &dyn Engine, limits: &Limits, control: &Control| {
            let NewAnnotation { image, mask, rig } = new;
            let mask = mask.as_ref().map(|mask| NamedBytes { name: &mask.name, bytes: &mask.bytes });
            let source = Some(NamedBytes { name: &image.name, bytes: &image.bytes });
            let scene = model.as_ref().map(|model| NamedBytes { name: "pose_model.onnx", bytes: model });
            let files = Files { source, target: mask, scene, ..Files::default() };
            let question = Question::Annotate { rig: rig.clone(), as_archive };
            let knowledge = Knowledge::default();
            read(engine.ask(&EngineRequest { question, files, formats: &[], knowledge: &knowledge, limits }, control)?)
        };
        self.look(look, std::future::ready(Ok(new)), work).await
    }
}
