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
use crate::model::{Control, Phase, Progress};

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
    let Some(styles) = Styles::new() else { return };
    while !finished.load(Ordering::Relaxed) {
        styles.show(&bar, &control.progress());
        thread::park_timeout(REDRAW);
    }
    bar.finish_and_clear();
}

/// How a bar looks.
struct Styles {
    counted: ProgressStyle,
    uncounted: ProgressStyle,
}

impl Styles {
    fn new() -> Option<Self> {
        let style = |template| ProgressStyle::with_template(template).ok();
        Some(Self { counted: style("{msg:>8} {bar:32} {pos}/{len}")?, uncounted: style("{msg:>8} {spinner}")? })
    }

    /// Shows how far the work is. Every change is drawn, so a bar never looks as if it counted before it has what it counts.
    fn show(&self, bar: &ProgressBar, progress: &Progress) {
        if progress.phase == Phase::Waiting {
            return;
        }
        // Reading and writing have one step or none: a bar would be full or empty, and say nothing.
        if progress.total > 1 {
            bar.set_length(progress.total);
            // The phase may have changed between the looks at its members.
            bar.set_position(progress.done.min(progress.total));
            bar.set_style(self.counted.clone());
        } else {
            bar.set_style(self.uncounted.clone());
        }
        bar.set_message(progress.phase.name());
        bar.tick();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use indicatif::TermLike;

    use super::*;

    /// A terminal that keeps what is drawn on it.
    #[derive(Clone, Debug, Default)]
    struct Paper(Arc<Mutex<String>>);

    impl Paper {
        fn add(&self, text: &str) {
            self.0.lock().expect("nobody panics with it").push_str(text);
        }
    }

    impl TermLike for Paper {
        fn width(&self) -> u16 {
            80
        }

        fn move_cursor_up(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }

        fn move_cursor_down(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }

        fn move_cursor_right(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }

        fn move_cursor_left(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }

        fn write_line(&self, line: &str) -> std::io::Result<()> {
            self.add(&format!("{line}\n"));
            Ok(())
        }

        fn write_str(&self, text: &str) -> std::io::Result<()> {
            self.add(text);
            Ok(())
        }

        fn clear_line(&self) -> std::io::Result<()> {
            self.add("\n");
            Ok(())
        }

        fn flush(&self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn no_bar_counts_nothing() {
        let (paper, styles) = (Paper::default(), Styles::new().expect("templates"));
        let target = ProgressDrawTarget::term_like_with_hz(Box::new(paper.clone()), u8::MAX);
        let bar = ProgressBar::with_draw_target(Some(0), target);
        for (phase, done, total) in [
            (Phase::Waiting, 0, 0),
            (Phase::Read, 0, 1),
            (Phase::Plan, 0, 0),
            (Phase::Retarget, 0, 121),
            (Phase::Write, 0, 1),
        ] {
            styles.show(&bar, &Progress { phase, done, total });
        }
        let drawn = paper.0.lock().expect("nobody panics with it").clone();
        assert!(drawn.contains("read") && drawn.contains("0/121"), "{drawn}");
        let counts = drawn.split_whitespace().filter(|word| word.contains('/'));
        let counts: std::collections::BTreeSet<&str> = counts.collect();
        assert_eq!(counts.into_iter().collect::<Vec<_>>(), ["0/121"], "nothing else is counted: {drawn}");
    }
}
