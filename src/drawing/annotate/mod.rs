//! A picture of a figure to a character that can be animated: its mask, its joints, and how sure they are. A pose model is asked where
//! there is one.
//!
//! | file | what it answers |
//! | --- | --- |
//! | `working_size` | the size that drawings are looked at in |
//! | `strokes` | what of a picture is drawn |
//! | `paper`, `edges` | the lines of lined paper; what surrounds the paper |
//! | `components`, `bridges` | pixels that hang together, and parts that do not |
//! | `mask` | which pixels are the figure's |
//! | `bits`, `distance`, `ways` | pixels in a set, distances from its edge, ways within it |
//! | `shape` | the middle of a figure, the tips that stand out and the ways to them |
//! | `limb` | root, bend and end of a limb |
//! | `human`, `human_joints` | head, hands and feet of a human figure, and its joints |
//! | `animal`, `chains` | the joints of other bodies |
//! | `joints` | joints as they are found |
//! | `pose_model`, `pose_answer`, `pose_network` | joints that a pose model finds, what it answers, and what runs it |
//! | `character_text`, `overlay` | an annotation as a config, and to be looked at |

mod animal;
mod bits;
mod bridges;
mod chains;
mod character_text;
mod components;
mod distance;
mod edges;
mod human;
mod human_joints;
mod joints;
mod limb;
mod mask;
mod overlay;
mod paper;
mod pose_answer;
mod pose_model;
#[cfg(feature = "pose-model")]
mod pose_network;
mod shape;
mod strokes;
mod ways;
mod working_size;

pub use mask::MaskOrigin;
pub use pose_answer::PoseModelError;
pub use pose_model::{MAX_MODEL_BYTES, PoseModel};

use super::DrawingError;
use crate::{
    model::{Canceled, Control, Reporter, Warning},
    picture::{Picture, Upright},
};

use bits::Bits;
use joints::{Fit, NoFit};
use shape::Shape;

/// Pixels of the longer side that pictures may be read with: what is larger is made smaller in any case.
pub const LONGEST_SIDE: usize = 2 * working_size::LARGEST;
/// Room around the figure, as a share of its longer side.
const MARGIN: f64 = 0.03;
/// Part of a picture that a figure fills when the picture is not cut.
const FILLS: f64 = 0.9;

/// The kind of body that a drawing shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyKind {
    /// Head, arms and legs, from the front.
    Humanoid,
    /// Four legs, from the side.
    Quadruped,
    /// Limbs of any number.
    Chains,
}

impl BodyKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Humanoid, Self::Quadruped, Self::Chains];

    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Humanoid => "humanoid",
            Self::Quadruped => "quadruped",
            Self::Chains => "chains",
        }
    }

    const fn noun(self) -> &'static str {
        match self {
            Self::Humanoid => "human figure from the front",
            Self::Quadruped => "four-legged animal from the side",
            Self::Chains => "body with limbs",
        }
    }
}

/// A joint of a drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct AnnotatedJoint {
    /// Its name.
    pub name: String,
    /// The joint that it hangs on; the root has none.
    pub parent: Option<String>,
    /// In pixels of the texture from its left and its top.
    pub place: [usize; 2],
    /// How sure its place is, from 0 to 1.
    pub confidence: f64,
}

/// A drawing that can be animated.
#[derive(Clone, Debug)]
pub struct Annotation {
    /// What kind of body it is.
    pub kind: BodyKind,
    /// The figure, cut out of the picture with a little room.
    pub texture: Picture,
    /// Where the mask came from.
    pub mask_origin: MaskOrigin,
    /// The joints, the root first and each after its parent.
    pub joints: Vec<AnnotatedJoint>,
    /// How sure the joints are together: the mean of theirs.
    pub confidence: f64,
    /// Left, top, right and bottom of the texture in the picture, in pixels of the picture as it was given.
    pub bounds: [usize; 4],
    /// Pixels of the texture for each of the picture.
    pub scale: f64,
    /// Joints that a pose model found.
    pub by_model: usize,
    /// Tips that stand out of the figure.
    pub tips: usize,
    /// Deviations and guesses.
    pub warnings: Vec<Warning>,
    mask: Bits,
}

/// Why a picture was not annotated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AnnotationError {
    /// There is no figure in it, or none of the kind that is asked for.
    NoFigure(DrawingError),
    /// The mask cannot be used.
    Mask(DrawingError),
    /// The pose model cannot be used.
    Model(PoseModelError),
    /// Nobody wants it any more.
    Canceled,
}

impl From<Canceled> for AnnotationError {
    fn from(_: Canceled) -> Self {
        Self::Canceled
    }
}

impl From<PoseModelError> for AnnotationError {
    fn from(error: PoseModelError) -> Self {
        if error == PoseModelError::Canceled { Self::Canceled } else { Self::Model(error) }
    }
}

/// Finds the mask and the joints of the figure in a picture. A mask that is given wins; without a kind, the one that fits is taken. A pose model's
/// joints of a human figure win as far as it is sure of them.
///
/// # Errors
///
/// Where there is no figure, or none of that kind, or the mask does not fit.
pub fn annotate(
    picture: &Upright,
    mask: Option<&Upright>,
    kind: Option<BodyKind>,
    model: Option<&PoseModel>,
    control: &Control,
) -> Result<Annotation, AnnotationError> {
    let mut reporter = Reporter::new();
    if let Some(mask) = mask {
        mask::check_size(mask.size, picture.size).map_err(AnnotationError::Mask)?;
    }
    let [width, height] = picture.size;
    let small = working_size::to_working_size(&picture.picture);
    let scale = small.width as f64 / width as f64;
    control.check()?;
    let (figure, mask_origin) = match mask {
        Some(mask) => {
            let mask = mask::given_mask(&working_size::to_working_size(&mask.picture), &mut reporter);
            (mask.map_err(AnnotationError::Mask)?, MaskOrigin::Given)
        }
        None => mask::mask_of_picture(&small, &mut reporter).map_err(AnnotationError::NoFigure)?,
    };
    control.check()?;
    let (corner, size) = frame(&figure);
    let mask = figure.cropped(corner, size);
    let texture = cropped(&small, corner, size);
    let shape = Shape::new(&mask, control)?;
    let modeled = match model.filter(|_| kind.is_none_or(|kind| kind == BodyKind::Humanoid)) {
        Some(model) => model.joints(&texture, control)?,
        None => Vec::new(),
    };
    let (kind, fit) = if modeled.len() == pose_model::ALL_JOINTS {
        (BodyKind::Humanoid, Fit { joints: Vec::new(), notes: Reporter::new() })
    } else {
        body(&shape, kind, &mut reporter).map_err(AnnotationError::NoFigure)?
    };
    let modeled = if kind == BodyKind::Humanoid { modeled } else { Vec::new() };
    for warning in fit.notes.into_warnings() {
        reporter.warn(warning.code, warning.place, warning.detail, warning.hint);
    }
    let by_model = modeled.len();
    let joints = annotated(&shape, &with_modeled(fit.joints, modeled, shape.factor), size);
    let confidence = joints.iter().map(|joint| joint.confidence).sum::<f64>() / joints.len().max(1) as f64;
    let given =
        |at: usize, side: usize, most: usize| ((at as f64 / side as f64 * most as f64).round() as usize).min(most);
    let bounds = [
        given(corner[0], small.width, width),
        given(corner[1], small.height, height),
        given(corner[0] + size[0], small.width, width),
        given(corner[1] + size[1], small.height, height),
    ];
    let (tips, warnings) = (shape.tips.len(), reporter.into_warnings());
    Ok(Annotation { kind, texture, mask_origin, joints, confidence, bounds, scale, by_model, tips, warnings, mask })
}

impl Annotation {
    /// The mask as a picture: white where the figure is.
    #[must_use]
    pub fn mask_picture(&self) -> Picture {
        let color = |&is_in: &bool| if is_in { [255; 4] } else { [0, 0, 0, 255] };
        Picture {
            width: self.mask.width,
            height: self.mask.height,
            pixels: self.mask.cells.iter().map(color).collect(),
        }
    }

    /// Pixels of the figure.
    #[must_use]
    pub fn mask_area(&self) -> usize {
        self.mask.count()
    }

    /// The texture with the joints over it.
    #[must_use]
    pub fn overlay(&self) -> Picture {
        overlay::overlay(&self.texture, &self.mask, &self.joints)
    }

    /// `char_cfg.yaml`.
    #[must_use]
    pub fn character_text(&self) -> String {
        character_text::character_text([self.texture.width, self.texture.height], &self.joints)
    }

    /// `bounding_box.yaml`.
    #[must_use]
    pub fn bounds_text(&self) -> String {
        character_text::bounds_text(self.bounds)
    }
}

/// Corner and size of what is cut out of a picture; all of it where the figure fills it.
fn frame(figure: &Bits) -> ([usize; 2], [usize; 2]) {
    let picture = [figure.width, figure.height];
    let Some([left, top, right, bottom]) = figure.bounds() else { return ([0, 0], picture) };
    let margin = (MARGIN * (right - left).max(bottom - top) as f64).ceil() as usize;
    let from = [left.saturating_sub(margin), top.saturating_sub(margin)];
    let to = [(right + margin).min(picture[0]), (bottom + margin).min(picture[1])];
    let size = [to[0] - from[0], to[1] - from[1]];
    let fills = |axis: usize| size[axis] as f64 > FILLS * picture[axis] as f64;
    if fills(0) && fills(1) { ([0, 0], picture) } else { (from, size) }
}

fn cropped(picture: &Picture, [left, top]: [usize; 2], [width, height]: [usize; 2]) -> Picture {
    let rows = (top..top + height).flat_map(|row| &picture.pixels[row * picture.width + left..][..width]);
    Picture { width, height, pixels: rows.copied().collect() }
}

/// The joints of that kind of body, or of the one that fits.
fn body(shape: &Shape, kind: Option<BodyKind>, reporter: &mut Reporter) -> Result<(BodyKind, Fit), DrawingError> {
    let fit = |kind: BodyKind| match kind {
        BodyKind::Humanoid => human::fit(shape),
        BodyKind::Quadruped => animal::fit(shape),
        BodyKind::Chains => chains::fit(shape),
    };
    if let Some(kind) = kind {
        return fit(kind).map(|fit| (kind, fit)).map_err(|NoFit { detail }| no_fit(kind, &detail));
    }
    let why = match fit(BodyKind::Humanoid) {
        Ok(found) => return Ok((BodyKind::Humanoid, found)),
        Err(NoFit { detail }) => detail,
    };
    let warn = |kind: BodyKind, reporter: &mut Reporter| {
        let detail =
            format!("it is taken for a {}, since it is hardly a {}: {why}", kind.noun(), BodyKind::Humanoid.noun());
        reporter.warn("body_kind", "joints", detail, "say what it is with rig: humanoid, quadruped or chains");
    };
    for kind in [BodyKind::Quadruped, BodyKind::Chains] {
        if let Ok(found) = fit(kind) {
            warn(kind, reporter);
            return Ok((kind, found));
        }
    }
    Err(no_fit(BodyKind::Chains, "nothing stands out of it"))
}

fn no_fit(kind: BodyKind, detail: &str) -> DrawingError {
    let fix = match kind {
        BodyKind::Humanoid => {
            "choose the rig quadruped or chains for another body, or give a mask with head, arms and legs apart"
        }
        BodyKind::Quadruped => "choose the rig humanoid or chains for another body",
        BodyKind::Chains => "give a picture or a mask of something with limbs",
    };
    DrawingError::new("image", format!("the figure is no {}: {detail}", kind.noun()), fix)
}

/// Joints with those of a model in their places; the model's are in pixels of the texture.
fn with_modeled(mut joints: Vec<joints::Joint>, modeled: Vec<joints::Joint>, factor: usize) -> Vec<joints::Joint> {
    for mut joint in modeled {
        joint.place /= factor as f64;
        match joints.iter_mut().find(|other| other.name == joint.name) {
            Some(other) => (other.place, other.confidence) = (joint.place, joint.confidence),
            None => joints.push(joint),
        }
    }
    joints
}

/// Joints in pixels of the texture, each inside the figure.
fn annotated(shape: &Shape, joints: &[joints::Joint], size: [usize; 2]) -> Vec<AnnotatedJoint> {
    let factor = shape.factor as f64;
    let joint = |joint: &joints::Joint| {
        let column = joint.place.x.max(0.0) as i64;
        let is_inside = shape.bits.has(column, joint.place.y.max(0.0) as i64);
        let place = if is_inside { joint.place } else { shape.place(shape.nearest(joint.place)) };
        let pixel = |at: f64, most: usize| ((at * factor).max(0.0) as usize).min(most - 1);
        AnnotatedJoint {
            name: joint.name.clone(),
            parent: Some(joint.parent.clone()).filter(|parent| !parent.is_empty()),
            place: [pixel(place.x, size[0]), pixel(place.y, size[1])],
            confidence: (joint.confidence * 100.0).round() / 100.0,
        }
    };
    joints.iter().map(joint).collect()
}
