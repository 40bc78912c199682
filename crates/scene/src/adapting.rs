//! Adapters: deformations that are dragged and whose effect goes into the parameters of what they are wrapped around (HBJF02
//! section 5).

use isoswarm_field::model::adapters::{Adapter, inverse, wrap};
use isoswarm_field::{Aabb, Field, FieldError, Model};
use isoswarm_particles::control::{FieldPoints, Transfer, TransferOptions, carry, transfer, transfer_from};

use crate::control::Metric;
use crate::scene::{Now, Scene};
use crate::{Change, Error, TransferReport};

/// Field points for each parameter of the operand, and the fewest.
const POINTS: usize = 4;
const FEWEST: usize = 24;
/// How far beside the surface field points lie, as a part of the operand's size.
const BAND: f64 = 0.1;
/// Linear steps when an effect is handed over for good.
const THOROUGH: usize = 40;
/// An operator is flattened if its operand can do without it up to this part of the size.
const FLAT: f64 = 1e-6;

/// The name of an adapter's node while it is on.
const NAME: &str = "adapter";

/// An adapter that is on.
#[derive(Clone, Debug)]
pub(crate) struct Adapting {
    /// The part that is adapted, in the model without the adapter.
    pub(crate) path: String,
    /// The adapter, in the model with it.
    pub(crate) adapter: String,
    /// The model without the adapter.
    pub(crate) original: Model,
    /// The part alone, with parameters that follow.
    pub(crate) operand: Field,
    /// D⁻¹, coordinate by coordinate.
    pub(crate) inverse: [Field; 3],
    /// Field points, and where they have been carried.
    pub(crate) field: FieldPoints,
    pub(crate) moved: Vec<[f64; 3]>,
    /// Numbers of the adapter's own parameters in the whole model.
    pub(crate) own: Vec<usize>,
    pub(crate) report: TransferReport,
}

impl Adapting {
    fn new(scene: &Scene, path: &str, place: &Place) -> Result<(Self, Field), Error> {
        let original = scene.model()?;
        let part = original.node(path)?;
        let operand = Field::new(&part)?;
        let freedom = operand.free().len();
        if freedom == 0 {
            return Err(Error::Nothing(format!(
                "`{path}` has no free parameter that could take on a deformation: release some, or wrap it in an operator"
            )));
        }
        let bounds = operand.bounds().unwrap_or(scene.now.state.bounds);
        let mut adapter = Adapter::around(&place.adapter, &bounds)?;
        adapter.center = place.center.unwrap_or(adapter.center);
        adapter.axis = place.axis.unwrap_or(adapter.axis);
        adapter.half = place.half.unwrap_or(adapter.half);
        adapter.controls = place.controls.unwrap_or(adapter.controls);
        let node = wrap(&adapter, &part, NAME)?;
        let [x, y, z] = inverse(&node)?;
        let whole = original.with_node(path, &node)?;
        let mut field = Field::new(&whole)?;
        // Only the adapter's own parameters are in q; they are those of its node, which has the place of the part.
        let at = original.nodes().iter().position(|n| n.path == path).unwrap_or(0);
        let adapter_path = whole.nodes()[at].path.clone();
        let own_paths: Vec<String> = node
            .params()
            .iter()
            .filter(|p| !p.frozen)
            .map(|p| format!("{adapter_path}/{}", p.name))
            .collect();
        let mut own = Vec::new();
        for i in 0..field.parameters().len() {
            let p = &field.parameters()[i];
            let mine = own_paths.contains(&p.path) && !p.discrete;
            if mine {
                own.push(i);
            }
            field.set_frozen(i, !mine);
        }
        let count = (POINTS * freedom).max(FEWEST);
        let points = FieldPoints::sprinkle(
            &operand,
            &grown(&bounds),
            count,
            BAND * bounds.diagonal(),
            scene.settings().seed,
        )?;
        let moved = points.points.clone();
        let inverse = [Field::new(&x)?, Field::new(&y)?, Field::new(&z)?];
        let report = TransferReport { freedom, rank: 0, ..TransferReport::default() };
        let (path, adapter) = (path.to_string(), adapter_path);
        let this = Self { path, adapter, original, operand, inverse, field: points, moved, own, report };
        Ok((this, field))
    }

    /// The model without the adapter.
    pub(crate) fn original(&self) -> &Model {
        &self.original
    }

    /// The operand's parameters follow the adapter's.
    fn follow(&mut self, whole: &Field, steps: usize) -> Result<(), Error> {
        // The node of D⁻¹ has the same free parameters in the same order.
        let values: Vec<f64> = self.own.iter().map(|&i| whole.parameters()[i].value).collect();
        for coordinate in &mut self.inverse {
            coordinate.set_q(&values)?;
        }
        let [x, y, z] = &self.inverse;
        self.moved = carry([x, y, z], &self.field.points, &self.moved)?;
        let options = TransferOptions { steps, ..TransferOptions::default() };
        let done = transfer(&mut self.operand, &self.field, &self.moved, options)?;
        self.report = report(&done, &self.operand);
        Ok(())
    }
}

/// Where an adapter acts; what is not given is found from the part that it is wrapped around.
#[derive(Clone, Debug, Default)]
pub(crate) struct Place {
    pub(crate) adapter: String,
    pub(crate) center: Option<[f64; 3]>,
    pub(crate) axis: Option<usize>,
    pub(crate) half: Option<[f64; 3]>,
    pub(crate) controls: Option<[usize; 3]>,
}

fn grown(bounds: &Aabb) -> Aabb {
    bounds.grown(0.05 * bounds.diagonal())
}

fn report(t: &Transfer, operand: &Field) -> TransferReport {
    let free = operand.free();
    TransferReport {
        rms: t.rms,
        largest: t.largest,
        relative: t.relative,
        rank: t.rank,
        freedom: t.freedom,
        at_limit: t.at_limit.iter().map(|&k| operand.parameters()[free[k]].path.clone()).collect(),
    }
}

impl Now {
    /// After the adapter has been moved.
    pub(crate) fn hand_over(&mut self) -> Result<(), Error> {
        match &mut self.state.adapting {
            Some(a) => a.follow(&self.state.field, TransferOptions::default().steps),
            None => Ok(()),
        }
    }
}

impl Scene {
    /// How well the part under the adapter follows it, while one is on.
    pub fn adapting(&self) -> Option<&TransferReport> {
        self.now.state.adapting.as_ref().map(|a| &a.report)
    }

    /// The adapter's path and how well the part under it follows, while one is on.
    pub fn adapter(&self) -> Option<(&str, &TransferReport)> {
        self.now.state.adapting.as_ref().map(|a| (a.adapter.as_str(), &a.report))
    }

    /// The path of the part under the adapter, in the model without it, while one is on.
    pub fn adapted_path(&self) -> Option<&str> {
        self.now.state.adapting.as_ref().map(|a| a.path.as_str())
    }

    /// The part under the adapter with its parameters as they follow it, while one is on.
    pub fn adapted(&self) -> Option<&Field> {
        self.now.state.adapting.as_ref().map(|a| &a.operand)
    }

    pub(crate) fn adapt(&mut self, path: &str, place: &Place) -> Result<Change, Error> {
        if self.now.state.adapting.is_some() {
            return Err(Error::Nothing("an adapter is on: accept, keep or cancel it first".into()));
        }
        let (adapting, field) = Adapting::new(self, path, place)?;
        self.remember();
        self.now.state.field = field;
        let transfer = Some(adapting.report.clone());
        self.now.state.adapting = Some(adapting);
        (self.now.metric, self.now.rested) = (Metric::stale(), false);
        Ok(Change { model: true, parameters: true, transfer, ..Change::default() })
    }

    fn take_adapter(&self) -> Result<Adapting, Error> {
        let none = || Error::Nothing("no adapter is on: put one on with `adapt`".into());
        self.now.state.adapting.clone().ok_or_else(none)
    }

    /// The part keeps what it has taken on; the adapter goes.
    pub(crate) fn accept(&mut self) -> Result<Change, Error> {
        let mut a = self.take_adapter()?;
        a.follow(self.field(), THOROUGH)?;
        let model = a.original.with_node(&a.path, &a.operand.current_model()?)?;
        self.finish_adapter(&model, "what the part could take on")?;
        let transfer = Some(a.report);
        Ok(Change { model: true, parameters: true, transfer, ..Change::default() })
    }

    /// The adapter becomes an operator of the model.
    pub(crate) fn keep_adapter(&mut self) -> Result<Change, Error> {
        let a = self.take_adapter()?;
        let (model, rest) = self.kept(&a)?;
        let field = Field::new(&model)?;
        self.remember();
        let state = &mut self.now.state;
        // Where no end is found of what it has become, the box that has served so far stays, for everybody to see.
        if state.settings.bounds.is_none() && field.bounds().is_none() {
            state.settings.bounds = Some([state.bounds.lo, state.bounds.hi]);
        }
        (state.field, state.adapting) = (field, None);
        self.resettle("the operator")?;
        self.now.state.rest = rest;
        Ok(Change { model: true, parameters: true, ..Change::default() })
    }

    /// The operand as it was, under the adapter as it is now; and the rest shape.
    fn kept(&self, a: &Adapting) -> Result<(Model, Option<Vec<f64>>), Error> {
        let node = self.model()?.node(&a.adapter)?;
        let keep = |m: &Model| m.with_wrapped(&a.path, |part| node.with_operands(vec![part.clone()]));
        Ok((keep(&a.original)?, self.carried_rest(&a.original, &keep)?))
    }

    /// The rest shape's values after a change of the tree `before`.
    pub(crate) fn carried_rest(
        &self,
        before: &Model,
        change: &dyn Fn(&Model) -> Result<Model, FieldError>,
    ) -> Result<Option<Vec<f64>>, Error> {
        let Some(rest) = &self.now.state.rest else { return Ok(None) };
        let mut params = before.parameters();
        for (p, value) in params.iter_mut().zip(rest).filter(|(p, _)| !p.discrete) {
            p.value = *value;
        }
        let at_rest = change(&before.with_parameters(&params)?)?;
        Ok(Some(at_rest.parameters().iter().map(|p| p.value).collect()))
    }

    /// Those of the parameters that may be changed now: while an adapter is on only its own, the others follow or come back.
    pub(crate) fn mine(&self, mut which: Vec<usize>, pattern: &str) -> Result<Vec<usize>, Error> {
        let Some(a) = &self.now.state.adapting else { return Ok(which) };
        which.retain(|i| a.own.contains(i));
        if which.is_empty() {
            return Err(Error::Nothing(format!(
                "`{pattern}` cannot be changed while an adapter is on, only the adapter's own parameters `{}/*`: \
                 accept, keep or cancel it first",
                a.adapter
            )));
        }
        Ok(which)
    }

    /// The bounds that the kinds of the nodes ask for, for each parameter.
    pub(crate) fn own_bounds(&self) -> Vec<(f64, f64)> {
        let mut known = std::collections::HashMap::new();
        for n in self.field().model().nodes() {
            let m = n.model();
            for (i, p) in m.params().iter().enumerate() {
                if let Some(spec) = m.kind().spec(i) {
                    known.insert(format!("{}/{}", n.path, p.name), spec.bounds);
                }
            }
        }
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        self.field().parameters().iter().map(|p| known.get(&p.path).copied().unwrap_or(free)).collect()
    }

    /// The model as it was before the adapter.
    pub(crate) fn cancel_adapter(&mut self) -> Result<Change, Error> {
        let a = self.take_adapter()?;
        self.finish_adapter(&a.original, "going back")?;
        Ok(Change { model: true, parameters: true, ..Change::default() })
    }

    fn finish_adapter(&mut self, model: &Model, what: &str) -> Result<(), Error> {
        let field = Field::new(model)?;
        self.remember();
        self.now.state.field = field;
        self.now.state.adapting = None;
        self.resettle(what)
    }

    /// Takes an operator on one operand off by giving its effect to the operand's parameters.
    pub(crate) fn flatten(&mut self, path: &str) -> Result<Change, Error> {
        if self.now.state.adapting.is_some() {
            return Err(Error::Nothing("an adapter is on: accept, keep or cancel it first".into()));
        }
        let whole = self.model()?;
        let node = whole.node(path)?;
        let [part] = node.operands() else {
            return Err(Error::Nothing(format!(
                "`{path}` has no single operand that could take its effect on"
            )));
        };
        let target = Field::new(&node)?;
        let mut operand = Field::new(part)?;
        let freedom = operand.free().len();
        let bounds = target.bounds().unwrap_or(self.now.state.bounds);
        let count = (POINTS * freedom).max(FEWEST);
        let seed = self.settings().seed;
        let points = FieldPoints::sprinkle(&target, &grown(&bounds), count, BAND * bounds.diagonal(), seed)?;
        let options = TransferOptions { steps: THOROUGH, ..TransferOptions::default() };
        let done = transfer_from(&mut operand, &target, &points.points, points.on, options)?;
        let transfer = report(&done, &operand);
        if transfer.relative.is_nan() || transfer.relative > FLAT {
            return Err(Error::Nothing(format!(
                "`{path}` stays: the parameters of its operand can take on its effect only to {:.2e} of the size \
                 (rank {} of {})",
                transfer.relative, transfer.rank, transfer.freedom
            )));
        }
        let model = whole.with_node(path, &operand.current_model()?)?;
        let field = Field::new(&model)?;
        let rest = self.carried_rest(&whole, &|m| m.with_node(path, &operand.current_model()?))?;
        self.remember();
        (self.now.state.field, self.now.state.rest) = (field, rest);
        self.resettle("flattening")?;
        Ok(Change { model: true, parameters: true, transfer: Some(transfer), ..Change::default() })
    }
}
