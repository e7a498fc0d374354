//! Bodies that arrive: streamed, bounded in size and in time.

use axum::{
    body::{Body, Bytes},
    extract::{DefaultBodyLimit, FromRequest, Multipart, Request, multipart::Field},
    http::{HeaderMap, header},
};
use futures::{Stream, StreamExt};

use super::{
    ApiState,
    body::{BodyWatch, BoundedBody, too_large},
    code::Code,
    digest, header_text,
    problem::Problem,
};
use crate::{
    config::Settings,
    engine::pack_files,
    jobs::{ArrivedFiles, AssetRecord, Assets, ConfigDocument, InputRole, NewJob, Principal, Upload},
};

/// Bytes of a picture of a drawing, which is held in memory while it arrives.
pub(super) const MAX_PICTURE_BYTES: u64 = 16 << 20;

/// Reads a body that is no multipart.
pub(super) struct BodyReader<'a> {
    headers: HeaderMap,
    body: BoundedBody,
    settings: &'a Settings,
}

impl<'a> BodyReader<'a> {
    pub(super) fn new(request: Request<Body>, settings: &'a Settings) -> Self {
        let (parts, body) = request.into_parts();
        Self { headers: parts.headers, body: BoundedBody::new(body, settings), settings }
    }

    /// A document that is small enough for memory.
    pub(super) async fn document(mut self, what: &str) -> Result<Vec<u8>, Problem> {
        let most = self.settings.max_document_bytes.0;
        collect(&mut self.body, most, what, &BodyWatch::default())
            .await
            .map_err(|problem| self.body.refusal(|| problem))
    }

    /// A file, kept as an asset of its owner. Gives the record and whether it is new.
    pub(super) async fn asset(
        mut self,
        assets: &Assets,
        owner: &Principal,
        name: &str,
    ) -> Result<(AssetRecord, bool), Problem> {
        let announced_digest = digest::announced(&self.headers)?;
        let mut upload = assets.begin(&clean_name(name), content_length(&self.headers)).await?;
        let received = receive(&mut self.body, &mut upload, &BodyWatch::default()).await;
        received.map_err(|problem| self.body.refusal(|| problem))?;
        let file = upload.finish(announced_digest.as_deref()).await?;
        Ok(assets.keep(owner, file).await?)
    }
}

/// Reads the multipart body of a job.
///
/// # Errors
/// As [`read_form`], and when the source or the target is missing.
pub(super) async fn read_job(request: Request<Body>, state: &ApiState) -> Result<Parts, Problem> {
    read_form(request, state).await?.with(&[InputRole::Source, InputRole::Target])
}

/// As [`read_job`], for a pose: only the target has to be there, and there is no config.
pub(super) async fn read_pose(request: Request<Body>, state: &ApiState) -> Result<Parts, Problem> {
    let form = read_form(request, state).await?;
    if form.config.is_some() {
        return Err(Problem::new(Code::UnknownPart, "a pose takes no part 'config'")
            .with_hint("POST /v1/retarget takes one; {\"pose\": {\"to\": \"t\"}} in it asks for a pose"));
    }
    form.with(&[InputRole::Target])
}

/// As [`read_job`], for an edit: only the source has to be there, and a target has no place.
pub(super) async fn read_edit(request: Request<Body>, state: &ApiState) -> Result<Parts, Problem> {
    let form = read_form(request, state).await?;
    let idle = [InputRole::Target, InputRole::TargetRest].into_iter().find(|role| form.files.has(*role));
    if let Some(role) = idle {
        return Err(Problem::new(Code::UnknownPart, format!("an edit takes no part '{}'", role.name()))
            .with_hint("POST /v1/retarget takes one, and edits in its config"));
    }
    form.with(&[InputRole::Source])
}

/// As [`read_job`], for a drawing: its files come as one archive or one by one, and what goes beside it becomes an archive as well.
pub(super) async fn read_drawing(request: Request<Body>, state: &ApiState) -> Result<Parts, Problem> {
    let mut form = read_parts_of(request, state, &DRAWING_PARTS).await?;
    let texts = std::mem::take(&mut form.beside);
    let (own, beside): (Vec<_>, Vec<_>) = texts.into_iter().partition(|(part, _, _)| OWN_PARTS.contains(part));
    if !own.is_empty() {
        if form.files.has(InputRole::Target) {
            let detail = format!("the part 'drawing' was sent, and '{}' besides", own[0].0);
            return Err(
                Problem::new(Code::UnknownPart, detail).with_hint("send the archive, or its three files one by one")
            );
        }
        if let Some(part) = OWN_PARTS.into_iter().find(|part| !own.iter().any(|(own, _, _)| own == part)) {
            return Err(
                no_part(part).with_hint("a drawing is 'character', 'texture' and 'mask', or 'drawing' with all three")
            );
        }
        form.add_archive(InputRole::Target, "drawing.zip", own, &state.assets).await?;
    }
    if !form.files.has(InputRole::Target) {
        return Err(no_part("drawing").with_hint("curl sends a file as -F source=@walk.bvh -F drawing=@hero.zip"));
    }
    if !form.files.has(InputRole::Source) && !beside.iter().any(|(part, _, _)| *part == "mvc") && form.config.is_none()
    {
        return Err(
            no_part("source").with_hint("send a file with a clip; only a scene that names its motion needs none")
        );
    }
    if !beside.is_empty() {
        form.add_archive(InputRole::Scene, "scene.zip", beside, &state.assets).await?;
    }
    form.with(&[InputRole::Target])
}

/// The parts of a drawing.
const DRAWING_PARTS: [&str; 11] = [
    "source",
    "drawing",
    "character",
    "texture",
    "mask",
    "motion",
    "retarget",
    "mvc",
    "background",
    "config",
    "preset",
];
/// Those that a drawing consists of.
const OWN_PARTS: [&str; 3] = ["character", "texture", "mask"];

fn no_part(name: &str) -> Problem {
    Problem::new(Code::MissingPart, format!("the part '{name}' is missing"))
}

/// A part that has to be sent and was not.
pub(super) fn missing(role: InputRole) -> Problem {
    Problem::new(Code::MissingPart, format!("the part '{}' is missing", role.name()))
        .with_hint("curl sends a file as -F source=@walk.bvh -F target=@hero.glb")
}

/// Reads a multipart body of files and a config: files go to the store as they come, in any order, and are kept only when all
/// of them have arrived.
///
/// # Errors
/// When a part is unknown, sent twice, too large or of no known format.
pub(super) async fn read_form(request: Request<Body>, state: &ApiState) -> Result<Form, Problem> {
    read_parts_of(request, state, &Form::NAMES).await
}

/// As [`read_form`], of the parts with these names.
async fn read_parts_of(
    request: Request<Body>,
    state: &ApiState,
    names: &'static [&'static str],
) -> Result<Form, Problem> {
    let (request, watch) = bounded(request, &state.settings)?;
    read_parts(request, state, names, &watch).await.map_err(|problem| watch.refusal(|| problem))
}

/// A multipart request whose body is bounded in bytes and in time, and what knows of its bounds.
pub(super) fn bounded(request: Request<Body>, settings: &Settings) -> Result<(Request<Body>, BodyWatch), Problem> {
    check_announced(request.headers(), settings)?;
    let (parts, body) = request.into_parts();
    let (body, watch) = BoundedBody::new(body, settings).of_parts();
    let mut request = Request::from_parts(parts, Body::from_stream(body));
    // Ours are the limits; the framework's would end at 2 MB.
    DefaultBodyLimit::disable().apply(&mut request);
    Ok((request, watch))
}

/// The parts of a multipart request.
pub(super) async fn multipart_of(request: Request<Body>) -> Result<Multipart, Problem> {
    Multipart::from_request(request, &()).await.map_err(|error| {
        tracing::debug!(error = error.body_text(), "a form could not be read");
        Problem::new(
            Code::UnsupportedMediaType,
            "the body must be a form of the type multipart/form-data, with its boundary",
        )
        .with_hint(
            "curl sends one as -F source=@walk.bvh -F target=@hero.glb, and sets the header 'Content-Type' by itself",
        )
    })
}

async fn read_parts(
    request: Request<Body>,
    state: &ApiState,
    names: &'static [&'static str],
    watch: &BodyWatch,
) -> Result<Form, Problem> {
    let mut multipart = multipart_of(request).await?;
    let mut parts = Form { names, ..Form::default() };
    while let Some(field) = multipart.next_field().await.map_err(broken)? {
        watch.advance();
        parts.take(field, &state.assets, &state.settings, watch).await?;
    }
    Ok(parts)
}

/// The parts of a multipart body, arrived but not kept. Dropping it leaves nothing.
#[derive(Debug, Default)]
pub(super) struct Form {
    files: ArrivedFiles,
    config: Option<ConfigDocument>,
    preset: Option<String>,
    /// Parts that become members of archives: the part, the member's name, its content.
    beside: Vec<(&'static str, String, Vec<u8>)>,
    /// The names of the parts that are taken.
    names: &'static [&'static str],
    bytes: u64,
}

impl Form {
    const NAMES: [&'static str; 6] = ["source", "target", "source_rest", "target_rest", "config", "preset"];

    async fn take(
        &mut self,
        mut field: Field<'_>,
        assets: &Assets,
        settings: &Settings,
        watch: &BodyWatch,
    ) -> Result<(), Problem> {
        let name = field.name().unwrap_or_default().to_owned();
        let file_name = clean_name(field.file_name().unwrap_or_default());
        if name == "config" && self.config.is_none() {
            let what = "the part 'config'";
            let bytes = collect(&mut field, settings.max_document_bytes.0, what, watch).await?;
            if !bytes.trim_ascii().is_empty() {
                self.config = Some(config_document(file_name, bytes)?);
            }
            return Ok(());
        }
        if name == "preset" && self.preset.is_none() {
            let bytes = collect(&mut field, settings.max_document_bytes.0, "the part 'preset'", watch).await?;
            let name = String::from_utf8_lossy(&bytes).trim().to_owned();
            self.preset = Some(name).filter(|name| !name.is_empty());
            return Ok(());
        }
        let Some(known) = self.names.iter().copied().find(|known| *known == name) else {
            return Err(unexpected(&name, self.names));
        };
        let role = if known == "drawing" { Some(InputRole::Target) } else { InputRole::from_name(known) };
        let Some(role) = role else {
            return self.take_beside(known, &file_name, &mut field, (settings, watch)).await;
        };
        if self.files.has(role) {
            return Err(unexpected(&name, self.names));
        }
        let most = settings.max_request_bytes.0;
        let mut upload = assets.begin(&file_name, None).await?;
        let arrived = receive(&mut field, &mut upload, watch).await?;
        // Browsers and explorers of APIs send fields that were left empty; an optional one that is empty was not meant.
        if arrived == 0 && matches!(role, InputRole::SourceRest | InputRole::TargetRest) {
            return Ok(());
        }
        self.bytes += arrived;
        if self.bytes > most {
            return Err(too_large("the request", "request_bytes", most, self.bytes));
        }
        self.files.add(role, upload.finish(None).await.map_err(|refusal| in_part(refusal.into(), role))?);
        Ok(())
    }

    /// A part that becomes a member of an archive: a config, or a picture.
    async fn take_beside(
        &mut self,
        part: &'static str,
        file_name: &str,
        field: &mut Field<'_>,
        (settings, watch): (&Settings, &BodyWatch),
    ) -> Result<(), Problem> {
        if matches!(part, "config" | "preset") || self.beside.iter().any(|(other, _, _)| *other == part) {
            return Err(unexpected(part, self.names));
        }
        let is_picture = matches!(part, "texture" | "mask" | "background");
        let most =
            if is_picture { MAX_PICTURE_BYTES.min(settings.max_file_bytes.0) } else { settings.max_document_bytes.0 };
        let limit = if is_picture { "drawing_picture_bytes" } else { "document_bytes" };
        let bytes = collect_within(field, (limit, most), &format!("the part '{part}'"), watch).await?;
        let ending = file_name.rsplit_once('.').map_or("png", |(_, ending)| ending).to_ascii_lowercase();
        let member = match part {
            "character" => "char_cfg.yaml".to_owned(),
            // Readers look at the bytes; the name is that which configs know.
            "texture" | "mask" => format!("{part}.png"),
            "background" if matches!(ending.as_str(), "jpg" | "jpeg" | "webp") => format!("background.{ending}"),
            "background" => "background.png".to_owned(),
            _ => format!("{part}.yaml"),
        };
        self.beside.push((part, member, bytes));
        Ok(())
    }

    /// Packs members into an archive, which is a file of the job like those that were sent.
    async fn add_archive(
        &mut self,
        role: InputRole,
        file_name: &str,
        members: Vec<(&'static str, String, Vec<u8>)>,
        assets: &Assets,
    ) -> Result<(), Problem> {
        let members = members.iter().map(|(_, name, bytes)| (name.as_str(), bytes.as_slice()));
        let packed = pack_files(members).map_err(|failure| Problem::internal(&failure))?;
        let mut upload = assets.begin(file_name, None).await?;
        upload.write(&packed).await?;
        self.files.add(role, upload.finish(None).await.map_err(|refusal| in_part(refusal.into(), role))?);
        Ok(())
    }

    /// The config alone, where there are no files.
    pub(super) fn only_config(&mut self) -> Option<ConfigDocument> {
        if self.files.is_empty() && self.preset.is_none() { self.config.take() } else { None }
    }

    /// What has arrived, when the required files are there.
    ///
    /// # Errors
    /// When one is missing.
    pub(super) fn with(self, required: &[InputRole]) -> Result<Parts, Problem> {
        match required.iter().find(|role| !self.files.has(**role)) {
            Some(role) => Err(missing(*role)),
            None => {
                let new = NewJob { config: self.config, preset: self.preset, ..NewJob::default() };
                Ok(Parts { files: self.files, new })
            }
        }
    }
}

/// The parts of a job that have arrived.
#[derive(Debug)]
pub(super) struct Parts {
    /// The files, which are not kept yet.
    pub(super) files: ArrivedFiles,
    /// Everything else.
    pub(super) new: NewJob,
}

impl Parts {
    /// Those of a job whose files have been uploaded before.
    pub(super) fn of_assets(new: NewJob) -> Self {
        Self { files: ArrivedFiles::default(), new }
    }

    /// The job, with its files kept as its owner's.
    pub(super) async fn keep(self, assets: &Assets, owner: &Principal) -> Result<NewJob, Problem> {
        Ok(NewJob { inputs: assets.keep_arrived(owner, self.files).await?, ..self.new })
    }
}

/// A part that is not one of these, or is there already.
pub(super) fn unexpected(name: &str, names: &[&str]) -> Problem {
    let shown: String = name.chars().take(64).collect();
    if names.contains(&name) {
        return Problem::new(Code::RepeatedPart, format!("the part '{shown}' was sent twice"))
            .with_hint(format!("send '{shown}' once; a job has one file of each kind, and a batch has many jobs"));
    }
    let known = names.join("', '");
    let similar = names.iter().filter(|known| strsim::jaro_winkler(known, name) > 0.7);
    let similar: Vec<String> = similar.map(|known| (*known).to_owned()).collect();
    Problem::new(Code::UnknownPart, format!("there is no part '{shown}'; the parts are '{known}'"))
        .at(format!("/{shown}"), similar)
}

fn in_part(problem: Problem, role: InputRole) -> Problem {
    Problem { part: role.name().into(), ..problem }
}

/// A config that came as bytes.
fn config_document(file_name: String, bytes: Vec<u8>) -> Result<ConfigDocument, Problem> {
    let text = String::from_utf8(bytes).map_err(|error| {
        let place = error.utf8_error().valid_up_to();
        Problem::new(
            Code::MalformedConfig,
            format!("the config is not UTF-8 text; byte {place} is the first invalid one"),
        )
    })?;
    Ok(ConfigDocument { file_name, text: text.into() })
}

/// Streams bytes into an upload. Gives how many.
async fn receive<E: ArrivalError>(
    chunks: &mut (impl Stream<Item = Result<Bytes, E>> + Unpin),
    upload: &mut Upload,
    watch: &BodyWatch,
) -> Result<u64, Problem> {
    let mut total = 0;
    while let Some(chunk) = chunks.next().await {
        let chunk = chunk.map_err(E::problem)?;
        watch.advance();
        total += chunk.len() as u64;
        upload.write(&chunk).await?;
    }
    Ok(total)
}

async fn collect<E: ArrivalError>(
    chunks: &mut (impl Stream<Item = Result<Bytes, E>> + Unpin),
    most: u64,
    what: &str,
    watch: &BodyWatch,
) -> Result<Vec<u8>, Problem> {
    collect_within(chunks, ("document_bytes", most), what, watch).await
}

async fn collect_within<E: ArrivalError>(
    chunks: &mut (impl Stream<Item = Result<Bytes, E>> + Unpin),
    (limit, most): (&'static str, u64),
    what: &str,
    watch: &BodyWatch,
) -> Result<Vec<u8>, Problem> {
    let mut bytes = Vec::new();
    while let Some(chunk) = chunks.next().await {
        let chunk = chunk.map_err(E::problem)?;
        watch.advance();
        let total = bytes.len() as u64 + chunk.len() as u64;
        if total > most {
            return Err(too_large(what, limit, most, total));
        }
        bytes.extend_from_slice(&chunk);
    }
    Ok(bytes)
}

/// A way in which bytes do not arrive.
trait ArrivalError {
    fn problem(self) -> Problem;
}

impl ArrivalError for axum::Error {
    fn problem(self) -> Problem {
        Problem::new(Code::MalformedRequest, "the body ended before it was complete")
    }
}

impl ArrivalError for axum::extract::multipart::MultipartError {
    fn problem(self) -> Problem {
        broken(self)
    }
}

pub(super) fn broken(error: axum::extract::multipart::MultipartError) -> Problem {
    Problem::new(Code::MalformedRequest, format!("the multipart body cannot be read: {}", error.body_text()))
}

fn check_announced(headers: &HeaderMap, settings: &Settings) -> Result<(), Problem> {
    let most = settings.max_request_bytes.0;
    match content_length(headers) {
        Some(announced) if announced > most => Err(too_large("the request", "request_bytes", most, announced)),
        _ => Ok(()),
    }
}

fn content_length(headers: &HeaderMap) -> Option<u64> {
    header_text::text(headers, &header::CONTENT_LENGTH).parse().ok()
}

/// A file name as it is kept: no folder, no control characters, not endless.
pub(super) fn clean_name(name: &str) -> String {
    const MAX_LETTERS: usize = 200;
    let last = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let kept: Vec<char> = last.chars().filter(|letter| !letter.is_control()).collect();
    // The ending tells formats apart, so it is the beginning that goes.
    kept[kept.len().saturating_sub(MAX_LETTERS)..].iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lose_folders_and_control_characters() {
        assert_eq!(clean_name("../../etc/passwd"), "passwd", "a path");
        assert_eq!(clean_name("C:\\clips\\walk.bvh"), "walk.bvh", "a path of another system");
        assert_eq!(clean_name("a\r\nb\0.glb"), "ab.glb", "control characters");
        assert!(clean_name(&format!("{}.glb", "a".repeat(1000))).ends_with("a.glb"), "the ending stays");
    }
}
