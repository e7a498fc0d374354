//! An engine process as its parent sees it.

use std::{
    io::{self, BufReader, Read},
    process::{Child, ChildStderr, ChildStdin, ChildStdout, Stdio},
    sync::{
        Arc, Mutex, Once, PoisonError,
        mpsc::{self, Receiver, RecvTimeoutError},
    },
    thread,
    time::{Duration, Instant},
};

use super::{
    frames::{self, Digested},
    kept_target::SentTarget,
    limits::Bounds,
    memory_watch::{MemoryWatch, Watched},
    messages::{Message, Reply, Request},
    priority::Priority,
    program::Program,
    sandbox::Sandbox,
};
use crate::{engine::Control, jobs::EngineRequest, telemetry::Metric};

/// How long a process may take to come up.
const START: Duration = Duration::from_secs(30);
/// How often to look whether the caller still wants the answer.
const LOOK: Duration = Duration::from_millis(10);
/// For so many milliseconds the allocator keeps memory that was freed: the next job needs as much again, and pages that come from the
/// system have to be zeroed first.
const KEEP_FREED_MEMORY: (&str, &str) = ("MIMALLOC_PURGE_DELAY", "10000");
/// Work that takes longer gives way to what is shorter.
const LONG: Duration = Duration::from_millis(500);
/// How long a process that was told to stop may take to do so. Well-behaved engines look every few milliseconds.
const STOP: Duration = Duration::from_secs(1);
/// Answers that wait to be heard: more than one only while progress is told faster than it is looked at.
const MAX_UNHEARD: usize = 16;
/// What is kept of what a process says before it dies.
const MAX_LAST_WORDS: usize = 4096;

/// Why there is no answer.
#[derive(Debug)]
pub(super) enum Lost {
    /// Nobody wants it any more.
    Canceled,
    /// The process died; how, in words.
    Crashed(String),
}

/// An engine process. Dropping it ends it.
#[derive(Debug)]
pub(super) struct EngineProcess {
    child: Child,
    input: ChildStdin,
    answers: Receiver<(Reply, Vec<Digested>)>,
    last_words: Arc<Mutex<Vec<u8>>>,
    /// The thread that hears them, which ends with the process.
    words: Option<thread::JoinHandle<()>>,
    requests: u64,
    target: SentTarget,
    watch: Watched,
    priority: Priority,
}

impl EngineProcess {
    /// Starts one and waits until it can be asked.
    pub(super) fn start(program: &Program, bounds: &Bounds, memory_watch: &MemoryWatch) -> io::Result<Self> {
        let mut command = program.command();
        command
            .arg("engine-process")
            .args(["--memory-bytes", &bounds.memory_bytes.to_string(), "--seconds", &bounds.seconds.to_string()])
            .args(["--output-bytes", &bounds.output_bytes.to_string()])
            // Nothing of ours is its business: neither the database's password nor the store's keys.
            .env_clear()
            .env(KEEP_FREED_MEMORY.0, KEEP_FREED_MEMORY.1)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        for name in PASSED_ON {
            #[expect(clippy::disallowed_methods, reason = "handed on as it is, and no setting of ours")]
            if let Some(value) = std::env::var_os(name) {
                command.env(name, value);
            }
        }
        let mut child = command.spawn()?;
        let (Some(input), Some(output), Some(errors)) = (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err(io::Error::other("a process without pipes"));
        };
        hold_more(&input);
        hold_more(&output);
        let (sender, answers) = mpsc::sync_channel(MAX_UNHEARD);
        let last_words = Arc::new(Mutex::new(Vec::new()));
        let (words, most) = (Arc::clone(&last_words), bounds.output_bytes);
        thread::Builder::new().name("engine-answers".to_owned()).spawn(move || hear(output, &sender, most))?;
        let words =
            thread::Builder::new().name("engine-words".to_owned()).spawn(move || keep_last_words(errors, &words))?;
        Metric::EngineProcesses.change(1.0);
        let watch = memory_watch.over(child.id());
        let priority = Priority::of(child.id());
        let (words, target) = (Some(words), SentTarget::default());
        let process = Self { child, input, answers, last_words, words, requests: 0, target, watch, priority };
        match process.answers.recv_timeout(START) {
            Ok((Reply::Ready(sandbox), _)) => {
                tell_of(sandbox);
                Ok(process)
            }
            _ => Err(io::Error::other("the process does not say that it is ready")),
        }
    }

    /// How many requests it was given.
    pub(super) const fn requests(&self) -> u64 {
        self.requests
    }

    /// Whether it keeps this target.
    pub(super) fn keeps_target(&self, sha256: &str) -> bool {
        self.target.is(sha256)
    }

    /// Whether the next request would be answered as fast as the first.
    pub(super) fn is_as_new(&mut self) -> bool {
        self.priority.restore()
    }

    /// Whether it has not ended.
    pub(super) fn is_alive(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Asks, and waits for the answer; tells `control` how far it is, and stops when it is canceled.
    pub(super) fn ask(
        &mut self,
        asked: &EngineRequest<'_>,
        threads: usize,
        control: &Control,
    ) -> Result<(Reply, Vec<Digested>), Lost> {
        self.requests += 1;
        let (mut request, mut blobs) = Request::new(asked);
        request.threads = threads;
        self.target.leave_out(&mut request, &mut blobs, asked.files.target_sha256);
        if frames::write(&mut self.input, &Message::Ask(Box::new(request)), &blobs).is_err() {
            return Err(self.crashed());
        }
        let began = Instant::now();
        let mut kill_at: Option<Instant> = None;
        loop {
            if began.elapsed() > LONG {
                self.priority.lower();
            }
            match self.answers.recv_timeout(LOOK) {
                Ok((Reply::Progress(progress), _)) => control.repeat(&progress.phase, progress.done, progress.total),
                Ok(answer) => return Ok(answer),
                Err(RecvTimeoutError::Disconnected) => return Err(self.crashed()),
                Err(RecvTimeoutError::Timeout) if self.watch.has_too_much() => {
                    self.end();
                    return Err(Lost::Crashed(TOO_MUCH_MEMORY.to_owned()));
                }
                Err(RecvTimeoutError::Timeout) if control.check().is_ok() => {}
                Err(RecvTimeoutError::Timeout) => match kill_at {
                    None => {
                        // A process that does not listen is ended all the same.
                        let _ = frames::write(&mut self.input, &Message::Cancel, &[]);
                        kill_at = Some(Instant::now() + STOP);
                    }
                    Some(end) if Instant::now() < end => {}
                    Some(_) => {
                        self.end();
                        return Err(Lost::Canceled);
                    }
                },
            }
        }
    }

    fn end(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    fn crashed(&mut self) -> Lost {
        // Whatever it is about to do, it is of no more use.
        let status = match self.child.try_wait() {
            Ok(Some(status)) => Ok(status),
            _ => {
                thread::sleep(LOOK);
                let _ = self.child.kill();
                self.child.wait()
            }
        };
        let status = status.map_or_else(|error| error.to_string(), |status| status.to_string());
        // On a busy machine the process may be gone before its last words are heard.
        if let Some(words) = self.words.take() {
            let _ = words.join();
        }
        let words = self.last_words.lock().unwrap_or_else(PoisonError::into_inner);
        let words = String::from_utf8_lossy(&words).into_owned();
        Lost::Crashed(how(&status, &words))
    }
}

/// Has a pipe hold what most files need, so that the two sides do not take turns over every 64 KiB of one.
#[cfg(target_os = "linux")]
fn hold_more(pipe: &impl std::os::fd::AsFd) {
    /// The most that a user may ask for, unless the machine says otherwise.
    const BYTES: usize = 1 << 20;
    // Where this is not allowed, it takes a little longer.
    let _ = rustix::pipe::fcntl_setpipe_size(pipe, BYTES);
}

#[cfg(not(target_os = "linux"))]
fn hold_more<T>(_: &T) {}

/// What the engine's thread pool and tests of its crashes look at.
const PASSED_ON: [&str; 2] = ["RAYON_NUM_THREADS", "RETARGETD_FAILPOINT"];

impl Drop for EngineProcess {
    fn drop(&mut self) {
        self.end();
        Metric::EngineProcesses.change(-1.0);
    }
}

const TOO_MUCH_MEMORY: &str = "it needed more memory than 'process_memory' allows";

/// How a process died, for people.
fn how(status: &str, words: &str) -> String {
    let reason = if words.contains("memory allocation of") || words.contains("out of memory") {
        TOO_MUCH_MEMORY
    } else if words.contains("overflowed its stack") {
        "its stack overflowed"
    } else if status.contains("SIGXCPU") {
        "it used more processor time than 'job_timeout' allows"
    } else if status.contains("SIGKILL") {
        "it was killed, most likely because the machine ran out of memory"
    } else {
        "it gave up by itself"
    };
    format!("{reason} ({status})")
}

/// Says once how far engine processes are locked in.
fn tell_of(sandbox: Sandbox) {
    static TOLD: Once = Once::new();
    TOLD.call_once(|| match sandbox.missing()[..] {
        [] => tracing::info!("engine processes have no files, no sockets and no other programs"),
        ref missing => tracing::warn!(
            missing = missing.join(", "),
            "engine processes are not locked in as far as they could be: this kernel does not let them"
        ),
    });
}

fn hear(output: ChildStdout, sender: &mpsc::SyncSender<(Reply, Vec<Digested>)>, most_bytes: u64) {
    let mut output = BufReader::new(output);
    // When it ends or says what nobody understands, the sender is dropped, which the other side sees.
    while let Ok(Some(answer)) = frames::read_digested(&mut output, most_bytes) {
        if sender.send(answer).is_err() {
            return;
        }
    }
}

fn keep_last_words(mut errors: ChildStderr, words: &Mutex<Vec<u8>>) {
    let mut buffer = [0; 1024];
    while let Ok(count @ 1..) = errors.read(&mut buffer) {
        let mut words = words.lock().unwrap_or_else(PoisonError::into_inner);
        words.extend_from_slice(&buffer[..count]);
        let surplus = words.len().saturating_sub(MAX_LAST_WORDS);
        words.drain(..surplus);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_death_is_told_in_words() {
        let cases = [
            ("signal: 6 (SIGABRT)", "memory allocation of 9 bytes failed", "process_memory"),
            ("signal: 6 (SIGABRT)", "thread 'retarget' has overflowed its stack", "its stack overflowed"),
            ("signal: 9 (SIGKILL)", "", "ran out of memory"),
            ("signal: 24 (SIGXCPU)", "", "processor time"),
            ("signal: 11 (SIGSEGV)", "", "gave up by itself (signal: 11 (SIGSEGV))"),
        ];
        for (status, words, expected) in cases {
            assert!(how(status, words).contains(expected), "{status} {words}: {}", how(status, words));
        }
    }
}
