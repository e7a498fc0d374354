//! A drawing that is ready to be seen: its texture on a mesh, its mesh in parts.

use glam::{DVec2, DVec3};

use crate::picture::Picture;

use super::{
    Arap, ArapWorkspace, CharacterSpec, DrawingError, Performance, PlanarRig, Precision, RetargetSpec, ViewSection,
    bones::{BoneMesh, BoneWorkspace},
    cutout::{Cutout, cut_out},
    fill::{self, Blend, Corner},
    lattice::Lattice,
    overlay, parts,
    skin::Skin,
    viewpoint::Viewpoint,
};

/// Squares along the side of the padded drawing, for the mesh of the original's deformation.
const COARSE_SQUARES: f64 = 48.0;
/// The same for the mesh that bones hold, at least and at most: thin limbs get a finer mesh than a figure that fills the picture.
const FINE_SQUARES: [f64; 2] = [48.0, 72.0];
/// Squares on the figure where those bounds allow it.
const SQUARES_OF_FIGURE: f64 = 900.0;

/// How a mesh follows the joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deformation {
    /// Bones hold it: limbs keep their length and their width.
    Bones,
    /// As rigid as possible between its joints, as the original does it.
    Arap,
}

/// How a drawing is put together and what of it is drawn.
#[derive(Clone, Debug)]
pub struct Look {
    /// How its mesh follows the joints.
    pub deformation: Deformation,
    /// Joints whose bones keep what hangs on them as it is.
    pub rigid: Vec<String>,
    /// Whether edges are smooth. Without it, a pixel is replaced or left.
    pub smooth: bool,
    /// Whether the texture keeps its size where it is drawn smaller.
    pub keep_texture: bool,
}

#[derive(Clone, Debug)]
enum Mesh {
    Bones(BoneMesh),
    Arap(Arap),
}

/// A drawing with texture, mesh and parts.
#[derive(Clone, Debug)]
pub struct Puppet {
    cutout: Cutout,
    /// For each vertex its place at rest.
    rest: Vec<DVec2>,
    triangles: Vec<[usize; 3]>,
    /// For each vertex its place on the texture, in pixels.
    texels: Vec<DVec2>,
    mesh: Mesh,
    /// For each body part group and each of its joints the joint and the triangles.
    parts: Vec<Vec<(usize, Vec<[usize; 3]>)>>,
    parents: Vec<Option<usize>>,
    viewpoint: Viewpoint,
    blend: Blend,
    shown: overlay::Shown,
}

/// What [`Puppet::draw`] works in.
#[derive(Clone, Debug)]
pub struct PuppetWorkspace {
    arap: Option<ArapWorkspace>,
    bones: Option<BoneWorkspace>,
    deformed: Vec<DVec2>,
    seen: Vec<Option<DVec2>>,
}

impl Puppet {
    /// Puts a drawing together.
    ///
    /// # Errors
    ///
    /// Where sizes do not fit, the mask is empty, or a joint is unknown.
    pub fn new(
        spec: &CharacterSpec,
        rig: &PlanarRig,
        retarget: &RetargetSpec,
        view: &ViewSection,
        look: &Look,
        pictures: [Picture; 2],
    ) -> Result<Self, DrawingError> {
        let viewpoint = Viewpoint::new(view);
        let scale = viewpoint.scale_at(retarget.char_starting_location[2]) / f64::from(spec.padded_side());
        let squares = |mask: &Picture, is_figure: &dyn Fn([u8; 4]) -> bool| match look.deformation {
            Deformation::Bones => {
                let pixels = mask.pixels.iter().filter(|pixel| is_figure(**pixel)).count().max(1) as f64;
                let side = mask.width.max(mask.height) as f64;
                ((SQUARES_OF_FIGURE / pixels).sqrt() * side).clamp(FINE_SQUARES[0], FINE_SQUARES[1])
            }
            Deformation::Arap => COARSE_SQUARES,
        };
        let (cutout, mesh) =
            cut_out(spec, pictures, (look.smooth && !look.keep_texture).then_some(scale), |mask, is_figure| {
                Lattice::new(mask, squares(mask, is_figure), is_figure)
            })?;
        let rigid: Vec<usize> = joints_named(rig, &look.rigid, "drawing.rigid")?;
        let body = match look.deformation {
            Deformation::Bones => Mesh::Bones(BoneMesh::new(&mesh.vertices, &mesh.triangles, rig, &rigid)?),
            Deformation::Arap => Mesh::Arap(Arap::new(&mesh.vertices, &mesh.triangles, &rig.rest, Precision::Double)?),
        };
        let of_joints = parts::triangles_of_joints(rig, &mesh);
        let groups = groups(rig, retarget, look.smooth)?;
        let parts = groups
            .into_iter()
            .map(|joints| joints.into_iter().map(|joint| (joint, of_joints[joint].clone())).collect())
            .collect();
        let side = f64::from(spec.padded_side());
        let texel = |vertex: &DVec2| {
            DVec2::new(vertex.x * side, f64::from(spec.height) - vertex.y * side) / cutout.shrunk as f64
        };
        Ok(Self {
            texels: mesh.vertices.iter().map(texel).collect(),
            rest: mesh.vertices,
            triangles: mesh.triangles,
            cutout,
            mesh: body,
            parts,
            parents: rig.parents.clone(),
            viewpoint,
            blend: if look.smooth { Blend::Over } else { Blend::Replace },
            shown: overlay::Shown::of(view),
        })
    }

    /// Memory for [`Self::draw`].
    #[must_use]
    pub fn workspace(&self) -> PuppetWorkspace {
        let count = self.texels.len();
        let (arap, bones) = match &self.mesh {
            Mesh::Arap(arap) => (Some(arap.workspace()), None),
            Mesh::Bones(bones) => (None, Some(bones.workspace())),
        };
        PuppetWorkspace { arap, bones, deformed: vec![DVec2::ZERO; count], seen: vec![None; count] }
    }

    /// The mesh at rest.
    #[must_use]
    pub fn rest(&self) -> (&[DVec2], &[[usize; 3]]) {
        (&self.rest, &self.triangles)
    }

    /// The joints that are drawn in no group by themselves and go with one nearby, where that is how it is drawn.
    #[must_use]
    pub fn skin(&self) -> Option<Skin<'_>> {
        let Mesh::Bones(mesh) = &self.mesh else { return None };
        let triangles = self.parts.iter().map(|part| part.iter().flat_map(|(_, own)| own.iter().copied()).collect());
        Some(Skin {
            mesh,
            vertices: &self.rest,
            texels: &self.texels,
            texture: &self.cutout.texture,
            parts: triangles.collect(),
        })
    }

    /// The mesh as it is at a frame, in the world.
    pub fn deformed<'a>(
        &self,
        performance: &Performance,
        frame: usize,
        workspace: &'a mut PuppetWorkspace,
    ) -> &'a [DVec2] {
        let frame = frame.min(performance.frames - 1);
        let (mut joints, root) = performance.joints_about_root(frame);
        let is_mirrored = performance.is_mirrored[frame];
        if is_mirrored {
            joints.iter_mut().for_each(|joint| joint.x = -joint.x);
        }
        match (&self.mesh, &mut workspace.arap, &mut workspace.bones) {
            (Mesh::Arap(mesh), Some(own), _) => mesh.deform(&joints, own, &mut workspace.deformed),
            (Mesh::Bones(mesh), _, Some(own)) => mesh.deform(&joints, own, &mut workspace.deformed),
            _ => {}
        }
        for vertex in &mut workspace.deformed {
            if is_mirrored {
                vertex.x = -vertex.x;
            }
            *vertex += root;
        }
        &workspace.deformed
    }

    /// Draws the puppet as it is at a frame over what is there, and says in which area: left, top, right and bottom. After its last frame it
    /// holds still.
    pub fn draw(
        &self,
        performance: &Performance,
        frame: usize,
        workspace: &mut PuppetWorkspace,
        picture: &mut Picture,
    ) -> [usize; 4] {
        let frame = frame.min(performance.frames - 1);
        self.deformed(performance, frame, workspace);
        let (shift, z) = (performance.seen_shift(frame), performance.start[2]);
        let see = |place: DVec2| self.viewpoint.seen((place + shift).extend(z));
        for (seen, &vertex) in workspace.seen.iter_mut().zip(&workspace.deformed) {
            *seen = see(vertex);
        }
        if self.shown.texture {
            self.draw_parts(performance, frame, &workspace.seen, picture, None);
        }
        if self.shown.colors {
            self.draw_parts(performance, frame, &workspace.seen, picture, Some(()));
        }
        if self.shown.mesh {
            for triangle in self.parts.iter().flatten().flat_map(|(_, triangles)| triangles) {
                overlay::outline(triangle.map(|corner| workspace.seen[corner]), picture);
            }
        }
        if self.shown.rig {
            let joints = self.parents.len();
            let at = |joint: usize| see(performance.joints[frame * joints + joint]);
            for (joint, parent) in self.parents.iter().enumerate() {
                let Some(parent) = parent else { continue };
                if let (Some(from), Some(to)) = (at(*parent), at(joint)) {
                    overlay::line(from, to, picture);
                }
            }
        }
        if self.shown.mesh || self.shown.rig {
            return [0, 0, picture.width, picture.height];
        }
        area_of(&workspace.seen, [picture.width, picture.height])
    }

    /// Draws what moves the drawing, as dots: the joints of the body.
    pub fn draw_body(&self, places: &[DVec3], size: f64, picture: &mut Picture) {
        for &place in places {
            if let Some(seen) = self.viewpoint.seen(place) {
                overlay::dot(seen, self.viewpoint.scale_at(place.z) * size / 2.0, picture);
            }
        }
    }

    fn draw_parts(
        &self,
        performance: &Performance,
        frame: usize,
        seen: &[Option<DVec2>],
        picture: &mut Picture,
        flat: Option<()>,
    ) {
        let groups = self.parts.len();
        for &group in &performance.order[frame * groups..(frame + 1) * groups] {
            let part = &self.parts[group];
            let is_near = performance.group_depths[frame * groups + group] > 0.0;
            for index in 0..part.len() {
                let (joint, triangles) = &part[if is_near { index } else { part.len() - 1 - index }];
                let color = flat.map(|()| overlay::color_of(*joint));
                for &triangle in triangles {
                    let corner = |vertex: usize| Some(Corner { seen: seen[vertex]?, texel: self.texels[vertex] });
                    let [Some(one), Some(two), Some(three)] = triangle.map(corner) else { continue };
                    match &color {
                        None => fill::triangle(picture, &self.cutout.texture, [one, two, three], self.blend),
                        Some(color) => fill::flat(picture, color, [one, two, three]),
                    }
                }
            }
        }
    }
}

/// The pixels of a picture that triangles between places may be drawn on.
fn area_of(seen: &[Option<DVec2>], [width, height]: [usize; 2]) -> [usize; 4] {
    let bounds = |(low, high): (DVec2, DVec2), place: &DVec2| (low.min(*place), high.max(*place));
    let (low, high) = seen.iter().flatten().fold((DVec2::MAX, DVec2::MIN), bounds);
    let pixel = |at: f64, most: usize| (at.max(0.0) as usize).min(most);
    let [left, top] = [pixel(low.x.floor(), width), pixel(low.y.floor(), height)];
    [left, top, pixel(high.x.ceil(), width).max(left), pixel(high.y.ceil(), height).max(top)]
}

fn joints_named(rig: &PlanarRig, names: &[String], place: &str) -> Result<Vec<usize>, DrawingError> {
    let find = |name: &String| rig.joint(name).ok_or_else(|| DrawingError::unknown_name(place, name, &rig.joint_names));
    names.iter().map(find).collect()
}

/// For each body part group the joints that are drawn with it. Joints that no group names are drawn before all of the group of the nearest
/// joint above them, where all is to be drawn.
fn groups(rig: &PlanarRig, retarget: &RetargetSpec, draw_all: bool) -> Result<Vec<Vec<usize>>, DrawingError> {
    let mut groups = Vec::new();
    for (index, group) in retarget.char_bodypart_groups.iter().enumerate() {
        groups.push(joints_named(rig, &group.char_joints, &format!("char_bodypart_groups[{index}].char_joints"))?);
    }
    if draw_all {
        let listed = groups.clone();
        let group_of = |joint: usize| listed.iter().position(|group: &Vec<usize>| group.contains(&joint));
        for joint in (0..rig.parents.len()).filter(|joint| group_of(*joint).is_none()) {
            let mut above = rig.parents[joint];
            while let Some(at) = above.filter(|at| group_of(*at).is_none()) {
                above = rig.parents[at];
            }
            let group = above.and_then(group_of).unwrap_or(0);
            if let Some(group) = groups.get_mut(group) {
                group.insert(0, joint);
            }
        }
    }
    Ok(groups)
}
