//! The engine as the service sees it.

use std::collections::BTreeMap;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::{
    engine::{
        self, Control, DisplayOptions, DrawInputs, EditInputs, Failure, FailureCode, Format, Inputs, Knowledge, Limits,
        NamedBytes, Outcome, Output, PoseChoice, PoseInputs, PreviewOptions, Report, Task, Timings,
    },
    store::{InputRole, JobRequest, JobTask, JobVerdict, Judgment, Store, StoreError},
};

/// What the engine can be asked, as plain data: the files go beside it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Question {
    /// The source's clip on the target.
    Retarget,
    /// The source's clip, edited.
    Edit,
    /// The target in a pose: that one, or the one that the config says.
    Pose {
        /// Which.
        to: Option<PoseChoice>,
    },
    /// The target, a drawing, as the source moves it.
    Draw,
    /// What the source holds.
    Inspect,
    /// What a retarget would do.
    Propose,
    /// Why a joint of the result is turned as it is.
    Explain {
        /// At that frame.
        frame: usize,
        /// Of the target.
        joint: String,
    },
    /// The config as it is understood.
    CheckConfig,
    /// What the source looks like.
    Preview(Box<PreviewOptions>),
    /// The source as a plain GLB.
    Display(Box<DisplayOptions>),
    /// Mask and joints of the figure in the source, a picture; the target is its mask, where one is given.
    Annotate {
        /// Name of the kind of body, or `auto`.
        rig: String,
        /// Whether the files are wanted, in place of what was found.
        as_archive: bool,
    },
}

impl Question {
    /// That of a job.
    ///
    /// # Errors
    /// When no pose has the name that the job has.
    pub(super) fn of_job(task: &JobTask) -> Result<Self, Failure> {
        let choice = |to: &String| {
            serde_json::from_value::<PoseChoice>(to.as_str().into())
                .map_err(|_| Failure::new(FailureCode::InvalidValue, format!("no pose is called '{to}'")))
        };
        Ok(match task {
            JobTask::Retarget => Self::Retarget,
            JobTask::Edit => Self::Edit,
            JobTask::Draw => Self::Draw,
            JobTask::Pose { to } => Self::Pose { to: to.as_ref().map(choice).transpose()? },
        })
    }
}

/// The files of a question.
#[derive(Clone, Copy, Debug, Default)]
pub struct Files<'a> {
    /// The file with the animation.
    pub source: Option<NamedBytes<'a>>,
    /// The file with the character.
    pub target: Option<NamedBytes<'a>>,
    /// The source rig in its rest pose.
    pub source_rest: Option<NamedBytes<'a>>,
    /// The target rig in its rest pose.
    pub target_rest: Option<NamedBytes<'a>>,
    /// What goes beside a drawing; where it is annotated, the pose model.
    pub scene: Option<NamedBytes<'a>>,
    /// The retarget spec.
    pub config: Option<NamedBytes<'a>>,
    /// The SHA-256 of the target in hexadecimal, where it is known: who works on the same target again may have kept it.
    pub target_sha256: Option<&'a str>,
}

/// A question with everything that its answer depends on.
#[derive(Clone, Debug)]
pub struct EngineRequest<'a> {
    /// What is asked.
    pub question: Question,
    /// Of what.
    pub files: Files<'a>,
    /// The formats wanted. Empty: what the config says.
    pub formats: &'a [Format],
    /// What users taught beside what the program knows.
    pub knowledge: &'a Knowledge,
    /// How large files may be.
    pub limits: &'a Limits,
}

/// What the engine says.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// To a task: what it gave.
    EngineResult(Box<EngineResult>),
    /// To how a file looks: an encoded picture, or a GLB for viewers.
    Picture(Vec<u8>),
    /// To a drawing whose files are wanted: a zip archive.
    Archive(Vec<u8>),
    /// To everything else: a JSON object.
    Document(serde_json::Value),
}

/// A file that came out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputFile {
    /// The file.
    pub output: Output,
    /// The SHA-256 of its bytes in hexadecimal, where it was found on the way.
    pub sha256: Option<String>,
}

/// What a retarget gave, as plain data that can come from anywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct EngineResult {
    /// The files.
    pub outputs: Vec<OutputFile>,
    /// What was measured, as JSON.
    pub report: String,
    /// The spec with everything found out filled in, as JSON.
    pub resolved_spec: String,
    /// How long each phase took.
    pub timings: Timings,
    /// How many warnings the report has.
    pub warnings: u64,
    /// What the report says of the result as a whole.
    pub judgment: Option<Judgment>,
}

impl TryFrom<Outcome> for EngineResult {
    type Error = Failure;

    fn try_from(outcome: Outcome) -> Result<Self, Failure> {
        let Outcome { outputs, report, resolved_spec } = outcome;
        Ok(Self {
            outputs: outputs.into_iter().map(|output| OutputFile { output, sha256: None }).collect(),
            resolved_spec: resolved_spec.to_string(),
            timings: report.timings,
            warnings: report.warnings.len() as u64,
            judgment: judgment(&report),
            report: serde_json::to_string(&report).map_err(|error| no_json(&error))?,
        })
    }
}

/// What a report says of the result as a whole.
fn judgment(report: &Report) -> Option<Judgment> {
    let verdict = |name: &str| JobVerdict::from_name(name).unwrap_or(JobVerdict::NotApplicable);
    if let Some(drawing) = &report.drawing {
        let (reason, coverage) = (drawing.verdict_reason.clone(), Some(drawing.coverage));
        return Some(Judgment { verdict: verdict(drawing.verdict.name()), reason, coverage });
    }
    let measures = report.measures.as_ref()?;
    let (reason, coverage) = (measures.verdict_reason.clone(), measures.coverage);
    Some(Judgment { verdict: verdict(measures.verdict.name()), reason, coverage })
}

/// What does the work. Handed in, so that tests of the scheduling need no real files.
pub trait Engine: Send + Sync + 'static {
    /// Whether a file that brings the engine down does no harm to this process.
    fn is_isolated(&self) -> bool {
        false
    }

    /// Answers. Must look at `control` every few milliseconds.
    ///
    /// # Errors
    /// As the function of [`engine`] that answers that question.
    fn ask(&self, asked: &EngineRequest<'_>, control: &Control) -> Result<Answer, Failure>;

    /// Lets go of what has not been used for a while; to be called from time to time.
    fn tidy(&self) {}
}

/// The real one.
#[derive(Clone, Copy, Debug, Default)]
pub struct RetargetEngine;

impl Engine for RetargetEngine {
    fn ask(&self, asked: &EngineRequest<'_>, control: &Control) -> Result<Answer, Failure> {
        let knowledge = asked.knowledge.parsed()?;
        let (knowledge, limits, files) = (knowledge.as_ref(), asked.limits, &asked.files);
        if let Some(task) = asked.task()? {
            return Ok(Answer::EngineResult(Box::new(engine::run(&task, knowledge, limits, control)?.try_into()?)));
        }
        match &asked.question {
            Question::Inspect => document(engine::inspect_with(files.source()?, knowledge, limits, control)?),
            Question::Explain { frame, joint } => {
                let question = engine::Question { frame: *frame, joint };
                document(engine::explain(&asked.pair()?, &question, knowledge, limits, control)?)
            }
            Question::Preview(options) => {
                Ok(Answer::Picture(engine::preview(files.source()?, options, limits, control)?.bytes))
            }
            Question::Display(options) => {
                Ok(Answer::Picture(engine::display(files.source()?, options, limits, control)?))
            }
            Question::Annotate { rig, as_archive } => annotate(files, rig, *as_archive, control),
            Question::CheckConfig => {
                let config = files.config.ok_or_else(|| missing("config"))?;
                engine::check_config(config).map(Answer::Document)
            }
            _ => document(engine::propose(&asked.pair()?, knowledge, limits, control)?),
        }
    }
}

fn annotate(files: &Files<'_>, rig: &str, as_archive: bool, control: &Control) -> Result<Answer, Failure> {
    let kind = engine::body_kind(rig)?;
    let model = files.scene.map(|model| engine::read_pose_model(model.bytes.to_vec())).transpose()?;
    let drawing = engine::annotate_drawing(files.source()?, files.target, kind, model.as_ref(), control)?;
    if as_archive { drawing.archive().map(Answer::Archive) } else { document(drawing.view()) }
}

/// The bytes of a job's files, by what they are to it.
#[derive(Debug)]
pub(super) struct InputBytes(BTreeMap<InputRole, Bytes>);

impl InputBytes {
    /// Reads the files of a job.
    ///
    /// # Errors
    /// When the store fails.
    pub(super) async fn read(store: &Store, request: &JobRequest) -> Result<Self, StoreError> {
        let mut bytes = BTreeMap::new();
        for (role, input) in &request.inputs {
            bytes.insert(*role, store.blobs().read(&input.sha256).await?);
        }
        Ok(Self(bytes))
    }

    pub(super) const fn new(bytes: BTreeMap<InputRole, Bytes>) -> Self {
        Self(bytes)
    }

    /// As the engine takes them. `request` is the one that they were read for.
    pub(super) fn files<'a>(&'a self, request: &'a JobRequest) -> Files<'a> {
        let find = |role: InputRole| {
            Some(NamedBytes { name: &request.inputs.get(&role)?.file_name, bytes: self.0.get(&role)? })
        };
        let config = request.config.as_ref();
        Files {
            source: find(InputRole::Source),
            target: find(InputRole::Target),
            source_rest: find(InputRole::SourceRest),
            target_rest: find(InputRole::TargetRest),
            scene: find(InputRole::Scene),
            config: config.map(|config| NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() }),
            target_sha256: request.inputs.get(&InputRole::Target).map(|target| target.sha256.as_str()),
        }
    }
}

impl<'a> Files<'a> {
    fn source(&self) -> Result<NamedBytes<'a>, Failure> {
        self.source.ok_or_else(|| missing("source"))
    }

    fn target(&self) -> Result<NamedBytes<'a>, Failure> {
        self.target.ok_or_else(|| missing("target"))
    }
}

impl<'a> EngineRequest<'a> {
    /// A question about a config alone.
    #[must_use]
    pub fn of_config(config: NamedBytes<'a>, knowledge: &'a Knowledge, limits: &'a Limits) -> Self {
        let files = Files { config: Some(config), ..Files::default() };
        Self { question: Question::CheckConfig, files, formats: &[], knowledge, limits }
    }

    /// The task that is asked for; nothing where the question is another one.
    fn task(&self) -> Result<Option<Task<'a>>, Failure> {
        let Files { source, target, source_rest, target_rest, scene, config, target_sha256: _ } = self.files;
        let formats = self.formats;
        Ok(Some(match &self.question {
            Question::Retarget => Task::Retarget(self.inputs(self.files.source()?, self.files.target()?)),
            Question::Edit => Task::Edit(EditInputs {
                source: self.files.source()?,
                source_rest,
                unread_target: target.is_some(),
                config,
                formats,
            }),
            Question::Pose { to } => {
                let target = self.files.target()?;
                Task::Pose(PoseInputs { target, target_rest, source, source_rest, to: *to, config, formats })
            }
            Question::Draw => Task::Draw(DrawInputs { source, drawing: self.files.target()?, scene, config, formats }),
            Question::Inspect
            | Question::Propose
            | Question::Explain { .. }
            | Question::CheckConfig
            | Question::Display(_)
            | Question::Preview(_)
            | Question::Annotate { .. } => return Ok(None),
        }))
    }

    /// Both files of a retarget; one that is alone, such as that of an edit, stands for both.
    fn pair(&self) -> Result<Inputs<'a>, Failure> {
        let Files { source, target, .. } = self.files;
        let source = source.or(target).ok_or_else(|| missing("source"))?;
        Ok(self.inputs(source, target.unwrap_or(source)))
    }

    const fn inputs(&self, source: NamedBytes<'a>, target: NamedBytes<'a>) -> Inputs<'a> {
        let Files { source_rest, target_rest, config, .. } = self.files;
        Inputs { source, target, source_rest, target_rest, config, formats: self.formats }
    }
}

impl Answer {
    /// What a task gave.
    ///
    /// # Errors
    /// When it is the answer to another question.
    pub fn ran(self) -> Result<EngineResult, Failure> {
        match self {
            Self::EngineResult(ran) => Ok(*ran),
            Self::Document(_) | Self::Picture(_) | Self::Archive(_) => Err(otherwise("the result of a task")),
        }
    }

    /// The document.
    ///
    /// # Errors
    /// When it is the answer to another question.
    pub fn document(self) -> Result<serde_json::Value, Failure> {
        match self {
            Self::Document(document) => Ok(document),
            Self::EngineResult(_) | Self::Picture(_) | Self::Archive(_) => Err(otherwise("a document")),
        }
    }

    /// The picture.
    ///
    /// # Errors
    /// When it is the answer to another question.
    pub fn picture(self) -> Result<Vec<u8>, Failure> {
        match self {
            Self::Picture(bytes) => Ok(bytes),
            Self::EngineResult(_) | Self::Document(_) | Self::Archive(_) => Err(otherwise("a picture")),
        }
    }

    /// The archive.
    ///
    /// # Errors
    /// When it is the answer to another question.
    pub fn archive(self) -> Result<Vec<u8>, Failure> {
        match self {
            Self::Archive(bytes) => Ok(bytes),
            Self::EngineResult(_) | Self::Document(_) | Self::Picture(_) => Err(otherwise("an archive")),
        }
    }
}

fn otherwise(wanted: &str) -> Failure {
    Failure::new(FailureCode::Internal, format!("the engine answers with something else than {wanted}"))
}

fn missing(part: &'static str) -> Failure {
    Failure::new(FailureCode::Internal, format!("the file '{part}' is missing")).in_part(part)
}

fn document(answer: impl Serialize) -> Result<Answer, Failure> {
    serde_json::to_value(answer).map(Answer::Document).map_err(|error| no_json(&error))
}

fn no_json(error: &serde_json::Error) -> Failure {
    Failure::new(FailureCode::Internal, format!("the answer is not valid JSON: {error}"))
}
