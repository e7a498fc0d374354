//! Settings that each can be used, and not together.

use super::{
    settings::{SettingError, Settings},
    tokens::{KeyPlace, Names, is_guarded_url},
    value::{Authentication, SettingValue as _},
};

impl Settings {
    /// What cannot stand together: tokens that nobody asks for, or whose signatures or audience cannot be checked.
    pub(super) fn contradictions(&self) -> Vec<SettingError> {
        let mut errors = Vec::new();
        let mut contradicts = |name: &str, seen: &str, expected: &str, example: &'static str| {
            let setting = Self::TABLE.iter().find(|setting| setting.name == name);
            errors.extend(setting.map(|setting| setting.error(seen.to_owned(), expected.to_owned(), example)));
        };
        let issuer = self.token_issuer.as_str();
        if issuer.is_empty() {
            if !self.token_audience.0.is_empty() || self.token_keys != KeyPlace::Discovered {
                let expected = "expected the issuer that tokens must name, since other settings of tokens are given";
                contradicts("token_issuer", issuer, expected, "https://id.studio.example");
            }
            return errors;
        }
        if self.token_audience.0.is_empty() {
            let expected = "expected what tokens for this service name as their audience, since an issuer is given";
            contradicts("token_audience", "", expected, Names::EXAMPLE);
        }
        if self.token_keys == KeyPlace::Discovered && !is_guarded_url(issuer) {
            let expected = "expected where the issuer's keys are, since the issuer is not an https URL at which they could be looked up";
            contradicts("token_keys", "", expected, KeyPlace::EXAMPLE);
        }
        if self.authentication == Authentication::None {
            let expected = "expected 'auto' or 'keys', since an issuer of tokens is given";
            contradicts("authentication", "none", expected, Authentication::EXAMPLE);
        }
        errors
    }
}
