//! What a rest file gave against what it should have given.

use glam::DVec3;
use retargetd::{
    model::{ModelPose, Reporter, Scene},
    retarget::RetargetSpec,
    rig::{PoseChoice, RestFit, Rig, RigSpec, SpecError, posed_target},
};

/// Warnings that say that something may be wrong with a rest file.
pub(super) const DOUBTS: [&str; 7] = [
    "rest_facing_guessed",
    "rest_file_incomplete",
    "rest_file_mirrored",
    "rest_file_matched_by_role",
    "rest_residual",
    "rest_roll_guessed",
    "rest_pose_chosen",
];

/// What came of one upload.
#[derive(Clone, Debug)]
pub(super) struct Uploaded {
    /// The largest angle between a limb's direction and where it should point, in degrees, and the limb.
    pub(super) limb_degrees: (f64, String),
    /// The same of the orientation of joints with a role.
    pub(super) orientation_degrees: (f64, String),
    /// How far soles are from where they should be, as a share of the leg.
    pub(super) pelvis_off: f64,
    pub(super) fit: RestFit,
    pub(super) codes: Vec<&'static str>,
}

/// The rig of a scene, with its rest file if there is one.
pub(super) fn rig_of<'a>(
    scene: &'a Scene,
    rest: Option<&Scene>,
    spec: &RigSpec,
) -> Result<(Rig<'a>, Vec<&'static str>), SpecError> {
    let mut reporter = Reporter::new();
    let rig = Rig::new("target", scene, rest, spec, &mut reporter)?;
    Ok((rig, reporter.warnings().iter().map(|warning| warning.code).collect()))
}

/// The scene as it rests without an upload.
pub(super) fn plain(scene: &Scene) -> Rig<'_> {
    rig_of(scene, None, &RigSpec::default()).expect("a rig").0
}

/// The scene's skeleton in a T or A pose, in model space.
pub(super) fn posed(scene: &Scene, to: PoseChoice) -> ModelPose {
    let rig = plain(scene);
    let posed = posed_target(None, &rig, to, RetargetSpec::default().align).expect("a pose");
    posed.pose.to_model(&scene.skeleton)
}

/// Uploads a rest file for a rig, and compares with the pose that the rig should rest in then.
pub(super) fn upload(scene: &Scene, rest: &Scene, expected: &ModelPose) -> Result<Uploaded, SpecError> {
    let (rig, codes) = rig_of(scene, Some(rest), &RigSpec::default())?;
    let fit = rig.rest_fit.clone().expect("a rest file was given");
    let pelvis = rig.role("pelvis").first().copied().unwrap_or(0);
    let leg = rig.rest.transforms()[pelvis].translation.distance(lowest(&rig));
    let pelvis_off = rig.rest.transforms()[pelvis].translation.distance(expected.transforms()[pelvis].translation);
    Ok(Uploaded {
        limb_degrees: limb_degrees(&rig, expected),
        orientation_degrees: orientation_degrees(&rig, expected),
        pelvis_off: pelvis_off / leg.max(1e-9),
        fit,
        codes,
    })
}

fn lowest(rig: &Rig<'_>) -> DVec3 {
    let places = rig.rest.transforms().iter().map(|transform| transform.translation);
    places.min_by(|one, other| one.dot(rig.up()).total_cmp(&other.dot(rig.up()))).expect("joints")
}

/// Pairs of joints that make up the limbs of a body, fingers included.
fn limbs(rig: &Rig<'_>) -> Vec<(String, usize, usize)> {
    let mut limbs = Vec::new();
    for side in ["left_", "right_"] {
        let parts = [
            ("upper_arm", "forearm"),
            ("forearm", "hand"),
            ("hand", "middle"),
            ("thigh", "shin"),
            ("shin", "foot"),
            ("foot", "toe"),
            ("clavicle", "upper_arm"),
        ];
        for (from, to) in parts {
            let first = |part: &str| rig.role(&format!("{side}{part}")).first().copied();
            limbs.extend(first(from).zip(first(to)).map(|(start, end)| (format!("{side}{from}"), start, end)));
        }
        for finger in ["thumb", "index", "middle", "ring", "pinky"] {
            let role = format!("{side}{finger}");
            limbs.extend(rig.role(&role).windows(2).map(|pair| (role.clone(), pair[0], pair[1])));
        }
    }
    for (from, to) in [("pelvis", "spine"), ("spine", "neck"), ("neck", "head")] {
        let joints = [rig.role(from), rig.role(to)].concat();
        limbs.extend(joints.windows(2).take(rig.role(from).len()).map(|pair| (from.to_owned(), pair[0], pair[1])));
    }
    limbs
}

pub(super) fn limb_degrees(rig: &Rig<'_>, expected: &ModelPose) -> (f64, String) {
    let bone = |pose: &ModelPose, from: usize, to: usize| {
        pose.transforms()[to].translation - pose.transforms()[from].translation
    };
    let size =
        expected.transforms().iter().map(|joint| joint.translation.distance(expected.transforms()[0].translation));
    // Two joints on one spot have no direction.
    let shortest = 2e-3 * size.fold(0.0, f64::max);
    let off = |(role, from, to): (String, usize, usize)| {
        let (found, wanted) = (bone(&rig.rest, from, to), bone(expected, from, to));
        (wanted.length() > shortest).then(|| (found.angle_between(wanted).to_degrees(), role))
    };
    largest(limbs(rig).into_iter().filter_map(off))
}

fn orientation_degrees(rig: &Rig<'_>, expected: &ModelPose) -> (f64, String) {
    let off = |(role, joint): (&String, usize)| {
        let (found, wanted) = (rig.rest.transforms()[joint].rotation, expected.transforms()[joint].rotation);
        (found.angle_between(wanted).to_degrees(), role.clone())
    };
    let joints = rig.roles.iter().filter(|(role, _)| *role != "root");
    largest(joints.flat_map(|(role, joints)| joints.iter().map(move |joint| (role, *joint))).map(off))
}

fn largest(values: impl Iterator<Item = (f64, String)>) -> (f64, String) {
    values.fold((0.0, String::new()), |worst, value| if value.0 > worst.0 { value } else { worst })
}
