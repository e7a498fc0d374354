//! What a drawing does in a motion, with the numbers of Animated Drawings.

use std::collections::BTreeMap;

use glam::DVec2;

use crate::formats::JointPaths;

use super::{
    config::{CharacterSpec, DrawingRetargetSpec, MotionSpec},
    driver::Driver,
    error::DrawingError,
    plane::{Plane, angle_degrees},
    puppet::Puppet,
    root::root_path,
};

/// A drawing in motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Performance {
    /// The motion that drives it.
    pub driver: Driver,
    /// Its joints.
    pub puppet: Puppet,
    /// The plane of each projection group, in their order.
    pub planes: Vec<Plane>,
    /// Joints of the motion in projection groups, with the plane of each, in the order of the motion.
    pub projected: Vec<(usize, Plane)>,
    /// Joints of the drawing that are turned, by their names, in the order of the config.
    pub driven: Vec<String>,
    /// Mappings that a check of the drawing at rest has taken away.
    pub dropped: Vec<String>,
    /// For each frame, the angle of the bone that leads to each of them, in degrees counterclockwise from up, 0 to 360.
    pub wanted_degrees: Vec<Vec<f64>>,
    /// For each frame, where the root is, seen from where it is in the first; right and up, in widths of the picture.
    pub root_path: Vec<DVec2>,
    /// For each frame, where joints are; right and up, in widths of the picture, from the origin of the scene.
    pub joints: Vec<Vec<DVec2>>,
}

impl Performance {
    /// Puts a motion onto a drawing.
    ///
    /// # Errors
    /// When a config names what the motion or the drawing does not have.
    pub fn new(
        character: &CharacterSpec,
        motion: &MotionSpec,
        paths: &JointPaths,
        retarget: &DrawingRetargetSpec,
    ) -> Result<Self, DrawingError> {
        let (driver, puppet) = (Driver::new(paths, motion)?, Puppet::new(character));
        let mut planes = Vec::new();
        let mut plane_of: BTreeMap<usize, Plane> = BTreeMap::new();
        for (index, group) in retarget.projection_groups.iter().enumerate() {
            let place = format!("/bvh_projection_bodypart_groups/{index}");
            let plane = Plane::of(group, &place, &driver)?;
            planes.push(plane);
            for (at, name) in group.bvh_joint_names.iter().enumerate() {
                let joint = driver.joint(format!("{place}/bvh_joint_names/{at}"), name)?;
                plane_of.insert(joint, plane);
            }
        }
        let mut mapping = Vec::new();
        for (name, [proximal, distal]) in &retarget.mapping {
            let place = format!("/char_joint_bvh_joints_mapping/{name}");
            let from = driver.joint(format!("{place}/0"), proximal)?;
            let to = driver.joint(format!("{place}/1"), distal)?;
            let plane = plane_of.get(&to).copied().ok_or_else(|| {
                let detail = format!("'{distal}' is in no projection group, so it has no plane");
                DrawingError::new(format!("{place}/1"), detail, "add it to bvh_projection_bodypart_groups")
            })?;
            mapping.push((name.clone(), puppet.joint(place, name)?, from, to, plane));
        }
        let mut dropped = Vec::new();
        for (index, check) in retarget.runtime_checks.iter().enumerate() {
            if !puppet.passes(check, &format!("/char_runtime_checks/{index}"))? {
                dropped.push(check.target.clone());
            }
        }
        mapping.retain(|(name, ..)| !dropped.contains(name));
        let angles = |frame: &super::driver::DriverFrame| -> Vec<f64> {
            let angle =
                |from: usize, to: usize, plane: Plane| angle_degrees(plane.seen(frame.joints[to] - frame.joints[from]));
            mapping.iter().map(|(_, _, from, to, plane)| angle(*from, *to, *plane)).collect()
        };
        let wanted_degrees: Vec<Vec<f64>> = driver.frames.iter().map(angles).collect();
        let at_rest = |angles: &Vec<f64>| {
            let mut wanted = vec![None; puppet.names.len()];
            mapping.iter().zip(angles).for_each(|((_, joint, ..), angle)| wanted[*joint] = Some(*angle));
            puppet.turned(&wanted)
        };
        let offset = &retarget.root_offset;
        let name = &offset.bvh_projection_bodypart_group_for_offset;
        let group = retarget.projection_groups.iter().position(|group| group.name == *name).ok_or_else(|| {
            let known = retarget.projection_groups.iter().map(|group| group.name.as_str());
            let place = "/char_bvh_root_offset/bvh_projection_bodypart_group_for_offset";
            DrawingError::unknown(place, "projection group", name, known)
        })?;
        let root_path = root_path(offset, planes[group], &driver, &puppet)?;
        let [start_x, start_y, _] = retarget.char_starting_location;
        let joints = wanted_degrees.iter().zip(&root_path).map(|(angles, at)| {
            let to = *at + DVec2::new(start_x, start_y) - puppet.rest[0];
            at_rest(angles).into_iter().map(|joint| joint + to).collect()
        });
        let joints = joints.collect();
        Ok(Self {
            planes,
            projected: plane_of.into_iter().collect(),
            driven: mapping.iter().map(|(name, ..)| name.clone()).collect(),
            dropped,
            wanted_degrees,
            root_path,
            joints,
            driver,
            puppet,
        })
    }

    /// How near the joints of projection groups are in a frame; larger is nearer.
    pub fn depths(&self, frame: usize) -> impl Iterator<Item = f64> {
        let joints = &self.driver.frames[frame].joints;
        self.projected.iter().map(|(joint, plane)| plane.depth(joints[*joint]))
    }
}
