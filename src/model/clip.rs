//! An animation: key times, and the tracks of every joint at them.

use std::{ops::Range, sync::Arc};

use glam::{Quat, Vec3};
use rayon::prelude::*;

use super::{LocalPose, MorphTrack, Skeleton, SparseKeys, Track, Transform};

/// An animation of a skeleton, sampled at key times that all channels share.
///
/// Tracks lie joint by joint, so that one channel is one run of memory: that is what a reader decodes, what the retarget
/// loop streams through and what a glTF accessor holds. Values are f32, arithmetic on them is f64.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clip {
    name: String,
    times_seconds: Vec<f64>,
    joints: Vec<JointTracks>,
    contacts: Vec<JointContacts>,
    morphs: Vec<MorphTrack>,
    sparse_keys: Option<Arc<SparseKeys>>,
    tempo: f64,
}

/// When a joint rests on something.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct JointContacts {
    /// Index of the joint.
    pub joint: usize,
    /// One value per frame.
    pub touches: Vec<bool>,
}

/// The three channels of one joint, local.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointTracks {
    /// Meters, in the parent's space.
    pub translation: Track<Vec3>,
    /// Unit quaternions, each on the same hemisphere as the one before.
    pub rotation: Track<Quat>,
    /// Factors.
    pub scale: Track<Vec3>,
}

/// Why tracks and times are no clip.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ClipError {
    /// Times must be finite and rise.
    #[error("key time {frame} is not finite or not later than the one before it")]
    TimesNotRising {
        /// Index of the first offending time.
        frame: usize,
    },
    /// A clip has at least one frame.
    #[error("the clip has no frame")]
    NoFrame,
    /// A sampled track has one value per frame.
    #[error("a track of joint {joint} has {actual} values where the clip has {frames} frames")]
    TrackLength {
        /// Index of the joint.
        joint: usize,
        /// Number of values found.
        actual: usize,
        /// Number of frames.
        frames: usize,
    },
    /// A sample is NaN or infinite.
    #[error("a track of joint {joint} is not finite at frame {frame}")]
    NotFinite {
        /// Index of the joint.
        joint: usize,
        /// Index of the frame.
        frame: usize,
    },
}

impl Clip {
    /// Takes key times and one entry per joint of the skeleton.
    ///
    /// # Errors
    /// When times do not rise, a track's length is not the number of frames, or a value is not finite.
    pub fn new(name: String, times_seconds: Vec<f64>, joints: Vec<JointTracks>) -> Result<Self, ClipError> {
        check(&times_seconds, &joints)?;
        Ok(Self::of_checked(name, times_seconds, joints))
    }

    /// The same for one who has looked at every value already: reading the whole clip once more is what takes longest here.
    pub(crate) fn of_checked(name: String, times_seconds: Vec<f64>, joints: Vec<JointTracks>) -> Self {
        debug_assert_eq!(check(&times_seconds, &joints), Ok(()), "it has been looked at");
        Self { name, times_seconds, joints, contacts: Vec::new(), morphs: Vec::new(), sparse_keys: None, tempo: 1.0 }
    }

    /// The same clip with what is known of contacts.
    ///
    /// # Errors
    /// When a track's length is not the number of frames.
    pub fn with_contacts(self, contacts: Vec<JointContacts>) -> Result<Self, ClipError> {
        let frames = self.frame_count();
        match contacts.iter().find(|track| track.touches.len() != frames) {
            Some(track) => Err(ClipError::TrackLength { joint: track.joint, actual: track.touches.len(), frames }),
            None => Ok(Self { contacts, ..self }),
        }
    }

    /// The same clip with other tracks, one entry per joint: name, times, contacts and morphs stay. Which keys are needed is not known
    /// of the new tracks.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_joints(self, joints: Vec<JointTracks>) -> Result<Self, ClipError> {
        let Self { name, times_seconds, contacts, morphs, tempo, .. } = self;
        Ok(Self { contacts, morphs, tempo, ..Self::new(name, times_seconds, joints)? })
    }

    /// When joints rest on something, where that is known.
    #[must_use]
    pub fn contacts(&self) -> &[JointContacts] {
        &self.contacts
    }

    /// The clip's name; may be empty.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The same clip under another name.
    #[must_use]
    pub fn renamed(self, name: String) -> Self {
        Self { name, ..self }
    }

    /// The same clip with the weights of morphs, one entry per morph that it animates.
    ///
    /// # Errors
    /// When a track's length is not the number of frames, or a weight is not finite; the error counts morphs as joints.
    pub fn with_morphs(self, morphs: Vec<MorphTrack>) -> Result<Self, ClipError> {
        for (index, track) in morphs.iter().enumerate() {
            check_track(&track.weights, index, self.times_seconds.len(), |value| value.is_finite())?;
        }
        Ok(Self { morphs, ..self })
    }

    /// The weights of the morphs that it animates.
    #[must_use]
    pub fn morphs(&self) -> &[MorphTrack] {
        &self.morphs
    }

    /// The same clip, of which these frames are needed, in formats whose tracks have key times of their own.
    #[must_use]
    pub fn with_sparse_keys(self, keys: Arc<SparseKeys>) -> Self {
        Self { sparse_keys: Some(keys), ..self }
    }

    /// The frames that are needed; nothing where all are.
    #[must_use]
    pub const fn sparse_keys(&self) -> Option<&Arc<SparseKeys>> {
        self.sparse_keys.as_ref()
    }

    /// The same clip, known to show so many seconds of what was performed in each of its own: 0.5 where it was slowed down to half.
    #[must_use]
    pub fn with_tempo(self, tempo: f64) -> Self {
        Self { tempo, ..self }
    }

    /// How many seconds of what was performed a second of the clip shows; 1 where nobody changed that.
    #[must_use]
    pub const fn tempo(&self) -> f64 {
        self.tempo
    }

    /// Key times on the clock of the performance: how fast a body moves, and how long a foot stands, is known for that one.
    #[must_use]
    pub fn performed_seconds(&self) -> Vec<f64> {
        self.times_seconds.iter().map(|time| time * self.tempo).collect()
    }

    /// Key times in seconds, rising.
    #[must_use]
    pub fn times_seconds(&self) -> &[f64] {
        &self.times_seconds
    }

    /// One entry per joint, in the skeleton's order.
    #[must_use]
    pub fn joints(&self) -> &[JointTracks] {
        &self.joints
    }

    /// How many frames there are; at least one.
    #[must_use]
    pub fn frame_count(&self) -> usize {
        self.times_seconds.len()
    }

    /// Last key time minus first.
    #[must_use]
    pub fn duration_seconds(&self) -> f64 {
        self.times_seconds[self.times_seconds.len() - 1] - self.times_seconds[0]
    }

    /// Frames per second where the keys are evenly spaced (to a thousandth of a frame, or the rounding of an f32 time);
    /// nothing for a single frame or uneven keys.
    #[must_use]
    pub fn uniform_fps(&self) -> Option<f64> {
        let frames = self.times_seconds.len();
        let duration = self.duration_seconds();
        if frames < 2 || duration <= 0.0 {
            return None;
        }
        let step = duration / (frames - 1) as f64;
        let slack = (step * 1e-3).max(self.times_seconds[frames - 1].abs() * 1e-6);
        let even = |(frame, time): (usize, &f64)| (self.times_seconds[0] + frame as f64 * step - time).abs() <= slack;
        self.times_seconds.iter().enumerate().all(even).then(|| step.recip())
    }

    /// Whether any channel of any joint is animated.
    #[must_use]
    pub fn is_animated(&self) -> bool {
        self.joints
            .iter()
            .any(|joint| joint.translation.is_animated() || joint.rotation.is_animated() || joint.scale.is_animated())
            || !self.morphs.is_empty()
    }

    /// The pose at one frame.
    ///
    /// # Panics
    /// When the frame is past the end.
    #[must_use]
    pub fn local_pose(&self, skeleton: &Skeleton, frame: usize) -> LocalPose {
        // A value at rest is narrowed as its track would be: what is found in a pose does not depend on whether a file writes that track.
        let local = |(tracks, joint): (&JointTracks, &super::Joint)| Transform {
            translation: tracks.translation.at(frame, joint.rest.translation.as_vec3()).as_dvec3(),
            rotation: tracks.rotation.at(frame, joint.rest.rotation.as_quat()).as_dquat().normalize(),
            scale: tracks.scale.at(frame, joint.rest.scale.as_vec3()).as_dvec3(),
        };
        LocalPose::new(self.joints.iter().zip(skeleton.joints()).map(local).collect())
    }

    /// Some of its frames, at the times that they have; which keys are needed is not known of them.
    ///
    /// # Panics
    /// When there is no such frame, or none at all.
    #[must_use]
    pub fn section(&self, frames: Range<usize>) -> Self {
        assert!(!frames.is_empty(), "a clip has at least one frame");
        let joint = |tracks: &JointTracks| JointTracks {
            translation: tracks.translation.section(frames.clone()),
            rotation: tracks.rotation.section(frames.clone()),
            scale: tracks.scale.section(frames.clone()),
        };
        let contact = |contacts: &JointContacts| JointContacts {
            joint: contacts.joint,
            touches: contacts.touches[frames.clone()].to_vec(),
        };
        let morph =
            |track: &MorphTrack| MorphTrack { morph: track.morph, weights: track.weights.section(frames.clone()) };
        Self {
            name: self.name.clone(),
            times_seconds: self.times_seconds[frames.clone()].to_vec(),
            joints: self.joints.iter().map(joint).collect(),
            contacts: self.contacts.iter().map(contact).collect(),
            morphs: self.morphs.iter().map(morph).collect(),
            sparse_keys: None,
            tempo: self.tempo,
        }
    }

    /// The same clip with a value for every frame of each track that is animated.
    #[must_use]
    pub fn sampled(self) -> Self {
        let frames = self.frame_count();
        let joint = |tracks: JointTracks| JointTracks {
            translation: tracks.translation.sampled(frames),
            rotation: tracks.rotation.sampled(frames),
            scale: tracks.scale.sampled(frames),
        };
        let morph = |track: MorphTrack| MorphTrack { weights: track.weights.sampled(frames), ..track };
        Self {
            joints: self.joints.into_iter().map(joint).collect(),
            morphs: self.morphs.into_iter().map(morph).collect(),
            sparse_keys: None,
            ..self
        }
    }

    /// Takes the clip apart: name, key times, tracks of joints. Contacts, morphs and the keys that are needed are left behind.
    #[must_use]
    pub fn into_parts(self) -> (String, Vec<f64>, Vec<JointTracks>) {
        (self.name, self.times_seconds, self.joints)
    }
}

fn check(times_seconds: &[f64], joints: &[JointTracks]) -> Result<(), ClipError> {
    let frames = times_seconds.len();
    if frames == 0 {
        return Err(ClipError::NoFrame);
    }
    for (frame, time) in times_seconds.iter().enumerate() {
        let rises = frame == 0 || times_seconds[frame - 1] < *time;
        if !time.is_finite() || !rises {
            return Err(ClipError::TimesNotRising { frame });
        }
    }
    // In parallel, since it reads the whole clip once; the first joint's fault is told, whichever was found first.
    let check = |(joint, tracks): (usize, &JointTracks)| {
        check_track(&tracks.translation, joint, frames, |value| value.is_finite())?;
        check_track(&tracks.rotation, joint, frames, |value| value.is_finite())?;
        check_track(&tracks.scale, joint, frames, |value| value.is_finite())
    };
    joints.par_iter().enumerate().map(check).find_map_first(Result::err).map_or(Ok(()), Err)
}

fn check_track<T: Copy>(
    track: &Track<T>,
    joint: usize,
    frames: usize,
    is_finite: impl Fn(&T) -> bool,
) -> Result<(), ClipError> {
    match track {
        Track::Rest => Ok(()),
        Track::Constant(value) if is_finite(value) => Ok(()),
        Track::Constant(_) => Err(ClipError::NotFinite { joint, frame: 0 }),
        Track::Sampled(values) if values.len() != frames => {
            Err(ClipError::TrackLength { joint, actual: values.len(), frames })
        }
        // Looking at all values without stopping is several times faster than looking for the first wrong one.
        Track::Sampled(values) if values.iter().fold(true, |all, value| all & is_finite(value)) => Ok(()),
        Track::Sampled(values) => {
            let frame = values.iter().position(|value| !is_finite(value)).unwrap_or_default();
            Err(ClipError::NotFinite { joint, frame })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_must_rise() {
        let error = Clip::new(String::new(), vec![0.0, 0.0], Vec::new()).expect_err("equal times");
        assert_eq!(error, ClipError::TimesNotRising { frame: 1 }, "the error names the frame");
    }

    #[test]
    fn tracks_are_as_long_as_the_clip() {
        let tracks = JointTracks { translation: Track::Sampled(vec![Vec3::ZERO]), ..JointTracks::default() };
        let error = Clip::new(String::new(), vec![0.0, 1.0], vec![tracks]).expect_err("too short");
        assert_eq!(error, ClipError::TrackLength { joint: 0, actual: 1, frames: 2 }, "the error counts");
    }

    #[test]
    fn even_keys_have_a_rate() {
        let times = (0..31).map(|frame| f64::from(frame) / 30.0).collect();
        let clip = Clip::new(String::new(), times, Vec::new()).expect("valid");
        assert!((clip.uniform_fps().expect("even") - 30.0).abs() < 1e-9, "thirty");
        let uneven = Clip::new(String::new(), vec![0.0, 0.1, 0.3], Vec::new()).expect("valid");
        assert_eq!(uneven.uniform_fps(), None, "uneven keys have none");
    }
}
