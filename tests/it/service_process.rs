//! The real binary as a service or a worker, and where it listens.

use std::{
    io::{BufRead, BufReader},
    process::{Child, Command, Stdio},
};

/// A process of the service. Dropping it kills it.
pub(crate) struct ServiceProcess {
    child: Child,
    /// Where it listens; empty for a worker.
    pub(crate) url: String,
}

impl ServiceProcess {
    /// Starts one that says where it listens, and waits until it does.
    pub(crate) fn listening(command: &mut Command) -> Self {
        let mut child = spawn(command);
        let mut line = String::new();
        let output = child.stdout.take().expect("its output is piped");
        BufReader::new(output).read_line(&mut line).expect("it prints a line");
        let url = line.split_whitespace().find(|word| word.starts_with("http://")).unwrap_or_default().to_owned();
        assert!(!url.is_empty(), "the line has the address: {line:?}");
        Self { child, url }
    }

    /// Starts one that listens nowhere.
    pub(crate) fn silent(command: &mut Command) -> Self {
        Self { child: spawn(command), url: String::new() }
    }

    /// Ends it as a power cut does.
    pub(crate) fn kill(&mut self) {
        self.child.kill().expect("it can be killed");
        self.child.wait().expect("it ends");
    }

    /// Sends SIGTERM and gives the exit code.
    pub(crate) fn terminate(mut self) -> Option<i32> {
        signal(&self.child, "-TERM");
        self.child.wait().expect("it ends").code()
    }

    /// Whether it has ended by itself.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("it can be asked").is_some()
    }
}

impl Drop for ServiceProcess {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends a signal by its flag: `-TERM`, `-STOP`, ...
pub(crate) fn signal(child: &Child, name: &str) {
    Command::new("kill").args([name, &child.id().to_string()]).status().expect("kill runs");
}

fn spawn(command: &mut Command) -> Child {
    command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the binary starts")
}
