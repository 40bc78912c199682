//! The tree that people edit: immutable nodes with a kind, a name, parameters and operands. Text, Python, files
//! and menus make trees; [`Model::lower`] turns a tree into an expression graph.

pub mod adapters;
mod arguments;
mod edit;
mod kind;
pub mod kinds;
mod leaf;
mod lower;
mod parameters;

use std::sync::Arc;

pub use arguments::Value;
pub use edit::NodeInfo;
pub use kind::{Category, Kind, Layout, Operands, ParamSpec, PayloadKind};
pub use kinds::{kind, kinds, kinds_json};
pub use leaf::{Callback, Leaf};
pub(crate) use lower::Call;
pub use lower::{Lower, Lowered, MAX_GRAPH};
pub use parameters::{ParamInfo, path_matches};

use crate::FieldError;
pub use crate::graph::MAX_AXES;
use crate::vm::Program;

/// Largest depth of a tree.
pub const MAX_DEPTH: usize = 10_000;

/// A parameter of a node.
#[derive(Clone, Debug)]
pub struct Param {
    /// Name within its node.
    pub name: Arc<str>,
    /// Present value; unused where `expr` is given.
    pub value: f64,
    /// Whether fits and pins leave it alone.
    pub frozen: bool,
    /// Smallest and largest value; infinite where there is no bound.
    pub bounds: (f64, f64),
    /// A typical change: steps in q are measured against it. Above 0.
    pub scale: f64,
    /// An expression that gives the value instead, evaluated where the node is.
    pub expr: Option<Model>,
}

impl Param {
    /// A free, unbounded parameter.
    pub fn new(name: impl Into<Arc<str>>, value: f64) -> Self {
        let bounds = (f64::NEG_INFINITY, f64::INFINITY);
        Self { name: name.into(), value, frozen: false, bounds, scale: 1.0, expr: None }
    }

    /// As the table specifies it, at its default value.
    pub fn from_spec(spec: &ParamSpec) -> Self {
        Self { frozen: spec.frozen, bounds: spec.bounds, ..Self::new(spec.name, spec.default) }
    }
}

/// What a node carries besides parameters and operands.
#[derive(Clone)]
pub enum Payload {
    /// Nothing.
    None,
    /// The value of a constant.
    Number(f64),
    /// The exponents of x, y and z of each monomial of a polynomial.
    Exponents(Arc<[[u8; 3]]>),
    /// h(f, g) of a user-defined blend: a formula whose x and y are f and g. Its parameters count as the node's
    /// own.
    Expression(Model),
    /// A straight-line program.
    Program(Arc<Program>),
    /// A function of the caller's.
    Callback(Arc<dyn Callback>),
}

impl Payload {
    fn kind(&self) -> PayloadKind {
        match self {
            Payload::None => PayloadKind::None,
            Payload::Number(_) => PayloadKind::Number,
            Payload::Exponents(_) => PayloadKind::Exponents,
            Payload::Expression(_) => PayloadKind::Expression,
            Payload::Program(_) => PayloadKind::Program,
            Payload::Callback(_) => PayloadKind::Callback,
        }
    }
}

/// A node of the tree; see [`Model`].
pub struct Tree {
    kind: &'static Kind,
    name: Option<Arc<str>>,
    params: Vec<Param>,
    operands: Vec<Model>,
    payload: Payload,
    depth: usize,
    /// Whether nothing of it counts.
    hidden: bool,
}

/// An immutable model: a node with all that hangs below it. Cloning is cheap and shares; a node that occurs
/// twice has its parameters once.
#[derive(Clone)]
pub struct Model(Arc<Tree>);

impl Model {
    /// A node. `Invalid` where the counts, values or payload are not what the kind needs, `TooLarge` where the
    /// tree would be deeper than [`MAX_DEPTH`]. A parameter given by an expression without coordinates and
    /// parameters gets its value.
    pub fn new(
        kind: &'static Kind,
        mut params: Vec<Param>,
        operands: Vec<Model>,
        payload: Payload,
    ) -> Result<Self, FieldError> {
        for p in &mut params {
            if let Some(v) = p.expr.as_ref().and_then(arguments::closed_value) {
                (p.value, p.expr) = (v, None);
            }
        }
        check(kind, &params, &operands, &payload)?;
        Self::unchecked(kind, None, params, operands, payload)
    }

    fn unchecked(
        kind: &'static Kind,
        name: Option<Arc<str>>,
        params: Vec<Param>,
        operands: Vec<Model>,
        payload: Payload,
    ) -> Result<Self, FieldError> {
        let depth = 1 + below(&params, &payload, &operands).map(|m| m.0.depth).max().unwrap_or(0);
        if depth > MAX_DEPTH {
            return Err(FieldError::TooLarge(format!(
                "a model may be nested {MAX_DEPTH} deep, this one is deeper; combine many parts with one \
                 `union` or one `add` of all of them instead of one by one"
            )));
        }
        let all = !operands.is_empty() && operands.iter().all(|m| m.0.hidden);
        let hidden = all || kind.name == kinds::HIDDEN;
        Ok(Self(Arc::new(Tree { kind, name, params, operands, payload, depth, hidden })))
    }

    /// A coordinate: 0 = x, 1 = y, 2 = z. Panics beyond.
    pub fn axis(axis: usize) -> Self {
        let name = ["x", "y", "z"][axis];
        Self::unchecked(kinds::known(name), None, vec![], vec![], Payload::None).expect("a leaf is not deep")
    }

    /// A constant. `Invalid` where it is not finite.
    pub fn constant(value: f64) -> Result<Self, FieldError> {
        Self::new(kinds::known("const"), vec![], vec![], Payload::Number(value))
    }

    /// A free-standing parameter of a formula, with path `name`.
    pub fn parameter(name: &str, value: f64) -> Result<Self, FieldError> {
        Self::new(kinds::known("parameter"), vec![Param::new(name, value)], vec![], Payload::None)
    }

    /// A function of the caller's, with its parameters as [`Callback::parameters`] has them.
    pub fn function(callback: Arc<dyn Callback>) -> Result<Self, FieldError> {
        Self::new(kinds::known("function"), callback.parameters(), vec![], Payload::Callback(callback))
    }

    /// The kind.
    pub fn kind(&self) -> &'static Kind {
        self.0.kind
    }

    /// The name given with [`Model::named`].
    pub fn name(&self) -> Option<&str> {
        self.0.name.as_deref()
    }

    /// The node's own parameters.
    pub fn params(&self) -> &[Param] {
        &self.0.params
    }

    /// The operands.
    pub fn operands(&self) -> &[Model] {
        &self.0.operands
    }

    /// What the node carries besides parameters and operands.
    pub fn payload(&self) -> &Payload {
        &self.0.payload
    }

    /// Number of nodes on the longest way down.
    pub fn depth(&self) -> usize {
        self.0.depth
    }

    /// The value of a constant.
    pub fn as_constant(&self) -> Option<f64> {
        match self.0.payload {
            Payload::Number(v) => Some(v),
            _ => None,
        }
    }

    /// Whether this is a solid: see [`Category`].
    pub fn is_solid(&self) -> bool {
        self.0.kind.is_solid()
    }

    /// Whether it is left out of what is above: see the kind `hidden`. An operator is, too, where all of its operands are.
    pub fn is_hidden(&self) -> bool {
        self.0.hidden
    }

    /// The node that counts in this one's place, and those of its operands that count: all of a node without hidden operands, or with
    /// no others. An operator of several operands that is left with one gives way to it.
    pub(crate) fn shown(&self) -> (&Self, Vec<&Self>) {
        let mut at = self;
        loop {
            let operands = at.operands();
            let shown: Vec<&Self> = operands.iter().filter(|m| at.0.hidden || !m.0.hidden).collect();
            match shown[..] {
                [one] if operands.len() > 1 => at = one,
                _ => return (at, shown),
            }
        }
    }

    /// The same node under a name, which appears in the paths of its parameters. Not empty, without `/` and `*`.
    pub fn named(&self, name: &str) -> Result<Self, FieldError> {
        check_name(name)?;
        let t = &*self.0;
        let name = Some(Arc::from(name));
        Self::unchecked(t.kind, name, t.params.clone(), t.operands.clone(), t.payload.clone())
    }

    /// The same without a name of its own.
    pub fn unnamed(&self) -> Result<Self, FieldError> {
        let t = &*self.0;
        Self::unchecked(t.kind, None, t.params.clone(), t.operands.clone(), t.payload.clone())
    }

    /// What tells one shared node from another.
    pub(crate) fn id(&self) -> usize {
        Arc::as_ptr(&self.0) as usize
    }

    /// Expressions of parameters and of the payload, then operands: what hangs below.
    pub(crate) fn below(&self) -> impl DoubleEndedIterator<Item = &Model> {
        below(&self.0.params, &self.0.payload, &self.0.operands)
    }
}

fn below<'a>(
    params: &'a [Param],
    payload: &'a Payload,
    operands: &'a [Model],
) -> impl DoubleEndedIterator<Item = &'a Model> {
    let own = match payload {
        Payload::Expression(h) => Some(h),
        _ => None,
    };
    params.iter().filter_map(|p| p.expr.as_ref()).chain(own).chain(operands)
}

/// Runs a step of a recursion over a tree; the stack grows as needed.
pub(crate) fn guarded<R>(step: impl FnOnce() -> R) -> R {
    stacker::maybe_grow(128 * 1024, 2 * 1024 * 1024, step)
}

fn check_name(name: &str) -> Result<(), FieldError> {
    if name.is_empty() || name.len() > 200 || name.contains(|c: char| c == '/' || c == '*' || c.is_control())
    {
        return Err(FieldError::Invalid(format!(
            "`{name}` cannot be a name: give 1 to 200 characters without `/` and `*`"
        )));
    }
    Ok(())
}

fn check(kind: &Kind, params: &[Param], operands: &[Model], payload: &Payload) -> Result<(), FieldError> {
    let wrong = |what: String| Err(FieldError::Invalid(format!("{}: {what}", kind.name)));
    if !kind.operands.accepts(operands.len()) {
        return wrong(format!("expected {}, given {}", kind.operands, operands.len()));
    }
    if payload.kind() != kind.payload {
        return wrong(format!("expected the payload {:?}, given {:?}", kind.payload, payload.kind()));
    }
    let (fixed, extra) = (kind.params.len(), params.len().checked_sub(kind.params.len()));
    let count_is_right = match (kind.layout, extra, payload) {
        (_, None, _) => false,
        (Layout::Fixed, Some(n), _) => n == 0,
        (Layout::Groups, Some(n), _) => n % kind.group.len() == 0,
        (Layout::Own, Some(n), _) => n == 1,
        (Layout::Function, Some(_), Payload::Callback(f)) => match leaf::mismatch(&**f, params) {
            Some(reason) => return wrong(reason),
            None => true,
        },
        (Layout::Function, ..) => false,
        (Layout::Monomials, Some(n), Payload::Exponents(e)) => n == e.len() && n > 0,
        (Layout::Monomials, ..) => false,
    };
    if !count_is_right {
        return wrong(match kind.layout {
            Layout::Groups => {
                format!(
                    "expected {fixed} parameters and then groups of {}, given {}",
                    kind.group.len(),
                    params.len()
                )
            }
            Layout::Monomials => format!("expected a coefficient for each monomial, given {}", params.len()),
            _ => format!("expected {fixed} parameters, given {}", params.len()),
        });
    }
    for (i, p) in params.iter().enumerate() {
        check_name(&p.name)?;
        let expected = match (kind.layout, payload) {
            (Layout::Own | Layout::Function, _) => None,
            (Layout::Monomials, Payload::Exponents(e)) => Some(kinds::coefficient_name(e[i])),
            _ if i >= fixed => Some(arguments::group_name(kind, i)),
            _ => Some(kind.params[i].name.to_string()),
        };
        if let Some(expected) = expected.filter(|e| **e != *p.name) {
            return wrong(format!("expected the parameter {expected}, given {}", p.name));
        }
        check_param(kind, kind.spec(i), p)?;
    }
    match payload {
        Payload::Number(v) if !v.is_finite() => wrong(format!("a constant must be finite, given {v}")),
        Payload::Exponents(e) => {
            let order = |[x, y, z]: [u8; 3]| (x as u32 + y as u32 + z as u32, z, y);
            match e.windows(2).find(|w| order(w[0]) >= order(w[1])) {
                Some(w) => wrong(format!(
                    "the monomials must come by degree, then by the exponents of z and y, each once; {:?} stands \
                     before {:?}",
                    w[0], w[1]
                )),
                None => Ok(()),
            }
        }
        _ => Ok(()),
    }
}

fn check_param(kind: &Kind, spec: Option<&ParamSpec>, p: &Param) -> Result<(), FieldError> {
    let wrong = |what: String| Err(FieldError::Invalid(format!("{}: {} {what}", kind.name, p.name)));
    let (lo, hi) = p.bounds;
    if lo.is_nan() || hi.is_nan() || lo > hi {
        return wrong(format!("has the bounds [{lo}, {hi}]: the first must not be above the second"));
    }
    if !(p.scale > 0.0 && p.scale.is_finite()) {
        return wrong(format!("has the scale {}: it must be positive and finite", p.scale));
    }
    let discrete = spec.is_some_and(|s| s.discrete);
    match &p.expr {
        Some(_) if discrete => return wrong("is discrete: give a whole number, not an expression".into()),
        Some(_) => return Ok(()),
        None => {}
    }
    if !p.value.is_finite() {
        return wrong(format!("must be finite, given {}", p.value));
    }
    if discrete && p.value.fract() != 0.0 {
        return wrong(format!("must be a whole number, given {}", p.value));
    }
    let (slo, shi) = spec.map_or((lo, hi), |s| (s.bounds.0.max(lo), s.bounds.1.min(hi)));
    if !(slo <= p.value && p.value <= shi) {
        let range = match (slo, shi) {
            (f64::MIN_POSITIVE, f64::INFINITY) => "above 0".to_string(),
            (lo, f64::INFINITY) => format!("at least {lo}"),
            (f64::NEG_INFINITY, hi) => format!("at most {hi}"),
            (lo, hi) => format!("between {lo} and {hi}"),
        };
        return wrong(format!("must be {range}, given {}", p.value));
    }
    Ok(())
}

impl Drop for Tree {
    /// Takes the tree apart node by node, so that a deep one needs no deep stack.
    fn drop(&mut self) {
        fn take(t: &mut Tree, rest: &mut Vec<Model>) {
            rest.append(&mut t.operands);
            rest.extend(t.params.iter_mut().filter_map(|p| p.expr.take()));
            if let Payload::Expression(h) = std::mem::replace(&mut t.payload, Payload::None) {
                rest.push(h);
            }
        }
        let mut rest = Vec::new();
        take(self, &mut rest);
        while let Some(m) = rest.pop() {
            if let Some(mut t) = Arc::into_inner(m.0) {
                take(&mut t, &mut rest);
            }
        }
    }
}

impl PartialEq for Model {
    /// Whether both have the same nodes with the same names, values and flags (functions by name), whatever is
    /// shared.
    fn eq(&self, other: &Self) -> bool {
        let mut seen = rustc_hash::FxHashSet::default();
        let mut rest = vec![(self, other)];
        while let Some((a, b)) = rest.pop() {
            if a.id() == b.id() || !seen.insert((a.id(), b.id())) {
                continue;
            }
            let (s, t) = (&*a.0, &*b.0);
            let payload = match (&s.payload, &t.payload) {
                (Payload::None, Payload::None) | (Payload::Expression(_), Payload::Expression(_)) => true,
                (Payload::Number(v), Payload::Number(w)) => v == w,
                (Payload::Exponents(v), Payload::Exponents(w)) => v == w,
                (Payload::Program(v), Payload::Program(w)) => v == w,
                (Payload::Callback(v), Payload::Callback(w)) => v.name() == w.name(),
                _ => false,
            };
            let params = s.params.len() == t.params.len()
                && s.params.iter().zip(&t.params).all(|(p, q)| {
                    p.name == q.name
                        && p.frozen == q.frozen
                        && p.bounds == q.bounds
                        && p.scale == q.scale
                        && p.expr.is_some() == q.expr.is_some()
                        && (p.expr.is_some() || p.value == q.value)
                });
            if !payload
                || !params
                || s.kind != t.kind
                || s.name != t.name
                || s.operands.len() != t.operands.len()
            {
                return false;
            }
            rest.extend(a.below().zip(b.below()));
        }
        true
    }
}

#[cfg(test)]
pub(crate) mod tests;
