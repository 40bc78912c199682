//! Samples of parametric surfaces.

use std::f64::consts::{PI, TAU};

use isoswarm_field::model::{Model, Value};
use isoswarm_field::{Field, text};
use isoswarm_particles::parametric::{Domain, Patch, Wrap};
use isoswarm_particles::{Amount, Error};

/// x, y and z as formulas of the parameters, which are called x and y there.
fn field(formulas: [&str; 3]) -> Field {
    let one = |f: &str| {
        let options = text::Options { axes: 2, ..text::Options::default() };
        Value::Model(text::parse_with(f, &[], options).unwrap())
    };
    Field::new(&Model::call("stack", formulas.map(one).to_vec(), vec![]).unwrap()).unwrap()
}

fn torus() -> Field {
    field(["(1 + 0.4*cos(y))*cos(x)", "(1 + 0.4*cos(y))*sin(x)", "0.4*sin(y)"])
}

fn square(wrap: [Wrap; 2]) -> Domain {
    Domain { lo: [0.0; 2], hi: [TAU; 2], wrap }
}

#[test]
fn a_torus_is_even() {
    let field = torus();
    let patch = Patch::new(&field, square([Wrap::Periodic; 2])).unwrap();
    let s = patch.sample(Amount::Count(2000), 1, 10_000).unwrap();
    assert_eq!((s.points.len(), s.uv.len(), s.normals.len()), (2000, 2000, 2000));
    assert!((s.area / (1.6 * PI * PI) - 1.0).abs() < 1e-12, "{}", s.area);
    assert!(
        s.settled && s.evenness.rho_avg > 0.92 && s.evenness.rho_min > 0.6 && s.evenness.cv < 0.07,
        "{:?}",
        s.evenness
    );
    for ((p, uv), n) in s.points.iter().zip(&s.uv).zip(&s.normals) {
        assert!(((p[0].hypot(p[1]) - 1.0).hypot(p[2]) - 0.4).abs() < 1e-14);
        assert!(uv.iter().all(|v| (0.0..=TAU).contains(v)));
        let out = [uv[0].cos() * uv[1].cos(), uv[0].sin() * uv[1].cos(), uv[1].sin()];
        assert!((0..3).all(|a| (n[a] - out[a]).abs() < 1e-12));
    }
}

#[test]
fn a_sphere_has_its_poles_and_no_crowd_there() {
    let sphere = field(["cos(x)*sin(y)", "sin(x)*sin(y)", "-cos(y)"]);
    let domain = Domain { lo: [0.0; 2], hi: [TAU, PI], wrap: [Wrap::Periodic, Wrap::Open] };
    let patch = Patch::new(&sphere, domain).unwrap();
    assert_eq!(patch.poles(), [[false; 2], [true; 2]]);
    let s = patch.sample(Amount::Count(1500), 0, 10_000).unwrap();
    assert!(
        s.evenness.rho_avg > 0.92 && s.evenness.rho_min > 0.6 && s.evenness.coverage < 0.85,
        "{:?}",
        s.evenness
    );
    assert_eq!((s.points[0][2], s.points[1][2]), (-1.0, 1.0));
    assert!((s.normals[0][2].abs() - 1.0).abs() < 1e-6 && s.normals[0][2] * s.normals[1][2] < 0.0);
    // As many near the poles as by area: caps of height .1 hold a twentieth each.
    let cap = |sign: f64| s.points.iter().filter(|p| sign * p[2] > 0.9).count();
    assert!((65..=85).contains(&cap(1.0)) && (65..=85).contains(&cap(-1.0)), "{} {}", cap(1.0), cap(-1.0));
}

#[test]
fn a_moebius_strip_has_one_side_and_one_edge() {
    let r = "(1 + 0.4*y*cos(x/2))";
    let strip = field([&format!("{r}*cos(x)"), &format!("{r}*sin(x)"), "0.4*y*sin(x/2)"]);
    let domain = |wrap| Domain { lo: [0.0, -1.0], hi: [TAU, 1.0], wrap };
    let error = Patch::new(&strip, domain([Wrap::Periodic, Wrap::Open])).unwrap_err();
    assert!(matches!(&error, Error::Option { name: "periodic", .. }), "{error}");
    let patch = Patch::new(&strip, domain([Wrap::Twisted, Wrap::Open])).unwrap();
    let s = patch.sample(Amount::Count(1200), 0, 10_000).unwrap();
    // Nearest neighbours, over the seam too.
    let near: Vec<f64> = s
        .points
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let d = |q: &[f64; 3]| (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>().sqrt();
            s.points
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != i)
                .map(|(_, q)| d(q))
                .fold(f64::INFINITY, f64::min)
        })
        .collect();
    let mean = near.iter().sum::<f64>() / 1200.0;
    let packed = (2.0 * s.area / 3f64.sqrt() / 1200.0).sqrt();
    let cv = (near.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / 1200.0).sqrt() / mean;
    assert!(mean > 0.85 * packed && cv < 0.12, "{} {cv}", mean / packed);
    let on_edge = s.uv.iter().filter(|p| p[1].abs() == 1.0).count();
    // The edge runs around twice; neighbours there are about as far apart as elsewhere.
    let edge = 2.0 * TAU * 1.02;
    assert!((on_edge as f64 - edge / mean).abs() < 0.3 * edge / mean, "{on_edge} {}", edge / mean);
}

#[test]
fn spacing_seeds_and_threads() {
    let field = torus();
    let patch = Patch::new(&field, square([Wrap::Periodic; 2])).unwrap();
    let s = patch.sample(Amount::Spacing(0.1), 3, 10_000).unwrap();
    assert!((s.spacing / 0.1 - 1.0).abs() < 0.05, "{}", s.spacing);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(|| patch.sample(Amount::Spacing(0.1), 3, 10_000).unwrap()), s);
    assert_ne!(patch.sample(Amount::Spacing(0.1), 4, 10_000).unwrap().points, s.points);
}

#[test]
fn bad_input_is_refused() {
    let field = torus();
    let message = |domain: Domain| Patch::new(&field, domain).unwrap_err().to_string();
    assert!(message(Domain { hi: [0.0, 1.0], ..square([Wrap::Open; 2]) }).contains("lo < hi"));
    assert!(message(Domain { hi: [1.0, TAU], ..square([Wrap::Periodic; 2]) }).contains("same curve"));
    let patch = Patch::new(&field, square([Wrap::Periodic; 2])).unwrap();
    assert!(patch.sample(Amount::Count(0), 0, 100).is_err());
    assert!(patch.sample(Amount::Count(101), 0, 100).is_err());
    assert!(patch.sample(Amount::Spacing(f64::NAN), 0, 100).is_err());
    let point = self::field(["1 + 0*x", "y*0", "x*0 + 2"]);
    assert!(
        Patch::new(&point, square([Wrap::Open; 2]))
            .and_then(|p| p.sample(Amount::Count(50), 0, 100))
            .is_err()
    );
    let scalar = Field::new(&text::parse("x + y + z", &[]).unwrap()).unwrap();
    assert!(Patch::new(&scalar, square([Wrap::Open; 2])).unwrap_err().to_string().contains("components"));
    let nan = self::field(["1/x", "y", "sqrt(x - 1)"]);
    assert!(Patch::new(&nan, square([Wrap::Open; 2])).unwrap_err().to_string().contains("finite"));
}
