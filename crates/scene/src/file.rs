//! Scenes and scripts as `.iso.json` files. They may come from strangers: sizes and versions are checked, and what is not known
//! is refused. Version 2 of a scene may have an adapter on; one without is written as version 1.

use std::collections::HashMap;
use std::sync::Arc;

use isoswarm_field::arrange::Arrange;
use isoswarm_field::{Aabb, Callback, Model, json};
use isoswarm_particles::control::{Guide, Pin};
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

#[cfg(feature = "schema")]
use crate::Command;
use crate::adapting::Adapting;
use crate::adapting_file::AdaptingRecord;
use crate::command::check_place;
use crate::control::ScenePin;
use crate::{Along, Amount, Entry, Error, Scene, Settings};

/// What a file of a scene calls itself.
pub const FORMAT: &str = "isoswarm scene";
/// What a file of commands calls itself.
pub const SCRIPT_FORMAT: &str = "isoswarm script";
/// The newest version of a scene that this code reads and, where an adapter is on, writes.
pub const VERSION: u32 = 2;
/// The version of scripts, and of scenes without an adapter.
const PLAIN_VERSION: u32 = 1;
/// Most pins and most commands in a file.
const MOST_PINS: usize = 100_000;
const MOST_COMMANDS: usize = 1_000_000;
/// Largest clock and largest number of a pin: what every reader of JSON takes exactly.
const LARGEST: u64 = 1 << 53;

#[derive(Deserialize)]
struct Header {
    format: Option<String>,
    version: Option<u32>,
}

/// A model being edited: see `isoswarm_scene`.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", schemars(title = "isoswarm scene"))]
struct SceneFile<'a> {
    /// "isoswarm scene"
    #[serde(rename = "format")]
    _format: &'a str,
    /// 1; 2 where an adapter is on
    #[serde(rename = "version")]
    version: u32,
    /// A model with its parameters: see iso.schema.json.
    #[serde(borrow)]
    #[cfg_attr(feature = "schema", schemars(with = "serde_json::Value"))]
    model: &'a RawValue,
    /// What the scene is set to.
    #[serde(default)]
    settings: Settings,
    /// Control points.
    #[serde(default)]
    pins: Vec<PinRecord>,
    /// The number of the next pin.
    #[serde(default)]
    next_pin: Option<u64>,
    /// Values of all parameters to which recovery leads back.
    #[serde(default)]
    rest: Option<Vec<f64>>,
    /// Mean distance between neighbouring floaters, where their number was given; found anew if missing.
    #[serde(default)]
    spacing: Option<f64>,
    /// Steps taken.
    #[serde(default)]
    clock: u64,
    /// The adapter that is on: since version 2.
    #[serde(default, borrow)]
    adapting: Option<AdaptingRecord<'a>>,
}

/// A control point.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct PinRecord {
    pub(crate) id: u64,
    pub(crate) at: [f64; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<String>,
    #[serde(default = "one")]
    pub(crate) weight: f64,
    #[serde(default)]
    pub(crate) softness: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) along: Option<Along>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) grip: Option<f64>,
}

/// Commands, one after the other. Each may have `at_step`, the clock to wait for.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", schemars(title = "isoswarm script"))]
struct ScriptFile {
    /// "isoswarm script"
    #[serde(rename = "format")]
    _format: String,
    /// 1
    #[serde(rename = "version")]
    _version: u32,
    /// What is done.
    #[cfg_attr(feature = "schema", schemars(with = "Vec<TimedCommand>"))]
    commands: Vec<serde_json::Value>,
}

/// An entry of a script, for the schema.
#[cfg(feature = "schema")]
#[derive(JsonSchema)]
#[allow(dead_code)]
struct TimedCommand {
    /// The clock to wait for.
    at_step: Option<u64>,
    /// What is done.
    #[serde(flatten)]
    command: Command,
}

/// The JSON schemas of scenes and scripts, by file name.
#[cfg(feature = "schema")]
pub fn schemas() -> [(&'static str, String); 2] {
    let text =
        |s: schemars::Schema| serde_json::to_string_pretty(&s).expect("a schema is serialisable") + "\n";
    [
        ("scene.schema.json", text(schemars::schema_for!(SceneFile<'static>))),
        ("script.schema.json", text(schemars::schema_for!(ScriptFile))),
    ]
}

fn one() -> f64 {
    1.0
}

fn fail<T>(format: &'static str, line: usize, reason: impl Into<String>) -> Result<T, Error> {
    Err(Error::File { format, line, reason: reason.into() })
}

fn syntax(format: &'static str, e: &serde_json::Error) -> Error {
    Error::File { format, line: e.line(), reason: e.to_string() }
}

/// Checks what a text says it is.
fn check_header(text: &str, format: &'static str, newest: u32) -> Result<(), Error> {
    if text.len() > json::MAX_BYTES {
        let (most, n) = (json::MAX_BYTES, text.len());
        return fail(format, 0, format!("a file may have {most} bytes, this one has {n}"));
    }
    let header: Header = serde_json::from_str(text).map_err(|e| syntax(format, &e))?;
    match (header.format.as_deref(), header.version) {
        (Some(f), Some(v)) if f == format && (1..=newest).contains(&v) => Ok(()),
        (Some(f), Some(v)) if f == format => {
            let expected = if newest == 1 { "1".into() } else { format!("1 to {newest}") };
            fail(format, 0, format!("expected version {expected}, given {v}: update isoswarm to read it"))
        }
        (f, _) => fail(
            format,
            0,
            format!("expected an object with \"format\": \"{format}\" and \"version\": 1, given {f:?}"),
        ),
    }
}

impl Scene {
    /// The scene as the text of an `.iso.json` file: model, parameters, pins, settings, clock and the adapter that is on, exact to
    /// the last bit. The floaters are not part of it; they settle again. Functions are stored by name.
    ///
    /// # Errors
    /// What the model's formulas report.
    pub fn to_json(&self) -> Result<String, Error> {
        let state = &self.now.state;
        let nested = |m: &Model| json::to_json(m).trim_end().replace('\n', "\n  ");
        let model = nested(&self.model()?);
        let adapting = state.adapting.as_ref().map(|a| a.to_text(&nested(a.original()), &self.now));
        let version = if adapting.is_some() { VERSION } else { PLAIN_VERSION };
        let pins: Vec<String> = state.pins.iter().map(|p| to_text(&record(p))).collect();
        let mut out =
            format!("{{\n  \"format\": \"{FORMAT}\",\n  \"version\": {version},\n  \"model\": {model},\n");
        out += &format!("  \"settings\": {},\n", to_text(&state.settings));
        let list =
            if pins.is_empty() { String::new() } else { format!("\n    {}\n  ", pins.join(",\n    ")) };
        out += &format!("  \"pins\": [{list}],\n  \"next_pin\": {},\n", state.next_pin);
        if let Some(rest) = &state.rest {
            out += &format!("  \"rest\": {},\n", to_text(rest));
        }
        if let Amount::Count(_) = state.settings.amount {
            out += &format!("  \"spacing\": {},\n", to_text(&state.spacing));
        }
        if let Some(adapting) = adapting {
            out += &format!("  \"adapting\": {adapting},\n");
        }
        out += &format!("  \"clock\": {}\n}}\n", self.now.clock);
        Ok(out)
    }

    /// Reads a scene, or a model, which becomes a scene with `settings` (a scene has its own). `functions` gives the function
    /// for each name that the file refers to.
    pub fn from_json(
        text: &str,
        settings: Settings,
        functions: &HashMap<String, Arc<dyn Callback>>,
    ) -> Result<Self, Error> {
        Self::from_json_with(text, settings, functions, &[])
    }

    /// The same with floaters that are known, such as those that the scene had when it was saved: those near the surface stay, and
    /// only where there are none new ones come. Without a spacing in the file they are not used.
    pub fn from_json_with(
        text: &str,
        settings: Settings,
        functions: &HashMap<String, Arc<dyn Callback>>,
        floaters: &[[f64; 3]],
    ) -> Result<Self, Error> {
        if !floaters.iter().flatten().all(|c| c.is_finite()) {
            return Err(Error::option("floaters", "finite numbers", "others"));
        }
        let find = |name: &str| functions.get(name).cloned();
        if serde_json::from_str::<Header>(text).is_ok_and(|h| h.format.as_deref() == Some(json::FORMAT)) {
            return Self::new(&json::from_json_with(text, &find)?, settings);
        }
        check_header(text, FORMAT, VERSION)?;
        let file: SceneFile<'_> = serde_json::from_str(text).map_err(|e| syntax(FORMAT, &e))?;
        if file.pins.len() > MOST_PINS {
            return fail(
                FORMAT,
                0,
                format!("a scene may have {MOST_PINS} pins, this one has {}", file.pins.len()),
            );
        }
        let model = json::from_json_with(file.model.get(), &find)?;
        if file.adapting.is_some() && file.version == PLAIN_VERSION {
            return fail(FORMAT, 0, "adapting: expected version 2 for a scene with an adapter on, given 1");
        }
        let adapting = match &file.adapting {
            Some(record) => {
                let original = json::from_json_with(record.original.get(), &find)?;
                let read = Adapting::of_record(record, original, &model);
                Some(read.or_else(|e| fail(FORMAT, 0, format!("adapting: {e}")))?)
            }
            None => None,
        };
        // What the scene's box is found from may have no end under an adapter.
        let bounds = file.adapting.as_ref().map(|a| Aabb::new(a.bounds[0], a.bounds[1]));
        let spacing = file.spacing.unwrap_or(0.0);
        if !(spacing.is_finite() && spacing >= 0.0) || file.spacing == Some(0.0) {
            return fail(FORMAT, 0, format!("spacing: expected a length above 0, given {spacing}"));
        }
        let ids = file.pins.iter().map(|p| p.id);
        if ids.chain(file.next_pin).chain([file.clock]).any(|n| n > LARGEST) {
            return fail(FORMAT, 0, format!("clock and numbers of pins: expected at most {LARGEST}"));
        }
        let known = match file.settings.amount {
            Amount::Spacing(s) => s,
            Amount::Count(_) => spacing,
        };
        let floaters = if known > 0.0 { floaters } else { &[] };
        let mut scene = Self::with_floaters(&model, file.settings, known, floaters, bounds)?;
        scene.functions.extend(functions.iter().map(|(k, f)| (k.clone(), f.clone())));
        let next = file.pins.iter().map(|p| p.id + 1).max().unwrap_or(0);
        let mut ids: Vec<u64> = file.pins.iter().map(|p| p.id).collect();
        ids.arrange();
        if ids.windows(2).any(|w| w[0] == w[1]) {
            return fail(FORMAT, 0, "two pins have the same id");
        }
        let mut names: Vec<&str> = file.pins.iter().filter_map(|p| p.name.as_deref()).collect();
        names.arrange();
        if let Some(w) = names.windows(2).find(|w| w[0] == w[1]) {
            return fail(FORMAT, 0, format!("two pins are called `{}`", w[0]));
        }
        for record in file.pins {
            let (id, axes) = (record.id, scene.field().axes());
            let mut pin = record.pin(axes).or_else(|e| fail(FORMAT, 0, format!("pin {id}: {e}")))?;
            pin.lay_patch(&scene.now)?;
            scene.now.state.pins.push(pin);
        }
        scene.now.state.next_pin = file.next_pin.unwrap_or(0).max(next);
        if let Some(rest) = file.rest {
            // Under an adapter it is that of the model without it.
            let of_original = adapting.as_ref().map(|a| a.original().parameters().len());
            let expected = of_original.unwrap_or_else(|| scene.field().parameters().len());
            if rest.len() != expected || rest.iter().any(|v| !v.is_finite()) {
                return fail(FORMAT, 0, format!("rest: expected {expected} finite numbers, one a parameter"));
            }
            scene.now.state.rest = Some(rest);
        }
        (scene.now.state.adapting, scene.now.clock) = (adapting, file.clock);
        scene.now.rested = scene.now.state.pins.is_empty();
        Ok(scene)
    }
}

fn record(p: &ScenePin) -> PinRecord {
    PinRecord {
        id: p.id,
        at: p.pin.at,
        name: p.name.clone(),
        weight: p.pin.weight,
        softness: p.pin.softness,
        along: match p.pin.guide {
            Guide::Free => None,
            Guide::Line(v) => Some(Along::Line(v)),
            Guide::Plane(v) => Some(Along::Plane(v)),
        },
        grip: p.grip,
    }
}

impl PinRecord {
    /// The pin, without its patch.
    ///
    /// # Errors
    /// Numbers that make no sense.
    pub(crate) fn pin(self, axes: usize) -> Result<ScenePin, Error> {
        check_place("pin", self.at, axes)?;
        if !(self.weight.is_finite() && self.weight > 0.0) {
            return Err(Error::option("weight", "a finite number above 0", self.weight));
        }
        if !(self.softness.is_finite() && self.softness >= 0.0) {
            return Err(Error::option("softness", "a finite number from 0 up", self.softness));
        }
        if let Some(r) = self.grip.filter(|r| !(r.is_finite() && *r > 0.0)) {
            return Err(Error::option("grip", "a radius above 0", r));
        }
        if self.name.as_ref().is_some_and(|n| n.is_empty()) {
            return Err(Error::option("name", "a name that is not empty", "``"));
        }
        if let Some(Along::Line(v) | Along::Plane(v)) = self.along
            && axes == 2
            && v[2] != 0.0
        {
            return Err(Error::option("along", "z = 0, as the model is a plane curve", format!("{v:?}")));
        }
        let guide = match self.along {
            None => Guide::Free,
            // Directions that have been written are of length 1 already, and keep their bits.
            Some(Along::Line(v)) if is_unit(v) => Guide::Line(v),
            Some(Along::Plane(v)) if is_unit(v) => Guide::Plane(v),
            Some(a) => a
                .guide()
                .ok_or_else(|| Error::option("along", "a direction that is not zero", format!("{a:?}")))?,
        };
        let pin = Pin { weight: self.weight, softness: self.softness, guide, ..Pin::new(self.at) };
        Ok(ScenePin { id: self.id, name: self.name, pin, grip: self.grip, patch: Vec::new() })
    }
}

fn is_unit(v: [f64; 3]) -> bool {
    (crate::vector::norm(v) - 1.0).abs() < 1e-12
}

pub(crate) fn to_text(v: &impl Serialize) -> String {
    serde_json::to_string(v).expect("finite numbers and names are serialisable")
}

/// Commands as the text of a script, one a line.
pub fn script_to_json(entries: &[Entry]) -> String {
    let lines: Vec<String> = entries.iter().map(to_text).collect();
    let list = if lines.is_empty() { String::new() } else { format!("\n    {}\n  ", lines.join(",\n    ")) };
    format!(
        "{{\n  \"format\": \"{SCRIPT_FORMAT}\",\n  \"version\": {PLAIN_VERSION},\n  \"commands\": [{list}]\n}}\n"
    )
}

/// Reads a script: `{"format": "isoswarm script", "version": 1, "commands": [...]}`.
pub fn script_from_json(text: &str) -> Result<Vec<Entry>, Error> {
    check_header(text, SCRIPT_FORMAT, PLAIN_VERSION)?;
    let file: ScriptFile = serde_json::from_str(text).map_err(|e| syntax(SCRIPT_FORMAT, &e))?;
    if file.commands.len() > MOST_COMMANDS {
        let n = file.commands.len();
        return fail(
            SCRIPT_FORMAT,
            0,
            format!("a script may have {MOST_COMMANDS} commands, this one has {n}"),
        );
    }
    file.commands
        .into_iter()
        .enumerate()
        .map(|(k, v)| entry(v).or_else(|e| fail(SCRIPT_FORMAT, 0, format!("command {k}: {e}"))))
        .collect()
}

/// The time beside, the rest is the command: `flatten` would let unknown fields through.
fn entry(mut v: serde_json::Value) -> Result<Entry, serde_json::Error> {
    let at = v.as_object_mut().and_then(|o| o.remove("at_step"));
    let at = at.map(serde_json::from_value).transpose()?;
    Ok(Entry { at, command: serde_json::from_value(v)? })
}
