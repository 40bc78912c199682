//! Random models, points and boxes that shrink.

use std::fmt;
use std::sync::Arc;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestRunner};

use super::Failure;
use super::reference::reached;
use crate::graph::Expr;
use crate::model::{Category, Kind, Layout, Operands, Param, Payload, PayloadKind, Value, kind, kinds};
use crate::{Aabb, Field, FieldError, Model, Op, vm};

/// A step of a recipe: which row of a table, which earlier results, and numbers in [0, 1).
#[derive(Clone, Debug)]
struct Step {
    row: u8,
    picks: [u8; 3],
    numbers: [u8; 8],
}

fn steps(count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Step>> {
    let step = (any::<u8>(), any::<[u8; 3]>(), any::<[u8; 8]>());
    vec(step.prop_map(|(row, picks, numbers)| Step { row, picks, numbers }), count)
}

/// One of the results so far: mostly a late one, so that trees grow deep.
fn pick(pool: &[Model], n: u8) -> Model {
    let (late, k) = (n % 4 != 3, n as usize / 4);
    let at = if late { pool.len() - 1 - k % pool.len().min(3) } else { k % pool.len() };
    pool[at].clone()
}

fn call(name: &str, operands: &[Model]) -> Result<Model, FieldError> {
    Model::call(name, operands.iter().cloned().map(Value::Model).collect(), vec![])
}

/// A formula over x, y, z, constants and three parameters, made of single operations.
#[derive(Clone)]
pub struct Expression {
    /// The formula.
    pub model: Model,
}

impl fmt::Debug for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.model.to_text().unwrap_or_else(|e| e.to_string()))
    }
}

/// The formula kinds that are one operation each: together all of [`Op::ALL`].
const SINGLE: [&str; 27] = [
    "add",
    "mul",
    "sub",
    "neg",
    "square",
    "min",
    "max",
    "abs",
    "sqrt",
    "div",
    "exp",
    "sin",
    "cos",
    "ln",
    "tan",
    "asin",
    "acos",
    "atan",
    "floor",
    "ceil",
    "round",
    "pow",
    "atan2",
    "mod",
    "less",
    "where",
    SQUARED_DIFFERENCE,
];

/// The one operation without a kind: the graph makes it of a difference that is squared.
const SQUARED_DIFFERENCE: &str = "squared difference";

/// Random formulas of up to `most` operations, among them every operation there is. Half of the operations that
/// are not defined everywhere get operands for which they are.
pub fn expressions(most: usize) -> impl Strategy<Value = Expression> {
    steps(1..most + 1)
        .prop_map(|steps| Expression { model: grow(&steps).expect("the recipe is a valid model") })
}

fn grow(steps: &[Step]) -> Result<Model, FieldError> {
    let mut pool = vec![
        Model::constant(-1.0)?,
        Model::constant(0.0)?,
        Model::constant(2.5)?,
        Model::parameter("a", 0.75)?,
        Model::parameter("b", -1.5)?,
        Model::parameter("c", 2.0)?,
        Model::axis(2),
        Model::axis(1),
        Model::axis(0),
    ];
    for s in steps {
        let name = SINGLE[s.row as usize % SINGLE.len()];
        let arity = match kind(name).map(|k| k.operands) {
            Some(Operands::Exactly(n)) => n,
            _ => 2,
        };
        let mut operands: Vec<Model> = (0..arity).map(|i| pick(&pool, s.picks[i])).collect();
        if s.numbers[0] % 2 == 0 {
            let last = arity - 1;
            match name {
                "sqrt" | "ln" | "pow" => operands[0] = positive(&operands[0])?,
                "div" | "mod" => operands[last] = positive(&operands[last])?,
                "asin" | "acos" | "exp" | "tan" => operands[0] = call("sin", &operands[..1])?,
                _ => {}
            }
            if name == "pow" {
                operands[1] = call("sin", &operands[1..])?;
            }
        }
        pool.push(match name {
            SQUARED_DIFFERENCE => call("square", &[call("sub", &operands)?])?,
            _ => call(name, &operands)?,
        });
    }
    Ok(pool.swap_remove(pool.len() - 1))
}

/// |m| + 1/4
fn positive(m: &Model) -> Result<Model, FieldError> {
    call("add", &[call("abs", std::slice::from_ref(m))?, Model::constant(0.25)?])
}

/// A tree of kinds.
#[derive(Clone)]
pub struct Tree {
    /// The tree.
    pub model: Model,
}

impl fmt::Debug for Tree {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.model.to_text().unwrap_or_else(|_| crate::json::to_json(&self.model)))
    }
}

/// Random trees of up to `most` nodes of all kinds with random parameters, without opaque functions.
pub fn trees(most: usize) -> impl Strategy<Value = Tree> {
    steps(1..most + 1).prop_map(|steps| {
        let usable: Vec<&Kind> = kinds()
            .iter()
            .filter(|k| {
                k.category != Category::Formula
                    && !matches!(k.name, "stack" | "function" | "planar" | "hidden")
            })
            .collect();
        let mut pool = vec![Model::axis(0), call("sphere", &[]).expect("a sphere has defaults")];
        for s in &steps {
            let kind = usable[s.row as usize % usable.len()];
            let operands = (0..operand_count(kind)).map(|i| pick(&pool, s.picks[i])).collect();
            let mut numbers = s.numbers.iter().map(|n| *n as f64 / 256.0).cycle();
            pool.push(node(kind, operands, &mut || numbers.next()).expect("the recipe is a valid model"));
        }
        Tree { model: pool.swap_remove(pool.len() - 1) }
    })
}

fn operand_count(kind: &Kind) -> usize {
    match kind.operands {
        Operands::Exactly(n) => n,
        Operands::AtLeast(n) => n.max(2),
    }
}

/// A node of a kind with parameters at their defaults (no numbers), or around them as the numbers in [0, 1) say.
pub fn node(
    kind: &'static Kind,
    operands: Vec<Model>,
    numbers: &mut dyn FnMut() -> Option<f64>,
) -> Result<Model, FieldError> {
    let mut params: Vec<Param> = kind.params.iter().map(Param::from_spec).collect();
    let mut payload = match kind.payload {
        PayloadKind::None => Payload::None,
        PayloadKind::Number => Payload::Number(3.0 * numbers().unwrap_or(0.5) - 1.5),
        PayloadKind::Exponents => Payload::Exponents(Arc::from([])),
        PayloadKind::Expression => {
            let (f, g) = (Model::axis(0), Model::axis(1));
            let length = call("hypot", &[f.clone(), g.clone()])?;
            let scaled = call("mul", &[Model::parameter("k", 0.5)?, length])?;
            Payload::Expression(call("sub", &[call("add", &[f, g])?, scaled])?)
        }
        PayloadKind::Program => {
            let (x, y) = (call("square", &[Model::axis(0)])?, Model::axis(1));
            Payload::Program(Arc::new(vm::Program::of(&call(
                "max",
                &[call("add", &[x, y])?, Model::axis(2)],
            )?)?))
        }
        PayloadKind::Callback => return Err(FieldError::Invalid("a function has no default".into())),
    };
    for (p, spec) in params.iter_mut().zip(kind.params) {
        if let Some(t) = numbers() {
            p.value = around(spec.default, spec.bounds, spec.discrete, t);
        }
    }
    match kind.layout {
        Layout::Fixed | Layout::Function => {}
        Layout::Own => params.push(Param::new("q", 1.5 - numbers().unwrap_or(0.0))),
        Layout::Groups => {
            let below = operands.iter().cloned().map(Value::Model);
            let mut all: Vec<Value> = below.chain(params.iter().map(|p| Value::Number(p.value))).collect();
            for i in 0..3 * kind.group.len() {
                let spec = &kind.group[i % kind.group.len()];
                let t = numbers().unwrap_or(0.19 * (i * 3 % 5) as f64);
                all.push(Value::Number(around(spec.default, spec.bounds, spec.discrete, t)));
            }
            return Model::call(kind.name, all, vec![]);
        }
        Layout::Monomials => {
            let exponents = crate::model::kinds::monomials(3);
            params = exponents
                .iter()
                .enumerate()
                .map(|(i, e)| {
                    let value = numbers().map_or(0.1 * i as f64, |t| 2.0 * t - 1.0);
                    Param::new(crate::model::kinds::coefficient_name(*e), value)
                })
                .collect();
            payload = Payload::Exponents(exponents.into());
        }
    }
    Model::new(kind, params, operands, payload)
}

/// A value within the bounds: half of the default to one and a half of it, moved by up to a half.
fn around(default: f64, (lo, hi): (f64, f64), discrete: bool, t: f64) -> f64 {
    if discrete {
        // The ends of −1 … 1 are the values of a sign; 0 is none.
        if (lo, hi) == (-1.0, 1.0) {
            return if t < 0.5 { -1.0 } else { 1.0 };
        }
        return (lo + (t * 3.0).floor()).min(hi);
    }
    let moved = if lo >= 0.0 { 0.1 * t } else { t - 0.5 };
    (default * (0.5 + t) + moved).clamp(lo.max(-1e6), hi.min(1e6))
}

/// A node of every kind but functions, stacks and what is hidden: at its defaults, and once for each list of numbers.
pub fn each_kind(numbers: &[Vec<f64>]) -> Vec<Model> {
    let solid = |i: usize| ["sphere", "torus", "box"][i % 3];
    let mut all = Vec::new();
    for k in kinds().iter().filter(|k| !matches!(k.name, "stack" | "function" | "hidden")) {
        let operand = |i: usize| match k.category {
            Category::Formula => Model::axis(i % 3),
            _ => call(solid(i), &[]).expect("shapes have defaults"),
        };
        let operands: Vec<Model> = (0..operand_count(k)).map(operand).collect();
        let build = |numbers: &mut dyn FnMut() -> Option<f64>| {
            node(k, operands.clone(), numbers).unwrap_or_else(|e| panic!("{}: {e}", k.name))
        };
        all.push(build(&mut || None));
        for list in numbers {
            let mut list = list.iter().copied().cycle();
            all.push(build(&mut || list.next()));
        }
    }
    all
}

/// How often each operation of [`Op::ALL`] is carried out for the first component of a field.
pub fn operations(field: &Field) -> Result<[usize; Op::ALL.len()], FieldError> {
    let lowered = field.model().lower()?;
    let mut count = [0; Op::ALL.len()];
    for i in reached(&lowered, lowered.roots[0]) {
        if let Expr::Op(op, _) = lowered.graph.exprs[i] {
            count[op as usize] += 1;
        }
    }
    Ok(count)
}

/// A coordinate: mostly of order 1, sometimes where shapes have kinks, sometimes huge or tiny.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        12 => -2.5..2.5,
        3 => prop_oneof![Just(0.0), Just(1.0), Just(-1.0), Just(0.5), Just(-0.5), Just(0.25), Just(2.0)],
        1 => (-12i32..12, -1.0..1.0).prop_map(|(e, m)| m * 10f64.powi(e)),
    ]
}

/// Random points.
pub fn points(count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<[f64; 3]>> {
    vec([coordinate(), coordinate(), coordinate()], count)
}

/// A box by its centre.
#[derive(Clone, Debug)]
pub struct BoxAt {
    /// The centre.
    pub centre: [f64; 3],
    /// Half the side along each axis; 0 for none.
    pub half: [f64; 3],
}

impl BoxAt {
    /// The box.
    pub fn aabb(&self) -> Aabb {
        let side = |s: f64| std::array::from_fn(|a| self.centre[a] + s * self.half[a]);
        Aabb::new(side(-1.0), side(1.0))
    }
}

/// Random boxes: of ordinary size, huge, tiny, without extent, and unbounded.
pub fn boxes() -> impl Strategy<Value = BoxAt> {
    let half = || {
        prop_oneof![
            8 => 0.0..1.5,
            2 => (-18i32..0).prop_map(|e| 10f64.powi(e)),
            2 => Just(0.0),
            1 => (0i32..300).prop_map(|e| 10f64.powi(e)),
            1 => Just(f64::INFINITY),
        ]
    };
    let parts = ([coordinate(), coordinate(), coordinate()], [half(), half(), half()]);
    parts.prop_map(|(centre, half)| BoxAt { centre, half })
}

/// `n` points of the cube of half-side `half`, the same for the same `seed`.
pub fn scattered(n: usize, half: f64, seed: u64) -> Vec<[f64; 3]> {
    // SplitMix64.
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..n).map(|_| std::array::from_fn(|_| half * (2.0 * next() - 1.0))).collect()
}

/// Runs a check on `cases` random inputs, the same in every run for the same `seed`, and panics with the smallest
/// input that fails. The environment's `PROPTEST_CASES` and `PROPTEST_RNG_SEED` explore further.
pub fn run<S: Strategy>(
    cases: u32,
    seed: u64,
    strategy: S,
    check: impl FnMut(S::Value) -> Result<(), Failure>,
) {
    let is_set = |name| std::env::var_os(name).is_some();
    let asked = Config::default();
    let config = Config {
        cases: if is_set("PROPTEST_CASES") { asked.cases } else { cases },
        rng_seed: if is_set("PROPTEST_RNG_SEED") { asked.rng_seed } else { RngSeed::Fixed(seed) },
        failure_persistence: None,
        ..asked
    };
    let check = std::cell::RefCell::new(check);
    let one = |input| (check.borrow_mut())(input).map_err(TestCaseError::from);
    if let Err(e) = TestRunner::new(config).run(&strategy, one) {
        panic!("{e}");
    }
}
