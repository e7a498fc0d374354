//! How the pelvis moves and turns.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod sizes;
pub(in crate::retarget) mod spec;

pub use self::spec::{HeightRule, PelvisOp, PelvisScale, PelvisScaleRule, ScaleOrigin};

use crate::retarget::ops::{
    context::Context,
    fade::Fade,
    op_spec::OpSpec,
    scope::{Alpha, Scope},
};

/// Factors beyond this are refused.
const MAX_SCALE: f64 = 1e6;

impl OpSpec for PelvisOp {
    fn scope(&self) -> Option<&Scope> {
        None
    }

    fn alpha(&self) -> &Alpha {
        &self.alpha
    }

    fn looks_at_whole_clip(&self) -> bool {
        self.frames.is_some()
    }

    fn check(&self, refuse: &mut dyn FnMut(&str, String)) {
        let scale = if let PelvisScale::Value(value) = self.scale { value } else { 1.0 };
        let named =
            [("scale", scale), ("scale_horizontal", self.scale_horizontal), ("scale_vertical", self.scale_vertical)];
        for (name, value) in named {
            if !(value.is_finite() && value.abs() <= MAX_SCALE) {
                refuse(name, format!("{value} is out of range"));
            }
        }
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let schedule = context.fade(&self.alpha, self.frames);
        let pelvis = context.mapping.pelvis.filter(|_| self.enabled);
        if let Some((schedule, pelvis)) = schedule.zip(pelvis) {
            context.push_front(schedule, Fade(vec![pelvis.target]));
        }
    }
}
