//! Pruned tapes answer as whole ones do; interval searches lose nothing; bounds contain.

use isoswarm_field::testkit::{
    cells_keep_zeros, each_kind, expressions, points, pruning_keeps, run, scattered, trees,
};
use isoswarm_field::{Aabb, Field, FieldError, Interval, RegionOptions, Surface, text};

fn field(text: &str) -> Field {
    Field::new(&text::parse(text, &[]).unwrap_or_else(|e| panic!("{text}: {e}"))).unwrap()
}

#[test]
fn random_formulas() {
    let mut count = 0;
    run(600, 21, (expressions(20), points(1..200), 0u32..4), |(e, points, m)| {
        let margin = [0.0, 1e-9, 0.05, 0.5][m as usize];
        count += pruning_keeps(&Field::new(&e.model)?, &points, margin, 0.0)?;
        Ok(())
    });
    assert!(count > 50_000, "compared only {count} points");
}

#[test]
fn random_trees() {
    let mut count = 0;
    run(200, 22, (trees(8), points(1..300), 0u32..3), |(tree, points, m)| {
        let field = match Field::new(&tree.model) {
            Err(FieldError::TooLarge(_)) => return Ok(()),
            field => field?,
        };
        if field.operations() < 2000 {
            count += pruning_keeps(&field, &points, [0.0, 0.01, 0.2][m as usize], 0.0)?;
        }
        Ok(())
    });
    assert!(count > 20_000, "compared only {count} points");
}

#[test]
fn every_kind() {
    let cloud = scattered(150, 1.3, 23);
    // Boxes without extent: single points, and points in planes through kinks.
    let flat: Vec<[f64; 3]> = cloud.iter().map(|p| [p[0], 0.5, 0.0]).collect();
    for model in each_kind(&[]) {
        let field = Field::new(&model).unwrap();
        for (points, margin) in [(&cloud, 0.02), (&flat, 0.0)] {
            pruning_keeps(&field, points, margin, 0.0)
                .unwrap_or_else(|e| panic!("{} with margin {margin}: {e}", model.kind().name));
        }
    }
}

#[test]
fn regions_without_extent_keep_derivatives() {
    // In the plane z = 1/2 all of these are single numbers, but they still change with z.
    let points: Vec<[f64; 3]> = scattered(40, 1.0, 24).iter().map(|p| [p[0], p[1], 0.5]).collect();
    for text in ["-z + 0*x", "abs(z) - 0.5 + x", "max(z, 0.25) + x", "(0.5 - z)*y + x", "min(z, 1 - z) + x"] {
        let f = field(text);
        let narrowed = f.narrowed_for(&points, 0.0, None, RegionOptions::default()).unwrap();
        let (mut v, mut w) = (vec![0.0; 40], vec![0.0; 40]);
        let (mut g, mut h) = (vec![[0.0; 3]; 40], vec![[0.0; 3]; 40]);
        Surface::value_gradient(&f, &points, &mut v, &mut g).unwrap();
        narrowed.value_gradient(&points, &mut w, &mut h).unwrap();
        assert_eq!((v, &g), (w, &h), "{text}");
        assert!(g.iter().all(|g| g[2] != 0.0) || text.starts_with("min"), "{text} has a derivative in z");
    }
}

#[test]
fn dropped_tails_stay_within_the_bound() {
    let balls: Vec<String> = scattered(60, 3.0, 25)
        .iter()
        .map(|p| format!("{}, {}, {}, {}", p[0], p[1], p[2], 0.4 + 0.1 * p[0].abs()))
        .collect();
    let texts = [
        format!("blobs(0.5, {})", balls.join(", ")),
        format!("gaussians(1, 2, {})", balls.join(", ")),
        "smooth_union(sphere(1), translate(torus(1, 0.2), 2), translate(box(1, 1, 1), -2), k=0.05)"
            .to_string(),
    ];
    let points = scattered(2000, 3.0, 26);
    let mut spatial = points.clone();
    spatial.sort_by(|a, b| ((a[0] * 2.0).floor(), a[1]).partial_cmp(&((b[0] * 2.0).floor(), b[1])).unwrap());
    for text in texts {
        let f = field(&text);
        let whole = f.operations() as f64;
        for tail in [1e-16, 1e-9, 1e-4] {
            pruning_keeps(&f, &spatial, 0.01, tail).unwrap_or_else(|e| panic!("{text}, tail {tail}: {e}"));
        }
        let options = RegionOptions { leaf: 64, tail: 1e-9 };
        let narrowed = f.narrowed_for(&spatial, 0.01, None, options).unwrap();
        assert!(
            narrowed.regions() > 10 && narrowed.operations() < whole,
            "{text}: {}",
            narrowed.operations()
        );
    }
}

#[test]
fn the_losing_side_disappears() {
    let parts: Vec<String> = (0..60).map(|i| format!("translate(sphere(0.4), {})", i)).collect();
    let f = field(&format!("union({})", parts.join(", ")));
    let mut points = scattered(4000, 0.5, 27);
    for (i, p) in points.iter_mut().enumerate() {
        p[0] += (i / 67) as f64;
    }
    let narrowed = f.narrowed_for(&points, 0.0, None, RegionOptions { leaf: 64, tail: 0.0 }).unwrap();
    assert!(
        narrowed.operations() < 0.1 * f.operations() as f64,
        "{} of {}",
        narrowed.operations(),
        f.operations()
    );
    assert!(pruning_keeps(&f, &points, 0.1, 0.0).unwrap() > 20_000);
}

#[test]
fn parameters_may_move_within_their_spans() {
    let mut f =
        Field::new(&text::parse("max(x - a, min(y, a*z)) + floor(a)", &[("a", 0.5)]).unwrap()).unwrap();
    let points = scattered(300, 0.3, 28);
    let spans = [Interval::new(0.4, 0.6)];
    let original = f.clone();
    original.narrowed_for(&points, 0.1, Some(&spans), RegionOptions::default()).unwrap();
    assert!(original.narrowed_for(&points, 0.1, Some(&[]), RegionOptions::default()).is_err());
    // What was pruned for the span is right at any value in it: compare the spans' intervals with values.
    let range = |f: &Field| f.interval(&[-0.4; 3], &[0.4; 3]).unwrap()[0];
    for a in [0.4, 0.5, 0.6] {
        f.set_value(0, a).unwrap();
        let mut v = vec![0.0; points.len()];
        f.value(points.as_flattened(), &mut v).unwrap();
        assert!(v.iter().all(|v| range(&f).contains(*v)));
    }
}

#[test]
fn narrowed_surfaces_refuse_other_points() {
    let f = field("torus(1, 0.25) | sphere(0.5) | box(1, 1, 1)");
    let points = scattered(100, 1.0, 29);
    let narrowed = Surface::narrowed(&f, &points, 0.1).unwrap().expect("the tape is long enough");
    let (mut v, mut g) = (vec![0.0; 99], vec![[0.0; 3]; 99]);
    let e = narrowed.value_gradient(&points[..99], &mut v, &mut g).unwrap_err().to_string();
    assert!(e.contains("expected 100 points") && e.contains("given 99"), "{e}");
}

/// Name, formula, whether bounded, and a box around it or around the part of it to look at.
fn surfaces() -> Vec<(String, String, bool, Aabb)> {
    let json: serde_json::Value =
        serde_json::from_str(include_str!("../../../models/surfaces.json")).unwrap();
    let corner = |v: &serde_json::Value| -> [f64; 3] { std::array::from_fn(|a| v[a].as_f64().unwrap()) };
    json.as_array()
        .unwrap()
        .iter()
        .map(|s| {
            let text = |key: &str| s[key].as_str().unwrap().to_string();
            let bounds = Aabb::new(corner(&s["bbox"][0]), corner(&s["bbox"][1]));
            // What hangs out of some compact surfaces are whole lines.
            let lines = s["tags"].as_array().unwrap().iter().any(|t| t == "lower-dim-part");
            (text("name"), text("expr"), s["compact"].as_bool().unwrap() && !lines, bounds)
        })
        .collect()
}

#[test]
fn bounds_contain_every_compact_surface_and_there_are_none_for_others() {
    for (name, expr, compact, near) in surfaces() {
        let f = field(&expr);
        let Some(bounds) = f.bounds() else {
            assert!(!compact, "{name} is compact, but no bounds were found");
            continue;
        };
        assert!(compact, "{name} is not compact, but has the bounds {bounds:?}");
        let found = newton(&f, &near.grown(0.2 * near.diagonal()), 400);
        assert!(found.len() > 50, "{name}: only {} zeros", found.len());
        for p in found {
            assert!(bounds.contains(p), "{name}: the zero {p:?} is outside of {bounds:?}");
        }
        assert!(bounds.diagonal() < 3.0 * near.diagonal(), "{name}: {bounds:?} is far too large");
    }
}

/// Points of the surface found by Newton's method from points scattered over the box.
fn newton(f: &Field, within: &Aabb, n: usize) -> Vec<[f64; 3]> {
    let place =
        |p: [f64; 3]| std::array::from_fn(|a| within.lo[a] + p[a].abs() * (within.hi[a] - within.lo[a]));
    let mut points: Vec<[f64; 3]> = scattered(n, 1.0, 30).into_iter().map(place).collect();
    let (mut v, mut g) = (vec![0.0; n], vec![[0.0; 3]; n]);
    for _ in 0..60 {
        Surface::value_gradient(f, &points, &mut v, &mut g).unwrap();
        for (p, (f, g)) in points.iter_mut().zip(v.iter().zip(&g)) {
            let size: f64 = g.iter().map(|c| c * c).sum();
            if size > 0.0 {
                *p = std::array::from_fn(|a| p[a] - f * g[a] / size);
            }
        }
    }
    Surface::value_gradient(f, &points, &mut v, &mut g).unwrap();
    let is_zero = |i: usize| v[i].abs() <= 1e-12 * g[i].iter().map(|c| c * c).sum::<f64>().sqrt();
    (0..n).filter(|&i| is_zero(i)).map(|i| points[i]).collect()
}

#[test]
fn interval_search_loses_no_zero() {
    for (name, expr, _, near) in surfaces() {
        let f = field(&expr);
        let side = near.diagonal() / 20.0;
        let place =
            |p: [f64; 3]| std::array::from_fn(|a| near.lo[a] + p[a].abs() * (near.hi[a] - near.lo[a]));
        let starts: Vec<[f64; 3]> = scattered(200, 1.0, 31).into_iter().map(place).collect();
        let zeros = cells_keep_zeros(&f, &near, side, &starts).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(zeros > 20, "{name}: only {zeros} zeros");
    }
    let curve = field("planar((x^2 + y^2 - 1)*(x - 0.2) - 0.1)");
    let plane = Aabb::new([-2.0, -2.0, 0.0], [2.0, 2.0, 0.0]);
    let starts: Vec<[f64; 3]> = scattered(200, 2.0, 32).iter().map(|p| [p[0], p[1], 0.0]).collect();
    assert!(cells_keep_zeros(&curve, &plane, 0.1, &starts).unwrap() > 50);
}

#[test]
fn an_empty_surface_has_no_boxes_and_few_are_kept_few() {
    let everywhere = Aabb::new([-2.0; 3], [2.0; 3]);
    let empty = field("x^2 + y^2 + z^2 + 1");
    let cells = empty.cells(&everywhere, 0.1, 10_000).unwrap();
    assert!(cells.boxes.is_empty());
    let (mut v, mut g) = (vec![0.0; 1], vec![[0.0; 3]; 1]);
    cells.evaluate.value_gradient(&[[1.0, 0.0, 0.0]], &mut v, &mut g).unwrap();
    assert_eq!((v[0], g[0]), (2.0, [2.0, 0.0, 0.0]), "the evaluator works outside of all boxes");
    let sphere = field("x^2 + y^2 + z^2 - 1");
    let cells = sphere.cells(&everywhere, 1e-3, 1000).unwrap();
    assert!(cells.boxes.len() <= 2000 && cells.side > 1e-3, "{} boxes of {}", cells.boxes.len(), cells.side);
    let stacked = field("stack(x, y)");
    assert!(stacked.cells(&everywhere, 0.1, 1000).is_none());
}

#[test]
fn narrowing_through_the_interface_is_exact_enough() -> Result<(), Box<dyn std::error::Error>> {
    // The interface chooses the tail: 1e-13 of |grad F| times the diameter in all.
    let balls: Vec<String> =
        scattered(100, 3.0, 33).iter().map(|p| format!("{}, {}, {}, 0.5", p[0], p[1], p[2])).collect();
    let blobs = format!("blobs(0.5, {})", balls.join(", "));
    // A sum of bumps needs no narrowing; what is more than that is pruned. Both against the whole tape.
    for (formula, is_narrowed) in [(blobs.clone(), false), (format!("({blobs}) * (4 + 0.1*z)"), true)] {
        let f = field(&formula);
        let bounds = f.bounds().unwrap_or(Aabb::new([-4.0; 3], [4.0; 3]));
        let points = newton(&f, &bounds, 3000);
        assert!(points.len() > 1000);
        let narrowed = Surface::narrowed(&f, &points, 0.01)?;
        assert_eq!(narrowed.is_some(), is_narrowed);
        let surface: &dyn Surface = narrowed.as_deref().unwrap_or(&f);
        let n = points.len();
        let (mut v, mut w) = (vec![0.0; n], vec![0.0; n]);
        let (mut g, mut h) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
        f.gradient(points.as_flattened(), &mut v, g.as_flattened_mut())?;
        surface.value_gradient(&points, &mut w, &mut h)?;
        let size = |g: &[f64; 3]| g.iter().map(|c| c * c).sum::<f64>().sqrt();
        for i in 0..n {
            assert!((v[i] - w[i]).abs() <= 1e-12 * bounds.diagonal() * size(&g[i]), "{:e} {:e}", v[i], w[i]);
        }
    }
    Ok(())
}

#[test]
fn thread_counts_do_not_matter() {
    let f =
        field("smooth_union(sphere(1), torus(1.2, 0.3), box(1, 2, 1), k=0.2) - translate(sphere(0.5), 1)");
    let points = scattered(5000, 1.5, 34);
    let results: Vec<_> = [1, 2, 5]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let narrowed = Surface::narrowed(&f, &points, 0.01).unwrap().unwrap();
                let (mut v, mut g) = (vec![0.0; 5000], vec![[0.0; 3]; 5000]);
                narrowed.value_gradient(&points, &mut v, &mut g).unwrap();
                let cells = f.cells(&Aabb::new([-2.0; 3], [2.0; 3]), 0.1, 100_000).unwrap();
                (v, g, cells.boxes)
            })
        })
        .collect();
    assert!(results.windows(2).all(|w| w[0] == w[1]));
}

#[test]
fn deformed_shapes_have_bounds() {
    let texts = [
        "taper(box(1, 1, 2), 0.4)",
        "taper(translate(sphere(1), 2, 0, 0), -0.3, axis=0)",
        "twist(box(2, 1, 3), 1.5)",
        "twist(translate(box(1, 1, 1), 2, 0, 0), 0.8, axis=1)",
        "bend(box(4, 0.5, 0.5), 0.6)",
        "bend(box(4, 0.5, 0.5), 0)",
        "bend(cylinder(0.3, 3), 0.5, axis=1)",
        "twist(taper(box(1, 1, 2), 0.4), 0.7)",
        // R-functions, of which plain intervals see no end.
        "r_blend(sphere(1), translate(sphere(1), 1.5, 0, 0))",
        "offset(r_blend(r_blend(sphere(1), translate(sphere(0.8), 1.5, 0, 0)), box(4, 0.5, 0.5)), 0.1)",
        "translate(twist(r_blend(box(1, 1, 2), cylinder(0.4, 3)), 0.5), 1, 0, 0)",
    ];
    for text in texts {
        let f = field(text);
        let bounds = f.bounds().unwrap_or_else(|| panic!("{text}: no box"));
        assert!(bounds.diagonal() < 25.0, "{text}: {bounds:?}");
        let zeros = cells_keep_zeros(&f, &bounds, bounds.diagonal() / 16.0, &scattered(200, 4.0, 27));
        assert!(zeros.unwrap_or_else(|e| panic!("{text}: {e}")) > 20, "{text}");
        // What Newton's method finds from afar lies in the box too.
        let found = newton(&f, &bounds.grown(2.0 * bounds.diagonal()), 300);
        assert!(found.len() > 20, "{text}: {} zeros", found.len());
        assert!(found.iter().all(|p| bounds.contains(*p)), "{text}");
    }
}
