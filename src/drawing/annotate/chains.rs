//! A body of any kind: a chain of three joints for each limb that stands out.

use super::{
    joints::{Fit, Joint, NoFit},
    limb::Limb,
    shape::Shape,
};
use crate::model::Reporter;

/// Limbs that become chains.
const MAX_LIMBS: usize = 12;

/// Fits a chain to each limb, counted clockwise from the top.
pub(super) fn fit(shape: &Shape) -> Result<Fit, NoFit> {
    if shape.tips.is_empty() {
        return Err(NoFit::new("nothing stands out of it"));
    }
    let center = shape.place(shape.center);
    let mut tips: Vec<usize> = (0..shape.tips.len().min(MAX_LIMBS)).collect();
    let turn = |tip: usize| {
        let out = shape.place(shape.tips[tip].way[0]) - center;
        out.x.atan2(-out.y).rem_euclid(std::f64::consts::TAU)
    };
    tips.sort_by(|one, other| turn(*one).total_cmp(&turn(*other)));
    let mut joints = vec![Joint::new("root", "", center, 0.9)];
    for (index, &tip) in tips.iter().enumerate() {
        let way = &shape.tips[tip].way;
        let others = tips.iter().filter(|&&other| other != tip).map(|&other| &shape.tips[other].way[..]);
        let limb = Limb::new(shape, way, shape.own(way, &others.collect::<Vec<_>>()));
        // What hardly stands out may be no limb.
        let share = shape.tips[tip].stands_out / shape.width().max(shape.height());
        let sure = (share / 0.15).clamp(0.3, 0.9);
        let names = ["root", "middle", "end"].map(|name| format!("limb{}_{name}", index + 1));
        let parents = ["root", &names[0], &names[1]];
        let places = [limb.root, limb.bend, limb.end];
        (0..3).for_each(|at| joints.push(Joint::new(&names[at], parents[at], places[at], sure)));
    }
    Ok(Fit { joints, notes: Reporter::new() })
}
