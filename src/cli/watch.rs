//! While the engine works: a progress bar, and Ctrl-C.

use std::{
    io::IsTerminal,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::manner::is_quiet;
use crate::model::{Control, Phase};

const REDRAW: Duration = Duration::from_millis(80);

/// Cancels the work at the first Ctrl-C. The thread that waits for it ends with the process.
pub(super) fn cancel_on_interrupt(control: &Arc<Control>) {
    let control = Arc::clone(control);
    thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        // Without a signal handler Ctrl-C still ends the process, only less politely.
        if let Ok(runtime) = runtime
            && runtime.block_on(tokio::signal::ctrl_c()).is_ok()
        {
            control.cancel();
        }
    });
}

/// Draws a bar on standard error until it is dropped.
pub(super) struct ProgressWatch {
    finished: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl ProgressWatch {
    /// Draws on a terminal only, since a pipe has no cursor to move; on one that calls itself dumb only when asked for.
    pub(super) fn start(control: &Arc<Control>, asked_for: bool) -> Option<Self> {
        #[expect(clippy::disallowed_methods, reason = "a fact about the terminal, not a setting of ours")]
        let is_dumb = std::env::var_os("TERM").is_some_and(|terminal| terminal == "dumb");
        if is_quiet() || !std::io::stderr().is_terminal() || (is_dumb && !asked_for) {
            return None;
        }
        let finished = Arc::new(AtomicBool::new(false));
        let (control, stop) = (Arc::clone(control), Arc::clone(&finished));
        let thread = thread::spawn(move || draw(&control, &stop));
        Some(Self { finished, thread: Some(thread) })
    }
}

impl Drop for ProgressWatch {
    fn drop(&mut self) {
        self.finished.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A bar that could not be drawn changes nothing about the result.
            let _ = thread.join();
        }
    }
}

fn draw(control: &Control, finished: &AtomicBool) {
    let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
    let styles = ["{msg:>8} {bar:32} {pos}/{len}", "{msg:>8} {spinner}"].map(ProgressStyle::with_template);
    let [Ok(counted), Ok(uncounted)] = styles else { return };
    while !finished.load(Ordering::Relaxed) {
        let progress = control.progress();
        if progress.phase != Phase::Waiting {
            // Reading and writing have one step or none: a bar would be full or empty, and say nothing.
            bar.set_style(if progress.total > 1 { counted.clone() } else { uncounted.clone() });
            bar.set_message(progress.phase.name());
            bar.set_length(progress.total);
            // The phase may have changed between the looks at its members.
            bar.set_position(progress.done.min(progress.total));
            bar.tick();
        }
        thread::park_timeout(REDRAW);
    }
    bar.finish_and_clear();
}
