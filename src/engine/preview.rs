//! What a file looks like: the figure and its motion as a picture.

use std::collections::BTreeSet;

use glam::DMat4;

use crate::{
    formats::{self, Limits},
    model::{Clip, Control, Phase, Reporter, Scene, Skeleton},
    picture::{Bone, Figure, FilmError, PictureError, PictureFormat, Subject, View, capsules, render},
    rig::{Rig, RigSpec, floors, standing_floor},
};

use super::{Failure, FailureCode, Knowledge, NamedBytes, WarningView, load::load};

/// A picture of a file.
#[derive(Clone, Debug)]
pub struct Preview {
    /// The picture, encoded.
    pub bytes: Vec<u8>,
    /// What it is encoded as.
    pub format: PictureFormat,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// How many frames it has.
    pub frames: usize,
    /// Guesses and losses.
    pub warnings: Vec<WarningView>,
}

/// What of a file is wanted as what.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PreviewOptions {
    /// How it is seen.
    pub view: View,
    /// The ending of the file that is wanted: `png`, `webp`, `gif` or `apng`.
    pub ending: String,
    /// The name of the clip; without one, the first that moves.
    pub clip: Option<String>,
}

/// Draws a file: the mesh, or where it has none, a body of capsules; in its clip, or where it has none, at rest.
///
/// # Errors
/// When the file cannot be read, holds nothing that can be seen, or the view asks for what cannot be done.
pub fn preview(
    file: NamedBytes<'_>,
    options: &PreviewOptions,
    limits: &Limits,
    control: &Control,
) -> Result<Preview, Failure> {
    if let Some((field, problem)) = options.view.problem() {
        return Err(Failure::new(FailureCode::InvalidValue, format!("{field}: {problem}")));
    }
    let mut reporter = Reporter::new();
    let loaded = load(file, "source", limits, control, &mut reporter)?;
    let shown = Shown::of(loaded.scene, options.clip.as_deref())?;
    let is_still = options.view.sheet.is_some() || options.view.at_seconds.is_some();
    let format = PictureFormat::of_ending(&options.ending, shown.clip.is_some() && !is_still).ok_or_else(|| {
        let detail = format!("'{}' is no picture that can be written", options.ending);
        Failure::new(FailureCode::UnsupportedFormat, detail).with_hint("use png, webp, gif or apng")
    })?;
    control.enter(Phase::Write, 1);
    let film = shown.film(&options.view, format, limits, control, &mut reporter)?;
    let warnings = reporter.into_warnings().into_iter().map(WarningView::from).collect();
    Ok(Preview { bytes: film.bytes, format, size: film.size, frames: film.frames, warnings })
}

/// A scene as a viewer shows it: with the nodes of its file, where those are not the joints that are retargeted.
struct Shown {
    scene: Scene,
    skeleton: Skeleton,
    clip: Option<Clip>,
}

impl Shown {
    fn of(scene: Scene, clip: Option<&str>) -> Result<Self, Failure> {
        let chosen = match clip {
            Some(name) => {
                let found = scene.clips.iter().find(|clip| clip.name() == name);
                let names = || scene.clips.iter().map(Clip::name).collect::<Vec<_>>().join(", ");
                Some(found.ok_or_else(|| {
                    Failure::new(FailureCode::UnknownName, format!("there is no clip '{name}'"))
                        .with_hint(format!("the file has: {}", names()))
                })?)
            }
            None => scene.clips.iter().find(|clip| clip.is_animated()),
        };
        let (skeleton, clip) = match &scene.stretched {
            Some(stretched) => {
                let clip = chosen.map(|clip| stretched.clip_of_nodes(&scene.skeleton, clip)).transpose();
                let clip = clip.map_err(|error| Failure::new(FailureCode::AssetMalformed, error.to_string()))?;
                (stretched.skeleton_of_nodes(&scene.skeleton), clip)
            }
            None => (scene.skeleton.clone(), chosen.cloned()),
        };
        Ok(Self { scene, skeleton, clip })
    }

    fn film(
        &self,
        view: &View,
        format: PictureFormat,
        limits: &Limits,
        control: &Control,
        reporter: &mut Reporter,
    ) -> Result<crate::picture::Film, Failure> {
        let scene = &self.scene;
        let rig = self.rig();
        let wanted: BTreeSet<usize> = (0..scene.morphs.len()).filter(|morph| self.moves_morph(*morph)).collect();
        let appearance = formats::appearance(scene, &wanted, limits, control, reporter)?;
        let has_mesh = appearance.triangle_count() > 0;
        let (mesh, problems) = Figure::new(appearance).map_err(in_picture)?;
        for (image, problem) in problems {
            let place = format!("image {image}");
            reporter.warn("texture_unreadable", place, problem.detail, "write the texture as PNG or JPEG");
        }
        let bones = self.bones(rig.as_ref())?;
        let work = rig.as_ref().map(|rig| rig.work_from_scene).or_else(|| scene.axes.map(|axes| axes.ours_from_this()));
        let picture_from_scene = DMat4::from_quat(work.unwrap_or_default());
        let role_joints = rig.iter().flat_map(|rig| rig.roles.iter().filter(|(role, _)| *role != "root"));
        let shown_joints: BTreeSet<usize> = role_joints.flat_map(|(_, joints)| joints.iter().copied()).collect();
        let floor = rig.as_ref().and_then(|rig| match &self.clip {
            Some(clip) => floors(rig, clip).map(|(_, floor)| floor),
            None => standing_floor(rig),
        });
        let unit = rig.as_ref().map(|rig| rig.unit_metres).or(scene.unit_metres);
        let subject = Subject {
            figure: if has_mesh { &mesh } else { &bones },
            bones: &bones,
            skeleton: &self.skeleton,
            clip: self.clip.as_ref(),
            rest_weights: scene.morphs.iter().map(|morph| morph.rest).collect(),
            shown_joints: shown_joints.into_iter().collect(),
            root: rig.as_ref().and_then(|rig| rig.role("pelvis").first().copied()),
            picture_from_scene: picture_from_scene.as_mat4(),
            units_per_metre: unit.filter(|unit| *unit > 0.0).map(|unit| unit.recip() as f32),
            floor: floor.map(|floor| floor as f32),
        };
        render(&subject, view, format, control).map_err(|error| match error {
            FilmError::Picture(error) => in_picture(error),
            FilmError::Canceled(canceled) => canceled.into(),
        })
    }

    /// What is known of the file as a rig; a file that is none can be seen all the same.
    fn rig(&self) -> Option<Rig<'_>> {
        if self.scene.skeleton.is_empty() {
            return None;
        }
        let knowledge = Knowledge::default();
        let spec = RigSpec::default();
        Rig::with_templates("source", &self.scene, None, &spec, knowledge.rigs(), &mut Reporter::new()).ok()
    }

    fn moves_morph(&self, morph: usize) -> bool {
        let is_animated = self.clip.iter().flat_map(|clip| clip.morphs()).any(|track| track.morph == morph);
        is_animated || self.scene.morphs[morph].rest != 0.0
    }

    /// The body of capsules.
    fn bones(&self, rig: Option<&Rig<'_>>) -> Result<Figure, Failure> {
        let rest = self.skeleton.rest_pose().to_model(&self.skeleton);
        let first = |role: &str| rig.and_then(|rig| rig.role(role).first().copied());
        let head = first("head").map(|head| (head, first("neck").or_else(|| first("pelvis"))));
        let (figure, _) = Figure::new(capsules(&rest, &drawn_bones(&self.skeleton, rig), head)).map_err(in_picture)?;
        Ok(figure)
    }
}

/// The bones that are drawn: of a body those with roles and all below them, else all between what the file calls joints.
fn drawn_bones(skeleton: &Skeleton, rig: Option<&Rig<'_>>) -> Vec<Bone> {
    let roles = || rig.into_iter().flat_map(|rig| rig.roles.iter().filter(|(role, _)| *role != "root"));
    let with_role: BTreeSet<usize> = roles().flat_map(|(_, joints)| joints.iter().copied()).collect();
    let is_trunk = |joint: usize| {
        let of_trunk = roles().filter(|(role, _)| matches!(role.as_str(), "pelvis" | "spine"));
        of_trunk.into_iter().any(|(_, joints)| joints.contains(&joint))
    };
    let has_joints = skeleton.joints().iter().any(|joint| joint.is_joint);
    let mut is_drawn = vec![false; skeleton.len()];
    for joint in 0..skeleton.len() {
        let above = skeleton.parent(joint).is_some_and(|parent| is_drawn[parent]);
        is_drawn[joint] = match with_role.is_empty() {
            true => skeleton.joints()[joint].is_joint || !has_joints,
            false => above || with_role.contains(&joint),
        };
    }
    let mut bones = Vec::new();
    for joint in (0..skeleton.len()).filter(|joint| is_drawn[*joint]) {
        let parent = skeleton.parent(joint).filter(|parent| is_drawn[*parent]);
        // Joints of limbs that hang on controls go on from the joint of the role before.
        let from = parent.or_else(|| rig.and_then(|rig| joint_before(rig, joint)));
        bones.extend(from.map(|from| Bone { from, to: joint, is_trunk: is_trunk(from) && is_trunk(joint) }));
    }
    bones
}

/// The joint that a body's joint goes on from by its role.
fn joint_before(rig: &Rig<'_>, joint: usize) -> Option<usize> {
    let (role, joints) = rig.roles.iter().find(|(role, joints)| *role != "root" && joints.contains(&joint))?;
    let place = joints.iter().position(|other| *other == joint)?;
    if let Some(before) = place.checked_sub(1) {
        return Some(joints[before]);
    }
    let (side, part) = ["left_", "right_"]
        .into_iter()
        .find_map(|side| role.strip_prefix(side).map(|part| (side, part)))
        .unwrap_or(("", role.as_str()));
    let before: &[&str] = match part {
        "spine" | "thigh" | "tail" => &["pelvis"],
        "shin" => &["thigh"],
        "foot" => &["shin"],
        "toe" => &["foot"],
        "clavicle" | "neck" => &["spine", "pelvis"],
        "upper_arm" => &["clavicle", "spine", "pelvis"],
        "forearm" => &["upper_arm"],
        "hand" => &["forearm"],
        "head" => &["neck", "spine"],
        _ => return None,
    };
    let last = |name: &&str| {
        [format!("{side}{name}"), (*name).to_owned()].iter().find_map(|role| rig.role(role).last().copied())
    };
    before.iter().find_map(last)
}

fn in_picture(error: PictureError) -> Failure {
    Failure::new(FailureCode::UnsupportedFeature, error.detail)
}
