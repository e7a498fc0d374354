//! A template from a skeleton whose joints are understood.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    ENOUGH, RigTemplate,
    check::is_usable,
    find::{own_names, plain_name},
};
use crate::{
    model::Skeleton,
    rig::{Part, RigKind, Role},
};

impl RigTemplate {
    /// The template that skeletons of the same joint names follow, with their roles as `roles` has them.
    ///
    /// Joints whose names are not their own, or say nothing once separators and namespaces are taken away, cannot be told by name
    /// and are left out, and so are roles of such joints only. Nothing where no role is left, or the skeleton is no body.
    #[must_use]
    pub fn learn<'a>(
        name: &str,
        kind: RigKind,
        skeleton: &Skeleton,
        roles: impl Iterator<Item = (Role, &'a [usize])>,
    ) -> Option<Self> {
        let own_names = own_names(skeleton);
        let (mut seen, mut repeated) = (BTreeSet::new(), BTreeSet::new());
        for plain in own_names.iter().map(|name| plain_name(name)) {
            if !seen.insert(plain.clone()) {
                repeated.insert(plain);
            }
        }
        let own_name = |joint: &usize| {
            let name = own_names.get(*joint)?;
            let plain = plain_name(name);
            // Namespaces differ from file to file.
            let bare = name.rsplit([':', '|']).find(|part| !part.is_empty())?.replace('*', "");
            let is_own = !plain.is_empty() && !repeated.contains(&plain) && is_usable(&bare);
            is_own.then_some(bare)
        };
        let mut named: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let mut has_counted_legs = false;
        for (role, joints) in roles {
            has_counted_legs |= role.part == Part::Leg;
            let names: Vec<String> = joints.iter().filter_map(own_name).collect();
            if !names.is_empty() {
                named.insert(role.to_string(), names);
            }
        }
        let is_body = kind != RigKind::Other || has_counted_legs;
        (!named.is_empty() && is_body).then(|| Self {
            name: template_name(name),
            title: String::new(),
            kind,
            prefixes: Vec::new(),
            sides: None,
            roles: named,
            expected: Vec::new(),
            required: Vec::new(),
            excluded: Vec::new(),
            at_least: ENOUGH,
        })
    }
}

/// A name that templates may have, from any text.
fn template_name(text: &str) -> String {
    const LONGEST: usize = 48;
    let plain = |letter: char| if letter.is_ascii_alphanumeric() { letter.to_ascii_lowercase() } else { '_' };
    let name: String = text.chars().map(plain).take(LONGEST).collect();
    let name = name.trim_matches('_');
    if name.is_empty() { "my_rig".to_owned() } else { name.to_owned() }
}
