//! What each part of the target is to be turned to.

use glam::{DQuat, DVec3};

use crate::model::rotation::twist_angle;

use super::{
    super::{named_pair::NamedPair, rig::Rig, spec::Align},
    HowAligned,
    arc::arc,
    face::Face,
    look::{Look, RollCue, Second, place},
    sole::RaisedFoot,
    split, unnumbered,
};

/// Bodies that face this close to one another face the same way, in radians: feet and shoulders are never quite even.
const SAME_HEADING_RADIANS: f64 = 0.035;

/// How much of a trunk's lean in a frame of a clip its pelvis takes.
const PELVIS_SHARE: f64 = 0.5;

/// How a part finds its direction.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Rule {
    /// From the role's first joint to the first joint of one of these roles, else where its mesh or its End Site is. All joints of
    /// the chain turn with the first.
    Toward(&'static [&'static str]),
    /// The same, heading only, so that soles stay flat; and where one of the two poses is a moment of a motion, by how much more
    /// the one foot is tilted than the other.
    Sole(&'static [&'static str]),
    /// As `Toward`, and where the chain's own bends are others than the source's, bone by bone at equal arc length.
    Trunk(&'static [&'static str]),
    /// Along the chain, bone by bone at equal arc length.
    AlongChain,
    /// Keeps its own orientation on the body.
    Keep,
    /// Looks where the source's looks, where that is known.
    Face,
    /// Rides its parent.
    Ride,
}

/// One rule per part. `from_nothing`: there is no orientation that could be kept.
fn rule(part: &str, from_nothing: bool) -> Rule {
    match part {
        "spine" => Rule::Trunk(&["neck", "head"]),
        "neck" => Rule::Trunk(&["head"]),
        "upper_arm" => Rule::Toward(&["forearm", "hand"]),
        "forearm" => Rule::Toward(&["hand"]),
        "hand" => Rule::Toward(&["middle", "index", "ring"]),
        "thigh" => Rule::Toward(&["shin", "foot"]),
        "shin" => Rule::Toward(&["foot"]),
        "foot" if from_nothing => Rule::Toward(&["toe"]),
        "foot" => Rule::Sole(&["toe"]),
        "clavicle" if from_nothing => Rule::Toward(&["upper_arm"]),
        "head" if from_nothing => Rule::Ride,
        "thumb" | "index" | "middle" | "ring" | "pinky" | "front_leg" | "hind_leg" | "tail" => Rule::AlongChain,
        "head" => Rule::Face,
        "clavicle" => Rule::Keep,
        // What creatures have several of.
        _ => match unnumbered(part) {
            "leg" | "wing" | "neck" | "tail" => Rule::AlongChain,
            "head" => Rule::Keep,
            _ => Rule::Ride,
        },
    }
}

/// What one joint is to be turned to. Directions are unit vectors in the target's own space; `own` ones are at rest.
#[derive(Clone, Copy, Debug)]
pub(super) enum Aim {
    /// Carried along by what carries it on the body, then until `own` points along `wanted`; over `pole` where the two are opposite.
    Point { own: DVec3, wanted: DVec3, pole: DVec3 },
    /// The same, but no farther than a neck is bent where nobody can tell how it is.
    Bent { own: DVec3, wanted: DVec3, pole: DVec3 },
    /// From its own orientation, about the up axis only.
    Head { own: DVec3, wanted: DVec3 },
    /// From its own orientation by this much.
    Turn(DQuat),
    /// The same, told apart: `own` is where it looks or points, and `wanted` where it is to.
    Face { turn: DQuat, own: DVec3, wanted: DVec3, how: HowAligned },
    /// Carried along by its parent, then by this much.
    Further(DQuat),
    /// As a whole spine is pointed and rolled, but for a share of how that twists it against `base`: the joints of a spine share what its
    /// ends differ by. `bone` as of [`Aim::Follow`].
    Shared { own: DVec3, wanted: DVec3, pole: DVec3, base: Option<usize>, share: f64, bone: Option<(DVec3, DVec3)> },
    /// From its own orientation by this much, and half as far about the up axis as its parent was turned beyond that.
    Between(DQuat),
    /// By what its chain's first joint was turned by. `bone`: its own bone, and the source's at the same place of the chain, where
    /// they are to be compared.
    Follow { first: usize, bone: Option<(DVec3, DVec3)> },
}

impl Aim {
    /// The joint whose turn has to be known before, beside that of what carries this one.
    pub(super) fn goes_by(&self) -> Option<usize> {
        match self {
            Self::Shared { base, .. } => *base,
            Self::Follow { first, .. } => Some(*first),
            _ => None,
        }
    }
}

/// How a joint is to be rolled about the direction that it has been given.
#[derive(Clone, Copy, Debug)]
pub(super) struct Roll {
    /// At rest.
    pub(super) own: DVec3,
    pub(super) wanted: DVec3,
    pub(super) cues: (RollCue, RollCue),
    pub(super) uncertainty_degrees: f64,
    /// Directions of the part below, where it is that part that is rolled: a forearm takes half of what its hand is rolled by,
    /// so that neither the wrist nor the elbow is wrung.
    pub(super) of_part_below: Option<(DVec3, DVec3)>,
}

/// What one joint is to be turned to.
#[derive(Clone, Debug)]
pub(super) struct Wish {
    pub(super) name: String,
    pub(super) aim: Aim,
    pub(super) roll: Option<Roll>,
}

/// What the joints of the target are to be turned to, by joint.
pub(super) fn wishes(
    source: &Look<'_>,
    target: &Rig<'_>,
    pairs: &[NamedPair],
    from_nothing: bool,
    mode: Align,
) -> Vec<Option<Wish>> {
    let mut rules = Rules {
        source,
        own: Look::Rig(target),
        target,
        from_nothing,
        mode,
        body_turn: body_turn(source, target),
        wishes: vec![None; target.skeleton().len()],
    };
    rules.pelvis();
    for pair in pairs {
        rules.pair(pair);
    }
    for &joint in &target.keep_pose {
        let name = target.skeleton().label(joint);
        rules.wishes[joint] = Some(Wish { name, aim: Aim::Turn(DQuat::IDENTITY), roll: None });
    }
    rules.wishes
}

/// How far the body as a whole is to be turned about the vertical, in the target's own space.
fn body_turn(source: &Look<'_>, target: &Rig<'_>) -> DQuat {
    let radians = source.heading_radians() - Look::Rig(target).heading_radians();
    let radians = (radians + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
    if radians.abs() < SAME_HEADING_RADIANS {
        return DQuat::IDENTITY;
    }
    DQuat::from_axis_angle(target.up(), radians)
}

/// The rules at work on one target.
pub(super) struct Rules<'a> {
    pub(super) source: &'a Look<'a>,
    pub(super) own: Look<'a>,
    pub(super) target: &'a Rig<'a>,
    from_nothing: bool,
    pub(super) mode: Align,
    pub(super) body_turn: DQuat,
    wishes: Vec<Option<Wish>>,
}

impl Rules<'_> {
    pub(super) fn scene(&self, work: DVec3) -> DVec3 {
        self.target.canonical_from_scene.conjugate() * work
    }

    pub(super) fn wish(&mut self, joint: usize, name: &str, aim: Aim, roll: Option<Roll>) {
        self.wishes[joint] = Some(Wish { name: name.to_owned(), aim, roll });
    }

    /// The axis that limbs swing about: arms in the plane of the body, everything else in the plane of a stride.
    pub(super) fn pole(&self, part: &str) -> DVec3 {
        let is_arm = matches!(part, "upper_arm" | "forearm" | "hand" | "clavicle");
        self.scene(if is_arm { DVec3::Z } else { DVec3::X })
    }

    /// The hips are level with the source's hips.
    fn pelvis(&mut self) {
        let Some(&joint) = self.target.role("pelvis").first() else { return };
        let line = self.own.across("thigh").zip(self.source.across("thigh"));
        let line = line.map(|(own, wanted)| (self.scene(own), self.scene(wanted)));
        if self.from_nothing {
            let Some(own) = self.own.toward("pelvis", "spine") else { return };
            let aim = Aim::Point { own: self.scene(own), wanted: self.scene(DVec3::Y), pole: self.pole("pelvis") };
            let roll = line.map(|(own, wanted)| Roll {
                own,
                wanted,
                cues: (RollCue::Convention, RollCue::Convention),
                uncertainty_degrees: 0.0,
                of_part_below: None,
            });
            return self.wish(joint, "pelvis", aim, roll);
        }
        let turn = match line {
            Some((own, wanted)) if (self.body_turn * own).angle_between(wanted) > SAME_HEADING_RADIANS => {
                DQuat::from_rotation_arc(self.body_turn * own, wanted) * self.body_turn
            }
            _ => self.body_turn,
        };
        self.wish(joint, "pelvis", Aim::Turn(self.leaning(turn, line.map(|(_, wanted)| wanted))), None);
    }

    /// A pelvis goes half of the way along with a trunk that leans in a frame of a clip, about its hips: nobody can tell from such a frame how
    /// the pelvis is pitched, and all of a lean in the lowest joint of the spine would be a kink.
    fn leaning(&self, turn: DQuat, hips: Option<DVec3>) -> DQuat {
        let toward = |look: &Look<'_>| ["neck", "head"].iter().find_map(|end| look.toward("spine", end));
        let lines = toward(&self.own).zip(toward(self.source));
        let Some((hips, (own, wanted))) = hips.zip(lines).filter(|_| self.is_moment()) else { return turn };
        let lean = arc(turn * self.scene(own), self.scene(wanted), self.pole("spine"));
        DQuat::from_axis_angle(hips, twist_angle(lean, hips) * PELVIS_SHARE) * turn
    }

    fn pair(&mut self, pair: &NamedPair) {
        let Some(role) = pair.role.as_deref() else { return self.unnamed(pair) };
        let (_, part) = split(role);
        let first = pair.target[0];
        match rule(part, self.from_nothing) {
            Rule::Toward(ends) => {
                let Some((own, wanted)) = self.directions(pair, role, ends) else { return };
                let roll = self.roll(role).or_else(|| self.half_of_the_hand(role));
                self.wish(first, role, Aim::Point { own, wanted, pole: self.pole(part) }, roll);
                for &joint in &pair.target[1..] {
                    self.wish(joint, role, Aim::Follow { first, bone: None }, None);
                }
            }
            Rule::Trunk(ends) if role == part => self.trunk(pair, role, part, ends),
            // A neck beside others leads to a head of its own.
            Rule::Trunk(_) => self.along_chain(pair, role, part),
            Rule::Sole(ends) => self.sole(pair, role, ends),
            // Of several heads, eyes are known of the middle one only.
            Rule::Face if role == "head" => self.face(first, role),
            Rule::Keep | Rule::Face => self.wish(first, role, Aim::Turn(self.body_turn), None),
            Rule::AlongChain => self.along_chain(pair, role, part),
            Rule::Ride => {}
        }
    }

    /// A foot turns with its heading, from its own orientation; one that is raised at rest is raised as the source's is.
    fn sole(&mut self, pair: &NamedPair, role: &str, ends: &[&str]) {
        let up = self.target.up();
        let level = |direction: DVec3| (direction - up * direction.dot(up)).try_normalize();
        let is_alike = self.own.stands_in_the_step_of(self.source);
        let raised = |look: &Look<'_>| if is_alike { None } else { look.raised_foot(role) };
        let (own_raised, source_raised) = (raised(&self.own), raised(self.source));
        let flat = |raised: Option<RaisedFoot>, rest: DVec3| raised.map_or(rest, |raised| self.scene(raised.along));
        let levels = self
            .directions(pair, role, ends)
            .and_then(|(own, wanted)| Some((own, level(flat(own_raised, own))?, level(flat(source_raised, wanted))?)));
        let raise = |raised: Option<RaisedFoot>| {
            let scene = self.target.canonical_from_scene.conjugate();
            raised.map_or(DQuat::IDENTITY, |raised| scene * raised.rest_from_flat * scene.conjugate())
        };
        let aim = match levels {
            None => Aim::Turn(self.body_turn),
            Some((_, own, wanted)) if own_raised.is_none() && source_raised.is_none() => Aim::Head { own, wanted },
            Some((own, own_level, wanted)) => {
                let heads = arc(own_level, wanted, up);
                let turn = (raise(source_raised) * heads * raise(own_raised).conjugate()).normalize();
                Aim::Face { turn, own, wanted: turn * own, how: HowAligned::Direction }
            }
        };
        self.wish(pair.target[0], role, aim, None);
    }

    /// A chain that no role names is turned only where both sides say what its first joint points at.
    fn unnamed(&mut self, pair: &NamedPair) {
        let [own, wanted] = self.explicit(pair);
        if let Some((own, wanted)) = own.zip(wanted) {
            let aim = Aim::Point { own: self.scene(own), wanted: self.scene(wanted), pole: self.pole("") };
            self.wish(pair.target[0], &pair.name, aim, None);
        }
    }

    /// Where a pair of joints points on both sides, to the same part of the body if both have one.
    pub(super) fn directions(&self, pair: &NamedPair, role: &str, ends: &[&str]) -> Option<(DVec3, DVec3)> {
        let (side, _) = split(role);
        let ends: Vec<String> = ends.iter().map(|end| format!("{side}{end}")).collect();
        let [explicit_own, explicit_wanted] = self.explicit(pair);
        let both = ends.iter().find_map(|end| self.own.toward(role, end).zip(self.source.toward(role, end)));
        let alone = |look: &Look<'_>| ends.iter().find_map(|end| look.toward(role, end)).or_else(|| look.leaf(role));
        let own = explicit_own.or_else(|| both.map(|both| both.0)).or_else(|| alone(&self.own))?;
        let wanted = explicit_wanted.or_else(|| both.map(|both| both.1)).or_else(|| alone(self.source))?;
        Some((self.scene(own), self.scene(wanted)))
    }

    /// Where the spec says that the first joints of a pair point, of the target's and of the source's.
    pub(super) fn explicit(&self, pair: &NamedPair) -> [Option<DVec3>; 2] {
        let source = match self.source {
            Look::Rig(source) => pointed_at(source, pair.source[0]),
            Look::Canonical(_) => None,
        };
        [pointed_at(self.target, pair.target[0]), source]
    }

    pub(super) fn roll(&self, role: &str) -> Option<Roll> {
        let (own, wanted) = self.own.second(role).zip(self.source.second(role))?;
        Some(self.between(&own, &wanted, None))
    }

    fn between(&self, own: &Second, wanted: &Second, of_part_below: Option<(DVec3, DVec3)>) -> Roll {
        Roll {
            own: self.scene(own.axis),
            wanted: self.scene(wanted.axis),
            cues: (wanted.cue, own.cue),
            uncertainty_degrees: own.uncertainty_degrees.max(wanted.uncertainty_degrees),
            of_part_below,
        }
    }

    fn half_of_the_hand(&self, role: &str) -> Option<Roll> {
        let side = role.strip_suffix("forearm")?;
        let hand = format!("{side}hand");
        let (own, wanted) = self.own.second(&hand).zip(self.source.second(&hand))?;
        let fingers = [format!("{side}middle"), format!("{side}index"), format!("{side}ring")];
        let direction =
            |look: &Look<'_>| fingers.iter().find_map(|end| look.toward(&hand, end)).or_else(|| look.leaf(&hand));
        let directions = (self.scene(direction(&self.own)?), self.scene(direction(self.source)?));
        Some(self.between(&own, &wanted, Some(directions)))
    }

    /// A head looks where the source's looks: the two are compared by eyes and meshes, and where these say no more than that
    /// both look somewhere ahead, the target's keeps its own orientation.
    fn face(&mut self, joint: usize, role: &str) {
        let is_known = |(own, wanted): &(Face, Face)| [own, wanted].iter().any(|face| face.cue != RollCue::Convention);
        let Some((own, wanted)) = self.own.face().zip(self.source.face()).filter(is_known) else {
            let aim = if self.is_moment() { Aim::Between(self.body_turn) } else { Aim::Turn(self.body_turn) };
            return self.wish(joint, role, aim, None);
        };
        let scene = self.target.canonical_from_scene;
        let whole = scene.conjugate() * wanted.frame() * own.frame().conjugate() * scene;
        let uncertainty_degrees = own.uncertainty_degrees.max(wanted.uncertainty_degrees);
        let roll = Roll {
            own: self.scene(own.left),
            wanted: self.scene(wanted.left),
            cues: (wanted.cue, own.cue),
            uncertainty_degrees,
            of_part_below: None,
        };
        let (own, wanted) = (self.scene(own.forward), self.scene(wanted.forward));
        let further = self.body_turn.angle_between(whole).to_degrees();
        let (turn, how) = match self.mode {
            Align::Direction => (arc(own, wanted, self.target.up()), HowAligned::Direction),
            Align::Auto if further <= uncertainty_degrees => (self.body_turn, HowAligned::Kept),
            Align::Auto | Align::Full | Align::Off => (whole.normalize(), HowAligned::Full),
        };
        self.wish(joint, role, Aim::Face { turn, own, wanted, how }, Some(roll));
    }
}

/// Where the spec says that a joint points, in canonical space.
fn pointed_at(rig: &Rig<'_>, joint: usize) -> Option<DVec3> {
    let end = rig.points_at.get(&joint)?;
    (place(rig, *end) - place(rig, joint)).try_normalize()
}
