//! A drawing, a motion and a retarget spec to the poses of all frames.

use glam::DVec2;

use super::{
    BodyMotion, DrawingError, PlanarRig, Plane, RetargetSpec, damping,
    projection::{Planes, angle_degrees},
    root_offset,
};

/// Whose rules a drawing follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Manner {
    /// Those of *Animated Drawings*, with all that it does otherwise than one would.
    Original,
    /// Bones follow without jumps and have the angles that they are to have, parts are ordered along one axis and change places seldom, and
    /// who goes far away stays in the picture.
    Steady,
}

/// What a drawing does, frame by frame.
#[derive(Clone, Debug)]
pub struct Performance {
    /// How many frames there are.
    pub frames: usize,
    /// Seconds between frames.
    pub frame_time: f64,
    /// The plane of each projection group.
    pub planes: Vec<Plane>,
    /// The driven joints of the drawing.
    pub driven: Vec<String>,
    /// For each frame the wanted angles of the driven joints.
    pub orientations_degrees: Vec<f64>,
    /// The joints of the body in projection groups.
    pub depth_joints: Vec<String>,
    /// For each frame their depths.
    pub depths: Vec<f64>,
    /// The root at each frame, relative to its start.
    pub roots: Vec<DVec2>,
    /// Where the root is at the first frame, with the plane of the character as z.
    pub start: [f64; 3],
    /// For each frame the joints of the drawing.
    pub joints: Vec<DVec2>,
    /// For each frame the body part groups in the order of drawing.
    pub order: Vec<usize>,
    /// For each frame and group, not sorted, its depth.
    pub group_depths: Vec<f64>,
    /// What was noticed: a code and a text.
    pub notes: Vec<(&'static str, String)>,
}

/// A driven joint: its index in the rig, the two joints of the body, and the plane.
struct Drive {
    joint: usize,
    from: usize,
    to: usize,
    plane: Plane,
}

impl Performance {
    /// Computes all frames.
    ///
    /// # Errors
    ///
    /// Where the spec names what the drawing or the body does not have.
    pub fn new(
        rig: &PlanarRig,
        motion: &BodyMotion,
        spec: &RetargetSpec,
        manner: Manner,
    ) -> Result<Self, DrawingError> {
        let planes = Planes::new(spec, motion);
        let mut notes: Vec<(&'static str, String)> = Vec::new();
        if !planes.unknown.is_empty() {
            notes.push(("drawing_joint_unknown", format!("the motion has no joint {}", planes.unknown.join(", "))));
        }
        let drives = drives(rig, motion, spec, &planes, &mut notes)?;
        let offset_plane = planes.of_groups[spec.offset_group()?];
        let mut roots = root_offset::way(&spec.char_bvh_root_offset, offset_plane, motion, rig)?;
        if manner == Manner::Steady && root_offset::stay(&mut roots) {
            notes.push(("drawing_in_place", "the motion goes far: the drawing stays where it is".to_owned()));
        }
        let one_plane = (manner == Manner::Steady).then_some(offset_plane);
        let group_depths = group_depths(motion, spec, &planes, one_plane)?;
        let order = order(&group_depths, spec.char_bodypart_groups.len(), motion, manner);
        let seen: Vec<(usize, Plane)> =
            planes.of_joints.iter().enumerate().filter_map(|(joint, plane)| Some((joint, (*plane)?))).collect();
        let depths = (0..motion.frames())
            .flat_map(|frame| seen.iter().map(move |&(joint, plane)| plane.depth(motion.place(frame, joint))));
        let mut performance = Self {
            frames: motion.frames(),
            frame_time: motion.frame_time,
            driven: drives.iter().map(|drive| rig.joint_names[drive.joint].clone()).collect(),
            orientations_degrees: Vec::new(),
            depth_joints: seen.iter().map(|&(joint, _)| motion.joint_names[joint].clone()).collect(),
            depths: depths.collect(),
            planes: planes.of_groups,
            roots,
            start: spec.char_starting_location,
            joints: vec![DVec2::ZERO; motion.frames() * rig.rest.len()],
            order,
            group_depths,
            notes,
        };
        performance.orientations_degrees = orientations(motion, &drives, manner);
        performance.pose(rig, &drives, manner);
        Ok(performance)
    }

    /// The corners between which the drawing is seen at all frames: its joints, and what of the figure is usually beyond them.
    #[must_use]
    pub fn bounds(&self, rig: &PlanarRig) -> [DVec2; 2] {
        /// By this share of the height of the joints at rest, heads, hands and feet go beyond them.
        const BEYOND: f64 = 0.25;
        let corners = |places: &[DVec2]| {
            let start = [DVec2::MAX, DVec2::MIN];
            places.iter().fold(start, |[low, high], place| [low.min(*place), high.max(*place)])
        };
        let [low_at_rest, high_at_rest] = corners(&rig.rest);
        let margin = DVec2::splat((high_at_rest - low_at_rest).max_element() * BEYOND);
        let [low, high] = corners(&self.joints);
        [low - margin, high + margin]
    }

    /// The joints at a frame relative to the root, and the root.
    #[must_use]
    pub fn joints_about_root(&self, frame: usize) -> (Vec<DVec2>, DVec2) {
        let count = self.joints.len() / self.frames;
        let joints = &self.joints[frame * count..(frame + 1) * count];
        let root = joints[0];
        (joints.iter().map(|&joint| joint - root).collect(), root)
    }

    fn pose(&mut self, rig: &PlanarRig, drives: &[Drive], manner: Manner) {
        let start = DVec2::new(self.start[0], self.start[1]);
        let mut wanted = vec![None; rig.rest.len()];
        for (frame, posed) in self.joints.chunks_exact_mut(rig.rest.len()).enumerate() {
            for (place, drive) in drives.iter().enumerate() {
                wanted[drive.joint] = Some(self.orientations_degrees[frame * drives.len() + place]);
            }
            match manner {
                Manner::Original => rig.pose(&wanted, start + self.roots[frame], posed),
                Manner::Steady => rig.pose_exactly(&wanted, start + self.roots[frame], posed),
            }
        }
    }
}

/// For each frame the angles of the driven bones.
fn orientations(motion: &BodyMotion, drives: &[Drive], manner: Manner) -> Vec<f64> {
    let mut degrees = vec![0.0; motion.frames() * drives.len()];
    for (place, drive) in drives.iter().enumerate() {
        let direction = |frame| motion.place(frame, drive.to) - motion.place(frame, drive.from);
        let angles: Vec<f64> = match manner {
            Manner::Original => {
                (0..motion.frames()).map(|frame| angle_degrees(drive.plane.seen(direction(frame)))).collect()
            }
            Manner::Steady => {
                let seen = |frame| drive.plane.seen(direction(frame).normalize_or_zero());
                let mut seen: Vec<DVec2> = (0..motion.frames()).map(seen).collect();
                damping::damp(&mut seen, motion.frame_time);
                damping::followed(&seen, motion.frame_time)
            }
        };
        for (frame, angle) in angles.into_iter().enumerate() {
            degrees[frame * drives.len() + place] = angle;
        }
    }
    degrees
}

/// For each frame the groups from the farthest to the nearest.
fn order(group_depths: &[f64], groups: usize, motion: &BodyMotion, manner: Manner) -> Vec<usize> {
    if manner == Manner::Steady {
        let reach = motion.places.iter().map(|place| place.length()).fold(0.0, f64::max);
        return damping::steady_order(group_depths, groups, reach, motion.frame_time);
    }
    let mut order = Vec::with_capacity(group_depths.len());
    for depths in group_depths.chunks_exact(groups.max(1)) {
        let mut sorted: Vec<usize> = (0..groups).collect();
        sorted.sort_by(|&one, &other| depths[one].total_cmp(&depths[other]));
        order.extend(sorted);
    }
    order
}

fn drives(
    rig: &PlanarRig,
    motion: &BodyMotion,
    spec: &RetargetSpec,
    planes: &Planes,
    notes: &mut Vec<(&'static str, String)>,
) -> Result<Vec<Drive>, DrawingError> {
    let find = |name: &str, place: &str| {
        rig.joint(name).ok_or_else(|| DrawingError::unknown_name(place, name, &rig.joint_names))
    };
    let mut dropped = Vec::new();
    for (index, check) in spec.char_runtime_checks.iter().enumerate() {
        let place = format!("char_runtime_checks[{index}]");
        let target = find(&check[1], &place)?;
        if !rig.is_above(target, [find(&check[2], &place)?, find(&check[3], &place)?]) {
            let text = format!("{} is not above {} and {}: nothing drives it", check[1], check[2], check[3]);
            notes.push(("drawing_check_failed", text));
            dropped.push(target);
        }
    }
    let mut drives = Vec::new();
    for (name, (from, to)) in &spec.char_joint_bvh_joints_mapping.0 {
        let place = format!("char_joint_bvh_joints_mapping.{name}");
        let joint = find(name, &place)?;
        if dropped.contains(&joint) {
            continue;
        }
        let from = motion.joint(from).ok_or_else(|| DrawingError::unknown_name(&*place, from, &motion.joint_names))?;
        let (to, plane) = planes.joint(motion, to, &place)?;
        drives.push(Drive { joint, from, to, plane });
    }
    Ok(drives)
}

/// For each frame and body part group the mean depth of its drivers: each before its own plane, or all before one.
fn group_depths(
    motion: &BodyMotion,
    spec: &RetargetSpec,
    planes: &Planes,
    one_plane: Option<Plane>,
) -> Result<Vec<f64>, DrawingError> {
    let mut drivers = Vec::new();
    for (index, group) in spec.char_bodypart_groups.iter().enumerate() {
        let place = format!("char_bodypart_groups[{index}].bvh_depth_drivers");
        let names = group.bvh_depth_drivers.iter();
        drivers.push(names.map(|name| planes.joint(motion, name, &place)).collect::<Result<Vec<_>, _>>()?);
    }
    let mut depths = Vec::with_capacity(motion.frames() * drivers.len());
    for frame in 0..motion.frames() {
        depths.extend(drivers.iter().map(|group| {
            let sum: f64 =
                group.iter().map(|&(joint, plane)| one_plane.unwrap_or(plane).depth(motion.place(frame, joint))).sum();
            sum / group.len() as f64
        }));
    }
    Ok(depths)
}
