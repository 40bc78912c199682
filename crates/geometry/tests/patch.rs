//! Meshes of parametric surfaces.

use std::f64::consts::{PI, TAU};

use isoswarm_field::model::{Model, Value};
use isoswarm_field::{Field, text};
use isoswarm_geometry::{Fault, Mesh, mesh_patch};
use isoswarm_particles::Amount;
use isoswarm_particles::parametric::{Domain, Patch, Wrap};

fn field(formulas: [&str; 3]) -> Field {
    let one = |f: &str| {
        let options = text::Options { axes: 2, ..text::Options::default() };
        Value::Model(text::parse_with(f, &[], options).unwrap())
    };
    Field::new(&Model::call("stack", formulas.map(one).to_vec(), vec![]).unwrap()).unwrap()
}

fn mesh(formulas: [&str; 3], lo: [f64; 2], hi: [f64; 2], wrap: [Wrap; 2], n: usize) -> (Mesh, f64) {
    let field = field(formulas);
    let patch = Patch::new(&field, Domain { lo, hi, wrap }).unwrap();
    let samples = patch.sample(Amount::Count(n), 0, 100_000).unwrap();
    (mesh_patch(&patch, &samples).unwrap(), samples.area)
}

#[test]
fn closed_surfaces_are_closed() {
    let (m, area) = mesh(
        ["(1 + 0.4*cos(y))*cos(x)", "(1 + 0.4*cos(y))*sin(x)", "0.4*sin(y)"],
        [0.0; 2],
        [TAU; 2],
        [Wrap::Periodic; 2],
        1500,
    );
    let t = m.topology();
    assert!(t.is_closed() && t.euler == [0] && t.vertices == 1500, "{t:?}");
    assert!((m.area() / area - 1.0).abs() < 0.01 && m.volume() > 0.0);
    assert!(m.quality().q_avg > 0.9, "{:?}", m.quality());
    let (m, area) = mesh(
        ["cos(x)*sin(y)", "sin(x)*sin(y)", "-cos(y)"],
        [0.0; 2],
        [TAU, PI],
        [Wrap::Periodic, Wrap::Open],
        1000,
    );
    let t = m.topology();
    assert!(t.is_closed() && t.euler == [2], "{t:?}");
    assert!((m.area() / area - 1.0).abs() < 0.01);
    assert!(m.quality().q_avg > 0.9, "{:?}", m.quality());
}

#[test]
fn open_surfaces_end_at_their_edges() {
    // A saddle over a square, and a tube.
    let (m, area) = mesh(["x", "y", "x*y"], [-1.0; 2], [1.0; 2], [Wrap::Open; 2], 800);
    let t = m.topology();
    assert!(t.is_manifold() && t.boundaries == 1 && t.euler == [1], "{t:?}");
    assert!((m.area() / area - 1.0).abs() < 0.01, "{} {area}", m.area());
    let (m, _) = mesh(["cos(x)", "sin(x)", "y"], [0.0; 2], [TAU, 2.0], [Wrap::Periodic, Wrap::Open], 800);
    let t = m.topology();
    assert!(t.is_manifold() && t.boundaries == 2 && t.euler == [0], "{t:?}");
}

#[test]
fn a_moebius_strip_has_one_edge_and_no_sides() {
    let r = "(1 + 0.4*y*cos(x/2))";
    let formulas = [format!("{r}*cos(x)"), format!("{r}*sin(x)"), "0.4*y*sin(x/2)".into()];
    let formulas = [&formulas[0][..], &formulas[1], &formulas[2]];
    let (m, area) = mesh(formulas, [0.0, -1.0], [TAU, 1.0], [Wrap::Twisted, Wrap::Open], 800);
    let t = m.topology();
    assert!(t.faults.iter().all(|f| matches!(f, Fault::Orientation { .. })) && !t.faults.is_empty(), "{t:?}");
    assert_eq!((t.boundaries, t.euler.clone()), (1, vec![0]));
    assert!((m.area() / area - 1.0).abs() < 0.01);
}
