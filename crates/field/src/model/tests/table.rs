//! The table of kinds: complete, consistent, and every row builds.

use super::*;

#[test]
fn every_kind_is_described_and_its_defaults_are_valid() {
    for k in kinds() {
        assert!(!k.doc.is_empty() && !k.formula.is_empty(), "{} lacks a description", k.name);
        assert!(
            k.name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'),
            "{}",
            k.name
        );
        assert_eq!(super::super::kind(k.name).map(|k| k.name), Some(k.name));
        assert_eq!(k.group.is_empty(), k.layout != Layout::Groups, "{}", k.name);
        for s in k.params.iter().chain(k.group) {
            assert!(s.bounds.0 <= s.default && s.default <= s.bounds.1, "{} {}", k.name, s.name);
            assert!(!s.doc.is_empty(), "{} {} lacks a description", k.name, s.name);
            assert!(!s.discrete || s.default.fract() == 0.0, "{} {}", k.name, s.name);
            let units = ["length", "angle", "angle/length", "1/length", "value", "index", ""];
            assert!(units.contains(&s.unit), "{} {} has the unit {}", k.name, s.name, s.unit);
        }
    }
}

#[test]
fn the_table_is_published_as_json() {
    let table: serde_json::Value = serde_json::from_str(&super::super::kinds_json()).unwrap();
    let rows = table.as_array().unwrap();
    assert_eq!(rows.len(), kinds().len());
    let sphere = rows.iter().find(|r| r["name"] == "sphere").unwrap();
    assert_eq!(sphere["category"], "shape");
    assert_eq!(sphere["params"][0]["name"], "r");
    assert_eq!(sphere["params"][0]["bounds"][1], serde_json::Value::Null);
    assert_eq!(sphere["operands"]["exactly"], 0);
}

/// Central difference of fourth order.
fn difference(m: &Lowered, p: [f64; 3], axis: usize) -> f64 {
    let h = 1e-3;
    let f = |t: f64| {
        let mut q = p;
        q[axis] += t * h;
        at(m, q).0
    };
    (8.0 * (f(1.0) - f(-1.0)) - (f(2.0) - f(-2.0))) / (12.0 * h)
}

#[test]
fn every_kind_has_the_gradient_of_its_values() {
    // Away from the creases of the operands.
    let points = [[0.31, 0.52, -0.23], [-0.64, 0.17, 0.45], [0.83, -0.74, 0.58]];
    for m in one_of_each() {
        let name = m.kind().name;
        if matches!(name, "stack" | "function") {
            continue; // several components; no derivative of its own
        }
        let lowered = m.lower().unwrap_or_else(|e| panic!("{name}: {e}"));
        for p in points {
            let (f, g) = at(&lowered, p);
            assert!(f.is_finite(), "{name} at {p:?} is {f}");
            for a in 0..3 {
                let d = difference(&lowered, p, a);
                assert!(
                    (g[a] - d).abs() < 2e-6 * (1.0 + d.abs()),
                    "{name} axis {a} at {p:?}: {} against {d}",
                    g[a]
                );
            }
        }
    }
}

#[test]
fn no_solid_is_undefined_at_its_centre_or_on_its_axes() {
    for m in one_of_each() {
        if !m.is_solid() {
            continue;
        }
        let lowered = m.lower().unwrap();
        for p in
            [[0.0; 3], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
        {
            let (f, g) = at(&lowered, p);
            assert!(
                f.is_finite() && g.iter().all(|v| v.is_finite()),
                "{} at {p:?}: {f}, {g:?}",
                m.kind().name
            );
        }
    }
}

#[test]
fn wrong_counts_and_values_are_refused_with_the_reason() {
    let refused = |r: Result<Model, FieldError>, words: &str| {
        let message = r.expect_err(words).to_string();
        assert!(message.contains(words), "{message}");
    };
    let n = |v: f64| Value::Number(v);
    refused(Model::call("sphere", vec![n(-1.0)], vec![]), "r must be above 0, given -1");
    refused(Model::call("sphere", vec![n(f64::NAN)], vec![]), "r must be finite");
    refused(Model::call("sphere", vec![n(1.0), n(2.0)], vec![]), "sphere takes r, given 2 arguments");
    refused(Model::call("sphere", vec![n(1.0)], vec![("r".into(), n(1.0))]), "`r` of sphere is given twice");
    refused(Model::call("sphere", vec![], vec![("radius".into(), n(1.0))]), "no parameter `radius`");
    refused(Model::call("spere", vec![], vec![]), "did you mean `sphere`?");
    refused(Model::call("union", vec![], vec![]), "1 or more operands, given 0");
    refused(Model::call("blobs", vec![n(0.5), n(1.0)], vec![]), "groups of 4");
    refused(Model::call("algebraic", vec![n(0.5), n(1.0)], vec![]), "1, 4, 10, 20, 35");
    refused(Model::call("parameter", vec![], vec![]), "no shape or function");
    refused(Model::constant(f64::INFINITY), "must be finite");
    let ball = || Value::Model(model("sphere()"));
    refused(Model::call("twist", vec![ball(), n(1.0), n(0.5)], vec![]), "axis must be a whole number");
    refused(
        Model::call("r_blend", vec![ball(), ball(), n(0.0)], vec![]).and_then(|m| m.lower().map(|_| m)),
        "s must be 1",
    );
    refused(
        Model::call("twist", vec![ball(), n(1.0), Value::Model(Model::axis(0))], vec![]),
        "axis is discrete",
    );
}

#[test]
fn coefficients_are_named_by_their_exponents_in_the_order_of_the_paper() {
    let names: Vec<String> = monomials(2).into_iter().map(super::super::kinds::coefficient_name).collect();
    let expected = ["c", "c_x1", "c_y1", "c_z1", "c_x2", "c_x1y1", "c_y2", "c_x1z1", "c_y1z1", "c_z2"];
    assert_eq!(names, expected);
    for d in 0..6 {
        assert_eq!(monomials(d).len(), (d + 1) * (d + 2) * (d + 3) / 6, "HBJF02's footnote 1");
    }
    for e in monomials(5) {
        let name = super::super::kinds::coefficient_name(e);
        assert_eq!(super::super::kinds::coefficient_exponents(&name), Some(e));
    }
    for wrong in ["", "c_", "x2", "c_y1x1", "c_x0", "c_x300", "c_x1x1", "cx1"] {
        assert_eq!(super::super::kinds::coefficient_exponents(wrong), None, "{wrong}");
    }
}
