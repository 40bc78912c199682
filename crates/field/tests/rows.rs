//! Sparse rows of ∂F/∂q are the dense ones, on random models and all shapes, on any number of threads.

use isoswarm_field::testkit::{
    bump_rows_agree, each_kind, expressions, points, pruned_rows_agree, run, scattered, trees,
};
use isoswarm_field::{Field, FieldError, Parametric, SparseRows, Surface, text};

fn field(formula: &str) -> Field {
    Field::new(&text::parse(formula, &[]).unwrap()).unwrap()
}

#[test]
fn random_formulas() {
    let mut count = 0;
    run(400, 31, (expressions(25), points(1..40)), |(e, points)| {
        count += pruned_rows_agree(&Field::new(&e.model)?, &points)?;
        Ok(())
    });
    assert!(count > 2000, "compared only {count} numbers");
}

#[test]
fn random_trees() {
    let mut count = 0;
    run(200, 32, (trees(8), points(1..60)), |(tree, points)| {
        let field = match Field::new(&tree.model) {
            Err(FieldError::TooLarge(_)) => return Ok(()),
            field => field?,
        };
        if field.operations() < 2000 {
            count += pruned_rows_agree(&field, &points)?;
        }
        Ok(())
    });
    assert!(count > 20_000, "compared only {count} numbers");
}

#[test]
fn every_kind() {
    let cloud = scattered(40, 1.3, 33);
    for model in each_kind(&[]) {
        let field = Field::new(&model).unwrap();
        pruned_rows_agree(&field, &cloud).unwrap_or_else(|e| panic!("{}: {e}", model.kind().name));
    }
}

/// `n` balls in a cube, far enough from each other that few count at a point.
fn balls(n: usize, side: f64) -> String {
    let of = |p: &[f64; 3]| format!("{}, {}, {}, {}", p[0], p[1], p[2], 0.3 + 0.05 * p[0].abs());
    scattered(n, side, 34).iter().map(of).collect::<Vec<_>>().join(", ")
}

#[test]
fn sums_of_bumps() {
    // With parameters that all bumps share, factors, signs, and constants beside them.
    let terms: Vec<String> = scattered(30, 3.0, 35)
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let (w, sign) = (2.0 + 0.1 * i as f64, if i % 3 == 0 { "-" } else { "+" });
            format!("{sign} a*exp(-{w}*((x - b - {})^2 + (y - {})^2 + (z - c*{})^2))/d", p[0], p[1], p[2])
        })
        .collect();
    let formula = format!("k - 2*(h {})", terms.join(" "));
    let given = [("a", 0.7), ("b", 0.1), ("c", 1.1), ("d", 1.3), ("k", 0.3), ("h", 0.05)];
    let sum = Field::new(&text::parse(&formula, &given).unwrap()).unwrap();
    let texts = [format!("blobs(0.5, {})", balls(60, 3.0)), format!("gaussians(1, 2, {})", balls(60, 3.0))];
    let points = scattered(100, 3.0, 36);
    for f in texts.iter().map(|t| field(t)).chain([sum]) {
        let compared = bump_rows_agree(&f, &points, 1e-13).unwrap();
        assert!(compared >= 600, "{compared} comparisons for {} parameters", f.q().len());
    }
}

#[test]
fn frozen_parameters_have_no_column() {
    let mut f = field(&format!("blobs(0.5, {})", balls(40, 3.0)));
    (0..f.parameters().len()).filter(|i| i % 3 == 0).for_each(|i| f.set_frozen(i, true));
    assert!(bump_rows_agree(&f, &scattered(50, 3.0, 37), 1e-13).unwrap() > 1000);
}

fn rows(f: &Field, points: &[[f64; 3]]) -> (Vec<f64>, Vec<[f64; 3]>, SparseRows) {
    let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    let rows = f.sparse_parameter_gradient(points, &mut v, &mut g).unwrap();
    (v, g, rows)
}

#[test]
fn large_local_models_have_short_rows() {
    let spheres: Vec<String> = scattered(300, 8.0, 38)
        .iter()
        .map(|p| format!("translate(sphere(0.4), {}, {}, {})", p[0], p[1], p[2]))
        .collect();
    let points = scattered(100, 8.0, 39);
    let union = field(&spheres.join(" | "));
    let bumps = field(&format!("blobs(0.5, {})", balls(300, 8.0)));
    for (what, f, most) in [("union", &union, 0.1), ("bumps", &bumps, 0.2)] {
        let (v, g, rows) = rows(f, &points);
        let m = f.q().len();
        let part = rows.entries() as f64 / (m * points.len()) as f64;
        assert!(part < most, "{what}: {part} of the entries");
        let (mut w, mut h) = (vec![0.0; 100], vec![[0.0; 3]; 100]);
        Surface::value_gradient(f, &points, &mut w, &mut h).unwrap();
        assert_eq!(v, w, "{what}");
        assert!(
            g.iter()
                .flatten()
                .zip(h.iter().flatten())
                .all(|(a, b)| (a - b).abs() <= 1e-13 * b.abs().max(1.0))
        );
        // The columns of a row are all there are, each once.
        for i in 0..rows.len() {
            let mut columns = rows.row(i).0.to_vec();
            columns.sort_unstable();
            columns.dedup();
            assert_eq!(columns.len(), rows.row(i).0.len());
        }
    }
    assert!(pruned_rows_agree(&union, &points).unwrap() > 100_000);
}

#[test]
fn few_parameters_and_odd_points() {
    let f = field("sphere(1) | translate(sphere(1), 1.5, 0, 0)");
    let (_, _, few) = rows(&f, &[[0.0, 0.0, 1.0]]);
    assert_eq!((few.len(), few.entries()), (1, f.q().len()), "all of them where there are few");
    let g = field(&format!("blobs(0.5, {})", balls(100, 3.0)));
    let (v, _, odd) = rows(&g, &[[f64::NAN; 3], [0.0; 3], [1e30, 0.0, 0.0], [f64::INFINITY, 0.0, 0.0]]);
    assert!(v[0].is_nan() && v[1].is_finite());
    assert_eq!((odd.len(), odd.width()), (4, 401));
    assert_eq!(odd.row(2).0.len(), 1, "far away only the bias counts");
    assert!(rows(&g, &[]).2.is_empty());
}

#[test]
fn thread_counts_do_not_matter() {
    let spheres: Vec<String> = scattered(100, 4.0, 40)
        .iter()
        .map(|p| format!("translate(sphere(0.4), {}, {}, {})", p[0], p[1], p[2]))
        .collect();
    let points = scattered(333, 4.0, 41);
    for f in [field(&spheres.join(" | ")), field(&format!("blobs(0.5, {})", balls(100, 4.0)))] {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| rows(&f, &points))
        };
        let one = on(1);
        assert!(one.2.entries() < one.2.len() * one.2.width() / 2);
        assert_eq!(one, on(2));
        assert_eq!(one, on(5));
    }
}
