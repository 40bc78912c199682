//! Files: exact round trips, hostile input refused with reasons, and a schema that is current.

use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::FieldError;
use crate::model::tests::samples::{Ball, grown, model, one_of_each, value};
use crate::model::{Callback, Value};

fn ball(name: &str) -> Option<Arc<dyn Callback>> {
    (name == "ball").then(|| Arc::new(Ball) as Arc<dyn Callback>)
}

#[test]
fn every_kind_reads_back() {
    for m in one_of_each() {
        let text = to_json(&m);
        let again = from_json_with(&text, &ball).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert!(again == m, "{text}");
        assert_eq!(to_json(&again), text);
    }
}

#[test]
fn numbers_names_flags_and_sharing_are_exact() {
    let m =
        model("ball = sphere(0.1); ball | translate(ball, 0.30000000000000004, -1e-300, 12345.678901234567)");
    let m = m.with_frozen("ball/r", true).unwrap().with_bounds("translate/y", -1.0, f64::INFINITY).unwrap();
    let m = m.with_scale("translate/*", 1.0 / 3.0).unwrap().named("Zwei Kugeln").unwrap();
    let again = from_json(&to_json(&m)).unwrap();
    assert!(again == m);
    assert_eq!(again.parameters(), m.parameters());
    let bits = |m: &Model| m.parameters().iter().map(|p| p.value.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&again), bits(&m));
    assert_eq!(again.name(), Some("Zwei Kugeln"));
    assert_eq!(again.operands()[0].id(), again.operands()[1].operands()[0].id());
}

#[test]
fn the_format_is_what_it_was() {
    // Written by version 1. It must be read for ever.
    let text = r#"{
  "format": "isoswarm model",
  "version": 1,
  "nodes": [
    {"kind":"x"},
    {"kind":"y"},
    {"kind":"mul","operands":[0,1]},
    {"kind":"parameter","params":[{"name":"a","value":2.0,"scale":0.5}]},
    {"kind":"sphere","name":"ball","params":[{"name":"r","expr":3}]},
    {"kind":"const","number":-0.5},
    {"kind":"add","operands":[0,5]},
    {"kind":"blend","operands":[4,6],"expression":2},
    {"kind":"twist","params":[{"name":"rate","value":0.25,"frozen":true,"bounds":[-1.0,null]},{"name":"axis","value":0.0}],"operands":[7]}
  ]
}
"#;
    let m = from_json(text).unwrap();
    assert_eq!(to_json(&m), text);
    assert_eq!(m.parameters()[0].bounds, (-1.0, f64::INFINITY));
    assert_eq!(value(&m, [3.0, 0.0, 0.0]), (3.0 - 2.0) * (3.0 - 0.5));
}

fn file(nodes: &str) -> String {
    format!("{{\"format\": \"isoswarm model\", \"version\": 1, \"nodes\": [{nodes}]}}")
}

#[test]
fn hostile_files_are_refused_with_the_reason() {
    let radius = r#"{"kind":"sphere","params":[{"name":"r","value":1}]}"#;
    for (text, words) in [
        ("", "EOF while parsing"),
        ("[]", "expected"),
        ("{}", "expected an object with \"format\""),
        ("{\"format\":\"ply\",\"version\":1,\"nodes\":[]}", "expected an object with \"format\""),
        (
            "{\"format\":\"isoswarm model\",\"version\":2,\"nodes\":[],\"new\":0}",
            "expected version 1 to 1, given 2: update",
        ),
        (&file(""), "no node"),
        (&file(r#"{"kind":"spere"}"#), "node 0 (spere): there is no such kind; did you mean `sphere`?"),
        (&file(r#"{"kind":"log","operands":[0]}"#), "no such kind"),
        (&file(r#"{"kind":"sphere"}"#), "node 0 (sphere): sphere: expected 1 parameters, given 0"),
        (
            &file(r#"{"kind":"sphere","params":[{"name":"q","value":1}]}"#),
            "expected the parameter r, given q",
        ),
        (&file(r#"{"kind":"sphere","params":[{"name":"r","value":-1}]}"#), "r must be above 0, given -1"),
        (&file(r#"{"kind":"sphere","params":[{"name":"r"}]}"#), "either a value or an expr"),
        (&file(r#"{"kind":"sphere","params":[{"name":"r","value":1e999}]}"#), "number out of range"),
        (&file(r#"{"kind":"sphere","params":[{"name":"r","value":NaN}]}"#), "expected value"),
        (&file(r#"{"kind":"sphere","params":[{"name":"r","value":1,"bounds":[2,1]}]}"#), "bounds [2, 1]"),
        (&file(r#"{"kind":"sphere","params":[{"name":"r","value":1,"scale":0}]}"#), "scale 0"),
        (&file(r#"{"kind":"sphere","colour":1}"#), "unknown field `colour`"),
        (
            &file(&format!(r#"{radius},{{"kind":"neg","operands":[1]}}"#)),
            "node 1 (neg): it refers to node 1, but only to nodes before it (0 to 0)",
        ),
        (&file(&format!(r#"{radius},{{"kind":"neg","operands":[-1]}}"#)), "invalid value"),
        (&file(&format!(r#"{radius},{{"kind":"neg","operands":[0,0]}}"#)), "expected 1 operand, given 2"),
        (&file(r#"{"kind":"const"}"#), "number is missing"),
        (&file(r#"{"kind":"x","number":1}"#), "no place for number"),
        (
            &file(
                r#"{"kind":"algebraic","params":[{"name":"c","value":1},{"name":"c","value":1}],"exponents":[[0,0,0],[0,0,0]]}"#,
            ),
            "each once",
        ),
        (&file(r#"{"kind":"algebraic","params":[],"exponents":[]}"#), "a coefficient for each monomial"),
        (
            &file(r#"{"kind":"algebraic","params":[{"name":"c","value":1}],"exponents":[[0,0,300]]}"#),
            "invalid value: integer `300`",
        ),
        (&file(r#"{"kind":"program","program":"_0 sine"}"#), "vm line 1"),
        (&file(r#"{"kind":"function","function":"noise"}"#), "functions that are not given: noise"),
        (
            &file(
                r#"{"kind":"twist","params":[{"name":"rate","value":1},{"name":"axis","value":0.5}],"operands":[0]}"#,
            ),
            "refers to node 0",
        ),
        (&("[".repeat(100_000)), "invalid type"),
        (&format!("{{\"other\": {}", "[".repeat(100_000)), "EOF"),
    ] {
        let shown = &text[..text.len().min(200)];
        match from_json_with(text, &ball) {
            Err(FieldError::File { format: "iso.json", reason, .. }) => {
                assert!(reason.contains(words), "{shown}: {reason}");
            }
            other => panic!("{shown}: {other:?}"),
        }
    }
    let e = from_json("{\n\"format\": \"isoswarm model\",\n\"version\": 1, \"nodes\": [}").unwrap_err();
    assert!(e.to_string().contains("line 3"), "{e}");
}

#[test]
fn a_file_deeper_than_a_model_may_be_is_refused() {
    let mut nodes = vec!["{\"kind\":\"x\"}".to_string()];
    nodes.extend((0..20_000).map(|i| format!("{{\"kind\":\"sin\",\"operands\":[{i}]}}")));
    assert!(matches!(from_json(&file(&nodes.join(","))), Err(FieldError::TooLarge(_))));
}

#[test]
fn functions_are_given_by_name() {
    let f = Model::function(Arc::new(Ball)).unwrap();
    let m = Model::call("offset", vec![Value::Model(f), Value::Number(0.5)], vec![]).unwrap();
    let text = to_json(&m);
    assert!(text.contains("\"function\":\"ball\""));
    assert_eq!(value(&from_json_with(&text, &ball).unwrap(), [2.0, 0.0, 0.0]), 2.5);
    assert!(from_json(&text).unwrap_err().to_string().contains("not given: ball; pass them by name"));
}

/// What stands in docs/ is what the table says.
fn current(name: &str, text: String) {
    let path = format!("{}/../../docs/{name}", env!("CARGO_MANIFEST_DIR"));
    assert!(
        std::fs::read_to_string(path).unwrap_or_default() == text,
        "docs/{name} is not what the table of kinds says; write it again with \
         `cargo run -p isoswarm-field --example reference`"
    );
}

#[test]
fn the_published_schema_is_current() {
    current("iso.schema.json", schema());
}

#[test]
fn the_published_reference_is_current() {
    current("kinds.md", crate::model::kinds::kinds_markdown());
}

proptest! {
    #![proptest_config(crate::model::tests::samples::cases(300, 3))]

    #[test]
    fn random_trees_read_back(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let m = grown(&bytes);
        let again = from_json(&to_json(&m)).unwrap();
        prop_assert!(again == m);
        prop_assert_eq!(again.parameters(), m.parameters());
    }

    #[test]
    fn random_text_never_panics(text in "\\PC{0,80}") {
        prop_assert!(from_json(&text).is_err());
        let _ = from_json(&file(&text));
    }

    #[test]
    fn damaged_files_never_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..100), at in any::<prop::sample::Index>(), c in any::<char>(),
    ) {
        let mut text: Vec<char> = to_json(&grown(&bytes)).chars().collect();
        let i = at.index(text.len());
        text[i] = c;
        let _ = from_json(&text.iter().collect::<String>());
        text.remove(i);
        let _ = from_json(&text.iter().collect::<String>());
        text.truncate(i.min(text.len() - 3));
        prop_assert!(from_json(&text.iter().collect::<String>()).is_err());
    }

    #[test]
    fn files_with_other_numbers_never_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..100), at in any::<prop::sample::Index>(),
        number in prop_oneof![Just("-1".to_string()), Just("1e300".into()), Just("0".into()), Just("null".into()), any::<u64>().prop_map(|n| n.to_string())],
    ) {
        let text = to_json(&grown(&bytes));
        let digits: Vec<usize> = text.char_indices().filter(|(_, c)| c.is_ascii_digit()).map(|(i, _)| i).collect();
        let i = digits[at.index(digits.len())];
        let changed = format!("{}{number}{}", &text[..i], &text[i + 1..]);
        if let Ok(m) = from_json(&changed) {
            let _ = m.lower();
        }
    }
}
