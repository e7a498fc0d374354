//! A drawing, a motion and a retarget spec to the poses of all frames.

use glam::{DVec2, DVec3};

use super::{
    BodyMotion, DrawingError, PlanarRig, Plane, RetargetSpec, contacts, damping, facing, plant,
    projection::{Planes, angle_degrees},
    root_offset,
};

/// Whose rules a drawing follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Manner {
    /// Those of *Animated Drawings*, with all that it does otherwise than one would.
    Original,
    /// Bones follow without jumps and have the angles that they are to have, parts are ordered along one axis and change places seldom,
    /// feet stand where they stand, and the camera follows one who goes far away.
    Steady,
}

/// The rules that a drawing follows, with what somebody chose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// Whose.
    pub manner: Manner,
    /// Over so many seconds a bone follows what drives it.
    pub damped_over_seconds: f64,
    /// Whether bones are drawn shorter where they point at the viewer.
    pub foreshorten: bool,
    /// Whether a drawing that is seen from the side is mirrored where its body turns around.
    pub mirror: bool,
    /// Whether standing feet stay where they are.
    pub plant: bool,
    /// Whether the camera goes along with it; nothing: where it goes far.
    pub stay: Option<bool>,
}

impl Rules {
    /// Those of a manner, with nothing chosen.
    #[must_use]
    pub const fn of(manner: Manner) -> Self {
        Self { manner, damped_over_seconds: 0.06, foreshorten: false, mirror: false, plant: true, stay: None }
    }
}

/// What a drawing does, frame by frame.
#[derive(Clone, Debug, Default)]
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
    /// For each frame, how long the driven bones are drawn, in lengths at rest.
    pub stretches: Vec<f64>,
    /// For each frame, whether the drawing is mirrored about its root. The angles are those before that.
    pub is_mirrored: Vec<bool>,
    /// For each frame, how far to the right the camera goes along.
    pub pan: Vec<f64>,
    /// Joints of the drawing that stand on the ground at times, and for each frame whether they do.
    pub contacts: Vec<(usize, Vec<bool>)>,
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
    pub fn new(rig: &PlanarRig, motion: &BodyMotion, spec: &RetargetSpec, rules: &Rules) -> Result<Self, DrawingError> {
        let manner = rules.manner;
        let planes = Planes::new(spec, motion);
        let mut notes: Vec<(&'static str, String)> = Vec::new();
        if !planes.unknown.is_empty() {
            notes.push(("drawing_joint_unknown", format!("the motion has no joint {}", planes.unknown.join(", "))));
        }
        let drives = drives(rig, motion, spec, &planes, &mut notes)?;
        let offset_plane = planes.of_groups[spec.offset_group()?];
        let is_mirrored = match manner {
            Manner::Steady if rules.mirror => facing::mirrored(motion, offset_plane),
            _ => vec![false; motion.frames()],
        };
        let roots = root_offset::way(&spec.char_bvh_root_offset, offset_plane, motion, rig, &is_mirrored)?;
        let one_plane = (manner == Manner::Steady).then_some(offset_plane);
        let group_depths = group_depths(motion, spec, &planes, one_plane)?;
        let seen: Vec<(usize, Plane)> =
            planes.of_joints.iter().enumerate().filter_map(|(joint, plane)| Some((joint, (*plane)?))).collect();
        let far = |frame: usize| seen.iter().map(move |&(joint, _)| motion.place(frame, joint).length());
        let reach = (0..motion.frames()).flat_map(far).fold(0.0, f64::max);
        let order = order(&group_depths, spec.char_bodypart_groups.len(), (reach, motion.frame_time), manner);
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
            stretches: Vec::new(),
            is_mirrored,
            pan: vec![0.0; motion.frames()],
            contacts: Vec::new(),
            roots,
            start: spec.char_starting_location,
            joints: vec![DVec2::ZERO; motion.frames() * rig.rest.len()],
            order,
            group_depths,
            notes,
        };
        (performance.orientations_degrees, performance.stretches) = orientations(motion, &drives, rules);
        performance.pose(rig, &drives, manner);
        if manner == Manner::Steady {
            if rules.plant {
                performance.plant(rig, motion, spec, &drives);
            }
            performance.pan = root_offset::pan(&performance.roots, performance.frame_time, rules.stay);
            if performance.pan.iter().any(|pan| *pan != 0.0) {
                performance.notes.push(("drawing_followed", "the camera goes along with the drawing".to_owned()));
            }
        }
        Ok(performance)
    }

    /// The corners between which the drawing is seen at all frames: its joints, and what of the figure is beyond them, in sides of its square;
    /// where that is not known, what usually is.
    #[must_use]
    pub fn bounds(&self, rig: &PlanarRig, beyond: Option<f64>) -> [DVec2; 2] {
        /// By this share of the height of the joints at rest, heads, hands and feet go beyond them.
        const BEYOND: f64 = 0.25;
        /// So much is left free around it, of what goes beyond the joints.
        const FREE: f64 = 1.1;
        let corners = |places: &[DVec2]| {
            let start = [DVec2::MAX, DVec2::MIN];
            places.iter().fold(start, |[low, high], place| [low.min(*place), high.max(*place)])
        };
        let [low_at_rest, high_at_rest] = corners(&rig.rest);
        let usual = (high_at_rest - low_at_rest).max_element() * BEYOND;
        let margin = DVec2::splat(beyond.map_or(usual, |beyond| beyond * FREE + 0.01));
        let joints = self.joints.len() / self.frames;
        let panned = self.joints.chunks_exact(joints).zip(&self.pan);
        let panned: Vec<DVec2> =
            panned.flat_map(|(places, pan)| places.iter().map(|place| *place - DVec2::new(*pan, 0.0))).collect();
        let [low, high] = corners(&panned);
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

    /// The place of a frame in what the camera sees.
    #[must_use]
    pub fn seen_shift(&self, frame: usize) -> DVec2 {
        DVec2::new(-self.pan[frame], 0.0)
    }

    fn pose(&mut self, rig: &PlanarRig, drives: &[Drive], manner: Manner) {
        let start = DVec2::new(self.start[0], self.start[1]);
        let mut wanted = vec![None; rig.rest.len()];
        for (frame, posed) in self.joints.chunks_exact_mut(rig.rest.len()).enumerate() {
            for (place, drive) in drives.iter().enumerate() {
                let at = frame * drives.len() + place;
                wanted[drive.joint] = Some((self.orientations_degrees[at], self.stretches[at]));
            }
            let root = start + self.roots[frame];
            match manner {
                Manner::Original => {
                    let wanted: Vec<Option<f64>> = wanted.iter().map(|wanted| wanted.map(|(angle, _)| angle)).collect();
                    rig.pose(&wanted, root, posed);
                }
                Manner::Steady => rig.pose_exactly(&wanted, root, posed),
            }
            if self.is_mirrored[frame] {
                posed.iter_mut().for_each(|place| place.x = 2.0 * root.x - place.x);
            }
        }
    }

    /// Lets feet stand where the body's feet stand: those that the chains for the way of the root end in.
    fn plant(&mut self, rig: &PlanarRig, motion: &BodyMotion, spec: &RetargetSpec, drives: &[Drive]) {
        let legs = legs(rig, motion, spec, drives);
        if legs.is_empty() {
            return;
        }
        let length = legs.iter().map(|leg| leg.length).sum::<f64>() / legs.len() as f64;
        let bodies: Vec<usize> = legs.iter().map(|leg| leg.body).collect();
        let stands = contacts::contacts(motion, &bodies, length);
        let joints = rig.rest.len();
        let place = |all: &[DVec2], frame: usize, joint: usize| all[frame * joints + joint];
        let from_root = |leg: &Leg| -> Vec<DVec2> {
            (0..self.frames).map(|frame| place(&self.joints, frame, leg.foot) - place(&self.joints, frame, 0)).collect()
        };
        let feet: Vec<Vec<DVec2>> = legs.iter().map(from_root).collect();
        self.roots = plant::planted_way(&self.roots, &feet, &stands);
        self.pose(rig, drives, Manner::Steady);
        let places =
            |leg: &Leg| -> Vec<DVec2> { (0..self.frames).map(|frame| place(&self.joints, frame, leg.foot)).collect() };
        let places: Vec<Vec<DVec2>> = legs.iter().map(places).collect();
        if let Some(ground) = plant::ground_of(&places, &stands) {
            for (leg, (places, stands)) in legs.iter().zip(places.iter().zip(&stands)) {
                let moved = plant::corrections(places, stands, ground, self.frame_time);
                self.bend(leg, &moved, (joints, drives.len()));
            }
            self.pose(rig, drives, Manner::Steady);
        }
        self.contacts = legs.iter().map(|leg| leg.foot).zip(stands).collect();
    }

    /// Bends a leg so that its foot is moved by so much in each frame.
    fn bend(&mut self, leg: &Leg, moved: &[DVec2], (joints, drives): (usize, usize)) {
        let most = damping::fastest_turn(self.frame_time);
        let mut before: Option<[f64; 2]> = None;
        for (frame, &moved) in moved.iter().enumerate() {
            let side = DVec2::new(if self.is_mirrored[frame] { -1.0 } else { 1.0 }, 1.0);
            let chain = leg.chain.map(|joint| self.joints[frame * joints + joint] * side);
            let at = leg.drives.map(|place| frame * drives + place);
            if moved != DVec2::ZERO
                && let Some(angles) = plant::reached(chain, chain[2] + moved * side)
            {
                (0..2).for_each(|bone| self.orientations_degrees[at[bone]] = angles[bone]);
            }
            if let Some(before) = before {
                for bone in 0..2 {
                    let angle = &mut self.orientations_degrees[at[bone]];
                    *angle = damping::no_faster(before[bone], *angle, most);
                }
            }
            before = Some(at.map(|at| self.orientations_degrees[at]));
        }
    }
}

/// A leg of the drawing that can be bent, and the foot of the body that it follows.
struct Leg {
    /// Hip, knee and foot.
    chain: [usize; 3],
    foot: usize,
    /// The places of knee and foot among the driven joints.
    drives: [usize; 2],
    body: usize,
    /// Of the body's leg.
    length: f64,
}

/// The legs that the way of the root is measured by.
fn legs(rig: &PlanarRig, motion: &BodyMotion, spec: &RetargetSpec, drives: &[Drive]) -> Vec<Leg> {
    let offset = &spec.char_bvh_root_offset;
    let leg = |(body, drawn): (&Vec<String>, &Vec<String>)| {
        let joints: Vec<usize> = drawn.iter().filter_map(|name| rig.joint(name)).collect();
        let [.., hip, knee, foot] = joints[..] else { return None };
        let (one, other) = (rig.parents[knee]? == hip, rig.parents[foot]? == knee);
        let drive = |joint: usize| drives.iter().position(|drive| drive.joint == joint);
        let joints: Vec<DVec3> =
            body.iter().filter_map(|name| motion.joint(name)).map(|joint| motion.place(0, joint)).collect();
        let length = joints.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        let places = [drive(knee)?, drive(foot)?];
        let body = drives[places[1]].to;
        (one && other).then_some(Leg { chain: [hip, knee, foot], foot, drives: places, body, length })
    };
    offset.bvh_joints.iter().zip(&offset.char_joints).filter_map(leg).collect()
}

/// For each frame the angles of the driven bones, and how long they are drawn.
fn orientations(motion: &BodyMotion, drives: &[Drive], rules: &Rules) -> (Vec<f64>, Vec<f64>) {
    /// No bone is drawn shorter than this share of its length.
    const SHORTEST: f64 = 0.35;
    let mut degrees = vec![0.0; motion.frames() * drives.len()];
    let mut stretches = vec![1.0; degrees.len()];
    for (place, drive) in drives.iter().enumerate() {
        let direction = |frame| motion.place(frame, drive.to) - motion.place(frame, drive.from);
        let angles: Vec<f64> = match rules.manner {
            Manner::Original => {
                (0..motion.frames()).map(|frame| angle_degrees(drive.plane.seen(direction(frame)))).collect()
            }
            Manner::Steady => {
                let seen = |frame| drive.plane.seen(direction(frame).normalize_or_zero());
                let mut seen: Vec<DVec2> = (0..motion.frames()).map(seen).collect();
                damping::damp(&mut seen, motion.frame_time, rules.damped_over_seconds);
                if rules.foreshorten {
                    for (frame, seen) in seen.iter().enumerate() {
                        stretches[frame * drives.len() + place] = seen.length().clamp(SHORTEST, 1.0);
                    }
                }
                damping::followed(&seen, motion.frame_time)
            }
        };
        for (frame, angle) in angles.into_iter().enumerate() {
            degrees[frame * drives.len() + place] = angle;
        }
    }
    (degrees, stretches)
}

/// For each frame the groups from the farthest to the nearest.
fn order(group_depths: &[f64], groups: usize, (reach, frame_time): (f64, f64), manner: Manner) -> Vec<usize> {
    if manner == Manner::Steady {
        return damping::steady_order(group_depths, groups, reach, frame_time);
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
