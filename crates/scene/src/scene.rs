//! The document: the only thing that changes.

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::Arc;

use isoswarm_field::{Aabb, Callback, Field, Model};
use isoswarm_particles::floaters::Floaters;

use crate::control::{Metric, ScenePin};
use crate::hold::Hold;
use crate::swarm::{Swarm, bounds_of};
use crate::{Change, Command, Error, PinRef, Settings};

/// What undo restores: bit for bit, never by inverse arithmetic.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// The model with its parameters' values and settings, compiled (the compiled part is shared).
    pub(crate) field: Field,
    pub(crate) pins: Vec<ScenePin>,
    pub(crate) next_pin: u64,
    pub(crate) settings: Settings,
    /// Values of all parameters to which recovery leads back.
    pub(crate) rest: Option<Vec<f64>>,
    /// The box that clips the surface.
    pub(crate) bounds: Aabb,
    /// Mean distance between neighbouring floaters that is aimed at.
    pub(crate) spacing: f64,
    /// The adapter that is on.
    pub(crate) adapting: Option<crate::adapting::Adapting>,
}

impl State {
    /// Whether the surface and what the floaters aim at are the same, so that they can stay as they are.
    pub(crate) fn has_surface_of(&self, other: &Self) -> bool {
        let values = |s: &Self| s.field.parameters().iter().map(|p| p.value.to_bits()).collect::<Vec<_>>();
        values(self) == values(other)
            && self.spacing == other.spacing
            && (self.bounds.lo, self.bounds.hi) == (other.bounds.lo, other.bounds.hi)
            && self.field.model() == other.field.model()
    }
}

/// All that changes with time.
#[derive(Clone, Debug)]
pub(crate) struct Now {
    pub(crate) state: State,
    pub(crate) swarm: Swarm,
    pub(crate) clock: u64,
    pub(crate) hold: Option<Hold>,
    pub(crate) metric: Metric,
    /// No pin wants the surface to move.
    pub(crate) rested: bool,
}

/// A command and the step at which it was given.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Entry {
    /// The clock when it was given; missing in scripts, which go on from one command to the next.
    #[serde(rename = "at_step", skip_serializing_if = "Option::is_none")]
    pub at: Option<u64>,
    /// What was done.
    #[serde(flatten)]
    pub command: Command,
}

/// How far a command has come; `Break` ends it where it is.
pub type ProgressFn<'a> = dyn FnMut(&Scene, &Progress) -> ControlFlow<()> + 'a;

/// See [`ProgressFn`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Steps of this command so far.
    pub steps: usize,
    /// The most it may take.
    pub most: usize,
    /// What remains to be done, in model units where something is dragged.
    pub remaining: f64,
}

/// A model being edited: its tree and parameters, the floaters on its surface, control points, settings and a clock.
///
/// ```
/// use isoswarm_field::text;
/// use isoswarm_scene::{Command, Scene, Settings};
/// let sphere = text::parse("sphere(r=1)", &[])?;
/// let mut scene = Scene::new(&sphere, Settings::default())?;
/// let hand = scene.pin([1.0, 0.0, 0.0])?;
/// let report = scene.drag(&[(hand, [1.5, 0.0, 0.0])])?;
/// assert!(report.reached);
/// assert!((scene.field().parameters()[0].value - 1.5).abs() < 1e-6);
/// scene.apply(Command::Undo {})?;
/// assert_eq!(scene.field().parameters()[0].value, 1.0);
/// # Ok::<(), isoswarm_scene::Error>(())
/// ```
pub struct Scene {
    pub(crate) now: Now,
    pub(crate) undo: Vec<State>,
    pub(crate) redo: Vec<State>,
    /// What could be redone until the command under way: back if it fails.
    undone: Vec<State>,
    pub(crate) log: Vec<Entry>,
    pub(crate) functions: HashMap<String, Arc<dyn Callback>>,
}

/// What there is to draw.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Steps taken.
    pub clock: u64,
    /// The floaters: positions, normals, radii, identities.
    pub floaters: &'a Floaters,
    /// Mean distance between neighbouring floaters that is aimed at (model units).
    pub spacing: f64,
    /// The control points.
    pub pins: &'a [ScenePin],
    /// The box that clips the surface.
    pub bounds: &'a Aabb,
    /// Diagonal of the box around the floaters (model units).
    pub size: f64,
    /// Floaters that have split and that have died in steps since the scene was made.
    pub births: u64,
    /// See `births`.
    pub deaths: u64,
}

/// Most states that undo keeps, and most parameters in all of them; but never fewer states than the last.
const UNDO_DEPTH: (usize, usize, usize) = (1000, 300_000, 20);

impl Scene {
    /// A scene of a model, with floaters on its surface.
    ///
    /// # Errors
    /// Settings that make no sense, a model without a surface or without an end where no bounds are given.
    pub fn new(model: &Model, settings: Settings) -> Result<Self, Error> {
        Self::with_floaters(model, settings, 0.0, &[], None)
    }

    /// The same with floaters at a spacing that was found before (0: to be found), of which some may be known, and in a box that
    /// may be known where none can be found.
    pub(crate) fn with_floaters(
        model: &Model,
        settings: Settings,
        spacing: f64,
        known: &[[f64; 3]],
        box_before: Option<Aabb>,
    ) -> Result<Self, Error> {
        settings.check()?;
        let field = Field::new(model)?;
        if field.components() != 1 {
            return Err(Error::option(
                "model",
                "a surface: one equation F = 0",
                format!("{} equations", field.components()),
            ));
        }
        let bounds = match (box_before, settings.bounds) {
            (Some(b), None) => b,
            _ => bounds_of(&field, &settings)?,
        };
        let start = Swarm::of(known, spacing);
        let Some(mut swarm) = start.settled(&field, &bounds, &settings)? else {
            return Err(Error::Vanished { what: "this model".into() });
        };
        if !known.is_empty() {
            swarm.orient(&field)?;
        }
        let (pins, spacing) = (Vec::new(), swarm.spacing);
        let state = State { field, pins, next_pin: 0, settings, rest: None, bounds, spacing, adapting: None };
        let now = Now { state, swarm, clock: 0, hold: None, metric: Metric::stale(), rested: true };
        let mut scene = Self {
            now,
            undo: Vec::new(),
            redo: Vec::new(),
            undone: Vec::new(),
            log: Vec::new(),
            functions: HashMap::new(),
        };
        scene.learn_functions(model);
        Ok(scene)
    }

    /// Remembers the functions of a model by name, so that texts can refer to them.
    pub fn learn_functions(&mut self, model: &Model) {
        self.functions.extend(model.functions().into_iter().map(|f| (f.name().to_string(), f)));
    }

    /// The field as it is now: model and parameters.
    pub fn field(&self) -> &Field {
        &self.now.state.field
    }

    /// The tree with the parameters' present values.
    pub fn model(&self) -> Result<Model, Error> {
        Ok(self.now.state.field.current_model()?)
    }

    /// The control points.
    pub fn pins(&self) -> &[ScenePin] {
        &self.now.state.pins
    }

    /// Steps taken.
    pub fn clock(&self) -> u64 {
        self.now.clock
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.now.state.settings
    }

    /// What has been done, in order.
    pub fn log(&self) -> &[Entry] {
        &self.log
    }

    /// What there is to draw.
    pub fn frame(&self) -> Frame<'_> {
        Frame {
            clock: self.now.clock,
            floaters: &self.now.swarm.floaters,
            spacing: self.now.swarm.spacing,
            pins: &self.now.state.pins,
            bounds: &self.now.state.bounds,
            size: self.now.swarm.size,
            births: self.now.swarm.births,
            deaths: self.now.swarm.deaths,
        }
    }

    /// Whether pins or parameters are still on their way: until then steps change the surface.
    pub fn is_moving(&self) -> bool {
        !self.now.rested
    }

    /// Whether something is being dragged.
    pub fn is_held(&self) -> bool {
        self.now.hold.is_some()
    }

    /// How many commands can be undone and redone.
    pub fn history(&self) -> (usize, usize) {
        (self.undo.len(), self.redo.len())
    }

    /// Carries a command out. On an error the scene is as it was.
    pub fn apply(&mut self, command: Command) -> Result<Change, Error> {
        self.apply_with(command, &mut |_, _| ControlFlow::Continue(()))
    }

    /// The same, with progress once a step.
    pub fn apply_with(&mut self, command: Command, progress: &mut ProgressFn<'_>) -> Result<Change, Error> {
        command.check()?;
        let before = self.now.clone();
        let past = self.undo.len();
        let mut entry = Entry { at: Some(self.now.clock), command: command.clone() };
        let mut stopped = None;
        let result = self.carry_out(command, &mut |scene, p| {
            let flow = progress(scene, p);
            if flow.is_break() {
                stopped = Some(p.steps);
            }
            flow
        });
        match &result {
            Ok(_) => {
                if let Some(steps) = stopped {
                    // So that the log gives the same again.
                    entry.command.shorten(steps);
                }
                self.note(entry);
                let (states, parameters, least) = UNDO_DEPTH;
                let depth = (parameters / self.field().parameters().len().max(1)).clamp(least, states);
                let beyond = self.undo.len().saturating_sub(depth);
                self.undo.drain(..beyond);
                self.undone.clear();
            }
            Err(_) => {
                self.now = before;
                self.undo.truncate(past);
                if !self.undone.is_empty() {
                    self.redo = std::mem::take(&mut self.undone);
                }
            }
        }
        result
    }

    /// Steps after steps are one entry of the log: a front-end takes them one by one.
    fn note(&mut self, entry: Entry) {
        let last = self.log.last_mut().map(|e| &mut e.command);
        match (last, &entry.command) {
            (Some(Command::Step { count: all }), Command::Step { count })
                if (*all + *count) as u64 <= crate::command::MOST_STEPS =>
            {
                *all += *count;
            }
            _ => self.log.push(entry),
        }
    }

    /// Lets time pass: `n` steps.
    pub fn step(&mut self, n: usize) -> Result<Change, Error> {
        self.apply(Command::Step { count: n })
    }

    /// A control point on the surface near `at`; its number.
    pub fn pin(&mut self, at: [f64; 3]) -> Result<u64, Error> {
        let pin = Command::Pin { at, name: None, weight: 1.0, softness: 0.0, along: None, grip: None };
        Ok(self.apply(pin)?.pin.expect("a pin was made"))
    }

    /// Drags pins until they arrive or nothing moves any more.
    pub fn drag(&mut self, hands: &[(u64, [f64; 3])]) -> Result<crate::DragReport, Error> {
        let hands = hands.iter().map(|&(id, to)| crate::Hand { pin: PinRef::Number(id), to }).collect();
        let command = Command::Drag { hands, radius: None, steps: crate::command::DRAG_STEPS };
        Ok(self.apply(command)?.drag.expect("a drag was made"))
    }

    /// Carries out the commands of a script or a log; those with a time wait for it. `progress` gets the number of the command,
    /// once a step; `Break` ends it all.
    ///
    /// # Errors
    /// What the command that fails reports; what came before it stays done.
    pub fn replay(
        &mut self,
        entries: &[Entry],
        progress: &mut dyn FnMut(&Scene, usize) -> ControlFlow<()>,
    ) -> Result<Vec<Change>, Error> {
        let mut changes = Vec::with_capacity(entries.len());
        for (k, entry) in entries.iter().enumerate() {
            let mut stopped = false;
            let mut tell = |scene: &Scene, _: &Progress| {
                let flow = progress(scene, k);
                stopped |= flow.is_break();
                flow
            };
            if let Some(at) = entry.at.filter(|&at| at > self.now.clock) {
                let count = usize::try_from(at - self.now.clock).unwrap_or(usize::MAX);
                self.apply_with(Command::Step { count }, &mut tell)?;
                if self.now.clock < at {
                    break;
                }
            }
            changes.push(self.apply_with(entry.command.clone(), &mut tell)?);
            if stopped || progress(self, k + 1).is_break() {
                break;
            }
        }
        Ok(changes)
    }

    /// Keeps the present state for undo.
    pub(crate) fn remember(&mut self) {
        self.undo.push(self.now.state.clone());
        if !self.redo.is_empty() {
            self.undone = std::mem::take(&mut self.redo);
        }
    }

    /// The number of a pin.
    pub(crate) fn find_pin(&self, pin: &PinRef) -> Result<usize, Error> {
        let pins = &self.now.state.pins;
        let found = match pin {
            PinRef::Number(id) => pins.iter().position(|p| p.id == *id),
            PinRef::Name(name) => pins.iter().position(|p| p.name.as_deref() == Some(name)),
        };
        found.ok_or_else(|| {
            let name =
                |p: &ScenePin| p.name.as_ref().map_or(p.id.to_string(), |n| format!("{} (`{n}`)", p.id));
            let known: Vec<String> = pins.iter().take(20).map(name).collect();
            let given = match pin {
                PinRef::Number(id) => id.to_string(),
                PinRef::Name(name) => format!("`{name}`"),
            };
            Error::NoPin { given, known: if known.is_empty() { "none".into() } else { known.join(", ") } }
        })
    }

    /// Brings the floaters onto the surface after a sudden change.
    pub(crate) fn resettle(&mut self, what: &str) -> Result<(), Error> {
        let state = &self.now.state;
        let bounds = match bounds_of(&state.field, &state.settings) {
            // An adapter bends a surface whose box is known: it stays near.
            Err(Error::Unbounded) if state.adapting.is_some() => state.bounds,
            found => found?,
        };
        self.resettle_in(bounds, what)
    }

    /// The same in a box that is known.
    pub(crate) fn resettle_in(&mut self, bounds: Aabb, what: &str) -> Result<(), Error> {
        let now = &mut self.now;
        now.state.bounds = bounds;
        let settled = now.swarm.settled(&now.state.field, &now.state.bounds, &now.state.settings)?;
        now.swarm = settled.ok_or_else(|| Error::Vanished { what: what.into() })?;
        now.state.spacing = now.swarm.spacing;
        (now.metric, now.rested) = (Metric::stale(), false);
        Ok(())
    }

    /// Distances between pins and the surface (model units), in the order of [`Scene::pins`].
    pub fn residuals(&self) -> Result<Vec<f64>, Error> {
        self.now.residuals()
    }
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scene")
            .field("clock", &self.now.clock)
            .field("parameters", &self.now.state.field.parameters().len())
            .field("pins", &self.now.state.pins.len())
            .field("floaters", &self.now.swarm.floaters.len())
            .finish()
    }
}
