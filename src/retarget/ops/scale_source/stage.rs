//! A larger or smaller source. (docs/algorithm/forward-kinematics.md.)

use glam::{DVec3, Vec3};

use crate::model::{Canceled, Clip, ClipError, Control, JointTracks, Skeleton, Track, Transform};

use crate::retarget::{run::RunError, stages::posing::Posing};

/// What the source's motion is scaled by.
#[derive(Clone, Copy, Debug)]
pub struct SourceScale {
    /// The factor.
    pub factor: f64,
    /// The source joint that stays where it is at each frame; else the origin does.
    pub pivot: Option<usize>,
    /// Up, in the source scene's space.
    pub up: DVec3,
    /// Height of the floor that the pivot is taken down to, in the scene's unit; nothing where it stays at its height.
    pub floor: Option<f64>,
}

/// Scales the figures of a clip, at every frame about its pivot.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ScaledSource {
    scale: SourceScale,
    /// In the source scene's space.
    posing: Posing,
    /// Joints that hang from nothing, with their rest transforms.
    roots: Vec<(usize, Transform)>,
}

impl ScaledSource {
    pub(in crate::retarget) fn new(scale: SourceScale, source: &Skeleton) -> Self {
        let joints = source.joints().iter().enumerate();
        let roots = joints.filter(|(_, joint)| joint.parent.is_none()).map(|(index, joint)| (index, joint.rest));
        Self { scale, posing: Posing::new(source, Transform::IDENTITY, scale.pivot), roots: roots.collect() }
    }

    /// The scaled clip; the same key times and joints.
    pub(in crate::retarget) fn apply(&self, clip: &Clip, control: &Control) -> Result<Clip, RunError> {
        let pivots = self.pivots(clip, control)?;
        let mut joints: Vec<JointTracks> = clip.joints().to_vec();
        let factor = self.scale.factor;
        for (joint, rest) in &self.roots {
            let tracks = &mut joints[*joint];
            let place = |frame: usize| tracks.translation.wide_at(frame, rest.translation);
            let moved =
                pivots.iter().enumerate().map(|(frame, pivot)| (*pivot + (place(frame) - *pivot) * factor).as_vec3());
            let size = |frame: usize| (tracks.scale.wide_at(frame, rest.scale) * factor).as_vec3();
            let (translation, scale) = (
                Track::Sampled(moved.collect::<Vec<Vec3>>()),
                match &tracks.scale {
                    Track::Sampled(values) => Track::Sampled((0..values.len()).map(size).collect()),
                    Track::Constant(_) | Track::Rest => Track::Constant(size(0)),
                },
            );
            (tracks.translation, tracks.scale) = (translation, scale);
        }
        let scaled: Result<Clip, ClipError> = Clip::new(clip.name().to_owned(), clip.times_seconds().to_vec(), joints);
        Ok(scaled?.with_tempo(clip.tempo()))
    }

    /// The point that stays, frame by frame.
    fn pivots(&self, clip: &Clip, control: &Control) -> Result<Vec<DVec3>, Canceled> {
        control.check()?;
        let SourceScale { pivot, up, floor, .. } = self.scale;
        let on_floor = |point: DVec3| floor.map_or(point, |floor| point + up * (floor - point.dot(up)));
        let Some(pivot) = pivot else { return Ok(vec![on_floor(DVec3::ZERO); clip.frame_count()]) };
        let (slot, mut pose) = (self.posing.slot(pivot), self.posing.pose());
        let place = |frame: usize| {
            self.posing.fill(&mut pose, clip.joints(), frame);
            on_floor(pose.model[slot].translation)
        };
        Ok((0..clip.frame_count()).map(place).collect())
    }
}
