//! How well rest files could be put onto their rigs.

use super::{
    metric::{Finding, Reading},
    motion::Both,
};
use crate::rig::Rig;

const NO_REST_FILE: &str = "no rest file was given";

/// The largest angle by which a bone of a rest pose points elsewhere than in its rest file.
pub(super) fn rest_residual(rigs: &Both<&Rig<'_>>) -> Finding {
    let mut reading = Reading::default();
    for rig in [rigs.source, rigs.target] {
        let Some((joint, degrees)) = rig.rest_fit.as_ref().and_then(|fit| fit.worst()) else { continue };
        reading.value = reading.value.max(degrees);
        reading.parts.insert(rig.name.to_owned(), degrees);
        // Places are told of the target only.
        if rig.name == "target" {
            reading.worst.push((0, joint, rig.name.to_owned(), degrees));
        }
    }
    if reading.parts.is_empty() { Err(NO_REST_FILE) } else { Ok(reading) }
}
