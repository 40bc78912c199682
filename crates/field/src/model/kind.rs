//! What a kind of node is: one row of the table from which Python, the text syntax, the file format and menus
//! are made.

use serde::Serialize;
use serde::ser::{SerializeSeq, Serializer};

use super::{Call, Lower};
use crate::{FieldError, Node};

/// Where a kind belongs in a menu. Shapes and operators are *solids*: between two of them the sign `-` means
/// difference, not subtraction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Category {
    /// Coordinates, constants, parameters.
    Atom,
    /// Arithmetic and functions of numbers.
    Formula,
    /// Surfaces that stand alone.
    Shape,
    /// Set operations, blends, offsets.
    Operator,
    /// Operators that move or deform the space of their operand.
    Deformation,
    /// What holds a model together but is no part of its shape.
    Structure,
}

/// A parameter that every node of a kind has.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ParamSpec {
    /// Name, also the keyword in text and Python.
    pub name: &'static str,
    /// Value where none is given.
    pub default: f64,
    /// `length`, `angle` (radians), `angle/length`, `1/length`, `value` (of F), `index`, or `` (a pure number).
    pub unit: &'static str,
    /// Smallest and largest value; infinite where there is no bound (null when serialised).
    #[serde(serialize_with = "bounds")]
    pub bounds: (f64, f64),
    /// Discrete parameters are integers, visible and editable but never part of q.
    pub discrete: bool,
    /// Whether the parameter is frozen unless it is released.
    pub frozen: bool,
    /// What it means.
    pub doc: &'static str,
}

fn bounds<S: Serializer>(b: &(f64, f64), s: S) -> Result<S::Ok, S::Error> {
    let mut seq = s.serialize_seq(Some(2))?;
    for v in [b.0, b.1] {
        seq.serialize_element(&v.is_finite().then_some(v))?;
    }
    seq.end()
}

impl ParamSpec {
    /// A continuous, unbounded, free parameter.
    pub(crate) const fn new(name: &'static str, default: f64, unit: &'static str, doc: &'static str) -> Self {
        let bounds = (f64::NEG_INFINITY, f64::INFINITY);
        Self { name, default, unit, bounds, discrete: false, frozen: false, doc }
    }

    /// A length above zero.
    pub(crate) const fn length(name: &'static str, default: f64, doc: &'static str) -> Self {
        Self::new(name, default, "length", doc).within(f64::MIN_POSITIVE, f64::INFINITY)
    }

    /// The same with bounds.
    pub(crate) const fn within(self, lo: f64, hi: f64) -> Self {
        Self { bounds: (lo, hi), ..self }
    }

    /// The same as an integer outside q.
    pub(crate) const fn discrete(self) -> Self {
        Self { discrete: true, ..self }
    }

    /// The same, frozen unless it is released.
    pub(crate) const fn frozen(self) -> Self {
        Self { frozen: true, ..self }
    }
}

/// Which parameters a node has beyond those listed in [`Kind::params`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// None.
    Fixed,
    /// Any number of groups of [`Kind::group`], numbered from 0: `x0, y0, z0, r0, x1, …`.
    Groups,
    /// One coefficient for each monomial: `c`, `c_x1`, `c_x2y1`, ….
    Monomials,
    /// One, with a name of its own.
    Own,
    /// Those of its function, with names of their own: see [`super::Callback::parameters`].
    Function,
}

/// How many operands a node has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Operands {
    /// So many.
    Exactly(usize),
    /// So many or more.
    AtLeast(usize),
}

impl Operands {
    /// Whether `n` operands are right.
    pub fn accepts(self, n: usize) -> bool {
        match self {
            Operands::Exactly(k) => n == k,
            Operands::AtLeast(k) => n >= k,
        }
    }
}

impl std::fmt::Display for Operands {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Operands::Exactly(k) => write!(f, "{k} operand{}", if *k == 1 { "" } else { "s" }),
            Operands::AtLeast(k) => write!(f, "{k} or more operands"),
        }
    }
}

/// What a node carries besides numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PayloadKind {
    /// Nothing.
    None,
    /// A number that is no parameter.
    Number,
    /// The exponents of x, y and z of each monomial.
    Exponents,
    /// An expression in f and g, the values of the operands.
    Expression,
    /// A straight-line program.
    Program,
    /// A function of the caller's.
    Callback,
}

/// Builds the expression of one node.
pub(crate) type Build = fn(&mut Lower, &Call) -> Result<Node, FieldError>;

/// A row of the table of kinds.
#[derive(Clone, Copy, Serialize)]
pub struct Kind {
    /// Name: an identifier, also the function's name in text and Python.
    pub name: &'static str,
    /// Other names that text accepts.
    pub aliases: &'static [&'static str],
    /// Where it belongs in a menu.
    pub category: Category,
    /// What it is, in a sentence or two.
    pub doc: &'static str,
    /// F as a formula; p = (x, y, z), f and g the operands.
    pub formula: &'static str,
    /// The parameters that every node has, in the order of q.
    pub params: &'static [ParamSpec],
    /// The parameters that repeat.
    pub group: &'static [ParamSpec],
    /// Which parameters there are beyond `params`.
    pub layout: Layout,
    /// How many operands.
    pub operands: Operands,
    /// What a node carries besides numbers.
    pub payload: PayloadKind,
    #[serde(skip)]
    pub(crate) build: Build,
}

impl Kind {
    /// A row to fill in.
    pub(crate) const ROW: Kind = Kind {
        name: "",
        aliases: &[],
        category: Category::Formula,
        doc: "",
        formula: "",
        params: &[],
        group: &[],
        layout: Layout::Fixed,
        operands: Operands::Exactly(0),
        payload: PayloadKind::None,
        build: |lower, _| Ok(lower.graph.constant(0.0)),
    };

    /// The specification of parameter number `i` of a node.
    pub fn spec(&self, i: usize) -> Option<&'static ParamSpec> {
        match i.checked_sub(self.params.len()) {
            None => self.params.get(i),
            Some(_) if self.group.is_empty() => None,
            Some(k) => self.group.get(k % self.group.len()),
        }
    }

    /// Whether nodes of this kind are solids: shapes, operators, deformations.
    pub fn is_solid(&self) -> bool {
        matches!(self.category, Category::Shape | Category::Operator | Category::Deformation)
    }
}

impl std::fmt::Debug for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Kind({})", self.name)
    }
}

impl PartialEq for Kind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}
