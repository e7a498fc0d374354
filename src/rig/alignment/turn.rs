//! The turning itself: parents before children, and what is left over.

use glam::{DQuat, DVec3};

use crate::model::{ModelPose, Transform, rotation::twist_angle};

use super::{
    super::{
        anatomy::{Ride, by_joint, order_after, rides},
        rig::Rig,
        spec::Align,
    },
    AlignedJoint, Alignment, HowAligned,
    arc::arc,
    curve::bowed,
    rules::{Aim, Roll, Wish},
    stand::regrounded,
};

/// Turns the joints of a rig's rest pose to what is wished of them. With alignment off nothing is turned, only compared.
pub(super) fn turn(target: &Rig<'_>, wishes: &[Option<Wish>], mode: Align) -> Alignment {
    let skeleton = target.skeleton();
    let rest = target.rest.transforms();
    // A shoulder that hangs from the neck goes with it: a rest pose is turned, and has its joints nowhere else than the file.
    let rides: Vec<Ride> = rides(target).into_iter().filter(|ride| ride.hangs_apart(skeleton)).collect();
    let rides = by_joint(rest.len(), &rides);
    let order = order_after(rest.len(), |joint| {
        let of_wish = wishes[joint].as_ref().and_then(|wish| wish.aim.goes_by());
        [skeleton.parent(joint), rides[joint].map(|ride| ride.on), of_wish]
    });
    let mut turned = vec![Transform::IDENTITY; rest.len()];
    // model_from_model: how far each joint's orientation has been turned from its own.
    let mut turns = vec![DQuat::IDENTITY; rest.len()];
    let mut joints = Vec::new();
    for joint in order {
        let (parent, ride, wish) = (skeleton.parent(joint), rides[joint], &wishes[joint]);
        let carried = ride.map(|ride| ride.on).or(parent).map_or(DQuat::IDENTITY, |above| turns[above]);
        let own_turn = match wish {
            _ if mode == Align::Off => DQuat::IDENTITY,
            None => carried,
            Some(wish) => match wish.aim {
                Aim::Turn(turn) | Aim::Face { turn, .. } => turn,
                Aim::Head { own, wanted } => arc(own, wanted, target.up()),
                Aim::Further(turn) => turn * carried,
                Aim::Follow { first, .. } => turns[first],
                Aim::Point { own, wanted, pole } => pointed(wish, (own, wanted), pole, carried, mode),
                Aim::Bent { own, wanted, pole } => {
                    pointed(wish, (own, bowed(carried * own, wanted)), pole, carried, mode)
                }
                Aim::Shared { own, wanted, pole, base, share, .. } => {
                    let carried = base.map_or(DQuat::IDENTITY, |base| turns[base]);
                    let whole = pointed(wish, (own, wanted), pole, carried, mode);
                    let twist = twist_angle(whole * carried.conjugate(), wanted);
                    DQuat::from_axis_angle(wanted, (share - 1.0) * twist) * whole
                }
                Aim::Between(turn) => {
                    let beyond = twist_angle(carried * turn.conjugate(), target.up());
                    DQuat::from_axis_angle(target.up(), beyond / 2.0) * turn
                }
            },
        };
        if let Some(wish) = wish.as_ref().filter(|wish| !matches!(wish.aim, Aim::Follow { bone: None, .. })) {
            joints.push(left_over(wish, joint, own_turn, mode));
        }
        let local = &target.rest_local.transforms()[joint];
        let mut transform = parent.map_or(*local, |parent| turned[parent].then_child(local));
        transform.rotation = (own_turn * rest[joint].rotation).normalize();
        if let Some(ride) = ride {
            transform.translation = turned[ride.on].transform_point(ride.on_from_joint.translation);
        }
        turned[joint] = transform;
        turns[joint] = own_turn;
    }
    if mode == Align::Off {
        return Alignment { rest: target.rest.clone(), joints };
    }
    Alignment { rest: regrounded(target, ModelPose::new(turned)), joints }
}

/// Carried along, then pointed from one direction to another, then rolled.
fn pointed(wish: &Wish, (own, wanted): (DVec3, DVec3), pole: DVec3, carried: DQuat, mode: Align) -> DQuat {
    let pointed = arc(carried * own, wanted, pole) * carried;
    let roll = wish.roll.filter(|_| mode != Align::Direction);
    let degrees = roll.map_or(0.0, |roll| roll_to_make(&roll, pointed, wanted, pole, mode));
    DQuat::from_axis_angle(wanted, degrees.to_radians()) * pointed
}

/// By how many degrees a joint is rolled that has been pointed already.
fn roll_to_make(roll: &Roll, pointed: DQuat, wanted: DVec3, pole: DVec3, mode: Align) -> f64 {
    let degrees = match roll.of_part_below {
        None => roll_degrees(roll, pointed, wanted),
        Some((own_below, wanted_below)) => {
            let below = arc(pointed * own_below, wanted_below, pole) * pointed;
            roll_degrees(roll, below, wanted_below)
        }
    };
    let degrees = degrees.unwrap_or(0.0);
    if mode == Align::Auto && degrees.abs() <= roll.uncertainty_degrees {
        0.0
    } else if roll.of_part_below.is_some() {
        degrees / 2.0
    } else {
        degrees
    }
}

/// The angle about `along` from where a joint's second direction has come to where it is wanted, −180° to 180°.
fn roll_degrees(roll: &Roll, turn: DQuat, along: DVec3) -> Option<f64> {
    let square = |vector: DVec3| (vector - along * vector.dot(along)).try_normalize();
    let (own, wanted) = (square(turn * roll.own)?, square(roll.wanted)?);
    let degrees = own.cross(wanted).dot(along).atan2(own.dot(wanted)).to_degrees();
    let is_signed = roll.cues.0.is_signed() && roll.cues.1.is_signed();
    // An axis without a sign is never further away than a right angle.
    let half_turns = if is_signed { 0.0 } else { (degrees / 180.0).round() };
    Some(degrees - half_turns * 180.0)
}

/// What is left between a joint and what was wished of it.
fn left_over(wish: &Wish, joint: usize, turn: DQuat, mode: Align) -> AlignedJoint {
    let (how, directions) = match wish.aim {
        Aim::Point { own, wanted, .. } | Aim::Bent { own, wanted, .. } => {
            let has_roll = wish.roll.is_some_and(|roll| roll.of_part_below.is_none());
            let how = if has_roll && mode != Align::Direction { HowAligned::Full } else { HowAligned::Direction };
            (how, Some((own, wanted)))
        }
        Aim::Head { own, wanted } => (HowAligned::Heading, Some((own, wanted))),
        Aim::Follow { bone, .. } | Aim::Shared { bone, .. } => (HowAligned::Whole, bone),
        Aim::Turn(_) | Aim::Between(_) => (HowAligned::Kept, None),
        Aim::Further(_) => (HowAligned::Sloped, None),
        Aim::Face { own, wanted, how, .. } => (how, Some((own, wanted))),
    };
    // Joints that share a twist are not to have all of it.
    let has_all = !matches!(wish.aim, Aim::Shared { share, .. } if share < 1.0);
    let roll = wish.roll.filter(|roll| roll.of_part_below.is_none() && has_all).zip(directions);
    AlignedJoint {
        name: wish.name.clone(),
        joint,
        how: if mode == Align::Off { HowAligned::Off } else { how },
        roll_from: roll.map(|(roll, _)| roll.cues),
        turned_degrees: (2.0 * turn.xyz().length().atan2(turn.w.abs())).to_degrees(),
        direction_degrees: directions.map(|(own, wanted)| (turn * own).angle_between(wanted).to_degrees()),
        roll_degrees: roll.and_then(|(roll, (_, wanted))| roll_degrees(&roll, turn, wanted)),
    }
}
