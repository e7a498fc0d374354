//! The joints of a drawing: at rest, and turned in its plane.

use glam::DVec2;

use super::{
    config::{CharacterSpec, RuntimeCheck},
    error::DrawingError,
    plane::angle_degrees,
};

/// A drawing's joints, depth first. Lengths are in widths of its picture, which is thought of as a square.
#[derive(Clone, Debug, PartialEq)]
pub struct Puppet {
    /// Of all joints.
    pub names: Vec<String>,
    /// Of each joint but the first.
    pub parents: Vec<Option<usize>>,
    /// At rest: right and up, from the lower left corner.
    pub rest: Vec<DVec2>,
    /// Of the bone from the joint above, in degrees counterclockwise from up; 0 of the root.
    pub rest_degrees: Vec<f64>,
}

impl Puppet {
    /// The joints of a character, whose config has been checked.
    #[must_use]
    pub fn new(character: &CharacterSpec) -> Self {
        let side = f64::from(character.width.max(character.height));
        let mut puppet = Self { names: Vec::new(), parents: Vec::new(), rest: Vec::new(), rest_degrees: Vec::new() };
        let mut left = vec![(None, "root")];
        while let Some((parent, name)) = left.pop() {
            let Some(joint) = character.skeleton.iter().find(|joint| joint.name == name) else { continue };
            let index = puppet.names.len();
            let [column, row] = joint.loc;
            puppet.names.push(joint.name.clone());
            puppet.parents.push(parent);
            puppet.rest.push(DVec2::new(column, f64::from(character.height) - row) / side);
            let bone = |parent: usize| puppet.rest[index] - puppet.rest[parent];
            puppet.rest_degrees.push(parent.map_or(0.0, |parent| angle_degrees(bone(parent))));
            let children = character.skeleton.iter().filter(|child| child.parent.as_deref() == Some(name));
            let children: Vec<(Option<usize>, &str)> =
                children.map(|child| (Some(index), child.name.as_str())).collect();
            left.extend(children.into_iter().rev());
        }
        puppet
    }

    /// The joint of that name.
    pub(super) fn joint(&self, place: impl Into<String>, name: &str) -> Result<usize, DrawingError> {
        let index = self.names.iter().position(|known| known == name);
        index.ok_or_else(|| {
            DrawingError::unknown(place, "joint in the drawing", name, self.names.iter().map(String::as_str))
        })
    }

    /// Whether a check holds: the joint is on the upper side of the line, or on it.
    pub(super) fn passes(&self, check: &RuntimeCheck, place: &str) -> Result<bool, DrawingError> {
        let joint =
            |index: usize, name: &str| self.joint(format!("{place}/{index}"), name).map(|joint| self.rest[joint]);
        let (target, from, to) = (joint(1, &check.target)?, joint(2, &check.line[0])?, joint(3, &check.line[1])?);
        Ok((to - from).perp_dot(target - from) >= 0.0)
    }

    /// Where joints are when the bones that lead to some of them have an angle, in degrees, as Animated Drawings turns them: a joint is turned by the last of its
    /// children that has one, and of what is above it only its own angle is taken off.
    pub(super) fn turned(&self, wanted_degrees: &[Option<f64>]) -> Vec<DVec2> {
        let mut local = vec![0.0; self.names.len()];
        for joint in 0..self.names.len() {
            let (Some(parent), Some(wanted)) = (self.parents[joint], wanted_degrees[joint]) else { continue };
            let above = wanted_degrees[parent].map_or(0.0, |wanted| wanted - self.rest_degrees[parent]);
            local[parent] = wanted - self.rest_degrees[joint] - above;
        }
        let mut turns = vec![0.0; self.names.len()];
        let mut places = self.rest.clone();
        for joint in 0..self.names.len() {
            let Some(parent) = self.parents[joint] else {
                turns[joint] = local[joint];
                continue;
            };
            let bone = self.rest[joint] - self.rest[parent];
            places[joint] = places[parent] + DVec2::from_angle(f64::to_radians(turns[parent])).rotate(bone);
            turns[joint] = turns[parent] + local[joint];
        }
        places
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::config::read_character;

    fn arm() -> Puppet {
        let text = "width: 100\nheight: 100\nskeleton:\n- {loc: [50, 50], name: root, parent: null}\n\
                    - {loc: [60, 50], name: elbow, parent: root}\n- {loc: [70, 50], name: hand, parent: elbow}\n";
        Puppet::new(&read_character(text.as_bytes()).expect("a character"))
    }

    #[test]
    fn joints_lie_up_and_right_of_the_lower_left_corner() {
        let arm = arm();
        assert_eq!(arm.rest, [DVec2::new(0.5, 0.5), DVec2::new(0.6, 0.5), DVec2::new(0.7, 0.5)]);
        assert_eq!(arm.rest_degrees, [0.0, 270.0, 270.0]);
    }

    #[test]
    fn bones_that_have_an_angle_have_it() {
        let places = arm().turned(&[None, Some(0.0), Some(90.0)]);
        assert!(places[1].distance(DVec2::new(0.5, 0.6)) < 1e-12, "up: {}", places[1]);
        assert!(places[2].distance(DVec2::new(0.4, 0.6)) < 1e-12, "and then to the left: {}", places[2]);
    }

    #[test]
    fn a_check_is_about_the_upper_side_of_a_line() {
        let check =
            |target: &str, from: &str, to: &str| RuntimeCheck { target: target.into(), line: [from.into(), to.into()] };
        let arm = arm();
        assert_eq!(arm.passes(&check("elbow", "root", "hand"), ""), Ok(true), "on the line");
        let missing = arm.passes(&check("neck", "root", "hand"), "/char_runtime_checks/0").expect_err("not there");
        assert_eq!(missing.place, "/char_runtime_checks/0/1");
    }
}
