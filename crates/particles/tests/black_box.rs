//! Dragging a function of points and parameters that is known by its values only.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use isoswarm_field::model::Param;
use isoswarm_field::{Callback, Field, FieldError, Model, text};
use isoswarm_particles::control::{Pin, StepOptions, step};

const ELLIPSOID: &str = "(x - a)^2 + (y - b)^2 + s*(z - c)^2 - r^2";
const VALUES: [(&str, f64); 5] = [("a", 0.0), ("b", 0.0), ("s", 0.5), ("c", 0.0), ("r", 1.0)];
const OPTIONS: StepOptions = StepOptions { longest: 0.05, gain: 0.5, tolerance: 1e-10 };

/// The ellipsoid as a black box; the call with the number `fails` fails.
#[derive(Default)]
struct BlackBox {
    calls: AtomicUsize,
    fails: usize,
}

impl Callback for BlackBox {
    fn name(&self) -> &str {
        "ellipsoid"
    }

    fn parameters(&self) -> Vec<Param> {
        VALUES.map(|(name, value)| Param::new(name, value)).to_vec()
    }

    fn value(&self, points: &[[f64; 3]], q: &[f64], value: &mut [f64]) -> Result<(), FieldError> {
        if self.calls.fetch_add(1, Ordering::Relaxed) + 1 == self.fails {
            return Err(FieldError::Callback { name: "ellipsoid".into(), reason: "no more".into() });
        }
        for (v, [x, y, z]) in value.iter_mut().zip(points) {
            *v = (x - q[0]).powi(2) + (y - q[1]).powi(2) + q[2] * (z - q[3]).powi(2) - q[4] * q[4];
        }
        Ok(())
    }
}

fn black_box(fails: usize) -> (Field, Arc<BlackBox>) {
    let function = Arc::new(BlackBox { fails, ..Default::default() });
    (Field::new(&Model::function(function.clone()).unwrap()).unwrap(), function)
}

/// One pin that is held and one that is dragged.
fn pins() -> Vec<Pin> {
    let hand = Pin { target: Some([1.4, 0.3, 0.0]), ..Pin::new([1.0, 0.0, 0.0]) };
    vec![hand, Pin::new([-1.0, 0.0, 0.0])]
}

#[test]
fn a_drag_of_a_black_box_converges_where_that_of_the_formula_does() {
    let mut formula = Field::new(&text::parse(ELLIPSOID, &VALUES).unwrap()).unwrap();
    let (mut opaque, _) = black_box(0);
    let (mut expected, mut given) = (pins(), pins());
    for _ in 0..40 {
        step(&mut formula, &mut expected, &[1.0; 5], &[], &OPTIONS).unwrap();
        step(&mut opaque, &mut given, &[1.0; 5], &[], &OPTIONS).unwrap();
    }
    let target = pins()[0].target.unwrap();
    for (a, b) in [(target, given[0].at), (expected[0].at, given[0].at), (pins()[1].at, given[1].at)] {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{b:?} instead of {a:?}");
    }
    for (a, b) in formula.q().iter().zip(opaque.q()) {
        assert!((a - b).abs() < 1e-7, "q is {:?} instead of {:?}", opaque.q(), formula.q());
    }
}

#[test]
fn a_black_box_that_fails_in_mid_step_leaves_everything_as_it_was() {
    let (mut whole, function) = black_box(0);
    step(&mut whole, &mut pins(), &[1.0; 5], &[], &OPTIONS).unwrap();
    let calls = function.calls.load(Ordering::Relaxed);
    assert!(calls > 11, "{calls} calls: one for F, two for each parameter, and the corrections");
    for fails in 1..=calls {
        let (mut field, _) = black_box(fails);
        let mut pins_now = pins();
        let error = step(&mut field, &mut pins_now, &[1.0; 5], &[], &OPTIONS).unwrap_err();
        assert!(error.to_string().contains("no more"), "{error}");
        assert_eq!((field.q(), pins_now), (VALUES.map(|v| v.1).to_vec(), pins()), "call {fails}");
    }
}
