//! stub until the rig branch lands
use crate::model::{ModelPose, Skeleton};
use glam::DVec3;
use std::{collections::BTreeMap, fmt, str::FromStr};
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Role(String);
impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}
impl FromStr for Role {
    type Err = ();
    fn from_str(s: &str) -> Result<Self, ()> {
        Ok(Self(s.into()))
    }
}
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RigKind {
    Biped,
    Quadruped,
    Other,
}
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestPoseKind {
    T,
    A,
    ArmsDown,
    Other,
}
#[derive(Clone, Debug)]
pub struct RoleFinding {
    pub joints: Vec<usize>,
    pub confidence: f64,
    pub alternatives: Vec<Vec<usize>>,
    pub reasons: Vec<String>,
}
#[derive(Clone, Copy, Debug)]
pub struct BodyFrame {
    pub up: DVec3,
    pub forward: DVec3,
    pub left: DVec3,
}
#[derive(Clone, Debug)]
pub struct Recognition {
    pub kind: RigKind,
    pub recognised_as: Option<String>,
    pub confidence: f64,
    pub roles: BTreeMap<Role, RoleFinding>,
    pub twist_helpers: Vec<usize>,
    pub body: Option<BodyFrame>,
    pub rest_pose: RestPoseKind,
}
pub fn recognise(_: &Skeleton, _: &ModelPose, _: &[(String, usize)], _: Option<&str>) -> Recognition {
    Recognition {
        kind: RigKind::Other,
        recognised_as: None,
        confidence: 0.0,
        roles: BTreeMap::new(),
        twist_helpers: vec![],
        body: None,
        rest_pose: RestPoseKind::Other,
    }
}
