//! How much a JSON text declares, found out before it is parsed.

/// What a text declares, if it is JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JsonSize {
    /// Greatest nesting.
    pub depth: u64,
    /// An upper bound of the number of values.
    pub values: u64,
    /// How many of them are lists and objects.
    pub containers: u64,
}

impl JsonSize {
    /// Counts without recursion and without parsing; texts are not looked into.
    #[must_use]
    pub fn of(text: &[u8]) -> Self {
        let (mut depth, mut deepest, mut values, mut containers) = (0_u64, 0_u64, 1_u64, 0_u64);
        let (mut in_string, mut escaped) = (false, false);
        for byte in text {
            if in_string {
                in_string = escaped || *byte != b'"';
                escaped = !escaped && *byte == b'\\';
                continue;
            }
            match byte {
                b'"' => in_string = true,
                b'{' | b'[' => {
                    depth += 1;
                    values += 1;
                    containers += 1;
                    deepest = deepest.max(depth);
                }
                b'}' | b']' => depth = depth.saturating_sub(1),
                b',' => values += 1,
                _ => {}
            }
        }
        Self { depth: deepest, values, containers }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nesting_and_values_are_counted_outside_strings() {
        assert_eq!(
            JsonSize::of(br#"{"a": [1, "]]]\"[[[", [2]]}"#),
            JsonSize { depth: 3, values: 6, containers: 3 },
            "three deep"
        );
    }
}
