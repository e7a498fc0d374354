//! Many clips onto one character, without a server: `retarget --batch`. Every clip has results of its own, called after it.

use std::{path::Path, sync::Arc};

use super::{
    clips::{self, Clip},
    exit::{Exit, FAILED},
    retarget::{Arguments, retarget_one},
    rows::{self, Row},
    watch::{ProgressWatch, cancel_on_interrupt},
};
use crate::model::Control;

/// Retargets every clip of a folder or a list. A clip that fails is told, and the others go on.
pub(super) fn run(arguments: &Arguments, place: &Path) -> Result<(), Exit> {
    clips::check_names(arguments.outputs.files())?;
    let clips = clips::clips(place)?;
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let watch = ProgressWatch::start(&control, arguments.outputs.destinations.progress);
    let mut rows = Vec::with_capacity(clips.len());
    for (index, Clip { name, path }) in clips.iter().enumerate() {
        control.repeat("retarget", index as u64, clips.len() as u64);
        if control.check().is_err() {
            let message = format!("interrupted; {} of {} clips have their results", rows.len(), clips.len());
            return Err(Exit::new(FAILED, message, ""));
        }
        rows.push(Row { name: name.clone(), ended: retarget_one(arguments, path, name) });
    }
    drop(watch);
    rows::tell(&rows)?;
    rows::end(
        &rows,
        arguments.outputs.destinations.judging,
        "the lines above say why; the results of the others are there",
    )
}
