//! The MOTION part: rows of numbers into tracks.

use glam::{Quat, Vec3};

use crate::{
    formats::{Budget, FormatError, Limit},
    model::{JointTracks, Reporter},
};

use super::{
    hierarchy::Hierarchy,
    scanner::{Scanner, Value},
    tracks::{GrowingTracks, ROWS_PER_BLOCK, positions_count_from_offsets},
};

/// Anything larger is no length or angle, and would become infinite as an f32.
const LARGEST: f64 = 1e30;
/// Values between two looks at the budget and at cancellation.
const VALUES_PER_CHECK: usize = 1 << 16;

/// The motion of a file.
#[derive(Debug)]
pub(super) struct Motion {
    /// Frame k at k · frame time.
    pub(super) times_seconds: Vec<f64>,
    /// One entry per joint.
    pub(super) tracks: Vec<JointTracks>,
}

/// Reads what follows MOTION; nothing where there are no frames.
///
/// # Errors
/// When the header or a row breaks the rules, or there is more than the budget allows.
pub(super) fn read(
    scanner: &mut Scanner<'_>,
    hierarchy: &Hierarchy,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Option<Motion>, FormatError> {
    if scanner.peek_word().is_none() {
        reporter.warn(
            "no_frames",
            scanner.place(),
            "the file has no MOTION; only the skeleton was read",
            "export the animation as well if there is one",
        );
        return Ok(None);
    }
    let header = header(scanner)?;
    budget.check(Limit::FramesPerClip, header.frames, "Frames")?;
    let rows = rows(scanner, hierarchy, &header, budget, reporter)?;
    let frames = rows.count;
    let Some(tracks) = rows.tracks.filter(|_| frames > 0) else {
        reporter.warn(
            "no_frames",
            scanner.place(),
            "the file has no frames; only the skeleton was read",
            "export the animation as well if there is one",
        );
        return Ok(None);
    };
    if frames as u64 != header.frames {
        reporter.warn(
            "row_count_differs",
            "MOTION",
            format!("the file declares {} frames and has {frames} rows; all rows were read", header.frames),
            "check the export if frames are missing",
        );
    }
    let samples = (frames as u64).saturating_mul(hierarchy.joints.len() as u64);
    budget.take(Limit::Samples, samples, "MOTION")?;
    budget.take_array(hierarchy.joints.len() as u64, size_of::<JointTracks>() as u64, "MOTION")?;
    budget.take_array(samples, (size_of::<Quat>() + size_of::<Vec3>()) as u64, "MOTION")?;
    let times_seconds: Vec<f64> = (0..frames).map(|frame| frame as f64 * header.frame_time_seconds).collect();
    if rows.from_offsets {
        reporter.warn(
            "positions_from_offsets",
            "MOTION",
            "the position channels below the root are next to nothing; they were taken to be added to the offsets",
            "export the positions of joints below the root as they are, or not at all",
        );
    }
    Ok(Some(Motion { times_seconds, tracks: tracks.finish() }))
}

struct Header {
    frames: u64,
    frame_time_seconds: f64,
}

/// `Frames:` and `Frame Time:`, in this order or the other.
fn header(scanner: &mut Scanner<'_>) -> Result<Header, FormatError> {
    let (mut frames, mut frame_time_seconds) = (None, None);
    while frames.is_none() || frame_time_seconds.is_none() {
        let word = scanner.next_word().unwrap_or_default().to_ascii_lowercase();
        match word.as_slice() {
            b"frames:" => frames = Some(frame_count(scanner)?),
            b"frames" if skip_word(scanner, b":") => frames = Some(frame_count(scanner)?),
            b"frame" if skip_word(scanner, b"time:") || skip_word(scanner, b"time") && skip_word(scanner, b":") => {
                frame_time_seconds = Some(frame_time(scanner)?);
            }
            _ => return Err(scanner.malformed("MOTION must begin with 'Frames: <count>' and 'Frame Time: <seconds>'")),
        }
    }
    Ok(Header { frames: frames.unwrap_or(0), frame_time_seconds: frame_time_seconds.unwrap_or(0.0) })
}

fn skip_word(scanner: &mut Scanner<'_>, word: &[u8]) -> bool {
    let is_next = scanner.peek_word().is_some_and(|next| next.eq_ignore_ascii_case(word));
    if is_next {
        scanner.next_word();
    }
    is_next
}

fn frame_count(scanner: &mut Scanner<'_>) -> Result<u64, FormatError> {
    let count = scanner.expect_number("the number of Frames")?;
    if count < 0.0 || count.fract() != 0.0 {
        return Err(scanner.malformed(format!("the number of Frames is {count}; it must be a whole number, 0 or more")));
    }
    // A float this large saturates, and no limit allows it.
    Ok(count as u64)
}

fn frame_time(scanner: &mut Scanner<'_>) -> Result<f64, FormatError> {
    let seconds = scanner.expect_number("the Frame Time")?;
    if !(1e-9..=1e6).contains(&seconds) {
        return Err(scanner
            .malformed(format!("the Frame Time is {seconds}; it must be seconds above 0"))
            .with_hint("write the seconds of one frame, such as 0.0333333 for 30 frames per second"));
    }
    Ok(seconds)
}

/// All complete rows of a file, as the tracks of its joints.
struct MotionRows<'h> {
    count: usize,
    /// Nothing without a complete row.
    tracks: Option<GrowingTracks<'h>>,
    /// Whether positions below the root are counted from the offsets.
    from_offsets: bool,
}

/// Values that wait until they are a block of rows. Only a block is kept as text has it, so that a long file is not held twice.
struct Block<'h> {
    hierarchy: &'h Hierarchy,
    values: Vec<f64>,
    /// How many values came in all.
    count: usize,
    full: usize,
    /// For how many frames there is room from the beginning.
    frames: usize,
    rows: MotionRows<'h>,
}

impl<'h> Block<'h> {
    fn new(hierarchy: &'h Hierarchy, frames: usize) -> Self {
        let full = hierarchy.channel_count.max(1) * ROWS_PER_BLOCK;
        let rows = MotionRows { count: 0, tracks: None, from_offsets: false };
        Self { hierarchy, values: Vec::with_capacity(full), count: 0, full, frames, rows }
    }

    #[inline]
    fn push(&mut self, value: f64) {
        self.values.push(value);
        self.count += 1;
        if self.values.len() == self.full {
            self.flush();
        }
    }

    /// Hands complete rows on.
    fn flush(&mut self) {
        let rows = self.values.len().checked_div(self.hierarchy.channel_count).unwrap_or(0);
        if rows > 0 {
            let tracks = self.rows.tracks.get_or_insert_with(|| {
                self.rows.from_offsets = positions_count_from_offsets(self.hierarchy, &self.values);
                GrowingTracks::new(self.hierarchy, self.frames, self.rows.from_offsets)
            });
            tracks.add(&self.values[..rows * self.hierarchy.channel_count]);
            self.rows.count += rows;
        }
        self.values.clear();
    }
}

/// All complete rows. The number of declared frames decides nothing but whether rows that do not agree with the lines of the file are
/// meant so.
fn rows<'h>(
    scanner: &mut Scanner<'_>,
    hierarchy: &'h Hierarchy,
    header: &Header,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<MotionRows<'h>, FormatError> {
    let channels = hierarchy.channel_count;
    let mut lines = Lines { channels, broken: None, line_begin: 0 };
    let mut paid = 0;
    // No value is shorter than two bytes with what separates it, so that the file itself bounds what is reserved.
    let declared = usize::try_from(header.frames).unwrap_or(usize::MAX).saturating_mul(channels);
    let expected = declared.min(scanner.remaining() / 2 + 1);
    budget.check(Limit::DecodedBytes, (expected as u64).saturating_mul(size_of::<f64>() as u64), "MOTION")?;
    let mut block = Block::new(hierarchy, expected.checked_div(channels).unwrap_or(0));
    loop {
        if block.count == paid {
            let more = VALUES_PER_CHECK.min(scanner.remaining() / 2 + 1);
            budget.take_array(more as u64, size_of::<f64>() as u64, "MOTION")?;
            budget.check_canceled()?;
            if let Some(row) = block.count.checked_div(channels) {
                budget.check(Limit::FramesPerClip, row as u64, "MOTION")?;
                let samples = (row as u64).saturating_mul(hierarchy.joints.len() as u64);
                budget.check(Limit::Samples, samples, "MOTION")?;
            }
            paid += more;
        }
        let line = scanner.line();
        match scanner.next_value() {
            Value::Number(number) if number.abs() < LARGEST => block.push(number),
            Value::Number(number) => return Err(bad_value(scanner, hierarchy, block.count, &number.to_string())),
            Value::NotANumber(word) => {
                let what = value_name(hierarchy, block.count);
                return Err(scanner.not_a_number(&what, word));
            }
            Value::LineEnd => lines.end_line(block.count, line),
            Value::End => {
                lines.end_line(block.count, line);
                break;
            }
        }
    }
    if channels == 0 && block.count > 0 {
        return Err(scanner.malformed("MOTION has numbers, but no joint has channels"));
    }
    lines.judge(block.count, header.frames, reporter)?;
    block.flush();
    budget.check(Limit::FramesPerClip, block.rows.count as u64, "MOTION")?;
    Ok(block.rows)
}

/// Whether lines and rows agree.
struct Lines {
    channels: usize,
    /// The first line that does not end where a row ends.
    broken: Option<BrokenLine>,
    /// How many values there were when the current line began.
    line_begin: usize,
}

struct BrokenLine {
    line: usize,
    row: usize,
    values: usize,
    end: usize,
}

impl Lines {
    fn end_line(&mut self, values: usize, line: usize) {
        if self.broken.is_none() && self.channels > 0 && !values.is_multiple_of(self.channels) {
            let row = self.line_begin / self.channels;
            self.broken = Some(BrokenLine { line, row, values: values - self.line_begin, end: values });
        }
        self.line_begin = values;
    }

    /// Rows may run over line ends where the count is right as a whole; a file may be cut off in its last row.
    fn judge(&self, values: usize, declared: u64, reporter: &mut Reporter) -> Result<(), FormatError> {
        let Some(broken) = &self.broken else { return Ok(()) };
        let place = format!("line {}", broken.line);
        let rows = values / self.channels;
        if values.is_multiple_of(self.channels) && rows as u64 == declared {
            reporter.warn(
                "rows_wrapped",
                place,
                "rows run over the ends of lines; the numbers were taken in order, as their count is right",
                "",
            );
            return Ok(());
        }
        if broken.end == values && rows > 0 {
            reporter.warn(
                "last_row_incomplete",
                place,
                format!(
                    "the last row has {} values where the hierarchy has {} channels; it was left out",
                    broken.values, self.channels
                ),
                "check that the upload or the export was complete",
            );
            return Ok(());
        }
        let detail = format!(
            "row {} of MOTION has {} values where the hierarchy has {} channels",
            broken.row + 1,
            broken.values,
            self.channels
        );
        Err(FormatError::malformed("bvh", place, detail))
    }
}

fn bad_value(scanner: &Scanner<'_>, hierarchy: &Hierarchy, index: usize, number: &str) -> FormatError {
    scanner.malformed(format!("{} is {number}, which is absurdly large", value_name(hierarchy, index)))
}

/// `frame 3, Zrotation of 'Hips'` for a value by its index; rows are counted from 0 like everywhere.
fn value_name(hierarchy: &Hierarchy, index: usize) -> String {
    let Some(frame) = index.checked_div(hierarchy.channel_count) else { return "a value of MOTION".into() };
    let mut left = index % hierarchy.channel_count;
    for (joint, channels) in hierarchy.joints.iter().zip(&hierarchy.channels) {
        if let Some(channel) = channels.get(left) {
            return format!("frame {frame}, {} of '{}'", channel.name(), joint.name);
        }
        left -= channels.len();
    }
    format!("frame {frame}")
}
