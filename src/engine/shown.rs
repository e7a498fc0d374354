//! A scene as it is shown: with the nodes of its file, where those are not the joints that are retargeted, and in meters where its unit is
//! known, so that two can be shown together.

use std::collections::BTreeSet;

use glam::{DMat4, DVec3};

use crate::{
    formats::{self, Limits},
    model::{Clip, Control, Reporter, Scene, Skeleton},
    picture::{Figure, PictureError, Subject, capsules},
    rig::{Rig, floors, standing_floor},
};

use super::{Failure, FailureCode, drawn_bones::drawn_bones};

/// A scene and what it does, ready to be drawn.
pub(super) struct Shown<'a> {
    name: String,
    scene: &'a Scene,
    rig: Option<&'a Rig<'a>>,
    /// Of the joints that are retargeted.
    clip: Option<&'a Clip>,
    /// The nodes of the file, and what they do.
    skeleton: Skeleton,
    clip_of_nodes: Option<Clip>,
    mesh: Figure,
    bones: Figure,
}

impl<'a> Shown<'a> {
    /// Reads what a scene looks like. A scene that is no rig can be seen all the same.
    pub(super) fn new(
        name: &str,
        scene: &'a Scene,
        rig: Option<&'a Rig<'a>>,
        clip: Option<&'a Clip>,
        (limits, control): (&Limits, &Control),
        reporter: &mut Reporter,
    ) -> Result<Self, Failure> {
        let (skeleton, clip_of_nodes) = match &scene.stretched {
            Some(stretched) => {
                let clip = clip.map(|clip| stretched.clip_of_nodes(&scene.skeleton, clip)).transpose();
                let clip = clip.map_err(|error| Failure::new(FailureCode::AssetMalformed, error.to_string()))?;
                (stretched.skeleton_of_nodes(&scene.skeleton), clip)
            }
            None => (scene.skeleton.clone(), clip.cloned()),
        };
        let is_animated = |morph: usize| clip.iter().flat_map(|clip| clip.morphs()).any(|track| track.morph == morph);
        let is_wanted = |morph: &usize| is_animated(*morph) || scene.morphs[*morph].rest != 0.0;
        let wanted: BTreeSet<usize> = (0..scene.morphs.len()).filter(is_wanted).collect();
        let appearance = formats::appearance(scene, &wanted, limits, control, reporter)?;
        let (mesh, problems) = Figure::new(appearance).map_err(in_picture)?;
        for (image, problem) in problems {
            let place = format!("image {image}");
            reporter.warn("texture_unreadable", place, problem.detail, "write the texture as PNG or JPEG");
        }
        let bones = bones(&skeleton, rig)?;
        Ok(Self { name: name.to_owned(), scene, rig, clip, skeleton, clip_of_nodes, mesh, bones })
    }

    pub(super) fn subject(&self) -> Subject<'_> {
        let (scene, rig) = (self.scene, self.rig);
        let unit = rig.map(|rig| rig.unit_meters).or(scene.unit_meters).filter(|unit| *unit > 0.0);
        let work =
            rig.map(|rig| rig.canonical_from_scene).or_else(|| scene.axes.map(|axes| axes.canonical_from_this()));
        let meters_from_scene = DMat4::from_scale_rotation_translation(
            DVec3::splat(unit.unwrap_or(1.0)),
            work.unwrap_or_default(),
            DVec3::ZERO,
        );
        let role_joints = rig.iter().flat_map(|rig| rig.roles.iter().filter(|(role, _)| *role != "root"));
        let shown_joints: BTreeSet<usize> = role_joints.flat_map(|(_, joints)| joints.iter().copied()).collect();
        let floor = rig.and_then(|rig| match self.clip {
            Some(clip) => floors(rig, clip).map(|(_, floor)| floor),
            None => standing_floor(rig),
        });
        Subject {
            name: self.name.clone(),
            figure: if self.mesh.is_empty() { &self.bones } else { &self.mesh },
            bones: &self.bones,
            skeleton: &self.skeleton,
            clip: self.clip_of_nodes.as_ref(),
            rest_weights: scene.morphs.iter().map(|morph| morph.rest).collect(),
            shown_joints: shown_joints.into_iter().collect(),
            root: rig.and_then(|rig| rig.role("pelvis").first().copied()),
            picture_from_scene: meters_from_scene.as_mat4(),
            units_per_meter: unit.map(|_| 1.0),
            floor: floor.map(|floor| (floor * unit.unwrap_or(1.0)) as f32),
        }
    }
}

/// The body of capsules.
fn bones(skeleton: &Skeleton, rig: Option<&Rig<'_>>) -> Result<Figure, Failure> {
    let rest = skeleton.rest_pose().to_model(skeleton);
    let first = |role: &str| rig.and_then(|rig| rig.role(role).first().copied());
    let head = first("head").map(|head| (head, first("neck").or_else(|| first("pelvis"))));
    let (figure, _) = Figure::new(capsules(&rest, &drawn_bones(skeleton, rig), head)).map_err(in_picture)?;
    Ok(figure)
}

pub(super) fn in_picture(error: PictureError) -> Failure {
    Failure::new(FailureCode::UnsupportedFeature, error.detail)
}
