//! The config of a scene: which characters do what, and how they are seen.

use serde::Deserialize;

use super::read;
use crate::drawing::error::DrawingError;

/// A scene. Fields have the names of the program's own files, in small letters.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// Who is there.
    pub scene: SceneSection,
    /// How it is seen.
    #[serde(default)]
    pub view: ViewSection,
    /// Where it goes.
    #[serde(default)]
    pub controller: ControllerSection,
}

/// Who is there.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "SCREAMING_SNAKE_CASE")]
pub struct SceneSection {
    /// Whether the floor is drawn.
    #[serde(default)]
    pub add_floor: bool,
    /// Whether the driving skeletons are drawn.
    #[serde(default, rename = "ADD_AD_RETARGET_BVH")]
    pub add_ad_retarget_bvh: bool,
    /// The characters, in the order in which they are drawn; at least one.
    pub animated_characters: Vec<CharacterFiles>,
}

/// The files of one character.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CharacterFiles {
    /// Path of the character's config; texture and mask lie beside it.
    pub character_cfg: String,
    /// Path of the motion's config.
    pub motion_cfg: String,
    /// Path of the retarget's config.
    pub retarget_cfg: String,
}

/// How it is seen.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "SCREAMING_SNAKE_CASE")]
pub struct ViewSection {
    /// Red, green, blue and opacity, each from 0 to 1.
    pub clear_color: [f64; 4],
    /// Path of a picture behind everything.
    pub background_image: Option<String>,
    /// Width and height in pixels.
    pub window_dimensions: [u32; 2],
    /// Whether characters are drawn with their texture.
    #[serde(rename = "DRAW_AD_TXTR")]
    pub draw_ad_txtr: bool,
    /// Whether their bones are drawn.
    #[serde(rename = "DRAW_AD_RIG")]
    pub draw_ad_rig: bool,
    /// Whether they are drawn in one color for each joint.
    #[serde(rename = "DRAW_AD_COLOR")]
    pub draw_ad_color: bool,
    /// Whether the lines of their meshes are drawn.
    #[serde(rename = "DRAW_AD_MESH_LINES")]
    pub draw_ad_mesh_lines: bool,
    /// Without effect: nothing here needs a display.
    pub use_mesa: bool,
    /// Where the camera is; 1 is the width of a character's picture.
    pub camera_pos: [f64; 3],
    /// Away from what the camera looks at.
    pub camera_fwd: [f64; 3],
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
        }
    }
}

/// Where it goes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "SCREAMING_SNAKE_CASE")]
pub struct ControllerSection {
    /// `interactive` or `video_render`; both are rendered to a file.
    pub mode: String,
    /// Without effect: there is no window.
    pub keyboard_timestep: f64,
    /// The file that is written where the command line names none.
    pub output_video_path: String,
    /// Without effect: the ending of the file decides.
    pub output_video_codec: String,
}

impl Default for ControllerSection {
    fn default() -> Self {
        Self {
            mode: "interactive".to_owned(),
            keyboard_timestep: 0.0333,
            output_video_path: "./output_video.mp4".to_owned(),
            output_video_codec: "avc1".to_owned(),
        }
    }
}

impl SceneSpec {
    /// Fields that are set and that nothing here reads, for a warning.
    #[must_use]
    pub fn not_used(&self) -> Vec<&'static str> {
        let usual = (ViewSection::default(), ControllerSection::default());
        let set = [
            ("view.USE_MESA", self.view.use_mesa),
            ("controller.KEYBOARD_TIMESTEP", self.controller.keyboard_timestep != usual.1.keyboard_timestep),
            ("controller.OUTPUT_VIDEO_CODEC", self.controller.output_video_codec != usual.1.output_video_codec),
        ];
        set.into_iter().filter(|(_, is_set)| *is_set).map(|(name, _)| name).collect()
    }
}

/// Reads the config of a scene.
///
/// # Errors
/// When it is no YAML, lacks what it needs, has a field that is not known, or holds a value that cannot be used.
pub fn read_scene(bytes: &[u8]) -> Result<SceneSpec, DrawingError> {
    let scene: SceneSpec = read(bytes, "the scene")?;
    let place = |field: &str| format!("/{field}");
    if scene.scene.animated_characters.is_empty() {
        let place = place("scene/ANIMATED_CHARACTERS");
        return Err(DrawingError::new(place, "there are no characters", "name at least one"));
    }
    if !["interactive", "video_render"].contains(&scene.controller.mode.as_str()) {
        let detail = format!("'{}' is no mode", scene.controller.mode);
        return Err(DrawingError::new(place("controller/MODE"), detail, "use video_render or interactive"));
    }
    if scene.view.window_dimensions.iter().any(|side| !(1..=1920).contains(side)) {
        let detail = "width and height are 1 to 1920 pixels";
        return Err(DrawingError::new(place("view/WINDOW_DIMENSIONS"), detail, ""));
    }
    if scene.view.clear_color.iter().any(|part| !(0.0..=1.0).contains(part)) {
        return Err(DrawingError::new(place("view/CLEAR_COLOR"), "each part is 0 to 1", ""));
    }
    Ok(scene)
}
