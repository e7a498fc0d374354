//! Numbers that are animated beside the joints, on their way into the result.

pub(in crate::retarget) mod drive;
pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::drive::CurveDrive;
pub use self::spec::{ContactCurve, CurveRow, CurvesOp, OtherCurves};

use crate::model::{Clip, Morph, Track};
use crate::retarget::{
    ops::{context::Context, op_spec::OpSpec, scope::Scope},
    stages::clock::Moment,
};

/// The values of each drive over the frames of a clip, whose own curves are `source`, in the order of the drives.
#[must_use]
pub fn carried_curves(clip: &Clip, source: &[Morph], drives: &[CurveDrive]) -> Vec<Track<f32>> {
    let values = |drive: &CurveDrive| {
        let rest = source[drive.source].rest;
        let track = clip.morphs().iter().find(|track| track.morph == drive.source);
        let at_rest = drive.value(f64::from(rest));
        let value = |frame: usize| {
            let own = track.map_or(rest, |track| track.weights.at(frame, rest));
            let alpha = drive.schedule.alpha_at(Moment { frame, seconds: clip.times_seconds()[frame] });
            #[expect(clippy::cast_possible_truncation, reason = "curves are single precision in every file")]
            let value = (at_rest + (drive.value(f64::from(own)) - at_rest) * alpha) as f32;
            value
        };
        Track::Sampled((0..clip.frame_count()).map(value).collect()).compacted()
    };
    drives.iter().map(values).collect()
}

impl OpSpec for CurvesOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn changes_poses(&self) -> bool {
        false
    }

    fn looks_at_whole_clip(&self) -> bool {
        true
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let schedule = context.schedule(&self.scope);
        let Context { index, source, clip, .. } = *context;
        let drives = resolve::curve_drives(self, index, &schedule, source.scene, clip, context.fields);
        context.resolved.curves.extend(drives);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::{MorphPlace, MorphTrack},
        retarget::ops::schedule::Schedule,
    };

    #[test]
    fn curves_go_over_as_much_as_their_op_works() {
        let morph = |name: &str, rest| Morph { name: name.into(), rest, place: MorphPlace::Property };
        let source = [morph("still", 3.0), morph("lock", 0.5)];
        let times: Vec<f64> = (0..4).map(f64::from).collect();
        let clip = Clip::new(String::new(), times, Vec::new()).expect("a clip");
        let lock = MorphTrack { morph: 1, weights: Track::Sampled(vec![0.0, 1.0, 2.0, 4.0]) };
        let clip = clip.with_morphs(vec![lock]).expect("a curve");
        let schedule = Schedule { alpha: vec![[0.0, 1.0], [2.0, 0.0]], frames: [0, 2] };
        let drive = |source, gain| CurveDrive { gain, ..CurveDrive::unchanged("a".into(), source, schedule.clone()) };
        let carried = carried_curves(&clip, &source, &[drive(1, 2.0), drive(0, 1.0)]);
        assert_eq!(carried[0], Track::Sampled(vec![0.0, 1.5, 1.0, 1.0]), "full, half, none, and outside of the frames");
        assert_eq!(carried[1], Track::Constant(3.0), "a curve that the clip does not animate rests");
    }
}
