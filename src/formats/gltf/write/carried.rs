//! Rotations in 16 bits whose rounding does not add up: every joint takes back by how much the one above it is off, so that each is
//! turned as it should be in the world but for one rounding.

use glam::Quat;

use crate::model::{KeyCurve, Skeleton, Track};

/// By how much written joints are off, from the top of the skeleton down.
#[derive(Debug)]
pub(super) struct Carried {
    /// `joint_from_written` of the rotations in model space, per joint and frame; nothing where it is exact, or not asked for any more.
    off: Vec<Option<Vec<Quat>>>,
    parents: Vec<Option<usize>>,
    /// How many children of each joint are still to come.
    children_left: Vec<usize>,
    times_seconds: Vec<f64>,
}

impl Carried {
    /// For a clip with frames at these times.
    pub(super) fn new(skeleton: &Skeleton, times_seconds: &[f64]) -> Self {
        Self {
            off: vec![None; skeleton.len()],
            parents: (0..skeleton.len()).map(|joint| skeleton.parent(joint)).collect(),
            children_left: skeleton.children().iter().map(Vec::len).collect(),
            times_seconds: times_seconds.to_vec(),
        }
    }

    /// What to round for a joint: its rotations at these frames, with what the joint above is off taken back.
    pub(super) fn wanted(&self, joint: usize, frames: impl Iterator<Item = usize>, rotations: &[Quat]) -> Vec<Quat> {
        let above = self.above(joint);
        let wanted =
            |(frame, rotation): (usize, &Quat)| above.map_or(*rotation, |off| off[frame].conjugate() * *rotation);
        frames.zip(rotations).map(wanted).collect()
    }

    /// Notes that a joint was written as it is in the clip.
    pub(super) fn exact(&mut self, joint: usize, rest: Quat, track: &Track<Quat>) {
        let through = |(frame, off): (usize, &Quat)| {
            let own = track.at(frame, rest);
            own.conjugate() * *off * own
        };
        let off = self.above(joint).map(|above| above.iter().enumerate().map(through).collect());
        self.note(joint, off);
    }

    /// Notes what a reader sees of a joint at every frame.
    pub(super) fn rounded(&mut self, joint: usize, exact: &[Quat], written: impl Iterator<Item = Quat>) {
        let above = self.above(joint);
        let off = exact.iter().zip(written).enumerate().map(|(frame, (exact, written))| {
            let above = above.map_or(Quat::IDENTITY, |above| above[frame]);
            (exact.conjugate() * above * written).normalize()
        });
        let off = off.collect();
        self.note(joint, Some(off));
    }

    /// What a reader sees at every frame between the keys of a linear curve.
    pub(super) fn between<'a>(
        &'a self,
        keys: &'a KeyCurve<Quat>,
        written: &'a [Quat],
    ) -> impl Iterator<Item = Quat> + 'a {
        let times = &self.times_seconds;
        let mut next = 0;
        (0..times.len()).map(move |frame| {
            while next + 1 < keys.frames.len() && keys.frames[next] < frame {
                next += 1;
            }
            let (after, before) = (keys.frames[next], keys.frames[next.saturating_sub(1)]);
            if frame >= after || before >= after {
                return written[next];
            }
            let part = (times[frame] - times[before]) / (times[after] - times[before]);
            written[next - 1].slerp(written[next], part as f32)
        })
    }

    fn above(&self, joint: usize) -> Option<&Vec<Quat>> {
        self.parents[joint].and_then(|parent| self.off[parent].as_ref())
    }

    fn note(&mut self, joint: usize, off: Option<Vec<Quat>>) {
        self.off[joint] = off.filter(|_| self.children_left[joint] > 0);
        let Some(parent) = self.parents[joint] else { return };
        self.children_left[parent] -= 1;
        if self.children_left[parent] == 0 {
            self.off[parent] = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Joint, Transform};

    /// To hundredths, which is within 0.015 radians.
    fn round(rotation: Quat) -> Quat {
        let coarse = |component: f32| (component * 100.0).round() / 100.0;
        Quat::from_array(rotation.to_array().map(coarse)).normalize()
    }

    #[test]
    fn a_limb_of_many_joints_is_off_by_one_rounding() {
        let joint = |index: usize| Joint {
            name: String::new(),
            parent: index.checked_sub(1),
            rest: Transform::IDENTITY,
            is_joint: true,
            node: index,
        };
        let skeleton = Skeleton::new((0..30).map(joint).collect()).expect("a chain");
        let times = [0.0, 0.1, 0.2];
        // All alike, so that each is rounded to the same side.
        let local = |frame: usize| Quat::from_rotation_x(0.105 + 0.07 * frame as f32);
        let mut carried = Carried::new(&skeleton, &times);
        let (mut exact, mut written, mut plain) = ([Quat::IDENTITY; 3], [Quat::IDENTITY; 3], [Quat::IDENTITY; 3]);
        for joint in 0..skeleton.len() {
            let own: Vec<Quat> = (0..3).map(local).collect();
            let stored: Vec<Quat> = carried.wanted(joint, 0..3, &own).into_iter().map(round).collect();
            carried.rounded(joint, &own, stored.iter().copied());
            for frame in 0..3 {
                exact[frame] *= own[frame];
                written[frame] *= stored[frame];
                plain[frame] *= round(own[frame]);
                assert!(exact[frame].angle_between(written[frame]) < 0.015, "joint {joint}, frame {frame}");
            }
        }
        let worst = exact.iter().zip(plain).map(|(exact, plain)| exact.angle_between(plain)).fold(0.0, f32::max);
        assert!(worst > 0.05, "without it they add up: {worst}");
        assert!(carried.off.iter().all(Option::is_none), "nothing is kept that nobody asks for");
    }
}
