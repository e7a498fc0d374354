//! `contacts`: where feet and hands rest on something in the source.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::{ContactCurve, Scope};

/// Finds out when feet (and hands, where asked) rest on the floor in the source. Later ops use it, and it is returned with the
/// result, so that it can be edited and sent back in `set`, `add` and `remove`.
///
/// A point touches when it is both low and slow; each test has a lower threshold to begin and a higher one to end. Heights and
/// speeds are for a leg of 1 m and grow with the source's leg. Heights are above the level at which the point rests in this
/// clip; where feet walk up and down, on stairs, slopes or in a capture that drifts, above what they stand on. Points: `left_foot` and `right_foot` (the back of the heel), `left_toe` and `right_toe` (the ball), `left_toe_tip` and
/// `right_toe_tip`, `left_hand` and `right_hand`. The points of a foot are those of its sole, from the mesh where there is one, else
/// guessed from its joints. Below a figure that walks on the spot the floor is taken to run, and speeds are those over it. Only source points count, so the result does not depend on the target.
///
/// Contacts that come with the source's clip (`contacts` of pose arrays, those that an output of this program notes in its `extras`)
/// are taken instead of what is found: a foot of which they say something touches only when they say so.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct ContactsOp {
    /// When it works; the mask names points.
    #[serde(flatten)]
    pub scope: Scope,
    /// Whether contacts are looked for. Otherwise there are only those that come with the clip, and those of `set`, `curves` and `add`.
    pub detect: bool,
    /// Meters above its resting level below which a point may begin to touch, at a leg of 1 m. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub height_on: f64,
    /// Meters above which a touching point lets go. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub height_off: f64,
    /// Meters per second below which a point may begin to touch, at a leg of 1 m. 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub speed_on: f64,
    /// Meters per second above which a touching point lets go. 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub speed_off: f64,
    /// Meters per second below which a point that comes to rest has landed: heels strike the floor faster than toes leave it. 0 to
    /// 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub speed_land: f64,
    /// Shorter contacts are dropped. 0 to 10 seconds.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub least_seconds: f64,
    /// Shorter gaps between contacts are closed. 0 to 10 seconds.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub gap_seconds: f64,
    /// Half the width of the smoothing before heights and speeds are taken. 0 to 1 second.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub smoothing_seconds: f64,
    /// Above what heights are measured.
    pub floor: ContactFloor,
    /// Contacts of these points instead of what is found: point to a list of `[from, to]` in seconds.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub set: BTreeMap<String, Vec<[f64; 2]>>,
    /// Contacts of these points from curves of the source's clip instead of what is found: point to a curve and its bounds. For clips
    /// whose feet have their speeds baked in, or switches that say when they are locked.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub curves: BTreeMap<String, ContactCurve>,
    /// Contacts beside what is found, likewise.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub add: BTreeMap<String, Vec<[f64; 2]>>,
    /// Times without contact, likewise.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub remove: BTreeMap<String, Vec<[f64; 2]>>,
}

impl Default for ContactsOp {
    fn default() -> Self {
        Self {
            scope: Scope::default(),
            detect: true,
            height_on: 0.03,
            height_off: 0.05,
            speed_on: 0.2,
            speed_off: 0.65,
            speed_land: 1.1,
            least_seconds: 0.08,
            gap_seconds: 0.07,
            smoothing_seconds: 0.05,
            floor: ContactFloor::default(),
            set: BTreeMap::new(),
            curves: BTreeMap::new(),
            add: BTreeMap::new(),
            remove: BTreeMap::new(),
        }
    }
}

/// Above what the heights of contact points are measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"adaptive\", \"any\" or a height in meters")]
pub enum ContactFloor {
    /// A floor at this height in the source, in meters along its up axis.
    Height(f64),
    /// A rule.
    Rule(ContactFloorRule),
}

impl Default for ContactFloor {
    fn default() -> Self {
        Self::Rule(ContactFloorRule::Adaptive)
    }
}

/// A rule for the floor of contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactFloorRule {
    /// The level at which each point is slow most often, and above that what the figure walks on: stairs, slopes.
    #[default]
    Adaptive,
    /// None: slow points touch at any height. For ground that is not found.
    Any,
}
