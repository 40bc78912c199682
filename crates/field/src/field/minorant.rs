//! A simpler function that is nowhere above F, for models with R-functions, whose ends intervals do not see: of
//! f + g − √(f² + g²) with both growing without end they know nothing, though it is at least (2 − √2) min(f, g).

use crate::FieldError;
use crate::model::{Model, Payload, guarded, kind};
use crate::text;

/// Nowhere above f + g − √(f² + g²) (x, y: f, g): that is from (2 − √2) to 1 times the smaller of both where it is positive,
/// and from 1 to 2 + √2 times where it is negative.
const UNION: &str = "min(0.585*min(x, y), 3.415*min(x, y))";

/// Operators that are monotone in their operands, at places that depend on the point alone.
const MONOTONE: [&str; 15] = [
    "union",
    "intersection",
    "offset",
    "translate",
    "rotate",
    "rotate_euler",
    "scale",
    "twist",
    "bend",
    "taper",
    "rotate_about",
    "scale_about",
    "taper_about",
    "twist_about",
    "bend_about",
];

/// A model that is nowhere above `model` and has no R-function; `None` where there is none in it, or it is under an operator
/// through which nothing is known.
pub(super) fn minorant(model: &Model) -> Option<Model> {
    let has_any = model.nodes().iter().any(|n| n.model().kind().name == "r_blend");
    if has_any { below(model).ok().flatten() } else { None }
}

fn below(model: &Model) -> Result<Option<Model>, FieldError> {
    if model.nodes().iter().all(|n| n.model().kind().name != "r_blend") {
        return Ok(Some(model.clone()));
    }
    let (model, shown) = model.shown();
    let name = model.kind().name;
    if name != "r_blend" && !MONOTONE.contains(&name) {
        return Ok(None);
    }
    let mut operands = Vec::with_capacity(shown.len());
    for part in shown {
        match guarded(|| below(part))? {
            Some(part) => operands.push(part),
            None => return Ok(None),
        }
    }
    if name != "r_blend" {
        return model.with_operands(operands).map(Some);
    }
    let value = |name: &str| model.params().iter().find(|p| *p.name == *name).map(|p| p.value);
    // With a degree of smoothness it may be as flat as one likes.
    let (Some(s), Some(0.0)) = (value("s"), value("d")) else { return Ok(None) };
    let known = |name: &str| {
        kind(name)
            .ok_or_else(|| FieldError::Invalid(format!("expected a kind called `{name}`, there is none")))
    };
    // f + g + √(f² + g²) is nowhere below the larger of both.
    let part = if s > 0.0 {
        Model::new(known("intersection")?, Vec::new(), operands, Payload::None)
    } else {
        let h = Payload::Expression(text::parse(UNION, &[])?);
        Model::new(known("blend")?, Vec::new(), operands, h)
    };
    part.map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Field;

    #[test]
    fn it_is_nowhere_above_the_model() {
        for source in [
            "r_blend(sphere(1), sphere(0.5))",
            "r_blend(x - 0.2, y + z, s=1)",
            "offset(r_blend(r_blend(x, y), z - 0.5), 0.3) | sphere(0.2)",
        ] {
            let model = text::parse(source, &[]).unwrap();
            let (f, g) = (Field::new(&model).unwrap(), Field::new(&minorant(&model).expect(source)).unwrap());
            let points: Vec<f64> =
                (0..3000).map(|k| (k as f64 * 0.618_033_988_749_895).fract() * 4.0 - 2.0).collect();
            let (mut above, mut below) = (vec![0.0; 1000], vec![0.0; 1000]);
            f.value(&points, &mut above).unwrap();
            g.value(&points, &mut below).unwrap();
            for (f, g) in above.iter().zip(&below) {
                assert!(
                    *g <= f + 1e-12 && (*f <= 0.0 || *g > 0.0 || source.contains("offset")),
                    "{source}: {g} {f}"
                );
            }
        }
        let smooth = text::parse("r_blend(sphere(1), sphere(0.5), d=2)", &[]).unwrap();
        assert!(minorant(&smooth).is_none());
        assert!(minorant(&text::parse("sphere(1)", &[]).unwrap()).is_none());
    }
}
