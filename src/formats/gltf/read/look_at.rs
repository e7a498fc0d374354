//! What a VRM says of looks: whether its eyes are moved by shapes, and how far a look has to go for them.

use serde_json::Value;

use crate::model::{LookAt, LookRange};

/// Reads it from the document's extensions; nothing where the file says nothing, or moves its eyes by joints, which turn as eyes do.
pub(super) fn read(extensions: &Value) -> Option<LookAt> {
    let (newer, older) = (&extensions["VRMC_vrm"]["lookAt"], &extensions["VRM"]["firstPerson"]);
    let by_shapes = newer["type"] == "expression" || older["lookAtTypeName"] == "BlendShape";
    if !by_shapes {
        return None;
    }
    let range = |name: &str| {
        let (map, curve) = (&newer[&format!("rangeMap{name}")], &older[&format!("lookAt{name}")]);
        let number = |value: &Value, usual: f64| {
            value.as_f64().filter(|number| number.is_finite() && *number > 0.0).unwrap_or(usual)
        };
        if map.is_object() {
            LookRange { most_degrees: number(&map["inputMaxValue"], 90.0), weight: number(&map["outputScale"], 1.0) }
        } else {
            LookRange { most_degrees: number(&curve["xRange"], 90.0), weight: number(&curve["yRange"], 1.0) }
        }
    };
    Some(LookAt {
        by_shapes,
        inner: range("HorizontalInner"),
        outer: range("HorizontalOuter"),
        up: range("VerticalUp"),
        down: range("VerticalDown"),
    })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn both_generations_say_the_same() {
        let newer = json!({"VRMC_vrm": {"lookAt": {"type": "expression",
            "rangeMapVerticalUp": {"inputMaxValue": 45.0, "outputScale": 0.5}}}});
        let older = json!({"VRM": {"firstPerson": {"lookAtTypeName": "BlendShape",
            "lookAtVerticalUp": {"xRange": 45.0, "yRange": 0.5}}}});
        for extensions in [newer, older] {
            let look = read(&extensions).expect("it looks by shapes");
            assert_eq!(look.up, LookRange { most_degrees: 45.0, weight: 0.5 }, "as the file says");
            assert_eq!(look.down, LookRange { most_degrees: 90.0, weight: 1.0 }, "what it does not say");
            assert!(
                (look.up.weight(0.5_f64.to_radians() * 45.0) - 0.25).abs() < 1e-12,
                "half the way is half the weight"
            );
            assert!((look.up.angle(0.25) - 22.5_f64.to_radians()).abs() < 1e-12, "and back");
        }
        assert_eq!(read(&json!({"VRM": {"firstPerson": {"lookAtTypeName": "Bone"}}})), None, "joints turn as they do");
        assert_eq!(read(&Value::Null), None, "no VRM");
    }
}
