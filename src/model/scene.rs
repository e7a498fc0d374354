//! What a file holds, once it has been read.

use std::{any::Any, fmt, sync::Arc};

use super::{Axes, Clip, LookAt, Morph, Skeleton, SkinPoints, SkinVertices, Stretched, Transform};

/// An imported file: one forest of joints, its clips and skins, and the file's own document for writing back what we do not
/// understand.
///
/// Made by a format's reader only, which guarantees that every index in it is in range and every number finite.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// All nodes, parents before children.
    pub skeleton: Skeleton,
    /// Animations of that skeleton; each has one entry per joint.
    pub clips: Vec<Clip>,
    /// Joints that a viewer does not show, rising: nodes of a glTF outside of its default scene, where there are joints in that one.
    pub hidden_joints: Vec<usize>,
    /// Skins, where the file has meshes bound to joints.
    pub skins: Vec<Skin>,
    /// `model_from_joint` of the pose in which the skins were bound, per joint; `None` for joints that no skin binds.
    /// Empty where the file says nothing.
    pub bind_pose: Vec<Option<Transform>>,
    /// Where the vertices of the skinned meshes lie around their joints; empty where the file has none, or none that can be
    /// decoded.
    pub skin_points: SkinPoints,
    /// The vertices themselves with all the joints that move them. Copies share them.
    pub skin_vertices: Arc<SkinVertices>,
    /// Morph targets of meshes, and expressions.
    pub morphs: Vec<Morph>,
    /// What the shapes that look aside mean, where the file says it.
    pub look_at: Option<LookAt>,
    /// The joint whose rotation says where the figure looks, seen from its head: what a VRM animation has in place of eyes.
    pub gaze_joint: Option<usize>,
    /// Roles that the file itself declares (a VRM humanoid map): role name of that format, and joint.
    pub declared_roles: Vec<(String, usize)>,
    /// The name of the convention that `declared_roles` follows, such as `vrm`.
    pub declared_convention: Option<&'static str>,
    /// The axes that everything here is in. glTF and FBX arrive in the canonical ones; pose arrays stay in the axes that they declare; `None`
    /// where the file does not say (BVH).
    pub axes: Option<Axes>,
    /// Meters per unit of length of everything here: 1 for glTF and FBX; `None` where the file does not say (BVH).
    pub unit_meters: Option<f64>,
    /// What lies between the joints here and the nodes of the file, where the file stretches its skeleton; the clips and the
    /// rest transforms of the scene are those of joints that keep their length.
    pub stretched: Option<Stretched>,
    /// What the format needs to write this scene back.
    pub payload: Payload,
}

/// A set of joints that deform a mesh. Where its vertices lie is in [`Scene::skin_points`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    /// The skin's or mesh's name; may be empty.
    pub name: String,
    /// Joints of the skeleton.
    pub joints: Vec<usize>,
    /// Whether the file gives no inverse bind matrices for it, so that nobody knows in which pose it was bound.
    pub has_no_inverse_binds: bool,
    /// Whether they are all the identity although its joints are in different places, which says as little.
    pub has_identity_binds: bool,
    /// How many joints a vertex of it is bound to at most, or can be where its meshes cannot be decoded; 0 where nobody counted.
    pub most_influences: usize,
}

/// A format's own document, opaque to everybody else. Copies share it.
#[derive(Clone, Default)]
pub struct Payload(Option<Arc<dyn Any + Send + Sync>>);

impl Payload {
    /// Wraps a format's document.
    #[must_use]
    pub fn new<T: Any + Send + Sync>(document: T) -> Self {
        Self(Some(Arc::new(document)))
    }

    /// The document, where it is of that type.
    #[must_use]
    pub fn get<T: Any>(&self) -> Option<&T> {
        self.0.as_deref().and_then(|document| document.downcast_ref())
    }
}

impl fmt::Debug for Payload {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(if self.0.is_some() { "Payload(..)" } else { "Payload(none)" })
    }
}
