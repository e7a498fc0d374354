//! The multipart body of a drawing: a picture, perhaps its mask, and words about it.

use axum::{
    body::Body,
    extract::{Request, multipart::Field},
};

use super::{
    ApiState,
    body::BodyWatch,
    code::Code,
    problem::Problem,
    upload::{bounded, broken, multipart_of, unexpected},
};
use crate::jobs::{ArrivingPicture, Jobs, NewAnnotation};

/// Bytes of a word.
const WORD_BYTES: usize = 64;
const NAMES: [&str; 3] = ["image", "mask", "rig"];

/// What has arrived of a form.
#[derive(Debug, Default)]
struct Arrived {
    image: Option<ArrivingPicture>,
    mask: Option<ArrivingPicture>,
    rig: Option<String>,
}

/// Reads the form. Each picture is held in memory, within its limit.
///
/// # Errors
/// When a part is unknown, sent twice or too large, or the picture is missing.
pub(super) async fn read_drawing(request: Request<Body>, state: &ApiState) -> Result<NewAnnotation, Problem> {
    let (request, watch) = bounded(request, &state.settings)?;
    let arrived = read(request, &state.jobs, &watch).await.map_err(|problem| watch.refusal(|| problem))?;
    let image = arrived.image.ok_or_else(|| {
        Problem::new(Code::MissingPart, "the part 'image' is missing")
            .with_hint("curl sends a picture as -F image=@drawing.png")
    })?;
    Ok(NewAnnotation { image, mask: arrived.mask, rig: arrived.rig.unwrap_or_else(|| "auto".to_owned()) })
}

async fn read(request: Request<Body>, jobs: &Jobs, watch: &BodyWatch) -> Result<Arrived, Problem> {
    let mut multipart = multipart_of(request).await?;
    let mut arrived = Arrived::default();
    while let Some(mut field) = multipart.next_field().await.map_err(broken)? {
        watch.advance();
        let name = field.name().unwrap_or_default().to_owned();
        match &*name {
            "image" if arrived.image.is_none() => {
                arrived.image = Some(picture("image", &mut field, jobs, watch).await?);
            }
            "mask" if arrived.mask.is_none() => arrived.mask = Some(picture("mask", &mut field, jobs, watch).await?),
            "rig" if arrived.rig.is_none() => arrived.rig = Some(word(&mut field, watch).await?),
            _ => return Err(unexpected(&name, &NAMES)),
        }
    }
    Ok(arrived)
}

async fn picture(
    name: &'static str,
    field: &mut Field<'_>,
    jobs: &Jobs,
    watch: &BodyWatch,
) -> Result<ArrivingPicture, Problem> {
    let mut picture = jobs.begin_picture(name);
    while let Some(chunk) = field.chunk().await.map_err(broken)? {
        watch.advance();
        picture.write(&chunk)?;
    }
    Ok(picture)
}

async fn word(field: &mut Field<'_>, watch: &BodyWatch) -> Result<String, Problem> {
    let mut bytes = Vec::new();
    while let Some(chunk) = field.chunk().await.map_err(broken)? {
        watch.advance();
        bytes.extend_from_slice(&chunk);
        if bytes.len() > WORD_BYTES {
            let detail = format!("the part 'rig' is longer than {WORD_BYTES} bytes");
            return Err(Problem::new(Code::InvalidValue, detail).with_hint("give auto, humanoid, quadruped or chains"));
        }
    }
    Ok(String::from_utf8_lossy(&bytes).trim().to_owned())
}
