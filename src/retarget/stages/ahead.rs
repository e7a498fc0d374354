//! Poses of several frames at once.
//!
//! Stages go through a clip frame by frame and look at a pose of each. Found one by one, those poses cost more than what is done with
//! them; found for [`FRAMES`] frames side by side, the compiler makes vector instructions of the same arithmetic. It is the same in
//! the same order as [`Transform::then_child`], so the bits are the same, whichever way a pose was found.

use glam::{DQuat, DVec3, Vec3};

use crate::{
    model::{JointTracks, Track, Transform},
    retarget::vectors::{Vectorized, Vectors},
};

/// Frames whose poses are found at once; divides what one thread takes at a time.
pub(super) const FRAMES: usize = 8;

/// Squares of lengths that are this near to one are brought to it by a Newton step, which leaves less than rounding does.
const NEARLY_UNIT: f64 = 1e-6;

type Lane = [f64; FRAMES];

/// A joint that is looked at.
#[derive(Clone, Debug)]
pub(super) struct PosedJoint {
    pub(super) joint: usize,
    pub(super) parent: Option<usize>,
    pub(super) rest: Transform,
}

/// A transform of each frame.
#[derive(Clone, Copy, Debug)]
struct Transforms {
    translation: [Lane; 3],
    rotation: [Lane; 4],
    scale: [Lane; 3],
}

impl Transforms {
    fn splat(transform: &Transform) -> Self {
        let splat = |value: f64| [value; FRAMES];
        Self {
            translation: transform.translation.to_array().map(splat),
            rotation: transform.rotation.to_array().map(splat),
            scale: transform.scale.to_array().map(splat),
        }
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Transform {
        Transform {
            translation: DVec3::from_array(self.translation.each_ref().map(|values| values[lane])),
            rotation: DQuat::from_array(self.rotation.each_ref().map(|values| values[lane])),
            scale: DVec3::from_array(self.scale.each_ref().map(|values| values[lane])),
        }
    }

    /// A joint's own, from its tracks.
    #[inline(always)]
    fn set_local(&mut self, tracks: &JointTracks, rest: &Transform, first: usize) {
        set_vector(&mut self.translation, &tracks.translation, rest.translation, first);
        set_vector(&mut self.scale, &tracks.scale, rest.scale, first);
        match &tracks.rotation {
            Track::Sampled(samples) => {
                for (lane, sample) in samples[first..first + FRAMES].iter().enumerate() {
                    set(&mut self.rotation, lane, unit(sample.as_dquat()).to_array());
                }
            }
            Track::Constant(value) => self.rotation = unit(value.as_dquat()).to_array().map(|value| [value; FRAMES]),
            Track::Rest => self.rotation = rest.rotation.to_array().map(|value| [value; FRAMES]),
        }
    }

    /// As [`Transform::then_child`].
    #[inline(always)]
    fn set_child(&mut self, parent: &Self, child: &Self) {
        let [px, py, pz, pw] = &parent.rotation;
        for lane in 0..FRAMES {
            let (x0, y0, z0, w0) = (px[lane], py[lane], pz[lane], pw[lane]);
            let [x, y, z] = [0, 1, 2].map(|axis| parent.scale[axis][lane] * child.translation[axis][lane]);
            let along = w0 * w0 - ((x0 * x0) + (y0 * y0) + (z0 * z0));
            let twice = ((x * x0) + (y * y0) + (z * z0)) * 2.0;
            let across = w0 * 2.0;
            let turned = [
                x * along + x0 * twice + (y0 * z - y * z0) * across,
                y * along + y0 * twice + (z0 * x - z * x0) * across,
                z * along + z0 * twice + (x0 * y - x * y0) * across,
            ];
            for (axis, turned) in turned.into_iter().enumerate() {
                self.translation[axis][lane] = parent.translation[axis][lane] + turned;
                self.scale[axis][lane] = parent.scale[axis][lane] * child.scale[axis][lane];
            }
        }
        let [cx, cy, cz, cw] = &child.rotation;
        for lane in 0..FRAMES {
            let (x0, y0, z0, w0) = (px[lane], py[lane], pz[lane], pw[lane]);
            let (x1, y1, z1, w1) = (cx[lane], cy[lane], cz[lane], cw[lane]);
            self.rotation[0][lane] = w0 * x1 + x0 * w1 + y0 * z1 - z0 * y1;
            self.rotation[1][lane] = w0 * y1 - x0 * z1 + y0 * w1 + z0 * x1;
            self.rotation[2][lane] = w0 * z1 + x0 * y1 - y0 * x1 + z0 * w1;
            self.rotation[3][lane] = w0 * w1 - x0 * x1 - y0 * y1 - z0 * z1;
        }
    }
}

/// Poses that were found ahead of when they are asked for.
#[derive(Clone, Debug)]
pub(super) struct Ahead {
    /// The first frame of them.
    first: usize,
    /// Which of them are there and were not taken yet.
    is_there: [bool; FRAMES],
    /// By slot: local and model transforms.
    local: Vec<Transforms>,
    model: Vec<Transforms>,
}

impl Ahead {
    pub(super) fn new(joints: &[PosedJoint]) -> Self {
        let local: Vec<Transforms> = joints.iter().map(|posed| Transforms::splat(&posed.rest)).collect();
        Self { first: 0, is_there: [false; FRAMES], model: local.clone(), local }
    }

    /// Takes the pose of a frame, where it is there; it can be taken once, since whoever takes it may change it. Local transforms are
    /// taken for as many joints as there is room for.
    pub(super) fn take(&mut self, frame: usize, local: &mut [Transform], model: &mut [Transform]) -> bool {
        let lane = frame.wrapping_sub(self.first);
        if !self.is_there.get_mut(lane).is_some_and(std::mem::take) {
            return false;
        }
        local.iter_mut().zip(&self.local).for_each(|(local, found)| *local = found.get(lane));
        model.iter_mut().zip(&self.model).for_each(|(model, found)| *model = found.get(lane));
        true
    }

    /// Finds the poses of [`FRAMES`] frames from a frame on.
    pub(super) fn find(&mut self, joints: &[PosedJoint], above: &Transform, tracks: &[JointTracks], frame: usize) {
        self.first = frame;
        self.is_there = [true; FRAMES];
        Vectors::detected().run(Find { ahead: self, joints, above, tracks });
    }

    #[inline(always)]
    fn find_each(&mut self, joints: &[PosedJoint], above: &Transform, tracks: &[JointTracks]) {
        let above = Transforms::splat(above);
        for (slot, posed) in joints.iter().enumerate() {
            let local = &mut self.local[slot];
            local.set_local(&tracks[posed.joint], &posed.rest, self.first);
            let (done, rest) = self.model.split_at_mut(slot);
            rest[0].set_child(posed.parent.map_or(&above, |parent| &done[parent]), local);
        }
    }
}

/// Poses that are found.
struct Find<'a> {
    ahead: &'a mut Ahead,
    joints: &'a [PosedJoint],
    above: &'a Transform,
    tracks: &'a [JointTracks],
}

impl Vectorized for Find<'_> {
    #[inline(always)]
    fn run(self) {
        self.ahead.find_each(self.joints, self.above, self.tracks);
    }
}

#[inline(always)]
fn set_vector(lanes: &mut [Lane; 3], track: &Track<Vec3>, rest: DVec3, first: usize) {
    match track {
        Track::Sampled(samples) => {
            for (lane, sample) in samples[first..first + FRAMES].iter().enumerate() {
                set(lanes, lane, sample.as_dvec3().to_array());
            }
        }
        Track::Constant(value) => *lanes = value.as_dvec3().to_array().map(|value| [value; FRAMES]),
        Track::Rest => *lanes = rest.to_array().map(|value| [value; FRAMES]),
    }
}

#[inline(always)]
fn set<const N: usize>(lanes: &mut [Lane; N], lane: usize, values: [f64; N]) {
    lanes.iter_mut().zip(values).for_each(|(lanes, value)| lanes[lane] = value);
}

/// A rotation at unit length. What a track holds is that but for the rounding of its numbers.
pub(super) fn unit(rotation: DQuat) -> DQuat {
    let square = rotation.length_squared();
    if (square - 1.0).abs() < NEARLY_UNIT { rotation * (1.5 - 0.5 * square) } else { rotation.normalize() }
}
