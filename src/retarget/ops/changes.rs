//! Which joints the ops behind forward kinematics may change.

use super::PlantMode;
use super::{
    edits::PosedEdit,
    resolved::{StagedKind, StagedOp, Stages},
};
use crate::rig::LimbJoints;

impl Stages {
    /// Target joints that an op may turn or move by itself, each with the name of the op on the wire; what hangs from them
    /// follows. The pelvis is among them where the op may shift it. Joints may repeat.
    #[must_use]
    pub fn changed_by(&self, op: &StagedOp, pelvis: Option<usize>) -> Vec<(usize, &'static str)> {
        let bones = |limb: usize, with_ball: bool| {
            let limb = self.limbs.get(limb).map(|limb| limb.target);
            let joints = limb.map(|LimbJoints { start, middle, end, ball, .. }| {
                [Some(start), Some(middle), Some(end), ball.filter(|_| with_ball)]
            });
            joints.into_iter().flatten().flatten()
        };
        let of_limbs = |with_ball: bool| op.limbs.iter().flat_map(move |limb| bones(*limb, with_ball));
        let shifted = |shifts: bool| pelvis.filter(|_| shifts && !op.limbs.is_empty()).into_iter();
        let named = |name: &'static str, joints: Vec<usize>| joints.into_iter().map(|joint| (joint, name)).collect();
        match &op.kind {
            // What is faded or contacts are found in is changed by other ops.
            StagedKind::Contacts(_) | StagedKind::Fade(_) => Vec::new(),
            StagedKind::Plant(plant) if plant.mode == PlantMode::Never => Vec::new(),
            StagedKind::Ik(_) => named("ik", of_limbs(false).collect()),
            StagedKind::Plant(plant) => named("plant", shifted(plant.pull_pelvis).chain(of_limbs(true)).collect()),
            StagedKind::Floor(floor) => {
                let tails = self.tails.iter().flat_map(|tail| &tail.joints).map(|tail| tail.joint);
                let tails = tails.filter(|_| floor.scope.mask.is_none());
                named("floor", shifted(floor.shift_pelvis).chain(of_limbs(true)).chain(tails).collect())
            }
            StagedKind::SelfContact(_) => named("self_contact", of_limbs(false).collect()),
            StagedKind::Filter(_, joints) => named("filter", joints.clone()),
            StagedKind::Twist(_, joints) => named("twist", joints.clone()),
            StagedKind::Stride(_) => named("stride", pelvis.into_iter().chain(of_limbs(false)).collect()),
            StagedKind::Grips(pairs) => {
                named("props", pairs.iter().flat_map(|pair| bones(pair.follows, false)).collect())
            }
            StagedKind::RootMotion(motion) => {
                named("root_motion", motion.root.into_iter().chain([motion.pelvis]).collect())
            }
            StagedKind::Posed(edits) => edits
                .iter()
                .flat_map(|edit| {
                    let (name, joints): (&'static str, Vec<usize>) = match edit {
                        PosedEdit::Joint(drive) => ("joints", vec![drive.joint]),
                        PosedEdit::Pin(drive) => ("pin", vec![drive.joint]),
                        PosedEdit::Copy(drive) => ("copy_base_pose", vec![drive.joint]),
                        PosedEdit::Add { joint, .. } => ("additive_pose", vec![*joint]),
                        PosedEdit::ArmSpacing { joint, .. } => ("arm_spacing", vec![*joint]),
                        PosedEdit::Stretch(stretch) => ("stretch_chain", stretch.target.clone()),
                        PosedEdit::Limit(limit) => ("limits", vec![limit.joint]),
                        PosedEdit::Finger(drive) => ("fingers", vec![drive.joint]),
                        PosedEdit::Prop(drive) => ("props", vec![drive.joint]),
                        PosedEdit::Shape(shape) => ("fk", shape.target.clone()),
                        PosedEdit::Reach(reach) => ("reach", reach.joints.clone()),
                        PosedEdit::Pole { limb, .. } => ("fk", bones(*limb, false).collect()),
                    };
                    joints.into_iter().map(move |joint| (joint, name))
                })
                .collect(),
        }
    }
}
