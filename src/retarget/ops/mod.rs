//! The steps of a retarget, a room each: what a user says of the op (`spec`), what that becomes for two rigs (`resolve`), and the work.
//!
//! The table below is the only place that names them all. The enum, the schema, the order of the documentation, the names on the wire
//! and the seeds of the fuzzer come from it.

pub(in crate::retarget) mod additive_pose;
pub(in crate::retarget) mod arm_clearance;
pub(in crate::retarget) mod arm_spacing;
pub(in crate::retarget) mod contacts;
pub(in crate::retarget) mod context;
pub(in crate::retarget) mod copy_base_pose;
pub(in crate::retarget) mod curves;
pub(in crate::retarget) mod edit;
pub(in crate::retarget) mod fade;
pub(in crate::retarget) mod feet;
pub(in crate::retarget) mod filter;
pub(in crate::retarget) mod fingers;
pub(in crate::retarget) mod fk;
pub(in crate::retarget) mod floor;
pub(in crate::retarget) mod hand_contact;
pub(in crate::retarget) mod ik;
pub(in crate::retarget) mod joints;
pub(in crate::retarget) mod limits;
pub(in crate::retarget) mod op_spec;
pub(in crate::retarget) mod pelvis;
pub(in crate::retarget) mod pin;
pub(in crate::retarget) mod plant;
pub(in crate::retarget) mod props;
pub(in crate::retarget) mod reach;
pub(in crate::retarget) mod resolved;
pub(in crate::retarget) mod root_motion;
pub(in crate::retarget) mod scale_source;
pub(in crate::retarget) mod schedule;
pub(in crate::retarget) mod scope;
pub(in crate::retarget) mod self_contact;
pub(in crate::retarget) mod source_curves;
pub(in crate::retarget) mod stretch_chain;
pub(in crate::retarget) mod stride;
pub(in crate::retarget) mod twist;

pub use additive_pose::AdditivePoseOp;
pub use arm_clearance::ArmClearanceOp;
pub use arm_spacing::ArmSpacingOp;
pub use contacts::{ContactFloor, ContactFloorRule, ContactsOp};
pub use copy_base_pose::CopyBasePoseOp;
pub use curves::{ContactCurve, CurveDrive, CurveRow, CurvesOp, OtherCurves, carried_curves};
pub use filter::{FilterKind, FilterOp, filtered};
pub use fingers::FingersOp;
pub use fk::{Carry, FkOp};
pub use floor::FloorOp;
pub use hand_contact::HandContactOp;
pub use ik::{IkGoal, IkOp};
pub use joints::{JointRow, JointSource, JointSpace, JointsOp};
pub use limits::{LimitRange, LimitsOp};
pub use pelvis::{HeightRule, PelvisOp, PelvisScale, PelvisScaleRule, ScaleOrigin};
pub use pin::{Pin, PinMode, PinOp, PinSide};
pub use plant::{PlantMode, PlantOp};
pub use props::{CarriedProp, Grip, GripHand, PropsOp};
pub use reach::{ReachGoal, ReachOp, ReachPlace};
pub use resolved::{ResolvedOp, ResolvedOps};
pub use root_motion::{RootAction, RootAxis, RootMotionOp, RootPlace, RootSource};
pub use scale_source::{ScaleSourceOp, SourceScale};
pub use schedule::{Schedule, scheduled};
pub use scope::{Alpha, AlphaCurve, Scope};
pub use self_contact::SelfContactOp;
pub use stretch_chain::StretchChainOp;
pub use stride::{StrideDirection, StrideOp};
pub use twist::TwistOp;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use context::Context;
use op_spec::OpSpec;

/// The ops: what each is for, its variant, its spec and its name on the wire, in the order of the documentation.
macro_rules! registry {
    ($($(#[$doc:meta])+ $variant:ident($spec:ident) = $name:tt,)+) => {
        /// One step of the retarget.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "op")]
        pub enum Op {
            $($(#[$doc])+ #[serde(rename = $name)] $variant($spec),)+
        }

        impl Op {
            /// The names of all ops on the wire, in the order of the documentation.
            pub const NAMES: &'static [&'static str] = &[$($name),+];

            /// Its name on the wire.
            #[must_use]
            pub const fn name(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => $name,)+
                }
            }

            fn spec(&self) -> &dyn OpSpec {
                match self {
                    $(Self::$variant(spec) => spec,)+
                }
            }
        }
    };
}

registry! {
    /// Moves and turns the pelvis.
    Pelvis(PelvisOp) = "pelvis",
    /// Turns the chains by forward kinematics.
    Fk(FkOp) = "fk",
    /// Swings arms out of a body that is thicker than the source's.
    ArmClearance(ArmClearanceOp) = "arm_clearance",
    /// Finds where feet and hands rest on something in the source.
    Contacts(ContactsOp) = "contacts",
    /// Sets goals for the ends of limbs and reaches them.
    Ik(IkOp) = "ik",
    /// Keeps feet where they stand.
    Plant(PlantOp) = "plant",
    /// Keeps soles as far above the floor as the source's are.
    Floor(FloorOp) = "floor",
    /// Brings hands together that touch each other.
    HandContact(HandContactOp) = "hand_contact",
    /// Keeps hands that touch the body touching it.
    SelfContact(SelfContactOp) = "self_contact",
    /// Takes noise off rotations.
    Filter(FilterOp) = "filter",
    /// Drives joints one by one from a table.
    Joints(JointsOp) = "joints",
    /// Lets joints follow another joint.
    Pin(PinOp) = "pin",
    /// Copies joints of equal names as they are.
    CopyBasePose(CopyBasePoseOp) = "copy_base_pose",
    /// Adds a constant change of pose.
    AdditivePose(AdditivePoseOp) = "additive_pose",
    /// Turns arms away from the body or toward it.
    ArmSpacing(ArmSpacingOp) = "arm_spacing",
    /// Makes chains longer or shorter.
    StretchChain(StretchChainOp) = "stretch_chain",
    /// Shares the twist of limbs out among twist joints.
    Twist(TwistOp) = "twist",
    /// Takes back what bends farther than bodies do.
    Limits(LimitsOp) = "limits",
    /// Bends and spreads fingers more or less.
    Fingers(FingersOp) = "fingers",
    /// Gets ends of chains to goals with the help of the body.
    Reach(ReachOp) = "reach",
    /// Makes steps longer or shorter.
    Stride(StrideOp) = "stride",
    /// Carries custom properties over.
    Curves(CurvesOp) = "curves",
    /// Keeps things in hands.
    Props(PropsOp) = "props",
    /// Scales the source's motion.
    ScaleSource(ScaleSourceOp) = "scale_source",
    /// Puts the figure's way onto its root joint, or takes it out.
    RootMotion(RootMotionOp) = "root_motion",
}

impl Op {
    /// How much of it is taken.
    #[must_use]
    pub fn alpha(&self) -> &Alpha {
        self.spec().alpha()
    }

    /// When and on what it works; nothing for `pelvis` and `fk`, which have fields of their own for that.
    #[must_use]
    pub fn scope(&self) -> Option<&Scope> {
        self.spec().scope()
    }

    /// Whether it is enabled and changes poses where it stands among the ops.
    pub(in crate::retarget) fn changes_poses(&self) -> bool {
        self.spec().changes_poses() && self.scope().is_some_and(|scope| scope.enabled)
    }

    /// Whether what it does in a frame depends on frames far away from it, or on times of the whole clip. What looks some seconds around
    /// itself does not.
    #[must_use]
    pub fn looks_at_whole_clip(&self) -> bool {
        let spec = self.spec();
        let is_scoped = self.scope().is_some_and(|scope| scope.frames.is_some());
        spec.looks_at_whole_clip() || is_scoped || spec.alpha().constant().is_none()
    }

    /// See [`OpSpec::check`].
    pub(in crate::retarget) fn check(&self, refuse: &mut dyn FnMut(&str, String)) {
        self.spec().check(refuse);
    }

    /// Hands what it becomes for two rigs to the context; nothing where it is not enabled.
    pub(in crate::retarget) fn resolve(&self, context: &mut Context<'_>) {
        self.spec().check_names(context);
        if self.scope().is_none_or(|scope| scope.enabled) {
            self.spec().resolve(context);
        }
    }
}
