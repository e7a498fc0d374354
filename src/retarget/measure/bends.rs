//! Knees and elbows: do they snap over, do they bend backwards, are they bent further than a body can?

use glam::DVec3;

use super::{
    body::{first_joint, last_joint},
    limbs::angle,
    metric::{Finding, Reading},
    motion::{Both, Compared, Wanted},
};
use crate::rig::Rig;

/// Roles of the three joints, and the largest bend, degrees: 0 is straight. Of the neck it is the bend of the head on the spine.
const BENDS: [(&str, [&str; 3], f64, bool); 5] = [
    ("left_knee", ["left_thigh", "left_shin", "left_foot"], 165.0, true),
    ("right_knee", ["right_thigh", "right_shin", "right_foot"], 165.0, true),
    ("left_elbow", ["left_upper_arm", "left_forearm", "left_hand"], 160.0, true),
    ("right_elbow", ["right_upper_arm", "right_forearm", "right_hand"], 160.0, true),
    ("neck", ["spine", "neck", "head"], 90.0, false),
];
/// Below this bend, in degrees, a limb counts as straight: it has no side that it bends to.
const STRAIGHT: f64 = 10.0;
/// From this bend on a limb can be said to bend backwards.
const BENT: f64 = 15.0;
/// How clearly a limb must bend to one side over a clip for the other side to be backwards.
const HINGED: f64 = 0.5;
const NO_BENDS: &str = "no knee and no elbow was recognized on both sides";

/// What is looked at.
pub(super) struct Bends(Vec<Bend>);

struct Bend {
    name: &'static str,
    joint: usize,
    points: [usize; 3],
    turn: usize,
    most_degrees: f64,
    is_hinge: bool,
}

/// One side of one bend over the frames looked at.
struct Bent {
    degrees: Vec<f64>,
    /// Normal of the plane of the bend, model space; zero where straight.
    normals: Vec<DVec3>,
    /// Whether it bends to the side that it does not usually bend to.
    backwards: Vec<bool>,
}

impl Bends {
    pub(super) fn find(rigs: &Both<&Rig<'_>>, wanted: &mut Wanted) -> Self {
        let bend = |(name, roles, most_degrees, is_hinge): (&'static str, [&str; 3], f64, bool)| {
            let [start, middle, end] = roles.map(|role| first_joint(rigs, role));
            let (start, middle, end) = (start?, middle?, end?);
            Some(Bend {
                name,
                joint: middle.target,
                points: [start, middle, end].map(|joint| wanted.joint(joint)),
                turn: wanted.turn(last_joint(rigs, roles[0])?),
                most_degrees,
                is_hinge,
            })
        };
        Self(BENDS.into_iter().filter_map(bend).collect())
    }

    /// Flips, and excess over what a body can do.
    pub(super) fn measure(&self, compared: &Compared) -> (Finding, Finding) {
        if self.0.is_empty() {
            return (Err(NO_BENDS), Err(NO_BENDS));
        }
        let (mut flips, mut limits) = (Reading::default(), Reading { source_value: Some(0.0), ..Reading::default() });
        for bend in &self.0 {
            let (source, target) = (bend.follow(compared, false), bend.follow(compared, true));
            if bend.is_hinge {
                let frames = bend.flips(&source, &target, compared);
                let found =
                    frames.iter().map(|&frame| (compared.frames.indices[frame], bend.joint, bend.name.to_owned(), 1.0));
                flips.worst.extend(found);
                flips.parts.insert(bend.name.to_owned(), frames.len() as f64);
                flips.value += frames.len() as f64;
            }
            let excess = |degrees: &[f64]| {
                let over = degrees.iter().map(|degrees| (degrees - bend.most_degrees).max(0.0)).enumerate();
                over.filter(|(_, value)| value.is_finite()).max_by(|first, second| first.1.total_cmp(&second.1))
            };
            let Some((frame, own)) = excess(&target.degrees) else { continue };
            let of_source = excess(&source.degrees).map_or(0.0, |(_, value)| value);
            limits.parts.insert(bend.name.to_owned(), own);
            limits.worst.push((compared.frames.indices[frame], bend.joint, bend.name.to_owned(), own));
            limits.value = limits.value.max(own);
            limits.source_value = limits.source_value.map(|value| value.max(of_source));
        }
        (Ok(flips), Ok(limits))
    }
}

impl Bend {
    fn follow(&self, compared: &Compared, is_target: bool) -> Bent {
        let side = compared.side(is_target);
        let count = compared.len();
        let (mut degrees, mut normals) = (Vec::with_capacity(count), Vec::with_capacity(count));
        // The side that it bends to, as the upper limb sees it.
        let (mut usual, mut weight) = (DVec3::ZERO, 0.0);
        let mut own_normals = Vec::with_capacity(count);
        for frame in 0..count {
            let [start, middle, end] = self.points.map(|point| side.position(frame, point));
            let (upper, lower) = (middle - start, end - middle);
            let bend = angle(upper, lower);
            let normal = if bend > STRAIGHT { upper.cross(lower).normalize_or_zero() } else { DVec3::ZERO };
            let own = side.turn(frame, self.turn).conjugate() * normal;
            if bend > BENT {
                usual += own * bend;
                weight += bend;
            }
            degrees.push(bend);
            normals.push(normal);
            own_normals.push(own);
        }
        let is_hinged = weight > 0.0 && usual.length() > HINGED * weight;
        let usual = if is_hinged { usual.normalize_or_zero() } else { DVec3::ZERO };
        let backwards = own_normals.iter().zip(&degrees).map(|(own, bend)| *bend > BENT && own.dot(usual) < -0.3);
        Bent { backwards: backwards.collect(), degrees, normals }
    }

    /// Frames at which the target flips and the source does not.
    fn flips(&self, source: &Bent, target: &Bent, compared: &Compared) -> Vec<usize> {
        let mut found = Vec::new();
        for run in &compared.frames.runs {
            for frame in run.start + 1..run.end {
                let snaps = |bent: &Bent| bent.normals[frame].dot(bent.normals[frame - 1]) < 0.0;
                let near = frame.saturating_sub(2).max(run.start)..(frame + 3).min(run.end);
                let begins = target.backwards[frame] && !target.backwards[frame - 1];
                let source_bends_back = near.clone().any(|frame| source.backwards[frame]);
                if (snaps(target) && !snaps(source)) || (begins && !source_bends_back) {
                    found.push(frame);
                }
            }
        }
        // A snap that leaves the limb bent backwards is one flip.
        found.dedup_by(|later, earlier| *later - *earlier <= 1);
        found
    }
}
