//! What recognition may use beside the skeleton: the user's templates, and what it found lately.

use super::{memory::RecognitionMemory, template::RigTemplate};

/// What recognition may use beside the skeleton.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recognizer<'a> {
    /// The user's own templates, which are tried before the built-in ones.
    pub templates: &'a [RigTemplate],
    /// What was found lately; without one, every skeleton is looked at anew.
    pub memory: Option<&'a RecognitionMemory>,
}

impl<'a> From<&'a [RigTemplate]> for Recognizer<'a> {
    fn from(templates: &'a [RigTemplate]) -> Self {
        Self { templates, memory: None }
    }
}
