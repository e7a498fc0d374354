//! Arms and legs: which joint of a side is which segment.
//!
//! Names say what a joint may be, the hierarchy says which of its meanings holds: the joint that the elbow hangs from is
//! the upper arm, whether it is called `LeftArm` (Mixamo) or `LeftShoulder` (Xsens, SMPL).

use super::{
    Part, Role, Side,
    body::Body,
    finding::{Findings, sure},
    lexicon::Sense,
};

/// Limbs of a side from which on a body is none that we know (a spider).
const TOO_MANY_LIMBS: usize = 3;

/// A joint for a segment, with how sure it is and why.
struct Choice {
    joint: usize,
    confidence: f64,
    reason: &'static str,
}

impl Choice {
    fn named(joint: usize) -> Self {
        Self { joint, confidence: sure::NAMED, reason: "its name says so" }
    }

    fn decided(joint: usize, reason: &'static str) -> Self {
        Self { joint, confidence: sure::DECIDED, reason }
    }

    fn misplaced(joint: usize, reason: &'static str) -> Self {
        Self { joint, confidence: sure::MISPLACED, reason }
    }
}

/// Finds clavicle, upper arm, forearm and hand of one side.
pub(super) fn find_arm(body: &Body<'_>, side: Side, findings: &mut Findings) {
    let of = |senses: &[Sense]| body.candidates(Some(side), senses);
    let (uppers, arms, shoulders) = (of(&[Sense::UpperArm]), of(&[Sense::Arm]), of(&[Sense::Shoulder]));
    let (clavicles, hands, palms) = (of(&[Sense::Clavicle]), of(&[Sense::Wrist, Sense::Hand]), of(&[Sense::Palm]));
    let mut forearms = of(&[Sense::Forearm]);
    if forearms.is_empty() {
        // `UpperArm` with `Arm` below it.
        forearms = arms.iter().copied().filter(|arm| !body.above(&uppers, *arm).is_empty()).collect();
    }
    let forearm_tops = body.topmost(&forearms);
    if body.topmost(&uppers).len() >= TOO_MANY_LIMBS || forearm_tops.len() >= TOO_MANY_LIMBS {
        return;
    }
    let forearm = findings.declared_first(side, Part::Forearm).or_else(|| {
        let score = |joint: usize| {
            let held = [&uppers, &arms, &shoulders].iter().any(|above| !body.above(above, joint).is_empty());
            usize::from(held) * 2 + usize::from(!body.below(&hands, joint).is_empty())
        };
        best_of(&forearm_tops, score)
    });
    let upper = findings
        .declared_first(side, Part::UpperArm)
        .map(Choice::named)
        .or_else(|| choose_upper_arm(body, forearm, &uppers, &arms, &shoulders));
    let arm_end = forearm.or(upper.as_ref().map(|choice| choice.joint));
    let hand = findings.declared_first(side, Part::Hand).map(Choice::named).or_else(|| {
        let below = arm_end.map_or_else(|| hands.clone(), |end| body.below(&hands, end));
        let palm_below = arm_end.map(|end| body.topmost(&body.below(&palms, end))).unwrap_or_default();
        match (below.first(), palm_below.as_slice(), hands.first()) {
            (Some(hand), _, _) => Some(Choice::named(*hand)),
            (None, [palm], _) => Some(Choice::decided(*palm, "the only palm at the end of the arm")),
            (None, _, Some(hand)) => Some(Choice::misplaced(*hand, "named so, but not below the forearm")),
            (None, _, None) => None,
        }
    });
    let clavicle = findings.declared_first(side, Part::Clavicle).map(Choice::named).or_else(|| {
        choose_clavicle(body, upper.as_ref().map(|choice| choice.joint).or(forearm)?, &clavicles, &shoulders)
    });

    let hand_joint = hand.as_ref().map(|choice| choice.joint);
    let family = [Sense::UpperArm, Sense::Arm, Sense::Shoulder];
    if let Some(choice) = clavicle {
        assign(findings, side, Part::Clavicle, &[choice.joint], &choice);
    }
    if let Some(choice) = upper {
        let joints = segment(body, choice.joint, forearm, &family);
        assign(findings, side, Part::UpperArm, &joints, &choice);
    }
    if let Some(joint) = forearm {
        let joints = segment(body, joint, hand_joint, &[Sense::Forearm]);
        assign(findings, side, Part::Forearm, &joints, &Choice::named(joint));
        findings.offer(Role::new(side, Part::Forearm), &forearm_tops);
    }
    if let Some(choice) = hand {
        assign(findings, side, Part::Hand, &[choice.joint], &choice);
        findings.offer(Role::new(side, Part::Hand), &hands);
    }
}

fn choose_upper_arm(
    body: &Body<'_>,
    forearm: Option<usize>,
    uppers: &[usize],
    arms: &[usize],
    shoulders: &[usize],
) -> Option<Choice> {
    let Some(forearm) = forearm else {
        let only = body.topmost(if uppers.is_empty() { arms } else { uppers });
        return only.first().map(|joint| Choice { confidence: 0.6, ..Choice::named(*joint) });
    };
    let above = |joints: &[usize]| body.above(joints, forearm).into_iter().find(|joint| *joint != forearm);
    let named = above(uppers).map(Choice::named);
    named
        .or_else(|| above(arms).map(|joint| Choice::decided(joint, "an arm joint with the elbow below it")))
        .or_else(|| above(shoulders).map(|joint| Choice::decided(joint, "a shoulder joint with the elbow below it")))
        .or_else(|| uppers.first().map(|joint| Choice::misplaced(*joint, "named so, but not above the forearm")))
}

fn choose_clavicle(body: &Body<'_>, upper: usize, clavicles: &[usize], shoulders: &[usize]) -> Option<Choice> {
    let above = |joints: &[usize]| body.above(joints, upper).last().copied();
    let first_above = |joints: &[usize]| body.above(joints, upper).first().copied();
    let apart =
        |joints: &[usize]| joints.iter().copied().find(|joint| *joint != upper && !body.is_below(*joint, upper));
    first_above(clavicles)
        .map(Choice::named)
        .or_else(|| {
            above(shoulders).map(|joint| Choice::decided(joint, "a shoulder joint with the upper arm below it"))
        })
        .or_else(|| apart(clavicles).map(|joint| Choice::misplaced(joint, "named so, but not above the upper arm")))
        .or_else(|| apart(shoulders).map(|joint| Choice::misplaced(joint, "named so, but not above the upper arm")))
}

/// Finds thigh, shin, foot and toe of one side.
pub(super) fn find_leg(body: &Body<'_>, side: Side, findings: &mut Findings) {
    let of = |senses: &[Sense]| body.candidates(Some(side), senses);
    let (thighs, hips, legs) = (of(&[Sense::Thigh]), of(&[Sense::Hip]), of(&[Sense::Leg]));
    let (ankles, feet, toes) = (of(&[Sense::Ankle]), of(&[Sense::Foot]), of(&[Sense::Toe]));
    let shins = of(&[Sense::Shin]);
    if [&thighs, &legs, &shins].iter().any(|joints| body.topmost(joints).len() >= TOO_MANY_LIMBS) {
        return;
    }
    let shin = findings.declared_first(side, Part::Shin).map(Choice::named).or_else(|| {
        let score = |joint: usize| {
            let held = [&thighs, &hips, &legs].iter().any(|above| !body.above(above, joint).is_empty());
            let carries = [&ankles, &feet].iter().any(|below| !body.below(below, joint).is_empty());
            usize::from(held) * 2 + usize::from(carries)
        };
        best_of(&body.topmost(&shins), score).map(Choice::named).or_else(|| {
            // `LeftUpLeg` or `LeftHip` with `LeftLeg` below it, or two `Leg` joints in a row.
            let held = |leg: &&usize| [&thighs, &hips, &legs].iter().any(|above| !body.above(above, **leg).is_empty());
            legs.iter().find(held).map(|leg| Choice::decided(*leg, "a leg joint with a thigh above it"))
        })
    });
    let shin_joint = shin.as_ref().map(|choice| choice.joint);
    let thigh = findings.declared_first(side, Part::Thigh).map(Choice::named).or_else(|| {
        let above = |joints: &[usize]| shin_joint.map(|shin| body.above(joints, shin)).unwrap_or_default();
        let named = above(&thighs).first().copied().map(Choice::named);
        named
            .or_else(|| above(&legs).first().map(|leg| Choice::decided(*leg, "a leg joint with the knee below it")))
            .or_else(|| above(&hips).last().map(|hip| Choice::decided(*hip, "a hip joint with the knee below it")))
            .or_else(|| {
                let reason = "named so, but with no shin below it";
                thighs.first().map(|thigh| Choice::misplaced(*thigh, reason))
            })
    });
    let leg_end = shin_joint.or(thigh.as_ref().map(|choice| choice.joint));
    let foot = findings.declared_first(side, Part::Foot).map(Choice::named).or_else(|| {
        let end = leg_end?;
        let below = |joints: &[usize]| body.below(joints, end).first().copied();
        let apart = |joints: &[usize]| body.topmost(joints).first().copied();
        below(&ankles)
            .or_else(|| below(&feet))
            .map(Choice::named)
            .or_else(|| apart(&feet).map(|foot| Choice::misplaced(foot, "named so, but not below the shin")))
    });
    let foot_joint = foot.as_ref().map(|choice| choice.joint);
    let toe = findings
        .declared_first(side, Part::Toe)
        .map(Choice::named)
        .or_else(|| choose_toe(body, foot_joint?, &toes, &feet));

    if let Some(choice) = thigh {
        let joints = segment(body, choice.joint, shin_joint, &[Sense::Thigh, Sense::Hip]);
        assign(findings, side, Part::Thigh, &joints, &choice);
    }
    if let Some(choice) = shin {
        let joints = segment(body, choice.joint, foot_joint, &[Sense::Shin, Sense::Leg]);
        assign(findings, side, Part::Shin, &joints, &choice);
    }
    if let Some(choice) = foot {
        assign(findings, side, Part::Foot, &[choice.joint], &choice);
    }
    if let Some(choice) = toe {
        assign(findings, side, Part::Toe, &[choice.joint], &choice);
    }
}

/// The joint at the ball of the foot. A foot with single toes has none.
fn choose_toe(body: &Body<'_>, foot: usize, toes: &[usize], feet: &[usize]) -> Option<Choice> {
    let below = body.topmost(&body.below(toes, foot));
    let base: Vec<usize> = below
        .iter()
        .copied()
        .filter(|toe| ["base", "ball", "toes"].iter().any(|word| body.names[*toe].has(word)))
        .collect();
    match (below.as_slice(), base.as_slice()) {
        ([toe], _) | (_, [toe]) => Some(Choice::named(*toe)),
        // SMPL: the joint below the ankle is called the foot.
        ([], _) if body.means(foot, &[Sense::Ankle]) => {
            body.below(feet, foot).first().map(|toe| Choice::decided(*toe, "a foot joint below the ankle"))
        }
        _ => None,
    }
}

/// A segment and what splits it: joints on the way to the next segment that are named alike or carry its twist. Where
/// there is no next segment, joints below that are named alike.
fn segment(body: &Body<'_>, first: usize, next: Option<usize>, alike: &[Sense]) -> Vec<usize> {
    let end = next.filter(|next| body.is_below(*next, first)).or_else(|| {
        let below = body.candidates(body.names[first].side, alike);
        body.below(&below, first).last().copied().filter(|_| next.is_none())
    });
    let Some(path) = end.and_then(|end| body.path(first, end)) else { return vec![first] };
    let belongs = |joint: &usize| {
        *joint == first || (Some(*joint) != next && (body.means(*joint, alike) || body.names[*joint].is_twist))
    };
    path.into_iter().filter(belongs).collect()
}

fn assign(findings: &mut Findings, side: Side, part: Part, joints: &[usize], choice: &Choice) {
    findings.assign(Role::new(side, part), joints, choice.confidence, choice.reason);
}

/// The first of those with the highest score.
fn best_of(joints: &[usize], score: impl Fn(usize) -> usize) -> Option<usize> {
    joints.iter().rev().copied().max_by_key(|joint| score(*joint))
}
