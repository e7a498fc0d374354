//! A chain of the source and the one of the target that follows it, and the parts of a role's name.

/// A chain of each side: its name on the target's, and its joints from the body outward.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NamedPair {
    pub(crate) name: String,
    /// What the source calls it.
    pub(crate) source_name: String,
    pub(crate) source: Vec<usize>,
    /// Further chains of the source, by what it calls them; the target follows the mean of all.
    pub(crate) also: Vec<(String, Vec<usize>)>,
    pub(crate) target: Vec<usize>,
    /// The role, where the pair comes from one.
    pub(crate) role: Option<String>,
}

/// `left_upper_arm` into `left_` and `upper_arm`.
pub(crate) fn split(role: &str) -> (&str, &str) {
    for prefix in ["left_", "right_"] {
        if let Some(part) = role.strip_prefix(prefix) {
            return (&role[..prefix.len()], part);
        }
    }
    ("", role)
}
