//! What stands for the value of a setting in the help of a command.

use crate::config::{Setting, Unit};

/// What stands for the value of a setting in its help.
pub(super) fn value_name(setting: &Setting) -> &'static str {
    match setting.unit {
        Unit::Count => "NUMBER",
        Unit::Bytes => "SIZE",
        Unit::Seconds => "PERIOD",
        Unit::None if matches!(setting.default, "on" | "off") => "on|off",
        Unit::None if setting.name.ends_with("listen") => "ADDRESS",
        Unit::None if matches!(setting.name, "database" | "otlp_endpoint" | "token_issuer") => "URL",
        Unit::None if setting.name == "data" => "FOLDER",
        Unit::None => "VALUE",
    }
}
