//! The parser and the printer: meaning, errors with positions, round trips, and no input that panics or hangs.

use proptest::prelude::*;

use super::*;
use crate::FieldError;
use crate::model::tests::samples::{grown, one_of_each, value};
use crate::model::{Layout, Model, kinds};

fn eval(text: &str) -> f64 {
    value(&parse(text, &[]).unwrap_or_else(|e| panic!("{text}: {e}")), [2.0, 3.0, 5.0])
}

#[test]
fn arithmetic_binds_as_usual() {
    for (text, expected) in [
        ("1 + 2*3", 7.0),
        ("(1 + 2)*3", 9.0),
        ("-2^2", -4.0),
        ("(-2)^2", 4.0),
        ("2^-2", 0.25),
        ("2^3^2", 512.0),
        ("2**3**2", 512.0),
        ("-x^2", -4.0),
        ("--x", 2.0),
        ("+x - -y", 5.0),
        ("10 - 4 - 3", 3.0),
        ("24/4/3", 2.0),
        ("24/4*3", 18.0),
        ("17 % 5 * 2", 4.0),
        ("x*y + z", 11.0),
        ("-x*y", -6.0),
        (".5 + 5. + 1e2 + 1.5e-1", 105.65),
        ("2e", f64::NAN),
        ("pi", std::f64::consts::PI),
        ("tau/2 - pi + e - e", 0.0),
        ("1 + 1 < 3", 1.0),
        ("x > y", 0.0),
        ("x | y & z", 2.0),
        ("min(x, y, z) + max(x, y)", 5.0),
        ("a = x + 1; b = a*a; b - a # the end", 6.0),
        ("x^2\n + y^2 # two lines\n - z", 8.0),
    ] {
        if expected.is_nan() {
            assert!(parse(text, &[]).is_err(), "{text}");
        } else {
            assert_eq!(eval(text), expected, "{text}");
        }
    }
}

#[test]
fn parameters_have_the_values_given() {
    let m = parse("x^2 + y^2 + z^2 - r^2", &[("r", 2.0)]).unwrap();
    assert_eq!(value(&m, [2.0, 3.0, 5.0]), 34.0);
    assert_eq!(m.free_standing(), [("r".to_string(), 2.0)]);
    assert_eq!(m.parameters()[0].path, "r");
    let m = parse("e*x", &[("e", 7.0)]).unwrap();
    assert_eq!(value(&m, [2.0, 0.0, 0.0]), 14.0, "a parameter may have the name of a constant");
    for (name, words) in
        [("x", "cannot be a parameter"), ("a b", "cannot be a parameter"), ("r", "does not occur")]
    {
        let e = parse("y", &[(name, 1.0)]).unwrap_err().to_string();
        assert!(e.contains(words), "{e}");
    }
    assert!(parse("r", &[("r", 1.0), ("r", 2.0)]).unwrap_err().to_string().contains("twice"));
    assert!(parse("r", &[("r", f64::NAN)]).unwrap_err().to_string().contains("finite"));
}

#[test]
fn every_error_has_its_position_and_reason() {
    for (text, position, words) in [
        ("", 0, "found the end of the text"),
        ("   ", 3, "expected a number, a name or a bracket"),
        ("x +", 3, "found the end of the text"),
        ("x + * y", 4, "found `*`"),
        ("(x + y", 6, "expected `)` for the bracket at position 0"),
        ("x + y)", 5, "this bracket closes none"),
        ("x y", 2, "expected a sign such as + or * before `y`"),
        ("2x", 1, "write 2*x"),
        ("x = 1", 0, "`x` already means something else"),
        ("x^2 = 1", 4, "a surface is F = 0"),
        ("x^2 == 1", 4, "a surface is F = 0"),
        ("x + radius", 4, "give its value: radius=1"),
        ("1.2.3 + x", 3, "two points"),
        ("1e999", 0, "too large"),
        ("x + é", 4, "unknown name `é`"),
        ("é$", 1, "unexpected character `$`"),
        ("x² + 1", 1, "write ^2"),
        ("x − 1", 2, "ASCII minus"),
        ("x + [1]", 4, "round brackets"),
        ("sphere(1", 8, "expected `,` or `)`"),
        ("spher(1)", 0, "did you mean `sphere`"),
        ("cyllinder(1)", 0, "did you mean `cylinder`"),
        ("1 + sphere(radius=1)", 11, "no parameter `radius`"),
        ("sphere(1, 2)", 10, "sphere takes r"),
        ("box(1, 2, x=3)", 10, "`x` of box is given twice"),
        ("sphere(-1)", 0, "must be above 0"),
        ("sphere(1/0)", 0, "must be finite"),
        ("box(x=1, 2)", 9, "before those by name"),
        ("sphere + 1", 0, "`sphere` is a function: write sphere(…)"),
        ("x(2)", 0, "write x*(…)"),
        ("q(2)", 0, "to multiply write q*(…)"),
        ("sin()", 0, "1 operand, given 0"),
        ("translate()", 0, "1 operand, given 0"),
        ("1 < x < 2", 6, "cannot be chained"),
        ("a = 1 x", 6, "expected `;`"),
        ("a = 1; a = 2; a", 7, "defined twice"),
        ("blend(x, y, h=z)", 14, "only f and g"),
        ("blend(x, y)", 0, "needs an expression in f and g"),
        ("f + 1", 0, "unknown name `f`"),
        ("algebraic(c_y1x2=1)", 10, "no coefficient"),
        ("algebraic(degree=1.5)", 10, "whole number"),
        ("algebraic(degree=1e9)", 10, "whole number"),
        ("sphere(r=1);", 11, "expected the end of the formula"),
        ("blobs(x99999999999999999999=1)", 6, "no parameter"),
        ("blobs(x1=1)", 6, "before it are not"),
    ] {
        match parse(text, &[]) {
            Err(FieldError::Parse { reason, position: given, excerpt }) => {
                assert!(reason.contains(words), "{text}: {reason}");
                assert_eq!(given, position, "{text}: {reason}");
                let caret = excerpt.lines().last().unwrap().chars().count() - 1;
                assert_eq!(caret, 4 + position.min(40), "{text}: {excerpt}");
            }
            other => panic!("{text}: {other:?}"),
        }
    }
}

#[test]
fn the_excerpt_is_of_the_line_and_short() {
    let text = format!("x\n + {}$ + {}\n + z", "y + ".repeat(100), "y".repeat(100));
    let e = parse(&text, &[]).unwrap_err();
    let FieldError::Parse { excerpt, .. } = &e else { panic!("{e}") };
    let lines: Vec<&str> = excerpt.lines().collect();
    assert_eq!(lines.len(), 3);
    assert_eq!(lines[1].chars().nth(44), Some('$'));
    assert!(lines[1].chars().count() <= 74);
}

#[test]
fn depth_and_length_are_bounded() {
    for text in [
        format!("{}x{}", "(".repeat(5000), ")".repeat(5000)),
        "-".repeat(5000) + "x",
        "x^".repeat(5000) + "x",
        format!("{}x{}", "sin(".repeat(5000), ")".repeat(5000)),
        "(".repeat(500_000),
    ] {
        let e = parse(&text, &[]).unwrap_err().to_string();
        assert!(e.contains("nested more than 200 deep"), "{e}");
    }
    assert!(parse(&format!("{}x{}", "(".repeat(190), ")".repeat(190)), &[]).is_ok());
    let long = " ".repeat(MAX_TEXT + 1);
    assert!(matches!(parse(&long, &[]), Err(FieldError::TooLarge(_))));
    let e = parse(&"q".repeat(MAX_TEXT), &[]).unwrap_err().to_string();
    assert!(e.len() < 400, "a long name is shortened in the message");
    // A megabyte of sums is one node with many operands.
    let sum = "x+".repeat(MAX_TEXT / 2 - 1) + "x";
    assert_eq!(parse(&sum, &[]).unwrap().depth(), 2);
    let e = parse(&("x-".repeat(20_000) + "x"), &[]).unwrap_err();
    assert!(e.to_string().contains("nested 10000 deep"), "{e}");
}

#[test]
fn every_kind_has_a_text_form_that_reads_back() {
    for m in one_of_each() {
        let name = m.kind().name;
        if matches!(name, "program" | "function") {
            assert!(m.to_text().unwrap_err().to_string().contains("no text form"), "{name}");
            continue;
        }
        let text = m.to_text().unwrap();
        let given = m.free_standing();
        let given: Vec<(&str, f64)> = given.iter().map(|(n, v)| (n.as_str(), *v)).collect();
        let again = parse(&text, &given).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert!(again == m, "{text} reads back as {again}");
    }
}

#[test]
fn every_fixed_kind_can_be_called_without_parameters() {
    for k in kinds().iter().filter(|k| k.is_solid() && k.layout == Layout::Fixed) {
        let operands = match k.operands {
            crate::model::Operands::Exactly(n) | crate::model::Operands::AtLeast(n) => n,
        };
        let arguments = vec!["sphere()"; operands].join(", ");
        let h = if k.name == "blend" { ", h=f" } else { "" };
        if !matches!(k.name, "program" | "function") {
            assert!(parse(&format!("{}({arguments}{h})", k.name), &[]).is_ok(), "{}", k.name);
        }
    }
}

#[test]
fn printing_keeps_brackets_names_and_sharing() {
    for text in [
        "x + y - z + 1",
        "x - (y - z)",
        "(x + y) + z",
        "x + (y + z)",
        "x*(y*z)/(x/y)",
        "-x^2 + (-x)^2 + (-2)^2 + -2",
        "-(1) + --x + -(-1)",
        "2^-x^y + (2^x)^y",
        "x < (y < z)",
        "(x | y) | z & (x & y)",
        "~sphere(r=1) & ~(torus(major=1) | box(x=2))",
        "sub(sphere(r=1), sphere(r=2)) + (sphere(r=1) - sphere(r=2) - sphere(r=3))",
        "(sphere(r=1) - sphere(r=2)) - 0.25",
        "ball = sphere(r=1); ball | translate(ball, x=2)",
        "blend(sphere(r=1), x, h=f*g - sqrt(f^2 + 1))",
        "blobs(0.5, 0, 0, 0, 1, 1, 2, 3, 4)",
        "sphere(r=1 + x^2)",
        "algebraic(c=-1, c_x2=1, c_x1y2=0.5)",
        "1e-300*x + 1e300*y + 123456.75*z + 1e15 - 1e16",
        "where(x < 1, y, z) % 2",
    ] {
        let m = parse(text, &[]).unwrap();
        let printed = m.to_text().unwrap();
        let again = parse(&printed, &[]).unwrap_or_else(|e| panic!("{text} → {printed}: {e}"));
        assert!(again == m, "{text} → {printed}");
        assert_eq!(again.to_text().unwrap(), printed);
        assert_eq!(again.parameters(), m.parameters(), "{text} → {printed}");
    }
    let m = parse("x + y*2", &[]).unwrap();
    assert_eq!(m.to_text().unwrap(), "x + y*2");
}

#[test]
fn what_text_cannot_say_is_refused() {
    let m = parse("sphere(1)", &[]).unwrap();
    for (m, words) in [
        (m.named("two words").unwrap(), "a part is called `two words`"),
        (m.with_frozen("*", true).unwrap(), "r of sphere is frozen"),
        (m.with_bounds("*", 0.5, 2.0).unwrap(), "bounded"),
    ] {
        assert!(m.to_text().unwrap_err().to_string().contains(words));
        assert!(m.to_string().contains("sphere(r=1)"), "but shown all the same");
    }
}

#[test]
fn the_surfaces_of_the_literature_parse() {
    for text in [
        "(x^2+y^2+z^2+0.84)^2-4*(x^2+y^2)",
        "max(max(max(abs(x),max(abs(y),abs(z)))-0.75,x^2+y^2+z^2-1),max(0.16-x^2-y^2,max(0.16-y^2-z^2,0.16-z^2-x^2)))",
        "0.55-exp(-((x-0.96)^2+y^2+z^2)/0.7)-exp(-((x+0.96)^2+y^2+z^2)/0.7)",
        "81*(x^3+y^3+z^3)-189*(x^2*y+x^2*z+y^2*x+y^2*z+z^2*x+z^2*y)+54*x*y*z+126*(x*y+x*z+y*z)-9*(x^2+y^2+z^2)-9*(x+y+z)+1",
        "4*(2.618033988749895*x^2-y^2)*(2.618033988749895*y^2-z^2)*(2.618033988749895*z^2-x^2)-4.23606797749979*(x^2+y^2+z^2-1)^2",
    ] {
        assert!(parse(text, &[]).unwrap().parameters().is_empty());
    }
    assert_eq!(eval("(x^2+2.25*y^2+z^2-1)^3-x^2*z^3-0.1125*y^2*z^3"), {
        let (x, y, z) = (2.0f64, 3.0f64, 5.0f64);
        (x * x + 2.25 * (y * y) + z * z - 1.0).powi(3) - x * x * z.powi(3) - 0.1125 * (y * y) * z.powi(3)
    });
}

#[test]
fn suggestions_are_near_names_only() {
    let known = || ["sphere", "smooth_union", "sin", "sinh"].into_iter();
    assert_eq!(suggestion("spehre", known()), "; did you mean `sphere`?");
    assert_eq!(suggestion("Sphere", known()), "; did you mean `sphere`?");
    assert_eq!(suggestion("sinn", known()), "; did you mean one of `sin`, `sinh`?");
    assert_eq!(suggestion("helicopter", known()), "");
}

fn read(m: &Model) -> Model {
    let text = m.to_text().unwrap_or_else(|e| panic!("{m}: {e}"));
    let given = m.free_standing();
    let given: Vec<(&str, f64)> = given.iter().map(|(n, v)| (n.as_str(), *v)).collect();
    parse(&text, &given).unwrap_or_else(|e| panic!("{text}: {e}"))
}

proptest! {
    #![proptest_config(crate::model::tests::samples::cases(400, 1))]

    #[test]
    fn random_trees_read_back_from_their_text(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let m = grown(&bytes);
        let again = read(&m);
        prop_assert!(again == m, "{m} reads back as {again}");
        prop_assert_eq!(again.parameters(), m.parameters());
    }

    #[test]
    fn random_text_never_panics(text in "\\PC{0,80}") {
        let _ = parse(&text, &[]);
    }

    #[test]
    fn random_words_never_panic(words in proptest::collection::vec(proptest::sample::select(vec![
        "x", "y", "f", "1", "2.5", "1e3", "+", "-", "*", "/", "^", "**", "(", ")", ",", "=", ";", "|", "&", "~", "<",
        ">=", "%", "sphere", "union", "blend", "blobs", "algebraic", "c_x2", "degree", "r", "h", "where", "pi", "a",
        "repeat", "stack", "#", "\n",
    ]), 0..40), glue in any::<bool>()) {
        let text = words.join(if glue { "" } else { " " });
        if let Ok(m) = parse(&text, &[]) {
            let _ = m.lower();
            prop_assert!(read(&m) == m, "{}", text);
        }
    }

    #[test]
    fn damaged_formulas_never_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..120), at in any::<prop::sample::Index>(), c in any::<char>(),
    ) {
        let mut text: Vec<char> = grown(&bytes).to_string().chars().collect();
        let i = at.index(text.len());
        text[i] = c;
        let _ = parse(&text.iter().collect::<String>(), &[("q", 1.0)]);
        text.remove(i);
        let _ = parse(&text.iter().collect::<String>(), &[("q", 1.0)]);
        text.truncate(i);
        let _ = parse(&text.iter().collect::<String>(), &[("q", 1.0)]);
    }
}
