//! What answers call joints, and values by role.

use std::{collections::BTreeMap, fmt};

use serde::{Serialize, Serializer};

use crate::model::Scene;

/// One name, or several.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum OneOrMore {
    /// One.
    One(String),
    /// Several, from the body outward.
    More(Vec<String>),
}

/// Values by role, in the order of the body: the trunk, the left, the right. An object in JSON.
#[derive(Clone, Debug)]
pub struct ByRole<T>(pub Vec<(String, T)>);

impl<T> ByRole<T> {
    /// The value of a role.
    #[must_use]
    pub fn get(&self, role: &str) -> Option<&T> {
        self.0.iter().find(|entry| entry.0 == role).map(|entry| &entry.1)
    }
}

impl<T: Serialize> Serialize for ByRole<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(role, value)| (role, value)))
    }
}

impl fmt::Display for OneOrMore {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::One(name) => formatter.write_str(name),
            Self::More(names) => formatter.write_str(&names.join(", ")),
        }
    }
}

/// What [`crate::model::Skeleton::label`] gives, for all joints at once.
pub(super) struct Labels<'a> {
    scene: &'a Scene,
    uses: BTreeMap<&'a str, usize>,
}

impl<'a> Labels<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        let mut uses = BTreeMap::new();
        for joint in scene.skeleton.joints() {
            *uses.entry(joint.name.as_str()).or_default() += 1;
        }
        Self { scene, uses }
    }

    pub(super) fn of(&self, joint: usize) -> String {
        let joint = &self.scene.skeleton.joints()[joint];
        let is_unique = !joint.name.is_empty() && self.uses.get(joint.name.as_str()) == Some(&1);
        if is_unique { joint.name.clone() } else { format!("#{}", joint.node) }
    }

    pub(super) fn one_or_more(&self, joints: &[usize]) -> OneOrMore {
        match joints {
            [joint] => OneOrMore::One(self.of(*joint)),
            joints => OneOrMore::More(joints.iter().map(|joint| self.of(*joint)).collect()),
        }
    }
}
