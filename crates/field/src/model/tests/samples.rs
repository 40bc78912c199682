//! Models to test with: one of every kind, random trees, and the plainest possible evaluator.

use std::sync::Arc;

use crate::graph::Expr;
use crate::model::kinds::{coefficient_name, monomials};
use crate::model::{
    Callback, Category, Kind, Layout, Lowered, MAX_AXES, Model, Operands, Param, Payload, PayloadKind, Value,
    kinds,
};
use crate::op::{apply, is_flat, pull};
use crate::{FieldError, Node};

/// F and ∂F/∂x of the first component at a point, node by node.
pub fn at(lowered: &Lowered, p: [f64; 3]) -> (f64, [f64; 3]) {
    let g = &lowered.graph;
    let root = lowered.roots[0];
    let mut v = vec![0.0; g.len()];
    for i in 0..g.len() {
        v[i] = match g.exprs[i] {
            Expr::Const(bits) => f64::from_bits(bits),
            Expr::Param(k) => lowered.params[k as usize].value,
            Expr::Input(k) if (k as usize) < MAX_AXES => p[k as usize],
            Expr::Input(k) => {
                let leaf = &lowered.leaves[k as usize - MAX_AXES];
                let inputs = [0, 1, 2].map(|a| v[leaf.inputs[a].0 as usize]);
                let mut out = [0.0];
                let q: Vec<f64> = lowered.params[leaf.params.clone()].iter().map(|p| p.value).collect();
                leaf.callback.value(&[inputs], &q, &mut out).unwrap();
                out[0]
            }
            Expr::Op(op, [a, b, c]) => apply(op, v[a.0 as usize], v[b.0 as usize], v[c.0 as usize]),
        };
    }
    let mut adjoint = vec![0.0; g.len()];
    adjoint[root.0 as usize] = 1.0;
    let mut gradient = [0.0; 3];
    for i in (0..g.len()).rev() {
        match g.exprs[i] {
            Expr::Op(op, operands) if adjoint[i] != 0.0 => {
                let [a, b, _] = operands.map(|n: Node| v[n.0 as usize]);
                for k in (0..op.arity()).filter(|k| !is_flat(op, *k)) {
                    adjoint[operands[k].0 as usize] += pull(op, k, adjoint[i], a, b, v[i]);
                }
            }
            Expr::Input(k) if k < 3 => gradient[k as usize] = adjoint[i],
            _ => {}
        }
    }
    (v[root.0 as usize], gradient)
}

/// F at a point.
pub fn value(m: &Model, p: [f64; 3]) -> f64 {
    at(&m.lower().unwrap(), p).0
}

/// A formula or shapes without parameters of their own names.
pub fn model(text: &str) -> Model {
    crate::text::parse(text, &[]).unwrap_or_else(|e| panic!("{text}: {e}"))
}

/// F = s (|p|² − r²) with r = s = 1, as a function known by values only.
pub struct Ball;

impl Callback for Ball {
    fn name(&self) -> &str {
        "ball"
    }

    fn parameters(&self) -> Vec<Param> {
        vec![Param::new("r", 1.0), Param::new("s", 1.0)]
    }

    fn value(&self, points: &[[f64; 3]], q: &[f64], value: &mut [f64]) -> Result<(), FieldError> {
        for (p, v) in points.iter().zip(value) {
            *v = q[1] * (p.iter().map(|c| c * c).sum::<f64>() - q[0] * q[0]);
        }
        Ok(())
    }
}

/// A node of every kind at its defaults, with spheres and boxes as operands of operators, and coordinates as
/// those of formulas.
pub fn one_of_each() -> Vec<Model> {
    let solid = |i: usize| model(["sphere(0.7)", "translate(box(1, 1.2, 1.4), 0.3)", "torus()"][i % 3]);
    let formula = |i: usize| model(["0.3 + 0.2*x", "0.4 + 0.1*y", "1 + 0.3*z"][i % 3]);
    let mut all = Vec::new();
    for k in kinds() {
        let n = match k.operands {
            Operands::Exactly(n) => n,
            Operands::AtLeast(n) => n.max(3),
        };
        let operand = |i| if k.category == Category::Formula { formula(i) } else { solid(i) };
        let mut operands: Vec<Model> = (0..n).map(operand).collect();
        let mut params: Vec<Param> = k.params.iter().map(Param::from_spec).collect();
        let payload = match k.payload {
            PayloadKind::None => Payload::None,
            PayloadKind::Number => Payload::Number(-2.5),
            PayloadKind::Exponents => Payload::Exponents(monomials(3).into()),
            PayloadKind::Expression => {
                let options = crate::text::Options { blend: true, ..Default::default() };
                let h = crate::text::parse_with("f + g - k*sqrt(f^2 + g^2)", &[("k", 0.5)], options);
                Payload::Expression(h.unwrap())
            }
            PayloadKind::Program => {
                Payload::Program(crate::vm::Program::of(&model("x^2 + y - 1")).unwrap().into())
            }
            PayloadKind::Callback => Payload::Callback(Arc::new(Ball)),
        };
        if k.name == "acosh" {
            let above_one = vec![Value::Model(operands[0].clone()), Value::Number(3.0)];
            operands[0] = Model::call("add", above_one, vec![]).unwrap();
        }
        match k.layout {
            Layout::Fixed => {}
            Layout::Function => params = Ball.parameters(),
            Layout::Own => params.push(Param::new("q", 1.5)),
            Layout::Groups => {
                let below = operands.iter().cloned().map(Value::Model);
                let numbers = params.iter().map(|p| Value::Number(p.value));
                let groups = (0..2 * k.group.len()).map(|i| Value::Number(0.1 + 0.13 * i as f64));
                let all = below.chain(numbers).chain(groups).collect();
                params = Model::call(k.name, all, vec![]).unwrap().params().to_vec();
            }
            Layout::Monomials => {
                let named = |(i, e): (usize, &[u8; 3])| Param::new(coefficient_name(*e), 0.1 * i as f64);
                params = monomials(3).iter().enumerate().map(named).collect();
            }
        }
        all.push(Model::new(k, params, operands, payload).unwrap_or_else(|e| panic!("{}: {e}", k.name)));
    }
    all
}

/// A random tree, grown from bytes so that a failing one shrinks. Parts occur several times, and have names.
pub fn grown(bytes: &[u8]) -> Model {
    let mut source = bytes.iter().copied().chain(std::iter::repeat(0));
    let mut pool = Vec::new();
    grow(&mut source, 6, &mut pool)
}

fn grow(source: &mut dyn Iterator<Item = u8>, depth: usize, pool: &mut Vec<Model>) -> Model {
    let mut next = || source.next().unwrap_or(0) as usize;
    let choice = next();
    if choice >= 200 && !pool.is_empty() {
        return pool[choice % pool.len()].clone();
    }
    let usable: Vec<&Kind> = kinds()
        .iter()
        .filter(|k| {
            matches!(k.payload, PayloadKind::None)
                && !matches!(k.name, "stack" | "parameter" | "x" | "y" | "z" | "hidden")
        })
        .filter(|k| depth > 0 || k.operands == Operands::Exactly(0))
        .collect();
    let pick = next();
    let numbers: Vec<f64> = (0..5).map(|_| 0.25 * (1 + next() % 16) as f64).collect();
    let name = next();
    if depth == 0 && choice % 2 == 0 || choice == 0 {
        return match pick % 5 {
            0 => Model::constant(numbers[0] - 2.0).unwrap(),
            1 => pool.iter().find(|m| m.kind().name == "parameter").cloned().unwrap_or_else(|| {
                let m = Model::parameter("q", numbers[0]).unwrap();
                pool.push(m.clone());
                m
            }),
            a => Model::axis(a - 2),
        };
    }
    let k = usable[pick % usable.len()];
    let count = match k.operands {
        Operands::Exactly(n) => n,
        Operands::AtLeast(n) => n + choice % 3,
    };
    let operands: Vec<Model> = (0..count).map(|_| grow(source, depth - 1, pool)).collect();
    let mut params: Vec<Param> = k.params.iter().map(Param::from_spec).collect();
    for (p, v) in params.iter_mut().zip(&numbers) {
        let discrete = k.params.iter().any(|s| s.name == &*p.name && s.discrete);
        if !discrete && depth > 0 && choice % 7 == 3 {
            p.expr = Some(grow(source, 0, pool)).filter(|e| e.as_constant().is_none());
        }
        if !discrete && p.bounds.0 <= *v && *v <= p.bounds.1 {
            p.value = *v;
        }
    }
    if k.layout == Layout::Groups {
        let below = operands.iter().cloned().map(Value::Model);
        let all: Vec<Value> = below.chain(params.iter().map(|p| Value::Number(p.value))).collect();
        let group = numbers.iter().chain(&numbers).take(k.group.len()).map(|v| Value::Number(*v));
        params =
            Model::call(k.name, all.into_iter().chain(group).collect(), vec![]).unwrap().params().to_vec();
    }
    let plain = params.iter().map(|p| Param { expr: None, ..p.clone() }).collect();
    let mut m = Model::new(k, params, operands.clone(), Payload::None)
        .unwrap_or_else(|_| Model::new(k, plain, operands, Payload::None).unwrap());
    if name % 5 == 1 {
        m = m.named(&format!("part{}", pool.len())).unwrap();
    }
    pool.push(m.clone());
    m
}

/// The same random cases in every run; `PROPTEST_CASES` and `PROPTEST_RNG_SEED` explore further.
pub fn cases(cases: u32, seed: u64) -> proptest::test_runner::Config {
    use proptest::test_runner::{Config, RngSeed};
    let mut config = Config { failure_persistence: None, ..Config::default() };
    if std::env::var_os("PROPTEST_CASES").is_none() {
        config.cases = cases;
    }
    if std::env::var_os("PROPTEST_RNG_SEED").is_none() {
        config.rng_seed = RngSeed::Fixed(seed);
    }
    config
}
