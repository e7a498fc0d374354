//! The four configs of Animated Drawings, as its files stand, `!!python/tuple` included.

mod character;
mod motion;
mod retarget;
mod scene;

pub use character::{CharacterSpec, SkeletonJoint, read_character};
pub use motion::{MotionSpec, UpAxis, read_motion};
pub use retarget::{
    BodypartGroup, DrawingRetargetSpec, ProjectionGroup, ProjectionMethod, RootOffset, RuntimeCheck, read_retarget,
};
pub use scene::{CharacterFiles, SceneSpec, read_scene};

use serde::de::DeserializeOwned;

use super::error::DrawingError;

/// Reads YAML or JSON into a config. `what` is which, as `the motion config`.
fn read<T: DeserializeOwned>(bytes: &[u8], what: &str) -> Result<T, DrawingError> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        DrawingError::new("", format!("{what} is not UTF-8 text: byte {}", error.valid_up_to()), "save it as UTF-8")
    })?;
    let document: serde_json::Value = serde_saphyr::from_str(text).map_err(|error| {
        let line = error.to_string().lines().next().unwrap_or_default().to_owned();
        DrawingError::new("", format!("{what} is no YAML: {line}"), "")
    })?;
    serde_path_to_error::deserialize(document).map_err(|error| {
        let place: String = error.path().to_string();
        let place =
            if place == "." { String::new() } else { format!("/{}", place.replace(['.', '['], "/").replace(']', "")) };
        DrawingError::new(place, format!("{what} cannot be used: {}", error.inner()), "")
    })
}
