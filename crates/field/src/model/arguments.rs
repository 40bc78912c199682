//! From the arguments of a call, `sphere(r=1)` or `union(a, b)`, to a node: one rule for text and Python.

use super::{Category, Kind, Layout, Model, Operands, Param, Payload, PayloadKind, kind, kinds};
use crate::FieldError;
use crate::arrange::Arrange;
use crate::text::suggestion;

/// An argument.
#[derive(Clone, Debug)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A model: an operand, or an expression that gives a parameter.
    Model(Model),
}

impl Value {
    fn into_model(self) -> Result<Model, FieldError> {
        match self {
            Value::Number(v) => Model::constant(v),
            Value::Model(m) => Ok(m),
        }
    }

    fn as_number(&self) -> Option<f64> {
        match self {
            Value::Number(v) => Some(*v),
            Value::Model(m) => closed_value(m),
        }
    }

    fn store(self, p: &mut Param) {
        match self {
            Value::Number(v) => p.value = v,
            Value::Model(m) => p.expr = Some(m),
        }
    }
}

/// The value of a formula without coordinates and parameters, such as 2*pi. Long ones stay formulas, so that
/// many that build on each other take no longer than reading them.
pub(super) fn closed_value(m: &Model) -> Option<f64> {
    let mut seen = rustc_hash::FxHashSet::default();
    let mut rest = vec![m];
    while let Some(m) = rest.pop() {
        if m.as_constant().is_none() && m.kind().category != Category::Formula {
            return None;
        }
        if seen.insert(m.id()) {
            rest.extend(m.operands());
        }
        if seen.len() > 200 {
            return None;
        }
    }
    let lowered = m.lower().ok()?;
    lowered.graph.as_constant(lowered.roots[0])
}

/// Why a call makes no sense, and which argument is to blame (positional ones first).
pub(crate) struct CallError {
    pub argument: Option<usize>,
    pub reason: String,
}

impl From<FieldError> for CallError {
    fn from(e: FieldError) -> Self {
        Self { argument: None, reason: e.to_string() }
    }
}

/// The largest total degree of a polynomial.
pub const MAX_DEGREE: usize = 60;

/// The exponents of all monomials up to a degree in the order of HBJF02 eq. 9 (corrected): by degree, then x²,
/// xy, y², xz, yz, z².
pub fn monomials(degree: usize) -> Vec<[u8; 3]> {
    let mut all = Vec::new();
    for d in 0..=degree {
        for z in 0..=d {
            for y in 0..=d - z {
                all.push([(d - y - z) as u8, y as u8, z as u8]);
            }
        }
    }
    all
}

/// The name of the coefficient of a monomial: `c`, `c_x1`, `c_x2y1`, ….
pub fn coefficient_name(exponents: [u8; 3]) -> String {
    let mut name = String::from("c");
    for (axis, e) in ["x", "y", "z"].iter().zip(exponents).filter(|(_, e)| *e > 0) {
        if name == "c" {
            name.push('_');
        }
        name.push_str(&format!("{axis}{e}"));
    }
    name
}

/// The exponents that a coefficient's name stands for.
pub fn coefficient_exponents(name: &str) -> Option<[u8; 3]> {
    let mut exponents = [0; 3];
    let rest = name.strip_prefix('c')?;
    let mut rest = if rest.is_empty() { rest } else { rest.strip_prefix('_')? };
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        if let Some(r) = rest.strip_prefix(axis) {
            let digits = r.find(|c: char| !c.is_ascii_digit()).unwrap_or(r.len());
            exponents[k] = r[..digits].parse().ok()?;
            rest = &r[digits..];
        }
    }
    (rest.is_empty() && coefficient_name(exponents) == name).then_some(exponents)
}

impl Model {
    /// A node of the kind `name` from arguments as people write them: operands first, then parameters in order
    /// or by keyword; where a kind takes any number of operands, its parameters go by keyword only. Parameters
    /// that are not given have their defaults.
    pub fn call(
        name: &str,
        positional: Vec<Value>,
        keyword: Vec<(String, Value)>,
    ) -> Result<Self, FieldError> {
        Self::call_located(name, positional, keyword).map_err(|e| FieldError::Invalid(e.reason))
    }

    pub(crate) fn call_located(
        name: &str,
        positional: Vec<Value>,
        keyword: Vec<(String, Value)>,
    ) -> Result<Self, CallError> {
        let fail = |argument, reason: String| Err(CallError { argument, reason });
        let callable = |k: &Kind| {
            k.category != Category::Atom
                && matches!(k.payload, PayloadKind::None | PayloadKind::Exponents | PayloadKind::Expression)
        };
        let Some(k) = kind(name).filter(|k| callable(k)) else {
            let known = kinds().iter().filter(|k| callable(k)).map(|k| k.name);
            return fail(None, format!("there is no shape or function `{name}`{}", suggestion(name, known)));
        };
        let given = positional.len();
        let mut arguments = positional.into_iter().enumerate();
        let wanted = match k.operands {
            Operands::Exactly(n) => n,
            Operands::AtLeast(_) => given,
        };
        let mut operands = Vec::with_capacity(wanted);
        for (_, v) in arguments.by_ref().take(wanted) {
            operands.push(v.into_model()?);
        }
        if !k.operands.accepts(operands.len()) {
            return fail(None, format!("{name} takes {}, given {given}", k.operands));
        }
        let mut payload = Payload::None;
        if k.layout == Layout::Monomials {
            let (params, exponents) = monomial_arguments(arguments.map(|a| a.1).collect(), keyword)?;
            return Ok(Self::new(k, params, operands, Payload::Exponents(exponents.into()))?);
        }
        let mut params: Vec<Param> = k.params.iter().map(Param::from_spec).collect();
        let mut filled = vec![false; params.len()];
        for (i, v) in arguments {
            let n = i - wanted;
            if k.payload == PayloadKind::Expression && matches!(payload, Payload::None) {
                payload = Payload::Expression(v.into_model()?);
                continue;
            }
            if n >= params.len() && k.layout != Layout::Groups {
                return fail(Some(i), format!("{name} takes {}, given {given} arguments", signature(k)));
            }
            fill(k, &mut params, &mut filled, n, v);
        }
        for (j, (key, v)) in keyword.into_iter().enumerate() {
            let at = Some(given + j);
            if key == "h" && k.payload == PayloadKind::Expression && matches!(payload, Payload::None) {
                payload = Payload::Expression(v.into_model()?);
                continue;
            }
            let Some(n) = param_number(k, &key).filter(|n| *n < 1_000_000) else {
                let known = k.params.iter().map(|s| s.name);
                let hint = suggestion(&key, known);
                return fail(at, format!("{name} has no parameter `{key}`{hint}; it takes {}", signature(k)));
            };
            if filled.get(n) == Some(&true) {
                return fail(at, format!("`{key}` of {name} is given twice"));
            }
            if n > params.len() {
                return fail(at, format!("`{key}` of {name} is given, but parameters before it are not"));
            }
            fill(k, &mut params, &mut filled, n, v);
        }
        if k.payload == PayloadKind::Expression && matches!(payload, Payload::None) {
            return fail(None, format!("{name} needs an expression in f and g: {name}(a, b, h=min(f, g))"));
        }
        Ok(Self::new(k, params, operands, payload)?)
    }
}

/// Stores the value of parameter `n`, which may be the next of a repeating group.
fn fill(k: &Kind, params: &mut Vec<Param>, filled: &mut Vec<bool>, n: usize, v: Value) {
    if n == params.len() {
        params.push(group_param(k, n));
        filled.push(false);
    }
    v.store(&mut params[n]);
    filled[n] = true;
}

/// Parameter `n` of a node with repeating groups, at its default.
fn group_param(k: &Kind, n: usize) -> Param {
    let spec = &k.group[(n - k.params.len()) % k.group.len()];
    Param { name: group_name(k, n).into(), ..Param::from_spec(spec) }
}

/// The name of parameter `n` of a node with repeating groups.
pub(super) fn group_name(k: &Kind, n: usize) -> String {
    let i = n - k.params.len();
    format!("{}{}", k.group[i % k.group.len()].name, i / k.group.len())
}

fn param_number(k: &Kind, key: &str) -> Option<usize> {
    if let Some(i) = k.params.iter().position(|s| s.name == key) {
        return Some(i);
    }
    let digits = key.trim_start_matches(|c: char| !c.is_ascii_digit());
    k.group.iter().enumerate().find_map(|(j, s)| {
        let number: usize = key.strip_prefix(s.name).filter(|r| *r == digits)?.parse().ok()?;
        Some(k.params.len() + number.checked_mul(k.group.len())? + j)
    })
}

/// What a kind takes, for error messages.
fn signature(k: &Kind) -> String {
    let mut parts = Vec::new();
    if k.operands != Operands::Exactly(0) {
        parts.push(k.operands.to_string());
    }
    if k.payload == PayloadKind::Expression {
        parts.push("h".into());
    }
    parts.extend(k.params.iter().map(|s| s.name.to_string()));
    if k.layout == Layout::Groups {
        let names: Vec<String> = k.group.iter().map(|s| format!("{}0", s.name)).collect();
        parts.push(format!("{}, …", names.join(", ")));
    }
    if parts.is_empty() { "nothing".into() } else { parts.join(", ") }
}

fn monomial_arguments(
    positional: Vec<Value>,
    keyword: Vec<(String, Value)>,
) -> Result<(Vec<Param>, Vec<[u8; 3]>), CallError> {
    let fail = |argument, reason: String| Err(CallError { argument, reason });
    let given = positional.len();
    let mut degree = None;
    if given > 0 {
        degree = (0..=MAX_DEGREE).find(|d| (d + 1) * (d + 2) * (d + 3) / 6 == given);
        if degree.is_none() {
            let counts = "1, 4, 10, 20, 35, … coefficients for degree 0, 1, 2, 3, 4, …";
            return fail(
                Some(given - 1),
                format!("algebraic takes {counts}, given {given}; or name them: c_x2=1"),
            );
        }
    }
    for (j, (key, v)) in keyword.iter().enumerate().filter(|(_, (key, _))| key == "degree") {
        match v.as_number() {
            Some(d) if degree.is_none() && d.fract() == 0.0 && (0.0..=MAX_DEGREE as f64).contains(&d) => {
                degree = Some(d as usize);
            }
            _ => {
                let reason = format!("{key} must be one whole number from 0 to {MAX_DEGREE}");
                return fail(Some(given + j), reason);
            }
        }
    }
    let mut exponents = degree.map(monomials).unwrap_or_default();
    let named = |e: [u8; 3]| Param::new(coefficient_name(e), 0.0);
    let mut params: Vec<Param> = exponents.iter().map(|e| named(*e)).collect();
    for (p, v) in params.iter_mut().zip(positional) {
        v.store(p);
    }
    let mut seen = Vec::new();
    for (j, (key, v)) in keyword.into_iter().enumerate().filter(|(_, (key, _))| key != "degree") {
        let at = Some(given + j);
        let Some(e) = coefficient_exponents(&key) else {
            return fail(at, format!("`{key}` is no coefficient; they are called c, c_x1, c_x2y1, c_z3, …"));
        };
        if e.iter().map(|&v| v as usize).sum::<usize>() > MAX_DEGREE {
            return fail(at, format!("the degree of `{key}` is above {MAX_DEGREE}"));
        }
        if seen.contains(&e) || given > 0 {
            return fail(at, format!("`{key}` is given twice"));
        }
        seen.push(e);
        let i = exponents.iter().position(|f| *f == e).unwrap_or_else(|| {
            exponents.push(e);
            params.push(named(e));
            params.len() - 1
        });
        v.store(&mut params[i]);
    }
    let mut order: Vec<usize> = (0..exponents.len()).collect();
    order.arrange_by_key(|&i| {
        let [x, y, z] = exponents[i];
        (x as u32 + y as u32 + z as u32, z, y)
    });
    let params = order.iter().map(|&i| params[i].clone()).collect();
    Ok((params, order.iter().map(|&i| exponents[i]).collect()))
}
