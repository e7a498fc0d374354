//! `props`: what carries what, and which hands hold the same thing.

use super::{carried::PropDrive, grips::GripPair};
use crate::{
    retarget::ops::{
        GripHand, PropsOp,
        context::{Context, is_in},
    },
    rig::{Limb, rig::Rig},
};

/// Fingers by which the size of a hand is told.
const FINGERS: [&str; 4] = ["middle", "index", "ring", "pinky"];

pub(in crate::retarget) fn resolve(op: &PropsOp, context: &mut Context<'_>) -> Vec<PropDrive> {
    let masked = context.masked(&op.scope);
    let mut edits = Vec::with_capacity(op.props.len());
    for (index, prop) in op.props.iter().enumerate() {
        let source = context.source_joint(&prop.source, &format!("props/{index}/source"));
        let joint = context.target_joint(&prop.target, &format!("props/{index}/target"));
        let (Some(source), Some(joint)) = (source, joint) else { continue };
        let place = format!("props/{index}/holder");
        let (holder, source_holder) = match &prop.holder {
            Some(name) => (context.target_joint(name, &place), context.source_joint(name, &place)),
            None => match nearest_hand(source, context) {
                Some((holder, source_holder)) => (Some(holder), Some(source_holder)),
                None => {
                    context.refuse(
                        &place,
                        "both rigs have no hand in common that could carry it; name its holder".to_owned(),
                    );
                    continue;
                }
            },
        };
        let (Some(holder), Some(source_holder)) = (holder, source_holder) else { continue };
        if context.target.skeleton().is_ancestor_or_self(joint, holder) {
            context.refuse(&place, format!("'{}' cannot be carried by what hangs below it", prop.target));
            continue;
        }
        if is_in(masked.as_ref(), joint) {
            let scale = prop.scale.unwrap_or_else(|| hand_ratio(context));
            edits.push(PropDrive { joint, source, holder, source_holder, scale });
        }
    }
    edits
}

/// The pairs of hands, as indices into the limbs that both rigs have.
pub(in crate::retarget) fn grips(op: &PropsOp, context: &mut Context<'_>) -> Vec<GripPair> {
    let limbs = context.limbs;
    let mut pairs = Vec::with_capacity(op.grips.len());
    for (index, grip) in op.grips.iter().enumerate() {
        let (lead, follows) = match grip.dominant {
            GripHand::RightHand => (Limb::RightArm, Limb::LeftArm),
            GripHand::LeftHand => (Limb::LeftArm, Limb::RightArm),
        };
        let find = |limb: Limb| limbs.iter().position(|pair| pair.limb == limb);
        let (Some(lead), Some(follows)) = (find(lead), find(follows)) else {
            context.refuse(
                &format!("grips/{index}"),
                "a grip needs both arms on both rigs; name them in roles".to_owned(),
            );
            continue;
        };
        let names = op.scope.mask.as_ref();
        let limb = limbs[follows].limb;
        if names.is_none_or(|names| names.iter().any(|name| name == limb.name() || name == limb.contact_points()[0])) {
            let scale = grip.scale.unwrap_or_else(|| hand_ratio(context));
            pairs.push(GripPair { lead, follows, scale, within: grip.within });
        }
    }
    pairs
}

/// The hand of both rigs that is nearest to a source joint at the first frame.
fn nearest_hand(joint: usize, context: &Context<'_>) -> Option<(usize, usize)> {
    let skeleton = context.source.skeleton();
    let pose = context.clip.local_pose(skeleton, 0).to_model(skeleton);
    let place = |joint: usize| pose.transforms()[joint].translation;
    let hands = ["left_hand", "right_hand"]
        .into_iter()
        .filter_map(|role| Some((*context.target.role(role).first()?, *context.source.role(role).first()?)));
    let distance = |hand: &(usize, usize)| place(hand.1).distance(place(joint));
    hands.min_by(|first, second| distance(first).total_cmp(&distance(second)))
}

/// How much larger the target's hands are, in plan units: from the wrist to the knuckle; where hands have no fingers, by the
/// forearms.
fn hand_ratio(context: &Context<'_>) -> f64 {
    let size = |rig: &Rig<'_>, side: &str, from: &str, to: &str| {
        let first = |part: &str| rig.role(&format!("{side}{part}")).first().copied();
        let place = |joint: usize| rig.rest.transforms()[joint].translation;
        let length = place(first(from)?).distance(place(first(to)?));
        (length > 0.0).then_some(length)
    };
    let unit = context.mapping.plan_from_source.scale.x;
    let ratio = |side: &str| {
        let bones = FINGERS.iter().map(|finger| ("hand", *finger)).chain([("forearm", "hand")]);
        bones.into_iter().find_map(|(from, to)| {
            let source = size(context.source, side, from, to)?;
            Some(size(context.target, side, from, to)? / (source * unit))
        })
    };
    let ratios: Vec<f64> = ["left_", "right_"].into_iter().filter_map(ratio).collect();
    if ratios.is_empty() { context.mapping.global_scale } else { ratios.iter().sum::<f64>() / ratios.len() as f64 }
}
