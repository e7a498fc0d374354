//! Records as they lie in FBX files: text and binary, of all versions from 6.1 on.

/// From this version on, records of binary files say where they end in 64 bits.
const WIDE_FROM: u32 = 7500;
/// Before this version, arrays were so many single values.
const ARRAYS_FROM: u32 = 7000;

/// A value of a record.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Whole(i32),
    Long(i64),
    Number(f64),
    /// One character without quotes.
    Letter(char),
    Text(String),
    /// In binary files only.
    Bytes(Vec<u8>),
    /// What is called so, of a class: text has the class before the name, binary behind it.
    Name(&'static str, String),
    Wholes(Vec<i32>),
    Longs(Vec<i64>),
    Numbers(Vec<f64>),
}

impl From<i32> for Value {
    fn from(value: i32) -> Self {
        Self::Whole(value)
    }
}

impl From<i64> for Value {
    fn from(value: i64) -> Self {
        Self::Long(value)
    }
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<char> for Value {
    fn from(value: char) -> Self {
        Self::Letter(value)
    }
}

impl From<&str> for Value {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

/// What there are several of, one after the other.
fn listed<T: ToString>(values: &[T]) -> String {
    values.iter().map(T::to_string).collect::<Vec<_>>().join(",")
}

impl Value {
    /// The values of an array, each by itself; nothing for what is none.
    fn each(&self) -> Option<Vec<Self>> {
        match self {
            Self::Wholes(values) => Some(values.iter().copied().map(Self::Whole).collect()),
            Self::Longs(values) => Some(values.iter().copied().map(Self::Long).collect()),
            Self::Numbers(values) => Some(values.iter().copied().map(Self::Number).collect()),
            _ => None,
        }
    }

    fn text(&self) -> String {
        let array = |count: usize, values: String| format!("*{count} {{\na: {values}\n}}");
        match self {
            Self::Whole(value) => value.to_string(),
            Self::Long(value) => value.to_string(),
            Self::Number(value) => format!("{value:e}"),
            Self::Letter(letter) => letter.to_string(),
            Self::Text(text) => format!("\"{text}\""),
            Self::Bytes(_) => panic!("text holds no bytes"),
            Self::Name(class, name) => format!("\"{class}::{name}\""),
            Self::Wholes(values) => array(values.len(), listed(values)),
            Self::Longs(values) => array(values.len(), listed(values)),
            Self::Numbers(values) => {
                array(values.len(), listed(&values.iter().map(|value| format!("{value:e}")).collect::<Vec<_>>()))
            }
        }
    }

    fn binary(&self, out: &mut Vec<u8>) {
        let mut tagged = |tag: u8, parts: &[&[u8]]| {
            out.push(tag);
            out.extend(parts.concat());
        };
        let size = |count: usize| (count as u32).to_le_bytes();
        let array = |count: usize, bytes: &[u8]| [&size(count), &size(0), &size(bytes.len()), bytes].concat();
        match self {
            Self::Whole(value) => tagged(b'I', &[&value.to_le_bytes()]),
            Self::Long(value) => tagged(b'L', &[&value.to_le_bytes()]),
            Self::Number(value) => tagged(b'D', &[&value.to_le_bytes()]),
            Self::Letter(letter) => tagged(b'C', &[&[*letter as u8]]),
            Self::Text(text) => tagged(b'S', &[&size(text.len()), text.as_bytes()]),
            Self::Bytes(bytes) => tagged(b'R', &[&size(bytes.len()), bytes]),
            Self::Name(class, name) => {
                let name = format!("{name}\0\u{1}{class}");
                tagged(b'S', &[&size(name.len()), name.as_bytes()]);
            }
            Self::Wholes(values) => {
                let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
                tagged(b'i', &[&array(values.len(), &bytes)]);
            }
            Self::Longs(values) => {
                let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
                tagged(b'l', &[&array(values.len(), &bytes)]);
            }
            Self::Numbers(values) => {
                let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
                tagged(b'd', &[&array(values.len(), &bytes)]);
            }
        }
    }
}

/// A record: its name, its values, and the records within it.
#[derive(Clone, Debug)]
pub(super) struct Record {
    name: &'static str,
    values: Vec<Value>,
    records: Vec<Self>,
}

impl Record {
    pub(super) const fn new(name: &'static str) -> Self {
        Self { name, values: Vec::new(), records: Vec::new() }
    }

    /// With one more value.
    pub(super) fn with(mut self, value: impl Into<Value>) -> Self {
        self.values.push(value.into());
        self
    }

    /// With a record of one value in it.
    pub(super) fn field(self, name: &'static str, value: impl Into<Value>) -> Self {
        self.holding([Self::new(name).with(value)])
    }

    /// With records in it.
    pub(super) fn holding(mut self, records: impl IntoIterator<Item = Self>) -> Self {
        self.records.extend(records);
        self
    }

    fn values(&self, version: u32) -> Vec<Value> {
        let each =
            |value: &Value| value.each().filter(|_| version < ARRAYS_FROM).unwrap_or_else(|| vec![value.clone()]);
        self.values.iter().flat_map(each).collect()
    }

    fn text(&self, version: u32) -> String {
        let values: Vec<String> = self.values(version).iter().map(Value::text).collect();
        let within: String = self.records.iter().map(|record| record.text(version)).collect();
        let within = if within.is_empty() && !values.is_empty() { within } else { format!(" {{\n{within}}}") };
        format!("{}: {}{within}\n", self.name, values.join(", "))
    }

    fn binary(&self, version: u32, out: &mut Vec<u8>) {
        let (start, word) = (out.len(), word(version));
        let values = self.values(version);
        out.extend(vec![0; 3 * word]);
        out.push(self.name.len() as u8);
        out.extend(self.name.as_bytes());
        let first = out.len();
        values.iter().for_each(|value| value.binary(out));
        let value_bytes = out.len() - first;
        if !self.records.is_empty() {
            self.records.iter().for_each(|record| record.binary(version, out));
            out.extend(vec![0; 3 * word + 1]);
        }
        for (index, number) in [out.len(), values.len(), value_bytes].into_iter().enumerate() {
            let at = start + index * word;
            out[at..at + word].copy_from_slice(&(number as u64).to_le_bytes()[..word]);
        }
    }
}

/// How many bytes a length has.
const fn word(version: u32) -> usize {
    if version < WIDE_FROM { 4 } else { 8 }
}

/// A file of text.
pub(super) fn text(records: &[Record], version: u32) -> Vec<u8> {
    let digits: Vec<String> = version.to_string().chars().take(3).map(String::from).collect();
    let head = format!("; FBX {} project file\n", digits.join("."));
    records.iter().fold(head, |text, record| text + &record.text(version)).into_bytes()
}

/// A binary file.
pub(super) fn binary(records: &[Record], version: u32) -> Vec<u8> {
    let mut out = b"Kaydara FBX Binary  \0\x1a\0".to_vec();
    out.extend(version.to_le_bytes());
    records.iter().for_each(|record| record.binary(version, &mut out));
    out.extend(vec![0; 3 * word(version) + 1]);
    out
}
