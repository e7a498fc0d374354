//! What the engine found out, for people: the report and the edits as pages of HTML, the rest as text for a terminal.

mod batch;
mod edits;
mod explanation;
mod inspection;
mod joint_table;
mod page;
mod proposal;

pub use batch::batch_page;
pub use edits::edits_article;
pub use joint_table::JointTable;
#[cfg(feature = "service")]
pub(crate) use page::Escaped;
pub use page::{Illustration, report_page};
