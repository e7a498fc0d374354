//! A scene and a clip to a file.

use crate::{
    formats::{FormatError, WriteOptions},
    model::{Clip, Control, Reporter, Scene},
};

pub(in crate::formats) fn write(
    _target: &Scene,
    _clip: &Clip,
    _options: &WriteOptions,
    _control: &Control,
    _reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    todo!()
}
