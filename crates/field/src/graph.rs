//! The expression graph: what a model is lowered to. Nodes are deduplicated and constants folded as they are
//! made, so that building twice costs nothing and what does not depend on the coordinates is found once.

use rustc_hash::FxHashMap;

use crate::op::{Op, apply};

/// Most coordinates that a field may have. Inputs from this number on are the outputs of opaque leaves.
pub const MAX_AXES: usize = 8;

/// A node of a [`Graph`]. Operands always have smaller numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Node(pub(crate) u32);

/// What a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Expr {
    /// A constant, by its bits.
    Const(u64),
    /// A coordinate (0 = x, …), or beyond the coordinates the output of an opaque leaf.
    Input(u32),
    /// A parameter, by its number in the model's list.
    Param(u32),
    /// An operation; unused operands repeat the first.
    Op(Op, [Node; 3]),
}

/// An arena of expressions.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    pub(crate) exprs: Vec<Expr>,
    known: FxHashMap<Expr, Node>,
}

impl Graph {
    /// An empty graph.
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.exprs.len()
    }

    /// Whether there is no node yet.
    pub fn is_empty(&self) -> bool {
        self.exprs.is_empty()
    }

    fn intern(&mut self, e: Expr) -> Node {
        let next = Node(self.exprs.len() as u32);
        let exprs = &mut self.exprs;
        *self.known.entry(e).or_insert_with(|| {
            exprs.push(e);
            next
        })
    }

    /// A constant (−0 becomes 0).
    pub fn constant(&mut self, v: f64) -> Node {
        self.intern(Expr::Const((v + 0.0).to_bits()))
    }

    /// Coordinate number `axis`: 0 = x, 1 = y, 2 = z.
    pub fn axis(&mut self, axis: usize) -> Node {
        self.intern(Expr::Input(axis as u32))
    }

    /// Parameter number `index`.
    pub fn param(&mut self, index: usize) -> Node {
        self.intern(Expr::Param(index as u32))
    }

    /// The value of a node that is a constant.
    pub fn as_constant(&self, n: Node) -> Option<f64> {
        match self.exprs[n.0 as usize] {
            Expr::Const(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// A unary operation.
    pub fn unary(&mut self, op: Op, a: Node) -> Node {
        debug_assert_eq!(op.arity(), 1);
        if let Some(v) = self.as_constant(a) {
            return self.constant(apply(op, v, v, v));
        }
        if let Expr::Op(inner, [x, y, _]) = self.exprs[a.0 as usize] {
            match (op, inner) {
                (Op::Square, Op::Sub) => return self.binary(Op::SquaredDifference, x, y),
                (Op::Neg, Op::Neg) => return x,
                (Op::Abs, Op::Abs | Op::Square | Op::SquaredDifference | Op::Exp | Op::Sqrt) => return a,
                (Op::Abs | Op::Square, Op::Neg) => return self.unary(op, x),
                (Op::Square, Op::Abs) => return self.unary(op, x),
                _ => {}
            }
        }
        self.intern(Expr::Op(op, [a; 3]))
    }

    /// A binary operation.
    pub fn binary(&mut self, op: Op, a: Node, b: Node) -> Node {
        debug_assert_eq!(op.arity(), 2);
        let (ca, cb) = (self.as_constant(a), self.as_constant(b));
        if let (Some(x), Some(y)) = (ca, cb) {
            return self.constant(apply(op, x, y, y));
        }
        match (op, ca, cb) {
            (Op::Add, Some(0.0), _) | (Op::Mul, Some(1.0), _) => return b,
            (Op::Add | Op::Sub, _, Some(0.0)) | (Op::Mul | Op::Div | Op::Pow, _, Some(1.0)) => return a,
            (Op::Sub, Some(0.0), _) | (Op::Mul, Some(-1.0), _) => return self.unary(Op::Neg, b),
            (Op::Mul | Op::Div, _, Some(-1.0)) => return self.unary(Op::Neg, a),
            (Op::Mul | Op::Div, Some(0.0), _) | (Op::Mul, _, Some(0.0)) => return self.constant(0.0),
            (Op::SquaredDifference, Some(0.0), _) => return self.unary(Op::Square, b),
            (Op::SquaredDifference, _, Some(0.0)) => return self.unary(Op::Square, a),
            (Op::Pow, _, Some(0.0)) => return self.constant(1.0),
            (Op::Pow, _, Some(0.5)) => return self.unary(Op::Sqrt, a),
            (Op::Pow, _, Some(n)) if n.fract() == 0.0 && n.abs() <= 64.0 => {
                return self.integer_power(a, n as i32);
            }
            _ => {}
        }
        if a == b {
            match op {
                Op::Add => {
                    let two = self.constant(2.0);
                    return self.binary(Op::Mul, two, a);
                }
                Op::Mul => return self.unary(Op::Square, a),
                Op::Min | Op::Max => return a,
                Op::Sub | Op::SquaredDifference | Op::Less => return self.constant(0.0),
                Op::Div => return self.constant(1.0),
                _ => {}
            }
        }
        let (a, b) = if op.commutes() && b < a { (b, a) } else { (a, b) };
        self.intern(Expr::Op(op, [a, b, a]))
    }

    /// aⁿ by repeated squaring.
    fn integer_power(&mut self, a: Node, n: i32) -> Node {
        let (mut square, mut rest, mut result) = (a, n.unsigned_abs(), None);
        while rest > 0 {
            if rest & 1 == 1 {
                result = Some(match result {
                    None => square,
                    Some(r) => self.mul(r, square),
                });
            }
            rest >>= 1;
            if rest > 0 {
                square = self.unary(Op::Square, square);
            }
        }
        let one = self.constant(1.0);
        match result {
            None => one,
            Some(r) if n < 0 => self.div(one, r),
            Some(r) => r,
        }
    }

    /// `c` where a < b, else `d`.
    pub fn select(&mut self, a: Node, b: Node, c: Node, d: Node) -> Node {
        let mask = self.binary(Op::Less, a, b);
        if c == d {
            return c;
        }
        match self.as_constant(mask) {
            Some(m) => {
                if m != 0.0 {
                    c
                } else {
                    d
                }
            }
            None => self.intern(Expr::Op(Op::Choose, [mask, c, d])),
        }
    }
}

macro_rules! unary {
    ($($(#[$doc:meta])* $name:ident = $op:ident;)*) => { impl Graph { $(
        $(#[$doc])* pub fn $name(&mut self, a: Node) -> Node { self.unary(Op::$op, a) }
    )* } };
}
macro_rules! binary {
    ($($(#[$doc:meta])* $name:ident = $op:ident;)*) => { impl Graph { $(
        $(#[$doc])* pub fn $name(&mut self, a: Node, b: Node) -> Node { self.binary(Op::$op, a, b) }
    )* } };
}
unary! {
    /// −a
    neg = Neg;
    /// |a|
    abs = Abs;
    /// √a
    sqrt = Sqrt;
    /// a²
    square = Square;
    /// eᵃ
    exp = Exp;
    /// ln a
    ln = Ln;
    /// sin a
    sin = Sin;
    /// cos a
    cos = Cos;
    /// tan a
    tan = Tan;
    /// asin a
    asin = Asin;
    /// acos a
    acos = Acos;
    /// atan a
    atan = Atan;
    /// ⌊a⌋
    floor = Floor;
    /// ⌈a⌉
    ceil = Ceil;
    /// Nearest integer.
    round = Round;
}
binary! {
    /// a + b
    add = Add;
    /// a − b
    sub = Sub;
    /// a · b
    mul = Mul;
    /// a / b
    div = Div;
    /// min(a, b)
    min = Min;
    /// max(a, b)
    max = Max;
    /// aᵇ
    pow = Pow;
    /// Angle of (b, a).
    atan2 = Atan2;
    /// a − b ⌊a/b⌋
    modulo = Mod;
    /// 1 where a < b, else 0.
    less = Less;
}

impl Graph {
    /// The sum of the terms, added in pairs (0 for none).
    pub fn sum(&mut self, terms: &[Node]) -> Node {
        match terms {
            [] => self.constant(0.0),
            [a] => *a,
            _ => {
                let (l, r) = terms.split_at(terms.len().div_ceil(2));
                let (l, r) = (self.sum(l), self.sum(r));
                self.add(l, r)
            }
        }
    }

    /// a·b for vectors of equal length.
    pub fn dot(&mut self, a: &[Node], b: &[Node]) -> Node {
        let terms: Vec<Node> = a.iter().zip(b).map(|(&a, &b)| self.mul(a, b)).collect();
        self.sum(&terms)
    }

    /// |a|, with derivative 0 at a = 0.
    pub fn length(&mut self, a: &[Node]) -> Node {
        let d = self.dot(a, a);
        self.sqrt(d)
    }

    /// The smallest of the terms, folded in pairs. Panics if there are none.
    pub fn min_all(&mut self, terms: &[Node]) -> Node {
        self.fold_pairs(Op::Min, terms)
    }

    /// The largest of the terms, folded in pairs. Panics if there are none.
    pub fn max_all(&mut self, terms: &[Node]) -> Node {
        self.fold_pairs(Op::Max, terms)
    }

    fn fold_pairs(&mut self, op: Op, terms: &[Node]) -> Node {
        if let [a] = terms {
            return *a;
        }
        let (l, r) = terms.split_at(terms.len().div_ceil(2));
        let (l, r) = (self.fold_pairs(op, l), self.fold_pairs(op, r));
        self.binary(op, l, r)
    }
}
