//! Who is in a picture.

use super::{marks::Marks, scene::Subject};

/// What is shown: a figure, what it may be compared with, and what is known of it.
#[derive(Clone, Copy, Debug)]
pub struct Cast<'a> {
    /// The figure itself.
    pub main: &'a Subject<'a>,
    /// What it was made from; seen where the view's layout asks for it.
    pub companion: Option<&'a Subject<'a>>,
    /// What is drawn where the view asks for marks, and where its sheet of the worst frames comes from.
    pub marks: Option<&'a Marks>,
}

impl<'a> Cast<'a> {
    /// A figure alone.
    #[must_use]
    pub const fn alone(main: &'a Subject<'a>) -> Self {
        Self { main, companion: None, marks: None }
    }
}
