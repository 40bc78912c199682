//! Models as text.

use std::fmt::Write;

use rustc_hash::{FxHashMap, FxHashSet};

use super::lexer::is_identifier;
use crate::FieldError;
use crate::model::{Category, Layout, Model, Operands, Param, Payload, guarded};

/// Parts nested deeper than this get a name of their own, so that the text can be read back.
const NESTED: usize = 40;

/// A number with all its digits, without an exponent where it is short.
pub(crate) fn number(v: f64) -> String {
    let size = v.abs();
    if size == 0.0 || (1e-5..1e16).contains(&size) { format!("{v}") } else { format!("{v:e}") }
}

struct Printer {
    names: FxHashMap<usize, String>,
    /// The first thing that the text cannot say.
    lost: Option<String>,
    in_blend: bool,
}

fn is_atom(m: &Model) -> bool {
    m.kind().category == Category::Atom
}

/// Nodes below `m` and itself, operands before their users, each once, with the number of their users.
fn ordered(m: &Model) -> (Vec<Model>, FxHashMap<usize, usize>) {
    fn visit(m: &Model, order: &mut Vec<Model>, users: &mut FxHashMap<usize, usize>) {
        let n = users.entry(m.id()).or_insert(0);
        *n += 1;
        if *n == 1 {
            for b in m.below() {
                guarded(|| visit(b, order, users));
            }
            order.push(m.clone());
        }
    }
    let (mut order, mut users) = (Vec::new(), FxHashMap::default());
    visit(m, &mut order, &mut users);
    (order, users)
}

impl Printer {
    fn lose(&mut self, what: impl FnOnce() -> String) {
        if self.lost.is_none() {
            self.lost = Some(what());
        }
    }

    /// Gives names to the parts that have one, occur twice or are too deep, and prints all.
    fn whole(&mut self, model: &Model) -> String {
        let (order, users) = ordered(model);
        let mut taken: FxHashSet<String> = ["x", "y", "z"].map(String::from).into_iter().collect();
        let mut free_standing: FxHashMap<&str, usize> = FxHashMap::default();
        for m in order.iter().filter(|m| m.kind().name == "parameter") {
            let name = &*m.params()[0].name;
            taken.insert(name.to_string());
            if *free_standing.entry(name).or_insert(m.id()) != m.id() {
                self.lose(|| format!("two parameters are called `{name}`"));
            }
            if !is_identifier(name) || ["x", "y", "z", "f", "g"].contains(&name) {
                self.lose(|| format!("a parameter is called `{name}`"));
            }
        }
        let mut nesting: FxHashMap<usize, usize> = FxHashMap::default();
        let mut number = 0;
        let mut text = String::new();
        for m in &order {
            let below = m.below().map(|b| nesting[&b.id()]).max().unwrap_or(0);
            nesting.insert(m.id(), below + 1);
            self.check(m);
            if is_atom(m) {
                continue;
            }
            let explicit =
                m.name().filter(|n| is_identifier(n) && !n.starts_with('_') && !taken.contains(*n));
            let is_shared = users[&m.id()] > 1;
            if m.name().is_none() && !is_shared && below + 1 < NESTED {
                continue;
            }
            let name = explicit.map(String::from).unwrap_or_else(|| {
                loop {
                    number += 1;
                    let name = format!("_{number}");
                    if !taken.contains(&name) {
                        break name;
                    }
                }
            });
            if let (None, Some(n)) = (explicit, m.name()) {
                self.lose(|| format!("a part is called `{n}`"));
            }
            taken.insert(name.clone());
            let _ = write!(text, "{name} = ");
            self.node(m, 0, &mut text);
            text.push_str("; ");
            nesting.insert(m.id(), 0);
            self.names.insert(m.id(), name);
        }
        self.any(model, 0, &mut text);
        text
    }

    /// Notes what the text cannot say of this node.
    fn check(&mut self, m: &Model) {
        let k = m.kind();
        for (i, p) in m.params().iter().enumerate() {
            let plain = k.spec(i).map_or_else(|| Param::new("", 0.0), Param::from_spec);
            let own = (p.frozen, p.bounds, p.scale);
            if p.expr.is_none() && own != (plain.frozen, plain.bounds, plain.scale) {
                self.lose(|| format!("{} of {} is frozen, bounded or scaled", p.name, k.name));
            }
        }
        match m.payload() {
            Payload::Program(_) => self.lose(|| "it contains a .vm program".into()),
            Payload::Callback(f) => self.lose(|| format!("it contains the function `{}`", f.name())),
            _ if is_atom(m) && m.name().is_some() => self.lose(|| format!("{} has a name", k.name)),
            _ => {}
        }
    }

    fn any(&mut self, m: &Model, weakest: u8, out: &mut String) {
        match self.names.get(&m.id()) {
            Some(name) => out.push_str(name),
            None => guarded(|| self.node(m, weakest, out)),
        }
    }

    /// Prints a node, in brackets where its sign binds less than `weakest`.
    fn node(&mut self, m: &Model, weakest: u8, out: &mut String) {
        let ops = m.operands();
        let solids = ops.iter().all(Model::is_solid);
        let name = m.kind().name;
        let (level, sign) = match (name, ops.len()) {
            ("less", _) => (0, " < "),
            ("union", 2..) => (1, " | "),
            ("intersection", 2..) => (2, " & "),
            ("add", 2..) => (3, " + "),
            ("sub", _) if !solids => (3, " - "),
            ("difference", 2..) if solids => (3, " - "),
            ("mul", 2..) => (4, "*"),
            ("div", _) => (4, "/"),
            ("mod", _) => (4, " % "),
            ("neg", _) => (5, "-"),
            ("complement", _) => (5, "~"),
            ("pow", _) => (6, "^"),
            ("const", _) if m.as_constant().is_some_and(f64::is_sign_negative) => (5, ""),
            _ => (7, ""),
        };
        if level < weakest {
            out.push('(');
        }
        match level {
            5 if sign.is_empty() => out.push_str(&number(m.as_constant().unwrap_or(0.0))),
            5 => {
                out.push_str(sign);
                // −(1) is no literal −1, and a name is no number.
                let literal = ops[0].as_constant().is_some_and(|v| !v.is_sign_negative());
                self.any(&ops[0], if literal { 8 } else { 5 }, out);
            }
            6 => {
                self.any(&ops[0], 7, out);
                out.push('^');
                self.any(&ops[1], 5, out);
            }
            7 => self.call(m, out),
            _ => {
                for (i, o) in ops.iter().enumerate() {
                    if i > 0 {
                        out.push_str(sign);
                    }
                    // The first of a row may be of the same strength, unless it would melt into the row.
                    let chain = matches!(name, "add" | "mul" | "union" | "intersection" | "difference");
                    let melts = level == 0 || (chain && o.kind().name == name);
                    self.any(o, if i == 0 && !melts { level } else { level + 1 }, out);
                }
            }
        }
        if level < weakest {
            out.push(')');
        }
    }

    fn call(&mut self, m: &Model, out: &mut String) {
        let k = m.kind();
        match (k.name, m.payload()) {
            ("x", _) => return out.push_str(if self.in_blend { "f" } else { "x" }),
            ("y", _) => return out.push_str(if self.in_blend { "g" } else { "y" }),
            ("z", _) => return out.push('z'),
            ("parameter", _) => return out.push_str(&m.params()[0].name),
            (_, Payload::Number(v)) => return out.push_str(&number(*v)),
            _ => {}
        }
        out.push_str(k.name);
        out.push('(');
        let mut first = true;
        let mut comma = |out: &mut String| {
            if !std::mem::take(&mut first) {
                out.push_str(", ");
            }
        };
        for o in m.operands() {
            comma(out);
            self.any(o, 0, out);
        }
        match m.payload() {
            Payload::Expression(h) => {
                comma(out);
                out.push_str("h=");
                let outer = std::mem::replace(&mut self.in_blend, true);
                self.any(h, 0, out);
                self.in_blend = outer;
            }
            Payload::Callback(f) => {
                comma(out);
                let _ = write!(out, "{:?}", f.name());
            }
            Payload::Program(p) => {
                comma(out);
                let _ = write!(out, "{} steps", p.len());
            }
            _ => {}
        }
        let by_position = k.layout == Layout::Groups && matches!(k.operands, Operands::Exactly(_));
        let spoken =
            |(i, p): &(usize, &Param)| k.spec(*i).is_none_or(|s| p.expr.is_some() || p.value != s.default);
        let last = m.params().iter().enumerate().filter(spoken).map(|(i, _)| i).next_back().unwrap_or(0);
        let shown = if k.layout == Layout::Fixed { last + 1 } else { m.params().len() };
        for p in m.params().iter().take(shown) {
            comma(out);
            if !by_position {
                let _ = write!(out, "{}=", p.name);
            }
            match &p.expr {
                Some(e) => self.any(e, 0, out),
                None => out.push_str(&number(p.value)),
            }
        }
        out.push(')');
    }
}

impl Model {
    /// The model as text which [`super::parse`] reads back to an equal model, given the values of
    /// [`Model::free_standing`]. `Invalid` where the text cannot say all: functions, .vm programs, names that are
    /// no identifiers, parameters that are frozen, bounded or scaled otherwise than by default.
    pub fn to_text(&self) -> Result<String, FieldError> {
        let mut printer = Printer { names: FxHashMap::default(), lost: None, in_blend: false };
        let text = printer.whole(self);
        match printer.lost {
            None => Ok(text),
            Some(what) => Err(FieldError::Invalid(format!(
                "the model has no text form, because {what}; save it as .iso.json"
            ))),
        }
    }

    /// The free-standing parameters of formulas and their values, in the order of q.
    pub fn free_standing(&self) -> Vec<(String, f64)> {
        let mut all: Vec<(String, f64)> = Vec::new();
        let mut seen = FxHashSet::default();
        let mut rest = vec![self];
        while let Some(m) = rest.pop() {
            if !seen.insert(m.id()) {
                continue;
            }
            if m.kind().name == "parameter" {
                all.push((m.params()[0].name.to_string(), m.params()[0].value));
            }
            rest.extend(m.below().rev());
        }
        all
    }
}

impl std::fmt::Display for Model {
    /// The text of the model; names and flags of parameters may be missing: see [`Model::to_text`].
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut printer = Printer { names: FxHashMap::default(), lost: None, in_blend: false };
        f.write_str(&printer.whole(self))
    }
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Model({self})")
    }
}
