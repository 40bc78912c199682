//! The elementary functions: accuracy against exact values, special values, borders of the reductions, and the same
//! bits in every vector width.

use isoswarm_field::math;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, LN_2, PI};

const INF: f64 = f64::INFINITY;
const NAN: f64 = f64::NAN;

type Block = [f64; 64];

/// One function: by its name, in a loop of the baseline and in one dispatched to the widest vectors there are.
struct Function {
    name: &'static str,
    ulps: f64,
    scalar: fn(f64, f64) -> f64,
    plain: fn(&Block, &Block, &mut Block),
    dispatched: fn(&Block, &Block, &mut Block),
}

macro_rules! functions {
    ($($name:ident $ulps:expr, $f:expr;)*) => {
        vec![$({
            #[inline(always)]
            fn body(a: &Block, b: &Block, out: &mut Block) {
                let f = $f;
                for i in 0..64 {
                    out[i] = f(a[i], b[i]);
                }
            }
            #[inline(never)]
            fn dispatched(a: &Block, b: &Block, out: &mut Block) {
                pulp::Arch::new().dispatch(#[inline(always)] || body(a, b, out));
            }
            Function { name: stringify!($name), ulps: $ulps, scalar: $f, plain: body, dispatched }
        }),*]
    };
}

fn functions() -> Vec<Function> {
    functions! {
        exp math::EXP_ULPS, |a: f64, _: f64| math::exp(a);
        ln math::LN_ULPS, |a: f64, _: f64| math::ln(a);
        sin math::SIN_ULPS, |a: f64, _: f64| math::sin(a);
        cos math::COS_ULPS, |a: f64, _: f64| math::cos(a);
        tan math::TAN_ULPS, |a: f64, _: f64| math::tan(a);
        asin math::ASIN_ULPS, |a: f64, _: f64| math::asin(a);
        acos math::ACOS_ULPS, |a: f64, _: f64| math::acos(a);
        atan math::ATAN_ULPS, |a: f64, _: f64| math::atan(a);
        atan2 math::ATAN2_ULPS, |a: f64, b: f64| math::atan2(a, b);
        pow math::POW_ULPS, |a: f64, b: f64| math::pow(a, b);
        sinh math::SINH_ULPS, |a: f64, _: f64| math::sinh(a);
        cosh math::COSH_ULPS, |a: f64, _: f64| math::cosh(a);
        tanh math::TANH_ULPS, |a: f64, _: f64| math::tanh(a);
        cbrt math::CBRT_ULPS, |a: f64, _: f64| math::cbrt(a);
        sqrt 0.5, |a: f64, _: f64| math::sqrt(a);
        floor 0.0, |a: f64, _: f64| math::floor(a);
        ceil 0.0, |a: f64, _: f64| math::ceil(a);
        round 0.0, |a: f64, _: f64| math::round(a);
        modulo 0.0, |a: f64, b: f64| math::modulo(a, b);
        min 0.0, |a: f64, b: f64| math::min(a, b);
        max 0.0, |a: f64, b: f64| math::max(a, b);
    }
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn uniform(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// Special values, any bit patterns, and ordinary numbers.
    fn any(&mut self) -> f64 {
        const SPECIAL: [f64; 20] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            INF,
            -INF,
            NAN,
            5e-324,
            -5e-324,
            f64::MIN_POSITIVE,
            f64::MAX,
            f64::MIN,
            709.79,
            -745.14,
            -708.4,
            1e16,
            0.5,
            -0.5,
            3.0,
            -2.0,
        ];
        match self.bits() % 4 {
            0 => SPECIAL[(self.bits() % 20) as usize],
            1 => f64::from_bits(self.bits()),
            2 => self.uniform(-1.0, 1.0),
            _ => self.uniform(-100.0, 100.0),
        }
    }
}

fn ulp(x: f64) -> f64 {
    x.abs().next_up().min(f64::MAX) - x.abs().next_up().min(f64::MAX).next_down()
}

/// Of two doubles: equal bits, all NaN counting as one.
fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

/// The double n steps above x.
fn step(x: f64, n: i64) -> f64 {
    let order = |b: i64| if b < 0 { i64::MIN - b } else { b };
    f64::from_bits(order(order(x.to_bits() as i64) + n) as u64)
}

#[test]
fn errors_against_exact_values_stay_below_the_stated_bounds() {
    let all = functions();
    let hex = |s: &str| f64::from_bits(u64::from_str_radix(s, 16).unwrap());
    let mut lines = 0;
    for line in include_str!("data/math_reference.txt").lines() {
        let w: Vec<&str> = line.split(' ').collect();
        let f = all.iter().find(|f| f.name == w[0]).unwrap();
        let (x, y, exact) = (hex(w[1]), hex(w[2]), hex(w[3]));
        let rest: f64 = w[4].parse().unwrap();
        let got = (f.scalar)(x, y);
        let error = ((got - exact) / ulp(exact) - rest / 1_048_576.0).abs();
        assert!(error <= f.ulps, "{}({x:e}, {y:e}) = {got:e}, off by {error} ulp", f.name);
        lines += 1;
    }
    assert_eq!(lines, 14 * 120);
}

#[test]
fn many_values_agree_with_libm() {
    let reference: [(&str, fn(f64, f64) -> f64, f64, f64); 14] = [
        ("exp", |a, _| libm::exp(a), -700.0, 700.0),
        ("ln", |a, _| libm::log(a), 0.0, 10.0),
        ("sin", |a, _| libm::sin(a), -1e5, 1e5),
        ("cos", |a, _| libm::cos(a), -1e5, 1e5),
        ("tan", |a, _| libm::tan(a), -1e5, 1e5),
        ("asin", |a, _| libm::asin(a), -1.0, 1.0),
        ("acos", |a, _| libm::acos(a), -1.0, 1.0),
        ("atan", |a, _| libm::atan(a), -5.0, 5.0),
        ("atan2", libm::atan2, -5.0, 5.0),
        ("pow", libm::pow, 0.0, 20.0),
        ("sinh", |a, _| libm::sinh(a), -20.0, 20.0),
        ("cosh", |a, _| libm::cosh(a), -20.0, 20.0),
        ("tanh", |a, _| libm::tanh(a), -20.0, 20.0),
        ("cbrt", |a, _| libm::cbrt(a), -20.0, 20.0),
    ];
    let all = functions();
    let mut random = Random(3);
    for (name, libm, lo, hi) in reference {
        let f = all.iter().find(|f| f.name == name).unwrap();
        for _ in 0..100_000 {
            let (x, y) = (random.uniform(lo, hi), random.uniform(lo, hi));
            let (got, expected) = ((f.scalar)(x, y), libm(x, y));
            let error = (got - expected).abs() / ulp(expected);
            // libm itself is below 1 ulp, its hyperbolic functions below 2.
            assert!(error <= f.ulps.ceil() + 1.0, "{name}({x:e}, {y:e}) = {got:e}, libm {expected:e}");
        }
    }
}

#[test]
fn every_vector_width_gives_the_same_bits() {
    let mut random = Random(1);
    for f in functions() {
        for _ in 0..2000 {
            let a: Block = std::array::from_fn(|_| random.any());
            let b: Block = std::array::from_fn(|_| random.any());
            let (mut plain, mut wide) = ([0.0; 64], [0.0; 64]);
            (f.plain)(&a, &b, &mut plain);
            (f.dispatched)(&a, &b, &mut wide);
            for i in 0..64 {
                let one = (f.scalar)(a[i], b[i]);
                assert!(
                    same(plain[i], wide[i]) && same(plain[i], one),
                    "{}({:e}, {:e}): {:e} plain, {:e} dispatched, {one:e} alone",
                    f.name,
                    a[i],
                    b[i],
                    plain[i],
                    wide[i]
                );
            }
        }
    }
}

/// The same on every machine. A deliberate change of a function changes its number here, and results with it.
#[test]
fn bits_are_those_of_every_other_machine() {
    let expected: [(&str, u64); 14] = [
        ("exp", 0x22328f3af6a8e251),
        ("ln", 0x185c6859d924e1cc),
        ("sin", 0x4f09ed34a085f8e9),
        ("cos", 0x61a850d77e629976),
        ("tan", 0xc2ee68dd3c7a2e20),
        ("asin", 0xba055f0081ae9286),
        ("acos", 0xd2794c05945b9d53),
        ("atan", 0xa798f780891f321a),
        ("atan2", 0xea00d49baff4e1b0),
        ("pow", 0x0695cc11d2e2f35a),
        ("sinh", 0x9ab3efafb7a50c62),
        ("cosh", 0xf50192eb4d2680f5),
        ("tanh", 0x1e550391b4a90639),
        ("cbrt", 0x2977ebd07ddcbba0),
    ];
    let all = functions();
    let got = expected.map(|(name, _)| {
        let f = all.iter().find(|f| f.name == name).unwrap();
        let mut random = Random(2);
        let mut hash = 0xcbf2_9ce4_8422_2325u64;
        for _ in 0..20_000 {
            let v = (f.scalar)(random.any(), random.any());
            let bits = if v.is_nan() { NAN.to_bits() } else { v.to_bits() };
            hash = (hash ^ bits).wrapping_mul(0x0100_0000_01b3);
        }
        (name, hash)
    });
    assert_eq!(got, expected);
}

#[track_caller]
fn check(got: f64, expected: f64) {
    assert!(same(got, expected), "got {got:e}, expected {expected:e}");
}

#[test]
fn special_values_of_exp_and_ln() {
    check(math::exp(0.0), 1.0);
    check(math::exp(-0.0), 1.0);
    check(math::exp(INF), INF);
    check(math::exp(-INF), 0.0);
    check(math::exp(NAN), NAN);
    check(math::exp(710.0), INF);
    check(math::exp(1e300), INF);
    check(math::exp(-745.2), 0.0);
    check(math::exp(-745.13), 5e-324);
    assert!(math::exp(709.782_712_893_384) < INF);
    check(math::ln(1.0), 0.0);
    check(math::ln(0.0), -INF);
    check(math::ln(-0.0), -INF);
    check(math::ln(-1.0), NAN);
    check(math::ln(-INF), NAN);
    check(math::ln(INF), INF);
    check(math::ln(NAN), NAN);
    check(math::ln(5e-324), -744.440_071_921_381_2);
}

#[test]
fn special_values_of_the_trigonometric_functions() {
    for f in [math::sin, math::tan, math::asin, math::atan, math::sinh, math::tanh, math::cbrt] {
        check(f(0.0), 0.0);
        check(f(-0.0), -0.0);
        check(f(NAN), NAN);
    }
    for f in [math::sin, math::tan, math::asin, math::atan, math::sinh, math::tanh] {
        check(f(5e-324), 5e-324);
        check(f(-2e-310), -2e-310);
    }
    for f in [math::sin, math::cos, math::tan] {
        check(f(INF), NAN);
        check(f(-INF), NAN);
        check(f(NAN), NAN);
    }
    check(math::cos(0.0), 1.0);
    // beyond TRIG_RANGE: as of 0
    check(math::sin(1e300), 0.0);
    check(math::cos(-1e300), 1.0);
    for f in [math::asin, math::acos] {
        check(f(1.000_000_1), NAN);
        check(f(-2.0), NAN);
        check(f(INF), NAN);
    }
    check(math::asin(1.0), FRAC_PI_2);
    check(math::asin(-1.0), -FRAC_PI_2);
    check(math::acos(1.0), 0.0);
    check(math::acos(-1.0), PI);
    check(math::acos(0.0), FRAC_PI_2);
    check(math::atan(INF), FRAC_PI_2);
    check(math::atan(-INF), -FRAC_PI_2);
    check(math::atan(1.0), FRAC_PI_4);
}

#[test]
fn atan2_and_pow_have_the_special_values_of_ieee_754() {
    let values = [
        0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 2.0, -2.0, 3.0, -3.0, INF, -INF, NAN, 1e300, -1e300, 5e-324, -5e-324,
    ];
    for a in values {
        for b in values {
            for (name, got, expected) in
                [("atan2", math::atan2(a, b), libm::atan2(a, b)), ("pow", math::pow(a, b), libm::pow(a, b))]
            {
                // bits for the special values, an ulp where the reference rounds differently
                let near = expected != 0.0 && (got - expected).abs() <= ulp(expected);
                assert!(same(got, expected) || near, "{name}({a:e}, {b:e}) = {got:e}, expected {expected:e}");
            }
        }
    }
}

#[test]
fn powers_that_are_doubles_are_exact() {
    for x in 0..500u64 {
        for y in 0..53u32 {
            if let Some(exact) = x.checked_pow(y).filter(|&v| v < 1 << 53) {
                check(math::pow(x as f64, f64::from(y)), exact as f64);
                let sign = if y % 2 == 1 { -1.0 } else { 1.0 };
                if x > 0 {
                    check(math::pow(-(x as f64), f64::from(y)), sign * exact as f64);
                }
            }
        }
    }
    check(math::pow(-8.0, 1.0 / 3.0), NAN);
    check(math::pow(-1.0, 9_007_199_254_740_991.0), -1.0);
    check(math::pow(-1.0, 9_007_199_254_740_992.0), 1.0);
    check(math::pow(1.0 + f64::EPSILON, 1e300), INF);
    check(math::pow(2.0, -1074.0), 5e-324);
}

#[test]
fn hyperbolic_functions_at_the_ends_of_the_range() {
    assert!(math::sinh(710.4) < INF && math::cosh(710.4) < INF);
    check(math::sinh(710.5), INF);
    check(math::sinh(-INF), -INF);
    check(math::cosh(-INF), INF);
    check(math::cosh(711.0), INF);
    check(math::cosh(NAN), NAN);
    check(math::cosh(0.0), 1.0);
    check(math::tanh(INF), 1.0);
    check(math::tanh(-50.0), -1.0);
    check(math::cbrt(27.0), 3.0);
    check(math::cbrt(-INF), -INF);
    check(math::cbrt(2f64.powi(-1074)), 2f64.powi(-358));
}

#[test]
fn rounding_modulo_and_order() {
    check(math::round(2.5), 2.0);
    check(math::round(-1.5), -2.0);
    check(math::floor(-0.5), -1.0);
    check(math::ceil(-0.5), -0.0);
    check(math::modulo(-1.0, 3.0), 2.0);
    check(math::modulo(5.5, 2.0), 1.5);
    check(math::modulo(1.0, -3.0), -2.0);
    check(math::modulo(1.0, 0.0), NAN);
    for (a, b) in [(1.0, NAN), (NAN, 1.0), (NAN, NAN)] {
        check(math::min(a, b), NAN);
        check(math::max(a, b), NAN);
    }
    check(math::min(-INF, 3.0), -INF);
    check(math::max(-INF, 3.0), 3.0);
}

/// Over the borders of the argument reductions, where two approximations meet, no function turns back.
#[test]
fn functions_are_monotone_over_the_borders_of_their_reductions() {
    let rising = |name: &str, f: &dyn Fn(f64) -> f64, borders: &[f64]| {
        for &x in borders {
            for n in -500..500 {
                let (a, b) = (step(x, n), step(x, n + 1));
                assert!(f(a) <= f(b), "{name}({a:e}) = {:e} > {name}({b:e}) = {:e}", f(a), f(b));
            }
        }
    };
    let halves: Vec<f64> = (-1000..1000).map(|k| (f64::from(k) + 0.5) * LN_2).collect();
    rising("exp", &math::exp, &halves);
    let roots: Vec<f64> = (-200..200).map(|k| 2f64.powi(k) * 0.5f64.sqrt()).collect();
    rising("ln", &math::ln, &roots);
    rising("ln", &math::ln, &[1.0, f64::MIN_POSITIVE]);
    rising("sin", &math::sin, &[-FRAC_PI_4, FRAC_PI_4, 0.0]);
    rising("-cos", &|x| -math::cos(x), &[FRAC_PI_4, 3.0 * FRAC_PI_4, FRAC_PI_2]);
    rising("tan", &math::tan, &[-FRAC_PI_4, FRAC_PI_4, 0.0]);
    rising("atan", &math::atan, &[0.4375, 0.6875, 1.0, 1.0 / 0.6875, 1.0 / 0.4375, -1.0]);
    rising("asin", &math::asin, &[0.5, -0.5]);
    rising("-acos", &|x| -math::acos(x), &[0.5, -0.5]);
}

#[test]
fn sine_and_cosine_never_leave_the_unit_interval() {
    let mut random = Random(5);
    for k in -20_000..20_000 {
        for n in -3..4 {
            let x = step(f64::from(k) * FRAC_PI_2, n);
            assert!(math::sin(x).abs() <= 1.0 && math::cos(x).abs() <= 1.0, "at {x:e}");
        }
    }
    for _ in 0..200_000 {
        let x = random.uniform(-1.0, 1.0) * 10f64.powf(random.uniform(0.0, 15.0));
        assert!(math::sin(x).abs() <= 1.0 && math::cos(x).abs() <= 1.0, "at {x:e}");
    }
}

#[test]
fn beyond_the_accurate_range_the_error_grows_with_the_argument() {
    let mut random = Random(6);
    for _ in 0..100_000 {
        let x = math::TRIG_ACCURATE * (math::TRIG_RANGE / math::TRIG_ACCURATE).powf(random.uniform(0.0, 1.0));
        let bound = x * f64::EPSILON;
        assert!((math::sin(x) - libm::sin(x)).abs() <= bound, "at {x:e}");
        assert!((math::cos(x) - libm::cos(x)).abs() <= bound, "at {x:e}");
    }
}
