//! Skinned capsules: a body of rounded bones.

use glam::{DVec2, DVec3};

use super::figure::Figure;

const SEGMENTS: usize = 14;
/// Rings of each rounded end, and of the shaft between them.
const CAP_RINGS: usize = 4;
const SHAFT_RINGS: usize = 7;

/// A bone's capsule: from its joint to an end, elliptical, tapering.
pub(super) struct Shape {
    pub(super) joint: String,
    /// Where it begins if not at the joint; then all of it moves with the joint, and nothing of it with the parent.
    pub(super) start: Option<DVec3>,
    pub(super) end: DVec3,
    /// Radii to the side and to the front, meters.
    pub(super) from_radii: DVec2,
    pub(super) to_radii: DVec2,
    /// Twist joints along the bone that share its weights, from its start to its end.
    pub(super) helpers: Vec<String>,
}

/// A mesh bound to joints, in the rest pose.
#[derive(Default)]
pub(super) struct Mesh {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) joints: Vec<[u8; 4]>,
    /// In 255ths; each sums up to 255.
    pub(super) weights: Vec<[u8; 4]>,
    pub(super) indices: Vec<u16>,
}

/// Makes the capsules of a figure into one mesh.
pub(super) fn mesh(figure: &Figure, shapes: &[Shape]) -> Mesh {
    let mut mesh = Mesh::default();
    for shape in shapes {
        add(&mut mesh, figure, shape);
    }
    mesh
}

fn add(mesh: &mut Mesh, figure: &Figure, shape: &Shape) {
    let joint = joint_index(figure, &shape.joint);
    let helpers: Vec<u8> = shape.helpers.iter().map(|name| joint_index(figure, name)).collect();
    // The root stays on the ground while the pelvis travels, so nothing hangs on it.
    let parent = figure.parent(usize::from(joint)).filter(|parent| figure.parent(*parent).is_some());
    let parent = parent.filter(|_| shape.start.is_none());
    let parent = parent.map_or(joint, |parent| parent as u8);
    let start = shape.start.unwrap_or_else(|| figure.model(usize::from(joint)).translation);
    let axis = (shape.end - start).normalize();
    // Across the bone: one direction to the side, one to the front (or up, for bones that point to the front).
    let hint = if axis.z.abs() > 0.7 { DVec3::Y } else { DVec3::Z };
    let front = hint.reject_from_normalized(axis).normalize();
    let side = axis.cross(front);
    let length = (shape.end - start).length();

    let first = mesh.positions.len();
    let rings = rings(shape, length);
    for ring in &rings {
        for segment in 0..=SEGMENTS {
            let angle = segment as f64 / SEGMENTS as f64 * std::f64::consts::TAU;
            let (sine, cosine) = angle.sin_cos();
            let across = side * (ring.radii.x * cosine) + front * (ring.radii.y * sine);
            // The normal of an ellipse leans towards its short axis.
            let outward = side * (ring.radii.y * cosine) + front * (ring.radii.x * sine);
            let normal = (outward.normalize_or(side) * ring.outward + axis * ring.along_normal).normalize();
            mesh.positions.push((start + axis * ring.along + across).as_vec3().to_array());
            mesh.normals.push(normal.as_vec3().normalize().to_array());
            let (joints, weights) = weights(joint, parent, &helpers, ring.along / length);
            mesh.joints.push(joints);
            mesh.weights.push(weights);
        }
    }
    let row = SEGMENTS + 1;
    for ring in 0..rings.len() - 1 {
        for segment in 0..SEGMENTS {
            let corner = first + ring * row + segment;
            let [a, b, c, d] = [corner, corner + 1, corner + row, corner + row + 1].map(|index| index as u16);
            // The first and the last ring are points: one of the two triangles there has no area.
            if ring > 0 {
                mesh.indices.extend([a, b, c]);
            }
            if ring + 2 < rings.len() {
                mesh.indices.extend([b, d, c]);
            }
        }
    }
}

struct Ring {
    /// Meters from the start, along the bone.
    along: f64,
    radii: DVec2,
    /// The parts of the normal away from the axis and along it.
    outward: f64,
    along_normal: f64,
}

fn rings(shape: &Shape, length: f64) -> Vec<Ring> {
    let mut rings = Vec::new();
    let quarter = std::f64::consts::FRAC_PI_2;
    let cap = |radii: DVec2, at: f64, angle: f64| {
        // The cap of a short bone is flat, or it would stick out of its neighbors.
        let height = radii.min_element().min(length * 0.6);
        Ring {
            along: at + height * angle.sin(),
            radii: radii * angle.cos().max(0.0),
            outward: angle.cos(),
            along_normal: angle.sin(),
        }
    };
    for ring in 0..CAP_RINGS {
        rings.push(cap(shape.from_radii, 0.0, quarter * (ring as f64 / CAP_RINGS as f64 - 1.0)));
    }
    let slope = (shape.from_radii - shape.to_radii).element_sum() / 2.0 / length;
    for ring in 0..SHAFT_RINGS {
        let part = ring as f64 / (SHAFT_RINGS - 1) as f64;
        let radii = shape.from_radii.lerp(shape.to_radii, part);
        rings.push(Ring { along: part * length, radii, outward: 1.0, along_normal: slope });
    }
    for ring in 1..=CAP_RINGS {
        rings.push(cap(shape.to_radii, length, quarter * ring as f64 / CAP_RINGS as f64));
    }
    rings
}

/// The start of a bone hangs half on its parent, so that joints do not tear; twist joints take the shaft.
fn weights(joint: u8, parent: u8, helpers: &[u8], part: f64) -> ([u8; 4], [u8; 4]) {
    let of_parent = if parent == joint { 0.0 } else { (0.4 * (1.0 - part / 0.15)).clamp(0.0, 0.4) };
    let mut shares = vec![(joint, 1.0 - of_parent), (parent, of_parent)];
    for (place, helper) in helpers.iter().enumerate() {
        let center = (place + 1) as f64 / (helpers.len() + 1) as f64;
        let share = (0.6 * (1.0 - (part - center).abs() * (helpers.len() + 1) as f64)).max(0.0);
        shares[0].1 -= share * shares[0].1;
        shares.push((*helper, share));
    }
    let total: f64 = shares.iter().map(|share| share.1).sum();
    let (mut joints, mut weights) = ([0; 4], [0; 4]);
    let mut left = 255_u8;
    // The bone itself stands first and takes what rounding leaves.
    for (slot, (index, share)) in shares.iter().enumerate().skip(1) {
        let weight = (share / total * 255.0).round().clamp(0.0, f64::from(left)) as u8;
        if weight > 0 {
            (joints[slot], weights[slot]) = (*index, weight);
            left -= weight;
        }
    }
    (joints[0], weights[0]) = (joint, left);
    (joints, weights)
}

fn joint_index(figure: &Figure, name: &str) -> u8 {
    let index = figure.index(name).expect("shapes name joints of the same body");
    u8::try_from(index).expect("the body has fewer than 256 joints")
}
