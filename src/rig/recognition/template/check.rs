//! From a document to a template, with all that is wrong with it.

use serde_json::Value;

use super::{RigTemplate, template_schema};
use crate::rig::{
    Role,
    deserialize::{deserialize, kind_of},
    error::{SpecError, SpecErrorKind, SpecField},
    unknown_fields::unknown_fields,
};

/// More roles or joints than this are no rig.
const MAX_ENTRIES: usize = 1000;
/// No joint's name that anybody types is longer.
const LONGEST_NAME: usize = 128;
/// The longest name of a template.
const LONGEST_TEMPLATE_NAME: usize = 64;

/// Reads a template.
///
/// # Errors
/// When it is no object, names fields or roles that do not exist, or has values of the wrong type or out of range; with a
/// pointer to every single one.
pub fn parse_template(document: Value) -> Result<RigTemplate, SpecError> {
    let with_hint = |error: SpecError| SpecError {
        hint: if error.hint.contains("GET /v1/schemas") {
            "GET /docs/guide/rigs explains rig templates; GET /v1/schemas/rig-template is their JSON Schema".to_owned()
        } else {
            error.hint
        },
        ..error
    };
    if !document.is_object() {
        let detail = format!("the rig template is {} where an object is expected", kind_of(&document));
        let hint =
            "a template is an object in JSON or YAML with a name, a kind and roles; GET /docs/guide/rigs explains it";
        return Err(SpecError::new(SpecErrorKind::Malformed, detail, hint));
    }
    if let Some(error) = SpecError::from_fields(unknown_fields(&document, template_schema())) {
        return Err(with_hint(error));
    }
    let template: RigTemplate = deserialize(&document).map_err(with_hint)?;
    SpecError::from_fields(wrong_fields(&template)).map_or(Ok(template), |error| Err(with_hint(error)))
}

fn wrong_fields(template: &RigTemplate) -> Vec<SpecField> {
    let mut fields = Vec::new();
    let mut require = |holds: bool, pointer: &str, detail: &dyn Fn() -> String| {
        if !holds {
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, pointer, detail()));
        }
    };
    let is_plain = |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit();
    let name = &template.name;
    let is_name = name.starts_with(is_plain)
        && name.len() <= LONGEST_TEMPLATE_NAME
        && name.chars().all(|letter| is_plain(letter) || matches!(letter, '_' | '-'));
    require(is_name, "/name", &|| {
        format!("'{name}' is no name of a template: use up to 64 lower-case letters, digits, '_' and '-'")
    });
    let share = template.at_least;
    require((0.25..=1.0).contains(&share), "/at_least", &|| format!("{share} is not between 0.25 and 1"));
    require(!template.roles.is_empty(), "/roles", &|| "a template without roles says nothing".to_owned());
    let entries: usize = template.roles.values().map(Vec::len).sum::<usize>()
        + template.expected.len()
        + template.required.len()
        + template.excluded.len();
    require(entries <= MAX_ENTRIES, "/roles", &|| format!("{entries} joints; at most {MAX_ENTRIES} are allowed"));
    let words: Vec<&String> = template.sides.iter().flatten().flatten().collect();
    let has_both = template.sides.as_ref().is_none_or(|[left, right]| !left.is_empty() && !right.is_empty());
    require(has_both && words.iter().all(|word| !word.is_empty()), "/sides", &|| {
        "each side needs at least one spelling, and none may be empty".to_owned()
    });
    for (role, names) in &template.roles {
        let pointer = format!("/roles/{role}");
        let is_role = role.parse::<Role>().is_ok();
        let is_paired = Role::of_both_sides(role).is_some();
        if !is_role && !is_paired {
            let known: Vec<String> = Role::all().map(|role| role.to_string()).collect();
            let field = SpecField::new(SpecErrorKind::UnknownName, &pointer, format!("there is no role '{role}'"));
            fields.push(field.with_nearest(role, known.iter().map(String::as_str)));
            continue;
        }
        if names.is_empty() {
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, &pointer, format!("{role} has no joint")));
        }
        for (index, name) in names.iter().enumerate() {
            let detail = if is_paired && !name.contains("{side}") {
                Some(format!("'{name}' of both sides needs {{side}} in it, or say left_{role} and right_{role}"))
            } else {
                wrong_name(name, template.sides.is_some())
            };
            let place = format!("{pointer}/{index}");
            fields.extend(detail.map(|detail| SpecField::new(SpecErrorKind::InvalidValue, place, detail)));
        }
    }
    let lists = [("expected", &template.expected), ("required", &template.required), ("excluded", &template.excluded)];
    for (list, names) in lists {
        for (index, name) in names.iter().enumerate() {
            let detail = wrong_name(name, template.sides.is_some());
            let place = format!("/{list}/{index}");
            fields.extend(detail.map(|detail| SpecField::new(SpecErrorKind::InvalidValue, place, detail)));
        }
    }
    fields
}

/// Whether a joint's name can stand in a template.
pub(super) fn is_usable(name: &str) -> bool {
    !name.contains(['|', '*', '{']) && wrong_name(name, false).is_none()
}

fn wrong_name(name: &str, has_sides: bool) -> Option<String> {
    if name.len() > LONGEST_NAME {
        return Some(format!("a name of {} bytes; at most {LONGEST_NAME} are allowed", name.len()));
    }
    if name.split('|').any(|spelling| !spelling.chars().any(|letter| letter.is_alphanumeric() || letter == '*')) {
        return Some(format!("'{name}' holds a name without a letter or digit"));
    }
    (name.contains("{side}") && !has_sides).then(|| format!("'{name}' holds {{side}}, but the template has no 'sides'"))
}
