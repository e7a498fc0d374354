//! When an op works on a clip, and how much.

use crate::model::{Clip, Scene};

use super::{
    super::{
        error::{SpecError, SpecErrorKind, SpecField},
        spec::{Alpha, Scope},
        stages::Schedule,
    },
    curves::alpha_keys,
};

/// The schedule of an op of that scope on a clip of a scene. `pointer` is that of the op in the spec.
///
/// # Errors
/// When the clip has none of the frames, or no such curve.
pub fn scheduled(scope: &Scope, pointer: &str, scene: &Scene, clip: &Clip) -> Result<Schedule, SpecError> {
    let mut fields = Vec::new();
    let schedule = schedule(&scope.alpha, scope.frames, pointer, scene, clip, &mut fields);
    SpecError::from_fields(fields).map_or(Ok(schedule), Err)
}

/// The same, with what is wrong added to `fields`.
pub(super) fn schedule(
    alpha: &Alpha,
    frames: Option<[usize; 2]>,
    pointer: &str,
    scene: &Scene,
    clip: &Clip,
    fields: &mut Vec<SpecField>,
) -> Schedule {
    let last = clip.frame_count() - 1;
    let frames = frames.unwrap_or([0, last]);
    if frames[0] > frames[1] || frames[0] > last {
        let detail = format!("frames {} to {} are none of the clip's 0 to {last}", frames[0], frames[1]);
        fields.push(SpecField::new(SpecErrorKind::InvalidValue, format!("{pointer}/frames"), detail));
    }
    let alpha = match alpha {
        Alpha::Constant(value) => vec![[0.0, *value]],
        Alpha::Keyed(keys) => keys.clone(),
        Alpha::Curve(curve) => alpha_keys(curve, format!("{pointer}/alpha"), scene, clip, fields),
    };
    Schedule { alpha, frames }
}
