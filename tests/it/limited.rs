//! The real binary on files that may do harm: how long it may take, how much memory it gets, and what it may answer.

use std::{
    fs::{self, File},
    path::Path,
    process::{Command, ExitStatus, Stdio},
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

/// No file may take longer.
const MAX_SECONDS: u64 = 10;
/// Address space that a process gets, in the unit of `ulimit -v`.
const MAX_KIBIBYTES: u32 = 1024 * 1024;
/// Exit codes that `inspect` may have: done, input refused.
pub(crate) const DONE: i32 = 0;
pub(crate) const REFUSED: i32 = 3;

/// What the binary did with a file.
pub(crate) struct Inspection {
    status: Option<ExitStatus>,
    output: Vec<u8>,
    error: String,
}

impl Inspection {
    /// What is wrong with it, when `wanted` is the exit code that it must have.
    pub(crate) fn problem(&self, wanted: Option<i32>) -> Option<String> {
        let Some(status) = self.status else { return Some(format!("still busy after {MAX_SECONDS} s")) };
        let Some(code) = status.code() else { return Some(format!("ended by a signal: {status}: {}", self.error)) };
        if self.error.contains("panicked") {
            return Some(format!("panics: {}", self.error));
        }
        if ![DONE, REFUSED].contains(&code) || wanted.is_some_and(|wanted| wanted != code) {
            return Some(format!("exit code {code}, wanted {wanted:?}: {}", self.error));
        }
        if code == REFUSED && !(self.error.starts_with("error: ") && self.error.contains("\nhint: ")) {
            return Some(format!("a refusal is an error and a hint: {}", self.error));
        }
        let object = || serde_json::from_slice::<serde_json::Value>(&self.output).is_ok_and(|value| value.is_object());
        (code == DONE && !object()).then(|| "the output is not one JSON object".to_owned())
    }
}

/// Runs `inspect --json` with a limit on its memory, and stops it when it takes too long.
pub(crate) fn inspect(file: &Path) -> Inspection {
    let folder = tempfile::tempdir().expect("a folder");
    let (output, error) = (folder.path().join("output"), folder.path().join("error"));
    let create = |path: &Path| Stdio::from(File::create(path).expect("a file in the temporary folder"));
    let mut child = Command::new("sh")
        .args(["-c", &format!("ulimit -v {MAX_KIBIBYTES}; exec \"$@\""), "sh"])
        .args([env!("CARGO_BIN_EXE_retargetd").as_ref(), "inspect".as_ref(), "--json".as_ref(), file.as_os_str()])
        .stdin(Stdio::null())
        .stdout(create(&output))
        .stderr(create(&error))
        .spawn()
        .expect("the shell starts");
    let deadline = Instant::now() + Duration::from_secs(MAX_SECONDS);
    let status = loop {
        let status = child.try_wait().expect("the child can be waited for");
        if status.is_some() || Instant::now() > deadline {
            break status;
        }
        thread::sleep(Duration::from_millis(2));
    };
    if status.is_none() {
        child.kill().expect("the child can be stopped");
        child.wait().expect("the child can be waited for");
    }
    Inspection {
        status,
        output: fs::read(output).expect("the child's output"),
        error: String::from_utf8_lossy(&fs::read(error).expect("the child's error output")).into_owned(),
    }
}

/// Applies a check to all files, as many at a time as there are cores, and returns what it found, in order.
pub(crate) fn in_parallel<T: Sync>(files: &[T], check: impl Fn(&T) -> Option<String> + Sync) -> Vec<String> {
    let next = AtomicUsize::new(0);
    let found = Mutex::new(Vec::new());
    let work = || {
        while let Some(file) = files.get(next.fetch_add(1, Ordering::Relaxed)) {
            if let Some(problem) = check(file) {
                found.lock().expect("no check panics while it holds the lock").push(problem);
            }
        }
    };
    let threads = thread::available_parallelism().map_or(2, usize::from);
    thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let mut found = found.into_inner().expect("no check panics while it holds the lock");
    found.sort();
    found
}
