//! The document: drags, undo, replay, edits while floaters live on the surface, bad input.

use std::ops::ControlFlow;

use isoswarm_field::{Surface, text};
use isoswarm_scene::{Along, Amount, Command, Ending, Error, Hand, PinRef, Scene, Settings};

type V3 = [f64; 3];

fn scene(formula: &str, n: usize) -> Scene {
    let settings = Settings { amount: Amount::Count(n), ..Settings::default() };
    Scene::new(&text::parse(formula, &[]).unwrap(), settings).unwrap()
}

fn value(scene: &Scene, path: &str) -> f64 {
    let i = scene.field().parameter(path).unwrap();
    scene.field().parameters()[i].value
}

fn values(scene: &Scene) -> Vec<u64> {
    scene.field().parameters().iter().map(|p| p.value.to_bits()).collect()
}

/// Largest |F|/|∇F| over the floaters.
fn off(scene: &Scene) -> f64 {
    let points = &scene.frame().floaters.points;
    let (mut f, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    scene.field().value_gradient(points, &mut f, &mut g).unwrap();
    let size = |g: &V3| (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt();
    f.iter().zip(&g).map(|(f, g)| f.abs() / size(g)).fold(0.0, f64::max)
}

/// Standard deviation over mean of the distance between nearest neighbours.
fn unevenness(points: &[V3]) -> f64 {
    let nearest: Vec<f64> = (0..points.len())
        .map(|i| {
            let d = |j: usize| (0..3).map(|a| (points[i][a] - points[j][a]).powi(2)).sum::<f64>();
            (0..points.len()).filter(|&j| j != i).map(d).fold(f64::INFINITY, f64::min).sqrt()
        })
        .collect();
    let mean = nearest.iter().sum::<f64>() / nearest.len() as f64;
    (nearest.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / nearest.len() as f64).sqrt() / mean
}

fn grip(at: V3, radius: f64) -> Command {
    Command::Pin { at, name: None, weight: 1.0, softness: 0.0, along: None, grip: Some(radius) }
}

const PAIR: &str = "smooth_union(translate(sphere(r=1), x=-0.8), translate(sphere(r=0.7), x=0.9), k=0.3)";

#[test]
fn a_drag_moves_the_surface_and_the_floaters_stay_even_on_it() {
    let mut s = scene(PAIR, 400);
    let left = s.pin([-1.8, 0.0, 0.0]).unwrap();
    let hand = s.pin([1.6, 0.0, 0.0]).unwrap();
    let held = s.pins()[left as usize].pin.at;
    let report = s.drag(&[(hand, [2.2, 0.4, 0.1])]).unwrap();
    assert!(report.reached && report.ending == Ending::Reached, "{report:?}");
    assert_eq!((report.rank, report.pins), (2, 2));
    let size = 4.0;
    assert!(s.residuals().unwrap().iter().all(|d| *d < 1e-9 * size), "{:?}", s.residuals());
    assert_eq!(s.pins()[left as usize].pin.at, held);
    assert!(off(&s) < 1e-4, "{}", off(&s));
    assert!(unevenness(&s.frame().floaters.points) < 0.1, "{}", unevenness(&s.frame().floaters.points));
    let samples = s.samples(Some(500)).unwrap();
    assert_eq!(samples.points.len(), 500);
    assert!(samples.report.max_error < 1e-10);
}

#[test]
fn undo_and_redo_give_every_bit_back() {
    let mut s = scene(PAIR, 200);
    let hand = s.pin([1.6, 0.0, 0.0]).unwrap();
    let before = (values(&s), s.pins().to_vec());
    s.drag(&[(hand, [2.0, 0.5, 0.0])]).unwrap();
    let after = (values(&s), s.pins().to_vec());
    assert_ne!(before.0, after.0);
    s.apply(Command::Undo {}).unwrap();
    assert_eq!((values(&s), s.pins().to_vec()), before);
    assert!(off(&s) < 1e-3);
    s.apply(Command::Redo {}).unwrap();
    assert_eq!((values(&s), s.pins().to_vec()), after);
    // A tree edit, and back beyond the pin.
    s.apply(Command::Add { path: String::new(), model: "translate(sphere(r=0.4), y=2)".into(), name: None })
        .unwrap();
    for _ in 0..3 {
        s.apply(Command::Undo {}).unwrap();
    }
    assert!(s.pins().is_empty());
    assert_eq!(s.model().unwrap(), text::parse(PAIR, &[]).unwrap());
    let error = s.apply(Command::Undo {}).unwrap_err();
    assert!(error.to_string().contains("nothing to undo"), "{error}");
    assert_eq!(s.history(), (0, 3));
}

#[test]
fn a_log_replays_to_the_same_bits_on_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut s = scene(PAIR, 3000);
            let hand = s.pin([1.6, 0.0, 0.0]).unwrap();
            s.step(3).unwrap();
            s.drag(&[(hand, [2.0, 0.5, 0.0])]).unwrap();
            s.apply(Command::Freeze { pattern: "*r".into(), frozen: true }).unwrap();
            s.step(2).unwrap();
            s.drag(&[(hand, [2.0, -0.5, 0.3])]).unwrap();
            s
        })
    };
    let (one, four) = (run(1), run(4));
    assert_eq!(values(&one), values(&four));
    assert_eq!(one.frame().floaters, four.frame().floaters);
    let text = isoswarm_scene::script_to_json(one.log());
    let log = isoswarm_scene::script_from_json(&text).unwrap();
    assert_eq!(log, one.log());
    let mut again = scene(PAIR, 3000);
    again.replay(&log, &mut |_, _| ControlFlow::Continue(())).unwrap();
    assert_eq!(again.clock(), one.clock());
    assert_eq!(values(&again), values(&one));
    assert_eq!(again.frame().floaters, one.frame().floaters);
}

#[test]
fn floaters_survive_edits_of_the_tree() {
    let mut s = scene("sphere(r=1)", 300);
    let ids = s.frame().floaters.id.clone();
    s.apply(Command::Add {
        path: String::new(),
        model: "translate(sphere(r=0.5), x=4)".into(),
        name: Some("moon".into()),
    })
    .unwrap();
    let f = s.frame().floaters;
    let far = f.points.iter().filter(|p| p[0] > 3.0).count();
    assert!(far > 40, "{far} on the moon");
    let kept = ids.iter().filter(|id| f.id.contains(id)).count();
    assert_eq!(kept, ids.len(), "the others are the same as before");
    assert!(off(&s) < 1e-6);
    s.apply(Command::Remove { path: "moon".into() }).unwrap();
    assert!(s.frame().floaters.points.iter().all(|p| p[0] < 1.1));
    assert_eq!(s.model().unwrap(), text::parse("sphere(r=1)", &[]).unwrap());
    let mut parameters = std::collections::BTreeMap::new();
    parameters.insert("x".to_string(), 0.5);
    s.apply(Command::Wrap {
        path: "sphere".into(),
        kind: "translate".into(),
        parameters,
        name: Some("mover".into()),
    })
    .unwrap();
    assert_eq!(value(&s, "mover/x"), 0.5);
    assert!(
        s.frame()
            .floaters
            .points
            .iter()
            .all(|p| ((p[0] - 0.5).powi(2) + p[1] * p[1] + p[2] * p[2] - 1.0).abs() < 1e-3)
    );
    s.apply(Command::Unwrap { path: "mover".into() }).unwrap();
    assert_eq!(value(&s, "sphere/r"), 1.0);
}

#[test]
fn a_grip_keeps_a_patch_from_slipping() {
    // Pulling a sphere sideways at its top: without a grip the pin slides around it, with one the sphere comes along.
    let run = |pin: Command| {
        let mut s = scene("translate(sphere(r=1))", 200);
        s.apply(Command::Freeze { pattern: "sphere/r".into(), frozen: true }).unwrap();
        let id = s.apply(pin).unwrap().pin.unwrap();
        let report = s.drag(&[(id, [0.4, 0.0, 1.0])]).unwrap();
        let slip = report.slip[0].1[0];
        (value(&s, "translate/x"), report, slip)
    };
    let free =
        Command::Pin { at: [0.0, 0.0, 1.0], name: None, weight: 1.0, softness: 0.0, along: None, grip: None };
    let (x, report, slip) = run(free);
    assert!(report.reached && slip > 0.3 && x < 0.2, "slippery: {x} {report:?}");
    let (x, report, _) = run(grip([0.0, 0.0, 1.0], 0.3));
    assert!(report.reached && x > 0.36, "gripped: {x} {report:?}");
}

#[test]
fn a_region_follows_its_pin() {
    // A plane as a polynomial of degree six in x and y; a region is drawn out more broadly than a point.
    let mut s = scene("sphere(r=1)", 400);
    let hand = s.pin([0.0, 0.0, 1.0]).unwrap();
    let hands = vec![Hand { pin: PinRef::Number(hand), to: [0.0, 0.0, 1.2] }];
    let change = s.apply(Command::Drag { hands, radius: Some(0.6), steps: 200 }).unwrap();
    assert!(change.drag.unwrap().reached);
    assert!((value(&s, "sphere/r") - 1.2).abs() < 1e-6);
}

#[test]
fn a_handle_turns_what_it_holds() {
    // An ellipsoid turned by a quarter about z through three pins: rotation is free, the axes are locked.
    let mut s = scene("rotate(ellipsoid(1.5, 1, 0.8), 0, az=1)", 300);
    for pattern in ["ellipsoid/*", "rotate/ax", "rotate/ay", "rotate/az"] {
        s.apply(Command::Freeze { pattern: pattern.into(), frozen: true }).unwrap();
    }
    let a = s.pin([1.06, 0.7, 0.0]).unwrap();
    let angle = 0.7;
    let turn = Command::Turn {
        pins: vec![PinRef::Number(a)],
        centre: [0.0; 3],
        rotation: [0.0, 0.0, angle],
        translation: [0.0; 3],
        steps: 500,
    };
    let report = s.apply(turn).unwrap().drag.unwrap();
    assert!(report.reached, "{report:?}");
    let path = s.field().parameters().iter().find(|p| p.is_free()).unwrap().path.clone();
    assert!((value(&s, &path) - angle).abs() < 1e-6, "{path} {}", value(&s, &path));
}

#[test]
fn what_cannot_be_done_leaves_the_scene_as_it_was() {
    let mut s = scene("sphere(r=1) | translate(sphere(r=0.5), x=3)", 300);
    let before = (values(&s), s.frame().floaters.clone(), s.log().len());
    let pin = |at: V3| Command::Pin { at, name: None, weight: 1.0, softness: 0.0, along: None, grip: None };
    let refused = [
        (pin([f64::NAN, 0.0, 0.0]), "finite"),
        (pin([40.0, 0.0, 0.0]), "off the surface"),
        (Command::Set { path: "sphere/r".into(), value: -1.0, continued: false }, "sphere/r"),
        (Command::Set { path: "sphere/q".into(), value: 1.0, continued: false }, "sphere/r"),
        (Command::Replace { path: String::new(), model: "x^2 + y^2 + z^2 + 1".into() }, "no surface"),
        (Command::Replace { path: String::new(), model: "x^2 +".into() }, "position"),
        (Command::Remove { path: "nobody".into() }, "sphere_2"),
        (Command::Release {}, "nothing is held"),
        (Command::Redo {}, "nothing to redo"),
        (
            Command::Drag {
                hands: vec![Hand { pin: PinRef::Name("x".into()), to: [0.0; 3] }],
                radius: None,
                steps: 9,
            },
            "no pin",
        ),
        (Command::Freeze { pattern: "nothing/*".into(), frozen: true }, "no parameter"),
        (Command::Limit { pattern: "sphere/r".into(), bounds: [Some(2.0), Some(3.0)] }, "contain its value"),
    ];
    for (command, reason) in refused {
        let error = s.apply(command.clone()).unwrap_err().to_string();
        assert!(error.contains(reason), "{command:?}: {error}");
        assert_eq!((values(&s), s.frame().floaters.clone(), s.log().len()), before, "{command:?}");
    }
    assert!(matches!(
        Scene::new(&text::parse("x - y", &[]).unwrap(), Settings::default()),
        Err(Error::Unbounded)
    ));
}

#[test]
fn a_surface_that_leaves_its_box_is_followed() {
    let mut s = scene("translate(sphere(r=1))", 200);
    s.apply(Command::Freeze { pattern: "sphere/r".into(), frozen: true }).unwrap();
    let hand = s.pin([1.0, 0.0, 0.0]).unwrap();
    s.step(60).unwrap();
    assert!(s.drag(&[(hand, [9.0, 0.0, 0.0])]).unwrap().reached);
    let f = s.frame();
    assert!((value(&s, "translate/x") - 8.0).abs() < 1e-6);
    assert!(f.floaters.points.iter().all(|p| p[0] > 6.9), "all came along");
    assert!(f.floaters.len() > 150 && f.floaters.len() < 260, "{}", f.floaters.len());
    assert!(unevenness(&f.floaters.points) < 0.12);
}

#[test]
fn a_scene_is_restored_from_its_file_to_the_last_bit() {
    let mut s = scene(PAIR, 200);
    let along = Some(Along::Plane([1.0, 2.0, 3.0]));
    s.apply(Command::Pin {
        at: [-1.8, 0.0, 0.0],
        name: Some("foot".into()),
        weight: 2.0,
        softness: 0.0,
        along,
        grip: None,
    })
    .unwrap();
    let hand = s.pin([1.6, 0.0, 0.0]).unwrap();
    s.apply(Command::Rest {}).unwrap();
    s.drag(&[(hand, [2.0, 0.5, 0.1])]).unwrap();
    s.apply(Command::Freeze { pattern: "*k".into(), frozen: true }).unwrap();
    let text = s.to_json().unwrap();
    let back = Scene::from_json(&text, Settings::default(), &Default::default()).unwrap();
    assert_eq!(back.to_json().unwrap(), text);
    assert_eq!(values(&back), values(&s));
    assert_eq!(back.pins(), s.pins());
    assert_eq!(back.clock(), s.clock());
    assert_eq!(back.model().unwrap(), s.model().unwrap());
    // A model alone is a scene too.
    let model = isoswarm_field::json::to_json(&s.model().unwrap());
    assert!(Scene::from_json(&model, Settings::default(), &Default::default()).unwrap().pins().is_empty());
}

#[test]
fn hostile_files_are_refused() {
    let open = |text: &str| {
        Scene::from_json(text, Settings::default(), &Default::default()).unwrap_err().to_string()
    };
    let good = scene("sphere(r=1)", 100).to_json().unwrap();
    assert!(
        open(&good.replace("\"version\": 1,\n  \"model\"", "\"version\": 9,\n  \"model\""))
            .contains("update")
    );
    assert!(open(&good.replace("\"clock\"", "\"klock\"")).contains("klock"));
    assert!(open(&good.replace("\"count\":100", "\"count\":100000000000")).contains("floaters"));
    assert!(open(&good[..good.len() / 2]).contains("line"));
    assert!(open("[]").contains("scene"));
    assert!(
        open(
            "{\"format\": \"isoswarm scene\", \"version\": 1, \"model\": {\"format\": \"isoswarm model\", \
                 \"version\": 1, \"nodes\": [{\"kind\": \"union\", \"operands\": [0]}]}}"
        )
        .contains("before it")
    );
    let script = |c: &str| {
        let text = format!("{{\"format\": \"isoswarm script\", \"version\": 1, \"commands\": [{c}]}}");
        isoswarm_scene::script_from_json(&text)
    };
    assert!(
        script("{\"do\": \"drag\", \"hands\": [], \"speed\": 3}").unwrap_err().to_string().contains("speed")
    );
    assert!(script("{\"do\": \"fly\"}").unwrap_err().to_string().contains("command 0"));
    assert_eq!(script("{\"do\": \"step\"}").unwrap()[0].command, Command::Step { count: 1 });
}

#[test]
fn a_rest_shape_is_returned_to_when_the_hand_lets_go() {
    let mut s = scene("sphere(r=1)", 200);
    s.apply(Command::Rest {}).unwrap();
    let hand = s.pin([1.0, 0.0, 0.0]).unwrap();
    s.drag(&[(hand, [1.4, 0.0, 0.0])]).unwrap();
    assert!((value(&s, "sphere/r") - 1.4).abs() < 1e-6);
    s.apply(Command::Unpin { pin: PinRef::Number(hand) }).unwrap();
    let settings = Settings { recovery: 0.1, ..s.settings().clone() };
    s.apply(Command::Settings { settings }).unwrap();
    s.step(200).unwrap();
    assert!((value(&s, "sphere/r") - 1.0).abs() < 1e-6, "{}", value(&s, "sphere/r"));
}

/// How far each floater that is still there has gone.
fn ways(before: &[(u64, V3)], s: &Scene) -> Vec<(V3, V3)> {
    let f = s.frame().floaters;
    let now: std::collections::HashMap<u64, V3> =
        f.id.iter().copied().zip(f.points.iter().copied()).collect();
    before.iter().filter_map(|(id, b)| now.get(id).map(|p| (*b, *p))).collect()
}

#[test]
fn floaters_move_no_more_than_the_surface_makes_them() {
    // The aim of WH94 section 4: at rest nothing moves, and a moving surface moves its floaters along its normals only.
    let norm = |v: V3| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let mut s = scene("translate(sphere(r=1))", 300);
    s.step(60).unwrap();
    let ids = s.frame().floaters.id.clone();
    s.step(20).unwrap();
    assert_eq!(s.frame().floaters.id, ids, "no births and no deaths at rest");
    let before = |s: &Scene| -> Vec<(u64, V3)> {
        s.frame().floaters.id.iter().copied().zip(s.frame().floaters.points.iter().copied()).collect()
    };
    // Carried along by .3: no floater goes farther than the ball.
    s.apply(Command::Freeze { pattern: "sphere/r".into(), frozen: true }).unwrap();
    let hand = s.pin([1.0, 0.0, 0.0]).unwrap();
    let was = before(&s);
    s.drag(&[(hand, [1.3, 0.0, 0.0])]).unwrap();
    let gone = ways(&was, &s);
    assert!(gone.len() >= was.len() * 3 / 4, "{} of {} are left", gone.len(), was.len());
    let far = gone.iter().map(|(b, p)| norm([0, 1, 2].map(|a| p[a] - b[a]))).fold(0.0, f64::max);
    assert!(far < 0.35, "{far}");
    // Blown up: straight outward, in the step before others are born and want room.
    s.apply(Command::Freeze { pattern: "*".into(), frozen: true }).unwrap();
    s.apply(Command::Freeze { pattern: "sphere/r".into(), frozen: false }).unwrap();
    s.step(60).unwrap();
    let was = before(&s);
    let hands = vec![Hand { pin: PinRef::Number(hand), to: [1.5, 0.0, 0.0] }];
    s.apply(Command::Grab { hands, radius: None }).unwrap();
    s.step(1).unwrap();
    let grown = value(&s, "sphere/r") - 1.0;
    assert!(grown > 0.02, "{grown}");
    let mut drift: Vec<f64> = ways(&was, &s)
        .iter()
        .map(|(b, p)| {
            let n = [b[0] - 0.3, b[1], b[2]].map(|v| v / norm([b[0] - 0.3, b[1], b[2]]));
            let d = [0, 1, 2].map(|a| p[a] - b[a]);
            let out = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
            norm([0, 1, 2].map(|a| d[a] - out * n[a]))
        })
        .collect();
    drift.sort_by(f64::total_cmp);
    let (median, largest) = (drift[drift.len() / 2], drift[drift.len() - 1]);
    assert!(median < 0.02 * grown && largest < 0.05 * grown, "{median}, {largest} of {grown}");
}

#[test]
fn a_fit_passes_through_points_and_pins() {
    let mut s = scene("translate(ellipsoid(1, 1, 1))", 200);
    let around: Vec<V3> = (0..60)
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / 60.0;
            let (r, t) = ((1.0 - z * z).sqrt(), 2.4 * i as f64);
            [1.4 * r * t.cos() + 0.3, 0.9 * r * t.sin(), 1.1 * z - 0.2]
        })
        .collect();
    let fit = |points: &[V3]| Command::Fit {
        points: points.to_vec(),
        weights: vec![],
        loss: Default::default(),
        iterations: 50,
    };
    let report = s.apply(fit(&around)).unwrap().fit.unwrap();
    assert!(report.converged && report.largest < 1e-9 && report.rank == 6, "{report:?}");
    assert!((value(&s, "translate/x") - 0.3).abs() < 1e-8);
    assert!(off(&s) < 1e-6, "the floaters are on it");
    // A few wild points hardly count with a robust loss.
    let mut wild = around.clone();
    wild.extend([[3.0, 3.0, 3.0], [-4.0, 1.0, 0.0], [0.0, 5.0, 1.0]]);
    s.apply(Command::Undo {}).unwrap();
    let loss = isoswarm_scene::FitLoss::Cauchy(0.02);
    let robust = Command::Fit { points: wild, weights: vec![], loss, iterations: 200 };
    s.apply(robust).unwrap();
    assert!((value(&s, "translate/x") - 0.3).abs() < 1e-3, "{}", value(&s, "translate/x"));
    assert!(s.apply(fit(&[])).unwrap_err().to_string().contains("at least one"));
    assert!(s.apply(fit(&[[f64::NAN; 3]])).is_err());
}

#[test]
fn floaters_are_denser_where_the_hand_is() {
    let mut s = scene("sphere(r=1)", 400);
    s.pin([1.0, 0.0, 0.0]).unwrap();
    let count = |s: &Scene| {
        let near = |p: &&V3| p[0] > 0.9;
        (s.frame().floaters.points.iter().filter(near).count(), s.frame().floaters.len())
    };
    let before = count(&s);
    let focus = Some(isoswarm_scene::Focus { radius: 0.4, factor: 0.4 });
    s.apply(Command::Settings { settings: Settings { focus, ..s.settings().clone() } }).unwrap();
    s.step(120).unwrap();
    let after = count(&s);
    assert!(after.0 as f64 > 2.5 * before.0 as f64, "{before:?} {after:?}");
    assert!(after.1 - after.0 < before.1 + before.1 / 4, "elsewhere about as before: {before:?} {after:?}");
    s.apply(Command::Settings { settings: Settings { focus: None, ..s.settings().clone() } }).unwrap();
    s.step(120).unwrap();
    assert!((count(&s).0 as f64) < 1.6 * before.0 as f64, "{:?}", count(&s));
}

#[test]
fn the_published_schemas_are_current() {
    for (name, text) in isoswarm_scene::schemas() {
        let path = format!("{}/../../docs/{name}", env!("CARGO_MANIFEST_DIR"));
        let published = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            published == text,
            "run `cargo run -p isoswarm-scene --example schemas` and commit docs/{name}"
        );
    }
}

#[test]
fn floaters_of_a_part_that_vanishes_go_with_it() {
    let mut s = scene("translate(sphere(r=1), x=0) | translate(sphere(r=0.5), x=3)", 400);
    let count = |s: &Scene| s.frame().floaters.points.iter().filter(|p| p[0] > 2.0).count();
    assert!(count(&s) > 50);
    // The small sphere is swallowed by the large one, which moves over it.
    s.apply(Command::Freeze { pattern: "*".into(), frozen: true }).unwrap();
    s.apply(Command::Freeze { pattern: "translate_2/x".into(), frozen: false }).unwrap();
    let hand = s.pin([3.5, 0.0, 0.0]).unwrap();
    s.drag(&[(hand, [1.1, 0.0, 0.0])]).unwrap();
    s.step(60).unwrap();
    assert!(off(&s) < 1e-3, "{}", off(&s));
    assert!(count(&s) == 0);
}

#[test]
fn a_region_does_not_keep_pins_from_arriving() {
    let mut s = scene("translate(sphere(r=1))", 300);
    let (a, b) = (s.pin([-1.0, 0.0, 0.0]).unwrap(), s.pin([1.0, 0.0, 0.0]).unwrap());
    let hand = |pin: u64, to: V3| Hand { pin: PinRef::Number(pin), to };
    let hands = vec![hand(a, [-1.0, 0.0, 0.0]), hand(b, [1.6, 0.0, 0.0])];
    let report = s.apply(Command::Drag { hands, radius: Some(0.5), steps: 300 }).unwrap().drag.unwrap();
    assert!(report.reached, "{report:?}");
}

#[test]
fn floaters_that_follow_go_along_with_a_ball() {
    // A ball that slides along x through its own equations: paint on it goes along, shortest ways do not.
    let moved = |follow: bool| {
        let settings = Settings { amount: Amount::Count(300), follow, ..Settings::default() };
        let model = text::parse("(x - a)^2 + y^2 + z^2 - 1", &[("a", 0.0)]).unwrap();
        let mut s = Scene::new(&model, settings).unwrap();
        s.step(40).unwrap();
        let before: std::collections::BTreeMap<u64, V3> = {
            let f = &s.frame().floaters;
            f.id.iter().copied().zip(f.points.iter().copied()).collect()
        };
        let hand = s.pin([1.0, 0.0, 0.0]).unwrap();
        s.drag(&[(hand, [1.5, 0.0, 0.0])]).unwrap();
        assert!((value(&s, "a") - 0.5).abs() < 1e-9);
        let f = &s.frame().floaters;
        let ways: Vec<f64> =
            f.id.iter()
                .zip(&f.points)
                .filter_map(|(id, p)| {
                    before.get(id).map(|q| {
                        ((p[0] - q[0] - 0.5).powi(2) + (p[1] - q[1]).powi(2) + (p[2] - q[2]).powi(2)).sqrt()
                    })
                })
                .collect();
        // Where they are crowded some die on shortest ways; none does that goes along.
        assert!(ways.len() >= if follow { 300 } else { 150 }, "{follow}: {}", ways.len());
        ways.iter().sum::<f64>() / ways.len() as f64
    };
    let (along, shortest) = (moved(true), moved(false));
    assert!(along < 0.01 && shortest > 10.0 * along, "{along} with, {shortest} without");
}

#[test]
fn a_scene_at_rest_keeps_every_bit() {
    let mut s = Scene::new(&text::parse("torus(1, 0.4)", &[]).unwrap(), Settings::default()).unwrap();
    let hands: Vec<_> = [[1.4, 0.0, 0.0], [0.0, 1.0, 0.4]].iter().map(|&at| s.pin(at).unwrap()).collect();
    s.drag(&[(hands[0], [1.43, 0.02, 0.0])]).unwrap();
    let before: Vec<u64> = s.field().q().iter().map(|v| v.to_bits()).collect();
    s.step(40).unwrap();
    let after: Vec<u64> = s.field().q().iter().map(|v| v.to_bits()).collect();
    assert_eq!(before, after);
}
