//! The table as a page of documentation.

use std::fmt::Write;

use super::super::{Category, Kind, Layout, Operands, ParamSpec, PayloadKind};
use super::kinds;

/// A call of the kind with its defaults, as in text.
fn usage(k: &Kind) -> String {
    if matches!(k.payload, PayloadKind::Program | PayloadKind::Callback) {
        return "(not in text)".into();
    }
    let mut arguments: Vec<String> = match k.operands {
        Operands::Exactly(n) => ["f", "g", "h"].iter().take(n).map(|s| s.to_string()).collect(),
        Operands::AtLeast(_) => vec!["f, g, …".to_string()],
    };
    if k.name == "blend" {
        arguments.push("h=…".into());
    }
    arguments.extend(k.params.iter().map(|s| format!("{}={}", s.name, crate::text::number(s.default))));
    match k.layout {
        Layout::Groups => arguments
            .push(k.group.iter().map(|s| format!("{}0", s.name)).collect::<Vec<_>>().join(", ") + ", …"),
        Layout::Monomials => arguments.push("c=…, c_x1=…, …".into()),
        Layout::Fixed | Layout::Own | Layout::Function => {}
    }
    format!("{}({})", k.name, arguments.join(", "))
}

fn describe(s: &ParamSpec) -> String {
    let bounds = match s.bounds {
        (f64::MIN_POSITIVE, f64::INFINITY) => ", above 0".to_string(),
        (lo, hi) if lo.is_finite() && hi.is_finite() => format!(", {lo} to {hi}"),
        (lo, _) if lo.is_finite() => format!(", at least {lo}"),
        _ => String::new(),
    };
    let unit = if s.unit.is_empty() || s.unit == "index" { String::new() } else { format!(" ({})", s.unit) };
    let flags = match (s.discrete, s.frozen) {
        (true, _) => ", discrete",
        (_, true) => ", frozen by default",
        _ => "",
    };
    format!("{}{unit}{bounds}{flags}", s.doc.trim_end_matches('.'))
}

/// All kinds as Markdown.
pub fn kinds_markdown() -> String {
    let mut page = String::from(
        "# Shapes, operators and functions\n\nMade from the table of kinds; do not edit. F < 0 inside; p = (x, y, z); \
         f, g, … are the operands. Angles are in radians.\n",
    );
    let sections = [
        (Category::Shape, "Shapes"),
        (Category::Operator, "Operators"),
        (Category::Deformation, "Deformations"),
        (Category::Formula, "Functions"),
        (Category::Structure, "Structure"),
    ];
    for (category, title) in sections {
        let _ = write!(page, "\n## {title}\n");
        for k in kinds().iter().filter(|k| k.category == category) {
            let _ =
                write!(page, "\n### {}\n\n{}\n\n    {}\n    F = {}\n", k.name, k.doc, usage(k), k.formula);
            if !k.aliases.is_empty() {
                let _ = write!(page, "\nAlso called {}.\n", k.aliases.join(", "));
            }
            let specs = k.params.iter().chain(k.group);
            let rows: Vec<String> = specs.map(|s| format!("- `{}`: {}.", s.name, describe(s))).collect();
            if !rows.is_empty() {
                let _ = write!(page, "\n{}\n", rows.join("\n"));
            }
        }
    }
    page
}
