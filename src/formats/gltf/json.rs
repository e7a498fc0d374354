//! Is this text safe to parse, and what stands at this place of it. Every error carries a JSON pointer.

use std::fmt;

use serde_json::{Map, Value};

use crate::formats::{Budget, FormatError, JsonSize, Limit};

const PHASE: &str = "json";
/// Lists grow by doubling, and a member of an object has its key beside its value.
const SLOTS_PER_VALUE: u64 = 2;
/// What a list or an object takes at least, however little it holds.
const SLOTS_PER_CONTAINER: u64 = 4;

/// Parses a document after counting, without recursion, how deep it nests and how many values it declares.
pub(in crate::formats) fn parse(text: &[u8], budget: &mut Budget<'_>) -> Result<Value, FormatError> {
    let JsonSize { depth, values, containers } = JsonSize::of(text);
    budget.check(Limit::JsonDepth, depth, "JSON")?;
    let slots = values.saturating_mul(SLOTS_PER_VALUE).saturating_add(containers.saturating_mul(SLOTS_PER_CONTAINER));
    budget.take_array(slots, size_of::<Value>() as u64, "JSON")?;
    budget.take(Limit::DecodedBytes, text.len() as u64, "JSON")?;
    serde_json::from_slice(text).map_err(|error| {
        FormatError::malformed(
            PHASE,
            format!("line {} column {}", error.line(), error.column()),
            format!("the document is not valid JSON: {error}"),
        )
    })
}

/// A value of the document and where it stands. Children borrow their parent, so a pointer costs nothing until it is printed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cursor<'d, 'p> {
    value: &'d Value,
    step: Step<'p>,
    parent: Option<&'p Self>,
}

#[derive(Clone, Copy, Debug)]
enum Step<'p> {
    Root,
    Key(&'p str),
    Index(usize),
}

impl<'d, 'p> Cursor<'d, 'p> {
    /// The whole document.
    pub(super) const fn root(value: &'d Value) -> Self {
        Self { value, step: Step::Root, parent: None }
    }

    /// The member of that name, or nothing where it is not there.
    pub(super) fn get<'q>(&'q self, key: &'q str) -> Result<Option<Cursor<'d, 'q>>, FormatError> {
        let member = self.object()?.get(key);
        Ok(member.map(|value| Cursor { value, step: Step::Key(key), parent: Some(self) }))
    }

    /// The member of that name.
    pub(super) fn require<'q>(&'q self, key: &'q str) -> Result<Cursor<'d, 'q>, FormatError> {
        self.get(key)?.ok_or_else(|| self.malformed(format!("the required member '{key}' is missing")))
    }

    /// The elements of an array.
    pub(super) fn elements<'q>(&'q self) -> Result<impl Iterator<Item = Cursor<'d, 'q>>, FormatError> {
        let array = self.value.as_array().ok_or_else(|| self.wrong_type("an array"))?;
        let cursor = |(index, value)| Cursor { value, step: Step::Index(index), parent: Some(self) };
        Ok(array.iter().enumerate().map(cursor))
    }

    /// One element of an array.
    pub(super) fn element(&self, index: usize) -> Result<Cursor<'d, '_>, FormatError> {
        let array = self.value.as_array().ok_or_else(|| self.wrong_type("an array"))?;
        let value = array.get(index).ok_or_else(|| self.malformed(format!("there is no element {index}")))?;
        Ok(Cursor { value, step: Step::Index(index), parent: Some(self) })
    }

    /// How many elements the array has.
    pub(super) fn length(&self) -> Result<usize, FormatError> {
        self.value.as_array().map(Vec::len).ok_or_else(|| self.wrong_type("an array"))
    }

    /// The members of an object, in the order of the file.
    pub(super) fn object(&self) -> Result<&'d Map<String, Value>, FormatError> {
        self.value.as_object().ok_or_else(|| self.wrong_type("an object"))
    }

    /// A text.
    pub(super) fn text(&self) -> Result<&'d str, FormatError> {
        self.value.as_str().ok_or_else(|| self.wrong_type("a text"))
    }

    /// A truth value.
    pub(super) fn boolean(&self) -> Result<bool, FormatError> {
        self.value.as_bool().ok_or_else(|| self.wrong_type("true or false"))
    }

    /// A finite number.
    pub(super) fn number(&self) -> Result<f64, FormatError> {
        self.value.as_f64().filter(|number| number.is_finite()).ok_or_else(|| self.wrong_type("a number"))
    }

    /// A count, an offset or an index: a whole number that is not negative. Some exporters write `3.0`.
    pub(super) fn whole(&self) -> Result<u64, FormatError> {
        const EXACT: f64 = 9_007_199_254_740_992.0;
        let from_float = |number: f64| {
            let is_whole = number.fract() == 0.0 && (0.0..=EXACT).contains(&number);
            is_whole.then_some(number as u64)
        };
        let whole = self.value.as_u64().or_else(|| self.value.as_f64().and_then(from_float));
        whole.ok_or_else(|| self.wrong_type("a whole number that is not negative"))
    }

    /// A count or an offset in memory.
    pub(super) fn size(&self) -> Result<usize, FormatError> {
        let whole = self.whole()?;
        usize::try_from(whole).map_err(|_| self.malformed(format!("{whole} is too large")))
    }

    /// An index into something of `count` elements, such as `nodes`.
    pub(super) fn index(&self, count: usize, of: &str) -> Result<usize, FormatError> {
        let index = self.size()?;
        let error = || self.malformed(format!("index {index} is out of range: there are {count} {of}"));
        (index < count).then_some(index).ok_or_else(error)
    }

    /// Exactly `N` numbers.
    pub(super) fn numbers<const N: usize>(&self) -> Result<[f64; N], FormatError> {
        if self.length()? != N {
            return Err(self.malformed(format!("there must be {N} numbers, not {}", self.length()?)));
        }
        let mut numbers = [0.0; N];
        for (number, element) in numbers.iter_mut().zip(self.elements()?) {
            *number = element.number()?;
        }
        Ok(numbers)
    }

    /// The value itself.
    pub(super) const fn value(&self) -> &'d Value {
        self.value
    }

    /// An error at this place.
    pub(super) fn malformed(&self, detail: impl Into<String>) -> FormatError {
        FormatError::malformed(self.phase(), self.to_string(), detail)
    }

    fn wrong_type(&self, wanted: &str) -> FormatError {
        let found = match self.value {
            Value::Null => "null".to_owned(),
            Value::Bool(value) => value.to_string(),
            Value::Number(value) => value.to_string(),
            Value::String(_) => "a text".to_owned(),
            Value::Array(_) => "an array".to_owned(),
            Value::Object(_) => "an object".to_owned(),
        };
        self.malformed(format!("this must be {wanted}, not {found}"))
    }

    /// Which part of the document this is in; the first key says so.
    fn phase(&self) -> &'static str {
        const PHASES: [&str; 9] =
            ["asset", "buffers", "bufferViews", "accessors", "nodes", "scenes", "skins", "animations", "extensions"];
        let mut cursor = self;
        let mut key = "";
        while let Some(parent) = cursor.parent {
            if let Step::Key(name) = cursor.step {
                key = name;
            }
            cursor = parent;
        }
        PHASES.into_iter().find(|phase| *phase == key).unwrap_or(PHASE)
    }
}

impl fmt::Display for Cursor<'_, '_> {
    /// The JSON pointer; empty for the whole document. Recursion goes as deep as the reader's own code does.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(parent) = self.parent {
            parent.fmt(formatter)?;
        }
        match self.step {
            Step::Root => Ok(()),
            Step::Key(key) => write!(formatter, "/{}", key.replace('~', "~0").replace('/', "~1")),
            Step::Index(index) => write!(formatter, "/{index}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{formats::Limits, model::Control};

    #[test]
    fn nesting_is_bounded() {
        let (limits, control) = (Limits::default(), Control::new());
        let deep = vec![b'['; 100_000];
        let error = parse(&deep, &mut Budget::new(&limits, &control)).expect_err("too deep");
        assert!(error.detail.contains("json_depth"), "the limit is named: {error}");
    }

    #[test]
    fn values_are_paid_for_before_they_are_made() {
        let (limits, control) = (Limits { decoded_bytes: 1000, ..Limits::default() }, Control::new());
        let many = format!("[{}0]", "0,".repeat(100));
        assert!(parse(many.as_bytes(), &mut Budget::new(&limits, &control)).is_err(), "100 values cost more");
        let (limits, few) =
            (Limits { decoded_bytes: 20_000, ..Limits::default() }, "[[0],[0],[0],[0],[0],[0],[0],[0]]");
        assert!(parse(few.as_bytes(), &mut Budget::new(&limits, &control)).is_ok(), "lists of one are cheap");
        let lists = format!("[{}[0]]", "[0],".repeat(40));
        assert!(parse(lists.as_bytes(), &mut Budget::new(&limits, &control)).is_err(), "but not free");
    }

    #[test]
    fn errors_point() {
        let value = serde_json::json!({"nodes": [{"children": [1.0, 1.5]}], "a/b": 1});
        let root = Cursor::root(&value);
        let nodes = root.require("nodes").expect("there");
        let node = nodes.element(0).expect("there");
        let children = node.require("children").expect("there");
        assert_eq!(children.element(0).expect("there").index(2, "nodes"), Ok(1), "whole floats are indices");
        let error = children.element(1).expect("there").index(2, "nodes").expect_err("no index");
        assert_eq!((error.place.as_str(), error.phase), ("/nodes/0/children/1", "nodes"), "where it is");
        let error = root.get("a/b").expect("an object").expect("there").text().expect_err("a number");
        assert_eq!(error.place, "/a~1b", "escaped");
    }
}
