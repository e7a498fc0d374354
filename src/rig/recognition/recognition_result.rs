//! What recognition finds.

use std::collections::BTreeMap;

use super::{BodyFrame, Part, Prop, RestPoseKind, Role, RoleFinding, TwistHelper, kind::RigKind};

/// What the joints of a skeleton mean.
#[derive(Clone, Debug, Default)]
pub struct Recognition {
    /// What kind of body it is. [`RigKind::Other`] has no limbs, only what is named beyond doubt; but for creatures on six and more
    /// legs, see [`Self::is_body`].
    pub kind: RigKind,
    /// The naming convention, where it is one with a name.
    pub recognised_as: Option<String>,
    /// How sure all of it is, from 0 to 1; missing parts of a whole body count as 0.
    pub confidence: f64,
    /// The joints of every role that was found.
    pub roles: BTreeMap<Role, RoleFinding>,
    /// Joints beside the limbs that carry part of their twist; in no role.
    pub twist_helpers: Vec<usize>,
    /// The same, with the segment of each and where on it the helper lies.
    pub twists: Vec<TwistHelper>,
    /// What the hands hold.
    pub props: Vec<Prop>,
    /// Up, forward and left of the body in the rest pose, in model space.
    pub body: Option<BodyFrame>,
    /// How the rest pose holds the arms.
    pub rest_pose: RestPoseKind,
    /// Whether left and right were exchanged because the feet contradict the names.
    pub sides_swapped: bool,
    /// Whether neither names nor feet nor knees say which side is left: then the body is taken to face front.
    pub sides_guessed: bool,
    /// Joints whose names speak of another part than the role that they have.
    pub misnamed: Vec<usize>,
    /// Whether the names do not make up a body and its shape alone does.
    pub by_shape: bool,
}

impl Recognition {
    /// Whether it is a body that stands: a biped, a quadruped, or a creature on more legs.
    #[must_use]
    pub fn is_body(&self) -> bool {
        self.kind != RigKind::Other || is_crawler(&self.roles)
    }
}

/// Whether the roles have legs that are counted: those of a body on six and more.
pub(super) fn is_crawler(roles: &BTreeMap<Role, RoleFinding>) -> bool {
    roles.keys().any(|role| role.part == Part::Leg)
}
