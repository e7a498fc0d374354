//! What somebody wants of a drawing: the one document, like that of a retarget. Every field is optional; `{}` finds everything out. The
//! doc comments here are the reference: the JSON Schema and the API document take them over.

use std::sync::OnceLock;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use crate::{
    retarget::{EditSpec, parse_by_schema, parse_document},
    rig::{ClipChoice, RigSpec, SpecError, SpecErrorKind, SpecField, deserialize::one_or_several},
};

use super::{Deformation, Manner, RetargetSpec, Rules, SceneSpec, ViewSection};

/// How a drawn character is to be moved. Every field is optional; `{}` finds everything out.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DrawSpec {
    /// Version of this document's shape; 1.
    #[schemars(range(min = 1, max = 1))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u32>,
    /// Says that this is no retarget of a figure in space.
    pub task: DrawTask,
    /// The rig that the motion comes from, as in the spec of a retarget.
    pub source: RigSpec,
    /// Which clip of the source file; its name, or its index from 0. Default: the first clip in which something moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clip: Option<ClipChoice>,
    /// Edits of the clip before it moves the drawing, as in the spec of a retarget: its time, its rate, its sides.
    pub edit: EditSpec,
    /// How the drawing is put together.
    pub drawing: FigureSpec,
    /// How the motion comes onto the picture.
    pub project: ProjectSpec,
    /// Which joints of the body move which bones, from which side they are seen, and in which order parts are drawn: the retarget config
    /// of *Animated Drawings*, as an object. Default: by the roles of the body and the names of the drawing's joints. The resolved spec
    /// says what was chosen.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<serde_json::Map<String, serde_json::Value>>")]
    pub retarget: Option<RetargetSpec>,
    /// The name of a scene config of *Animated Drawings* in the archive of the drawing, which says who moves how, and from where that is seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// From where it is seen, and what of it. A scene has a view of its own.
    pub view: DrawnView,
    /// What comes out: one output or a list. Default: GIF.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output: Option<DrawnOutputs>,
    /// Whose numbers come out: `animated_drawings` for those of that program, with all that is wrong in them. Goes with its configs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compat: Option<Compat>,
    /// Turns warnings, and measures that fail, into an error.
    pub strict: bool,
}

/// The task of a [`DrawSpec`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DrawTask {
    /// A drawing moves.
    #[default]
    Draw,
}

/// Whose numbers come out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Compat {
    /// Those of the program *Animated Drawings*.
    AnimatedDrawings,
}

/// How a drawing is put together.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FigureSpec {
    /// How the mesh follows the joints.
    pub deform: DeformWord,
    /// Joints whose bones keep all that is nearest to them as it is, such as `neck` for the head. At most 128.
    pub rigid: Vec<String>,
}

/// How a mesh follows the joints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DeformWord {
    /// Limbs keep their length and their width.
    #[default]
    Bones,
    /// As rigid as possible between the joints, as *Animated Drawings* does it.
    Arap,
}

/// How the motion comes onto the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ProjectSpec {
    /// Over so many seconds a bone follows what drives it. 0 to 1; default 0.06.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub damping: f64,
    /// Whether a bone is drawn shorter where it points at the viewer.
    pub foreshorten: bool,
    /// What is done where the body turns around and the drawing is seen from the side.
    pub turn: Turn,
    /// Whether feet that stand stay where they are.
    pub plant: bool,
    /// Whether the camera goes along with the drawing. Default: where it goes farther than one and a half of its own side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stay: Option<bool>,
}

impl Default for ProjectSpec {
    fn default() -> Self {
        Self { damping: 0.06, foreshorten: false, turn: Turn::Face, plant: true, stay: None }
    }
}

/// What is done where the body turns around.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Turn {
    /// Nothing: the drawing faces the same way all the time.
    #[default]
    Face,
    /// It is mirrored where the body has turned by more than 100 degrees for more than 0.3 s.
    Mirror,
}

/// From where a drawing is seen, and what of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DrawnView {
    /// Width and height of the picture in pixels, 1 to 4096, and no more than 1920 times 1080 pixels together. Default 500 and 500.
    pub size: [usize; 2],
    /// What is behind everything: `#rrggbb`, or `#rrggbbaa` with opacity. Default: nothing.
    #[schemars(regex(pattern = r"^#([0-9a-fA-F]{6}|[0-9a-fA-F]{8})$"))]
    pub background: String,
    /// Where it is seen from. Default: so that the whole way is seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<DrawnCamera>,
    /// What is drawn, in this order of layers: `floor`, `texture`, `colors`, `mesh`, `rig`, `source`. Default: `texture`.
    pub draw: Vec<DrawnLayer>,
}

impl Default for DrawnView {
    fn default() -> Self {
        Self { size: [500, 500], background: "#ffffff00".to_owned(), camera: None, draw: vec![DrawnLayer::Texture] }
    }
}

/// A camera of a drawing, in sides of its square.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DrawnCamera {
    /// Where it is: right, up and toward the viewer.
    pub position: [f64; 3],
    /// Against this direction it looks.
    pub backward: [f64; 3],
}

/// What of a drawing is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DrawnLayer {
    /// The drawing itself.
    Texture,
    /// The part of each joint in a color of its own.
    Colors,
    /// The edges of its mesh.
    Mesh,
    /// Its bones.
    Rig,
    /// Tiles under it.
    Floor,
    /// The joints of the body that moves it.
    Source,
}

/// One output or several.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum DrawnOutputs {
    /// One.
    One(DrawnOutput),
    /// Several, at most 16.
    Many(Vec<DrawnOutput>),
}

impl<'de> Deserialize<'de> for DrawnOutputs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        one_or_several(deserializer, "an output or a list of outputs", Self::One, Self::Many)
    }
}

/// An output of a drawing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DrawnOutput {
    /// The name of a format: `gif`, `webp`, `apng`, `mp4`, `png_zip`, `glb`, `poses2d_npz` or `poses2d_json`. Default `gif`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub format: Option<String>,
}

impl DrawSpec {
    /// The same, with the numbers of *Animated Drawings*.
    #[must_use]
    pub fn with_compat(self) -> Self {
        Self { compat: Some(Compat::AnimatedDrawings), ..self }
    }

    /// The same, with the clip of that name.
    #[must_use]
    pub fn with_clip(self, name: &str) -> Self {
        Self { clip: Some(ClipChoice::Name(name.to_owned())), ..self }
    }

    /// The rules that the drawing follows.
    #[must_use]
    pub fn rules(&self) -> Rules {
        let manner = if self.compat.is_some() { Manner::Original } else { Manner::Steady };
        Rules {
            damped_over_seconds: self.project.damping,
            foreshorten: self.project.foreshorten,
            mirror: self.project.turn == Turn::Mirror,
            plant: self.project.plant,
            stay: self.project.stay,
            ..Rules::of(manner)
        }
    }

    /// How the mesh follows the joints.
    #[must_use]
    pub fn deformation(&self) -> Deformation {
        match (self.compat, self.drawing.deform) {
            (None, DeformWord::Bones) => Deformation::Bones,
            _ => Deformation::Arap,
        }
    }

    /// The formats that it names, in their order.
    #[must_use]
    pub fn formats(&self) -> Vec<&str> {
        match &self.output {
            None => Vec::new(),
            Some(DrawnOutputs::One(output)) => vec![output.name()],
            Some(DrawnOutputs::Many(outputs)) => outputs.iter().map(DrawnOutput::name).collect(),
        }
    }
}

impl DrawnOutput {
    fn name(&self) -> &str {
        self.format.as_deref().unwrap_or("gif")
    }
}

impl DrawnView {
    /// The same as a section of a scene; `scene` has the camera that sees all, where none is given.
    #[must_use]
    pub fn over(&self, scene: &SceneSpec) -> (ViewSection, bool, bool) {
        let has = |layer: DrawnLayer| self.draw.contains(&layer);
        let mut view = scene.view.clone();
        view.clear_color = color(&self.background).unwrap_or([1.0, 1.0, 1.0, 0.0]);
        view.window_dimensions = self.size;
        view.draw_ad_txtr = has(DrawnLayer::Texture);
        view.draw_ad_rig = has(DrawnLayer::Rig);
        view.draw_ad_color = has(DrawnLayer::Colors);
        view.draw_ad_mesh_lines = has(DrawnLayer::Mesh);
        if let Some(camera) = self.camera {
            (view.camera_pos, view.camera_fwd) = (camera.position, camera.backward);
        }
        (view, has(DrawnLayer::Floor), has(DrawnLayer::Source))
    }
}

/// Red, green, blue and opacity, 0 to 1, of `#rrggbb` or `#rrggbbaa`.
fn color(text: &str) -> Option<[f64; 4]> {
    let digits = text.strip_prefix('#').filter(|digits| digits.is_ascii())?;
    let part = |place: usize| u8::from_str_radix(digits.get(2 * place..2 * place + 2)?, 16).ok().map(f64::from);
    let opacity = if digits.len() == 6 { Some(255.0) } else { part(3) };
    Some([part(0)?, part(1)?, part(2)?, opacity?].map(|part| part / 255.0)).filter(|_| matches!(digits.len(), 6 | 8))
}

/// Reads and checks a document.
///
/// # Errors
///
/// With the pointer of each field that is wrong.
pub fn parse_draw_spec(bytes: &[u8]) -> Result<DrawSpec, SpecError> {
    parse_draw_value(parse_document(bytes)?)
}

/// Whether a document says that it is of this kind.
#[must_use]
pub fn is_draw_document(document: &serde_json::Value) -> bool {
    document.get("task").is_some_and(|task| task == "draw")
}

/// The same from a parsed document.
///
/// # Errors
///
/// As [`parse_draw_spec`].
pub fn parse_draw_value(document: serde_json::Value) -> Result<DrawSpec, SpecError> {
    let spec: DrawSpec = parse_by_schema(document, draw_spec_schema())?;
    let mut fields = Vec::new();
    let mut require = |holds: bool, pointer: &str, detail: String| {
        if !holds {
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, pointer, detail));
        }
    };
    let [width, height] = spec.view.size;
    let pixels = width.saturating_mul(height);
    require(
        width > 0 && height > 0 && width.max(height) <= 4096 && pixels <= super::MAX_VIDEO_PIXELS,
        "/view/size",
        format!("{width} by {height}: sides are 1 to 4096, and {} pixels are the most", super::MAX_VIDEO_PIXELS),
    );
    require(
        color(&spec.view.background).is_some(),
        "/view/background",
        format!("{:?} is no color; write #rrggbb or #rrggbbaa", spec.view.background),
    );
    require(spec.drawing.rigid.len() <= 128, "/drawing/rigid", "at most 128 joints are named".to_owned());
    require(spec.formats().len() <= 16, "/output", "at most 16 outputs are made".to_owned());
    if let Some(camera) = spec.view.camera {
        let is_finite = camera.position.iter().chain(&camera.backward).all(|part| part.is_finite());
        require(is_finite, "/view/camera", "three finite numbers each".to_owned());
    }
    SpecError::from_fields(fields).map_or(Ok(spec), Err)
}

/// The JSON Schema of [`DrawSpec`].
#[must_use]
pub fn draw_spec_schema() -> &'static serde_json::Value {
    static SCHEMA: OnceLock<serde_json::Value> = OnceLock::new();
    SCHEMA.get_or_init(|| schemars::schema_for!(DrawSpec).to_value())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_document_has_the_defaults_and_unknown_fields_are_named() {
        let spec = parse_draw_spec(b"{}").expect("a spec");
        assert_eq!(spec.rules(), Rules::of(Manner::Steady));
        assert_eq!(spec.deformation(), Deformation::Bones);
        let told = |text: &str| parse_draw_spec(text.as_bytes()).expect_err("refused").fields[0].pointer.clone();
        assert_eq!(told("{\"project\": {\"dampin\": 1}}"), "/project/dampin");
        assert_eq!(told("{\"view\": {\"size\": [0, 5]}}"), "/view/size");
        assert_eq!(told("{\"view\": {\"background\": \"red\"}}"), "/view/background");
        assert_eq!(told("{\"project\": {\"damping\": 7}}"), "/project/damping");
    }

    #[test]
    fn colors_are_read() {
        assert_eq!(color("#ff0000"), Some([1.0, 0.0, 0.0, 1.0]));
        assert_eq!(color("#00ff0000"), Some([0.0, 1.0, 0.0, 0.0]));
        assert_eq!(color("#00ff0"), None);
    }
}
