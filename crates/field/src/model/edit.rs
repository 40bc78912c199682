//! Changes of the tree itself: nodes found by path, replaced, added, removed, wrapped, put into another order. Every change
//! gives another tree; what did not change is shared.

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use super::parameters::Names;
use super::{Callback, Model, Operands, Payload, guarded};
use crate::FieldError;
use crate::arrange::Arrange;
use crate::text::suggestion;

/// A node of a model, as a list of its parts shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeInfo {
    /// Where it is: the names of the named nodes above and its own (its name or its kind), joined by `/`; unique. The
    /// paths of its parameters begin with it.
    pub path: String,
    /// Its kind.
    pub kind: &'static str,
    /// Nodes on the way from the root to it.
    pub level: usize,
    /// Number of its operands.
    pub operands: usize,
    /// Whether it is hidden itself, not only with what is above it.
    pub hidden: bool,
    model: Model,
}

impl NodeInfo {
    /// The part of the model that begins here.
    pub fn model(&self) -> &Model {
        &self.model
    }
}

impl Model {
    /// The caller's functions in it, wherever they stand, those within formulas too; each once.
    pub fn functions(&self) -> Vec<Arc<dyn Callback>> {
        let (mut found, mut seen) = (Vec::<Arc<dyn Callback>>::new(), FxHashSet::default());
        let mut stack = vec![self];
        while let Some(m) = stack.pop() {
            if !seen.insert(m.id()) {
                continue;
            }
            if let Payload::Callback(f) = m.payload()
                && !found.iter().any(|g| Arc::ptr_eq(f, g))
            {
                found.push(f.clone());
            }
            stack.extend(m.below());
        }
        found
    }

    /// All nodes that can be edited, each before its operands, in the order of the parameters. Formulas count as one node, and what is
    /// hidden is said to be so.
    pub fn nodes(&self) -> Vec<NodeInfo> {
        fn visit(
            m: &Model,
            above: &str,
            (level, hidden): (usize, bool),
            names: &mut Names,
            stems: &FxHashMap<usize, String>,
            out: &mut Vec<NodeInfo>,
            seen: &mut FxHashSet<usize>,
        ) {
            if !seen.insert(m.id()) {
                return;
            }
            if m.hides() {
                return guarded(|| visit(&m.operands()[0], above, (level, true), names, stems, out, seen));
            }
            let own = m.name().unwrap_or(m.kind().name);
            let path = match stems.get(&m.id()) {
                Some(stem) => stem.clone(),
                None => names.unique(format!("{above}{own}")),
            };
            let (kind, operands) = (m.kind().name, m.operands().len());
            out.push(NodeInfo { path, kind, level, operands, hidden, model: m.clone() });
            let inner = m.name().map(|n| format!("{above}{n}/"));
            let above = inner.as_deref().unwrap_or(above);
            for b in m.operands().iter().filter(|b| b.is_solid()) {
                guarded(|| visit(b, above, (level + 1, false), names, stems, out, seen));
            }
        }
        let (mut names, stems) = super::parameters::stems(self);
        let mut out = Vec::new();
        visit(self, "", (0, false), &mut names, &stems, &mut out, &mut rustc_hash::FxHashSet::default());
        out
    }

    /// The part of the model at a path.
    pub fn node(&self, path: &str) -> Result<Self, FieldError> {
        let nodes = self.nodes();
        if let Some(n) = nodes.iter().find(|n| n.path == path) {
            return Ok(n.model.clone());
        }
        let hint = suggestion(path, nodes.iter().map(|n| n.path.as_str()));
        let mut known: Vec<&str> = nodes.iter().map(|n| n.path.as_str()).take(20).collect();
        if nodes.len() > known.len() {
            known.push("…");
        }
        Err(FieldError::Invalid(format!("there is no node `{path}`{hint}; there are: {}", known.join(", "))))
    }

    /// Whether this is the node around a part that is hidden.
    fn hides(&self) -> bool {
        self.kind().name == super::kinds::HIDDEN
    }

    /// The model with the part at a path hidden: left out of the operator above it, with its parameters in place; or shown again.
    pub fn with_hidden(&self, path: &str, hidden: bool) -> Result<Self, FieldError> {
        let old = self.node(path)?;
        let around = self.find(|m| m.hides() && m.operands()[0].id() == old.id());
        match (around, hidden) {
            (None, true) => {
                let kind = super::kinds::known(super::kinds::HIDDEN);
                let new = Model::new(kind, vec![], vec![old.clone()], Payload::None)?;
                self.exchanged(&old, Some(&new))
            }
            (Some(around), false) => self.exchanged(&around, Some(&old)),
            _ => Ok(self.clone()),
        }
    }

    /// A node, wherever it stands.
    fn find(&self, is: impl Fn(&Self) -> bool) -> Option<Self> {
        let mut seen = FxHashSet::default();
        let mut stack = vec![self];
        while let Some(m) = stack.pop() {
            if seen.insert(m.id()) {
                if is(m) {
                    return Some(m.clone());
                }
                stack.extend(m.operands());
            }
        }
        None
    }

    /// The model with another part at a path.
    pub fn with_node(&self, path: &str, part: &Model) -> Result<Self, FieldError> {
        let old = self.node(path)?;
        self.exchanged(&old, Some(part))
    }

    /// The model with the part at a path inside an operator that `wrap` makes of it.
    pub fn with_wrapped(
        &self,
        path: &str,
        wrap: impl FnOnce(&Model) -> Result<Model, FieldError>,
    ) -> Result<Self, FieldError> {
        let old = self.node(path)?;
        let new = wrap(&old)?;
        self.exchanged(&old, Some(&new))
    }

    /// The model with one more part: another operand, at the end, of the operator at the path where that takes any number;
    /// otherwise the union of what is there and the part.
    pub fn with_added(&self, path: &str, part: &Model) -> Result<Self, FieldError> {
        let old = self.node(path)?;
        let new = match old.kind().operands {
            Operands::AtLeast(_) if old.is_solid() => {
                let mut operands = old.operands().to_vec();
                operands.push(part.clone());
                old.with_operands(operands)?
            }
            _ => Model::new(
                super::kinds::known("union"),
                vec![],
                vec![old.clone(), part.clone()],
                Payload::None,
            )?,
        };
        self.exchanged(&old, Some(&new))
    }

    /// The model with a copy of the part at a path, with parameters of its own: right after it in the operator above where that
    /// takes any number of operands, otherwise in a union with it.
    pub fn with_copy(&self, path: &str, name: Option<&str>) -> Result<Self, FieldError> {
        let old = self.node(path)?;
        let mut copy = old.fresh(&mut FxHashMap::default())?;
        if let Some(name) = name {
            copy = copy.named(name)?;
        }
        let above = self.nodes().into_iter().map(|n| n.model).find(|m| {
            matches!(m.kind().operands, Operands::AtLeast(_))
                && m.operands().iter().any(|o| o.id() == old.id())
        });
        let Some(above) = above else {
            let union = super::kinds::known("union");
            let both = Model::new(union, vec![], vec![old.clone(), copy], Payload::None)?;
            return self.exchanged(&old, Some(&both));
        };
        let mut operands = above.operands().to_vec();
        let place = operands.iter().position(|o| o.id() == old.id()).map_or(operands.len(), |k| k + 1);
        operands.insert(place, copy);
        self.exchanged(&above, Some(&above.with_operands(operands)?))
    }

    /// The same of new nodes; what is shared within it stays so.
    fn fresh(&self, done: &mut FxHashMap<usize, Model>) -> Result<Self, FieldError> {
        if let Some(m) = done.get(&self.id()) {
            return Ok(m.clone());
        }
        let operands = self.operands().iter().map(|o| guarded(|| o.fresh(done))).collect::<Result<_, _>>()?;
        let m = self.with_operands(operands)?;
        done.insert(self.id(), m.clone());
        Ok(m)
    }

    /// The model without the part at a path. An operator of several operands that is left with one gives way
    /// to it; an operator on one operand goes with it.
    pub fn without_node(&self, path: &str) -> Result<Self, FieldError> {
        let old = self.node(path)?;
        if old.id() == self.id() {
            return Err(FieldError::Invalid(format!(
                "`{path}` is the whole model, which cannot be removed: replace it instead"
            )));
        }
        self.exchanged(&old, None)
    }

    /// The model without the operator at a path: its only operand takes its place.
    pub fn without_operator(&self, path: &str) -> Result<Self, FieldError> {
        let old = self.node(path)?;
        match old.operands() {
            [one] => self.exchanged(&old, Some(&one.clone())),
            all => Err(FieldError::Invalid(format!(
                "`{path}` has {} operands, so that none can take its place: only an operator on one operand can be taken off",
                all.len()
            ))),
        }
    }

    /// The model with the operands of the node at a path in another order: `order[i]` is the present place of the operand
    /// that comes i-th.
    pub fn with_order(&self, path: &str, order: &[usize]) -> Result<Self, FieldError> {
        let old = self.node(path)?;
        let n = old.operands().len();
        let mut sorted = order.to_vec();
        sorted.arrange();
        if sorted.iter().copied().ne(0..n) {
            return Err(FieldError::Invalid(format!(
                "the order of `{path}` needs each of 0 to {} once, given {order:?}",
                n as i64 - 1
            )));
        }
        let operands = order.iter().map(|&i| old.operands()[i].clone()).collect();
        self.exchanged(&old, Some(&old.with_operands(operands)?))
    }

    /// The same node on other operands.
    pub fn with_operands(&self, operands: Vec<Model>) -> Result<Self, FieldError> {
        let t = &*self.0;
        super::check(t.kind, &t.params, &operands, &t.payload)?;
        Self::unchecked(t.kind, t.name.clone(), t.params.clone(), operands, t.payload.clone())
    }

    /// The model with `new` in every place of `old`, or without it.
    fn exchanged(&self, old: &Model, new: Option<&Model>) -> Result<Self, FieldError> {
        fn visit(
            m: &Model,
            old: &Model,
            new: Option<&Model>,
            done: &mut FxHashMap<usize, Option<Model>>,
        ) -> Result<Option<Model>, FieldError> {
            if m.id() == old.id() {
                return Ok(new.cloned());
            }
            if let Some(n) = done.get(&m.id()) {
                return Ok(n.clone());
            }
            let mut operands = Vec::with_capacity(m.operands().len());
            let mut changed = false;
            for o in m.operands() {
                let n = guarded(|| visit(o, old, new, done))?;
                changed |= n.as_ref().is_none_or(|n| n.id() != o.id());
                operands.extend(n);
            }
            let n = match (changed, operands.len()) {
                (false, _) => Some(m.clone()),
                (true, 0) if !m.operands().is_empty() => None,
                (true, 1) if m.operands().len() > 1 => Some(operands.remove(0)),
                (true, k) if !m.kind().operands.accepts(k) => {
                    return Err(FieldError::Invalid(format!(
                        "{} needs {}, and {k} would be left: remove the operator instead",
                        m.kind().name,
                        m.kind().operands
                    )));
                }
                (true, _) => Some(m.with_operands(operands)?),
            };
            done.insert(m.id(), n.clone());
            Ok(n)
        }
        visit(self, old, new, &mut FxHashMap::default())?.ok_or_else(|| {
            FieldError::Invalid("nothing would be left of the model: replace it instead".into())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::parse;

    fn creature() -> Model {
        let part = |t: &str, n: &str| parse(t, &[]).unwrap().named(n).unwrap();
        let parts = vec![part("sphere(r=1)", "head"), part("capsule()", "arm"), part("capsule()", "leg")];
        let kind = super::super::kinds::known("union");
        Model::new(kind, vec![], parts, Payload::None).unwrap().named("body").unwrap()
    }

    fn paths(m: &Model) -> Vec<String> {
        m.nodes().into_iter().map(|n| n.path).collect()
    }

    #[test]
    fn nodes_have_the_paths_of_their_parameters() {
        let m = creature();
        assert_eq!(paths(&m), ["body", "body/head", "body/arm", "body/leg"]);
        for p in m.parameters() {
            let node = p.path.rsplit_once('/').unwrap().0;
            assert!(m.node(node).unwrap().params().iter().any(|q| p.path.ends_with(&*q.name)), "{}", p.path);
        }
        let twins = parse("sphere(r=1) | translate(sphere(r=2), x=3)", &[]).unwrap();
        assert_eq!(paths(&twins), ["union", "sphere", "translate", "sphere_2"]);
        assert_eq!(twins.node("sphere_2").unwrap().params()[0].value, 2.0);
    }

    #[test]
    fn parts_come_and_go() {
        let m = creature();
        let tail = parse("torus()", &[]).unwrap().named("tail").unwrap();
        let more = m.with_added("body", &tail).unwrap();
        assert_eq!(paths(&more), ["body", "body/head", "body/arm", "body/leg", "body/tail"]);
        assert_eq!(more.without_node("body/tail").unwrap(), m);
        // A shape takes no operands: the union of both.
        let on_head = m.with_added("body/head", &tail).unwrap();
        assert_eq!(paths(&on_head), ["body", "body/union", "body/head", "body/tail", "body/arm", "body/leg"]);
        assert_eq!(on_head.without_node("body/tail").unwrap(), m, "the union gives way to what is left");
        let two = m.without_node("body/arm").unwrap();
        assert_eq!(paths(&two), ["body", "body/head", "body/leg"]);
        assert_eq!(paths(&two.without_node("body/leg").unwrap()), ["head"], "and so does the operator");
    }

    #[test]
    fn parts_are_wrapped_replaced_and_put_in_order() {
        let m = creature();
        let moved = m
            .with_wrapped("body/arm", |arm| {
                let k = crate::model::kind("translate").unwrap();
                let params = k.params.iter().map(crate::model::Param::from_spec).collect();
                Model::new(k, params, vec![arm.clone()], Payload::None)
            })
            .unwrap();
        assert_eq!(paths(&moved), ["body", "body/head", "body/translate", "body/arm", "body/leg"]);
        assert_eq!(moved.without_operator("body/translate").unwrap(), m);
        let ordered = m.with_order("body", &[2, 0, 1]).unwrap();
        assert_eq!(paths(&ordered), ["body", "body/leg", "body/head", "body/arm"]);
        let replaced = m.with_node("body/head", &parse("box(1, 1, 1)", &[]).unwrap()).unwrap();
        assert_eq!(paths(&replaced)[1], "body/box");
        assert_eq!(
            m.node("body/leg").unwrap().id(),
            replaced.node("body/leg").unwrap().id(),
            "the rest is shared"
        );
    }

    #[test]
    fn hidden_parts_keep_their_places_paths_and_parameters() {
        let m = creature();
        let hidden = m.with_hidden("body/arm", true).unwrap();
        assert_eq!(paths(&hidden), paths(&m));
        assert_eq!(hidden.parameters(), m.parameters());
        let flags: Vec<bool> = hidden.nodes().iter().map(|n| n.hidden).collect();
        assert_eq!(flags, [false, false, true, false]);
        assert_eq!(hidden.with_hidden("body/arm", true).unwrap(), hidden, "once is enough");
        assert_eq!(hidden.with_hidden("body/leg", false).unwrap(), hidden, "it is shown");
        assert_eq!(hidden.with_hidden("body/arm", false).unwrap(), m);
        let longer = hidden.with_value("body/arm/r", 0.7).unwrap();
        let shown = longer.with_hidden("body/arm", false).unwrap();
        assert_eq!(shown, m.with_value("body/arm/r", 0.7).unwrap());
        assert_eq!(paths(&hidden.without_node("body/arm").unwrap()), ["body", "body/head", "body/leg"]);
        for again in [
            crate::json::from_json(&crate::json::to_json(&hidden)).unwrap(),
            parse(&hidden.to_text().unwrap(), &[]).unwrap(),
        ] {
            assert_eq!(again, hidden);
        }
    }

    #[test]
    fn mistakes_are_named() {
        let m = creature();
        let error = |r: Result<Model, FieldError>| r.unwrap_err().to_string();
        assert!(error(m.node("body/had")).contains("body/head"));
        assert!(error(m.without_node("body")).contains("replace"));
        assert!(error(m.with_order("body", &[0, 0, 1])).contains("once"));
        assert!(error(m.without_operator("body")).contains("3 operands"));
    }
}
