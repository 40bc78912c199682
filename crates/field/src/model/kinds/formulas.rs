//! Arithmetic and functions of numbers.

use crate::graph::Expr;
use crate::model::kind::{Category, Kind, Operands};
use crate::model::{Call, Lower};
use crate::{FieldError, Graph, Node, Op};

const FORMULA: Kind = Kind { category: Category::Formula, ..Kind::ROW };

/// A row for a function of one, two or three operands.
macro_rules! function {
    ($name:literal $aliases:expr, $formula:literal, $doc:literal, |$g:ident, $a:ident| $body:expr) => {
        function!(@row $name $aliases, $formula, $doc, 1, |l: &mut Lower, c: &Call| {
            let $a = l.operand(c, 0)?;
            let $g = &mut l.graph;
            Ok($body)
        })
    };
    ($name:literal $aliases:expr, $formula:literal, $doc:literal, |$g:ident, $a:ident, $b:ident| $body:expr) => {
        function!(@row $name $aliases, $formula, $doc, 2, |l: &mut Lower, c: &Call| {
            let ($a, $b) = (l.operand(c, 0)?, l.operand(c, 1)?);
            let $g = &mut l.graph;
            Ok($body)
        })
    };
    ($name:literal $aliases:expr, $formula:literal, $doc:literal,
     |$g:ident, $a:ident, $b:ident, $d:ident| $body:expr) => {
        function!(@row $name $aliases, $formula, $doc, 3, |l: &mut Lower, c: &Call| {
            let ($a, $b, $d) = (l.operand(c, 0)?, l.operand(c, 1)?, l.operand(c, 2)?);
            let $g = &mut l.graph;
            Ok($body)
        })
    };
    (@row $name:literal $aliases:expr, $formula:literal, $doc:literal, $n:literal, $build:expr) => {
        Kind {
            name: $name,
            aliases: &$aliases,
            doc: $doc,
            formula: $formula,
            operands: Operands::Exactly($n),
            build: $build,
            ..FORMULA
        }
    };
}

/// A row for a function of any number of operands.
const fn many(
    name: &'static str,
    formula: &'static str,
    doc: &'static str,
    build: fn(&mut Lower, &Call) -> Result<Node, FieldError>,
) -> Kind {
    Kind { name, formula, doc, operands: Operands::AtLeast(1), build, ..FORMULA }
}

pub const KINDS: &[Kind] = &[
    many("add", "f + g + …", "The sum.", |l, c| {
        let terms = l.operands(c)?;
        Ok(l.graph.sum(&terms))
    }),
    function!("sub"["minus"], "f − g", "The difference of two numbers.", |g, a, b| g.sub(a, b)),
    many("mul", "f · g · …", "The product.", |l, c| {
        let terms = l.operands(c)?;
        Ok(terms[1..].iter().fold(terms[0], |a, &b| l.graph.mul(a, b)))
    }),
    function!("div" [], "f / g", "The quotient.", |g, a, b| g.div(a, b)),
    function!("neg" [], "−f", "The negative.", |g, a| g.neg(a)),
    function!("pow" [], "f^g", "A power; a negative base only with a whole exponent.", |g, a, b| g.pow(a, b)),
    function!("mod" [], "f − g ⌊f/g⌋", "The remainder, with the sign of g.", |g, a, b| g.modulo(a, b)),
    many("min", "min(f, g, …)", "The smallest.", |l, c| {
        let terms = l.operands(c)?;
        Ok(l.graph.min_all(&terms))
    }),
    many("max", "max(f, g, …)", "The largest.", |l, c| {
        let terms = l.operands(c)?;
        Ok(l.graph.max_all(&terms))
    }),
    many("hypot", "√(f² + g² + …)", "The length of a vector; derivative 0 at 0.", |l, c| {
        let terms = l.operands(c)?;
        Ok(l.graph.length(&terms))
    }),
    function!("abs" [], "|f|", "The absolute value; derivative 0 at 0.", |g, a| g.abs(a)),
    function!("sqrt" [], "√f", "The square root; derivative 0 at 0.", |g, a| g.sqrt(a)),
    function!("square" [], "f²", "The square.", |g, a| g.square(a)),
    function!("cbrt" [], "∛f", "The cube root, also of negative numbers, for |f| < 1e150.", |g, a| cbrt(g, a)),
    function!("exp" [], "e^f", "The exponential function.", |g, a| g.exp(a)),
    function!("exp2" [], "2^f", "A power of two.", |g, a| {
        let k = g.constant(std::f64::consts::LN_2);
        let e = g.mul(k, a);
        g.exp(e)
    }),
    function!("ln"["log"], "ln f", "The natural logarithm.", |g, a| g.ln(a)),
    function!("log2" [], "ln f / ln 2", "The logarithm to base 2.", |g, a| {
        let (l, k) = (g.ln(a), g.constant(std::f64::consts::LOG2_E));
        g.mul(l, k)
    }),
    function!("log10" [], "ln f / ln 10", "The logarithm to base 10.", |g, a| {
        let (l, k) = (g.ln(a), g.constant(std::f64::consts::LOG10_E));
        g.mul(l, k)
    }),
    function!("sin" [], "sin f", "Sine.", |g, a| g.sin(a)),
    function!("cos" [], "cos f", "Cosine.", |g, a| g.cos(a)),
    function!("tan" [], "tan f", "Tangent.", |g, a| g.tan(a)),
    function!("asin" [], "asin f", "Arc sine.", |g, a| g.asin(a)),
    function!("acos" [], "acos f", "Arc cosine.", |g, a| g.acos(a)),
    function!("atan" [], "atan f", "Arc tangent.", |g, a| g.atan(a)),
    function!("atan2" [], "atan2(f, g)", "The angle of the point (g, f).", |g, a, b| g.atan2(a, b)),
    function!("sinh" [], "(e^f − e^−f)/2", "Hyperbolic sine.", |g, a| {
        let (up, down) = exponentials(g, a);
        let d = g.sub(up, down);
        half(g, d)
    }),
    function!("cosh" [], "(e^f + e^−f)/2", "Hyperbolic cosine.", |g, a| {
        let (up, down) = exponentials(g, a);
        let s = g.add(up, down);
        half(g, s)
    }),
    function!("tanh" [], "1 − 2/(e^2f + 1)", "Hyperbolic tangent.", |g, a| {
        let (one, two) = (g.constant(1.0), g.constant(2.0));
        let twice = g.mul(two, a);
        let e = g.exp(twice);
        let below = g.add(e, one);
        let part = g.div(two, below);
        g.sub(one, part)
    }),
    function!("asinh" [], "ln(f + √(f² + 1))", "Inverse hyperbolic sine.", |g, a| {
        let (zero, one, squared) = (g.constant(0.0), g.constant(1.0), g.square(a));
        let sum = g.add(squared, one);
        let root = g.sqrt(sum);
        // Of negative numbers the sum would lose digits.
        let (up, down) = (g.add(root, a), g.sub(root, a));
        let (up, down) = (g.ln(up), g.ln(down));
        let minus = g.neg(down);
        g.select(a, zero, minus, up)
    }),
    function!("acosh" [], "ln(f + √(f² − 1))", "Inverse hyperbolic cosine, for f ≥ 1.", |g, a| {
        let (one, squared) = (g.constant(1.0), g.square(a));
        let rest = g.sub(squared, one);
        let root = g.sqrt(rest);
        let sum = g.add(a, root);
        g.ln(sum)
    }),
    function!("atanh" [], "ln((1 + f)/(1 − f))/2", "Inverse hyperbolic tangent, for |f| < 1.", |g, a| {
        let one = g.constant(1.0);
        let (up, down) = (g.add(one, a), g.sub(one, a));
        let part = g.div(up, down);
        let l = g.ln(part);
        half(g, l)
    }),
    function!("trunc" [], "f without its fraction", "The nearest whole number towards 0; derivative 0.", |g, a| {
        let (zero, up, down) = (g.constant(0.0), g.ceil(a), g.floor(a));
        g.select(a, zero, up, down)
    }),
    function!("floor" [], "⌊f⌋", "The largest whole number not above; derivative 0.", |g, a| g.floor(a)),
    function!("ceil" [], "⌈f⌉", "The smallest whole number not below; derivative 0.", |g, a| g.ceil(a)),
    function!("round" [], "round f", "The nearest whole number, halves away from 0; derivative 0.",
        |g, a| g.round(a)),
    function!("sign" [], "sgn f", "−1, 0 or 1; derivative 0.", |g, a| {
        let (zero, one, minus) = (g.constant(0.0), g.constant(1.0), g.constant(-1.0));
        let rest = g.select(a, zero, minus, zero);
        g.select(zero, a, one, rest)
    }),
    function!("less" [], "f < g", "1 where f < g, else 0; derivative 0.", |g, a, b| g.less(a, b)),
    function!(
        "where"["select"],
        "g where f ≠ 0, else h",
        "One of two values; `where(x < 1, f, g)`. The surface may tear where the condition changes.",
        |g, mask, a, b| choose(g, mask, a, b)
    ),
    function!("step" [], "1 where g ≥ f, else 0", "A step at f; derivative 0.", |g, edge, a| {
        let (zero, one) = (g.constant(0.0), g.constant(1.0));
        g.select(a, edge, zero, one)
    }),
    function!("smoothstep" [], "t²(3 − 2t), t = clamp((h − f)/(g − f), 0, 1)",
    "A smooth step of h from f to g.", |g, lo, hi, a| {
        let (above, width) = (g.sub(a, lo), g.sub(hi, lo));
        let t = g.div(above, width);
        let (zero, one) = (g.constant(0.0), g.constant(1.0));
        let t = clamp(g, t, zero, one);
        let (two, three) = (g.constant(2.0), g.constant(3.0));
        let (twice, squared) = (g.mul(two, t), g.square(t));
        let rest = g.sub(three, twice);
        g.mul(squared, rest)
    }),
    function!("lerp"["mix"], "f + h (g − f)", "From f at h = 0 to g at h = 1.", |g, a, b, t| {
        let d = g.sub(b, a);
        let part = g.mul(t, d);
        g.add(a, part)
    }),
    function!("clamp" [], "min(max(f, g), h)", "f between g and h.", |g, a, lo, hi| clamp(g, a, lo, hi)),
];

/// min(max(a, lo), hi)
pub fn clamp(g: &mut Graph, a: Node, lo: Node, hi: Node) -> Node {
    let a = g.max(a, lo);
    g.min(a, hi)
}

fn half(g: &mut Graph, a: Node) -> Node {
    let h = g.constant(0.5);
    g.mul(h, a)
}

fn exponentials(g: &mut Graph, a: Node) -> (Node, Node) {
    let n = g.neg(a);
    (g.exp(a), g.exp(n))
}

/// `a` where mask ≠ 0, else `b`.
fn choose(g: &mut Graph, mask: Node, a: Node, b: Node) -> Node {
    if let Expr::Op(Op::Less, [lo, hi, _]) = g.exprs[mask.0 as usize] {
        return g.select(lo, hi, a, b);
    }
    let (size, zero) = (g.abs(mask), g.constant(0.0));
    g.select(zero, size, a, b)
}

/// a (a² + 10⁻³⁰⁰)^(−1/3): the cube root with a derivative that is finite at 0.
fn cbrt(g: &mut Graph, a: Node) -> Node {
    let (tiny, power) = (g.constant(1e-300), g.constant(-1.0 / 3.0));
    let squared = g.square(a);
    let size = g.add(squared, tiny);
    let root = g.binary(Op::Pow, size, power);
    g.mul(a, root)
}
