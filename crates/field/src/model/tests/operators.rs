//! Set operations, blends and deformations: known values and identities.

use super::*;

const POINTS: [[f64; 3]; 5] =
    [[0.31, 0.52, -0.23], [-0.64, 0.17, 0.45], [0.83, -0.74, 0.58], [1.7, 0.3, -1.1], [-0.2, -1.4, 0.9]];

/// Both texts have the same values.
fn same(a: &str, b: &str) {
    let (a_, b_) = (model(a), model(b));
    for p in POINTS {
        let (f, g) = (value(&a_, p), value(&b_, p));
        assert!((f - g).abs() < 1e-12 * (1.0 + f.abs()), "{a} = {f} but {b} = {g} at {p:?}");
    }
}

#[test]
fn set_operations() {
    same("sphere() | box(2, 1, 1)", "min(sphere(), box(2, 1, 1))");
    same("sphere() & box(2, 1, 1)", "max(sphere(), box(2, 1, 1))");
    same("sphere() - box(2, 1, 1)", "max(sphere(), -box(2, 1, 1))");
    same("sphere() - box(2, 1, 1) - torus()", "sphere() & ~box(2, 1, 1) & ~torus()");
    same("sub(sphere(), box(2, 1, 1))", "1*sphere() - box(2, 1, 1)");
    same("sphere() - 0.2", "offset(sphere(), 0.2)");
    same("shell(sphere(), 0.2)", "abs(sphere()) - 0.1");
    same("~(sphere() | torus())", "~sphere() & ~torus()");
}

#[test]
fn hidden_operands_are_left_out() {
    same("sphere() | hidden(box(2, 1, 1))", "sphere()");
    same("hidden(sphere()) & box(2, 1, 1) & torus()", "box(2, 1, 1) & torus()");
    same("sphere() - hidden(box(2, 1, 1)) - torus()", "sphere() - torus()");
    same(
        "smooth_union(sphere(), hidden(box(2, 1, 1)), torus(), k=0.3)",
        "smooth_union(sphere(), torus(), k=0.3)",
    );
    // An operator of two gives way to the one that is left.
    same("superelliptic_blend(sphere(), hidden(torus()))", "sphere()");
    same("blend(hidden(sphere()), torus(), h=f*g + 1)", "torus()");
    // An operator with nothing left is left out itself.
    same("sphere() | translate(hidden(box(1, 1, 1)), 2)", "sphere()");
    same("sphere() | ~(hidden(torus()) | hidden(box(1, 1, 1)))", "sphere()");
    same("twist(sphere() | hidden(torus()), 0.3)", "twist(sphere(), 0.3)");
}

#[test]
fn a_model_of_which_everything_is_hidden_is_none() {
    for text in ["hidden(sphere())", "translate(hidden(sphere()), 1)", "hidden(sphere()) | hidden(torus())"] {
        let refused = crate::Field::new(&model(text)).expect_err(text).to_string();
        assert!(refused.contains("every part of the model is hidden"), "{refused}");
    }
}

#[test]
fn moves_are_inverse_transformations_of_space() {
    same("translate(sphere(), 1, -2, 3)", "sqrt((x-1)^2 + (y+2)^2 + (z-3)^2) - 1");
    same("scale(box(2, 1, 1), 2)", "box(4, 2, 2)");
    same("scale_axes(sphere(), 1, 2, 3)", "ellipsoid(1, 2, 3)");
    // A quarter turn about z takes x to y.
    same("rotate(box(2, 1, 1), pi/2)", "box(1, 2, 1)");
    same("rotate(translate(sphere(0.1), 1), pi/2)", "translate(sphere(0.1), 0, 1)");
    same(
        "rotate(translate(sphere(0.1), 1), 0.7, 0, 0, 5)",
        "rotate_euler(translate(sphere(0.1), 1), 0, 0, 0.7)",
    );
    same("rotate(translate(sphere(0.1), 0, 1), pi/2, 1, 0, 0)", "translate(sphere(0.1), 0, 0, 1)");
    same("rotate(translate(sphere(0.1), 0, 0, 1), pi/2, 0, 1, 0)", "translate(sphere(0.1), 1, 0, 0)");
    same(
        "rotate_euler(translate(box(1, 2, 3), 0.3, 0.4, 0.5), 0.5, 0.6, 0.7)",
        "rotate(rotate(rotate(translate(box(1, 2, 3), 0.3, 0.4, 0.5), 0.5, 1, 0, 0), 0.6, 0, 1, 0), 0.7, 0, 0, 1)",
    );
    same("rotate(translate(box(1, 2, 3), 0.3), 2*pi/3, 1, 1, 1)", "translate(box(3, 1, 2), 0, 0.3)");
}

#[test]
fn mirror_and_repeat() {
    let m = model("mirror(translate(sphere(0.5), 1))");
    assert_eq!([value(&m, [1.0, 0.0, 0.0]), value(&m, [-1.0, 0.0, 0.0])], [-0.5, -0.5]);
    let m = model("mirror(translate(sphere(0.5), 3), 2, 0, 0, 1)");
    assert_eq!([value(&m, [3.0, 0.0, 0.0]), value(&m, [-1.0, 0.0, 0.0])], [-0.5, -0.5]);
    let m = model("repeat(sphere(0.5), 2, 3)");
    for p in [[0.0; 3], [2.0, 0.0, 0.0], [-8.0, 9.0, 0.0]] {
        assert_eq!(value(&m, p), -0.5);
    }
    assert_eq!(value(&m, [0.0, 0.0, 2.0]), 1.5, "z is not repeated");
    let m = model("repeat(sphere(0.5), 2, nx=2)");
    assert_eq!([-3.0, -1.0, 1.0, 3.0].map(|x| value(&m, [x, 0.0, 0.0])), [1.5, -0.5, -0.5, 1.5]);
    let m = model("repeat(sphere(0.5), 2, nx=3)");
    assert_eq!([-4.0, -2.0, 0.0, 2.0, 4.0].map(|x| value(&m, [x, 0.0, 0.0])), [1.5, -0.5, -0.5, -0.5, 1.5]);
}

#[test]
fn deformations() {
    // Twisted by a quarter turn at z = 1.
    let m = model("twist(translate(sphere(0.1), 1, 0, 1), pi/2)");
    assert!((value(&m, [0.0, 1.0, 1.0]) + 0.1).abs() < 1e-12);
    // A rod along x bent to a circle of radius 2 about (0, 2): a quarter of its length π ends at (2, 2).
    let m = model("bend(translate(sphere(0.1), pi), 0.5)");
    assert!((value(&m, [2.0, 2.0, 0.0]) + 0.1).abs() < 1e-12);
    same("bend(box(3, 1, 1), 0)", "box(3, 1, 1)");
    let (straight, nearly) = (model("bend(box(3, 1, 1), 1e-9)"), model("bend(box(3, 1, 1), 1e-7)"));
    for p in POINTS {
        assert!((value(&straight, p) - value(&nearly, p)).abs() < 1e-6);
    }
    let m = model("bend(translate(sphere(0.1), 0, 0, pi), 0.5, 1)");
    assert!((value(&m, [2.0, 0.0, 2.0]) + 0.1).abs() < 1e-12, "about y, z is bent towards x");
    let m = model("taper(cylinder(1, 10), 0.5)");
    assert!(value(&m, [2.0, 0.0, 2.0]).abs() < 1e-12 && value(&m, [1.0, 0.0, 0.0]).abs() < 1e-12);
    let m = model("twist(translate(sphere(0.1), 1, 1, 0), pi/2, 0)");
    assert!((value(&m, [1.0, 0.0, 1.0]) + 0.1).abs() < 1e-12, "about x, y is turned to z");
}

#[test]
fn blends_of_the_paper() {
    same("blobby_blend(sphere(), torus(), 2, 0.1, 0.2)", "2 - exp(-sphere() - 0.1) - exp(-torus() - 0.2)");
    same(
        "superelliptic_blend(sphere(), torus(), 0.5, 0.7, 3)",
        "1 - max(0, 1 - sphere()/0.5)^3 - max(0, 1 - torus()/0.7)^3",
    );
    same("r_blend(sphere(), torus())", "sphere() + torus() - hypot(sphere(), torus())");
    same(
        "r_blend(sphere(), torus(), 1, 3)",
        "(sphere() + torus() + hypot(sphere(), torus()))*(sphere()^2 + torus()^2)^1.5",
    );
    same("blend(sphere(), torus(), h=f*g - 0.1)", "sphere()*torus() - 0.1");
    same("blend(sphere(), torus(), f + 2*g)", "sphere() + 2*torus()");
}

#[test]
fn the_signs_of_the_blends_are_those_of_union_and_intersection() {
    // f and g as coordinates, in all four quadrants.
    for (f, g) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 0.1), (0.3, -2.0)] {
        let h = |text: &str| value(&model(text), [f, g, 0.0]);
        assert_eq!(h("r_blend(x, y, 1)") < 0.0, f < 0.0 && g < 0.0, "s = 1 is the intersection at {f}, {g}");
        assert_eq!(h("r_blend(x, y, -1)") < 0.0, f < 0.0 || g < 0.0, "s = -1 is the union at {f}, {g}");
        for d in [2, 3, 4, 5] {
            let h = h(&format!("superelliptic_blend(x, y, 0.5, 0.5, {d})"));
            assert_eq!(h < 0.0, f < 0.0 || g < 0.0, "a union away from the seam at {f}, {g}, d = {d}");
        }
    }
    // It stays outside where eq. 5 as printed closes again.
    assert!(value(&model("superelliptic_blend(x, y, 0.5, 0.5, 2)"), [1.0, 1.0, 0.0]) > 0.0);
}

#[test]
fn the_derivative_of_an_r_function_is_defined_at_the_crease() {
    let (f, g) = at(&model("r_blend(x, y, -1, 0)").lower().unwrap(), [0.0, 0.0, 0.7]);
    assert_eq!((f, g), (0.0, [1.0, 1.0, 0.0]));
    for d in 1..5 {
        let (f, g) = at(&model(&format!("r_blend(x, y, -1, {d})")).lower().unwrap(), [0.0, 0.0, 0.7]);
        assert_eq!((f, g), (0.0, [0.0; 3]), "d = {d}");
    }
}

#[test]
fn smooth_minima_are_safe_and_tight() {
    let m = model("smooth_union(x, y, z, k=0.1)");
    let v = value(&m, [1.0, 1.0, 1.0]);
    assert!((v - (1.0 - 0.1 * 3f64.ln())).abs() < 1e-15, "three equal operands move the surface by k ln 3");
    // Naively exp(−f/k) would overflow or vanish here.
    for p in [[-500.0, 3.0, 900.0], [1e6, 2e6, 3e6]] {
        let (v, g) = at(&m.lower().unwrap(), p);
        assert_eq!((v, g), (p[0], [1.0, 0.0, 0.0]));
    }
    same("smooth_intersection(sphere(), torus())", "-smooth_union(-sphere(), -torus())");
    same("smooth_difference(sphere(), torus(), k=0.3)", "smooth_intersection(sphere(), -torus(), k=0.3)");
    same("smooth_union(sphere(), torus(), k=0.3)", "-0.3*ln(exp(-sphere()/0.3) + exp(-torus()/0.3))");
    let q = model("quadratic_union(x, y, k=0.5)");
    assert_eq!(
        [value(&q, [1.0, 1.0, 0.0]), value(&q, [1.0, 1.5, 0.0]), value(&q, [1.0, 3.0, 0.0])],
        [0.875, 1.0, 1.0]
    );
}

#[test]
fn shapes_are_solids_and_formulas_are_not() {
    assert_eq!(model("sphere() - torus()").kind().name, "difference");
    assert_eq!(model("translate(x^2 - 1, 1) - torus()").kind().name, "difference");
    assert_eq!(model("x^2 - torus()").kind().name, "sub");
    assert_eq!(model("torus() - 0.1").kind().name, "sub");
    let (a, b) = (model("sphere()"), model("torus()"));
    let chain = a.operator("|", &b).unwrap().operator("|", &a).unwrap();
    assert_eq!(chain.operands().len(), 3, "a chain is one node");
    assert_eq!(a.operator("-", &b).unwrap().kind().name, "difference");
    assert_eq!(Model::axis(0).operator("-", &b).unwrap().kind().name, "sub");
    assert!(a.operator("@", &b).is_err());
}

#[test]
fn functions_are_leaves_called_where_they_are_used() {
    let f = Model::function(Arc::new(Ball)).unwrap();
    let moved = Model::call("translate", vec![Value::Model(f.clone()), Value::Number(2.0)], vec![]).unwrap();
    let both = f.operator("|", &moved).unwrap();
    let lowered = both.lower().unwrap();
    assert_eq!(lowered.leaves.len(), 2, "one for each place");
    assert_eq!(lowered.leaves[0].name, "ball");
    assert_eq!(at(&lowered, [2.0, 0.0, 0.0]).0, -1.0);
    assert_eq!(
        f.operator("+", &f).unwrap().lower().unwrap().leaves.len(),
        1,
        "the same place is called once"
    );
    // A function of a function's value.
    let h = Payload::Expression(f.clone());
    let nested =
        Model::new(super::super::kind("blend").unwrap(), vec![], vec![f.clone(), Model::axis(2)], h).unwrap();
    let lowered = nested.lower().unwrap();
    assert_eq!(at(&lowered, [0.0, 0.0, 2.0]).0, 9.0 + 4.0 - 1.0);
}

#[test]
fn axes_and_components_are_counted() {
    let axes = |text: &str| model(text).lower().unwrap().axes;
    assert_eq!(axes("x^2 + y^2 - 1"), 3, "a cylinder");
    assert_eq!(axes("planar(x)^2 + planar(y)^2 - 1"), 2);
    assert_eq!(axes("planar(sphere())"), 2);
    assert_eq!(axes("planar(x) + z"), 3);
    let two = crate::text::Options { axes: 2, blend: false };
    let curve = crate::text::parse_with("x^2 + y^2 - 1", &[], two).unwrap().lower().unwrap();
    assert_eq!((curve.axes, curve.roots.len()), (2, 1));
    let curve = model("stack(sphere(), x + y, z)").lower().unwrap();
    assert_eq!((curve.axes, curve.roots.len()), (3, 3));
    let e = model("sphere() | stack(sphere(), x)").lower().unwrap_err().to_string();
    assert!(e.contains("only the outermost node"), "{e}");
}
