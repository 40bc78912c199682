use super::*;
use crate::Model;
use crate::program::Purpose;
use crate::tape::Tape;

/// Every operation, with operands that vary and with parameters.
const FORMULAS: [&str; 3] = [
    "exp(-p*x^2) + sin(3*y)*cos(z) + atan2(y, x) + tan(0.3*x) + asin(0.2*x) - acos(0.2*y) + atan(p/z) + q",
    "min(x, y) + max(z, x*y, p) + mod(x, 0.7) + where(x < y, z, x^3) + ln(2 + x*x) + x/(1 + q*y*y) + abs(z)",
    "sqrt(x*x + p) - (x - q)^2 + floor(3*x) + ceil(2*y) + round(4*z) + (2 + x)^y + q*exp(p)*x + (q - y)/2",
];

fn points(n: usize) -> Vec<[f64; 3]> {
    let number =
        |i: usize| ((i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / 2f64.powi(52) - 1.0;
    (0..n).map(|i| [number(3 * i), number(3 * i + 1), number(3 * i + 2)]).collect()
}

struct Case {
    program: Program,
    uniforms: Vec<f64>,
    tape: Tape,
}

fn case(text: &str, purpose: Purpose) -> Case {
    let model: Model = crate::text::parse(text, &[("p", 0.8), ("q", 1.3)]).unwrap();
    let lowered = model.lower().unwrap();
    let tape = Tape::new(&lowered.graph, lowered.roots[0]);
    let values: Vec<f64> = lowered.params.iter().map(|p| p.value).collect();
    let uniforms = tape.uniforms.evaluate(&values);
    Case { program: Program::new(&tape, purpose), uniforms, tape }
}

/// Results of both loops, as bits.
fn both(n: usize, width: usize, make: impl Fn(&mut [f64], bool)) {
    let [mut apart, mut once] = [vec![f64::NAN; n * width], vec![f64::NAN; n * width]];
    make(&mut apart, false);
    make(&mut once, true);
    let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&apart), bits(&once));
}

/// The loop that has everything gives the bits of those that are compiled for one purpose each.
#[test]
fn one_copy_of_the_loops_gives_the_bits_of_many() {
    for text in FORMULAS {
        for n in [1, 7, 16, 17, 64, 200] {
            let points = points(n);
            let batch = Batch::of_points(&points, 3);
            let call = |c: &Case, value: &mut [f64], want: Want, once: bool| {
                let run = if once { run_once } else { run };
                run(&c.program, &c.uniforms, batch, value, want);
            };
            let c = case(text, Purpose::Value);
            both(n, 1, |out, once| call(&c, out, Want::Value, once));
            let c = case(text, Purpose::Inputs);
            both(n, 4, |out, once| {
                let (value, x) = out.split_at_mut(n);
                let (x, leaves) = (Columns { data: x, stride: 3 }, Columns { data: &mut [], stride: 0 });
                call(&c, value, Want::Gradient { x, leaves }, once);
            });
            both(n, 4, |out, once| {
                let (value, x) = out.split_at_mut(n);
                call(&c, value, Want::Chosen { x: Columns { data: x, stride: 3 } }, once);
            });
            let c = case(text, Purpose::Everything);
            let rates = c.tape.uniforms.rates(&c.uniforms, &[0.3, -0.7]);
            both(n, 5, |out, once| {
                let (value, rest) = out.split_at_mut(n);
                let (x, rate) = rest.split_at_mut(3 * n);
                let (x, leaves) = (Columns { data: x, stride: 3 }, Columns { data: &mut [], stride: 0 });
                call(&c, value, Want::Rate { x, leaves, rates: &rates, rate }, once);
            });
            let rows = Rows::new(&c.tape.uniforms, &[Some(0), Some(1)]);
            both(n, 6, |out, once| {
                let (value, rest) = out.split_at_mut(n);
                let (x, q) = rest.split_at_mut(3 * n);
                let (x, leaves) = (Columns { data: x, stride: 3 }, Columns { data: &mut [], stride: 0 });
                call(
                    &c,
                    value,
                    Want::Parameters { x, leaves, rows: &rows, q: Columns { data: q, stride: 2 } },
                    once,
                );
            });
        }
    }
}

#[test]
fn second_derivatives_one_by_one_have_the_bits_of_those_in_blocks() {
    for text in FORMULAS {
        let points = points(21);
        let batch = Batch::of_points(&points, 3);
        let c = case(text, Purpose::Inputs);
        both(21, 9, |out, once| {
            let by = if once { hessian_by::<1> } else { hessian_by::<8> };
            by(&c.program, &c.uniforms, batch, out);
        });
    }
}
