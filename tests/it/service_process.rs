//! The real binary as a service or a worker, and where it listens.

use std::{
    io::{BufRead, BufReader},
    process::{Child, ChildStdout, Command, Stdio},
    time::Duration,
};

/// The id of what an answer says was made. A refusal is shown as it came: a full disk must not look like an id that is missing.
pub(crate) async fn taken(answer: reqwest::Response) -> String {
    let (asked, status) = (answer.url().clone(), answer.status());
    let body = answer.text().await.unwrap_or_else(|error| format!("(the answer broke off: {error})"));
    let made: Option<serde_json::Value> = serde_json::from_str(&body).ok();
    let id = made.as_ref().filter(|_| status.is_success()).and_then(|made| made["id"].as_str());
    id.unwrap_or_else(|| panic!("{asked} was refused with {status}: {body}")).to_owned()
}

/// A process of the service. Dropping it kills it.
pub(crate) struct ServiceProcess {
    child: Child,
    /// Where it listens; empty for a worker.
    pub(crate) url: String,
    /// What else it says.
    output: Option<BufReader<ChildStdout>>,
}

impl ServiceProcess {
    /// Starts one that says where it listens, and waits until it does.
    pub(crate) fn listening(command: &mut Command) -> Self {
        Self::listening_with_log(command, Stdio::null())
    }

    /// The same, with its log lines going there.
    pub(crate) fn listening_with_log(command: &mut Command, log: impl Into<Stdio>) -> Self {
        let mut child = spawn(command, log.into());
        let output = child.stdout.take().map(BufReader::new);
        let mut process = Self { child, url: String::new(), output };
        process.url = process.next_url();
        process
    }

    /// The address on the next line that it prints.
    pub(crate) fn next_url(&mut self) -> String {
        let mut line = String::new();
        self.output.as_mut().expect("its output is piped").read_line(&mut line).expect("it prints a line");
        let url = line.split_whitespace().find(|word| word.starts_with("http://")).unwrap_or_default().to_owned();
        assert!(!url.is_empty(), "the line has the address: {line:?}");
        url
    }

    /// Starts one that listens nowhere.
    pub(crate) fn silent(command: &mut Command) -> Self {
        Self { child: spawn(command, Stdio::null()), url: String::new(), output: None }
    }

    /// What the system knows it by.
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Ends it as a power cut does.
    pub(crate) fn kill(&mut self) {
        self.child.kill().expect("it can be killed");
        self.child.wait().expect("it ends");
    }

    /// Sends SIGTERM and gives the exit code.
    pub(crate) fn terminate(mut self) -> Option<i32> {
        signal(self.child.id(), "-TERM");
        self.child.wait().expect("it ends").code()
    }

    /// What sends it SIGTERM while others use it.
    pub(crate) fn stopper(&self) -> Stopper {
        Stopper(self.child.id())
    }

    /// Waits until it has ended, and gives the exit code.
    pub(crate) fn exit_code(&mut self) -> Option<i32> {
        self.child.wait().expect("it ends").code()
    }

    /// The memory that it has, in MiB. Only on Linux; 0 elsewhere.
    pub(crate) fn memory_mebibytes(&self) -> f64 {
        self.status("VmRSS:") as f64 / 1024.0
    }

    /// The most memory that it had, in MiB. Only on Linux; 0 elsewhere.
    pub(crate) fn most_memory_mebibytes(&self) -> u64 {
        self.status("VmHWM:") / 1024
    }

    /// A number of the kernel's about it; 0 where there is none.
    fn status(&self, name: &str) -> u64 {
        let text = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix(name));
        line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
    }

    /// How many files and sockets it has open. Only on Linux; 0 elsewhere.
    pub(crate) fn open_files(&self) -> u64 {
        std::fs::read_dir(format!("/proc/{}/fd", self.child.id())).map_or(0, |entries| entries.count() as u64)
    }

    /// How many processes it has started that still run. Only on Linux; 0 elsewhere.
    pub(crate) fn children(&self) -> usize {
        let own = self.child.id().to_string();
        let of_own = |entry: std::fs::DirEntry| {
            let text = std::fs::read_to_string(entry.path().join("stat")).unwrap_or_default();
            text.rsplit(')').next().unwrap_or_default().split_whitespace().nth(1) == Some(&own)
        };
        std::fs::read_dir("/proc")
            .into_iter()
            .flatten()
            .flatten()
            .filter_map(|entry| of_own(entry).then_some(()))
            .count()
    }

    /// The processor time that it and the processes below it have had so far. Only on Linux; nothing elsewhere.
    pub(crate) fn processor_time(&self) -> Duration {
        let own = self.child.id().to_string();
        let mut ticks = 0;
        for entry in std::fs::read_dir("/proc").into_iter().flatten().flatten() {
            // It may have ended in the meantime. Behind the name, which may have anything in it, fields are numbered from the state, which is 3.
            let text = std::fs::read_to_string(entry.path().join("stat")).unwrap_or_default();
            let fields: Vec<&str> = text.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
            let field = |number: usize| fields.get(number - 3).copied().unwrap_or_default();
            if entry.file_name() == *own || field(4) == own {
                ticks += field(14).parse::<u64>().unwrap_or(0) + field(15).parse::<u64>().unwrap_or(0);
            }
        }
        Duration::from_millis(ticks * 1000 / rustix::param::clock_ticks_per_second())
    }

    /// Whether it has ended by itself.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("it can be asked").is_some()
    }
}

/// Stops a process that somebody else has.
pub(crate) struct Stopper(u32);

impl Stopper {
    /// Sends SIGTERM.
    pub(crate) fn terminate(&self) {
        signal(self.0, "-TERM");
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
pub(crate) fn signal(process: u32, name: &str) {
    Command::new("kill").args([name, &process.to_string()]).status().expect("kill runs");
}

fn spawn(command: &mut Command, log: Stdio) -> Child {
    command.stdout(Stdio::piped()).stderr(log).spawn().expect("the binary starts")
}
