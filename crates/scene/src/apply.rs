//! What each command does.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::model::path_matches;
use isoswarm_field::{Field, FieldError};
use isoswarm_particles::project;

use crate::adapting::Place;
use crate::command::check_place;
use crate::control::Metric;
use crate::editing::{or_root, wrap};
use crate::file::PinRecord;
use crate::hold::{Hold, Motion};
use crate::scene::{Progress, ProgressFn, Scene};
use crate::{
    Along, Command, DragReport, Ending, Entry, Error, FitReport, Hand, PinRef, Settings, TransferReport,
};

/// Steps after letting go.
const SETTLING: usize = 20;
/// A pin may be given at most this part of the model's size off the surface.
const FAR: f64 = 0.1;
/// A drag has arrived within this part of the model's size.
const REACHED: f64 = 1e-8;

/// What a command did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Change {
    /// The tree is another one.
    pub model: bool,
    /// Values or settings of parameters have changed.
    pub parameters: bool,
    /// The number of the pin that was made.
    pub pin: Option<u64>,
    /// The numbers of the pins that were taken away, for the surface is not where they are any more.
    pub lost: Vec<u64>,
    /// How a drag went.
    pub drag: Option<DragReport>,
    /// How a fit went.
    pub fit: Option<FitReport>,
    /// How well a part takes on the effect of its adapter, while one is on and when it is accepted.
    pub transfer: Option<TransferReport>,
}

impl Scene {
    pub(crate) fn carry_out(
        &mut self,
        command: Command,
        progress: &mut ProgressFn<'_>,
    ) -> Result<Change, Error> {
        match command {
            Command::Set { path, value, continued } => self.set(&path, value, continued),
            Command::Assign { values, pins } => self.assign(&values, &pins),
            Command::Freeze { pattern, frozen } => self.each(&pattern, |f, i| {
                f.set_frozen(i, frozen);
                Ok(())
            }),
            Command::Limit { pattern, bounds: [lo, hi] } => {
                let own = self.own_bounds();
                self.each(&pattern, |f, i| {
                    f.set_bounds(
                        i,
                        lo.unwrap_or(own[i].0).max(own[i].0),
                        hi.unwrap_or(own[i].1).min(own[i].1),
                    )
                })
            }
            Command::Scale { pattern, scale } => self.each(&pattern, |f, i| f.set_scale(i, scale)),
            Command::Pin { at, name, weight, softness, along, grip } => {
                self.make_pin(at, name, weight, softness, along, grip)
            }
            Command::Unpin { pin } => {
                let i = self.find_pin(&pin)?;
                self.idle("remove a pin")?;
                self.remember();
                self.now.state.pins.remove(i);
                Ok(Change::default())
            }
            Command::Grab { hands, radius } => self.grab(&hands, radius).map(|()| Change::default()),
            Command::Release {} => {
                if self.now.hold.is_none() {
                    return Err(Error::Nothing("nothing is held: grab a pin first".into()));
                }
                let drag = Some(self.release(Ending::Released)?);
                Ok(Change { parameters: true, drag, ..Change::default() })
            }
            Command::Drag { hands, radius, steps } => {
                self.idle("start a drag")?;
                self.grab(&hands, radius)?;
                self.drag_to_its_end(steps, progress)
            }
            Command::Turn { pins, centre, rotation, translation, steps } => {
                self.idle("start a turn")?;
                self.take_handle(&pins, centre, rotation, translation)?;
                self.drag_to_its_end(steps, progress)
            }
            Command::Step { count } => {
                for k in 0..count {
                    self.now.step()?;
                    let done = Progress { steps: k + 1, most: count, remaining: 0.0 };
                    if progress(self, &done).is_break() {
                        break;
                    }
                }
                Ok(Change { parameters: true, ..Change::default() })
            }
            Command::Fit { points, weights, loss, iterations } => {
                self.idle("fit")?;
                self.no_adapter("fit")?;
                self.fit_points(&points, &weights, loss, iterations, progress)
            }
            Command::Rest {} => {
                self.no_adapter("take a rest shape")?;
                self.remember();
                let values = self.field().parameters().iter().map(|p| p.value).collect();
                self.now.state.rest = Some(values);
                Ok(Change::default())
            }
            Command::Settings { settings } => self.change_settings(settings),
            Command::Add { path, model, name } => {
                let mut part = self.read_part(&model)?;
                if let Some(name) = name {
                    part = part.named(&name)?;
                }
                self.edit("adding this part", &|m| m.with_added(&or_root(m, &path), &part))
            }
            Command::Replace { path, model } => {
                let part = self.read_part(&model)?;
                self.edit("this replacement", &|m| m.with_node(&or_root(m, &path), &part))
            }
            Command::Remove { path } => self.edit("removing this part", &|m| m.without_node(&path)),
            Command::Hide { path, hidden } => self
                .edit(if hidden { "hiding this part" } else { "showing this part" }, &|m| {
                    m.with_hidden(&path, hidden)
                }),
            Command::Wrap { path, kind, parameters, name } => self.edit("this operator", &|m| {
                m.with_wrapped(&or_root(m, &path), |inner| wrap(inner, &kind, &parameters, name.as_deref()))
            }),
            Command::Unwrap { path } => self.edit("taking off this operator", &|m| m.without_operator(&path)),
            Command::Reorder { path, order } => {
                self.edit("this order", &|m| m.with_order(&or_root(m, &path), &order))
            }
            Command::Adapt { path, adapter, center, axis, half, controls } => {
                self.idle("put an adapter on")?;
                let path = or_root(&self.model()?, &path);
                self.adapt(&path, &Place { adapter, center, axis, half, controls })
            }
            Command::Accept {} => {
                self.idle("take the adapter off")?;
                self.accept()
            }
            Command::Keep {} => {
                self.idle("keep the adapter")?;
                self.keep_adapter()
            }
            Command::Cancel {} => {
                self.idle("take the adapter off")?;
                self.cancel_adapter()
            }
            Command::Flatten { path } => {
                self.idle("flatten")?;
                self.flatten(&path)
            }
            Command::Rename { path, name } => self.edit("this name", &|m| {
                let path = or_root(m, &path);
                let part = m.node(&path)?;
                m.with_node(&path, &if name.is_empty() { part.unnamed()? } else { part.named(&name)? })
            }),
            Command::Duplicate { path, name } => {
                self.edit("this copy", &|m| m.with_copy(&or_root(m, &path), name.as_deref()))
            }
            Command::Together { commands } => self.together(commands, progress),
            Command::Undo {} => self.turn_back(true),
            Command::Redo {} => self.turn_back(false),
        }
    }

    /// Several commands as one: undone together, and none is done if one fails.
    fn together(&mut self, commands: Vec<Command>, progress: &mut ProgressFn<'_>) -> Result<Change, Error> {
        let past = self.undo.len();
        let mut all = Change::default();
        for command in commands {
            if matches!(command, Command::Undo {} | Command::Redo {} | Command::Together { .. }) {
                return Err(Error::option(
                    "together",
                    "commands other than undo, redo and together",
                    "one of them",
                ));
            }
            command.check()?;
            let mut stopped = false;
            let change = self.carry_out(command, &mut |scene, p| {
                let flow = progress(scene, p);
                stopped |= flow.is_break();
                flow
            })?;
            if stopped {
                return Err(Error::Nothing(
                    "the commands were stopped, and none of them was carried out".into(),
                ));
            }
            all.model |= change.model;
            all.parameters |= change.parameters;
            all.pin = change.pin.or(all.pin);
            all.lost.extend(change.lost);
            all.drag = change.drag.or(all.drag);
            all.fit = change.fit.or(all.fit);
            all.transfer = change.transfer.or(all.transfer);
        }
        // What was before the first of them is what undo goes back to.
        self.undo.truncate(past + 1);
        Ok(all)
    }

    /// Refuses what cannot be done while something is dragged.
    pub(crate) fn idle(&self, what: &str) -> Result<(), Error> {
        match self.now.hold {
            None => Ok(()),
            Some(_) => Err(Error::Nothing(format!("cannot {what} while pins are held: release them first"))),
        }
    }

    /// Refuses what cannot be done while an adapter is on.
    pub(crate) fn no_adapter(&self, what: &str) -> Result<(), Error> {
        match self.now.state.adapting {
            None => Ok(()),
            Some(_) => Err(Error::Nothing(format!(
                "cannot {what} while an adapter is on: accept, keep or cancel it first"
            ))),
        }
    }

    fn set(&mut self, path: &str, value: f64, continued: bool) -> Result<Change, Error> {
        let i = self.field().parameter(path)?;
        self.mine(vec![i], path)?;
        if self.field().parameters()[i].discrete {
            return self.edit("this value", &|m| m.with_value(path, value));
        }
        let same = |e: &Entry| matches!(&e.command, Command::Set { path: last, .. } if last == path);
        let mut before = self.log.iter().rev().skip_while(|e| matches!(e.command, Command::Step { .. }));
        if !(continued && before.next().is_some_and(same)) {
            self.remember();
        }
        self.now.state.field.set_value(i, value)?;
        self.now.hand_over()?;
        self.resettle(&format!("`{path}` = {value}"))?;
        Ok(Change { parameters: true, transfer: self.adapting().cloned(), ..Change::default() })
    }

    fn assign(
        &mut self,
        values: &std::collections::BTreeMap<String, f64>,
        pins: &[Hand],
    ) -> Result<Change, Error> {
        self.idle("take values over")?;
        let mut places = Vec::with_capacity(pins.len());
        for h in pins {
            check_place("pins", h.to, self.field().axes())?;
            places.push((self.find_pin(&h.pin)?, h.to));
        }
        self.remember();
        for (path, value) in values {
            let i = self.field().parameter(path)?;
            self.mine(vec![i], path)?;
            if self.field().parameters()[i].discrete {
                return Err(Error::option("values", "no discrete parameters: `set` them", path));
            }
            self.now.state.field.set_value(i, *value)?;
        }
        for (k, to) in places {
            self.now.state.pins[k].pin.at = to;
        }
        self.now.hand_over()?;
        self.resettle("these values")?;
        Ok(Change { parameters: true, transfer: self.adapting().cloned(), ..Change::default() })
    }

    /// Changes the settings of all parameters that fit a pattern.
    fn each(
        &mut self,
        pattern: &str,
        change: impl Fn(&mut Field, usize) -> Result<(), FieldError>,
    ) -> Result<Change, Error> {
        let params = self.field().parameters();
        let fits: Vec<usize> =
            (0..params.len()).filter(|&i| path_matches(pattern, &params[i].path)).collect();
        if fits.is_empty() {
            // Says which there are.
            self.field().parameter(pattern)?;
        }
        let fits = self.mine(fits, pattern)?;
        self.remember();
        for i in fits {
            change(&mut self.now.state.field, i)?;
        }
        (self.now.metric, self.now.rested) = (Metric::stale(), false);
        Ok(Change { parameters: true, ..Change::default() })
    }

    fn make_pin(
        &mut self,
        at: [f64; 3],
        name: Option<String>,
        weight: f64,
        softness: f64,
        along: Option<Along>,
        grip: Option<f64>,
    ) -> Result<Change, Error> {
        let record = PinRecord { id: self.now.state.next_pin, at, name, weight, softness, along, grip };
        let mut pin = record.pin(self.field().axes())?;
        if pin.name.is_some() && self.now.state.pins.iter().any(|p| p.name == pin.name) {
            let name = pin.name.unwrap_or_default();
            return Err(Error::option("name", "a name that no other pin has", format!("`{name}`")));
        }
        let size = self.now.swarm.size;
        let mut place = [at];
        let left = project(self.field(), &mut place, size)?[0];
        let moved = (0..3).map(|a| (place[0][a] - at[a]).powi(2)).sum::<f64>().sqrt();
        let distance = if left <= 1e-9 * size { moved } else { f64::INFINITY };
        let limit = FAR * size;
        if distance > limit {
            return Err(Error::FarPin { at, distance, limit });
        }
        self.remember();
        let id = pin.id;
        self.now.state.next_pin += 1;
        pin.pin.at = place[0];
        pin.lay_patch(&self.now)?;
        self.now.state.pins.push(pin);
        (self.now.rested, self.now.metric) = (false, Metric::stale());
        Ok(Change { pin: Some(id), ..Change::default() })
    }

    fn targets(&self, hands: &[Hand]) -> Result<Vec<(u64, [f64; 3])>, Error> {
        let axes = self.field().axes();
        let target = |h: &Hand| {
            check_place("to", h.to, axes)?;
            Ok((self.now.state.pins[self.find_pin(&h.pin)?].id, h.to))
        };
        let targets: Vec<(u64, [f64; 3])> = hands.iter().map(target).collect::<Result<_, Error>>()?;
        self.each_once(targets.iter().map(|t| t.0))?;
        Ok(targets)
    }

    /// Refuses a list of pins that is empty or has one twice.
    fn each_once(&self, ids: impl Iterator<Item = u64>) -> Result<(), Error> {
        let mut ids: Vec<u64> = ids.collect();
        ids.arrange();
        if ids.is_empty() {
            return Err(Error::option("hands", "at least one pin and where it goes", "none"));
        }
        match ids.windows(2).find(|w| w[0] == w[1]) {
            Some(w) => Err(Error::option("hands", "each pin once", format!("pin {} twice", w[0]))),
            None => Ok(()),
        }
    }

    fn grab(&mut self, hands: &[Hand], radius: Option<f64>) -> Result<(), Error> {
        let targets = self.targets(hands)?;
        if let Some(r) = radius.filter(|r| !(r.is_finite() && *r > 0.0)) {
            return Err(Error::option("radius", "a length above 0", r));
        }
        if let Some(hold) = &mut self.now.hold {
            hold.aim(targets);
            return Ok(());
        }
        self.remember();
        let mut hold = Hold::new(targets);
        if let Some(r) = radius {
            hold.take_along(&self.now.state.pins, &self.now.swarm.floaters.points, r);
        }
        self.now.hold = Some(hold);
        (self.now.metric, self.now.rested) = (Metric::stale(), false);
        Ok(())
    }

    fn take_handle(
        &mut self,
        pins: &[PinRef],
        centre: [f64; 3],
        rotation: [f64; 3],
        translation: [f64; 3],
    ) -> Result<(), Error> {
        let axes = self.field().axes();
        check_place("centre", centre, axes)?;
        check_place("translation", translation, axes)?;
        check_place("rotation", rotation, 3)?;
        if axes == 2 && (rotation[0] != 0.0 || rotation[1] != 0.0) {
            return Err(Error::option("rotation", "a turn about z in the plane", format!("{rotation:?}")));
        }
        let mut from = Vec::with_capacity(pins.len());
        for p in pins {
            let pin = &self.now.state.pins[self.find_pin(p)?];
            from.push((pin.id, pin.pin.at));
        }
        self.each_once(from.iter().map(|f| f.0))?;
        self.remember();
        self.now.hold = Some(Hold::turning(Motion::new(centre, rotation, translation, from)));
        (self.now.metric, self.now.rested) = (Metric::stale(), false);
        Ok(())
    }

    fn drag_to_its_end(&mut self, most: usize, progress: &mut ProgressFn<'_>) -> Result<Change, Error> {
        let mut ending = Ending::StepLimit;
        for k in 0..most {
            self.now.step()?;
            let longest = self.now.state.settings.speed * self.now.swarm.size;
            let reach = REACHED * self.now.swarm.size;
            let Standing { remaining, stalled } = self.drag_state(longest);
            if remaining <= reach {
                ending = Ending::Reached;
                break;
            }
            if stalled {
                ending = Ending::Stuck;
                break;
            }
            if progress(self, &Progress { steps: k + 1, most, remaining }).is_break() {
                ending = Ending::Cancelled;
                break;
            }
        }
        let drag = Some(self.release(ending)?);
        Ok(Change { parameters: true, drag, transfer: self.adapting().cloned(), ..Change::default() })
    }

    fn drag_state(&mut self, longest: f64) -> Standing {
        let pins = &self.now.state.pins;
        let Some(hold) = &mut self.now.hold else { return Standing { remaining: 0.0, stalled: false } };
        let remaining = hold.remaining(pins);
        Standing { remaining, stalled: hold.is_stalled(pins, longest) }
    }

    /// Lets go, and settles.
    fn release(&mut self, ending: Ending) -> Result<DragReport, Error> {
        let hold = self.now.hold.take().unwrap_or_default();
        let distance = hold.remaining(&self.now.state.pins);
        if hold.steps > 0 {
            self.now.look_around()?;
        }
        for _ in 0..SETTLING {
            self.now.step()?;
        }
        let patches: Vec<usize> =
            (0..self.now.state.pins.len()).filter(|&i| self.now.state.pins[i].grip.is_some()).collect();
        for i in patches {
            let mut pin = self.now.state.pins[i].clone();
            pin.lay_patch(&self.now)?;
            self.now.state.pins[i] = pin;
        }
        self.drag_report(&hold, ending, Some(distance))
    }

    /// How the drag under way goes; `None` where nothing is held.
    pub fn dragging(&self) -> Result<Option<DragReport>, Error> {
        self.now.hold.as_ref().map(|h| self.drag_report(h, Ending::Held, None)).transpose()
    }

    /// `distance`: what remained when it was let go, if it was.
    fn drag_report(&self, hold: &Hold, ending: Ending, distance: Option<f64>) -> Result<DragReport, Error> {
        let distance = distance.unwrap_or_else(|| hold.remaining(&self.now.state.pins));
        let residual = self.residuals()?.into_iter().fold(0.0, f64::max);
        let paths = self.field().parameters().iter().filter(|p| p.is_free()).map(|p| p.path.clone());
        let paths: Vec<String> = paths.collect();
        Ok(DragReport {
            reached: ending == Ending::Reached || distance <= REACHED * self.now.swarm.size,
            ending,
            distance,
            rank: hold.last.rank,
            pins: self.now.state.pins.len(),
            residual,
            slip: hold.slip(),
            steps: hold.steps,
            at_limit: hold.last.at_limit.iter().filter_map(|&i| paths.get(i).cloned()).collect(),
        })
    }

    fn change_settings(&mut self, settings: Settings) -> Result<Change, Error> {
        settings.check()?;
        self.idle("change the settings")?;
        self.remember();
        let resample = settings.amount != self.now.state.settings.amount;
        if resample {
            self.now.swarm.spacing = 0.0;
        }
        let resettle = resample || settings.bounds != self.now.state.settings.bounds;
        self.now.state.settings = settings;
        if resettle {
            self.resettle("these settings")?;
        }
        Ok(Change::default())
    }

    fn turn_back(&mut self, undo: bool) -> Result<Change, Error> {
        if self.now.hold.is_some() {
            self.release(Ending::Released)?;
        }
        let from = if undo { &self.undo } else { &self.redo };
        let Some(state) = from.last().cloned() else {
            let what = if undo {
                "there is nothing to undo: this is where the scene began"
            } else {
                "there is nothing to redo"
            };
            return Err(Error::Nothing(what.into()));
        };
        let bounds = state.bounds;
        self.now.swarm.spacing = state.spacing;
        let was = std::mem::replace(&mut self.now.state, state);
        if self.now.state.has_surface_of(&was) {
            (self.now.metric, self.now.rested) = (Metric::stale(), false);
        } else {
            self.resettle_in(bounds, "going back")?;
        }
        let (from, to) =
            if undo { (&mut self.undo, &mut self.redo) } else { (&mut self.redo, &mut self.undo) };
        from.pop();
        to.push(was);
        Ok(Change { model: true, parameters: true, ..Change::default() })
    }
}

/// How far a drag is.
struct Standing {
    remaining: f64,
    stalled: bool,
}
