//! Order, paths and editing of parameters.

use super::*;

fn paths(m: &Model) -> Vec<String> {
    m.parameters().into_iter().map(|p| p.path).collect()
}

#[test]
fn a_nodes_own_parameters_come_before_its_operands() {
    let m = model("smooth_union(sphere(2), translate(box(1, 2, 3), 4, 5, 6), k=0.5)");
    let expected = [
        "smooth_union/k",
        "sphere/r",
        "translate/x",
        "translate/y",
        "translate/z",
        "box/x",
        "box/y",
        "box/z",
    ];
    assert_eq!(paths(&m), expected);
    let values: Vec<f64> = m.parameters().iter().map(|p| p.value).collect();
    assert_eq!(values, [0.5, 2.0, 4.0, 5.0, 6.0, 1.0, 2.0, 3.0], "HBJF02 section 3");
}

#[test]
fn paths_have_the_names_above_and_are_unique() {
    let m = model("arm = capsule(0.2); body = arm | sphere() | sphere(2); body | translate(body, 3)");
    assert_eq!(
        paths(&m),
        [
            "body/arm/r",
            "body/arm/h",
            "body/sphere/r",
            "body/sphere_2/r",
            "translate/x",
            "translate/y",
            "translate/z"
        ],
        "a part that occurs twice has its parameters once"
    );
    let m = model("sphere(1) | sphere(2)").named("top").unwrap();
    assert_eq!(paths(&m), ["top/sphere/r", "top/sphere_2/r"]);
    let m = crate::text::parse("body = sphere(r) | x^2 - r; body", &[("r", 2.0)]).unwrap();
    assert_eq!(paths(&m), ["r"], "a free-standing parameter is its name");
    let twice =
        Model::parameter("r", 1.0).unwrap().operator("+", &Model::parameter("r", 2.0).unwrap()).unwrap();
    assert_eq!(paths(&twice), ["r", "r_2"]);
}

#[test]
fn a_parameter_may_be_an_expression() {
    let m = crate::text::parse("sphere(r=2*a) | box(a, 1, 1)", &[("a", 0.5)]).unwrap();
    assert_eq!(paths(&m), ["a", "box/y", "box/z"]);
    assert_eq!(value(&m, [1.5, 0.0, 0.0]), 0.5);
    let m = m.with_value("a", 1.0).unwrap();
    assert_eq!(value(&m, [3.0, 0.0, 0.0]), 1.0);
    assert_eq!(value(&model("sphere(r=1 + z)"), [0.0, 0.0, 2.0]), -1.0, "evaluated where the node is");
    assert_eq!(model("sphere(r=1/4 + 2)").params()[0].value, 2.25, "constants are plain values");
}

#[test]
fn discrete_parameters_are_visible_constants() {
    let m = model("superelliptic_blend(sphere(), torus(), d=3)");
    let d = m.parameters().into_iter().find(|p| p.path.ends_with("/d")).unwrap();
    assert!(d.discrete && d.value == 3.0);
    let lowered = m.lower().unwrap();
    let used: Vec<usize> = lowered
        .graph
        .exprs
        .iter()
        .filter_map(|e| if let Expr::Param(k) = e { Some(*k as usize) } else { None })
        .collect();
    assert!(used.iter().all(|&k| !lowered.params[k].discrete));
    assert_eq!(used.len(), lowered.params.len() - 1, "all others are in the graph");
    assert!(m.with_value("superelliptic_blend/d", 2.5).is_err());
    assert!(m.with_value("superelliptic_blend/d", 4.0).is_ok());
}

#[test]
fn numbers_of_the_graph_are_places_in_the_list() {
    let m = model("blobs(0.5, 1, 2, 3, 4) + x*sphere(7)");
    let lowered = m.lower().unwrap();
    assert_eq!(lowered.params, m.parameters());
    let names: Vec<&str> = lowered.params.iter().map(|p| p.path.as_str()).collect();
    assert_eq!(names, ["blobs/bias", "blobs/x0", "blobs/y0", "blobs/z0", "blobs/r0", "sphere/r"]);
    assert_eq!((lowered.params[4].unit, lowered.params[0].unit), ("length", "value"));
}

#[test]
fn editing_leaves_the_original_and_shares_the_rest() {
    let m = model("sphere(1) | torus(3, 0.5) | sphere(2)");
    let n = m.with_value("sphere_2/r", 5.0).unwrap();
    assert_eq!(m.parameters()[3].value, 2.0);
    assert_eq!(n.parameters()[3].value, 5.0);
    assert_eq!(m.operands()[1].id(), n.operands()[1].id(), "the torus is shared");
    let f = m.with_frozen("sphere*", true).unwrap();
    let frozen: Vec<bool> = f.parameters().iter().map(|p| p.frozen).collect();
    assert_eq!(frozen, [true, false, false, true]);
    let b = m.with_bounds("torus/*", 0.1, 4.0).unwrap().with_scale("*/minor", 0.01).unwrap();
    assert_eq!(b.parameters()[2].bounds, (0.1, 4.0));
    assert_eq!(b.parameters()[2].scale, 0.01);
    assert!(b.with_value("torus/major", 9.0).unwrap_err().to_string().contains("between 0.1 and 4"));
    let v = m.with_values(&[1.5, 2.5, 0.5, 3.5]).unwrap();
    assert_eq!(v.parameters().iter().map(|p| p.value).collect::<Vec<_>>(), [1.5, 2.5, 0.5, 3.5]);
    assert!(matches!(m.with_values(&[1.0]), Err(FieldError::Shape { .. })));
    assert!(m.with_value("sphere/r", f64::NAN).is_err());
    assert!(m.with_bounds("*", 2.0, 1.0).is_err());
    let e = m.with_value("sphere/q", 1.0).unwrap_err().to_string();
    assert!(e.contains("no parameter is called `sphere/q`") && e.contains("torus/major"), "{e}");
}

#[test]
fn a_shared_part_stays_shared_after_an_edit() {
    let m = model("ball = sphere(1); ball | translate(ball, 3)");
    let n = m.with_value("ball/r", 2.0).unwrap();
    assert_eq!(paths(&n), paths(&m));
    assert_eq!(n.operands()[0].id(), n.operands()[1].operands()[0].id());
}

#[test]
fn names_are_checked() {
    for bad in ["", "a/b", "a*", "a\nb"] {
        assert!(model("sphere()").named(bad).is_err(), "{bad:?}");
    }
    assert_eq!(model("sphere()").named("Kugel 1").unwrap().name(), Some("Kugel 1"));
}
