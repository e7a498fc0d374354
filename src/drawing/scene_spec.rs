//! Who is in a picture, from where it is seen, what comes out: the config that names all others.

use glam::DVec2;
use serde::Deserialize;

use super::{
    DrawingError,
    yaml::{self, NotUsed, nullable},
};

/// The vertical field of view of every scene.
pub(super) const FIELD_OF_VIEW_DEGREES: f64 = 35.0;
/// Codecs by which an MP4 is meant as it is written here.
const H264_CODECS: [&str; 5] = ["avc1", "mp4v", "h264", "x264", "avc3"];
/// Characters in one scene.
pub(super) const MAX_CHARACTERS: usize = 16;
/// Pixels along one side of the picture.
const MAX_SIDE: usize = 4096;

/// A scene with its view and its controller.
#[derive(Clone, Debug, Deserialize)]
pub struct SceneSpec {
    /// Who is in it.
    pub scene: SceneSection,
    /// From where it is seen.
    #[serde(default, deserialize_with = "nullable")]
    pub view: ViewSection,
    /// What comes out.
    #[serde(default, deserialize_with = "nullable")]
    pub controller: ControllerSection,
    #[serde(flatten)]
    not_used: NotUsed,
}

/// Who is in a scene.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub struct SceneSection {
    /// Tiles under the characters.
    #[serde(default)]
    pub add_floor: bool,
    /// The driving bodies, drawn beside the characters.
    #[serde(default)]
    pub add_ad_retarget_bvh: bool,
    /// The characters, drawn in this order.
    pub animated_characters: Vec<CharacterFiles>,
    #[serde(flatten)]
    not_used: NotUsed,
}

/// The configs of one character.
#[derive(Clone, Debug, Deserialize)]
pub struct CharacterFiles {
    /// Its joints; the texture and the mask are beside this file.
    pub character_cfg: String,
    /// Its motion.
    pub motion_cfg: String,
    /// How the motion drives it.
    pub retarget_cfg: String,
    #[serde(flatten)]
    not_used: NotUsed,
}

/// From where a scene is seen.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE", default)]
pub struct ViewSection {
    /// Red, green, blue and opacity behind everything, 0 to 1.
    pub clear_color: [f64; 4],
    /// A picture behind everything.
    pub background_image: Option<String>,
    /// Width and height in pixels.
    pub window_dimensions: [usize; 2],
    /// Whether the texture is drawn.
    pub draw_ad_txtr: bool,
    /// Whether the bones are drawn.
    pub draw_ad_rig: bool,
    /// Whether each joint's part is drawn in a color of its own.
    pub draw_ad_color: bool,
    /// Whether the edges of the mesh are drawn.
    pub draw_ad_mesh_lines: bool,
    /// Not used: nothing is drawn through OpenGL.
    pub use_mesa: bool,
    /// Where the camera is, in sides of a character's square; Y up.
    pub camera_pos: [f64; 3],
    /// Against this direction the camera looks.
    pub camera_fwd: [f64; 3],
    #[serde(flatten)]
    not_used: NotUsed,
}

impl Default for ViewSection {
    fn default() -> Self {
        Self {
            clear_color: [1.0, 1.0, 1.0, 0.0],
            background_image: None,
            window_dimensions: [500, 500],
            draw_ad_txtr: true,
            draw_ad_rig: false,
            draw_ad_color: false,
            draw_ad_mesh_lines: false,
            use_mesa: false,
            camera_pos: [0.0, 0.7, 2.0],
            camera_fwd: [0.0, 0.5, 2.0],
            not_used: NotUsed::new(),
        }
    }
}

/// How the original program is run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// In a window; here nothing comes out unless an output is named.
    #[default]
    Interactive,
    /// To a file.
    VideoRender,
}

/// What comes out.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE", default)]
pub struct ControllerSection {
    /// In a window or to a file.
    pub mode: Mode,
    /// Not used: there is no window.
    pub keyboard_timestep: f64,
    /// Where the moving picture goes.
    pub output_video_path: Option<String>,
    /// The codec of an MP4.
    pub output_video_codec: Option<String>,
    #[serde(flatten)]
    not_used: NotUsed,
}

impl Default for ControllerSection {
    fn default() -> Self {
        Self {
            mode: Mode::Interactive,
            keyboard_timestep: 1.0 / 30.0,
            output_video_path: None,
            output_video_codec: None,
            not_used: NotUsed::new(),
        }
    }
}

impl SceneSpec {
    /// A view of all between two corners on the plane at `z`, which are in sides of a character's square, from straight ahead, in a picture
    /// of that width and height.
    #[must_use]
    pub fn of_bounds([low, high]: [DVec2; 2], z: f64, window_dimensions: [usize; 2]) -> Self {
        let (middle, size) = ((low + high) / 2.0, high - low);
        let [width, height] = window_dimensions.map(|side| side.max(1) as f64);
        let half = size.y.max(size.x * height / width) / 2.0;
        let distance = half / (FIELD_OF_VIEW_DEGREES / 2.0).to_radians().tan();
        let camera_pos = [middle.x, middle.y, z + distance];
        let view = ViewSection { camera_pos, camera_fwd: [0.0, 0.0, 1.0], window_dimensions, ..ViewSection::default() };
        let scene = SceneSection {
            add_floor: false,
            add_ad_retarget_bvh: false,
            animated_characters: Vec::new(),
            not_used: NotUsed::new(),
        };
        Self { scene, view, controller: ControllerSection::default(), not_used: NotUsed::new() }
    }

    /// Reads and checks the text of a scene.
    ///
    /// # Errors
    ///
    /// With the place of what is wrong.
    pub fn read(text: &str) -> Result<Self, DrawingError> {
        let spec: Self = yaml::parse(text)?;
        let count = spec.scene.animated_characters.len();
        if count == 0 || count > MAX_CHARACTERS {
            let detail = format!("{count} characters");
            return Err(DrawingError::new(
                "scene.ANIMATED_CHARACTERS",
                detail,
                format!("name 1 to {MAX_CHARACTERS} characters"),
            ));
        }
        let size = spec.view.window_dimensions;
        let is_too_large = size[0].saturating_mul(size[1]) > super::MAX_VIDEO_PIXELS;
        if is_too_large || size.iter().any(|&side| side == 0 || side > MAX_SIDE) {
            let detail = format!("{} by {} pixels", size[0], size[1]);
            let fix =
                format!("take sides of 1 to {MAX_SIDE}, and {} pixels altogether at most", super::MAX_VIDEO_PIXELS);
            return Err(DrawingError::new("view.WINDOW_DIMENSIONS", detail, fix));
        }
        if spec.view.clear_color.iter().any(|part| !(0.0..=1.0).contains(part)) {
            return Err(DrawingError::new("view.CLEAR_COLOR", "a part is not within 0 and 1", "give parts of 0 to 1"));
        }
        for (field, vector) in [("view.CAMERA_POS", spec.view.camera_pos), ("view.CAMERA_FWD", spec.view.camera_fwd)] {
            if vector.iter().any(|part| !part.is_finite()) {
                return Err(DrawingError::new(field, "a part is not a finite number", "give three numbers"));
            }
        }
        Ok(spec)
    }

    /// The fields that nothing reads, with their sections.
    #[must_use]
    pub fn not_used(&self) -> Vec<String> {
        let mut fields: Vec<String> = self.not_used.keys().cloned().collect();
        fields.extend(self.scene.not_used.keys().map(|field| format!("scene.{field}")));
        fields.extend(self.view.not_used.keys().map(|field| format!("view.{field}")));
        fields.extend(self.controller.not_used.keys().map(|field| format!("controller.{field}")));
        for (index, files) in self.scene.animated_characters.iter().enumerate() {
            fields.extend(files.not_used.keys().map(|field| format!("scene.ANIMATED_CHARACTERS[{index}].{field}")));
        }
        if let Some(codec) = &self.controller.output_video_codec
            && !H264_CODECS.contains(&codec.to_lowercase().as_str())
        {
            fields.push(format!("controller.OUTPUT_VIDEO_CODEC, {codec}: an MP4 is written as H.264"));
        }
        if self.view.use_mesa {
            fields.push("view.USE_MESA".to_owned());
        }
        if self.controller.keyboard_timestep != ControllerSection::default().keyboard_timestep {
            fields.push("controller.KEYBOARD_TIMESTEP".to_owned());
        }
        fields
    }
}
