//! The subcommands. Each is one file with its arguments and a `run`; none has logic of its own beyond reading files,
//! calling the engine or the service, and telling the user.

mod annotate;
mod batch;
mod check_config;
mod clips;
mod compare;
mod demo;
mod draw;
mod edit;
mod engine_process;
mod exit;
mod explain;
mod files;
mod health;
mod hints;
mod inputs;
mod inspect;
mod joint_table;
mod keys;
mod limits;
mod long_clip;
mod manner;
mod openapi;
mod outputs;
mod pages;
mod pose;
mod preview;
mod retarget;
mod rows;
mod samples;
mod serve;
mod service;
mod setting_argument;
mod submit;
mod suggest;
mod table;
mod usage;
mod user_knowledge;
mod verdict;
mod view;
mod watch;
mod worker;

use std::{ffi::OsString, process::ExitCode};

use clap::{CommandFactory, Parser, Subcommand};

/// How a command ends, for its help.
const EXIT_CODES: &str =
    "Exit codes: 0 done, 2 bad usage, 3 an input was refused, 4 failed, 5 done but worse than --fail-on allows";

/// Moves character animation from any rig to any rig.
#[derive(Debug, Parser)]
#[command(name = "retargetd", version, about, propagate_version = true, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    manner: manner::Manner,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the HTTP service: API and workers in one process.
    Serve(service::Arguments),
    /// Run jobs that `serve` takes on in other processes, on the same Postgres database and the same file store.
    Worker(service::WorkerArguments),
    /// Retarget one clip onto one character, without a server.
    #[command(after_help = EXIT_CODES)]
    Retarget(retarget::Arguments),
    /// Run `retarget` on a running service: upload, follow, download.
    #[command(after_help = EXIT_CODES)]
    Submit(submit::Arguments),
    /// Edit one clip of a file: timing, loop seams, mirroring; without a second rig.
    #[command(after_help = EXIT_CODES)]
    Edit(edit::Arguments),
    /// Animate a drawn character: a scene of *Animated Drawings*, without that program.
    Draw(draw::Arguments),
    /// Find mask and joints of the figure in a picture, and write the folder that `draw` reads.
    Annotate(annotate::Arguments),
    /// Say why a joint of the result is turned as it is at one frame.
    Explain(explain::Arguments),
    /// Say what files hold: skeleton, clips, recognized rig, roles, rest pose, units, warnings.
    #[command(after_help = EXIT_CODES)]
    Inspect(inspect::Arguments),
    /// Render a file: a still, a sheet of stills or a moving picture.
    Preview(preview::Arguments),
    /// Render two files at the same time, equally tall, side by side or the first as a ghost over the second
    Compare(compare::Arguments),
    /// Show what a retarget of two files would do, and write the config for it.
    Suggest(suggest::Arguments),
    /// Write a table of joint pairs as a starting point for a spreadsheet.
    JointTable(joint_table::Arguments),
    /// Check a config, alone or against two files, without retargeting.
    CheckConfig(check_config::Arguments),
    /// Put a character into a T pose, an A pose or the pose of another one, and write it to a file.
    Pose(pose::Arguments),
    /// Run a retarget over HTTP on an empty data folder, with the built-in sample.
    Demo(demo::Arguments),
    /// Write a sample clip and a sample character.
    Samples(samples::Arguments),
    /// Print the OpenAPI document.
    Openapi(openapi::Arguments),
    /// Create, list and revoke keys that authenticate callers.
    Keys(keys::Arguments),
    /// Check whether a running service is ready; for container health checks.
    Health(health::Arguments),
    /// Print a script that completes command lines in a shell
    Completions(pages::CompletionArguments),
    /// Print the manual page, or write those of all subcommands
    Man(pages::ManArguments),
    /// What the service starts to run the engine in; not for people.
    #[command(hide = true)]
    EngineProcess(engine_process::Arguments),
}

/// Parses the command line and runs the subcommand.
#[must_use]
pub fn run() -> ExitCode {
    run_words(std::env::args_os().collect())
}

/// The same for a command line that is handed in, the program's name first, and with the exit code as a number: for programs that this
/// library is a part of.
#[must_use]
pub fn run_with(command_line: Vec<OsString>) -> u8 {
    let code = run_words(command_line);
    (0..=u8::MAX).find(|number| ExitCode::from(*number) == code).unwrap_or(exit::FAILED)
}

fn run_words(command_line: Vec<OsString>) -> ExitCode {
    let Arguments { command, manner } = match Arguments::try_parse_from(&command_line) {
        Ok(arguments) => arguments,
        Err(error) => match usage::refused(&error, &usage::named(Arguments::command(), &command_line)) {
            // Asked for in any way, since what follows could not be read.
            Some(exit) => {
                manner::Manner::of_words(command_line.into_iter()).set();
                return exit.tell();
            }
            None => error.exit(),
        },
    };
    manner.set();
    dispatch(command)
}

fn dispatch(command: Command) -> ExitCode {
    let done = match command {
        Command::Serve(arguments) => return serve::run(&arguments),
        Command::Worker(arguments) => return worker::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Retarget(arguments) => match &arguments.batch {
            Some(place) => batch::run(&arguments, place),
            None => retarget::run(&arguments),
        },
        Command::Submit(arguments) => submit::run(&arguments),
        Command::Draw(arguments) => draw::run(&arguments),
        Command::Annotate(arguments) => annotate::run(&arguments),
        Command::Edit(arguments) => edit::run(&arguments),
        Command::Inspect(arguments) => inspect::run(&arguments),
        Command::Preview(arguments) => preview::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Suggest(arguments) => suggest::run(&arguments),
        Command::JointTable(arguments) => joint_table::run(&arguments),
        Command::CheckConfig(arguments) => check_config::run(&arguments),
        Command::Pose(arguments) => pose::run(&arguments),
        Command::Demo(arguments) => return demo::run(arguments),
        Command::Samples(arguments) => samples::run(&arguments),
        Command::Openapi(arguments) => return openapi::run(&arguments),
        Command::Keys(arguments) => keys::run(arguments),
        Command::Health(arguments) => health::run(arguments),
        Command::Completions(arguments) => pages::complete(&arguments, Arguments::command()),
        Command::Man(arguments) => pages::man(&arguments, Arguments::command()),
        Command::EngineProcess(arguments) => return engine_process::run(&arguments),
    };
    done.map_or_else(|exit| exit.tell(), |()| ExitCode::SUCCESS)
}

/// What runs the work of a subcommand that waits for others.
fn runtime() -> Result<tokio::runtime::Runtime, exit::Exit> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.map_err(|error| exit::Exit::new(exit::FAILED, error.to_string(), ""))
}
