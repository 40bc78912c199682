//! Tapes: meaning, errors with lines, round trips, and no input that panics or hangs.

use proptest::prelude::*;

use super::*;
use crate::model::tests::samples::{grown, model, value};

#[test]
fn a_tape_has_the_values_of_its_last_line() {
    let m = parse_vm("# a sphere\n\n_0 const 1.5\n_1 var-x\n_2 square _1\n_3 sub _2 _0\n").unwrap();
    assert_eq!(value(&m, [2.0, 0.0, 0.0]), 2.5);
    assert!(m.parameters().is_empty() && m.is_solid());
    let m = parse_vm("a var-x\nb var-y\na add a b\nc mul a a").unwrap();
    assert_eq!(value(&m, [2.0, 3.0, 0.0]), 25.0, "a name may be used again");
}

#[test]
fn every_operation_means_what_it_means_in_fidget() {
    let (x, y) = (-2.5f64, 0.75f64);
    for (line, expected) in [
        ("neg _x", 2.5),
        ("abs _x", 2.5),
        ("recip _y", 1.0 / y),
        ("sqrt _y", y.sqrt()),
        ("square _x", 6.25),
        ("floor _x", -3.0),
        ("ceil _x", -2.0),
        ("round _x", -3.0),
        ("sin _x", x.sin()),
        ("cos _x", x.cos()),
        ("tan _x", x.tan()),
        ("asin _y", y.asin()),
        ("acos _y", y.acos()),
        ("atan _x", x.atan()),
        ("exp _x", x.exp()),
        ("ln _y", y.ln()),
        ("not _x", 0.0),
        ("not _0", 1.0),
        ("add _x _y", x + y),
        ("sub _x _y", x - y),
        ("mul _x _y", x * y),
        ("div _x _y", x / y),
        ("min _x _y", x),
        ("max _x _y", y),
        ("atan2 _x _y", x.atan2(y)),
        ("compare _x _y", -1.0),
        ("compare _y _x", 1.0),
        ("compare _x _x", 0.0),
        ("mod _x _y", x.rem_euclid(y)),
        ("mod _y _x", y.rem_euclid(x)),
        ("and _x _y", y),
        ("and _0 _y", 0.0),
        ("or _x _y", x),
        ("or _0 _y", y),
    ] {
        let tape = format!("_x var-x\n_y var-y\n_z var-z\n_0 sub _z _z\n_1 {line}");
        let given = value(&parse_vm(&tape).unwrap(), [x, y, 0.0]);
        assert!((given - expected).abs() < 1e-14, "{line} = {given}, expected {expected}");
        // The same with the 0 known only at the point.
        let given = value(&parse_vm(&tape.replace("sub _z _z", "mul _z _x")).unwrap(), [x, y, 0.0]);
        assert!((given - expected).abs() < 1e-14, "{line} = {given}, expected {expected}");
    }
}

#[test]
fn errors_have_lines_and_reasons() {
    for (tape, line, words) in [
        ("", 0, "no operation"),
        ("# only this", 0, "no operation"),
        ("_0 var-x\n_1", 2, "expected `name operation operands…`"),
        ("_0 var-x\n_1 sine _0", 2, "unknown operation `sine`; did you mean `sin`?"),
        ("_0 var-w", 1, "did you mean one of `var-x`, `var-y`, `var-z`?"),
        ("_0 var-x\n\n_1 add _0 _7", 3, "`_7` is used before any line defines it"),
        ("_0 add _0 _0", 1, "`_0` is used before"),
        ("_0 var-x\n_1 add _0", 2, "`add` takes 2 operands, given 1"),
        ("_0 var-x _1", 1, "takes 0 operands, given 1"),
        ("_0 const one", 1, "expected a finite number, found `one`"),
        ("_0 const NaN", 1, "expected a finite number"),
        ("_0 const 1e999", 1, "expected a finite number"),
        ("_0 const", 1, "`const` takes 1 operand, given 0"),
        ("_0 var-x\n_1 rand _0", 2, "cannot be differentiated"),
        ("\u{0}\u{1} \u{2}", 1, "unknown operation `\\u{2}`"),
    ] {
        match parse_vm(tape) {
            Err(FieldError::File { format: "vm", line: given, reason }) => {
                assert!(reason.contains(words), "{tape:?}: {reason}");
                assert_eq!(given, line, "{tape:?}: {reason}");
            }
            other => panic!("{tape:?}: {other:?}"),
        }
    }
}

#[test]
fn size_is_bounded() {
    let long = "_0 var-x\n".repeat(MAX_STEPS + 1);
    assert!(matches!(parse_vm(&long), Err(FieldError::TooLarge(_))));
    let long = "_0 var-x\n".to_string() + &"_0 sin _0\n".repeat(200_000);
    assert_eq!(parse_vm(&long).unwrap().lower().unwrap().graph.len(), 200_003, "depth is no limit");
}

#[test]
fn a_part_of_a_machine_loads() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/csg_part.vm");
    let program = Program::parse(&std::fs::read_to_string(path).unwrap()).unwrap();
    assert!(program.len() > 1000);
    assert_eq!(Program::parse(&program.to_text()).unwrap(), program);
}

#[test]
fn a_model_becomes_a_tape_of_its_present_values() {
    let m = model("smooth_union(sphere(2), x^2.5 % 3, k=0.5) + where(x < y, z, 1)*sign(x)");
    let tape = Program::of(&m).unwrap().to_text();
    let again = parse_vm(&tape).unwrap();
    for p in [[0.3, 0.4, 0.5], [2.0, -1.0, 3.0], [0.0, 0.0, 1.0]] {
        let (f, g) = (value(&m, p), value(&again, p));
        assert!((f - g).abs() < 1e-12 * (1.0 + f.abs()), "{f} against {g} at {p:?}");
    }
    assert!(Program::of(&model("stack(x, y)")).unwrap_err().to_string().contains("one result"));
    let f = Model::function(std::sync::Arc::new(crate::model::tests::samples::Ball)).unwrap();
    assert!(Program::of(&f).unwrap_err().to_string().contains("the function ball"));
    assert!(Program::of(&model("x + 1/0")).unwrap_err().to_string().contains("inf everywhere"));
}

proptest! {
    #![proptest_config(crate::model::tests::samples::cases(300, 2))]

    #[test]
    fn tapes_of_random_trees_read_back(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        if let Ok(program) = Program::of(&grown(&bytes)) {
            prop_assert_eq!(&Program::parse(&program.to_text()).unwrap(), &program);
        }
    }

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = parse_vm(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn random_lines_never_panic(words in proptest::collection::vec(proptest::sample::select(vec![
        "_0", "_1", "var-x", "const", "1.5", "add", "sin", "mod", "and", "or", "not", "compare", "min", "\n", "\n", "#",
    ]), 0..60)) {
        if let Ok(m) = parse_vm(&words.join(" ")) {
            prop_assert!(m.lower().is_ok());
        }
    }

    #[test]
    fn damaged_tapes_never_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..100), at in any::<prop::sample::Index>(), c in any::<char>(),
    ) {
        let Ok(program) = Program::of(&grown(&bytes)) else { return Ok(()) };
        let mut text: Vec<char> = program.to_text().chars().collect();
        let i = at.index(text.len());
        text[i] = c;
        let _ = parse_vm(&text.iter().collect::<String>());
        text.truncate(i);
        let _ = parse_vm(&text.iter().collect::<String>());
    }
}
