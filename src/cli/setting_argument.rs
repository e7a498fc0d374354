//! A setting as an argument of a command: its flag, its environment variable and its help.

use clap::Arg;

use crate::config::{Setting, Unit};

/// The argument of a setting, which is known by the setting's name.
pub(super) fn setting_argument(setting: &Setting) -> Arg {
    Arg::new(setting.name)
        .long(setting.name.replace('_', "-"))
        .env(setting.variable())
        .value_name(value_name(setting))
        .help(format!("{} [default: {}]", setting.help.trim(), setting.default))
}

/// What stands for the value of a setting in its help.
fn value_name(setting: &Setting) -> &'static str {
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
