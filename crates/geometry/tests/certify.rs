//! Proofs of topology, against what is known, and what must not be proven.

mod lattice;

use isoswarm_field::Aabb;
use isoswarm_geometry::{Certificate, CertifyOptions, MeshReport, certify};
use lattice::surface;

fn cube(half: f64) -> Aabb {
    Aabb::new([-half; 3], [half; 3])
}

fn run(formula: &str, bounds: Aabb) -> Certificate {
    certify(&surface(formula), &bounds, CertifyOptions::default()).unwrap()
}

#[test]
fn closed_surfaces_are_proven() {
    let cases: [(&str, Aabb, Vec<i64>); 8] = [
        ("x^2 + y^2 + z^2 - 1", cube(1.5), vec![2]),
        // As thin as a twentieth, and flat to fourth order.
        ("x^2 + y^2 + (z/0.05)^2 - 1", Aabb::new([-1.1, -1.1, -0.08], [1.1, 1.1, 0.08]), vec![2]),
        ("x^4 + y^4 + z^4 - 1", cube(1.15), vec![2]),
        ("(sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.0025", cube(1.2), vec![0]),
        (
            "(x^2*(1-x^2)-y^2)^2+0.5*z^2-0.025*(1+x^2+y^2+z^2)",
            Aabb::new([-1.4, -1.0, -0.55], [1.4, 1.0, 0.55]),
            vec![-2],
        ),
        ("x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+11.8", cube(2.6), vec![-8]),
        ("x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+13", cube(2.5), vec![2; 8]),
        (
            "0.55-exp(-((x-0.96)^2+y^2+z^2)/0.7)-exp(-((x+0.96)^2+y^2+z^2)/0.7)",
            Aabb::new([-1.9, -0.9, -0.9], [1.9, 0.9, 0.9]),
            vec![2, 2],
        ),
    ];
    for (formula, bounds, euler) in cases {
        let c = run(formula, bounds);
        assert!(c.proven, "{formula}: {c}");
        assert_eq!(c.euler, Some(euler.iter().sum()), "{formula}");
        assert_eq!(c.components.iter().map(|c| c.euler).collect::<Vec<_>>(), euler, "{formula}");
        let [minima, saddles, maxima] = c.critical.map(|n| n as i64);
        assert_eq!(minima - saddles + maxima, c.euler.unwrap());
    }
}

#[test]
fn shells_lie_inside_each_other() {
    // Radii 1, 2/3 and 1/3, and a ball beside them.
    let c = run(
        "(x^2+y^2+z^2-1)*(x^2+y^2+z^2-0.4444)*(x^2+y^2+z^2-0.1111)*((x-2)^2+y^2+z^2-0.25)",
        Aabb::new([-1.3, -1.3, -1.3], [2.7, 1.3, 1.3]),
    );
    assert!(c.proven && c.components.len() == 4, "{c}");
    let mut depths: Vec<usize> = c.components.iter().map(|c| c.inside.as_ref().unwrap().len()).collect();
    depths.sort_unstable();
    assert_eq!(depths, [0, 0, 1, 2]);
    let innermost = c.components.iter().find(|c| c.inside.as_ref().unwrap().len() == 2).unwrap();
    for &k in innermost.inside.as_ref().unwrap() {
        assert!(c.components[k].inside.as_ref().unwrap().len() < 2);
    }
}

#[test]
fn nothing_is_proven_where_it_is_not_so() {
    let fails = |formula: &str, bounds: Aabb, near: fn([f64; 3]) -> bool, why: &str| {
        let c = run(formula, bounds);
        assert!(!c.proven && c.reason.contains(why) && !c.doubtful.is_empty(), "{formula}: {c}");
        let middle = |b: &Aabb| [0, 1, 2].map(|a| 0.5 * (b.lo[a] + b.hi[a]));
        assert!(c.doubtful.iter().all(|b| near(middle(b))), "{formula}: {:?}", &c.doubtful[0]);
    };
    let at_origin = |p: [f64; 3]| p.iter().all(|v| v.abs() < 1e-3);
    // A node, and a horn torus that touches itself.
    fails("(x^2+y^2+z^2+1)^2-4*x^2-1", cube(1.7), at_origin, "singular");
    fails("(x^2+y^2+z^2)^2-4*(x^2+y^2)", cube(2.3), at_origin, "singular");
    // Creases on which the height has its extremes.
    let on_edge = |p: [f64; 3]| p.iter().filter(|v| v.abs() > 0.99).count() >= 2;
    fails("max(abs(x), max(abs(y), abs(z))) - 1", cube(1.2), on_edge, "creased");
    fails("max(x^2+y^2-1, abs(z)-1)", cube(1.2), |p| p[2].abs() > 0.99, "creased");
    fails("min((x-0.6)^2+y^2+z^2-1,(x+0.6)^2+y^2+z^2-1)", cube(1.8), |p| p[0].abs() < 0.01, "creased");
    // A surface that leaves the box, and one that touches it.
    fails("x^2 + y^2 - z^2 - 0.25", cube(1.0), |p| p.iter().any(|v| v.abs() > 0.999), "reaches the bounds");
    fails(
        "x^2 + y^2 + z^2 - 1",
        Aabb::new([-1.0, -2.0, -2.0], [2.0; 3]),
        |p| p[0] == -1.0,
        "reaches the bounds",
    );
    // A jump is no surface's end.
    let c = run("floor(x + 0.5) + 0.5", cube(2.0));
    assert!(!c.proven, "{c}");
}

#[test]
fn kinks_off_the_critical_points_do_no_harm() {
    // A lens with a crease at its rim, around a cavity: there are directions that no normal at the rim has.
    let c = run("max(x, -x) + (y^2 + z^2) - 1 + 10*max(0, 0.2 - x^2 - y^2 - z^2)", cube(1.3));
    assert!(c.proven && c.components.len() == 2 && c.euler == Some(4), "{c}");
    let c = run("x^2 + y^2 + z^2 - 1 + max(0, 0.2 - x^2 - y^2 - z^2)", cube(1.3));
    assert!(c.proven && c.euler == Some(2), "{c}");
}

#[test]
fn empty_boxes_and_budgets() {
    let c = run("x^2 + y^2 + z^2 + 1", cube(2.0));
    assert!(c.proven && c.euler == Some(0) && c.components.is_empty(), "{c}");
    let decocube =
        "((x^2+y^2-0.9025)^2+(z^2-1)^2)*((y^2+z^2-0.9025)^2+(x^2-1)^2)*((z^2+x^2-0.9025)^2+(y^2-1)^2)-0.01";
    let options = CertifyOptions { boxes: 2000, ..Default::default() };
    let c = certify(&surface(decocube), &cube(1.6), options).unwrap();
    assert!(!c.proven && c.boxes <= 2000 && !c.doubtful.is_empty() && !c.reason.is_empty(), "{c}");
    let mut calls = 0;
    let mut stop = |_| {
        calls += 1;
        calls < 5
    };
    let options = CertifyOptions { goes_on: Some(&mut stop), ..Default::default() };
    assert!(!certify(&surface(decocube), &cube(1.6), options).unwrap().proven);
    let bad = Aabb::new([0.0; 3], [0.0, 1.0, 1.0]);
    let error = certify(&surface("x^2 + y^2 + z^2 - 1"), &bad, CertifyOptions::default()).unwrap_err();
    assert!(error.to_string().contains("lo < hi"), "{error}");
}

#[test]
fn meshes_are_compared() {
    let torus = surface("(x^2+y^2+z^2+0.84)^2-4*(x^2+y^2)");
    let bounds = Aabb::new([-1.6, -1.6, -0.55], [1.6, 1.6, 0.55]);
    let c = certify(&torus, &bounds, CertifyOptions::default()).unwrap();
    let good = lattice::mesh(&torus, &bounds, [30, 30, 12]);
    assert_eq!((c.agrees(&good.topology()), c.difference(&good.topology())), (Some(true), None));
    // Too coarse a lattice misses the hole.
    let ball = lattice::mesh(&surface("x^2+y^2+z^2-1"), &cube(1.3), [8; 3]);
    assert_eq!(c.agrees(&ball.topology()), Some(false));
    let mut open = good.clone();
    open.faces.pop();
    assert!(c.difference(&open.topology()).unwrap().contains("not a closed"));
    assert_eq!(Certificate::default().agrees(&good.topology()), None);
    let mut report = MeshReport { topology: ball.topology(), ..MeshReport::default() };
    report.certify(&c);
    assert!(report.certified == Some(false) && report.warnings[0].contains("[0]"), "{report:?}");
}

#[test]
fn proofs_do_not_depend_on_threads() {
    let bounds = Aabb::new([-1.4, -1.0, -0.55], [1.4, 1.0, 0.55]);
    let one = || run("(x^2*(1-x^2)-y^2)^2+0.5*z^2-0.025*(1+x^2+y^2+z^2)", bounds);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(one), one());
}
