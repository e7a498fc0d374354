//! One retarget of the matrix, measured.

use glam::{DMat4, DQuat};
use retargetd::{
    model::{Clip, Control, Reporter, Transform},
    retarget::{Mapping, Plan, Resolved, RetargetSpec, resolve, run},
    rig::Rig,
};

use super::{
    super::figure::{degrees_between, percentile, position, rotations, world},
    bipeds::Biped,
};

/// Parts whose direction is compared, with the roles that their ends may have.
pub(super) const LIMBS: [(&str, &[&str]); 6] = [
    ("spine", &["neck", "head"]),
    ("neck", &["head"]),
    ("upper_arm", &["forearm"]),
    ("forearm", &["hand"]),
    ("thigh", &["shin"]),
    ("shin", &["foot"]),
];
/// Segments of the target that must keep their length, joint to joint, whatever the nodes between them.
const SEGMENTS: [(&str, &str); 9] = [
    ("pelvis", "thigh"),
    ("thigh", "shin"),
    ("shin", "foot"),
    ("foot", "toe"),
    ("clavicle", "upper_arm"),
    ("upper_arm", "forearm"),
    ("forearm", "hand"),
    ("hand", "middle"),
    ("hand", "thumb"),
];

/// What is allowed.
pub(super) const MAX_DIRECTION_DEGREES: f64 = 5.0;
pub(super) const MAX_TWIST_DEGREES: f64 = 10.0;
/// A joint of the trunk that is bent further than this beyond all bends of the source's trunk shows as a kink.
pub(super) const MAX_KINK_DEGREES: f64 = 20.0;
pub(super) const MAX_LENGTH_DRIFT: f64 = 1e-3;
pub(super) const MAX_OFF_THE_GROUND: f64 = 0.10;
/// Feet closer to the origin than this share of the pelvis height stand on it.
const STANDS_ON_ORIGIN: f64 = 0.15;

/// One pair.
pub(super) struct Row {
    pub(super) source: String,
    pub(super) target: String,
    pub(super) result: Result<Measured, String>,
    pub(super) warnings: Vec<&'static str>,
}

/// Figures of a pair; nothing where a side has no such part.
pub(super) struct Measured {
    /// 95th percentile of the direction error of each of [`LIMBS`], the worse side, in degrees.
    pub(super) directions: [Option<f64>; LIMBS.len()],
    /// 95th percentile of how far the turn of the hands from the aligned rest differs from the source's, in degrees.
    pub(super) hands: Option<f64>,
    /// The same of the feet.
    pub(super) feet: Option<f64>,
    /// The largest bend of one joint of spine, neck and head from the target's own rest pose, beyond the sum of the source's, in degrees.
    pub(super) kink: Option<f64>,
    /// Largest change of a segment's length, as a share of the leg.
    pub(super) length_drift: f64,
    /// The end of that segment.
    pub(super) longest_drift: String,
    /// How much lower or higher the lowest joint of the feet comes than at rest, as a share of the leg, beyond the source's own.
    pub(super) ground: Option<f64>,
}

impl Measured {
    /// What is beyond a limit.
    pub(super) fn excesses(&self) -> Vec<String> {
        let limbs = LIMBS.iter().map(|limb| limb.0).zip(self.directions);
        let mut checks: Vec<(&str, Option<f64>, f64)> =
            limbs.map(|(limb, degrees)| (limb, degrees, MAX_DIRECTION_DEGREES)).collect();
        checks.push(("hands", self.hands, MAX_TWIST_DEGREES));
        checks.push(("feet", self.feet, MAX_TWIST_DEGREES));
        checks.push(("kink", self.kink.map(|degrees| degrees.max(0.0)), MAX_KINK_DEGREES));
        checks.push(("length", Some(self.length_drift), MAX_LENGTH_DRIFT));
        checks.push(("ground", self.ground, MAX_OFF_THE_GROUND));
        let is_beyond = |value: f64, most: f64| value.is_nan() || value.abs() > most;
        let beyond = |check: &&(&str, Option<f64>, f64)| check.1.is_some_and(|value| is_beyond(value, check.2));
        let mut excesses: Vec<String> = checks.iter().filter(beyond).map(|check| check.0.to_owned()).collect();
        // Rigs without hands have no forearm to measure, but no biped is without arms and legs.
        let [_, _, upper_arm, forearm, thigh, shin] = self.directions;
        if upper_arm.or(forearm).is_none() || thigh.or(shin).is_none() {
            excesses.push("incomplete".to_owned());
        }
        excesses
    }
}

impl Row {
    pub(super) fn of(source: &Biped<'_>, target: &Biped<'_>) -> Self {
        let mut reporter = Reporter::new();
        let result = measure(source, target, &mut reporter);
        let own = reporter.warnings().iter().map(|warning| warning.code);
        let mut warnings: Vec<&'static str> = own.chain(source.warnings.iter().copied()).collect();
        warnings.extend(&target.warnings);
        warnings.sort_unstable();
        warnings.dedup();
        Self { source: source.name.to_owned(), target: target.name.to_owned(), result, warnings }
    }

    /// Whether everything is as it must be.
    pub(super) fn is_within(&self) -> bool {
        self.result.as_ref().is_ok_and(|measured| measured.excesses().is_empty())
    }
}

fn measure(source: &Biped<'_>, target: &Biped<'_>, reporter: &mut Reporter) -> Result<Measured, String> {
    let clip = source.clip.as_ref().expect("sources move");
    let resolved = resolve(&RetargetSpec::default(), &source.rig, &target.rig, clip, reporter);
    let Resolved { mapping, .. } = resolved.map_err(|error| error.to_string())?;
    let plan = Plan::new(source.rig.skeleton(), target.rig.skeleton(), &mapping);
    let result = run(&plan, clip, &Control::new()).map_err(|error| error.to_string())?;
    let poses = |biped: &Biped<'_>, clip: &Clip| -> Vec<Pose> {
        let frames = 0..clip.frame_count();
        frames.map(|frame| Pose::of(&biped.scene.skeleton, clip, frame)).collect()
    };
    let pair = Pair {
        source: &source.rig,
        target: &target.rig,
        mapping: &mapping,
        source_poses: poses(source, clip),
        target_poses: poses(target, &result),
        target_rest: target.rig.rest.transforms().iter().map(|rest| rest.to_matrix()).collect(),
    };
    let (longest_drift, length_drift) = pair.length_drift();
    Ok(Measured {
        directions: LIMBS.map(|(part, ends)| pair.worse_side(|side| pair.direction(side, part, ends))),
        hands: pair.worse_side(|side| pair.turn(&format!("{side}hand"))),
        feet: pair.worse_side(|side| pair.turn(&format!("{side}foot"))),
        kink: pair.kink(),
        length_drift,
        longest_drift,
        ground: pair.ground(),
    })
}

struct Pose {
    world: Vec<DMat4>,
    rotations: Vec<DQuat>,
}

impl Pose {
    fn of(skeleton: &retargetd::model::Skeleton, clip: &Clip, frame: usize) -> Self {
        Self { world: world(skeleton, Some((clip, frame))), rotations: rotations(skeleton, clip, frame) }
    }
}

struct Pair<'a> {
    source: &'a Rig<'a>,
    target: &'a Rig<'a>,
    mapping: &'a Mapping,
    source_poses: Vec<Pose>,
    target_poses: Vec<Pose>,
    target_rest: Vec<DMat4>,
}

impl Pair<'_> {
    fn worse_side(&self, measure: impl Fn(&str) -> Option<f64>) -> Option<f64> {
        let sides = ["", "left_", "right_"].into_iter().filter_map(measure);
        sides.reduce(|worse, other| if worse.is_nan() { worse } else { worse.max(other) })
    }

    fn poses(&self) -> impl Iterator<Item = (&Pose, &Pose)> {
        self.source_poses.iter().zip(&self.target_poses)
    }

    fn direction(&self, side: &str, part: &str, ends: &[&str]) -> Option<f64> {
        let first = |rig: &Rig<'_>, part: &str| rig.role(&format!("{side}{part}")).first().copied();
        let both = |part: &str| Some((first(self.source, part)?, first(self.target, part)?));
        let (start, end) = (both(part)?, ends.iter().find_map(|end| both(end))?);
        let turn = self.mapping.target_from_source();
        // A neck keeps how it is made, so its direction differs from the source's by as much as at rest.
        let made_otherwise = if part == "neck" {
            let line = |rest: &[Transform], start: usize, end: usize| rest[end].translation - rest[start].translation;
            let source = turn * line(self.mapping.source_rest.transforms(), start.0, end.0);
            source.angle_between(line(self.mapping.target_rest.transforms(), start.1, end.1)).to_degrees()
        } else {
            0.0
        };
        let angle = |(source, target): (&Pose, &Pose)| {
            let wanted = turn * (position(&source.world, end.0) - position(&source.world, start.0));
            let found = position(&target.world, end.1) - position(&target.world, start.1);
            (wanted.angle_between(found).to_degrees() - made_otherwise).abs()
        };
        Some(percentile(self.poses().map(angle).collect(), 0.95))
    }

    /// Of both rigs' trunks: pelvis, spine, neck and head, from below.
    fn kink(&self) -> Option<f64> {
        let chain = |rig: &Rig<'_>| {
            let head = rig.role("head").iter().take(1);
            let roles = ["pelvis", "spine", "neck"].iter().flat_map(|role| rig.role(role));
            roles.chain(head).copied().collect::<Vec<usize>>()
        };
        let bends = |chain: &[usize], rest: &[Transform], rotations: &[DQuat]| {
            let bend = |pair: &[usize]| {
                let relative = |rotation: &dyn Fn(usize) -> DQuat| rotation(pair[0]).conjugate() * rotation(pair[1]);
                degrees_between(relative(&|joint| rest[joint].rotation), relative(&|joint| rotations[joint]))
            };
            chain.windows(2).map(bend).collect::<Vec<f64>>()
        };
        let (source, target) = (chain(self.source), chain(self.target));
        let beyond = |(source_pose, target_pose): (&Pose, &Pose)| {
            let of_source: f64 =
                bends(&source, self.mapping.source_rest.transforms(), &source_pose.rotations).iter().sum();
            let of_target = bends(&target, self.target.rest.transforms(), &target_pose.rotations);
            of_target.into_iter().fold(0.0, f64::max) - of_source
        };
        // Of a rest pose that is a moment of a motion nobody knows how far it is bent itself.
        let is_in_motion = [self.source, self.target].iter().any(|rig| rig.rest_source.is_in_motion());
        (source.len() > 1 && target.len() > 1 && !is_in_motion)
            .then(|| percentile(self.poses().map(beyond).collect(), 0.99))
    }

    fn turn(&self, role: &str) -> Option<f64> {
        let (from, to) = (*self.source.role(role).first()?, *self.target.role(role).first()?);
        let turn = self.mapping.target_from_source();
        let source_rest = self.mapping.source_rest.transforms()[from].rotation;
        let target_rest = self.mapping.target_rest.transforms()[to].rotation;
        let angle = |(source, target): (&Pose, &Pose)| {
            let wanted = turn * source.rotations[from] * source_rest.conjugate() * turn.conjugate();
            degrees_between(wanted, target.rotations[to] * target_rest.conjugate())
        };
        Some(percentile(self.poses().map(angle).collect(), 0.95))
    }

    fn leg(rig: &Rig<'_>, world: &[DMat4]) -> Option<f64> {
        let [thigh, shin, foot] = ["left_thigh", "left_shin", "left_foot"]
            .map(|role| rig.role(role).first().map(|&joint| position(world, joint)));
        Some(thigh?.distance(shin?) + shin?.distance(foot?))
    }

    /// The segments of the target that have both ends, with what they are called.
    fn segments(&self) -> Vec<(String, usize, usize)> {
        let first = |role: &str| self.target.role(role).first().copied();
        let has = |role: &str| !self.target.role(role).is_empty();
        let mut segments = Vec::new();
        for (side, (start, end)) in
            ["left_", "right_"].into_iter().flat_map(|side| SEGMENTS.iter().map(move |segment| (side, segment)))
        {
            // Bones of the palm move on their own, and carry the finger.
            let is_bridged = has(&format!("{side}{end}_metacarpal"));
            let start_joint = first(&format!("{side}{start}")).or_else(|| first(start));
            if let (Some(from), Some(to), false) = (start_joint, first(&format!("{side}{end}")), is_bridged) {
                segments.push((format!("{side}{end}"), from, to));
            }
        }
        let chest = self.target.role("spine").last().copied();
        for role in ["left_clavicle", "left_upper_arm", "right_clavicle", "right_upper_arm", "neck"] {
            // Arms hang from the chest where there is no clavicle between.
            let is_bridged = role.ends_with("upper_arm") && has(&role.replace("upper_arm", "clavicle"));
            if let (Some(chest), Some(end), false) = (chest, first(role), is_bridged) {
                segments.push((role.to_owned(), chest, end));
            }
        }
        segments
    }

    /// The segment whose length changes most, and by how much. The rest pose may be the bind pose, whose bones differ a little
    /// from the nodes': either length is right.
    fn length_drift(&self) -> (String, f64) {
        let Some(leg) = Self::leg(self.target, &self.target_rest) else { return (String::new(), 0.0) };
        let nodes = world(self.target.skeleton(), None);
        let driven = self.mapping.driven();
        let drift = |(role, start, end): (String, usize, usize)| {
            // Joints between that the source moves bend the segment, as it bends the source's; their bones keep their length.
            let path = self.target.skeleton().path(start, end).unwrap_or_default();
            let mut stops: Vec<usize> = path.iter().copied().skip(1).filter(|joint| driven[*joint]).collect();
            stops.retain(|joint| *joint != end);
            let stops = [vec![start], stops, vec![end]].concat();
            let length = |world: &[DMat4]| -> f64 {
                stops.windows(2).map(|pair| position(world, pair[0]).distance(position(world, pair[1]))).sum()
            };
            let (bind, node) = (length(&self.target_rest), length(&nodes));
            let change = |pose: &Pose| {
                let length = length(&pose.world);
                (length - bind).abs().min((length - node).abs()) / leg
            };
            (role, self.target_poses.iter().map(change).fold(0.0, f64::max))
        };
        let drifts = self.segments().into_iter().map(drift);
        drifts.max_by(|first, second| first.1.total_cmp(&second.1)).unwrap_or_default()
    }

    /// How much higher the figure stands than it should, beyond what the source's own clip does: dancers jump. Nothing where
    /// the target's file does not know its floor; clips whose floor is not known are put onto it.
    fn ground(&self) -> Option<f64> {
        let (target, is_known) = height_off_the_floor(self.target, &self.target_poses)?;
        let source = height_off_the_floor(self.source, &self.source_poses).filter(|(_, is_known)| *is_known);
        is_known.then(|| target - source.map_or(0.0, |(height, _)| height))
    }
}

/// How much higher the lowest ankle of a clip is than that of somebody who stands, as a share of the leg; a twentieth of the
/// frames may be lower. And whether the rest pose stands on the origin, so that the file knows its floor.
fn height_off_the_floor(rig: &Rig<'_>, poses: &[Pose]) -> Option<(f64, bool)> {
    let rest: Vec<DMat4> = rig.rest.transforms().iter().map(|rest| rest.to_matrix()).collect();
    let ankles = [*rig.role("left_foot").first()?, *rig.role("right_foot").first()?];
    let lowest = |world: &[DMat4], joints: &[usize]| {
        joints.iter().map(|&joint| position(world, joint).dot(rig.up())).fold(f64::INFINITY, f64::min)
    };
    let skeleton = rig.skeleton();
    let is_of_a_foot = |joint: &usize| ankles.iter().any(|ankle| skeleton.is_ancestor_or_self(*ankle, *joint));
    let feet: Vec<usize> = (0..skeleton.len()).filter(is_of_a_foot).collect();
    let (ankle, sole) = (lowest(&rest, &ankles), lowest(&rest, &feet));
    let pelvis = position(&rest, *rig.role("pelvis").first()?).dot(rig.up());
    let stands = sole.abs() <= STANDS_ON_ORIGIN * (pelvis - sole);
    let standing = ankle - if stands { sole.min(0.0) } else { sole };
    let low = percentile(poses.iter().map(|pose| lowest(&pose.world, &ankles)).collect(), 0.05);
    Some(((low - standing) / Pair::leg(rig, &rest)?, stands))
}
