//! isoswarm-web: a scene for JavaScript. Glue over `isoswarm-scene`, without algorithms.
//!
//! Texts in and out are JSON of the shapes in `web/src/client/protocol.ts`; columns are typed arrays of their own, which can be transferred. What goes wrong
//! is thrown as the JSON of a `Failure`. A panic ends the module: `panicked` tells JavaScript why before it does.

#[cfg(feature = "jobs")]
mod export;
mod failure;
mod frame;
#[cfg(feature = "jobs")]
mod mesh;
mod open;
mod report;
mod state;

use std::ops::ControlFlow;

use isoswarm_scene::{Command, Progress, Scene};
use serde::Serialize;
use wasm_bindgen::prelude::*;

pub use failure::start;
use failure::{Failure, Thrown};

/// What JavaScript calls.
type Answer<T> = Result<T, JsValue>;

pub(crate) fn to_json(value: &impl Serialize) -> Answer<String> {
    serde_json::to_string(value).map_err(|e| Failure::input(e.to_string()).into())
}

/// A scene.
#[wasm_bindgen]
pub struct Core {
    pub(crate) scene: Scene,
    /// What the next frame tells of the steps since the last one.
    pub(crate) since: frame::Since,
}

#[wasm_bindgen]
impl Core {
    /// A scene from a source (JSON: text, parameters, settings, script) and the floaters that it had, 3 numbers each.
    pub fn open(source: &str, floaters: &[f64]) -> Answer<Core> {
        let scene = open::open(source, floaters)?;
        let since = frame::Since::of(&scene);
        Ok(Core { scene, since })
    }

    /// Carries a command out and gives the change. `tell(done, of, remaining)` is called once a step; true ends the command.
    pub fn apply(&mut self, command: &str, tell: &js_sys::Function) -> Answer<String> {
        let command: Command =
            serde_json::from_str(command).map_err(|e| Failure::input(format!("command: {e}")))?;
        let stop = |p: &Progress| {
            let (done, of, remaining) = (p.steps as f64, p.most as f64, p.remaining);
            tell.call3(&JsValue::NULL, &done.into(), &of.into(), &remaining.into())
                .is_ok_and(|v| v.is_truthy())
        };
        let change = self.scene.apply_with(command, &mut |_, p| flow(stop(p))).thrown()?;
        to_json(&report::change(&change))
    }

    /// Up to so many steps, as long as `more()` is true; how many were taken.
    pub fn advance(&mut self, steps: usize, more: &js_sys::Function) -> Answer<usize> {
        let before = self.scene.clock();
        if steps > 0 {
            let over = |_: &Progress| !more.call0(&JsValue::NULL).is_ok_and(|v| v.is_truthy());
            self.scene.apply_with(Command::Step { count: steps }, &mut |_, p| flow(over(p))).thrown()?;
        }
        Ok((self.scene.clock() - before) as usize)
    }

    /// All but the floaters.
    pub fn state(&self) -> Answer<String> {
        to_json(&state::state(&self.scene)?)
    }

    /// Whether something is being dragged.
    pub fn is_held(&self) -> bool {
        self.scene.is_held()
    }

    /// Where a ray first meets the surface, or `null`.
    pub fn pick(&self, ox: f64, oy: f64, oz: f64, dx: f64, dy: f64, dz: f64) -> Answer<String> {
        to_json(&self.scene.pick([ox, oy, oz], [dx, dy, dz]).thrown()?.map(report::hit))
    }

    /// The nearest point of the surface, or `null`.
    pub fn project(&self, x: f64, y: f64, z: f64) -> Answer<String> {
        to_json(&self.scene.nearest([x, y, z]).thrown()?.map(report::hit))
    }

    /// The text of an `.iso.json` file.
    pub fn save(&self) -> Answer<String> {
        self.scene.to_json().thrown()
    }

    /// What has been done, as a script.
    pub fn log(&self) -> String {
        isoswarm_scene::script_to_json(self.scene.log())
    }

    /// The part at a path (empty: the whole) as the text of a model file.
    pub fn part(&self, path: &str) -> Answer<String> {
        let model = self.scene.model().thrown()?;
        let part = if path.is_empty() { model } else { model.node(path).thrown()? };
        Ok(isoswarm_field::json::to_json(&part))
    }

    /// The box around the part at a path (empty: the whole), as it is before the operators above it; `null` where none is found.
    pub fn part_box(&self, path: &str) -> Answer<String> {
        let model = self.scene.model().thrown()?;
        let part = if path.is_empty() { model } else { model.node(path).thrown()? };
        let found = isoswarm_field::Field::new(&part).thrown()?.bounds();
        to_json(&found.map(|b| [b.lo, b.hi]))
    }
}

fn flow(stop: bool) -> ControlFlow<()> {
    if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// The table of kinds.
#[wasm_bindgen]
pub fn kinds() -> Answer<String> {
    to_json(&isoswarm_field::model::kinds())
}

/// The table of adapters.
#[wasm_bindgen]
pub fn adapters() -> Answer<String> {
    let rows = isoswarm_field::model::adapters::ADAPTERS;
    to_json(&rows.iter().map(|a| serde_json::json!({ "name": a.name, "doc": a.doc })).collect::<Vec<_>>())
}

/// Whether a text can be read as a model or a scene.
#[wasm_bindgen]
pub fn check(text: &str, parameters: &str) -> Answer<String> {
    to_json(&open::check(text, parameters)?)
}

/// The version of the core.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").into()
}
