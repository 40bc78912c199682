//! Intervals contain what points inside evaluate to: function by function, and for whole fields with gradients and
//! Hessians, over ordinary, huge, tiny, degenerate and unbounded boxes.

use isoswarm_field::testkit::{
    BoxAt, boxes, each_kind, expressions, intervals_contain, points, run, scattered, trees,
};
use isoswarm_field::{Field, FieldError, Interval, Scalar, math, text};

fn field(text: &str) -> Field {
    Field::new(&text::parse(text, &[]).unwrap_or_else(|e| panic!("{text}: {e}"))).unwrap()
}

fn range(text: &str, lo: [f64; 3], hi: [f64; 3]) -> Interval {
    let field = field(text);
    let d = field.axes();
    field.interval(&lo[..d], &hi[..d]).unwrap()[0]
}

#[test]
fn random_formulas() {
    let mut count = 0;
    run(1500, 11, (expressions(14), boxes(), points(1..24)), |(e, at, inside)| {
        count += intervals_contain(&Field::new(&e.model)?, &at, &inside)?;
        Ok(())
    });
    assert!(count > 100_000, "compared only {count} numbers");
}

#[test]
fn random_trees() {
    let mut count = 0;
    run(250, 12, (trees(6), boxes(), points(1..16)), |(tree, at, inside)| {
        let field = match Field::new(&tree.model) {
            Err(FieldError::TooLarge(_)) => return Ok(()),
            field => field?,
        };
        if field.operations() < 2000 {
            count += intervals_contain(&field, &at, &inside)?;
        }
        Ok(())
    });
    assert!(count > 20_000, "compared only {count} numbers");
}

#[test]
fn every_kind_over_boxes_of_all_sizes() {
    let inside = scattered(12, 1.0, 13);
    let numbers: Vec<Vec<f64>> = scattered(4, 0.5, 14).iter().map(|p| p.map(|v| v + 0.5).to_vec()).collect();
    for model in each_kind(&numbers[..2]) {
        let field = Field::new(&model).unwrap();
        for (i, centre) in scattered(12, 1.5, 15).into_iter().enumerate() {
            let size = [0.4, 1e-9, 0.0, 3.0, 1e6, 0.05][i % 6];
            // Every other box is centred where shapes have kinks.
            let centre = if i % 2 == 0 { centre } else { centre.map(f64::round) };
            for half in [[size; 3], [size, 0.0, 0.3 * size]] {
                intervals_contain(&field, &BoxAt { centre, half }, &inside)
                    .unwrap_or_else(|e| panic!("{} {:?}: {e}", model.kind().name, field.q()));
            }
        }
    }
}

/// Interval and pointwise function, compared over random intervals at all scales.
fn contains(
    name: &str,
    over: &dyn Fn(Interval) -> Interval,
    at: &dyn Fn(f64) -> f64,
    scales: std::ops::Range<i32>,
) {
    for (i, p) in scattered(20_000, 1.0, 16).into_iter().enumerate() {
        let scale = 10f64.powi(scales.start + i as i32 % (scales.end - scales.start));
        let width = if i % 3 == 0 { 0.0 } else { scale * 10f64.powi(-(i as i32 % 17)) };
        let (lo, hi) = (p[0] * scale, p[0] * scale + p[1].abs() * width);
        let r = over(Interval::new(lo, hi));
        for t in [0.0, 1.0, p[2].abs(), 0.5] {
            let x = (lo + t * (hi - lo)).clamp(lo, hi);
            let y = at(x);
            assert!(
                y.is_nan() || r.contains(y),
                "{name}({x:e}) = {y:e} is not in {r:?} over [{lo:e}, {hi:e}]"
            );
        }
    }
}

#[test]
fn functions_of_one_number_at_all_scales() {
    contains("exp", &|x| x.exp(), &math::exp, -20..4);
    contains("ln", &|x| x.ln(), &math::ln, -300..300);
    contains("sqrt", &|x| Scalar::sqrt(x), &f64::sqrt, -300..300);
    contains("square", &|x| x.square(), &|x| x * x, -170..170);
    contains("sin", &|x| x.sin(), &math::sin, -310..16);
    contains("cos", &|x| x.cos(), &math::cos, -310..16);
    contains("tan", &|x| x.tan(), &math::tan, -310..16);
    contains("asin", &|x| x.asin(), &math::asin, -310..1);
    contains("acos", &|x| x.acos(), &math::acos, -310..1);
    contains("atan", &|x| x.atan(), &math::atan, -310..300);
    contains("floor", &|x| x.floor(), &f64::floor, -5..20);
    contains("ceil", &|x| x.ceil(), &f64::ceil, -5..20);
    contains("round", &|x| Scalar::round(x), &f64::round, -5..20);
    contains("abs", &|x| x.abs(), &f64::abs, -300..300);
    for n in [-3.0, -2.0, -0.5, 0.0, 1.0 / 3.0, 1.5, 2.0, 3.0, 7.0] {
        let b = Interval::new(n, n);
        contains(&format!("power {n} of"), &|x| x.pow(b), &|x| math::pow(x, n), -40..40);
        contains(&format!("power of {n} to"), &|x| b.pow(x), &|x| math::pow(n, x), -10..4);
        contains(&format!("{n} modulo"), &|x| b.modulo(x), &|x| math::modulo(n, x), -10..10);
        contains(&format!("modulo {n} of"), &|x| x.modulo(b), &|x| math::modulo(x, n), -10..20);
        contains(&format!("atan2({n}, x) of"), &|x| b.atan2(x), &|x| math::atan2(n, x), -300..300);
        contains(&format!("atan2(x, {n}) of"), &|x| x.atan2(b), &|x| math::atan2(x, n), -300..300);
    }
}

#[test]
fn functions_of_two_intervals() {
    let powers = scattered(30_000, 1.0, 17);
    for (i, p) in powers.iter().enumerate() {
        let scale = [0.5, 3.0, 40.0][i % 3];
        let a = Interval::new(p[0] * scale, p[0] * scale + p[1].abs());
        let b = Interval::new(p[1] * 3.0, p[1] * 3.0 + p[2].abs() * (i % 5) as f64);
        let pairs = [
            (a.lo, b.lo),
            (a.hi, b.hi),
            (a.lo, b.hi),
            (a.hi, b.lo),
            (0.5 * (a.lo + a.hi), 0.5 * (b.lo + b.hi)),
        ];
        for (x, y) in pairs.into_iter().chain([(a.lo, b.hi.floor()), (a.hi, b.lo.ceil())]) {
            if !(b.contains(y)) {
                continue;
            }
            for (name, r, v) in [
                ("pow", a.pow(b), math::pow(x, y)),
                ("atan2", a.atan2(b), math::atan2(x, y)),
                ("modulo", a.modulo(b), math::modulo(x, y)),
                ("quotient", a / b, x / y),
                ("product", a * b, x * y),
                ("difference", a - b, x - y),
                ("minimum", Scalar::min(a, b), x.min(y)),
                ("less", a.less(b), Scalar::less(x, y)),
            ] {
                assert!(
                    v.is_nan() || r.contains(v),
                    "{name}({x:e}, {y:e}) = {v:e} is not in {r:?} of {a:?}, {b:?}"
                );
            }
        }
    }
}

#[test]
fn trigonometric_functions_of_huge_numbers() {
    // Beyond TRIG_ACCURATE the functions are those of a neighbouring argument: the interval covers both.
    for x in [2e6, 1e9, 3.3e11, 1.09e12, 1e13, 1e300, f64::MAX] {
        let point = Interval::new(x, x);
        for (r, v, exact) in [(point.sin(), math::sin(x), x.sin()), (point.cos(), math::cos(x), x.cos())] {
            assert!(r.contains(v) && r.contains(exact), "at {x:e}: {v} and {exact} in {r:?}");
        }
        assert!(point.tan().contains(math::tan(x)) && point.tan().contains(x.tan()));
    }
    let all = Interval::ENTIRE;
    assert_eq!((all.sin(), all.cos(), all.tan()), (Interval::new(-1.0, 1.0), Interval::new(-1.0, 1.0), all));
}

#[test]
fn intervals_are_tight_where_they_can_be() {
    let near = |r: Interval, lo: f64, hi: f64| {
        let ulp = |v: f64| 12.0 * f64::EPSILON * v.abs() + f64::MIN_POSITIVE;
        assert!(
            r.lo <= lo && hi <= r.hi && lo - r.lo <= ulp(lo) && r.hi - hi <= ulp(hi),
            "{r:?} should be [{lo:e}, {hi:e}]"
        );
    };
    near(Interval::new(1e-9, 2e-9).sin(), math::sin(1e-9), math::sin(2e-9));
    near(Interval::new(0.5, 2.0).sin(), 0.5f64.sin(), 1.0);
    near(Interval::new(3.0, 3.5).cos(), -1.0, 3.5f64.cos());
    near(Interval::new(-1.0, 2.0).pow(Interval::new(2.0, 2.0)), 0.0, 4.0);
    near(Interval::new(-2.0, 1.0).pow(Interval::new(3.0, 3.0)), -8.0, 1.0);
    near(Interval::new(0.0, 4.0).pow(Interval::new(1.5, 1.5)), 0.0, 8.0);
    near(Interval::new(0.0, 4.0).pow(Interval::new(0.5, 1.5)), 0.0, 8.0);
    near(Interval::new(0.0, 1.0).exp(), 1.0, 1f64.exp());
    near(Interval::new(1.0, 4.0).ln(), 0.0, 4f64.ln());
    near(Interval::new(-0.5, 0.5).tan(), -(0.5f64.tan()), 0.5f64.tan());
    // Too large for a number, but never 0 and never undefined.
    assert!(Interval::new(800.0, 900.0).exp().lo > 1e308);
    assert!(!range("exp(x^2 + y^2 + z^2) - 5", [30.0; 3], [f64::INFINITY; 3]).has_zero());
}

#[test]
fn kinks_lie_inside() {
    // Over a kink the gradient takes both sides' values and the mean of them at the tie.
    let f = field("max(x, y) + abs(z)");
    let g = f.interval_gradient(&[-1.0, -1.0, -1.0], &[1.0, 1.0, 1.0]).unwrap();
    for (r, sides) in g.iter().zip([[0.0, 1.0], [0.0, 1.0], [-1.0, 1.0]]) {
        assert!(r.contains(sides[0]) && r.contains(sides[1]) && r.contains(0.5), "{r:?}");
        assert!(r.lo > -1.1 && r.hi < 1.1, "{r:?}");
    }
    assert_eq!(range("floor(x)", [0.5; 3], [1.5; 3]), Interval::new(0.0, 1.0));
    assert_eq!(range("where(x < 1, 5, 7)", [0.5; 3], [1.5; 3]), Interval::new(5.0, 7.0));
    assert_eq!(range("where(x < 1, 5, 7)", [0.5; 3], [0.75; 3]), Interval::new(5.0, 5.0));
    let root = range("sqrt(x)", [-1.0; 3], [4.0; 3]);
    assert!(root.lo == 0.0 && root.contains(2.0) && root.hi < 2.000001, "{root:?}");
    assert_eq!(range("1/x", [-1.0; 3], [1.0; 3]), Interval::ENTIRE);
}

#[test]
fn boxes_that_are_none_are_refused() {
    let f = field("x + y + z");
    for (lo, hi) in [
        ([1.0, 0.0, 0.0], [0.0, 1.0, 1.0]),
        ([f64::NAN, 0.0, 0.0], [1.0; 3]),
        ([0.0; 3], [1.0, f64::NAN, 1.0]),
    ] {
        for result in [f.interval(&lo, &hi), f.interval_gradient(&lo, &hi), f.interval_hessian(&lo, &hi)] {
            let message = result.unwrap_err().to_string();
            assert!(message.contains("lo <= hi"), "{message}");
        }
    }
    assert!(f.interval(&[0.0; 2], &[1.0; 2]).is_err());
    assert_eq!(f.interval(&[1.0; 3], &[1.0; 3]).unwrap()[0].width().max(1e-14), 1e-14);
}
