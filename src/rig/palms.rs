//! Where a hand is, from the wrist to the middle of it, and how thick: what two hands touch each other with. (docs/algorithm/body.md.)

use glam::{DVec2, DVec3};

use super::{
    limb::Limb,
    rig::Rig,
    rig_memory::Question,
    volumes::{Body, Capsule, share_of},
};

/// How thick a hand usually is, from its middle: the share of the way from the wrist to the knuckles, and where those are not known, in legs.
const THICKNESS: f64 = 0.2;
const THICKNESS_LEGS: f64 = 0.025;
/// A mesh that says it is thinner or thicker by more than these factors is something else.
const MAX_THINNER: f64 = 2.5;
const MAX_THICKER: f64 = 10.0;
/// How far its middle is from the wrist: the share of the way to the knuckles, and where those are not known, in legs.
const TO_KNUCKLES: f64 = 0.8;
const FROM_WRIST_LEGS: f64 = 0.09;
/// What is farther from the wrist than this many times the way to the knuckles is no palm.
const BEYOND_KNUCKLES: f64 = 1.2;
/// Fewer points of a mesh do not say how thick a hand is.
const FEW_POINTS: usize = 12;
/// Share of the points that lie within the thickness.
const WITHIN: f64 = 0.8;

/// Where is its palm, and how thick is it?
#[derive(PartialEq)]
struct WhereItsPalmIs {
    arm: Limb,
}

impl Question for WhereItsPalmIs {
    type Answer = Option<Capsule>;
}

/// From the wrist to the middle of a hand, as thick as the hand, in the scene's unit; nothing for what is no arm, and for figures without legs,
/// whose length says how large hands usually are.
///
/// As thick as the mesh of the hand's joint where there is one: across the flat side, which is the one on which its points are spread least.
pub(crate) fn palm(side: &Rig<'_>, arm: Limb) -> Option<Capsule> {
    side.recall(WhereItsPalmIs { arm }, |_| find_palm(side, arm))
}

fn find_palm(side: &Rig<'_>, arm: Limb) -> Option<Capsule> {
    let prefix = arm.side_of_arm()?;
    let body = Body::of(side, 1.0)?;
    let (elbow, joint) = (body.place(&format!("{prefix}forearm"))?, body.first(&format!("{prefix}hand"))?);
    let wrist = body.at(joint);
    let knuckles = body.place(&format!("{prefix}middle"));
    let along = (knuckles.unwrap_or(wrist * 2.0 - elbow) - wrist).try_normalize()?;
    let most = knuckles.map_or(f64::INFINITY, |knuckles| BEYOND_KNUCKLES * knuckles.distance(wrist));
    let is_of_palm = |point: &DVec3| (0.0..=most).contains(&(*point - wrist).dot(along));
    let points: Vec<DVec3> = body.mesh_points(&[joint]).filter(is_of_palm).collect();
    let has_mesh = points.len() >= FEW_POINTS;
    let center = match knuckles {
        Some(knuckles) => wrist + (knuckles - wrist) * TO_KNUCKLES,
        None if has_mesh => points.iter().sum::<DVec3>() / points.len() as f64,
        None => wrist + along * (FROM_WRIST_LEGS * body.leg),
    };
    let usual = knuckles.map_or(THICKNESS_LEGS * body.leg, |knuckles| THICKNESS * knuckles.distance(wrist));
    let radius = if has_mesh { thickness(&points, along) } else { usual };
    let radius = radius.clamp(usual / MAX_THINNER, usual * MAX_THICKER);
    Some(Capsule { start: body.anchor(joint, wrist), end: body.anchor(joint, center), radius })
}

/// Half of how far points are spread across a direction, where that is least.
fn thickness(points: &[DVec3], along: DVec3) -> f64 {
    let (x, y) = along.any_orthonormal_pair();
    let flat: Vec<DVec2> = points.iter().map(|point| DVec2::new(point.dot(x), point.dot(y))).collect();
    let mean = flat.iter().sum::<DVec2>() / flat.len() as f64;
    let (mut square, mut product) = (DVec2::ZERO, 0.0);
    for from_mean in flat.iter().map(|point| *point - mean) {
        square += from_mean * from_mean;
        product += from_mean.x * from_mean.y;
    }
    // The long axis of the points is at half the angle of (xx - yy, 2 xy).
    let across = DVec2::from_angle((2.0 * product).atan2(square.x - square.y) / 2.0).perp();
    let mut distances: Vec<f64> = flat.iter().map(|point| (*point - mean).dot(across).abs()).collect();
    share_of(&mut distances, WITHIN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::{Reporter, Scene, SkinPoint, SkinPoints, Transform},
        retarget::RetargetSpec,
        samples,
    };

    fn palms(scene: &Scene) -> (f64, [Capsule; 2]) {
        let spec = RetargetSpec::default();
        let rig = Rig::new("target", scene, None, &spec.target, &mut Reporter::new()).expect("a rig");
        let leg = Body::of(&rig, 1.0).expect("a body").leg;
        (leg, [Limb::LeftArm, Limb::RightArm].map(|arm| palm(&rig, arm).expect("a hand")))
    }

    #[test]
    fn a_hand_without_a_mesh_is_as_thick_as_its_length_says() {
        let scene = samples::walk_scene();
        let (_, palms) = palms(&scene);
        let place = |name: &str| {
            let joint = scene.skeleton.find(name).expect("a joint of the walker");
            scene.skeleton.rest_pose().to_model(&scene.skeleton).transforms()[joint].translation
        };
        let length = place("mixamorig:LeftHand").distance(place("mixamorig:LeftHandMiddle1"));
        for palm in palms {
            assert!((palm.radius - THICKNESS * length).abs() < 1e-4, "{} of a hand of {length}", palm.radius);
            assert!(palm.start.offset == DVec3::ZERO, "it begins at the wrist");
            assert!((palm.end.offset.length() - TO_KNUCKLES * length).abs() < 1e-4, "{}", palm.end.offset);
        }
    }

    /// A board of 12 by 8 by 3 centimeters that lies askew about the hand's axis: as thick as it is, and not as wide.
    #[test]
    fn a_hand_is_as_thick_as_its_mesh_across_the_flat_side() {
        let mut scene = samples::walk_scene();
        let joint = scene.skeleton.find("mixamorig:LeftHand").expect("a hand");
        let knuckle = scene.skeleton.find("mixamorig:LeftHandMiddle1").expect("a finger");
        let rest = scene.skeleton.rest_pose().to_model(&scene.skeleton);
        let [wrist, knuckles] = [joint, knuckle].map(|joint| rest.transforms()[joint].translation);
        let along = (knuckles - wrist).normalize();
        let (wide, thick) = along.any_orthonormal_pair();
        let (wide, thick) = (wide * 0.6 + thick * 0.8, thick * 0.6 - wide * 0.8);
        let mut entries = Vec::new();
        for step in 0..13 {
            for across in -4..=4 {
                for side in [-0.015, 0.015] {
                    let place =
                        wrist + along * (0.01 * f64::from(step)) + wide * (0.01 * f64::from(across)) + thick * side;
                    let own = rest.transforms()[joint].relative(&Transform::from_translation(place)).translation;
                    let point = SkinPoint { position: own.as_vec3(), weight: 1.0 };
                    entries.push((u32::try_from(joint).expect("few joints"), point));
                }
            }
        }
        scene.skin_points = SkinPoints::new(scene.skeleton.len(), &entries);
        let (_, [left, right]) = palms(&scene);
        assert!((left.radius - 0.015).abs() < 1e-3, "as thick as the board: {}", left.radius);
        assert!(right.radius > 0.0 && right.end.offset != DVec3::ZERO, "the other one has no mesh");
    }
}
