//! What a scene is set to.

#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;

/// How many floaters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Amount {
    /// As many as make the mean distance between neighbours this long (model units).
    Spacing(f64),
    /// About this many on the surface as it is now; the spacing that follows stays while the surface changes.
    Count(usize),
}

/// Denser floaters around a point: the user's focus of interest (WH94, future work).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Focus {
    /// Within about this distance of the dragged pins, or of all pins where none is dragged (model units).
    pub radius: f64,
    /// the spacing is this part of the spacing elsewhere, 0.01 to 1.
    pub factor: f64,
}

/// What a scene is set to; lengths in model units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// How many floaters.
    #[serde(default = "default_amount")]
    pub amount: Amount,
    /// Seed of every random choice.
    #[serde(default)]
    pub seed: u64,
    /// Smallest and largest corner of the box that clips the surface; found from the model, and found anew while
    /// it changes, if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Part of the way to its target that a dragged pin goes in a step, above 0 to 1: the spring between pin and hand.
    #[serde(default = "default_gain")]
    pub gain: f64,
    /// Longest way of a dragged pin in a step as a part of the model's diameter, above 0 to 0.25.
    #[serde(default = "default_speed")]
    pub speed: f64,
    /// Part of the way back to the rest shape (see [`crate::Command::Rest`]) in a step, 0 to 1; 0: stay.
    #[serde(default)]
    pub recovery: f64,
    /// Denser floaters where the surface is curved, 0 to 1: at 1 their number per area grows with the square of the curvature, between
    /// one quarter and four times that of uniform ones; 0: the same everywhere.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub curvature: f64,
    /// Whether floaters go along with the surface where it moves, keeping their normals, as if painted on it: each can be followed
    /// through time. Otherwise they take the shortest way to where it is.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub follow: bool,
    /// Denser floaters around the hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus: Option<Focus>,
}

fn is_zero(v: &f64) -> bool {
    *v == 0.0
}

fn default_amount() -> Amount {
    Amount::Count(1000)
}

fn default_gain() -> f64 {
    0.4
}

fn default_speed() -> f64 {
    0.02
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            amount: default_amount(),
            seed: 0,
            bounds: None,
            gain: default_gain(),
            speed: default_speed(),
            recovery: 0.0,
            curvature: 0.0,
            follow: false,
            focus: None,
        }
    }
}

impl Settings {
    /// Largest number of floaters that a scene is asked for.
    pub const MOST: usize = 5_000_000;

    /// Whether all of it makes sense.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let within = |name, v: f64, lo: f64, hi: f64| {
            if v > lo && v <= hi {
                Ok(())
            } else {
                Err(Error::option(name, format!("a number above {lo} up to {hi}"), v))
            }
        };
        match self.amount {
            Amount::Spacing(s) => within("spacing", s, 0.0, f64::MAX)?,
            Amount::Count(n) if !(4..=Self::MOST).contains(&n) => {
                return Err(Error::option("n", format!("4 to {} floaters", Self::MOST), n));
            }
            Amount::Count(_) => {}
        }
        if let Some([lo, hi]) = self.bounds
            && !(0..3).all(|a| lo[a].is_finite() && hi[a].is_finite() && lo[a] <= hi[a])
        {
            return Err(Error::option(
                "bounds",
                "two finite corners with lo <= hi",
                format!("{lo:?}, {hi:?}"),
            ));
        }
        within("gain", self.gain, 0.0, 1.0)?;
        within("speed", self.speed, 0.0, 0.25)?;
        if !(0.0..=1.0).contains(&self.recovery) {
            return Err(Error::option("recovery", "a number from 0 to 1", self.recovery));
        }
        if !(0.0..=1.0).contains(&self.curvature) {
            return Err(Error::option("curvature", "a number from 0 to 1", self.curvature));
        }
        if let Some(f) = self.focus {
            within("focus radius", f.radius, 0.0, f64::MAX)?;
            if !(0.01..=1.0).contains(&f.factor) {
                return Err(Error::option("focus factor", "a number from 0.01 to 1", f.factor));
            }
        }
        Ok(())
    }
}
