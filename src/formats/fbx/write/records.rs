//! The records that all parts of a file are made of.

use super::binary::{Property, Record};

/// An object of the document: its kind, its name, its class.
pub(super) fn object(kind: &'static str, id: i64, name: &str, class: &str) -> Record {
    let type_name = match class {
        "Cluster" | "BlendShapeChannel" => "SubDeformer",
        _ => kind,
    };
    Record::new(kind).with(id).with(format!("{name}\0\u{1}{type_name}")).with(class)
}

/// A row of `Properties70`: name, type, label, flags, values.
pub(super) fn property<const N: usize>(
    name: &str,
    kind: &str,
    label: &str,
    flags: &str,
    values: [Property; N],
) -> Record {
    let record = Record::new("P").with(name).with(kind).with(label).with(flags);
    values.into_iter().fold(record, Record::with)
}

/// `child` belongs to `parent`.
pub(super) fn connection(child: i64, parent: i64) -> Record {
    Record::new("C").with("OO").with(child).with(parent)
}

/// `child` is what moves a property of `parent`, or lies on it.
pub(super) fn connection_to_property(child: i64, parent: i64, property: &str) -> Record {
    Record::new("C").with("OP").with(child).with(parent).with(property)
}
