//! The joints of the drawing at rest and posed.

use glam::{DVec2, Vec2};

use super::{CharacterSpec, DrawingError, projection::angle_degrees};

/// The joints of a drawing, depth first.
#[derive(Clone, Debug)]
pub struct PlanarRig {
    /// The names of the joints.
    pub joint_names: Vec<String>,
    /// The parent of each joint; it comes before the joint.
    pub parents: Vec<Option<usize>>,
    /// Where the joints are at rest.
    pub rest: Vec<DVec2>,
    /// The angle of each joint's bone, from its parent, at rest.
    pub rest_degrees: Vec<f64>,
}

impl PlanarRig {
    /// The rig of a character.
    ///
    /// # Errors
    ///
    /// Where a joint does not hang on the root.
    pub fn new(spec: &CharacterSpec) -> Result<Self, DrawingError> {
        let mut rig = Self { joint_names: vec![], parents: vec![], rest: vec![], rest_degrees: vec![] };
        let root = spec.skeleton.iter().position(|joint| joint.name == "root");
        let mut open: Vec<(usize, Option<usize>)> = root.map(|root| (root, None)).into_iter().collect();
        while let Some((index, parent)) = open.pop() {
            let joint = &spec.skeleton[index];
            let side = f64::from(spec.padded_side());
            let place = DVec2::new(joint.loc[0] / side, (f64::from(spec.height) - joint.loc[1]) / side);
            let at = rig.rest.len();
            rig.joint_names.push(joint.name.clone());
            rig.parents.push(parent);
            rig.rest.push(place);
            rig.rest_degrees.push(parent.map_or(0.0, |parent| angle_degrees(place - rig.rest[parent])));
            let children = spec.skeleton.iter().enumerate().rev();
            let children = children.filter(|(_, child)| child.parent.as_deref() == Some(joint.name.as_str()));
            open.extend(children.map(|(child, _)| (child, Some(at))));
        }
        if let Some(left) = spec.skeleton.iter().position(|joint| !rig.joint_names.contains(&joint.name)) {
            let detail = format!("the joint {:?} does not hang on the root", spec.skeleton[left].name);
            return Err(DrawingError::new(format!("skeleton[{left}].parent"), detail, "undo the circle of parents"));
        }
        Ok(rig)
    }

    /// The index of a joint.
    #[must_use]
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joint_names.iter().position(|joint| joint == name)
    }

    /// Where the joints are at rest in single precision, each reached from its parent: where *Animated Drawings* pins its mesh.
    #[must_use]
    pub fn rest_in_single_precision(&self) -> Vec<DVec2> {
        let mut places: Vec<Vec2> = Vec::with_capacity(self.rest.len());
        for (joint, parent) in self.parents.iter().enumerate() {
            let place = self.rest[joint].as_vec2();
            places.push(parent.map_or(place, |parent| places[parent] + (place - self.rest[parent].as_vec2())));
        }
        places.into_iter().map(Vec2::as_dvec2).collect()
    }

    /// Poses the rig as *Animated Drawings* does: a driven bone takes the turn of its parent's bone into account only where that
    /// is driven too, and of several driven children the last one turns their parent.
    ///
    /// `wanted` has an angle for each driven joint.
    pub(super) fn pose(&self, wanted: &[Option<f64>], root: DVec2, posed: &mut [DVec2]) {
        let turned = |joint: usize| wanted[joint].map_or(0.0, |angle| angle - self.rest_degrees[joint]);
        let mut turns = vec![0.0; self.rest.len()];
        for (joint, (angle, parent)) in wanted.iter().zip(&self.parents).enumerate() {
            if let (Some(_), Some(parent)) = (angle, *parent) {
                turns[parent] = turned(joint) - turned(parent);
            }
        }
        for joint in 0..self.rest.len() {
            let Some(parent) = self.parents[joint] else {
                posed[joint] = root;
                continue;
            };
            let turn = DVec2::from_angle(turns[parent].to_radians());
            posed[joint] = posed[parent] + turn.rotate(self.rest[joint] - self.rest[parent]);
            turns[joint] += turns[parent];
        }
    }

    /// Poses the rig so that every driven bone has its angle; what is not driven turns with the bone that it hangs on.
    ///
    /// `wanted` has an angle and a length, in lengths at rest, for each driven joint.
    pub(super) fn pose_exactly(&self, wanted: &[Option<(f64, f64)>], root: DVec2, posed: &mut [DVec2]) {
        let mut turns = vec![0.0; self.rest.len()];
        for joint in 0..self.rest.len() {
            let Some(parent) = self.parents[joint] else {
                posed[joint] = root;
                continue;
            };
            turns[joint] = wanted[joint].map_or(turns[parent], |(angle, _)| angle - self.rest_degrees[joint]);
            let turn = DVec2::from_angle(turns[joint].to_radians());
            let way = (self.rest[joint] - self.rest[parent]) * wanted[joint].map_or(1.0, |(_, length)| length);
            posed[joint] = posed[parent] + turn.rotate(way);
        }
    }

    /// Whether `target` lies on the left of the line from `start` to `end` at rest.
    pub(super) fn is_above(&self, target: usize, [start, end]: [usize; 2]) -> bool {
        let along = (self.rest[end] - self.rest[start]).normalize_or_zero();
        along.perp_dot(self.rest[target] - self.rest[start]) >= 0.0
    }
}
