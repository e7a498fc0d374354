//! A finger's joint that is bent and spread more or less. (docs/algorithm/joints.md.)

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::FingersOp;

use crate::retarget::stages::posed::Step;
use crate::retarget::{
    mapping::Mapping,
    ops::{context::Context, edit::Edit, op_spec::OpSpec, scope::Scope},
    stages::posed::builder::StepBuilder,
};
use glam::{DQuat, DVec3};

use crate::model::rotation::twist_angle;

use crate::model::Transform;

use crate::retarget::stages::posed::figure::{Figure, scaled};

/// One joint.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct FingerStep {
    pub(in crate::retarget) slot: usize,
    /// Its rotation below its parent at rest.
    pub(in crate::retarget) rest: DQuat,
    /// How bending and spreading are told apart; nothing for thumbs, which are bent as a whole.
    pub(in crate::retarget) axes: Option<FingerAxes>,
    pub(in crate::retarget) curl: f64,
    pub(in crate::retarget) spread: f64,
    /// Radians.
    pub(in crate::retarget) curl_offset: f64,
}

/// Axes in the joint's own space at rest; unit vectors, each perpendicular to the others.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct FingerAxes {
    /// Along the bone.
    pub(in crate::retarget) along: DVec3,
    /// What it bends about, toward the palm.
    pub(in crate::retarget) flexion: DVec3,
}

impl Step for FingerStep {
    fn apply(&self, figure: &mut Figure<'_>) {
        let local = figure.local(self.slot);
        let change = (self.rest.conjugate() * local.rotation).normalize();
        let changed = match self.axes {
            None => scaled(change, self.curl),
            Some(FingerAxes { along, flexion }) => {
                let twist = DQuat::from_axis_angle(along, twist_angle(change, along));
                let swing = change * twist.conjugate();
                let swing = if swing.w < 0.0 { -swing } else { swing }.to_scaled_axis();
                let bent = swing.dot(flexion);
                let across = swing - flexion * bent;
                let bent = bent * self.curl + self.curl_offset;
                DQuat::from_scaled_axis(flexion * bent + across * self.spread) * twist
            }
        };
        figure.set_local(self.slot, Transform { rotation: (self.rest * changed).normalize(), ..local });
    }
}

/// How a joint of a finger is bent.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct FingerDrive {
    /// The joint.
    pub(in crate::retarget) joint: usize,
    /// Along its bone, and what it bends about toward the palm, in its own axes; nothing where it is bent as a whole.
    pub(in crate::retarget) axes: Option<[DVec3; 2]>,
    /// Factor on the bending.
    pub(in crate::retarget) curl: f64,
    /// Factor on the spreading.
    pub(in crate::retarget) spread: f64,
    /// Radians of further bending.
    pub(in crate::retarget) curl_offset: f64,
}

impl Edit for FingerDrive {
    type Step = FingerStep;

    fn joints(&self, _mapping: &Mapping) -> Vec<usize> {
        vec![self.joint]
    }

    fn step(&self, builder: &mut StepBuilder<'_>) -> FingerStep {
        FingerStep {
            slot: builder.change(self.joint, true, false),
            rest: builder.rest_below_parent(self.joint).rotation,
            axes: self.axes.map(|[along, flexion]| FingerAxes { along, flexion }),
            curl: self.curl,
            spread: self.spread,
            curl_offset: self.curl_offset,
        }
    }
}

impl OpSpec for FingersOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let edits = resolve::resolve(self, context);
        context.push(&self.scope, edits);
    }
}
