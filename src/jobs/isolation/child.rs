//! An engine process from inside: it reads requests, works, and answers.

use std::{
    io,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::Duration,
};

use super::{
    frames,
    kept_target::KeptTarget,
    limits::{self, Bounds},
    messages::{Message, Reply, Request},
    sandbox, signals,
    threads::Threads,
};
use crate::{
    config::trigger_named,
    engine::{Control, Failure, FailureCode, Format, Knowledge, Memory, Output},
    jobs::{Answer, Engine, EngineRequest, EngineResult, OutputFile, RetargetEngine, failure, running::progress_of},
    telemetry::monotonic_seconds,
};

/// How often the parent is told how far the work is.
const TELL: Duration = Duration::from_millis(100);

/// A request that has arrived, its files, and what stops the work on it.
struct Received {
    request: Request,
    blobs: Vec<Vec<u8>>,
    control: Arc<Control>,
}

/// A reply and the bytes that go with it.
struct Sent {
    reply: Reply,
    blobs: Vec<Vec<u8>>,
}

/// Serves requests from standard input until it ends.
///
/// # Errors
/// When the process cannot be bounded, or nobody hears its answers.
pub fn serve(bounds: &Bounds) -> io::Result<()> {
    // It is started as /proc/self/exe, which lists of processes would show as `exe`. One without a name still works.
    #[cfg(target_os = "linux")]
    let _ = rustix::thread::set_name(c"retargetd-work");
    signals::leave_to_parent()?;
    limits::at_start(bounds)?;
    // Before there is another thread: each has its own.
    let sandbox = sandbox::enter();
    // The parent asks for one thing after another.
    let (sender, requests) = mpsc::sync_channel(1);
    thread::Builder::new().name("requests".to_owned()).spawn(move || receive(&sender))?;
    // The one thread that writes, so answers are never torn.
    let mut output = unbuffered_output()?;
    frames::write(&mut output, &Reply::Ready(sandbox), &[])?;
    let mut threads = Threads::default();
    let (memory, mut target) = (Arc::new(Memory::default()), KeptTarget::default());
    for Received { request, blobs, control } in requests {
        limits::for_one_request(bounds)?;
        let files = target.put_back(&request, blobs)?;
        let working = Arc::clone(&control);
        let (sender, done) = mpsc::sync_channel(1);
        let (bounds, memory) = (*bounds, Arc::clone(&memory));
        threads.of(request.threads)?.spawn(move || {
            let work = std::panic::AssertUnwindSafe(|| answer(&request, &files, &working, memory));
            let reply = std::panic::catch_unwind(work).unwrap_or_else(|_| Sent::of(Reply::Panicked));
            let reply = reply.within(bounds.output_bytes);
            // Nobody is left to tell when the process ends.
            let _ = sender.send(reply);
        });
        let mut told = None;
        let reply = loop {
            match done.recv_timeout(TELL) {
                Ok(reply) => break reply,
                Err(RecvTimeoutError::Disconnected) => break Sent::of(Reply::Panicked),
                Err(RecvTimeoutError::Timeout) => {
                    let progress = progress_of(&control);
                    if told.as_ref() != Some(&progress) {
                        frames::write(&mut output, &Reply::Progress(progress.clone()), &[])?;
                        told = Some(progress);
                    }
                }
            }
        };
        let blobs: Vec<&[u8]> = reply.blobs.iter().map(Vec::as_slice).collect();
        frames::write(&mut output, &reply.reply, &blobs)?;
    }
    Ok(())
}

/// Standard output as it is: what Rust makes of it looks for the ends of lines.
#[cfg(unix)]
fn unbuffered_output() -> io::Result<impl io::Write> {
    use std::os::fd::AsFd as _;
    Ok(std::fs::File::from(io::stdout().as_fd().try_clone_to_owned()?))
}

#[cfg(not(unix))]
fn unbuffered_output() -> io::Result<impl io::Write> {
    Ok(io::stdout().lock())
}

/// Reads what the parent says. When the parent is gone, whatever is being worked on is for nobody.
#[expect(clippy::disallowed_methods, reason = "an unwanted engine process must not listen or hold files")]
fn receive(sender: &mpsc::SyncSender<Received>) {
    let mut input = io::stdin().lock();
    let current: Mutex<Arc<Control>> = Mutex::default();
    while let Ok(Some((message, blobs))) = frames::read::<Message>(&mut input) {
        match message {
            Message::Ask(request) => {
                let control = Arc::new(Control::with_clock(monotonic_seconds));
                *current.lock().unwrap_or_else(PoisonError::into_inner) = Arc::clone(&control);
                if sender.send(Received { request: *request, blobs, control }).is_err() {
                    break;
                }
            }
            Message::Cancel => current.lock().unwrap_or_else(PoisonError::into_inner).cancel(),
        }
    }
    std::process::exit(0);
}

fn answer(request: &Request, files: &[Arc<Vec<u8>>], control: &Control, memory: Arc<Memory>) -> Sent {
    trigger_named(request.names.first().and_then(Option::as_deref).unwrap_or_default());
    let formats: Vec<Format> = request.formats.iter().filter_map(|name| Format::from_name(name)).collect();
    let asked = EngineRequest {
        question: request.question.clone(),
        files: request.files(files),
        formats: &formats,
        knowledge: &Knowledge::unread(request.rigs.clone()).remembering(memory),
        limits: &request.limits,
    };
    match RetargetEngine.ask(&asked, control) {
        Ok(Answer::EngineResult(ran)) => Sent::ran(*ran),
        Ok(Answer::Document(document)) => {
            Sent { reply: Reply::Document, blobs: vec![document.to_string().into_bytes()] }
        }
        Ok(Answer::Picture(bytes)) => Sent { reply: Reply::Picture, blobs: vec![bytes] },
        Ok(Answer::Archive(bytes)) => Sent { reply: Reply::Archive, blobs: vec![bytes] },
        Err(failed) => Sent::of(Reply::Failed(failure::keep(failed))),
    }
}

fn too_much_output(bytes: u64, most: u64) -> Failure {
    let detail = format!("what the job gives has {bytes} bytes, more than the limit 'output_bytes' of {most} allows");
    Failure::new(FailureCode::AssetLimitExceeded, detail)
        .with_hint("ask for fewer formats, fewer frames, or a format that takes less, such as glb in place of json")
}

impl Sent {
    const fn of(reply: Reply) -> Self {
        Self { reply, blobs: Vec::new() }
    }

    /// Itself, unless it is larger than an answer may be.
    fn within(self, most: u64) -> Self {
        let bytes = self.blobs.iter().map(|blob| blob.len() as u64).sum::<u64>();
        if bytes <= most {
            return self;
        }
        Self::of(Reply::Failed(failure::keep(too_much_output(bytes, most))))
    }

    fn ran(ran: EngineResult) -> Self {
        let EngineResult { outputs, report, resolved_spec, timings, warnings, judgment } = ran;
        let parts =
            |OutputFile { output: Output { format, name, bytes }, .. }| ((format.info().name.to_owned(), name), bytes);
        let (names, files): (Vec<_>, Vec<_>) = outputs.into_iter().map(parts).unzip();
        let texts = [report.into_bytes(), resolved_spec.into_bytes()];
        let blobs = texts.into_iter().chain(files).collect();
        Self { reply: Reply::EngineResult { timings, warnings, judgment, outputs: names }, blobs }
    }
}
