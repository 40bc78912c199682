use super::*;
use crate::{Field, Surface, text};

fn field(formula: &str) -> Field {
    Field::new(&text::parse(formula, &[]).unwrap()).unwrap()
}

fn at(f: &Field, p: V3) -> Local {
    let switches = f.switches().unwrap();
    let mut out = Local::default();
    switches.at(&switches.everywhere(), p, 1e-9, &mut Desk::default(), &mut out);
    out
}

#[test]
fn only_switches_on_the_sides_taken_matter() {
    let f = field("max(abs(x), max(abs(y), abs(z))) - 1");
    // On the face x = 1: the outer maximum and |x|.
    let here = at(&f, [1.0, 0.3, 0.2]);
    assert_eq!((here.value, here.gradient), (0.0, [1.0, 0.0, 0.0]));
    let mut g: Vec<f64> = here.switches.iter().map(|d| d.value).collect();
    g.sort_by(f64::total_cmp);
    assert_eq!(g, [0.7, 1.0]);
    // On the edge x = y = 1 all but |z|.
    let here = at(&f, [1.0, 1.0, 0.2]);
    assert_eq!(here.switches.len(), 4);
    let tied: Vec<V3> = here.switches.iter().filter(|d| d.value == 0.0).map(|d| d.gradient).collect();
    assert_eq!(tied, [[1.0, -1.0, 0.0]]);
    assert!(field("x^2 + y^2 - 1").switches().unwrap().is_empty());
    let cone = field("sqrt(x^2 + (y - 1)^2) - z");
    let switches = cone.switches().unwrap();
    let (boxes, _) = switches.boxes(&Aabb::new([-1.0; 3], [1.1; 3]), 0.1, 1000);
    let tip = [0.0, 1.0, 0.0];
    assert!(boxes.iter().any(|b| b.bounds.contains(tip)));
    // A root whose radicand may vanish, on a surface that passes by: no farther than a box's size from the tip.
    assert!(boxes.iter().all(|b| b.bounds.grown(0.1).contains(tip)));
    assert!(boxes.iter().all(|b| switches.squares(b.tips[0]).len() == 2));
}

#[test]
fn differences_are_the_derivatives_of_their_values() {
    let f = field("min(max(x*y - 0.3, exp(z) - 1), abs(x - y^2) - floor(z + 0.2)) + mod(x, 0.7)");
    let p = [0.31, -0.42, 0.53];
    let here = at(&f, p);
    let h = 1e-6;
    for d in &here.switches {
        for a in 0..3 {
            let side = |s: f64| {
                let mut q = p;
                q[a] += s;
                at(&f, q).of(d.switch).unwrap().value
            };
            let slope = (side(h) - side(-h)) / (2.0 * h);
            assert!((slope - d.gradient[a]).abs() < 1e-8, "{d:?}");
        }
    }
}

#[test]
fn boxes_cover_the_edges_of_a_cube_and_little_else() {
    let f = field("max(abs(x), max(abs(y), abs(z))) - 1");
    let switches = f.switches().unwrap();
    let (boxes, side) = switches.boxes(&Aabb::new([-1.3; 3], [1.3; 3]), 0.05, 1_000_000);
    assert!(side <= 0.05);
    for i in 0..1000 {
        let t = -1.0 + 0.002 * f64::from(i);
        for (s, u) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            for p in [[s, u, t], [s, t, u], [t, s, u]] {
                assert!(boxes.iter().any(|b| b.bounds.contains(p)), "{p:?}");
            }
        }
    }
    // 24 units of edges, at most four boxes around each, and an end.
    assert!(boxes.len() < (4.0 * 24.0 / side) as usize + 8 * 8, "{}", boxes.len());
    // What is left of the function in a box is the function.
    let (mut desk, mut one, mut all) = (Desk::default(), Local::default(), Local::default());
    for b in &boxes {
        let route = &switches.routes(&[b.bounds])[0];
        let p = [0, 1, 2].map(|a| b.bounds.lo[a] + 0.3 * (b.bounds.hi[a] - b.bounds.lo[a]));
        switches.at(route, p, 0.0, &mut desk, &mut one);
        switches.at(&switches.everywhere(), p, 0.0, &mut desk, &mut all);
        assert_eq!((one.value, one.gradient), (all.value, all.gradient));
    }
}

#[test]
fn minima_that_cancel_do_not_matter() {
    let shape = "smooth_union(sphere(r=0.5), translate(sphere(r=0.5), x=0.7), translate(sphere(r=0.4), y=0.6), k=0.1)";
    let f = field(shape);
    let boxes = |f: &Field| f.switches().unwrap().boxes(&Aabb::new([-1.5; 3], [1.5; 3]), 0.05, 100_000).0;
    assert!(boxes(&f).is_empty());
    let cut = field(&format!("{shape} - box(0.3, 0.3, 4)"));
    let switches: Vec<u32> = boxes(&cut).into_iter().flat_map(|b| b.switches).collect();
    assert!(!switches.is_empty());
}
