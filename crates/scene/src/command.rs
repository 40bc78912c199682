//! What can be done to a scene, as data: logged, saved, replayed.

use isoswarm_particles::control::Guide;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

use crate::vector::unit;
use crate::{Error, Settings};

/// A pin by its number or its name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(untagged)]
pub enum PinRef {
    /// The number that [`crate::Change::pin`] gave.
    Number(u64),
    /// The name that it was given.
    Name(String),
}

impl<'de> Deserialize<'de> for PinRef {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        match Value::deserialize(from)? {
            Value::String(name) => Ok(PinRef::Name(name)),
            other => other
                .as_u64()
                .map(PinRef::Number)
                .ok_or_else(|| D::Error::custom("expected a pin's number or its name")),
        }
    }
}

/// Along what a pin may give way; directions need not have length 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Along {
    /// A line of this direction.
    Line([f64; 3]),
    /// The plane of this normal.
    Plane([f64; 3]),
}

impl Along {
    /// With a direction of length 1; `None` where it has none.
    pub(crate) fn guide(self) -> Option<Guide> {
        match self {
            Along::Line(v) => unit(v).map(Guide::Line),
            Along::Plane(v) => unit(v).map(Guide::Plane),
        }
    }
}

/// A pin and where it is dragged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Hand {
    /// The pin.
    pub pin: PinRef,
    /// Where to (model units).
    pub to: [f64; 3],
}

/// The enum, and how it is read. What serde derives for a tag among the other fields is a hundred kilobytes: here the tag is taken out, and
/// the rest read as what it is then, a variant of `Apart`.
macro_rules! command {
    ($(#[$about:meta])* pub enum Command { $($variants:tt)* }) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq, Serialize)]
        #[cfg_attr(feature = "schema", derive(JsonSchema))]
        #[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
        pub enum Command { $($variants)* }

        #[derive(Deserialize)]
        #[serde(remote = "Command", rename_all = "snake_case", deny_unknown_fields)]
        enum Apart { $($variants)* }
    };
}

impl<'de> Deserialize<'de> for Command {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let mut fields = serde_json::Map::deserialize(from)?;
        match fields.remove("do") {
            Some(Value::String(name)) => {
                let mut apart = serde_json::Map::new();
                apart.insert(name, Value::Object(fields));
                Apart::deserialize(Value::Object(apart)).map_err(D::Error::custom)
            }
            Some(other) => {
                Err(D::Error::custom(format!("expected the name of a command as `do`, given {other}")))
            }
            None => Err(D::Error::missing_field("do")),
        }
    }
}

command! {
/// A change of a scene. In files: `{"do": "drag", "hands": [{"pin": "hand", "to": [1, 2, 0]}]}`.
pub enum Command {
    /// Gives a parameter a value; a discrete one too.
    Set {
        /// Its path.
        path: String,
        /// The value.
        value: f64,
        /// Whether it goes on with the last change of the same parameter, as a slider does: undo takes both back.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        continued: bool,
    },
    /// Takes values of parameters and places of pins over from a scene that is the same but for them: all at once, exactly as they
    /// come.
    Assign {
        /// Values by path, discrete ones apart.
        #[serde(default)]
        values: std::collections::BTreeMap<String, f64>,
        /// Pins and where they are.
        #[serde(default)]
        pins: Vec<Hand>,
    },
    /// Locks the parameters that fit the pattern (a path in which `*` stands for anything), or lets them go.
    Freeze {
        /// The pattern.
        pattern: String,
        /// Whether to lock.
        #[serde(default = "yes")]
        frozen: bool,
    },
    /// Bounds of the parameters that fit the pattern; null: none but what the kind of node asks for (a radius stays above 0).
    Limit {
        /// The pattern.
        pattern: String,
        /// Smallest and largest value.
        bounds: [Option<f64>; 2],
    },
    /// A typical change of the parameters that fit the pattern.
    Scale {
        /// The pattern.
        pattern: String,
        /// Above 0.
        scale: f64,
    },
    /// A control point on the surface near a point.
    Pin {
        /// The point (model units).
        at: [f64; 3],
        /// A name to refer to it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// What it counts beside pins that contradict it, above 0; it acts squared.
        #[serde(default = "one")]
        weight: f64,
        /// 0: met exactly where possible; above 0: missed at a cost.
        #[serde(default)]
        softness: f64,
        /// Along what it may give way.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        along: Option<Along>,
        /// Radius of a patch of the surface that moves with it (against slipping); model units.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        grip: Option<f64>,
    },
    /// Removes a control point.
    Unpin {
        /// Which.
        pin: PinRef,
    },
    /// Takes hold of pins, or tells where those held are dragged to now; [`Command::Step`] moves them.
    Grab {
        /// Pins and where they go.
        hands: Vec<Hand>,
        /// Radius of the region around each that follows, less and less towards its edge; model units.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        radius: Option<f64>,
    },
    /// Lets go, and settles.
    Release {},
    /// Takes hold, drags until the pins arrive or nothing moves any more, lets go, settles.
    Drag {
        /// Pins and where they go.
        hands: Vec<Hand>,
        /// See [`Command::Grab`].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        radius: Option<f64>,
        /// Most steps.
        #[serde(default = "many")]
        steps: usize,
    },
    /// Turns and moves several pins together, as a handle does.
    Turn {
        /// The pins.
        pins: Vec<PinRef>,
        /// What stays in place under the rotation (model units).
        centre: [f64; 3],
        /// Axis times angle (radians).
        #[serde(default)]
        rotation: [f64; 3],
        /// Added to it (model units).
        #[serde(default)]
        translation: [f64; 3],
        /// Most steps.
        #[serde(default = "many")]
        steps: usize,
    },
    /// Lets time pass.
    Step {
        /// How many steps, up to 10 million.
        #[serde(default = "once")]
        count: usize,
    },
    /// Moves the free parameters until the surface passes through points, as well as it can.
    Fit {
        /// The points (model units).
        points: Vec<[f64; 3]>,
        /// What each counts, 0 or more; empty: 1.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        weights: Vec<f64>,
        /// What a distance costs: robust losses make little of points that are far off.
        #[serde(default)]
        loss: FitLoss,
        /// Most iterations.
        #[serde(default = "hundred")]
        iterations: usize,
    },
    /// Takes the present shape as the shape to which [`Settings::recovery`] leads back.
    Rest {},
    /// Other settings.
    Settings {
        /// All of them.
        settings: Settings,
    },
    /// Another operand of the operator at a path, or the union of the node there and the part.
    Add {
        /// The node; empty: the whole.
        #[serde(default)]
        path: String,
        /// A formula, or the text of a model file.
        model: String,
        /// Its name in the model.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
    },
    /// Another part at a path.
    Replace {
        /// The node; empty: the whole.
        #[serde(default)]
        path: String,
        /// A formula, or the text of a model file.
        model: String,
    },
    /// Takes a part out.
    Remove {
        /// The node.
        path: String,
    },
    /// Leaves a part out of the operator above it, or takes it in again; its parameters stay, pins on it go.
    Hide {
        /// The node.
        path: String,
        /// Whether to leave it out.
        #[serde(default = "yes")]
        hidden: bool,
    },
    /// Puts a part inside an operator.
    Wrap {
        /// The node; empty: the whole.
        #[serde(default)]
        path: String,
        /// A kind on one operand.
        kind: String,
        /// Its parameters by name; the others as the table has them.
        #[serde(default, skip_serializing_if = "std::collections::BTreeMap::is_empty")]
        parameters: std::collections::BTreeMap<String, f64>,
        /// The operator's name in the model.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
    },
    /// Takes an operator off its only operand.
    Unwrap {
        /// The node.
        path: String,
    },
    /// The operands of a node in another order.
    Reorder {
        /// The node; empty: the whole.
        #[serde(default)]
        path: String,
        /// The present place of each operand.
        order: Vec<usize>,
    },
    /// Puts an adapter on a part: a deformation whose few parameters are all that pins then move, while the part's own parameters
    /// follow. See [`isoswarm_field::model::adapters`].
    Adapt {
        /// The node; empty: the whole.
        #[serde(default)]
        path: String,
        /// `mover`, `rotate`, `scale`, `taper`, `twist`, `bend` or `lattice`.
        adapter: String,
        /// The point that stays; the middle of the part if not given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        center: Option<[f64; 3]>,
        /// 0: x, 1: y, 2: z, of a taper, a twist or a bend; z if not given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
        /// Half of the size of a lattice's box; around the part if not given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        half: Option<[f64; 3]>,
        /// Control points of a lattice along x, y and z; three each if not given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        controls: Option<[usize; 3]>,
    },
    /// Takes the adapter off; the part keeps what its parameters could take on.
    Accept {},
    /// Leaves the adapter in the model as an operator.
    Keep {},
    /// Takes the adapter off; the part is as it was.
    Cancel {},
    /// Takes an operator off its only operand, whose parameters take its effect on. Refused where they cannot.
    Flatten {
        /// The node.
        path: String,
    },
    /// Gives a node a name.
    Rename {
        /// The node; empty: the whole.
        #[serde(default)]
        path: String,
        /// The name: letters, digits and `_`; empty: none.
        name: String,
    },
    /// A copy of a part, with parameters of its own, where [`Command::Add`] would put another part beside it.
    Duplicate {
        /// The node; empty: the whole.
        #[serde(default)]
        path: String,
        /// The copy's name; without it that of the part.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
    },
    /// Several commands as one, undone together. If one fails none is done.
    Together {
        /// All but undo, redo and together.
        commands: Vec<Command>,
    },
    /// Takes back the last change of the model, the parameters, the pins or the settings.
    Undo {},
    /// Makes it again.
    Redo {},
}
}

/// Refuses what is no place: not finite, so far off that squares overflow, or off the plane of a curve.
pub(crate) fn check_place(name: &'static str, p: [f64; 3], axes: usize) -> Result<(), Error> {
    if !p.iter().all(|c| c.is_finite() && c.abs() < 1e100) {
        return Err(Error::option(name, "three finite numbers below 1e100", format!("{p:?}")));
    }
    if axes == 2 && p[2] != 0.0 {
        return Err(Error::option(name, "z = 0, as the model is a plane curve", format!("{p:?}")));
    }
    Ok(())
}

impl Command {
    /// Refuses what would take for ever.
    pub(crate) fn check(&self) -> Result<(), Error> {
        match self {
            Command::Drag { steps: n, .. } | Command::Turn { steps: n, .. } | Command::Step { count: n }
                if *n as u64 > MOST_STEPS =>
            {
                Err(Error::option("steps", format!("up to {MOST_STEPS}"), n))
            }
            _ => Ok(()),
        }
    }

    /// The same, ended after so many steps.
    pub(crate) fn shorten(&mut self, steps: usize) {
        match self {
            Command::Drag { steps: most, .. }
            | Command::Turn { steps: most, .. }
            | Command::Step { count: most } => *most = steps,
            Command::Fit { iterations, .. } => *iterations = steps.max(1),
            _ => {}
        }
    }
}

/// What a distance costs in a fit; robust losses make little of distances beyond a length (model units, above 0).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum FitLoss {
    /// Its square.
    #[default]
    Squares,
    /// Its square up to the length, then linear.
    Huber(f64),
    /// About its square up to the length, then its logarithm.
    Cauchy(f64),
    /// A smooth Huber loss.
    SoftL1(f64),
}

fn hundred() -> usize {
    100
}

fn yes() -> bool {
    true
}

fn one() -> f64 {
    1.0
}

fn once() -> usize {
    1
}

/// Most steps that a command may be asked for.
pub(crate) const MOST_STEPS: u64 = 10_000_000;

/// Most steps of a drag by default.
pub(crate) const DRAG_STEPS: usize = 1000;

fn many() -> usize {
    DRAG_STEPS
}
