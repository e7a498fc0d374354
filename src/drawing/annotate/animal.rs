//! A four-legged animal from the side, with the joints that *Animated Drawings* gives its four-legged example.

use glam::DVec2;

use super::{
    human::{core, stands},
    joints::{CORRECT, Fit, Joint, NoFit},
    limb::Limb,
    shape::Shape,
};
use crate::model::Reporter;

/// How far a leg stands out at least, as a share of the longer side.
const MIN_LEG: f64 = 0.055;

/// Fits an animal with four legs, seen from the side.
pub(super) fn fit(shape: &Shape) -> Result<Fit, NoFit> {
    let side = shape.width().max(shape.height());
    let is_leg = |&tip: &usize| stands(shape, &shape.tips[tip]) && shape.tips[tip].stands_out > MIN_LEG * side;
    let mut legs: Vec<usize> = (0..shape.tips.len()).filter(is_leg).collect();
    legs.sort_by(|one, other| shape.tips[*other].stands_out.total_cmp(&shape.tips[*one].stands_out));
    legs.truncate(4);
    if legs.len() < 3 {
        return Err(NoFit::new(format!(
            "{} legs stand out below its trunk; an animal from the side shows three or four",
            legs.len()
        )));
    }
    let [core_width, core_height] = core(shape);
    if core_width < 1.05 * core_height {
        return Err(NoFit::new("its trunk does not lie"));
    }
    let foot = |tip: usize| shape.place(shape.tips[tip].way[0]);
    legs.sort_by(|one, other| foot(*one).x.total_cmp(&foot(*other).x));
    let center = shape.place(shape.center);
    let (head, head_width) = head(shape, &legs).ok_or_else(|| NoFit::new("no head stands out of it"))?;
    let faces_right = head.x > center.x;
    let ways: Vec<&[usize]> = legs.iter().map(|&leg| &shape.tips[leg].way[..]).collect();
    let mut limbs: Vec<Limb> = (0..ways.len())
        .map(|leg| {
            let others: Vec<&[usize]> =
                (0..ways.len()).filter(|&other| other != leg).map(|other| ways[other]).collect();
            Limb::new(shape, ways[leg], shape.own(ways[leg], &others))
        })
        .collect();
    // From the hind legs to the fore legs.
    if !faces_right {
        limbs.reverse();
    }
    let mut notes = Reporter::new();
    let seen = limbs.len();
    if seen == 3 {
        // The pair that is closer together hides one.
        let [one, two, three] = [0, 1, 2].map(|leg: usize| limbs[leg].end.x);
        let hidden = if (two - one).abs() < (three - two).abs() { 2 } else { 0 };
        limbs.insert(hidden, limbs[hidden].clone());
        notes.warn(
            "joints_guessed",
            "joints",
            "three legs stand out: the fourth is put where the one beside it is",
            CORRECT,
        );
    }
    let sure = if seen == 4 { 0.9 } else { 0.6 };
    let root = limbs.iter().map(|limb| limb.root).sum::<DVec2>() / 4.0;
    let fore = f64::midpoint(limbs[2].root.x, limbs[3].root.x);
    let torso = shape.place(shape.nearest(DVec2::new(fore, f64::midpoint(head.y, root.y))));
    let head_sure = (head_width / shape.depth[shape.center] * 2.0).clamp(0.4, 0.9);
    let mut joints = vec![
        Joint::new("root", "", root, sure),
        Joint::new("hip", "root", root, sure),
        Joint::new("torso", "hip", torso, head_sure),
        Joint::new("neck", "torso", head, head_sure),
    ];
    // The near side is the right one of an animal that faces right; its legs are nearer to the head.
    let sides = if faces_right { ["left", "right"] } else { ["right", "left"] };
    for (index, limb) in limbs.iter().enumerate() {
        let (side, end) = (sides[index % 2], if index < 2 { "b" } else { "f" });
        let names = ["hip", "knee", "foot"].map(|name| format!("{side}_{name}_{end}"));
        let parents = ["root", &names[0], &names[1]];
        let places = [limb.root, limb.bend, limb.end];
        (0..3).for_each(|at| joints.push(Joint::new(&names[at], parents[at], places[at], sure)));
    }
    Ok(Fit { joints, notes })
}

/// The middle of the head and half of its width: of what stands out beyond the legs, the end that is wider and higher.
fn head(shape: &Shape, legs: &[usize]) -> Option<(DVec2, f64)> {
    let center = shape.place(shape.center);
    let ways: Vec<&[usize]> = legs.iter().map(|&leg| &shape.tips[leg].way[..]).collect();
    let ends = (0..shape.tips.len()).filter(|tip| !legs.contains(tip)).filter_map(|tip| {
        let way = &shape.tips[tip].way;
        let own = shape.own(way, &ways).max(1);
        let within = |share: f64| {
            let far = share * shape.width();
            (1..own).find(|&index| shape.length(&way[..index]) > far).unwrap_or(own)
        };
        let outer = &way[..within(0.22)];
        let usual = shape.median_depth(&way[..within(0.2)]);
        let place = shape.place(widest(shape, outer)?);
        let is_at_end = (place.x - center.x).abs() > 0.15 * shape.width();
        let high = (center.y - shape.place(way[0]).y) / shape.height();
        is_at_end.then_some((place, usual, usual / shape.height() + 0.15 * high))
    });
    ends.max_by(|one, other| one.2.total_cmp(&other.2)).map(|(place, width, _)| (place, width))
}

/// The first pixel that is wide and behind which the way becomes narrow, else the widest.
fn widest(shape: &Shape, way: &[usize]) -> Option<usize> {
    let most = way.iter().map(|&pixel| shape.depth[pixel]).fold(0.0, f64::max);
    let mut best = *way.first()?;
    for &pixel in way {
        if shape.depth[pixel] > shape.depth[best] {
            best = pixel;
        } else if shape.depth[best] >= 0.6 * most && shape.depth[pixel] < 0.8 * shape.depth[best] {
            break;
        }
    }
    Some(best)
}
