//! Spine, neck and head of a body whose limbs are known.

use glam::DVec3;

use super::shape::Shape;

/// Where a joint lies above the shoulders, as a share of the trunk: the middle and the spread over many rigs.
#[derive(Clone, Copy)]
struct Height {
    middle: f64,
    spread: f64,
}

const NECK: Height = Height { middle: 0.1, spread: 0.12 };
const HEAD: Height = Height { middle: 0.3, spread: 0.12 };
/// The top of the head; higher is as well, since heads of cartoons are.
const TOP: Height = Height { middle: 0.68, spread: 0.2 };
/// How much likelier a last joint is the top of a head where limbs end in such joints, too; and where they do not.
const TOPS: f64 = 3.0;
const NO_TOPS: f64 = 0.2;

/// What that many joints hang from is a head: eyes, ears, jaw, hair.
const FACE_JOINTS: usize = 3;

impl Height {
    fn likeness(self, value: f64) -> f64 {
        (-0.5 * ((value - self.middle) / self.spread).powi(2)).exp()
    }
}

/// What the trunk lies between.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends<'a> {
    /// Legs and spine hang from it.
    pub pelvis: usize,
    /// The arms hang from it.
    pub chest: usize,
    /// The first joints of all limbs, which are no part of the trunk.
    pub limbs: &'a [usize],
    /// Whether limbs end in joints that only say where their last bones end, as exporters add them.
    pub tips: bool,
}

/// The joints on the middle plane.
#[derive(Clone, Debug, Default)]
pub(super) struct Trunk {
    pub spine: Vec<usize>,
    pub neck: Vec<usize>,
    pub head: Option<usize>,
}

/// Finds spine, neck and head. `up` and `across` are of unit length, `shoulders` is the middle between them, `height` the
/// distance from the hips to there.
pub(super) fn find_trunk(
    shape: &Shape<'_>,
    ends: Ends<'_>,
    shoulders: DVec3,
    up: DVec3,
    across: DVec3,
    height: f64,
) -> Trunk {
    let mut spine = shape.way(ends.pelvis, ends.chest).unwrap_or_default();
    let above = middle_chain(shape, ends, up, across);
    let height_of = |joint: usize| (shape.positions[joint] - shoulders).dot(up) / height;
    let mut head = 0;
    while let Some(next) = above.get(head + 1).copied() {
        let here = above[head];
        let has_face = |joint: usize| shape.children[joint].len() >= FACE_JOINTS;
        if shape.length[next] < 0.01 * height {
            break;
        }
        if !has_face(next) {
            let (low, high) = (height_of(here), height_of(next));
            // Either this is the head and the next its top, or this belongs to the neck and the next may be the head.
            let tops = if ends.tips { TOPS } else { NO_TOPS };
            let is_head = HEAD.likeness(low) * TOP.likeness(high.min(TOP.middle)) * tops;
            let goes_on = NECK.likeness(low) * HEAD.likeness(high);
            let is_leaf = above.len() == head + 2;
            if has_face(here) || (is_leaf && is_head > goes_on) || low > HEAD.middle + 2.0 * HEAD.spread {
                break;
            }
        } else if has_face(here) && height_of(here) > NECK.middle {
            break;
        }
        head += 1;
    }
    let mut neck: Vec<usize> = above.iter().take(head).copied().collect();
    // 3ds Max Biped hangs the arms from the neck.
    let chest_is_neck = neck.is_empty() && spine.len() > 2 && !above.is_empty() && height_of(ends.chest) > -0.02;
    if chest_is_neck {
        neck.extend(spine.pop());
    }
    Trunk { spine, neck, head: above.get(head).copied() }
}

/// Neck and head of an animal: the neck may be long, the head is where the face begins, else the last joint.
pub(super) fn find_animal_trunk(shape: &Shape<'_>, ends: Ends<'_>, to_head: DVec3, across: DVec3) -> Trunk {
    let spine = shape.way(ends.pelvis, ends.chest).unwrap_or_default();
    let above = middle_chain(shape, ends, to_head, across);
    let face = above.iter().position(|joint| shape.children[*joint].len() >= FACE_JOINTS);
    let head = face.or(above.len().checked_sub(1));
    let neck = head.map_or_else(Vec::new, |head| above[..head].to_vec());
    Trunk { spine, neck, head: head.map(|head| above[head]) }
}

/// The joints above the chest on the way to the head: at each joint the child that leads highest.
fn middle_chain(shape: &Shape<'_>, ends: Ends<'_>, up: DVec3, across: DVec3) -> Vec<usize> {
    let mut chain = Vec::new();
    let mut here = ends.chest;
    let highest = highest_below(shape, up);
    loop {
        let rise = |joint: &usize| highest[*joint] - shape.positions[here].dot(up);
        let in_middle = |joint: &usize| {
            let bone = shape.positions[*joint] - shape.positions[here];
            bone.dot(across).abs() <= 0.2 * bone.length()
        };
        let open = shape.children[here].iter().filter(|joint| !ends.limbs.contains(joint) && in_middle(joint));
        let next = open.filter(|joint| rise(joint) > 0.01 * shape.span).max_by(|first, second| {
            let upward = |joint: &usize| {
                let bone = shape.positions[*joint] - shape.positions[here];
                // Straight up first; hair and hats that reach as high start to the side.
                rise(joint) * (1.0 + bone.normalize_or_zero().dot(up))
            };
            upward(first).total_cmp(&upward(second)).then(second.cmp(first))
        });
        let Some(next) = next.copied().filter(|_| chain.len() < 24) else { break };
        chain.push(next);
        here = next;
    }
    chain
}

/// How high the highest joint below each joint is, itself included.
fn highest_below(shape: &Shape<'_>, up: DVec3) -> Vec<f64> {
    let mut highest: Vec<f64> = shape.positions.iter().map(|position| position.dot(up)).collect();
    for joint in shape.order.iter().rev() {
        if let Some(above) = shape.parent[*joint] {
            highest[above] = highest[above].max(highest[*joint]);
        }
    }
    highest
}
