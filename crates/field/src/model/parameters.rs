//! Parameters of a whole model: their order, their paths, and models with other values.

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use super::{Model, Param, Payload, check_param, guarded};
use crate::FieldError;

/// A parameter of a whole model.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamInfo {
    /// Where it is: the names of the named nodes above, the node's own (its name or its kind), the parameter's,
    /// joined by `/`. A free-standing parameter of a formula is its name alone. Unique: a second node with
    /// the same path gets `_2`.
    pub path: String,
    /// Present value.
    pub value: f64,
    /// Whether fits and pins leave it alone.
    pub frozen: bool,
    /// Smallest and largest value; infinite where there is no bound.
    pub bounds: (f64, f64),
    /// A typical change.
    pub scale: f64,
    /// Discrete parameters are whole numbers, outside q, and constants of the graph.
    pub discrete: bool,
    /// The unit: see [`super::ParamSpec::unit`].
    pub unit: &'static str,
}

impl ParamInfo {
    /// Whether it is part of q: neither frozen nor discrete.
    pub fn is_free(&self) -> bool {
        !self.frozen && !self.discrete
    }
}

/// Paths in use.
#[derive(Default)]
pub(super) struct Names {
    used: FxHashSet<String>,
    /// The last number given to a stem.
    numbers: FxHashMap<String, usize>,
}

impl Names {
    /// The stem, or with the next free of `_2`, `_3`, ….
    pub fn unique(&mut self, stem: String) -> String {
        let mut name = stem.clone();
        if self.used.contains(&stem) {
            let number = self.numbers.entry(stem.clone()).or_insert(1);
            while self.used.contains(&name) {
                *number += 1;
                name = format!("{stem}_{number}");
            }
        }
        self.used.insert(name.clone());
        name
    }
}

/// The number of each node's first parameter.
#[derive(Default)]
pub(crate) struct Places {
    first: FxHashMap<usize, usize>,
    params: Vec<ParamInfo>,
    /// The path of each node with parameters of its own.
    stems: FxHashMap<usize, String>,
}

/// The path of each node with parameters of its own, and the names in use.
pub(super) fn stems(model: &Model) -> (Names, FxHashMap<usize, String>) {
    let mut names = Names::default();
    let mut places = Places::default();
    places.visit(model, "", &mut names);
    (names, places.stems)
}

impl Places {
    /// Numbers all parameters: a node's own, then those of what hangs below, each node at its first visit.
    pub fn of(model: &Model) -> Self {
        let mut this = Self::default();
        this.visit(model, "", &mut Names::default());
        this
    }

    fn visit(&mut self, model: &Model, above: &str, names: &mut Names) {
        if self.first.contains_key(&model.id()) {
            return;
        }
        self.first.insert(model.id(), self.params.len());
        let own = model.name().unwrap_or(model.kind().name);
        let free_standing = model.kind().name == "parameter";
        if model.params().iter().any(|p| p.expr.is_none()) {
            let stem =
                if free_standing { model.params()[0].name.to_string() } else { format!("{above}{own}") };
            let unique = names.unique(stem);
            self.stems.insert(model.id(), unique.clone());
            for (i, p) in model.params().iter().enumerate().filter(|(_, p)| p.expr.is_none()) {
                let spec = model.kind().spec(i);
                self.params.push(ParamInfo {
                    path: if free_standing { unique.clone() } else { format!("{unique}/{}", p.name) },
                    value: p.value,
                    frozen: p.frozen,
                    bounds: p.bounds,
                    scale: p.scale,
                    discrete: spec.is_some_and(|s| s.discrete),
                    unit: spec.map_or("", |s| s.unit),
                });
            }
        }
        let inner = model.name().map(|n| format!("{above}{n}/"));
        let above = inner.as_deref().unwrap_or(above);
        for m in model.below() {
            guarded(|| self.visit(m, above, names));
        }
    }

    /// The number of the first parameter of a node.
    pub fn first(&self, model: &Model) -> usize {
        self.first[&model.id()]
    }

    /// All parameters in order.
    pub fn into_params(self) -> Vec<ParamInfo> {
        self.params
    }
}

/// Whether `path` fits `pattern`, in which `*` stands for any characters.
pub fn path_matches(pattern: &str, path: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or("");
    let Some(mut rest) = path.strip_prefix(first) else { return false };
    let mut parts: Vec<&str> = parts.collect();
    let Some(last) = parts.pop() else { return rest.is_empty() };
    for part in parts {
        match rest.find(part) {
            Some(i) => rest = &rest[i + part.len()..],
            None => return false,
        }
    }
    rest.ends_with(last)
}

impl Model {
    /// All parameters, free and frozen, in the order of HBJF02 section 3.
    pub fn parameters(&self) -> Vec<ParamInfo> {
        Places::of(self).into_params()
    }

    /// A model with another value of one parameter.
    pub fn with_value(&self, path: &str, value: f64) -> Result<Self, FieldError> {
        self.edit(path, |p| p.value = value)
    }

    /// A model with the parameters that fit `pattern` (a path in which `*` stands for anything) frozen or free.
    pub fn with_frozen(&self, pattern: &str, frozen: bool) -> Result<Self, FieldError> {
        self.edit(pattern, |p| p.frozen = frozen)
    }

    /// A model with other bounds of the parameters that fit `pattern`.
    pub fn with_bounds(&self, pattern: &str, lo: f64, hi: f64) -> Result<Self, FieldError> {
        self.edit(pattern, |p| p.bounds = (lo, hi))
    }

    /// A model with another scale of the parameters that fit `pattern`.
    pub fn with_scale(&self, pattern: &str, scale: f64) -> Result<Self, FieldError> {
        self.edit(pattern, |p| p.scale = scale)
    }

    /// A model with other values of all parameters, in their order.
    pub fn with_values(&self, values: &[f64]) -> Result<Self, FieldError> {
        let places = Places::of(self);
        if values.len() != places.params.len() {
            return Err(FieldError::Shape {
                what: "values",
                expected: format!("{} numbers, one for each parameter", places.params.len()),
                given: values.len().to_string(),
            });
        }
        self.rebuilt(&places, &mut |i, p| p.value = values[i])
    }

    /// A model whose parameters have the values, flags, bounds and scales of `params`, which are its own parameters
    /// in their order.
    pub fn with_parameters(&self, params: &[ParamInfo]) -> Result<Self, FieldError> {
        let places = Places::of(self);
        if places.params.len() != params.len() {
            return Err(FieldError::Shape {
                what: "parameters",
                expected: format!("{}, those of the model", places.params.len()),
                given: params.len().to_string(),
            });
        }
        self.rebuilt(&places, &mut |i, p| {
            let new = &params[i];
            (p.value, p.frozen, p.bounds, p.scale) = (new.value, new.frozen, new.bounds, new.scale);
        })
    }

    /// A model with the parameters that fit `pattern` changed. The rest is shared with `self`.
    pub fn edit(&self, pattern: &str, mut change: impl FnMut(&mut Param)) -> Result<Self, FieldError> {
        let places = Places::of(self);
        let hit: Vec<bool> = places.params.iter().map(|p| path_matches(pattern, &p.path)).collect();
        if !hit.contains(&true) {
            let known: Vec<&str> = places.params.iter().map(|p| p.path.as_str()).take(40).collect();
            let more = if places.params.len() > known.len() { ", …" } else { "" };
            return Err(FieldError::UnknownParameter {
                path: pattern.to_string(),
                known: if known.is_empty() { "none".to_string() } else { known.join(", ") + more },
            });
        }
        self.rebuilt(&places, &mut |i, p| {
            if hit[i] {
                change(p);
            }
        })
    }

    fn rebuilt(
        &self,
        places: &Places,
        change: &mut dyn FnMut(usize, &mut Param),
    ) -> Result<Self, FieldError> {
        fn visit(
            m: &Model,
            places: &Places,
            done: &mut FxHashMap<usize, Model>,
            change: &mut dyn FnMut(usize, &mut Param),
        ) -> Result<Model, FieldError> {
            if let Some(n) = done.get(&m.id()) {
                return Ok(n.clone());
            }
            let t = &*m.0;
            let mut number = places.first(m);
            let mut changed = false;
            let mut params = t.params.clone();
            for (i, p) in params.iter_mut().enumerate() {
                match &mut p.expr {
                    Some(e) => {
                        let n = guarded(|| visit(e, places, done, change))?;
                        changed |= !Arc::ptr_eq(&n.0, &e.0);
                        *e = n;
                    }
                    None => {
                        let before = (p.value, p.frozen, p.bounds, p.scale);
                        change(number, p);
                        number += 1;
                        if before != (p.value, p.frozen, p.bounds, p.scale) {
                            changed = true;
                            check_param(t.kind, t.kind.spec(i), p)?;
                        }
                    }
                }
            }
            let mut payload = t.payload.clone();
            if let Payload::Expression(h) = &mut payload {
                let n = guarded(|| visit(h, places, done, change))?;
                changed |= !Arc::ptr_eq(&n.0, &h.0);
                *h = n;
            }
            let mut operands = Vec::with_capacity(t.operands.len());
            for o in &t.operands {
                let n = guarded(|| visit(o, places, done, change))?;
                changed |= !Arc::ptr_eq(&n.0, &o.0);
                operands.push(n);
            }
            let n = if changed {
                Model::unchecked(t.kind, t.name.clone(), params, operands, payload)?
            } else {
                m.clone()
            };
            done.insert(m.id(), n.clone());
            Ok(n)
        }
        visit(self, places, &mut FxHashMap::default(), change)
    }
}
