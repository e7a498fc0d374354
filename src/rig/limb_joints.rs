//! The joints of a limb, and what lies below its foot at rest.

use super::{
    anatomy::{is_carried, rides},
    floor::Stance,
    limb::{Limb, LimbJoints, Sole},
    rig::Rig,
};

/// What makes a limb of a leg: its start, middle, shin and end, and the first joint beyond the end where there is one.
pub(crate) struct LegJoints {
    pub(crate) chain: [usize; 4],
    pub(crate) beyond: Option<usize>,
}

/// The joints of a limb of which every bone has a role.
pub(crate) fn by_roles(roles: [&str; 4], side: &Rig<'_>) -> Option<LegJoints> {
    let [start, middle, end, beyond] = roles.map(|role| side.role(role).first().copied());
    Some(LegJoints { chain: [start?, middle?, middle?, end?], beyond })
}

/// The left leg of a rig, for tests of what is found out about it.
#[cfg(test)]
pub(crate) fn leg_of(side: &Rig<'_>) -> Option<LimbJoints> {
    limb_joints(Limb::LeftLeg, &by_roles(Limb::LeftLeg.roles()?, side)?, side, 1.0)
}

/// `unit` is plan units per unit of that side.
pub(crate) fn limb_joints(limb: Limb, joints: &LegJoints, side: &Rig<'_>, unit: f64) -> Option<LimbJoints> {
    let rides = &rides(side);
    let LegJoints { chain: [start, middle, shin, end], beyond } = *joints;
    let place = |joint: usize| side.rest.transforms()[joint].translation;
    let has_length = |from: usize, to: usize| place(from).distance(place(to)) > 0.0;
    let skeleton = side.skeleton();
    let is_chained = is_carried(skeleton, rides, middle, start) && is_carried(skeleton, rides, end, middle);
    let ball = beyond.filter(|ball| limb.is_leg() && is_carried(skeleton, rides, *ball, end));
    let tip = ball.and_then(|ball| {
        let below = (ball + 1..skeleton.len()).filter(|&joint| skeleton.is_ancestor_or_self(ball, joint));
        below.max_by(|first, second| {
            place(*first).distance(place(ball)).total_cmp(&place(*second).distance(place(ball)))
        })
    });
    let is_limb = is_chained && has_length(start, middle) && has_length(middle, end);
    let sole = side.role("pelvis").first().filter(|_| limb.is_leg()).map(|&pelvis| {
        let floor = Stance::of(side, pelvis).floor;
        let above = |joint: usize| (side.rest_height(joint) - floor) * unit;
        let bone = |from: usize, to: usize| {
            side.rest.transforms()[from].rotation.conjugate() * (place(to) - place(from)) * unit
        };
        let down = |joint: usize| side.rest.transforms()[joint].rotation.conjugate() * -side.up();
        Sole {
            heel: above(end),
            ball: ball.map(above),
            tip: tip.map(above),
            down: [Some(end), ball, tip].map(|joint| joint.map(down)),
            end_to_ball: ball.map(|ball| bone(end, ball)),
            ball_to_tip: ball.zip(tip).map(|(ball, tip)| bone(ball, tip)),
        }
    });
    is_limb.then_some(LimbJoints { start, middle, shin, end, ball, tip, sole })
}
