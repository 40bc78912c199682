//! Depth and size: refused with a reason, never a crash.

use super::*;
use crate::model::MAX_DEPTH;

/// Runs a test on a thread with a small stack, so that unguarded recursion would fail.
fn on_small_stack(test: impl FnOnce() + Send + 'static) {
    std::thread::Builder::new().stack_size(512 * 1024).spawn(test).unwrap().join().unwrap();
}

fn deep(n: usize) -> Model {
    (1..n).fold(Model::axis(0), |m, _| Model::call("sin", vec![Value::Model(m)], vec![]).unwrap())
}

#[test]
fn the_deepest_tree_lowers_prints_compares_and_drops() {
    on_small_stack(|| {
        let m = deep(MAX_DEPTH);
        assert_eq!(m.depth(), MAX_DEPTH);
        assert_eq!(m.lower().unwrap().graph.len(), MAX_DEPTH + 2);
        assert!(m.parameters().is_empty());
        let text = m.to_text().unwrap();
        assert!(
            crate::text::parse(&text, &[]).unwrap() == m,
            "deep parts are named so that the text can be read"
        );
        assert!(crate::json::from_json(&crate::json::to_json(&m)).unwrap() == m);
        let edited = m.operator("+", &model("sphere()"));
        let e = edited.unwrap_err().to_string();
        assert!(e.contains("nested 10000 deep"), "{e}");
    });
}

#[test]
fn a_tree_as_deep_in_its_parameters_drops() {
    on_small_stack(|| {
        let mut m = model("sphere()");
        for _ in 1..MAX_DEPTH {
            m = Model::call("sphere", vec![Value::Model(m)], vec![]).unwrap();
        }
        assert!(m.lower().is_ok());
        drop(m);
    });
}

#[test]
fn a_small_tree_that_unfolds_without_end_is_refused() {
    let mut m = model("sphere(0.1)");
    for i in 0..40 {
        let moved = |d: f64| {
            Value::Model(
                Model::call("translate", vec![Value::Model(m.clone()), Value::Number(d)], vec![]).unwrap(),
            )
        };
        m = Model::call("union", vec![moved(1.0 + i as f64), moved(-0.5)], vec![]).unwrap();
    }
    match m.lower() {
        Err(FieldError::TooLarge(e)) => assert!(e.contains("4000000 operations"), "{e}"),
        other => panic!("expected TooLarge, got {:?}", other.map(|l| l.graph.len())),
    }
}

#[test]
fn sharing_without_moves_costs_nothing() {
    let mut m = model("sphere(0.5)");
    for _ in 0..1000 {
        m = m.operator("*", &m).unwrap();
        m = Model::call("sqrt", vec![Value::Model(m)], vec![]).unwrap();
    }
    assert!(m.lower().unwrap().graph.len() < 3000);
    assert!(m.to_text().unwrap().len() < 100_000);
}

#[test]
fn many_equal_parts_have_paths_of_their_own() {
    let m = model(&vec!["sphere()"; 20_000].join("|"));
    let params = m.parameters();
    assert_eq!(params[19_999].path, "sphere_20000/r");
    assert_eq!(m.lower().unwrap().params.len(), 20_000);
    let edited = m.with_value("sphere_777/r", 2.0).unwrap();
    assert_eq!(edited.parameters()[776].value, 2.0);
}
