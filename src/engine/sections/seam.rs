//! Where one section goes over into the next: both were worked out there, from other surroundings, and differ by next to nothing.

use glam::{Quat, Vec3};

use crate::model::{Clip, ClipError, JointTracks, Track, rotation::smootherstep};

/// What a section says of the frames behind it.
pub(super) struct Tail(Clip);

impl Tail {
    pub(super) const fn new(frames: Clip) -> Self {
        Self(frames)
    }

    /// The next section, going over from this one: its frame `first` is the tail's first.
    ///
    /// # Errors
    /// When a mean of two values is none.
    pub(super) fn fade_into(&self, section: Clip, first: usize) -> Result<Clip, ClipError> {
        let frames = self.0.frame_count();
        let share = |frame: usize| smootherstep((frame + 1) as f64 / (frames + 1) as f64);
        let vectors = |own: &Track<Vec3>, next: Track<Vec3>| {
            faded(own, next, first, frames, |own, next, frame| own.lerp(next, share(frame) as f32))
        };
        let joint = |(own, next): (&JointTracks, JointTracks)| JointTracks {
            translation: vectors(&own.translation, next.translation),
            rotation: faded(
                &own.rotation,
                on_hemisphere(&own.rotation, next.rotation, first),
                first,
                frames,
                |own: Quat, next, frame| own.as_dquat().slerp(next.as_dquat(), share(frame)).normalize().as_quat(),
            ),
            scale: vectors(&own.scale, next.scale),
        };
        let (name, times, joints) = section.into_parts();
        let joints = self.0.joints().iter().zip(joints).map(joint).collect();
        Clip::new(name, times, joints)
    }
}

/// A track that goes over from another one, frame by frame from `first` on.
fn faded<T: Copy>(
    own: &Track<T>,
    next: Track<T>,
    first: usize,
    frames: usize,
    fade: impl Fn(T, T, usize) -> T,
) -> Track<T> {
    let Track::Sampled(mut values) = next else { return next };
    for (frame, value) in values.iter_mut().skip(first).take(frames).enumerate() {
        *value = fade(own.at(frame, *value), *value, frame);
    }
    Track::Sampled(values)
}

/// The same rotations on the hemisphere of another track, whose first frame is the frame `first` of this one.
fn on_hemisphere(own: &Track<Quat>, next: Track<Quat>, first: usize) -> Track<Quat> {
    let is_turned_over = own.at(0, Quat::IDENTITY).dot(next.at(first, Quat::IDENTITY)) < 0.0;
    if is_turned_over && own.is_animated() { next.map(|rotation| -rotation) } else { next }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(frames: usize, place: impl Fn(usize) -> f32, turn: impl Fn(usize) -> Quat) -> Clip {
        let tracks = JointTracks {
            translation: Track::Sampled((0..frames).map(|frame| Vec3::X * place(frame)).collect()),
            rotation: Track::Sampled((0..frames).map(turn).collect()),
            ..JointTracks::default()
        };
        let times = (0..frames).map(|frame| frame as f64 / 30.0).collect();
        Clip::new("clip".into(), times, vec![tracks]).expect("a clip")
    }

    #[test]
    fn a_section_begins_as_the_one_before_it_ends() {
        let tail = Tail::new(clip(9, |_| 1.0, |_| Quat::from_rotation_x(0.1)));
        // Written on the other hemisphere, and a little elsewhere.
        let next = clip(40, |_| 1.5, |_| -Quat::from_rotation_x(0.2));
        let faded = tail.fade_into(next, 10).expect("numbers");
        let JointTracks { translation, rotation, .. } = &faded.joints()[0];
        let place = |frame: usize| translation.at(frame, Vec3::ZERO).x;
        let angle = |frame: usize| 2.0 * rotation.at(frame, Quat::IDENTITY).x.asin();
        assert!((place(10) - 1.0).abs() < 0.01 && (angle(10) - 0.1).abs() < 0.01, "{} {}", place(10), angle(10));
        assert!((place(14) - 1.25).abs() < 1e-6 && (angle(14) - 0.15).abs() < 1e-6, "half of each in the middle");
        assert!((place(19) - 1.5).abs() < 1e-6 && (angle(19) - 0.2).abs() < 1e-6, "its own behind the tail");
        assert!((10..39).all(|frame| place(frame + 1) >= place(frame)), "without a step back");
    }

    #[test]
    fn equal_sections_are_left_as_they_are() {
        let moving = |frame: usize| Quat::from_rotation_y(frame as f32 * 0.1);
        let whole = clip(50, |frame| frame as f32, moving);
        let faded = Tail::new(whole.section(20..30)).fade_into(whole.section(15..50), 5).expect("numbers");
        for (frame, value) in (15..50).enumerate() {
            let JointTracks { translation, rotation, .. } = &faded.joints()[0];
            assert!((translation.at(frame, Vec3::ZERO).x - value as f32).abs() < 1e-4, "{frame}");
            assert!(rotation.at(frame, Quat::IDENTITY).abs_diff_eq(moving(value), 1e-6), "{frame}");
        }
    }
}
