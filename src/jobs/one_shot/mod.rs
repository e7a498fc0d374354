//! A job whose files come with it and whose caller waits for its file: everything that keeps the disk out of that wait.
//!
//! ```text
//!  files arrive (arrival)                        the caller (waiting)
//!      │                                             │
//!  admitted ── engine's own process, a worker free ──┼─→ begun (head_start) ──┐
//!      │                                             │      │ refused, or the  │
//!      │                                             │      │ caller goes:     │
//!      │                                             │      ↓ stopped          │
//!  files and record on the disk                      │                         │
//!      │                                             │                         │
//!  claimed by a worker, which has a seat (seats) ────┼── takes over what begun ┘
//!      │                                             │
//!  engine done: the seat is left to the next job     │
//!      │                                             │
//!  given (handover) ─────────────────────────────────┴─→ answered with the file
//!      │
//!  end written: settled; who asked about the job meanwhile is answered now
//! ```
//!
//! Each state is kept by one part and left by dropping what stands for it: `Begun` stops work that no worker has taken over, `Wanting`
//! ends when the caller goes, `Given` settles the job, `Seat` gives its place and its memory back. A job that skips one of them is run all
//! the same: the head start and the handover save time and decide nothing.

mod arrival;
mod handover;
mod head_start;
mod seats;
mod waiting;

pub use arrival::ArrivedFiles;
pub use handover::HandedFile;
pub use waiting::{Awaited, Awaiting};

pub(super) use handover::Handovers;
pub(super) use head_start::{BegunWork, HeadStart, HeadStarts};
pub(super) use seats::{MOMENT, Seat, Seats};
