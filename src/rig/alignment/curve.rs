//! How the bends of a chain are laid onto another one, whatever the number of its bones.

use glam::{DQuat, DVec3};

use crate::model::rotation::{approach, smootherstep};

use super::{
    super::{named_pair::NamedPair, rig::Rig, spec::Align},
    HowAligned,
    arc::arc,
    look::{Bone, Look, chain},
    rules::{Aim, Rules},
};

/// Between two rest poses that somebody laid out, necks that differ by less hold the head alike: riggers put the lower joint of a neck
/// anywhere between the spine and the throat. By more, one of them bows its head. 70 degrees: hunched
/// creatures have their heads ahead of their chests, at a neck that leads forward by 50 to 60.
const SAME_NECK_RADIANS: f64 = 1.22;

/// A pose from a frame of a clip says how a neck is bowed and where its joint lies at once. A neck goes up to about this far with it, 12
/// degrees, which nobody sees as a bend where the source's neck is straight.
const BOWED_NECK_RADIANS: f64 = 0.21;
/// From there on more and more of a difference is bowing, until all of it is: 35 and 60 degrees.
const BOWED_RADIANS: [f64; 2] = [0.61, 1.05];

/// Thirds of two spines that differ by less are where the riggers put the joints; by more, the two bodies hold themselves otherwise. 25
/// degrees.
const SAME_BEND_RADIANS: f64 = 0.44;
/// A bend is looked at over no less than this share of a spine.
const SHORTEST_BEND: f64 = 1.0 / 3.0;

impl Rules<'_> {
    /// Each bone of a chain as the source's at the same place, or as the mean of several sources'.
    pub(super) fn along_chain(&mut self, pair: &NamedPair, role: &str, part: &str) {
        let own = chain(self.target, &pair.target);
        // Bones without a length were left out, and the others have no joint of their own number then.
        if own.len() + 1 != pair.target.len() {
            return;
        }
        let sources = std::iter::once(&pair.source).chain(pair.also.iter().map(|(_, joints)| joints));
        let bent: Vec<Vec<DVec3>> =
            sources.filter_map(|joints| bent_as(&own, &self.source.chain(role, joints))).collect();
        for (position, (bone, &joint)) in own.iter().zip(&pair.target).enumerate() {
            let mean = bent.iter().map(|directions| directions[position]).sum::<DVec3>().try_normalize();
            let Some(wanted) = mean else { return };
            let aim = Aim::Point { own: self.scene(bone.direction), wanted: self.scene(wanted), pole: self.pole(part) };
            self.wish(joint, role, aim, None);
        }
    }

    /// A spine or neck as a whole, and where its bends are others than the source's, bone by bone.
    pub(super) fn trunk(&mut self, pair: &NamedPair, role: &str, part: &str, ends: &[&str]) {
        let Some((own, wanted)) = self.directions(pair, role, ends) else { return };
        let (first, pole, roll) = (pair.target[0], self.pole(part), self.roll(role));
        let curves = self.curves(pair, role, ends);
        let bones = curves.as_ref().map(|curves| self.bends(curves, wanted)).unwrap_or_default();
        let whole = arc(own, wanted, pole);
        let is_like = |curves: &Curves| {
            curves
                .thirds()
                .all(|(own, wanted)| (whole * self.scene(own)).angle_between(self.scene(wanted)) <= SAME_BEND_RADIANS)
        };
        if curves.as_ref().is_none_or(|curves| self.mode == Align::Auto && is_like(curves)) {
            if part == "spine" && self.is_moment() {
                return self.shared(pair, role, (own, wanted), &bones);
            }
            if part == "neck" && self.is_same_neck(pair, own, wanted) {
                self.wish(first, role, Aim::Face { turn: self.body_turn, own, wanted, how: HowAligned::Kept }, None);
            } else {
                let aim = if part == "neck" && self.is_moment() && self.is_free(pair) {
                    Aim::Bent { own, wanted: bowed(self.body_turn * own, wanted), pole }
                } else {
                    Aim::Point { own, wanted, pole }
                };
                self.wish(first, role, aim, roll);
            }
            for (position, &joint) in pair.target.iter().enumerate().skip(1) {
                self.wish(joint, role, Aim::Follow { first, bone: bones.get(position).copied() }, None);
            }
            return;
        }
        for (&joint, (own, wanted)) in pair.target.iter().zip(bones) {
            self.wish(joint, role, Aim::Point { own, wanted, pole }, roll.filter(|_| joint == first));
        }
    }

    /// A spine as a whole whose joints share how it is twisted against what carries it: hips and shoulders of a frame of a clip are turned
    /// against one another as the body was, and by no single joint.
    fn shared(&mut self, pair: &NamedPair, role: &str, (own, wanted): (DVec3, DVec3), bones: &[(DVec3, DVec3)]) {
        let (base, pole, roll) = (self.target.skeleton().parent(pair.target[0]), self.pole(role), self.roll(role));
        for (position, &joint) in pair.target.iter().enumerate() {
            let share = (position + 1) as f64 / pair.target.len() as f64;
            let bone = if position == 0 { Some((own, wanted)) } else { bones.get(position).copied() };
            self.wish(joint, role, Aim::Shared { own, wanted, pole, base, share, bone }, roll);
        }
    }

    /// Whether what the rests of both sides have in common is a moment of a motion, and the rules decide what is made of it.
    pub(super) fn is_moment(&self) -> bool {
        self.mode == Align::Auto && self.is_laid_out() == Some(false)
    }

    /// Whether a neck differs from the source's by no more than riggers differ about where its joint is, so that it keeps how it is
    /// made: turned by that difference it would be bent where the source's is straight, and the head back again.
    fn is_same_neck(&self, pair: &NamedPair, own: DVec3, wanted: DVec3) -> bool {
        let is_near = (self.body_turn * own).angle_between(wanted) <= SAME_NECK_RADIANS;
        self.is_laid_out() == Some(true) && self.is_free(pair) && is_near
    }

    /// Whether somebody laid out the rest poses of both rigs; nothing where the source is no rig.
    fn is_laid_out(&self) -> Option<bool> {
        let is_laid_out = |rig: &Rig<'_>| !rig.rest_source.is_in_motion();
        match self.source {
            Look::Rig(source) => Some(is_laid_out(self.target) && is_laid_out(source)),
            Look::Canonical(_) => None,
        }
    }

    /// Whether the spec leaves it to the rules where the joints of a pair point.
    fn is_free(&self, pair: &NamedPair) -> bool {
        self.mode == Align::Auto && !self.explicit(pair).iter().any(Option::is_some)
    }

    /// The bones of a spine or neck up to what it leads to, of both sides. Nothing where one of the two has no bends, or the spec says what
    /// their first joints point at.
    fn curves(&self, pair: &NamedPair, role: &str, ends: &[&str]) -> Option<Curves> {
        let has = |end: &&&str| !self.target.role(end).is_empty() && self.source.toward(role, end).is_some();
        let is_pointed = self.explicit(pair).iter().any(Option::is_some);
        let end = ends.iter().find(has).filter(|_| !is_pointed && pair.target.len() > 1)?;
        let bones = |rig: &Rig<'_>, joints: &[usize]| chain(rig, &[joints, &rig.role(end)[..1]].concat());
        let own = bones(self.target, &pair.target);
        let wanted = match self.source {
            Look::Rig(source) if pair.source.len() > 1 => bones(source, &pair.source),
            Look::Rig(_) => return None,
            Look::Canonical(_) => self.source.chain(role, &pair.source),
        };
        (own.len() == pair.target.len() && !wanted.is_empty()).then_some(Curves { own, wanted })
    }

    /// Where each bone points, and where it points when the chain bends as the source's does and leads to where `whole` points.
    fn bends(&self, curves: &Curves, whole: DVec3) -> Vec<(DVec3, DVec3)> {
        let bent = curves.own.iter().filter_map(|bone| {
            // A short bone that zigzags is where the rigger put a joint and no bend of the body.
            let missing = ((SHORTEST_BEND - (bone.end - bone.begin)) / 2.0).max(0.0);
            straight_line(&curves.wanted, bone.begin - missing, bone.end + missing)
        });
        let bent: Vec<DVec3> = bent.map(|direction| self.scene(direction)).collect();
        let bones = curves.own.iter().map(|bone| self.scene(bone.direction));
        bones.zip(leading_to(&curves.own, &bent, whole)).collect()
    }
}

/// A direction that goes along with another one as a neck does that is measured from a frame of a clip.
pub(super) fn bowed(own: DVec3, wanted: DVec3) -> DVec3 {
    let angle = own.angle_between(wanted);
    if angle <= f64::EPSILON { wanted } else { own.slerp(wanted, bow(angle) / angle) }
}

/// How far a neck is bowed that differs by an angle; both in radians. Smooth, and never less for a larger angle.
fn bow(angle: f64) -> f64 {
    let [begin, end] = BOWED_RADIANS;
    let little = approach(angle, 0.0, BOWED_NECK_RADIANS);
    little + (angle - little) * smootherstep((angle - begin) / (end - begin))
}

/// The bones of two spines or necks, in canonical space; neither is empty.
struct Curves {
    own: Vec<Bone>,
    wanted: Vec<Bone>,
}

impl Curves {
    /// Where each third of both chains leads, by length: how the bodies hold themselves, whatever their joints do in between.
    fn thirds(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        (0..3_u32).filter_map(|third| {
            let (begin, end) = (f64::from(third) / 3.0, f64::from(third + 1) / 3.0);
            straight_line(&self.own, begin, end).zip(straight_line(&self.wanted, begin, end))
        })
    }
}

/// Where the bones of a chain are to point so that it bends as another one does: over the same share of the length, or bone by bone
/// where there are as many. As long as `own`; nothing where the other chain has no length.
fn bent_as(own: &[Bone], wanted: &[Bone]) -> Option<Vec<DVec3>> {
    if wanted.len() == own.len() {
        return Some(wanted.iter().map(|bone| bone.direction).collect());
    }
    own.iter().map(|bone| straight_line(wanted, bone.begin, bone.end)).collect()
}

/// The same directions, turned together until a chain of such bones leads to where `whole` points.
fn leading_to(own: &[Bone], directions: &[DVec3], whole: DVec3) -> Vec<DVec3> {
    let way: DVec3 = own.iter().zip(directions).map(|(bone, direction)| *direction * (bone.end - bone.begin)).sum();
    let turn = way.try_normalize().map_or(DQuat::IDENTITY, |way| DQuat::from_rotation_arc(way, whole));
    directions.iter().map(|direction| turn * *direction).collect()
}

/// From one place of a chain to another, both as shares of its length.
fn straight_line(bones: &[Bone], begin: f64, end: f64) -> Option<DVec3> {
    let part = |bone: &Bone| bone.direction * (bone.end.min(end) - bone.begin.max(begin)).max(0.0);
    bones.iter().map(part).sum::<DVec3>().try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of a circle from +Y to +Z, in equal bones.
    fn quarter(bones: u32) -> Vec<Bone> {
        let share = |bone: u32| f64::from(bone) / f64::from(bones);
        let place = |bone: u32| {
            let (sine, cosine) = (share(bone) * std::f64::consts::FRAC_PI_2).sin_cos();
            DVec3::new(0.0, sine, 1.0 - cosine)
        };
        let bone = |bone: u32| Bone {
            begin: share(bone),
            end: share(bone + 1),
            direction: (place(bone + 1) - place(bone)).normalize(),
        };
        (0..bones).map(bone).collect()
    }

    #[test]
    fn a_curve_is_the_same_whatever_the_number_of_its_bones() {
        let straight: Vec<Bone> = quarter(3).into_iter().map(|bone| Bone { direction: DVec3::Y, ..bone }).collect();
        for bones in [2, 4, 5, 9] {
            let found = bent_as(&straight, &quarter(bones)).expect("a curve");
            for (found, wanted) in found.iter().zip(quarter(3)) {
                // A chord of two bones turns by 22.5° at its ends.
                let degrees = found.angle_between(wanted.direction).to_degrees();
                assert!(degrees < if bones == 2 { 8.0 } else { 4.0 }, "{bones}: {degrees:.2}°");
            }
        }
        assert!(bent_as(&straight, &[]).is_none(), "nothing to bend as");
    }

    #[test]
    fn a_neck_is_bowed_smoothly() {
        let degrees = |angle: f64| bow(angle.to_radians()).to_degrees();
        assert!(degrees(5.0) > 4.5 && degrees(25.0) < 12.5, "{} and {}", degrees(5.0), degrees(25.0));
        assert!((degrees(75.0) - 75.0).abs() < 1e-9, "who looks at the floor looks at the floor");
        let angles: Vec<f64> = (0..90).map(|angle| degrees(f64::from(angle))).collect();
        assert!(angles.windows(2).all(|pair| (0.0..5.0).contains(&(pair[1] - pair[0]))), "{angles:?}");
    }

    #[test]
    fn bent_bones_lead_where_the_whole_is_to_lead() {
        let own = quarter(4);
        let directions = bent_as(&own, &quarter(7)).expect("a curve");
        let turned = leading_to(&own, &directions, DVec3::X);
        let way: DVec3 = own.iter().zip(&turned).map(|(bone, direction)| *direction * (bone.end - bone.begin)).sum();
        assert!(way.normalize().angle_between(DVec3::X) < 1e-9, "{way}");
        let bend = |directions: &[DVec3]| directions[0].angle_between(directions[3]);
        assert!((bend(&directions) - bend(&turned)).abs() < 1e-9, "bent as much as before");
    }
}
