//! A picture of a figure to a drawing that can be animated: its files, and what was found out.

use serde::Serialize;

use crate::{
    drawing::{
        self, Annotation, AnnotationError, BodyKind, DrawingError, LONGEST_SIDE, MaskOrigin, PoseModel, PoseModelError,
    },
    formats::pack_files,
    model::Control,
    picture::{Picture, PictureError, Upright, read_upright, write_png},
};

use super::{Failure, FailureCode, NamedBytes, WarningView};

/// A drawing with mask and joints.
#[derive(Clone, Debug)]
pub struct AnnotatedDrawing(Annotation);

/// What was found out about a drawing, as it goes to users.
#[derive(Clone, Debug, Serialize)]
pub struct AnnotationView {
    /// The kind of body: `humanoid`, `quadruped` or `chains`.
    pub rig: &'static str,
    /// How sure the joints are together, from 0 to 1.
    pub confidence: f64,
    /// Width and height of the texture and the mask in pixels.
    pub size: [usize; 2],
    /// The joints, the root first and each after its parent.
    pub skeleton: Vec<DrawnJointView>,
    /// The texture in the picture, in pixels of the picture as it was given.
    #[serde(rename = "box")]
    pub bounds: BoxView,
    /// Pixels of the texture for each of the picture.
    pub scale: f64,
    /// The mask.
    pub mask: MaskView,
    /// How many joints a pose model found. Absent where none did.
    #[serde(skip_serializing_if = "is_zero")]
    pub joints_by_model: usize,
    /// Tips that stand out of the figure: hands, feet, head, hair and the like.
    pub tips: usize,
    /// Deviations and guesses.
    pub warnings: Vec<WarningView>,
}

/// A joint of a drawing.
#[derive(Clone, Debug, Serialize)]
pub struct DrawnJointView {
    /// Its name.
    pub name: String,
    /// The joint that it hangs on; the root has none.
    pub parent: Option<String>,
    /// In pixels of the texture from its left and its top.
    pub loc: [usize; 2],
    /// How sure its place is, from 0 to 1.
    pub confidence: f64,
}

/// A box, in pixels.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BoxView {
    /// From the left of the picture.
    pub left: usize,
    /// From its top.
    pub top: usize,
    /// From the left of the picture, one beyond the last pixel.
    pub right: usize,
    /// From its top, one beyond the last pixel.
    pub bottom: usize,
}

/// What the mask is.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MaskView {
    /// Where it came from: `given`, `alpha` or `strokes`.
    pub origin: &'static str,
    /// Pixels of the figure.
    pub pixels: usize,
}

/// The kind of body of that name: `humanoid`, `quadruped`, `chains`, or `auto` for whichever fits.
///
/// # Errors
/// For another name.
pub fn body_kind(name: &str) -> Result<Option<BodyKind>, Failure> {
    if name == "auto" {
        return Ok(None);
    }
    BodyKind::ALL.into_iter().find(|kind| kind.name() == name).map(Some).ok_or_else(|| {
        let shown: String = name.chars().take(40).collect();
        let detail = format!("there is no rig '{shown}' of drawings");
        Failure::new(FailureCode::InvalidValue, detail).with_hint("give auto, humanoid, quadruped or chains")
    })
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
const fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Reads a pose model: an ONNX file.
///
/// # Errors
/// Where it cannot be used, or this build runs no models.
pub fn read_pose_model(bytes: Vec<u8>) -> Result<PoseModel, Failure> {
    PoseModel::read(bytes).map_err(refused_model)
}

/// Reads a pose model, and asks it about an empty picture, so that what is wrong with it is said at once.
///
/// # Errors
/// Like [`read_pose_model`]; where it is too slow, or its answers are not those of a pose model.
pub fn tried_pose_model(bytes: Vec<u8>, control: &Control) -> Result<PoseModel, Failure> {
    let model = read_pose_model(bytes)?;
    model.try_out(control).map_err(refused_model)?;
    Ok(model)
}

fn refused_model(error: PoseModelError) -> Failure {
    match error {
        PoseModelError::NotBuilt => {
            let detail = "this build runs no pose models: it was made without the feature 'pose-model'";
            Failure::new(FailureCode::UnsupportedFeature, detail)
                .with_hint("build it with cargo build --release --features pose-model")
        }
        PoseModelError::Unusable(error) => {
            Failure::new(FailureCode::InvalidValue, error.to_string()).with_hint(error.fix)
        }
        PoseModelError::Canceled => Failure::new(FailureCode::Canceled, "canceled"),
    }
}

/// Finds mask and joints of the figure in a picture. A mask that is given wins over what is found; without a kind, the one that fits is taken; a
/// pose model's joints win as far as it is sure of them.
///
/// # Errors
/// Where the picture or the mask cannot be read, or there is no figure of the kind.
pub fn annotate_drawing(
    picture: NamedBytes<'_>,
    mask: Option<NamedBytes<'_>>,
    kind: Option<BodyKind>,
    model: Option<&PoseModel>,
    control: &Control,
) -> Result<AnnotatedDrawing, Failure> {
    let picture = upright(picture, "image")?;
    control.check()?;
    let mask = mask.map(|mask| upright(mask, "mask")).transpose()?;
    let refused = |code: FailureCode, part: &'static str, error: DrawingError| {
        Failure::new(code, format!("{part}: {}", error.detail)).with_hint(error.fix).in_part(part)
    };
    drawing::annotate(&picture, mask.as_ref(), kind, model, control).map(AnnotatedDrawing).map_err(
        |error| match error {
            AnnotationError::NoFigure(error) => refused(FailureCode::FigureNotFound, "image", error),
            AnnotationError::Mask(error) => refused(FailureCode::InvalidValue, "mask", error),
            AnnotationError::Model(error) => refused_model(error),
            AnnotationError::Canceled => Failure::new(FailureCode::Canceled, "canceled"),
        },
    )
}

fn upright(file: NamedBytes<'_>, part: &'static str) -> Result<Upright, Failure> {
    read_upright(file.bytes, LONGEST_SIDE).map_err(|error| {
        Failure::new(FailureCode::AssetMalformed, format!("{part}: {error}"))
            .with_hint("give a PNG, JPEG or WebP file that a browser shows")
            .in_part(part)
    })
}

impl AnnotatedDrawing {
    /// The files of a character folder, each with its name.
    ///
    /// # Errors
    /// Where a picture cannot be encoded.
    pub fn files(&self) -> Result<Vec<(&'static str, Vec<u8>)>, Failure> {
        let Self(annotation) = self;
        let png = |picture: &Picture| {
            write_png(picture).map_err(|error: PictureError| Failure::new(FailureCode::Internal, error.to_string()))
        };
        Ok(vec![
            ("char_cfg.yaml", annotation.character_text().into_bytes()),
            ("texture.png", png(&annotation.texture)?),
            ("mask.png", png(&annotation.mask_picture())?),
            ("joint_overlay.png", png(&annotation.overlay())?),
            ("bounding_box.yaml", annotation.bounds_text().into_bytes()),
        ])
    }

    /// The character folder as a zip archive, the same bytes for the same drawing.
    ///
    /// # Errors
    /// Where it cannot be made.
    pub fn archive(&self) -> Result<Vec<u8>, Failure> {
        let files = self.files()?;
        pack_files(files.iter().map(|(name, bytes)| (*name, bytes.as_slice())))
            .map_err(|error| Failure::new(FailureCode::Internal, format!("the archive: {error}")))
    }

    /// What was found out.
    #[must_use]
    pub fn view(&self) -> AnnotationView {
        let Self(annotation) = self;
        let [left, top, right, bottom] = annotation.bounds;
        let round = |value: f64| (value * 1e4).round() / 1e4;
        AnnotationView {
            rig: annotation.kind.name(),
            confidence: round(annotation.confidence),
            size: [annotation.texture.width, annotation.texture.height],
            skeleton: annotation
                .joints
                .iter()
                .map(|joint| DrawnJointView {
                    name: joint.name.clone(),
                    parent: joint.parent.clone(),
                    loc: joint.place,
                    confidence: joint.confidence,
                })
                .collect(),
            bounds: BoxView { left, top, right, bottom },
            scale: round(annotation.scale),
            mask: MaskView { origin: origin(annotation.mask_origin), pixels: annotation.mask_area() },
            joints_by_model: annotation.by_model,
            tips: annotation.tips,
            warnings: annotation.warnings.iter().cloned().map(WarningView::from).collect(),
        }
    }
}

const fn origin(origin: MaskOrigin) -> &'static str {
    match origin {
        MaskOrigin::Given => "given",
        MaskOrigin::Alpha => "alpha",
        MaskOrigin::Strokes => "strokes",
    }
}
