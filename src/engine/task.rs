//! What the engine makes: a retarget, an edit, a pose or a drawing that moves, each with the files that it reads.

use crate::{
    formats::Limits,
    model::{Control, Phase, Reporter},
    retarget::{RetargetSpec, Task as SpecTask, parse_document},
    rig::PoseSpec,
};

use super::{
    DrawInputs, EditInputs, Failure, Inputs, Knowledge, NamedBytes, Outcome, PoseInputs, draw::drawn, edit::edited,
    files::read_spec, pose::posed, retarget::retargeted, task_context::TaskContext,
};

/// The warning `empty_config`, of a config file without a word: what is the matter, and what to do.
pub const EMPTY_CONFIG: (&str, &str) = (
    "the config is empty; everything is found out, as without a config",
    "check that the file was written, or send {} where it is meant",
);

/// Whether a config file is there and says nothing.
#[must_use]
pub fn is_empty_config(config: NamedBytes<'_>) -> bool {
    config.bytes.trim_ascii().is_empty()
}

pub(super) fn warn_of_empty_config(config: Option<NamedBytes<'_>>, reporter: &mut Reporter) {
    if config.is_some_and(is_empty_config) {
        let (detail, hint) = EMPTY_CONFIG;
        reporter.warn("empty_config", "", detail, hint);
    }
}

/// What is to be made, and of what.
#[derive(Clone, Copy, Debug)]
pub enum Task<'a> {
    /// The source's clip on the target.
    Retarget(Inputs<'a>),
    /// The source's clip, edited.
    Edit(EditInputs<'a>),
    /// The target in a pose.
    Pose(PoseInputs<'a>),
    /// A drawing that moves.
    Draw(DrawInputs<'a>),
}

/// A task by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskKind {
    /// [`Task::Retarget`].
    Retarget,
    /// [`Task::Edit`].
    Edit,
    /// [`Task::Pose`].
    Pose,
    /// [`Task::Draw`].
    Draw,
}

/// What a config asks for, by its plain words. One that cannot be read asks for a retarget, which then says what is wrong with it.
#[must_use]
pub fn task_of(config: Option<NamedBytes<'_>>) -> TaskKind {
    let document = config.and_then(|config| parse_document(config.bytes).ok()).unwrap_or_default();
    let asks_for = |name: &str| document.get("task").is_some_and(|task| task == name);
    if asks_for("draw") {
        return TaskKind::Draw;
    }
    let asks_for_edit = asks_for("edit");
    let has_pose = document.get("pose").is_some_and(|pose| !pose.is_null());
    match (has_pose, asks_for_edit) {
        (true, _) => TaskKind::Pose,
        (false, true) => TaskKind::Edit,
        (false, false) => TaskKind::Retarget,
    }
}

impl<'a> Task<'a> {
    /// What the spec asks for, with the files of a retarget.
    fn asked(spec: &RetargetSpec, inputs: &Inputs<'a>) -> Self {
        let Inputs { source, target, source_rest, target_rest, config, formats } = *inputs;
        match (&spec.pose, spec.task) {
            (Some(_), _) => {
                let source = Some(source);
                Self::Pose(PoseInputs { target, target_rest, source, source_rest, to: None, config, formats })
            }
            (None, SpecTask::Edit) => {
                Self::Edit(EditInputs { source, source_rest, unread_target: true, config, formats })
            }
            (None, SpecTask::Retarget) => Self::Retarget(*inputs),
        }
    }

    const fn config(&self) -> Option<NamedBytes<'a>> {
        match self {
            Self::Retarget(inputs) => inputs.config,
            Self::Edit(inputs) => inputs.config,
            Self::Pose(inputs) => inputs.config,
            Self::Draw(inputs) => inputs.config,
        }
    }
}

/// Makes what is asked for, with what is known of rigs beside what the program comes with.
///
/// # Errors
/// When an input cannot be read, the spec does not fit, there is nothing to work on, or the work is canceled.
pub fn run(task: &Task<'_>, knowledge: &Knowledge, limits: &Limits, control: &Control) -> Result<Outcome, Failure> {
    match task {
        Task::Draw(inputs) => drawn(inputs, knowledge, limits, control),
        task => perform(|_| *task, task.config(), knowledge, limits, control),
    }
}

/// Retargets, or whatever else the config asks for.
///
/// # Errors
/// As [`run`].
pub fn retarget(inputs: &Inputs<'_>, limits: &Limits, control: &Control) -> Result<Outcome, Failure> {
    retarget_with(inputs, &Knowledge::default(), limits, control)
}

/// As [`retarget`], with what is known of rigs beside what the program comes with.
///
/// # Errors
/// As [`run`].
pub fn retarget_with(
    inputs: &Inputs<'_>,
    knowledge: &Knowledge,
    limits: &Limits,
    control: &Control,
) -> Result<Outcome, Failure> {
    perform(|spec| Task::asked(spec, inputs), inputs.config, knowledge, limits, control)
}

/// Edits one clip of a file and writes it back onto the file's own skeleton, mesh and all where the format has them.
///
/// # Errors
/// As [`run`].
pub fn edit(inputs: &EditInputs<'_>, limits: &Limits, control: &Control) -> Result<Outcome, Failure> {
    run(&Task::Edit(*inputs), &Knowledge::default(), limits, control)
}

fn perform<'a>(
    task: impl FnOnce(&RetargetSpec) -> Task<'a>,
    config: Option<NamedBytes<'_>>,
    knowledge: &Knowledge,
    limits: &Limits,
    control: &Control,
) -> Result<Outcome, Failure> {
    let begin = control.seconds();
    control.enter(Phase::Read, 0);
    let mut spec = read_spec(config)?;
    let task = task(&spec);
    // The resolved spec says it too: run again, it does the same.
    match &task {
        Task::Draw(_) => {}
        Task::Retarget(_) => (spec.task, spec.pose) = (SpecTask::Retarget, None),
        Task::Edit(_) => spec.task = SpecTask::Edit,
        Task::Pose(inputs) => {
            let said = spec.pose.unwrap_or_default();
            spec.pose = Some(inputs.to.map_or(said, |to| PoseSpec { to }));
        }
    }
    let mut reporter = Reporter::new();
    warn_of_empty_config(config, &mut reporter);
    let work = TaskContext { spec, knowledge, limits, control, begin, reporter };
    match task {
        Task::Retarget(inputs) => retargeted(work, &inputs),
        Task::Edit(inputs) => edited(work, &inputs),
        Task::Pose(inputs) => posed(work, &inputs),
        Task::Draw(inputs) => drawn(&inputs, knowledge, limits, control),
    }
}
