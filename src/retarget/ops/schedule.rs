//! When an op works on a clip, and how much.

use crate::model::{Clip, Scene};

use super::{Alpha, Scope, source_curves::alpha_keys};
use crate::{
    retarget::stages::clock::Moment,
    rig::error::{SpecError, SpecErrorKind, SpecField},
};

/// When an op works.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    /// Keys of seconds and alpha, at least one.
    pub alpha: Vec<[f64; 2]>,
    /// First and last frame.
    pub frames: [usize; 2],
}

impl Schedule {
    /// All of it, at all frames.
    #[must_use]
    pub fn always() -> Self {
        Self { alpha: vec![[0.0, 1.0]], frames: [0, usize::MAX] }
    }

    /// The share of the stage's change at a frame: the alpha at its time, 0 outside of the frames.
    pub(in crate::retarget) fn alpha_at(&self, Moment { frame, seconds }: Moment) -> f64 {
        if frame < self.frames[0] || frame > self.frames[1] {
            return 0.0;
        }
        let after = self.alpha.partition_point(|key| key[0] <= seconds);
        let (Some(before), next) = (self.alpha[..after].last(), self.alpha.get(after)) else {
            return self.alpha.first().map_or(1.0, |key| key[1]);
        };
        let Some(next) = next else { return before[1] };
        before[1] + (next[1] - before[1]) * (seconds - before[0]) / (next[0] - before[0])
    }
}

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
pub(in crate::retarget) fn schedule(
    alpha: &Alpha,
    frames: Option<[usize; 2]>,
    pointer: &str,
    scene: &Scene,
    clip: &Clip,
    fields: &mut Vec<SpecField>,
) -> Schedule {
    let last = clip.frame_count() - 1;
    // What is compiled for one clip works on longer ones too.
    let frames = frames.unwrap_or([0, usize::MAX]);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_is_linear_between_keys_and_nothing_outside_of_the_frames() {
        let schedule = Schedule { alpha: vec![[1.0, 0.0], [2.0, 1.0]], frames: [2, 50] };
        let alpha = |frame: usize, seconds: f64| schedule.alpha_at(Moment { frame, seconds });
        assert_eq!(alpha(10, 0.5), 0.0, "before the first key");
        assert_eq!(alpha(10, 1.25), 0.25, "between");
        assert_eq!(alpha(10, 9.0), 1.0, "after the last");
        assert_eq!(alpha(51, 9.0), 0.0, "outside of the frames");
        assert_eq!(alpha(1, 1.5), 0.0, "outside of the frames");
    }
}
