//! Clips whose end flows into their begin, and what comes before and after them when they are played over and over.
//! (docs/algorithm/loops.md.)
//!
//! Steps of games are such clips. Stages that look at time see the end of a clip where there is none: a foot that is held at the last
//! frame and not at the first would jump at every pass. So a clip that flows into itself is worked on with what is played before
//! it and after it, and that is cut off again.

use glam::{DQuat, DVec3, Quat, Vec3};

use super::{
    mapping::Mapping,
    stages::{
        clock::Clock,
        posing::{Pose, Posing},
    },
};
use crate::model::{Clip, ClipError, JointTracks, Skeleton, Track, Transform, Travel};

/// Fewer frames, or shorter, on the clock of the performance, are no motion that is repeated.
const MIN_FRAMES: usize = 4;
const MIN_SECONDS: f64 = 0.2;
/// Pelvis and legs come back where they are turned by less than this, and are no farther away than this share of the figure's size: steps of
/// games are repeated with as much. Arms and heads, of which stages do not ask that they rest anywhere, may miss their places by more.
const MAX_DEGREES: f64 = 2.0;
const MAX_SHARE: f64 = 0.03;
const OTHERS: f64 = 5.0;
/// A figure that gets less far than this share of its size, and turns less, is on the spot.
const ON_SPOT: f64 = 0.05;
/// How long what is played before and after matters, on the clock of the performance. Stages smooth over less.
const AROUND_SECONDS: f64 = 1.5;
/// So many frames before and after at most, or as many as the clip has.
const MAX_FRAMES: usize = 512;

/// Looks at whether clips of one source flow into themselves.
#[derive(Clone, Debug)]
pub(super) struct Loops {
    /// In the source scene's space.
    posing: Posing,
    /// Slots of what drives the target, and how exactly they must come back; the first is the joint that carries the figure.
    slots: Vec<(usize, f64)>,
    /// Joints that hang from nothing, with their rest transforms.
    roots: Vec<(usize, Transform)>,
    up: DVec3,
    /// The largest distance from the joint that carries the figure to another one at rest.
    size: f64,
}

/// How a clip goes on behind its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Loop {
    /// After so many frames it begins again.
    frames: usize,
    /// And after so much time.
    seconds: f64,
    /// There and so it begins again.
    travel: Travel,
    /// Whether it begins again where it began.
    pub(super) is_on_spot: bool,
}

/// A clip with what is played before it and after it.
#[derive(Clone, Debug)]
pub(super) struct Surrounded {
    pub(super) clip: Clip,
    pub(super) clock: Clock,
}

impl Loops {
    /// Nothing where nothing drives the target. `up` in the source scene's space.
    pub(super) fn new(source: &Skeleton, mapping: &Mapping, up: DVec3) -> Option<Self> {
        let carrier = mapping.pelvis.map(|pelvis| pelvis.source);
        let chains = mapping.chains.iter().flat_map(|chain| chain.source.iter().copied());
        let driving: Vec<usize> = carrier.into_iter().chain(chains).collect();
        let posing = Posing::new(source, Transform::IDENTITY, driving.iter().copied());
        let mut pose = posing.pose();
        posing.fill_model(&mut pose, &vec![JointTracks::default(); source.len()], 0);
        let limbs = mapping.limbs.iter().filter(|pair| pair.limb.is_leg()).map(|pair| pair.source);
        let standing: Vec<usize> = limbs.flat_map(|leg| [leg.start, leg.middle, leg.end]).chain(carrier).collect();
        let slack = |joint: usize| if standing.is_empty() || standing.contains(&joint) { 1.0 } else { OTHERS };
        let slots: Vec<(usize, f64)> = driving.into_iter().map(|joint| (posing.slot(joint), slack(joint))).collect();
        let start = pose.model[slots.first()?.0].translation;
        let size = slots.iter().map(|(slot, _)| pose.model[*slot].translation.distance(start)).fold(0.0, f64::max);
        let roots = source.joints().iter().enumerate().filter(|(_, joint)| joint.parent.is_none());
        let roots = roots.map(|(index, joint)| (index, joint.rest)).collect();
        Some(Self { posing, slots, roots, up, size })
    }

    /// How a clip goes on behind its end; nothing where it does not flow into itself.
    pub(super) fn find(&self, clip: &Clip) -> Option<Loop> {
        let frames = clip.frame_count();
        let duration = clip.duration_seconds();
        if frames < MIN_FRAMES || duration * clip.tempo() < MIN_SECONDS {
            return None;
        }
        let mut pose = self.posing.pose();
        let first = self.pose(&mut pose, clip, 0);
        let last = self.pose(&mut pose, clip, frames - 1);
        let travel = Travel::between(&first[0], &last[0], self.up);
        if self.come_back(&first, &last, travel, &vec![Step::NONE; first.len()]) {
            return Some(self.repeats(frames - 1, duration, travel));
        }
        let second = self.pose(&mut pose, clip, 1);
        let before_last = self.pose(&mut pose, clip, frames - 2);
        let steps: Vec<Step> = (0..first.len())
            .map(|slot| Step::between([&first[slot], &second[slot]], [&before_last[slot], &last[slot]]))
            .collect();
        let expected: Vec<Transform> = last.iter().zip(&steps).map(|(last, step)| step.from(last)).collect();
        let travel = Travel::between(&first[0], &expected[0], self.up);
        // A figure that gets nowhere has its pelvis sway by no more than a step; where exactly is not known.
        let travel = if travel.way.length() > steps[0].way.length() { travel } else { Travel::NONE };
        let seconds = duration * frames as f64 / (frames - 1) as f64;
        self.come_back(&first, &expected, travel, &steps).then(|| self.repeats(frames, seconds, travel))
    }

    fn repeats(&self, frames: usize, seconds: f64, travel: Travel) -> Loop {
        let is_on_spot =
            travel.way.length() < ON_SPOT * self.size && travel.turn.angle_between(DQuat::IDENTITY) < ON_SPOT;
        Loop { frames, seconds, travel, is_on_spot }
    }

    fn pose(&self, pose: &mut Pose, clip: &Clip, frame: usize) -> Vec<Transform> {
        self.posing.fill_model(pose, clip.joints(), frame);
        self.slots.iter().map(|(slot, _)| pose.model[*slot]).collect()
    }

    /// Whether joints are where they were at first, but for how far the figure got; a joint that moves fast may miss that by more.
    fn come_back(&self, first: &[Transform], now: &[Transform], travel: Travel, steps: &[Step]) -> bool {
        let mut joints = first.iter().zip(now).zip(steps).zip(&self.slots);
        joints.all(|(((first, now), step), (_, slack))| {
            let turned = (travel.turn * first.rotation).angle_between(now.rotation);
            let moved = travel.place(first.translation).distance(now.translation);
            let (may_move, may_turn) = step.may_miss;
            turned <= may_turn.max(slack * MAX_DEGREES.to_radians())
                && moved <= may_move.max(slack * MAX_SHARE * self.size)
        })
    }

    /// The clip with what is played before it and after it.
    ///
    /// # Errors
    /// When the figure gets so far that no track can hold it.
    pub(super) fn around(&self, clip: &Clip, repeats: &Loop) -> Result<Surrounded, ClipError> {
        let (count, around) = (clip.frame_count(), repeats.around(clip));
        let frames = -(around as i64)..(count + around) as i64;
        let places: Vec<(i64, usize)> = frames.map(|frame| repeats.place(frame, count)).collect();
        let start = clip.times_seconds()[0];
        let time = |(pass, frame): &(i64, usize)| {
            start + *pass as f64 * repeats.seconds + (clip.times_seconds()[*frame] - start)
        };
        let times = places.iter().map(time).collect();
        let shown: Vec<usize> = places.iter().map(|(_, frame)| *frame).collect();
        let joint = |tracks: &JointTracks| JointTracks {
            translation: tracks.translation.of_frames(&shown),
            rotation: tracks.rotation.of_frames(&shown),
            scale: tracks.scale.of_frames(&shown),
        };
        let mut joints: Vec<JointTracks> = clip.joints().iter().map(joint).collect();
        if repeats.travel != Travel::NONE {
            let travels: Vec<Travel> = places.iter().map(|(pass, _)| repeats.travel.times(*pass)).collect();
            self.carry(&mut joints, &travels);
        }
        let clip = Clip::new(clip.name().to_owned(), times, joints)?.with_tempo(clip.tempo());
        Ok(Surrounded { clip, clock: Clock::repeated(around..around + count, shown, repeats.frames) })
    }

    /// Takes the figure to where each frame is played.
    fn carry(&self, joints: &mut [JointTracks], travels: &[Travel]) {
        for (joint, rest) in &self.roots {
            let JointTracks { translation, rotation, .. } = &mut joints[*joint];
            let place = |(frame, travel): (usize, &Travel)| {
                travel.place(translation.wide_at(frame, rest.translation)).as_vec3()
            };
            let places: Vec<Vec3> = travels.iter().enumerate().map(place).collect();
            let turned =
                |(frame, travel): (usize, &Travel)| (travel.turn * rotation.wide_at(frame, rest.rotation)).as_quat();
            let rotations: Vec<Quat> = travels.iter().enumerate().map(turned).collect();
            *translation = Track::Sampled(places);
            *rotation = Track::Sampled(rotations);
        }
    }
}

impl Loop {
    /// Pass and frame of a clip of so many frames that a frame shows, counted from the clip's first. The clip itself is in pass 0, with all
    /// of its frames.
    fn place(&self, frame: i64, count: usize) -> (i64, usize) {
        if let Some(own) = usize::try_from(frame).ok().filter(|frame| *frame < count) {
            return (0, own);
        }
        let period = self.frames as i64;
        let within = usize::try_from(frame.rem_euclid(period)).unwrap_or_default();
        (frame.div_euclid(period), within)
    }

    /// How many frames are played before the clip, and after it.
    fn around(&self, clip: &Clip) -> usize {
        let per_frame = self.seconds * clip.tempo() / self.frames as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a duration over a part of it")]
        let wanted = (AROUND_SECONDS / per_frame).ceil() as usize;
        wanted.min(MAX_FRAMES.max(clip.frame_count()))
    }
}

/// How a joint is expected to move from the last frame of a clip to the one that it lacks, and by how much it may miss that: by the longer one of
/// the steps before and after it.
#[derive(Clone, Copy)]
struct Step {
    way: DVec3,
    turn: DQuat,
    /// In the scene's unit and in radians.
    may_miss: (f64, f64),
}

impl Step {
    const NONE: Self = Self { way: DVec3::ZERO, turn: DQuat::IDENTITY, may_miss: (0.0, 0.0) };

    /// Halfway between the first step of a clip and its last.
    fn between(first: [&Transform; 2], last: [&Transform; 2]) -> Self {
        let step = |[from, to]: [&Transform; 2]| {
            let turn = (to.rotation * from.rotation.conjugate()).normalize();
            (to.translation - from.translation, turn)
        };
        let ((way, turn), (last_way, last_turn)) = (step(first), step(last));
        let angle = |turn: DQuat| turn.angle_between(DQuat::IDENTITY);
        // A foot that strikes the floor there stops within a frame.
        let may_miss = (way.length().max(last_way.length()), angle(turn).max(angle(last_turn)));
        Self { way: way.midpoint(last_way), turn: turn.slerp(last_turn, 0.5), may_miss }
    }

    fn from(&self, start: &Transform) -> Transform {
        Transform {
            translation: start.translation + self.way,
            rotation: (self.turn * start.rotation).normalize(),
            ..*start
        }
    }
}
