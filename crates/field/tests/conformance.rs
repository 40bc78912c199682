//! Every evaluator against every other and against finite differences, on random formulas, random trees, and every
//! kind of the table.

use isoswarm_field::testkit::{
    Outcome, batches_agree, each_kind, evaluators_agree, expressions, gradient_differences,
    hessian_differences, operations, parameter_differences, points, rates_agree, run, scattered,
    threads_agree, trees,
};
use isoswarm_field::{Field, FieldError, Op, text};

fn all(field: &Field, points: &[[f64; 3]]) -> Outcome {
    let mut count = evaluators_agree(field, points)?;
    count += rates_agree(field, points)?;
    count += gradient_differences(field, points)?;
    count += parameter_differences(field, points)?;
    Ok(count + hessian_differences(field, points)?)
}

#[test]
fn random_formulas() {
    let mut used = [0; Op::ALL.len()];
    let mut counts = [0; 6];
    run(1000, 1, (expressions(25), points(1..40)), |(e, points)| {
        let field = Field::new(&e.model)?;
        let checks: [fn(&Field, &[[f64; 3]]) -> Outcome; 6] = [
            evaluators_agree,
            rates_agree,
            batches_agree,
            gradient_differences,
            parameter_differences,
            hessian_differences,
        ];
        for (check, count) in checks.iter().zip(&mut counts) {
            *count += check(&field, &points)?;
        }
        for (total, n) in used.iter_mut().zip(operations(&field)?) {
            *total += n;
        }
        Ok(())
    });
    for (op, n) in Op::ALL.iter().zip(used) {
        assert!(n >= 20, "the random formulas have {op:?} only {n} times");
    }
    for (i, n) in counts.iter().enumerate() {
        assert!(*n > 1500, "check {i} compared only {n} numbers");
    }
}

#[test]
fn random_trees() {
    let mut count = 0;
    run(300, 2, (trees(7), points(1..20)), |(tree, points)| {
        let field = match Field::new(&tree.model) {
            // Trees of repeated deformations may unfold beyond the bound on size.
            Err(FieldError::TooLarge(_)) => return Ok(()),
            field => field?,
        };
        if field.operations() < 2000 {
            count += all(&field, &points)?;
        }
        Ok(())
    });
    assert!(count > 10_000, "compared only {count} numbers");
}

#[test]
fn every_kind_with_default_and_random_parameters() {
    let numbers: Vec<Vec<f64>> =
        scattered(12, 0.5, 3).chunks(4).map(|c| c.iter().flatten().map(|v| v + 0.5).collect()).collect();
    let points = scattered(25, 1.6, 4);
    for model in each_kind(&numbers) {
        let name = model.kind().name;
        let field = Field::new(&model).unwrap();
        let checks: [(&str, fn(&Field, &[[f64; 3]]) -> Outcome); 5] = [
            ("evaluators", evaluators_agree),
            ("rates", rates_agree),
            ("gradient", gradient_differences),
            ("parameters", parameter_differences),
            ("Hessian", hessian_differences),
        ];
        for (what, check) in checks {
            let count =
                check(&field, &points).unwrap_or_else(|e| panic!("{name} {:?}: {what}: {e}", field.q()));
            let expected = what != "parameters" || !field.free().is_empty();
            // Defined in part of space, or with a step next to most parameters.
            let least = match name {
                "acosh" => 3,
                "repeat" | "asin" | "acos" | "ln" | "log2" | "log10" | "sqrt" | "pow" | "atanh" => 5,
                _ => 20,
            };
            assert!(count >= least || !expected, "{name}: {what}: only {count} comparisons");
        }
    }
}

/// Shapes for checks that need much of one thing rather than many models.
fn several() -> Vec<Field> {
    let texts = [
        "smooth_union(sphere(1), torus(1.2, 0.3), translate(box(1, 2, 1), 0.5), k=0.2)",
        "(rotate(cylinder(0.5, 2), 0.4) | sphere(0.8)) - twist(rounded_box(1, 1, 1, 0.2), 0.7)",
        "blobs(0.5, 0, 0, 0, 1, 0.9, 0, 0, 0.7, 0, 0.8, 0.1, 0.6)",
        "planar(min(x^2 + y^2 - 1, (x - 1)^2 + atan2(y, x) - a))",
        "stack(x^2 + y^2 - a, z - sin(x*y), mod(x + y, a))",
    ];
    let parameters: &[(&str, f64)] = &[("a", 1.25)];
    let given = |t: &str| if t.contains("stack") || t.contains("planar") { parameters } else { &[] };
    texts.iter().map(|t| Field::new(&text::parse(t, given(t)).unwrap()).unwrap()).collect()
}

#[test]
fn thread_counts_do_not_matter() {
    let points = scattered(3001, 2.0, 5);
    for field in several() {
        assert!(threads_agree(&field, &points).unwrap() > 30_000);
    }
}

#[test]
fn batch_sizes_do_not_matter() {
    // Around the lengths of blocks: 8, 16, 32 and 64.
    for n in [1, 7, 8, 9, 15, 16, 17, 31, 32, 33, 63, 64, 65, 130] {
        let points = scattered(n, 2.0, n as u64);
        for field in several() {
            batches_agree(&field, &points).unwrap();
        }
    }
}

#[test]
fn long_tapes_run_in_short_blocks_with_the_same_bits() {
    // So many registers that blocks of 64 would leave the cache.
    let terms: Vec<String> = (0..1500).map(|i| format!("sin({}*x + y*{i})*cos(z + {i})", i + 1)).collect();
    let sum = Field::new(&text::parse(&terms.join(" + "), &[]).unwrap()).unwrap();
    let points = scattered(150, 1.0, 6);
    batches_agree(&sum, &points).unwrap();
    evaluators_agree(&sum, &points).unwrap();
}

#[test]
fn points_in_a_batch_do_not_touch_each_other() {
    for field in several() {
        let d = field.axes();
        let flat: Vec<f64> = scattered(100, 2.0, 7).iter().flat_map(|p| p[..d].to_vec()).collect();
        let mut spoilt = flat.clone();
        for (i, bad) in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308].into_iter().enumerate() {
            spoilt[(17 + 13 * i) * d] = bad;
        }
        let (n, k) = (100, field.components());
        let run = |flat: &[f64]| {
            let (mut v, mut g) = (vec![0.0; n * k], vec![0.0; n * k * d]);
            field.gradient(flat, &mut v, &mut g).unwrap();
            (v, g)
        };
        let (whole, other) = (run(&flat), run(&spoilt));
        for i in (0..n).filter(|i| ![17, 30, 43, 56].contains(i)) {
            assert_eq!(whole.0[i * k..(i + 1) * k], other.0[i * k..(i + 1) * k]);
            assert_eq!(whole.1[i * k * d..(i + 1) * k * d], other.1[i * k * d..(i + 1) * k * d]);
        }
        assert!(other.0[17 * k].is_nan(), "NaN in, NaN out");
    }
}
