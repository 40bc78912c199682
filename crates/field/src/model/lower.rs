//! From the tree to the expression graph.

use rustc_hash::FxHashMap;

use super::parameters::{ParamInfo, Places};
use super::{Leaf, MAX_AXES, Model, Payload, guarded};
use crate::graph::Expr;
use crate::{FieldError, Graph, Node};

/// Largest number of nodes of a lowered model.
pub const MAX_GRAPH: usize = 4_000_000;

/// A model as expressions.
#[derive(Clone, Debug)]
pub struct Lowered {
    /// The expressions; parameter number i of the graph is `params[i]`.
    pub graph: Graph,
    /// F, or its components where there are several.
    pub roots: Vec<Node>,
    /// Number of coordinates: 3, or 2 for curves in the plane.
    pub axes: usize,
    /// All parameters, free and frozen, in the order of HBJF02 section 3: a node's own, then its operands'.
    pub params: Vec<ParamInfo>,
    /// The opaque leaves, in the order in which they must be called.
    pub leaves: Vec<Leaf>,
}

/// The state of lowering: what the functions that build a kind's expression work on.
pub struct Lower {
    /// The graph under construction.
    pub graph: Graph,
    places: Places,
    memo: FxHashMap<(usize, [Node; 3]), Node>,
    leaves: Vec<Leaf>,
    planar: bool,
}

/// One node being lowered.
pub(crate) struct Call<'a> {
    /// The node.
    pub model: &'a Model,
    /// Its parameters.
    pub p: Vec<Node>,
    /// Its operands that are not hidden.
    operands: Vec<&'a Model>,
    /// The coordinates where it is evaluated.
    pub at: [Node; 3],
}

impl Call<'_> {
    /// The value of a discrete parameter.
    pub fn discrete(&self, i: usize) -> i64 {
        self.model.params()[i].value as i64
    }
}

impl Lower {
    /// The expression of a model at the coordinates `at`.
    pub fn model(&mut self, model: &Model, at: [Node; 3]) -> Result<Node, FieldError> {
        let key = (model.id(), at);
        if let Some(&n) = self.memo.get(&key) {
            return Ok(n);
        }
        if self.graph.len().max(self.memo.len()) > MAX_GRAPH {
            return Err(FieldError::TooLarge(format!(
                "the model needs more than {MAX_GRAPH} operations; repeat a part with `repeat` instead of \
                 copies, or divide the model"
            )));
        }
        let n = guarded(|| {
            let (model, operands) = model.shown();
            let first = self.places.first(model);
            let mut own = 0;
            let mut p = Vec::with_capacity(model.params().len());
            for (i, param) in model.params().iter().enumerate() {
                if let Some(e) = &param.expr {
                    p.push(self.model(e, at)?);
                    continue;
                }
                let discrete = model.kind().spec(i).is_some_and(|s| s.discrete);
                p.push(if discrete {
                    self.graph.constant(param.value)
                } else {
                    self.graph.param(first + own)
                });
                own += 1;
            }
            (model.kind().build)(self, &Call { model, p, operands, at })
        })?;
        self.memo.insert(key, n);
        Ok(n)
    }

    /// Operand `i` where the node itself is.
    pub(crate) fn operand(&mut self, c: &Call, i: usize) -> Result<Node, FieldError> {
        self.model(c.operands[i], c.at)
    }

    /// All operands where the node itself is.
    pub(crate) fn operands(&mut self, c: &Call) -> Result<Vec<Node>, FieldError> {
        c.operands.iter().map(|m| self.model(m, c.at)).collect()
    }

    /// The only operand, at other coordinates.
    pub(crate) fn moved(&mut self, c: &Call, at: [Node; 3]) -> Result<Node, FieldError> {
        self.model(c.operands[0], at)
    }

    /// Says that the model was made in the plane.
    pub(crate) fn make_planar(&mut self) {
        self.planar = true;
    }

    /// The output of an opaque leaf.
    pub(crate) fn leaf(&mut self, c: &Call) -> Node {
        let Payload::Callback(callback) = c.model.payload() else {
            unreachable!("checked when the node was made")
        };
        let output = self.graph.axis(MAX_AXES + self.leaves.len());
        let first = self.places.first(c.model);
        let params = first..first + c.model.params().len();
        let name = c.model.name().unwrap_or(callback.name()).to_string();
        self.leaves.push(Leaf { callback: callback.clone(), inputs: c.at.to_vec(), params, name });
        output
    }
}

impl Model {
    /// The expressions of the model. `TooLarge` where they are more than [`MAX_GRAPH`], `Invalid` where a
    /// `stack` is not the outermost node.
    pub fn lower(&self) -> Result<Lowered, FieldError> {
        let places = Places::of(self);
        let mut lower = Lower {
            graph: Graph::new(),
            places,
            memo: FxHashMap::default(),
            leaves: Vec::new(),
            planar: false,
        };
        let at = [0, 1, 2].map(|a| lower.graph.axis(a));
        let roots = if self.kind().name == "stack" {
            self.operands()
                .iter()
                .filter(|m| !m.is_hidden())
                .map(|m| lower.model(m, at))
                .collect::<Result<Vec<_>, _>>()?
        } else {
            vec![lower.model(self, at)?]
        };
        let Lower { graph, places, leaves, planar, .. } = lower;
        let axes = if planar && !reaches(&graph, &roots, &leaves, at[2]) { 2 } else { 3 };
        Ok(Lowered { graph, roots, axes, params: places.into_params(), leaves })
    }
}

/// Whether any of the roots or of the leaves' inputs depends on `target`.
fn reaches(graph: &Graph, roots: &[Node], leaves: &[Leaf], target: Node) -> bool {
    let mut reached = vec![false; graph.len()];
    let mut rest = roots.to_vec();
    let mut leaf_done = vec![false; leaves.len()];
    while let Some(n) = rest.pop() {
        if std::mem::replace(&mut reached[n.0 as usize], true) {
            continue;
        }
        match graph.exprs[n.0 as usize] {
            Expr::Op(_, operands) => rest.extend(operands),
            Expr::Input(k) if k as usize >= MAX_AXES => {
                let k = k as usize - MAX_AXES;
                if !std::mem::replace(&mut leaf_done[k], true) {
                    rest.extend(&leaves[k].inputs);
                }
            }
            _ => {}
        }
    }
    reached[target.0 as usize]
}
