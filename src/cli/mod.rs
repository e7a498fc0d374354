//! The subcommands. Each is one file with its arguments and a `run`; none has logic of its own beyond reading files,
//! calling the engine or the service, and telling the user.

mod check_config;
mod compare;
mod demo;
mod draw;
mod edit;
mod engine_process;
mod exit;
mod explain;
mod files;
mod health;
mod inputs;
mod inspect;
mod joint_table;
mod keys;
mod openapi;
mod outputs;
mod pose;
mod preview;
mod retarget;
mod samples;
mod serve;
mod service;
mod submit;
mod suggest;
mod user_knowledge;
mod view;
mod watch;
mod worker;

use std::{ffi::OsString, process::ExitCode};

use clap::{Parser, Subcommand};

/// Moves character animation from any rig to any rig.
#[derive(Debug, Parser)]
#[command(name = "retargetd", version, about, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the HTTP service: API and workers in one process.
    Serve(service::Arguments),
    /// Run jobs of `serve` processes that share the Postgres database and the file store.
    Worker(service::Arguments),
    /// Retarget one clip onto one character, without a server.
    Retarget(retarget::Arguments),
    /// Run `retarget` on a running service: upload, follow, download.
    Submit(submit::Arguments),
    /// Edit one clip of a file: timing, loop seams, mirroring; without a second rig.
    Edit(edit::Arguments),
    /// Animate a drawn character: a scene of *Animated Drawings*, without that program.
    Draw(draw::Arguments),
    /// Explain the rotation of a result's joint at one frame.
    Explain(explain::Arguments),
    /// Show the contents of a file: skeleton, clips, recognized rig, roles, rest pose, units, warnings.
    Inspect(inspect::Arguments),
    /// Render a file: a still, a sheet of stills or a moving picture.
    Preview(preview::Arguments),
    /// Render two files at the same scale and time, side by side or the first as a ghost over the second
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
    /// Engine process, started by the service; not for interactive use.
    #[command(hide = true)]
    EngineProcess(engine_process::Arguments),
}

/// Parses the command line and runs the subcommand.
#[must_use]
pub fn run() -> ExitCode {
    dispatch(Arguments::parse().command)
}

/// The same for a command line that is handed in, the program's name first, and with the exit code as a number: for programs that this
/// library is a part of.
#[must_use]
pub fn run_with(command_line: Vec<OsString>) -> u8 {
    let code = dispatch(Arguments::parse_from(command_line).command);
    (0..=u8::MAX).find(|number| ExitCode::from(*number) == code).unwrap_or(exit::FAILED)
}

fn dispatch(command: Command) -> ExitCode {
    match command {
        Command::Serve(arguments) => serve::run(&arguments),
        Command::Worker(arguments) => worker::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Retarget(arguments) => retarget::run(&arguments),
        Command::Submit(arguments) => submit::run(&arguments),
        Command::Draw(arguments) => draw::run(&arguments),
        Command::Edit(arguments) => edit::run(&arguments),
        Command::Inspect(arguments) => inspect::run(&arguments),
        Command::Preview(arguments) => preview::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Suggest(arguments) => suggest::run(&arguments),
        Command::JointTable(arguments) => joint_table::run(&arguments),
        Command::CheckConfig(arguments) => check_config::run(&arguments),
        Command::Pose(arguments) => pose::run(&arguments),
        Command::Demo(arguments) => demo::run(arguments),
        Command::Samples(arguments) => samples::run(&arguments),
        Command::Openapi(arguments) => openapi::run(&arguments),
        Command::Keys(arguments) => keys::run(arguments),
        Command::Health(arguments) => health::run(arguments),
        Command::EngineProcess(arguments) => engine_process::run(&arguments),
    }
}
