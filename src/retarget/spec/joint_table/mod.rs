//! Joint tables: a `joints` op as a table that spreadsheets read and write, one row per pair of joints.
//!
//! The first line that is neither empty nor a comment (`#`) is the header. Its columns may come in any order, in any case, with spaces
//! for underscores; only `source` and `target` have to be there, and an empty cell is a default:
//!
//! | column | cell |
//! |---|---|
//! | `source`, `target` | a joint or a role |
//! | `source_end` | a second joint of the source: the target points as the line from `source` to it |
//! | `position`, `rotation` | whether they follow: yes, no, true, false, 1, 0, x |
//! | `position_gain`, `rotation_gain` | a factor |
//! | `position_offset_x`, `_y`, `_z` | meters |
//! | `rotation_offset_x`, `_y`, `_z` | degrees |
//! | `axis_order` | the source's axes as the target's: `xzy`, `+x-z+y` |
//! | `axis_offset_x`, `_y`, `_z` | degrees |
//! | `space` | `model` or `local` |
//! | `points_to` | the joint that the target's bone leads to |
//!
//! Cells are separated by semicolons, commas or tabs, whichever the header has most of. Quotes hold separators, and a doubled quote
//! is one. A byte-order mark is fine. Where commas do not separate, numbers may have decimal commas.

mod cells;
mod read;
mod write;

pub(in crate::retarget) use read::{is_table, read_table};
pub use write::{TableRow, write_table};

/// A column: its name in the header, and what its cells are.
struct Column {
    name: &'static str,
    /// The field of a row of the op; with an index where the field is a list.
    field: &'static str,
    index: Option<usize>,
    kind: Kind,
}

/// What the cells of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Text,
    Truth,
    Number,
}

const fn column(name: &'static str, field: &'static str, index: Option<usize>, kind: Kind) -> Column {
    Column { name, field, index, kind }
}

/// All columns, in the order in which they are written.
const COLUMNS: [Column; 19] = [
    column("source", "source", None, Kind::Text),
    column("target", "target", None, Kind::Text),
    column("source_end", "source_end", None, Kind::Text),
    column("position", "position", None, Kind::Truth),
    column("rotation", "rotation", None, Kind::Truth),
    column("position_gain", "position_gain", None, Kind::Number),
    column("rotation_gain", "rotation_gain", None, Kind::Number),
    column("position_offset_x", "position_offset", Some(0), Kind::Number),
    column("position_offset_y", "position_offset", Some(1), Kind::Number),
    column("position_offset_z", "position_offset", Some(2), Kind::Number),
    column("rotation_offset_x", "rotation_offset", Some(0), Kind::Number),
    column("rotation_offset_y", "rotation_offset", Some(1), Kind::Number),
    column("rotation_offset_z", "rotation_offset", Some(2), Kind::Number),
    column("axis_order", "axis_order", None, Kind::Text),
    column("axis_offset_x", "axis_offset", Some(0), Kind::Number),
    column("axis_offset_y", "axis_offset", Some(1), Kind::Number),
    column("axis_offset_z", "axis_offset", Some(2), Kind::Number),
    column("space", "space", None, Kind::Text),
    column("points_to", "points_to", None, Kind::Text),
];
