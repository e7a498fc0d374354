//! What the ops behind forward kinematics work on.

use glam::{DMat3, DQuat, DVec3};

use crate::model::{Clip, Reporter, Track};

use super::animal_legs::animal_leg;
use crate::retarget::ops::{
    self, contacts::resolve::take_contacts, context::Subject, curves::resolve::curve_drives, schedule::schedule,
    source_curves::contact_spans,
};
use crate::rig::limb_joints::{by_roles, limb_joints};
use crate::{
    retarget::{
        mapping::{ChainPair, Mapping},
        ops::{
            Alpha, ContactsOp, Op, Scope,
            edits::SourceScale,
            resolved::{Ground, LimbPair, StagedKind, StagedOp, Stages},
            schedule::Schedule,
        },
    },
    rig::{
        Limb, LimbJoints, Sole,
        auto_map::{known_names, roles_of},
        error::{SpecError, SpecErrorKind, SpecField},
        floor::{Stance, clip_floor},
        leg_rows::is_whole_leg,
        rig::Rig,
        soles::{FootShape, foot_shape},
        tails::find_tails,
        volumes::{HandPair, body_parts, hand},
    },
};

/// A foot whose ankle is higher than the other by more than this share of its length does not stand.
const RAISED: f64 = 0.2;
/// Cosine of half the angle by which what is stiff may turn: a tenth of a degree.
const STIFF: f32 = 1.0 - 4e-7;

/// Resolves the ops behind `pelvis` and `fk`, and what those two do behind the plan. `kinematics` are the chains of each `fk` op by
/// its index. Needs the rest of the mapping.
pub(in crate::retarget) fn resolve_stages(
    ops: &[Op],
    kinematics: &[(usize, Vec<ChainPair>)],
    [source, target]: [&Rig<'_>; 2],
    clip: &Clip,
    mapping: &Mapping,
    reporter: &mut Reporter,
) -> Result<Stages, SpecError> {
    let mut limbs: Vec<LimbPair> = Limb::all().filter_map(|limb| find_limb(limb, source, target)).collect();
    limbs.iter_mut().for_each(|pair| pair.has_stiff_foot = has_stiff_foot(pair, source, clip));
    for pair in limbs.chunk_by_mut(|one, other| one.limb.is_paired_with(other.limb)) {
        share_soles(pair, source, |pair| &mut pair.source);
        share_soles(pair, target, |pair| &mut pair.target);
    }
    shape_feet(&mut limbs, source, target);
    let (mut front, mut staged) = (Vec::new(), Vec::new());
    let mut source_scale: Option<SourceScale> = None;
    let mut curves = Vec::new();
    let mut fields = Vec::new();
    for (index, op) in ops.iter().enumerate() {
        let context = Context { index, source, clip, limbs: &limbs };
        let (scope, kind, defaults) = match op {
            Op::Pelvis(op) => {
                let schedule = context.fade(&op.alpha, op.frames, &mut fields);
                let pelvis = mapping.pelvis.filter(|_| op.enabled);
                front.extend(schedule.zip(pelvis).map(|(schedule, pelvis)| StagedOp {
                    schedule,
                    limbs: Vec::new(),
                    kind: StagedKind::Fade(vec![pelvis.target]),
                }));
                continue;
            }
            Op::Fk(op) => {
                let schedule = context.fade(&op.alpha, op.frames, &mut fields);
                let chains = kinematics.iter().find(|entry| entry.0 == index).map_or(&[][..], |entry| &entry.1);
                let edits = ops::fk::edits::resolve(op, chains, &limbs);
                if !edits.is_empty() {
                    front.push(StagedOp {
                        schedule: Schedule::always(),
                        limbs: Vec::new(),
                        kind: StagedKind::Posed(edits),
                    });
                }
                let joints = chains.iter().flat_map(|chain| chain.target.iter().copied()).collect();
                let fade = schedule.filter(|_| op.enabled);
                front.extend(fade.map(|schedule| StagedOp {
                    schedule,
                    limbs: Vec::new(),
                    kind: StagedKind::Fade(joints),
                }));
                continue;
            }
            Op::ScaleSource(op) => {
                source_scale = ops::scale_source::resolve::resolve(op, index, source, source_scale, &mut fields);
                continue;
            }
            Op::Props(op) => {
                if op.scope.enabled {
                    let mut subject = Subject { index, source, target, clip, mapping, reporter, fields: &mut fields };
                    let grips = ops::props::resolve::grips(op, &limbs, &mut subject);
                    let edits = ops::props::resolve::resolve(op, &mut subject);
                    let schedule = context.schedule(&op.scope, &mut fields);
                    let kinds =
                        [(!grips.is_empty()).then_some(StagedKind::Grips(grips)), Some(StagedKind::Posed(edits))];
                    let staged_op = |kind| StagedOp { schedule: schedule.clone(), limbs: Vec::new(), kind };
                    staged.extend(kinds.into_iter().flatten().map(staged_op));
                }
                continue;
            }
            Op::Curves(op) => {
                if op.scope.enabled {
                    let schedule = context.schedule(&op.scope, &mut fields);
                    curves.extend(curve_drives(op, index, &schedule, source.scene, clip, &mut fields));
                }
                continue;
            }
            Op::Stride(op) => (&op.scope, StagedKind::Stride(op.clone()), Defaults::Legs),
            Op::Fingers(_)
            | Op::Reach(_)
            | Op::Joints(_)
            | Op::Pin(_)
            | Op::CopyBasePose(_)
            | Op::AdditivePose(_)
            | Op::ArmSpacing(_)
            | Op::StretchChain(_)
            | Op::Twist(_)
            | Op::Limits(_)
            | Op::RootMotion(_) => {
                let mut subject = Subject { index, source, target, clip, mapping, reporter, fields: &mut fields };
                let Some(scope) = op.scope().filter(|scope| scope.enabled) else { continue };
                if let Some(kind) = resolve_posed(op, &mut subject) {
                    staged.push(StagedOp { schedule: context.schedule(scope, &mut fields), limbs: Vec::new(), kind });
                }
                continue;
            }
            Op::Contacts(op) => (&op.scope, StagedKind::Contacts(context.contacts(op, &mut fields)), Defaults::All),
            Op::Ik(op) => (&op.scope, StagedKind::Ik(op.clone()), Defaults::Legs),
            Op::Plant(op) => (&op.scope, StagedKind::Plant(op.clone()), Defaults::Legs),
            Op::Floor(op) => (&op.scope, StagedKind::Floor(op.clone()), Defaults::Legs),
            Op::SelfContact(op) => (&op.scope, StagedKind::SelfContact(op.clone()), Defaults::Arms),
            Op::Filter(op) => {
                if op.scope.enabled {
                    let joints = filtered_joints(&op.scope, index, target, mapping, &mut fields);
                    let schedule = context.schedule(&op.scope, &mut fields);
                    staged.push(StagedOp { schedule, limbs: Vec::new(), kind: StagedKind::Filter(op.clone(), joints) });
                }
                continue;
            }
        };
        if !scope.enabled {
            continue;
        }
        staged.push(StagedOp {
            schedule: context.schedule(scope, &mut fields),
            limbs: context.masked_limbs(scope, defaults, &mut fields),
            kind,
        });
    }
    if let Some(error) = SpecError::from_fields(fields) {
        return Err(error);
    }
    report_order(ops, &staged, reporter);
    report_stiff_feet(&staged, &limbs, reporter);
    front.extend(staged);
    if front.is_empty() {
        return Ok(Stages { source_scale, curves, ..Stages::default() });
    }
    let (mut parts, mut hands) = (Vec::new(), Vec::new());
    if front.iter().any(|op| matches!(op.kind, StagedKind::SelfContact(_))) {
        let unit = source.unit_metres / target.unit_metres;
        parts = body_parts(source, target, unit);
        hands = find_hands(&limbs, source, target, unit);
    }
    let has_floor = front.iter().any(|op| matches!(op.kind, StagedKind::Floor(_)));
    let tails = if has_floor { find_tails(target) } else { Vec::new() };
    let ground = ground(source, target, clip, mapping);
    Ok(Stages { ground, limbs, tails, parts, hands, ops: front, source_scale, curves })
}

/// What an op does by itself; nothing for ops that are resolved with others, and for one that has nothing to do.
fn resolve_posed(op: &Op, subject: &mut Subject<'_>) -> Option<StagedKind> {
    match op {
        Op::Joints(op) => Some(StagedKind::Posed(ops::joints::resolve::resolve(op, subject))),
        Op::Pin(op) => Some(StagedKind::Posed(ops::pin::resolve::resolve(op, subject))),
        Op::CopyBasePose(op) => Some(StagedKind::Posed(ops::copy_base_pose::resolve::resolve(op, subject))),
        Op::AdditivePose(op) => Some(StagedKind::Posed(ops::additive_pose::resolve::resolve(op, subject))),
        Op::ArmSpacing(op) => Some(StagedKind::Posed(ops::arm_spacing::resolve::resolve(op, subject))),
        Op::StretchChain(op) => Some(StagedKind::Posed(ops::stretch_chain::resolve::resolve(op, subject))),
        Op::Limits(op) => Some(StagedKind::Posed(ops::limits::resolve::resolve(op, subject))),
        Op::Twist(op) => {
            let masked = subject.masked(&op.scope);
            let all = || (0..subject.target.skeleton().len()).collect();
            Some(StagedKind::Twist(op.gain, masked.unwrap_or_else(all)))
        }
        Op::RootMotion(op) => ops::root_motion::resolve::resolve(op, subject).map(StagedKind::RootMotion),
        Op::Reach(op) => Some(StagedKind::Posed(ops::reach::resolve::resolve(op, subject))),
        Op::Fingers(op) => Some(StagedKind::Posed(ops::fingers::resolve::resolve(op, subject))),
        Op::Stride(_)
        | Op::SelfContact(_)
        | Op::Props(_)
        | Op::ScaleSource(_)
        | Op::Pelvis(_)
        | Op::Fk(_)
        | Op::Contacts(_)
        | Op::Ik(_)
        | Op::Plant(_)
        | Op::Floor(_)
        | Op::Filter(_)
        | Op::Curves(_) => None,
    }
}

fn find_hands(limbs: &[LimbPair], source: &Rig<'_>, target: &Rig<'_>, unit: f64) -> Vec<HandPair> {
    let pair = |(limb, pair): (usize, &LimbPair)| {
        Some(HandPair { limb, source: hand(source, pair.limb, unit)?, target: hand(target, pair.limb, 1.0)? })
    };
    limbs.iter().enumerate().filter_map(pair).collect()
}

/// Which limbs an op is about when its mask does not say.
#[derive(Clone, Copy)]
enum Defaults {
    All,
    Legs,
    Arms,
}

struct Context<'a> {
    index: usize,
    source: &'a Rig<'a>,
    clip: &'a Clip,
    limbs: &'a [LimbPair],
}

impl Context<'_> {
    fn schedule(&self, scope: &Scope, fields: &mut Vec<SpecField>) -> Schedule {
        self.schedule_of(&scope.alpha, scope.frames, fields)
    }

    /// When `pelvis` or `fk` is faded behind the plan; nothing where the plan's own alpha says it all.
    fn fade(&self, alpha: &Alpha, frames: Option<[usize; 2]>, fields: &mut Vec<SpecField>) -> Option<Schedule> {
        let is_constant = frames.is_none() && alpha.constant().is_some();
        (!is_constant).then(|| self.schedule_of(alpha, frames, fields))
    }

    fn schedule_of(&self, alpha: &Alpha, frames: Option<[usize; 2]>, fields: &mut Vec<SpecField>) -> Schedule {
        schedule(alpha, frames, &format!("/ops/{}", self.index), self.source.scene, self.clip, fields)
    }

    /// The op with what curves say put into `set`.
    fn contacts(&self, op: &ContactsOp, fields: &mut Vec<SpecField>) -> ContactsOp {
        let pointer = format!("/ops/{}/curves", self.index);
        let known: Vec<&str> = Limb::all().flat_map(Limb::contact_points).filter(|point| !point.is_empty()).collect();
        let times = [("set", &op.set), ("add", &op.add), ("remove", &op.remove)];
        let named = times.into_iter().flat_map(|(field, points)| points.keys().map(move |point| (field, point)));
        for (field, point) in named.chain(op.curves.keys().map(|point| ("curves", point))) {
            if !known.contains(&point.as_str()) {
                let detail = format!("there is no point of contact '{point}'");
                let pointer = format!("/ops/{}/{field}/{point}", self.index);
                let field = SpecField::new(SpecErrorKind::UnknownName, pointer, detail);
                fields.push(field.with_nearest(point, known.iter().copied()));
            }
        }
        let mut resolved = op.clone();
        resolved.set.extend(contact_spans(&op.curves, &pointer, self.source.scene, self.clip, fields));
        take_contacts(&mut resolved, self.limbs, self.source.skeleton(), self.clip);
        resolved
    }

    fn masked_limbs(&self, scope: &Scope, defaults: Defaults, fields: &mut Vec<SpecField>) -> Vec<usize> {
        let names =
            |limb: &Limb| [limb.name()].into_iter().chain(limb.contact_points()).filter(|name| !name.is_empty());
        let known: Vec<&str> = Limb::all().flat_map(|limb| names(&limb).collect::<Vec<&str>>()).collect();
        for (position, name) in scope.mask.iter().flatten().enumerate() {
            if !known.contains(&name.as_str()) {
                let detail = format!("there is no limb '{name}' to mask");
                let pointer = format!("/ops/{}/mask/{position}", self.index);
                let field = SpecField::new(SpecErrorKind::UnknownName, pointer, detail);
                fields.push(field.with_nearest(name, known.iter().copied()));
            }
        }
        let wanted = |pair: &LimbPair| match &scope.mask {
            None => match defaults {
                Defaults::All => true,
                Defaults::Legs => pair.limb.is_leg(),
                Defaults::Arms => !pair.limb.is_leg(),
            },
            Some(masked) => names(&pair.limb).any(|name| masked.iter().any(|masked| masked == name)),
        };
        (0..self.limbs.len()).filter(|&index| wanted(&self.limbs[index])).collect()
    }
}

/// The driven joints of the masked roles; all but those of the legs where nothing is masked.
fn filtered_joints(
    scope: &Scope,
    index: usize,
    target: &Rig<'_>,
    mapping: &Mapping,
    fields: &mut Vec<SpecField>,
) -> Vec<usize> {
    let driven = mapping.driven();
    let joints_of = |name: &str| -> Vec<usize> {
        roles_of(name).into_iter().flat_map(|role| target.role(role).iter().copied()).collect()
    };
    let Some(mask) = &scope.mask else {
        let legs: Vec<usize> =
            ["left_leg", "right_leg", "left_toe", "right_toe"].into_iter().flat_map(joints_of).collect();
        let of_animals = target.roles.iter().filter(|(role, _)| is_whole_leg(role)).flat_map(|(_, joints)| joints);
        let legs: Vec<usize> = legs.into_iter().chain(of_animals.copied()).collect();
        return (0..driven.len()).filter(|joint| driven[*joint] && !legs.contains(joint)).collect();
    };
    let mut wanted = Vec::new();
    for (position, name) in mask.iter().enumerate() {
        let joints = joints_of(name);
        if joints.is_empty() {
            let detail = format!("the target rig has no role '{name}' to mask");
            let pointer = format!("/ops/{index}/mask/{position}");
            let known = known_names(target);
            let field = SpecField::new(SpecErrorKind::UnknownName, pointer, detail);
            fields.push(field.with_nearest(name, known.iter().map(String::as_str)));
        }
        wanted.extend(joints);
    }
    (0..driven.len()).filter(|joint| driven[*joint] && wanted.contains(joint)).collect()
}

/// Tells where an op does not run where it stands, or can do nothing because of what stands before it.
fn report_order(ops: &[Op], staged: &[StagedOp], reporter: &mut Reporter) {
    let is_kinematic = |op: &Op| match op {
        Op::Pelvis(op) => op.enabled,
        Op::Fk(op) => op.enabled,
        _ => false,
    };
    // Contacts are found in the source, which is scaled before anything else, and curves pose nothing: where these stand makes no
    // difference.
    let poses = |op: &Op| {
        !matches!(op, Op::Contacts(_) | Op::ScaleSource(_) | Op::Curves(_)) && op.scope().is_some_and(|op| op.enabled)
    };
    let kinematics_end = ops.iter().rposition(is_kinematic).unwrap_or(0);
    for (index, _) in ops[..kinematics_end].iter().enumerate().filter(|(_, op)| poses(op)) {
        reporter.warn(
            "op_runs_behind_kinematics",
            format!("/ops/{index}"),
            "the op stands before a pelvis or fk op, and those run before all others; it runs behind them",
            "put pelvis and fk first, as they run",
        );
    }
    let mut knows_contacts = false;
    for op in staged {
        match op.kind {
            StagedKind::Contacts(_) => knows_contacts = true,
            StagedKind::Plant(_) if !knows_contacts => reporter.warn(
                "plant_without_contacts",
                "ops",
                "plant holds feet during contacts, and no contacts op stands before it; nothing is held",
                "put {\"op\": \"contacts\"} before {\"op\": \"plant\"}",
            ),
            _ => {}
        }
    }
}

/// Tells that feet are set flat because the source does not say how they are turned.
fn report_stiff_feet(staged: &[StagedOp], limbs: &[LimbPair], reporter: &mut Reporter) {
    let is_set_flat = |op: &StagedOp| {
        matches!(op.kind, StagedKind::Floor(_)) && op.limbs.iter().any(|limb| limbs[*limb].has_stiff_foot)
    };
    if staged.iter().any(is_set_flat) {
        reporter.warn(
            "feet_set_flat",
            "source",
            "the source has no toes and its feet never turn against the shins, so that nothing says how they are turned; \
             feet are set flat while they stand",
            "send a source whose feet are animated, or leave the floor op out",
        );
    }
}

/// Whether there is a leg that both rigs have and whose target joints are driven.
pub(in crate::retarget) fn have_driven_leg(
    source: &Rig<'_>,
    target: &Rig<'_>,
    is_driven: impl Fn(usize) -> bool,
) -> bool {
    let legs = Limb::all().filter(|limb| limb.is_leg());
    let mut targets = legs.filter_map(|limb| find_limb(limb, source, target)).map(|pair| pair.target);
    targets.any(|leg| [leg.start, leg.middle].into_iter().all(&is_driven))
}

/// A limb of which both rigs have start, middle and end.
fn find_limb(limb: Limb, source: &Rig<'_>, target: &Rig<'_>) -> Option<LimbPair> {
    let unit = source.unit_metres / target.unit_metres;
    let [of_source, of_target] = match limb.roles() {
        Some(roles) => [by_roles(roles, source)?, by_roles(roles, target)?],
        None => animal_leg(limb, source, target)?,
    };
    let (source, target) = (limb_joints(limb, &of_source, source, unit)?, limb_joints(limb, &of_target, target, 1.0)?);
    let (source_foot, target_foot) = (FootShape::default(), FootShape::default());
    Some(LimbPair { limb, source, target, has_stiff_foot: false, source_foot, target_foot })
}

/// Skeletons of points have ankles and nothing beyond.
fn has_stiff_foot(pair: &LimbPair, source: &Rig<'_>, clip: &Clip) -> bool {
    let LimbJoints { middle, end, ball, .. } = pair.source;
    let turns = |joint: &usize| match &clip.joints()[*joint].rotation {
        Track::Sampled(values) => values.iter().any(|value| value.dot(values[0]).abs() < STIFF),
        Track::Rest | Track::Constant(_) => false,
    };
    let below_shin = source
        .skeleton()
        .path(middle, end)
        .filter(|_| pair.limb.is_leg() && pair.limb.whole_leg().is_none() && ball.is_none());
    clip.frame_count() > 1 && below_shin.is_some_and(|path| !path[1..].iter().any(turns))
}

/// Both feet have the sole of the one that stands: a rest pose may be a frame of a walk.
fn share_soles(limbs: &mut [LimbPair], rig: &Rig<'_>, side: impl Fn(&mut LimbPair) -> &mut LimbJoints) {
    let soles: Vec<Sole> = limbs.iter_mut().filter_map(|pair| side(pair).sole).collect();
    let least = |part: fn(&Sole) -> Option<f64>| soles.iter().filter_map(part).reduce(f64::min);
    let (heel, ball, tip) = (least(|sole| Some(sole.heel)), least(|sole| sole.ball), least(|sole| sole.tip));
    let is_raised = |sole: &Sole| {
        let raised = sole.heel - heel.unwrap_or(sole.heel);
        raised > RAISED * sole.end_to_ball.map_or(sole.heel, DVec3::length)
    };
    let standing = soles.iter().find(|sole| !is_raised(sole));
    for joints in limbs.iter_mut().map(side) {
        let (end, toe) = (joints.end, joints.ball);
        let Some(sole) = joints.sole.as_mut() else { continue };
        if is_raised(sole) {
            sole.down =
                standing.and_then(|standing| down_as_if_standing(standing, sole, rig, end, toe)).unwrap_or_default();
        }
        sole.heel = heel.unwrap_or(sole.heel);
        sole.ball = sole.ball.and(ball);
        sole.tip = sole.tip.and(tip);
    }
}

/// A foot in the air is tipped, too: it would stand with its ball as far off straight below the ankle as the other foot's is, turned
/// about the body's own left. Straight down then, in the axes of its joints; nothing where it has no ball.
fn down_as_if_standing(
    standing: &Sole,
    raised: &Sole,
    rig: &Rig<'_>,
    end: usize,
    ball: Option<usize>,
) -> Option<[Option<DVec3>; 3]> {
    let (stands, bone) = (standing.end_to_ball?, raised.end_to_ball?.try_normalize()?);
    let angle = stands.angle_between(standing.down[0]?);
    let turned = |joint: usize| rig.rest.transforms()[joint].rotation;
    let left = turned(end).conjugate() * (rig.work_from_scene.conjugate() * DVec3::X);
    let left = (left - bone * left.dot(bone)).try_normalize()?;
    let down = DQuat::from_axis_angle(left, angle) * bone;
    let of_toes = ball.map(|ball| turned(ball).conjugate() * (turned(end) * down));
    Some([Some(down), of_toes, raised.down[2].and(of_toes)])
}

/// Finds the soles of both sides. Of what is turned by nothing but the shins, nobody knows how it lies; and feet of one body are
/// looked at in one way.
fn shape_feet(limbs: &mut [LimbPair], source: &Rig<'_>, target: &Rig<'_>) {
    let unit = source.unit_metres / target.unit_metres;
    let is_leg = |pair: &&mut LimbPair| pair.limb.is_leg();
    let stands = |sole: Option<Sole>| sole.is_some_and(|sole| sole.down[0].is_some());
    let known = |pair: &LimbPair| [!pair.has_stiff_foot && stands(pair.source.sole), stands(pair.target.sole)];
    let legs = || limbs.iter().filter(|pair| pair.limb.is_leg());
    let [source_stands, target_stands] = [0, 1].map(|side| legs().all(|pair| known(pair)[side]));
    for pair in limbs.iter_mut().filter(is_leg) {
        let is_human = pair.limb.whole_leg().is_none();
        pair.source_foot = foot_shape(source, &pair.source, unit, source_stands, is_human);
        pair.target_foot = foot_shape(target, &pair.target, 1.0, target_stands, is_human);
    }
}

fn ground(source: &Rig<'_>, target: &Rig<'_>, clip: &Clip, mapping: &Mapping) -> Ground {
    let up = mapping.plan_from_target * target.up();
    let front = mapping.plan_from_target * (target.work_from_scene.conjugate() * DVec3::Z);
    let unit = mapping.plan_from_source.scale.x;
    let stance = |side: &Rig<'_>| side.role("pelvis").first().map(|&pelvis| (pelvis, Stance::of(side, pelvis)));
    let (mut source_rest_floor, mut source_floor) = (0.0, 0.0);
    if let Some((pelvis, stance)) = stance(source) {
        let floor =
            if stance.sole.is_some() { stance.floor } else { clip_floor(source, clip, pelvis, stance.floor).height };
        (source_rest_floor, source_floor) = (stance.floor * unit, floor * unit);
    }
    let target_rest_floor = stance(target).map_or(0.0, |(_, stance)| stance.floor);
    let (travel, target_floor) = match &mapping.pelvis {
        Some(pelvis) => {
            // The floor does not sink with a pelvis that is offset.
            let travel = |scale: DVec3| {
                let turn = DMat3::from_quat(pelvis.plain.ours_from_plan);
                turn.transpose() * DMat3::from_diagonal(scale) * turn
            };
            let away = up * (source_floor - pelvis.plain.source_sole) - pelvis.plain.source_origin;
            let floor = pelvis.plain.target_origin + travel(pelvis.plain.scale) * away;
            (travel(pelvis.position.scale), floor.dot(up))
        }
        None => (DMat3::from_diagonal(DVec3::splat(mapping.global_scale)), target_rest_floor),
    };
    Ground {
        up,
        front,
        units_per_metre: target.unit_metres.recip(),
        travel,
        source_rest_floor,
        source_floor,
        target_rest_floor,
        target_floor,
    }
}
