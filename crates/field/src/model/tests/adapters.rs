//! Deformations about a centre, and adapters made of them.

use super::*;
use crate::model::adapters::{ADAPTERS, Adapter, identity, inverse, is_identity, wrap};
use crate::{Aabb, Field};

const POINTS: [[f64; 3]; 5] =
    [[0.31, 0.52, -0.23], [-0.64, 0.17, 0.45], [0.83, -0.74, 0.58], [1.7, 0.3, -1.1], [-0.2, -1.4, 0.9]];

fn same(a: &str, b: &str) {
    let (a_, b_) = (model(a), model(b));
    for p in POINTS {
        let ((f, s), (g, t)) = (at(&a_.lower().unwrap(), p), at(&b_.lower().unwrap(), p));
        assert!((f - g).abs() < 1e-12 * (1.0 + f.abs()), "{a} = {f} but {b} = {g} at {p:?}");
        assert!((0..3).all(|k| (s[k] - t[k]).abs() < 1e-11), "{a} has {s:?} but {b} has {t:?} at {p:?}");
    }
}

#[test]
fn about_a_centre_is_what_moves_around_the_plain_deformation_give() {
    let there = |inner: &str| format!("translate({inner}, 0.3, -0.2, 0.5)");
    let back = "translate(box(1, 2, 3), -0.3, 0.2, -0.5)";
    let c = "0.3, -0.2, 0.5";
    for axis in 0..3 {
        for (about, plain) in [("twist_about", "twist"), ("taper_about", "taper"), ("bend_about", "bend")] {
            same(
                &format!("{about}(box(1, 2, 3), 0.4, {axis}, {c})"),
                &there(&format!("{plain}({back}, 0.4, {axis})")),
            );
        }
    }
    same(
        &format!("scale_about(box(1, 2, 3), 2, 0.5, 3, {c})"),
        &there(&format!("scale_axes({back}, 2, 0.5, 3)")),
    );
    // A rotation vector of length .7 √14 along (1, 2, 3).
    same(
        &format!("rotate_about(box(1, 2, 3), 0.7, 1.4, 2.1, {c})"),
        &there(&format!("rotate({back}, 0.7*sqrt(14), 1, 2, 3)")),
    );
    for angle in ["1e-12", "3e-3", "0.0999", "0.1001", "0.1999", "0.2001", "3.5"] {
        same(
            &format!("rotate_about(box(1, 2, 3), 0, {angle})"),
            &format!("rotate(box(1, 2, 3), {angle}, 0, 1, 0)"),
        );
    }
}

#[test]
fn a_bend_has_no_seam_where_it_turns_straight() {
    // On both sides of k²(x² + y²) = .01, by the plain formula; and at k = 0 with the derivative by k, x y.
    for k in [1e-3f64, 0.099, 0.101, 0.5, -0.099, -0.101] {
        for p in POINTS {
            let u = value(&model(&format!("bend_about(x, {k:?})")), p);
            let plain = (k * p[0]).atan2(1.0 - k * p[1]) / k;
            assert!((u - plain).abs() < 1e-12, "{k} {p:?}: {u} {plain}");
        }
    }
    let f = Field::new(&model("bend_about(x)")).unwrap();
    let (mut v, mut g, mut q) = ([0.0], [0.0; 3], [0.0]);
    f.parameter_gradient(&[0.3, -0.4, 0.7], &mut v, &mut g, &mut q).unwrap();
    assert_eq!((v, g), ([0.3], [1.0, 0.0, 0.0]));
    assert!((q[0] + 0.12).abs() < 1e-15, "{q:?}");
}

#[test]
fn a_rotation_vector_of_nothing_has_the_derivatives_of_a_small_turn() {
    let f = Field::new(&model("rotate_about(x + 2*y + 5*z)")).unwrap();
    let (mut v, mut g, mut q) = ([0.0], [0.0; 3], [0.0; 3]);
    let p = [0.3, -0.4, 0.7];
    f.parameter_gradient(&p, &mut v, &mut g, &mut q).unwrap();
    // d/dw of a·(p − w × p) is a × p.
    let a = [1.0, 2.0, 5.0];
    let expected = [0, 1, 2].map(|k| a[(k + 1) % 3] * p[(k + 2) % 3] - a[(k + 2) % 3] * p[(k + 1) % 3]);
    assert_eq!(g, a);
    assert!((0..3).all(|k| (q[k] - expected[k]).abs() < 1e-15), "{q:?} {expected:?}");
}

#[test]
fn a_lattice_moves_what_is_in_it() {
    // All displacements alike: a translation, inside and outside of the box.
    let all: Vec<String> = (0..8).map(|_| "0.3, -0.2, 0.1".to_string()).collect();
    same(
        &format!("free_form(box(1, 2, 3), -1, -1, -1, 2, 2, 2, 2, 2, 2, {})", all.join(", ")),
        "translate(box(1, 2, 3), 0.3, -0.2, 0.1)",
    );
    // Linear precision: displacements that grow linearly along x stretch, whatever the number of control points.
    for n in 2..=8 {
        let shift: Vec<String> = (0..n * 2 * 2)
            .map(|i| format!("{}, 0, 0", 0.5 * ((i % n) as f64 / (n - 1) as f64 * 4.0 - 2.0)))
            .collect();
        same(
            &format!("free_form(x^2 + y*z, -2, -2, -2, 4, 4, 4, {n}, 2, 2, {})", shift.join(", ")),
            "(x/2)^2 + y*z",
        );
    }
    assert!(model("free_form(sphere(), nx=2, ny=2, nz=2)").lower().is_ok(), "none given: the identity");
    let most = format!("free_form(sphere(), -1, -1, -1, 2, 2, 2, 2, 2, 2{})", ", 0, 0, 0".repeat(9));
    let e = model(&most).lower().map(|_| ()).unwrap_err().to_string();
    assert!(e.contains("at most nx · ny · nz = 8"), "{e}");
}

#[test]
fn adapters_start_as_nothing_with_their_own_parameters_free() {
    let operand = model("translate(box(1, 2, 3), 0.1)");
    let bounds = Aabb::new([-1.0, -1.0, -2.0], [1.0, 1.0, 2.0]);
    for (row, free) in ADAPTERS.iter().zip([3, 3, 3, 1, 1, 1, 81]) {
        let adapter = Adapter::around(row.name, &bounds).unwrap();
        let node = wrap(&adapter, &operand, "hand").unwrap();
        assert_eq!(identity(&node).unwrap().len(), free, "{}", row.name);
        assert!(is_identity(&node));
        let own = node.params().len();
        let all = node.parameters();
        let moved = all[..own].iter().filter(|p| p.is_free()).count();
        assert_eq!(moved, free, "{}", row.name);
        assert!(all[..own].iter().all(|p| p.path.starts_with("hand/")));
        for p in POINTS {
            assert!((value(&node, p) - value(&operand, p)).abs() < 1e-15, "{} at {p:?}", row.name);
        }
        let (i, v) = identity(&node).unwrap()[0];
        let path = all[i].path.clone();
        let moved = node.edit(&path, |p| p.value = v + 0.1).unwrap();
        assert!(!is_identity(&moved));
    }
    assert!(Adapter::around("squeeze", &bounds).unwrap_err().to_string().contains("mover, rotate"));
    let wide = Adapter { controls: [9, 3, 3], ..Adapter::around("lattice", &bounds).unwrap() };
    assert!(wrap(&wide, &operand, "hand").is_err());
    assert!(identity(&operand.operands()[0]).is_none());
}

#[test]
fn the_inverse_of_an_adapter_is_where_its_operand_is_seen() {
    let operand = model("x^2 + 3*y - z");
    let bounds = Aabb::new([-1.0; 3], [2.0; 3]);
    for row in ADAPTERS {
        let node = wrap(&Adapter::around(row.name, &bounds).unwrap(), &operand, "hand").unwrap();
        let mut k: f64 = 0.0;
        let node = node
            .edit("hand/*", |p| {
                if !p.frozen && &*p.name != "axis" && !p.name.starts_with('n') {
                    k += 0.07;
                    p.value += k.min(0.2);
                }
            })
            .unwrap();
        let back = inverse(&node).unwrap();
        for p in POINTS {
            let before = [0, 1, 2].map(|a| value(&back[a], p));
            assert!((value(&operand, before) - value(&node, p)).abs() < 1e-13, "{} at {p:?}", row.name);
        }
    }
}
