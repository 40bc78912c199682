//! Control points against first principles: the Kuhn-Tucker conditions, units, precedence, limits.

use isoswarm_field::{Field, Parametric, Surface, text};
use isoswarm_particles::control::{ControlStep, Guide, Pin, StepOptions, sensitivity, step};

const SPHERE: &str = "(x - a)^2 + (y - b)^2 + (z - c)^2 - r^2";
const AT: [(&str, f64); 4] = [("a", 0.0), ("b", 0.0), ("c", 0.0), ("r", 1.0)];
const FINE: StepOptions = StepOptions { longest: 0.05, gain: 0.5, tolerance: 1e-10 };

fn field(formula: &str, parameters: &[(&str, f64)]) -> Field {
    Field::new(&text::parse(formula, parameters).unwrap()).unwrap()
}

/// Points all over the unit sphere.
fn around() -> Vec<[f64; 3]> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..200)
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / 200.0;
            let (r, t) = ((1.0 - z * z).sqrt(), golden * i as f64);
            [r * t.cos(), r * t.sin(), z]
        })
        .collect()
}

/// Steps until the drag is over, at most so many.
fn drag(field: &mut Field, pins: &mut [Pin], metric: &[f64], steps: usize) -> Vec<ControlStep> {
    (0..steps).map(|_| step(field, pins, metric, &[], &FINE).unwrap()).collect()
}

fn off(field: &Field, p: [f64; 3]) -> f64 {
    let (mut f, mut g) = ([0.0], [[0.0; 3]]);
    Surface::value_gradient(field, &[p], &mut f, &mut g).unwrap();
    f[0].abs() / (g[0][0].powi(2) + g[0][1].powi(2) + g[0][2].powi(2)).sqrt()
}

/// Solves a dense system by elimination with full pivoting of rows.
fn dense(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        let p = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap();
        a.swap(k, p);
        b.swap(k, p);
        for i in k + 1..n {
            let f = a[i][k] / a[k][k];
            for j in k..n {
                a[i][j] -= f * a[k][j];
            }
            b[i] -= f * b[k];
        }
    }
    let mut x = vec![0.0; n];
    for k in (0..n).rev() {
        x[k] = (b[k] - (k + 1..n).map(|j| a[k][j] * x[j]).sum::<f64>()) / a[k][k];
    }
    x
}

#[test]
fn a_step_solves_the_kuhn_tucker_system() {
    // A quadric is linear in q, so that one step has no second-order part.
    let formula = "q0 + q1*x + q2*y + q3*z + q4*x^2 + q5*x*y + q6*y^2 + q7*x*z + q8*y*z + q9*z^2";
    let names = ["q0", "q1", "q2", "q3", "q4", "q5", "q6", "q7", "q8", "q9"];
    let start = [-1.0, 0.1, -0.2, 0.05, 1.0, 0.1, 1.2, -0.1, 0.2, 0.8];
    let parameters: Vec<(&str, f64)> = names.into_iter().zip(start).collect();
    let mut f = field(formula, &parameters);
    let q = f.q();
    let free = isoswarm_particles::project;
    let mut at = vec![[1.0, 0.1, 0.0], [0.0, -1.0, 0.2], [0.1, 0.3, 1.1]];
    free(&f, &mut at, 4.0).unwrap();
    let mut pins: Vec<Pin> = at.iter().map(|&p| Pin::new(p)).collect();
    let d = [0.01, 0.02, -0.005];
    pins[1].target = Some([0, 1, 2].map(|a| at[1][a] + d[a]));
    let metric: Vec<f64> = (0..10).map(|j| 0.5 + 0.1 * j as f64).collect();
    let desired: Vec<f64> = (0..10).map(|j| 0.001 * (j as f64 - 4.0)).collect();
    let (m, n) = (10, 3);
    // [M² Jᵀ; J 0] (Δq, λ) = (M² Q, -F - Fx·d), M the metric, with J at where the pins end, as F is linear in q.
    let ends: Vec<[f64; 3]> =
        (0..3).map(|i| if i == 1 { [0, 1, 2].map(|a| at[1][a] + d[a]) } else { at[i] }).collect();
    let (mut value, mut gradient, mut rows) = (vec![0.0; n], vec![[0.0; 3]; n], vec![0.0; n * m]);
    Parametric::parameter_gradient(&f, &at, &mut value, &mut gradient, &mut rows).unwrap();
    let mut a = vec![vec![0.0; m + n]; m + n];
    let mut b = vec![0.0; m + n];
    for j in 0..m {
        a[j][j] = metric[j] * metric[j];
        b[j] = metric[j] * metric[j] * desired[j];
        for i in 0..n {
            a[j][m + i] = rows[i * m + j];
            a[m + i][j] = rows[i * m + j];
        }
    }
    for i in 0..n {
        let slope: f64 = (0..3).map(|c| gradient[i][c] * (ends[i][c] - at[i][c])).sum();
        b[m + i] = -value[i] - slope;
    }
    let expected = dense(a, b);
    let wide = StepOptions { longest: 1.0, gain: 1.0, tolerance: 1e-3 };
    let report = step(&mut f, &mut pins, &metric, &desired, &wide).unwrap();
    for j in 0..m {
        assert!((report.q_change[j] - expected[j]).abs() < 1e-13, "{j}: {report:?} {expected:?}");
        assert!((f.q()[j] - q[j] - expected[j]).abs() < 1e-13);
    }
    assert_eq!(report.rank, 3);
}

#[test]
fn pins_hold_while_another_point_is_dragged() {
    let mut f = field(SPHERE, &AT);
    let metric = sensitivity(&f, &around()).unwrap();
    let mut pins = [Pin::new([-1.0, 0.0, 0.0]), Pin::new([0.0, 1.0, 0.0]), Pin::new([1.0, 0.0, 0.0])];
    for k in 0..1000 {
        // A path of a thousand steps around where the point began.
        let t = f64::from(k) * 0.02;
        pins[2].target = Some([1.2 + 0.3 * t.cos(), 0.2 * t.sin(), 0.1 * (2.0 * t).sin()]);
        let report = step(&mut f, &mut pins, &metric, &[], &FINE).unwrap();
        assert!(!report.stuck && report.rank == 3);
        for p in &pins[..2] {
            assert!(off(&f, p.at) < 1e-10, "step {k}: {}", off(&f, p.at));
        }
        assert_eq!((pins[0].at, pins[1].at), ([-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]));
    }
    let t = 999.0 * 0.02f64;
    let target = [1.2 + 0.3 * t.cos(), 0.2 * t.sin(), 0.1 * (2.0 * t).sin()];
    let lag = (0..3).map(|a| (pins[2].at[a] - target[a]).powi(2)).sum::<f64>().sqrt();
    assert!(lag < 0.02, "the pin lags behind the hand by {lag}");
}

#[test]
fn units_do_not_matter() {
    // The same sphere with its radius in thousandths and its place in other units.
    let mut one = field(SPHERE, &AT);
    let other = "(x - 100*a)^2 + (y - b)^2 + (z - c/10)^2 - (r/1000)^2";
    let mut two = field(other, &[("a", 0.0), ("b", 0.0), ("c", 0.0), ("r", 1000.0)]);
    for (path, scale) in [("a", 0.01), ("c", 10.0), ("r", 1000.0)] {
        two = Field::new(&two.model().with_scale(path, scale).unwrap()).unwrap();
    }
    let run = |f: &mut Field| {
        let metric = sensitivity(f, &around()).unwrap();
        let mut pins = [Pin::new([0.0, 0.0, 1.0]), Pin::new([0.6, 0.8, 0.0])];
        pins[1].target = Some([0.9, 1.0, 0.2]);
        drag(f, &mut pins, &metric, 60);
        f.q()
    };
    let (a, b) = (run(&mut one), run(&mut two));
    let units = [0.01, 1.0, 10.0, 1000.0];
    for j in 0..4 {
        assert!((a[j] - b[j] / units[j]).abs() < 1e-9, "{a:?} {b:?}");
    }
    assert!(a[0] > 0.01 && (a[3] - 1.0).abs() > 1e-3, "the shape has changed: {a:?}");
}

#[test]
fn frozen_parameters_keep_every_bit() {
    let mut f = field(SPHERE, &AT);
    let r = f.parameter("r").unwrap();
    f.set_value(r, 1.0 + 1e-3).unwrap();
    f.set_frozen(r, true);
    let metric = sensitivity(&f, &around()).unwrap();
    let mut pins = [Pin::new([1.001, 0.0, 0.0])];
    pins[0].target = Some([2.0, 0.3, 0.1]);
    let steps = drag(&mut f, &mut pins, &metric, 80);
    assert_eq!(f.parameters()[r].value.to_bits(), (1.0f64 + 1e-3).to_bits());
    assert!(steps.last().unwrap().moved < 1e-9);
    // Only the place is left: the sphere follows the hand.
    assert!(off(&f, [2.0, 0.3, 0.1]) < 1e-9 && f.q()[0] > 0.5, "{:?}", f.q());
}

#[test]
fn a_duplicate_changes_nothing() {
    let run = |twice: bool| {
        let mut f = field(SPHERE, &AT);
        let metric = sensitivity(&f, &around()).unwrap();
        let mut pins = vec![Pin::new([1.0, 0.0, 0.0]), Pin::new([-1.0, 0.0, 0.0])];
        pins[0].target = Some([1.3, 0.0, 0.2]);
        if twice {
            pins.push(Pin::new([-1.0, 0.0, 0.0]));
        }
        let steps = drag(&mut f, &mut pins, &metric, 40);
        (f.q(), steps[0].rank)
    };
    let ((a, rank), (b, again)) = (run(false), run(true));
    assert_eq!((rank, again), (2, 2));
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12), "{a:?} {b:?}");
}

#[test]
fn contradictory_pins_are_met_by_weight() {
    // Only the radius is free: r = 1 and r = 1.2 cannot both be; least squares in distance, weights 3 and 1.
    let mut f = field("x^2 + y^2 + z^2 - r^2", &[("r", 1.0)]);
    let mut pins = [Pin::new([1.0, 0.0, 0.0]), Pin::new([0.0, 1.2, 0.0])];
    pins[0].weight = 3.0;
    let steps = drag(&mut f, &mut pins, &[1.0], 30);
    let last = steps.last().unwrap();
    assert_eq!(last.rank, 1);
    // Stationary: Σ w² F/|Fx| ∂F/∂r/|Fx| = 0, both slopes taken at the pins.
    let r = f.q()[0];
    let part = |d: f64, w: f64| w * w * (d * d - r * r) / (2.0 * d) / (2.0 * d);
    assert!((part(1.0, 3.0) + part(1.2, 1.0)).abs() < 1e-6, "{r}");
    assert!((r - 1.02).abs() < 0.01, "{r}");
    assert!(last.residual[0] > 0.01 && last.residual[1] > 0.1, "{last:?}");
}

#[test]
fn a_drag_past_the_possible_ends_gracefully() {
    // The sphere may grow to 1.5 and not move; the hand goes to 4.
    let model =
        text::parse("x^2 + y^2 + z^2 - r^2", &[("r", 1.0)]).unwrap().with_bounds("r", 0.5, 1.5).unwrap();
    let mut f = Field::new(&model).unwrap();
    let metric = sensitivity(&f, &around()).unwrap();
    let mut pins = [Pin::new([1.0, 0.0, 0.0])];
    pins[0].target = Some([4.0, 0.0, 0.0]);
    let steps = drag(&mut f, &mut pins, &metric, 60);
    let last = steps.last().unwrap();
    assert_eq!(f.q(), [1.5]);
    assert_eq!(last.at_limit, [0]);
    assert!(last.moved.abs() < 1e-9 && (pins[0].at[0] - 1.5).abs() < 1e-9, "{:?} {last:?}", pins[0].at);
    // Held points come first: the same hand cannot tear off a pin on the other side.
    let mut f = field("x^2 + y^2 + z^2 - r^2", &[("r", 1.0)]);
    let mut pins = [Pin::new([1.0, 0.0, 0.0]), Pin::new([-1.0, 0.0, 0.0])];
    pins[0].target = Some([2.0, 0.5, 0.0]);
    let steps = drag(&mut f, &mut pins, &[1.0], 60);
    assert!((f.q()[0] - 1.0).abs() < 1e-12);
    // The hand slips over the surface to the point nearest to it.
    let n = (4.25f64).sqrt();
    assert!(
        (pins[0].at[0] - 2.0 / n).abs() < 0.02 && (pins[0].at[1] - 0.5 / n).abs() < 0.02,
        "{:?}",
        pins[0].at
    );
    assert!(steps.iter().map(|s| s.slip[0][1]).sum::<f64>() > 0.2, "the slip is reported");
}

#[test]
fn more_pins_than_parameters_are_least_squares() {
    let mut f = field(SPHERE, &AT);
    let metric = sensitivity(&f, &around()).unwrap();
    // Points of another sphere, all met exactly although they are twelve for four parameters.
    let mut pins: Vec<Pin> = around()
        .iter()
        .step_by(17)
        .map(|p| Pin::new([0, 1, 2].map(|a| 1.1 * p[a] + [0.1, -0.05, 0.2][a])))
        .collect();
    let steps = drag(&mut f, &mut pins, &metric, 20);
    assert_eq!((pins.len(), steps[0].rank), (12, 4));
    for (got, wanted) in f.q().iter().zip([0.1, -0.05, 0.2, 1.1]) {
        assert!((got - wanted).abs() < 1e-9, "{:?}", f.q());
    }
}

#[test]
fn a_guided_pin_gives_way_along_its_line() {
    let mut f = field("x^2 + y^2 + z^2 - r^2", &[("r", 1.0)]);
    let mut pins = [Pin::new([1.0, 0.0, 0.0]), Pin::new([0.0, 1.0, 0.0])];
    pins[0].target = Some([1.5, 0.0, 0.0]);
    pins[1].guide = Guide::Line([0.0, 1.0, 0.0]);
    drag(&mut f, &mut pins, &[1.0], 60);
    assert!((f.q()[0] - 1.5).abs() < 1e-9, "{:?}", f.q());
    assert!((pins[1].at[1] - 1.5).abs() < 1e-9 && pins[1].at[0] == 0.0, "{:?}", pins[1].at);
}

#[test]
fn a_soft_pin_is_missed_at_a_cost() {
    // Minimise (Δr)² + (s/c)² with Δr + s = .1: Δr = .1 / (1 + c²).
    let c = 0.5;
    let mut f = field("x^2 + y^2 + z^2 - r^2", &[("r", 1.0)]);
    let mut pins = [Pin { softness: c, ..Pin::new([1.0, 0.0, 0.0]) }];
    pins[0].target = Some([1.1, 0.0, 0.0]);
    let wide = StepOptions { longest: 1.0, gain: 1.0, tolerance: 1e-9 };
    step(&mut f, &mut pins, &[1.0], &[], &wide).unwrap();
    assert!((f.q()[0] - (1.0 + 0.1 / (1.0 + c * c))).abs() < 1e-12, "{:?}", f.q());
}

#[test]
fn the_desired_change_is_made_where_the_pins_allow() {
    let mut f = field(SPHERE, &AT);
    let metric = sensitivity(&f, &around()).unwrap();
    let mut pins = [Pin::new([1.0, 0.0, 0.0])];
    let report = step(&mut f, &mut pins, &metric, &[0.0, 0.02, 0.0, 0.0], &FINE).unwrap();
    assert!((report.q_change[1] - 0.02).abs() < 1e-3, "{report:?}");
    assert!(off(&f, [1.0, 0.0, 0.0]) < 1e-10);
}

#[test]
fn vanishing_gradients_and_nonsense_are_answered() {
    // On the axis there is no normal, whatever c: the pin there rests, the other one works.
    let mut f = field("(x^2 + y^2) * (z - c)", &[("c", 0.0)]);
    let mut pins = [Pin::new([0.0, 0.0, 0.5]), Pin::new([1.0, 0.0, 0.0])];
    pins[1].target = Some([1.0, 0.0, 0.3]);
    drag(&mut f, &mut pins, &[1.0], 40);
    assert!((f.q()[0] - 0.3).abs() < 1e-9, "{:?}", f.q());
    let mut bad = [Pin::new([f64::NAN, 0.0, 0.0])];
    let error = step(&mut f, &mut bad, &[1.0], &[], &FINE).unwrap_err().to_string();
    assert!(error.contains("pin") && error.contains("finite"), "{error}");
}

#[test]
fn a_pin_far_off_the_surface_draws_it_near_step_by_step() {
    let mut f = field(SPHERE, &AT);
    let metric = sensitivity(&f, &around()).unwrap();
    let mut pins = [Pin::new([0.0, 0.0, 1.0]), Pin::new([3.0, 0.5, 0.0])];
    let mut before = off(&f, pins[1].at);
    for _ in 0..80 {
        let report = step(&mut f, &mut pins, &metric, &[], &FINE).unwrap();
        assert!(!report.stuck);
        assert!(off(&f, [0.0, 0.0, 1.0]) < 1e-10, "the other pin holds all the way");
        let now = off(&f, pins[1].at);
        assert!(now <= before && before - now < 3.0 * FINE.longest, "{before} {now}");
        before = now;
    }
    assert!(before < 1e-10, "{before}");
}

#[test]
fn a_held_pin_is_met_where_derivatives_change_much_within_a_step() {
    // The slope by a grows from 1 to 1.5 in this step: corrections with the slope at its beginning halve what is left, no more.
    let mut f = field("x - exp(a) + b*y^2", &[("a", 0.0), ("b", 0.0)]);
    let target = Some([1.5, 0.0, 0.0]);
    let mut pins = [Pin { target, ..Pin::new([1.0, 0.0, 0.0]) }, Pin::new([1.0, 1.0, 0.0])];
    let options = StepOptions { longest: 0.5, gain: 1.0, tolerance: 1e-10 };
    let report = step(&mut f, &mut pins, &[1.0, 1.0], &[], &options).unwrap();
    assert!(report.residual.iter().all(|r| *r <= 1e-10), "{:?}", report.residual);
    assert_eq!((report.retries, pins[1].at), (0, [1.0, 1.0, 0.0]));
    assert!((pins[0].at[0] - 1.5).abs() < 1e-10);
    let q = f.q();
    assert!((q[0] - 1.5f64.ln()).abs() < 1e-9 && (q[1] - 0.5).abs() < 1e-9, "{q:?}");
}

#[test]
fn what_nothing_can_move_keeps_every_bit() {
    // The angle about an axis of symmetry and the rate of a twist of a solid of revolution: their derivatives are rounding.
    for (formula, free, at) in [
        ("twist(ellipsoid(1, 1, 2), rate=0.1)", "twist/rate", [0.0, 1.0, 0.0]),
        ("rotate(ellipsoid(2, 1, 1), angle=0.3, ax=1, az=0)", "rotate/angle", [0.0, 0.6, 0.8]),
    ] {
        let mut f = field(formula, &[]);
        for i in 0..f.parameters().len() {
            let frozen = f.parameters()[i].path != free;
            f.set_frozen(i, frozen);
        }
        let before = f.q();
        assert_eq!(before.len(), 1, "{formula}");
        let mut points = around();
        isoswarm_particles::project(&f, &mut points, 4.0).unwrap();
        let metric = sensitivity(&f, &points).unwrap();
        let mut pins = [Pin::new(at)];
        pins[0].target = Some([0.3, 1.3, 0.2]);
        for report in drag(&mut f, &mut pins, &metric, 40) {
            assert_eq!((report.rank, f.q()[0].to_bits()), (0, before[0].to_bits()), "{formula}: {report:?}");
        }
        // The pin slips to where the surface is nearest to the hand.
        assert!(off(&f, pins[0].at) < 1e-9 && pins[0].at[0] > 0.05, "{formula}: {pins:?}");
    }
}

#[test]
fn contradictory_drags_are_least_squares_at_any_speed() {
    // Only the radius is free; five hands at 1.3 and one at 1.5: the mean, however short the steps.
    for (longest, steps) in [(0.5, 60), (0.05, 100), (0.005, 1500)] {
        let mut f = field("sqrt(x^2 + y^2 + z^2) - r", &[("r", 1.0)]);
        let mut pins: Vec<Pin> = (0..6)
            .map(|i| {
                let mut at = [0.0; 3];
                at[i / 2] = if i % 2 == 0 { 1.0 } else { -1.0 };
                let far = if i == 0 { 1.5 } else { 1.3 };
                Pin { target: Some(at.map(|v| far * v)), ..Pin::new(at) }
            })
            .collect();
        let options = StepOptions { longest, ..FINE };
        for _ in 0..steps {
            step(&mut f, &mut pins, &[1.0], &[], &options).unwrap();
        }
        assert!((f.q()[0] - 4.0 / 3.0).abs() < 1e-9, "{longest}: {:?}", f.q());
        assert!(pins.iter().all(|p| off(&f, p.at) < 1e-9), "{pins:?}");
    }
}
