//! What front-ends need: picking, bundles of commands, sliders, copies, values taken over.

use std::collections::BTreeMap;

use isoswarm_field::{Field, text};
use isoswarm_scene::{Amount, Change, Command, Ending, Hand, PinRef, Scene, Settings};

fn scene(formula: &str) -> Scene {
    let model = text::parse(formula, &[]).unwrap();
    Scene::new(&model, Settings { amount: Amount::Count(400), ..Settings::default() }).unwrap()
}

fn value(s: &Scene, path: &str) -> f64 {
    s.field().parameters()[s.field().parameter(path).unwrap()].value
}

fn set(path: &str, value: f64, continued: bool) -> Command {
    Command::Set { path: path.into(), value, continued }
}

fn paths(s: &Scene) -> Vec<String> {
    s.model().unwrap().nodes().into_iter().map(|n| n.path).collect()
}

#[test]
fn a_ray_meets_the_nearer_side_of_a_torus_where_algebra_says() {
    let s = scene("torus(major=1, minor=0.3)");
    let hit = s.pick([5.0, 0.1, 0.05], [-2.0, 0.0, 0.0]).unwrap().unwrap();
    // (|xy| - 1)² + z² = 0.3² at y = 0.1, z = 0.05.
    let x = ((1.0 + (0.09f64 - 0.0025).sqrt()).powi(2) - 0.01).sqrt();
    assert!((hit.at[0] - x).abs() < 1e-10, "{hit:?}");
    assert!((hit.t - (5.0 - x) / 2.0).abs() < 1e-10, "{hit:?}");
    assert!(hit.normal[0] > 0.9);
    // From the middle it meets the inner side; through the hole it meets nothing.
    let inner = s.pick([0.0; 3], [1.0, 0.0, 0.0]).unwrap().unwrap();
    assert!((inner.at[0] - 0.7).abs() < 1e-10 && inner.normal[0] < -0.9, "{inner:?}");
    assert_eq!(s.pick([0.0, 0.0, 5.0], [0.0, 0.0, -1.0]).unwrap(), None);
    // Behind the eye there is nothing.
    assert_eq!(s.pick([5.0, 0.0, 0.0], [1.0, 0.0, 0.0]).unwrap(), None);
    assert!(s.pick([5.0, 0.0, 0.0], [0.0; 3]).unwrap_err().to_string().contains("not zero"));
    assert!(s.pick([f64::NAN; 3], [1.0, 0.0, 0.0]).is_err());
    let near = s.nearest([1.5, 0.0, 0.0]).unwrap().unwrap();
    assert!((near.at[0] - 1.3).abs() < 1e-10);
}

#[test]
fn every_ray_towards_a_sphere_hits_it() {
    let s = scene("sphere(r=1)");
    for k in 0..400 {
        let (u, v) = (f64::from(k % 20) / 20.0 - 0.475, f64::from(k / 20) / 20.0 - 0.475);
        let hit = s.pick([1.9 * u, 1.9 * v, 9.0], [0.0, 0.0, -1.0]).unwrap();
        let inside = 1.9f64 * 1.9 * (u * u + v * v);
        if inside < 0.98 {
            let z = (1.0 - inside).sqrt();
            let hit = hit.unwrap_or_else(|| panic!("missed at {u}, {v}"));
            assert!((hit.at[2] - z).abs() < 1e-9, "{hit:?}");
        }
    }
}

#[test]
fn a_slider_is_undone_as_one_and_two_are_two() {
    let mut s = scene("sphere(r=1) | translate(sphere(r=0.5), x=1)");
    for k in 1..=5 {
        s.apply(set("sphere/r", 1.0 + 0.02 * f64::from(k), k > 1)).unwrap();
        s.step(2).unwrap();
    }
    s.apply(set("translate/x", 1.1, true)).unwrap();
    assert_eq!(s.history(), (2, 0));
    s.apply(Command::Undo {}).unwrap();
    assert_eq!((value(&s, "sphere/r"), value(&s, "translate/x")), (1.1, 1.0));
    s.apply(Command::Undo {}).unwrap();
    assert_eq!(value(&s, "sphere/r"), 1.0);
    // After an undo nothing goes on: what was undone is gone.
    s.apply(set("sphere/r", 1.3, true)).unwrap();
    assert_eq!(s.history(), (1, 0));
}

#[test]
fn together_is_all_or_nothing_and_one_undo() {
    let mut s = scene("sphere(r=1)");
    let add = |model: &str, name: &str| Command::Add {
        path: String::new(),
        model: model.into(),
        name: Some(name.into()),
    };
    let both = vec![add("translate(sphere(r=0.4), x=1)", "a"), add("translate(sphere(r=0.4), x=-1)", "b")];
    let change = s.apply(Command::Together { commands: both }).unwrap();
    assert!(change.model);
    assert_eq!(s.history(), (1, 0));
    let before = (paths(&s), s.frame().floaters.clone());
    let bad = vec![set("sphere/r", 0.9, false), set("sphere/q", 0.9, false)];
    assert!(s.apply(Command::Together { commands: bad }).is_err());
    assert_eq!((paths(&s), s.frame().floaters.clone()), before);
    assert_eq!((value(&s, "sphere/r"), s.history()), (1.0, (1, 0)));
    assert!(s.apply(Command::Together { commands: vec![Command::Undo {}] }).is_err());
    s.apply(Command::Undo {}).unwrap();
    assert_eq!(paths(&s), ["sphere"]);
    s.apply(Command::Redo {}).unwrap();
    assert_eq!(paths(&s), before.0);
}

#[test]
fn a_copy_has_parameters_of_its_own_and_stands_beside() {
    let mut s = scene("sphere(r=1) | translate(box(0.5, 0.5, 0.5), x=1.5)");
    let copy = |path: &str, name: Option<&str>| Command::Duplicate {
        path: path.into(),
        name: name.map(String::from),
    };
    s.apply(copy("translate", Some("twin"))).unwrap();
    assert_eq!(paths(&s)[0], "union");
    let nodes = s.model().unwrap().nodes();
    assert_eq!(nodes[0].operands, 3);
    s.apply(set("twin/x", -1.5, false)).unwrap();
    assert_eq!((value(&s, "translate/x"), value(&s, "twin/x")), (1.5, -1.5));
    s.apply(Command::Rename { path: "twin".into(), name: "left".into() }).unwrap();
    assert!(paths(&s).contains(&"left".to_string()));
    s.apply(Command::Rename { path: "left".into(), name: String::new() }).unwrap();
    assert!(paths(&s).contains(&"translate_2".to_string()), "{:?}", paths(&s));
    let refused = s.apply(Command::Rename { path: "sphere".into(), name: "a/b".into() });
    assert!(refused.is_err());
    // Where the operator above takes one operand only there is a union.
    let mut s = scene("twist(box(1, 1, 1), rate=0.5)");
    s.apply(copy("box", None)).unwrap();
    assert_eq!(paths(&s)[..2], ["twist", "union"]);
    s.apply(copy("", None)).unwrap();
    assert_eq!(paths(&s)[0], "union");
}

#[test]
fn values_and_pins_are_taken_over_to_the_bit() {
    let formula = "translate(ellipsoid(1, 0.8, 0.6), x=0.1)";
    let (mut a, mut b) = (scene(formula), scene(formula));
    for s in [&mut a, &mut b] {
        s.pin([1.1, 0.0, 0.0]).unwrap();
        s.pin([-0.9, 0.0, 0.0]).unwrap();
    }
    a.drag(&[(0, [1.4, 0.1, 0.0])]).unwrap();
    let values: BTreeMap<String, f64> =
        a.field().parameters().iter().map(|p| (p.path.clone(), p.value)).collect();
    let pins = a.pins().iter().map(|p| Hand { pin: PinRef::Number(p.id), to: p.pin.at }).collect();
    b.apply(Command::Assign { values, pins }).unwrap();
    b.step(30).unwrap();
    for (p, q) in a.field().parameters().iter().zip(b.field().parameters()) {
        assert!((p.value - q.value).abs() < 1e-9, "{}: {} and {}", p.path, p.value, q.value);
    }
    b.apply(Command::Undo {}).unwrap();
    assert_eq!(value(&b, "translate/x"), 0.1);
    let wrong = BTreeMap::from([("translate/x".to_string(), f64::NAN)]);
    assert!(b.apply(Command::Assign { values: wrong, pins: vec![] }).is_err());
    assert_eq!(value(&b, "translate/x"), 0.1);
}

#[test]
fn a_drag_under_way_can_be_looked_at() {
    let mut s = scene("sphere(r=1)");
    let hand = s.pin([1.0, 0.0, 0.0]).unwrap();
    assert_eq!(s.dragging().unwrap(), None);
    let hands = vec![Hand { pin: PinRef::Number(hand), to: [1.5, 0.0, 0.0] }];
    s.apply(Command::Grab { hands, radius: None }).unwrap();
    s.step(3).unwrap();
    let report = s.dragging().unwrap().unwrap();
    assert_eq!((report.ending, report.steps, report.rank), (Ending::Held, 3, 1));
    assert!(report.distance > 0.1 && report.distance < 0.5 && s.is_moving(), "{report:?}");
    let Change { drag, .. } = s.apply(Command::Release {}).unwrap();
    assert_eq!(drag.unwrap().ending, Ending::Released);
}

#[test]
fn floaters_gather_where_the_surface_bends() {
    let mut s = scene("ellipsoid(2, 0.5, 0.5)");
    let near_tip = |s: &Scene| {
        let f = s.frame().floaters;
        let tip: Vec<f64> =
            (0..f.len()).filter(|&i| f.points[i][0].abs() > 1.8).map(|i| f.sigma[i]).collect();
        let waist: Vec<f64> =
            (0..f.len()).filter(|&i| f.points[i][0].abs() < 0.5).map(|i| f.sigma[i]).collect();
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        mean(&tip) / mean(&waist)
    };
    s.step(100).unwrap();
    assert!((near_tip(&s) - 1.0).abs() < 0.15, "{}", near_tip(&s));
    let settings = Settings { curvature: 1.0, ..s.settings().clone() };
    s.apply(Command::Settings { settings }).unwrap();
    s.step(300).unwrap();
    assert!(near_tip(&s) < 0.7, "{}", near_tip(&s));
    let wrong = Settings { curvature: 2.0, ..s.settings().clone() };
    assert!(s.apply(Command::Settings { settings: wrong }).is_err());
}

#[test]
fn a_scene_read_with_its_floaters_keeps_them() {
    let mut s = scene("sphere(r=1) | translate(sphere(r=0.5), x=3)");
    s.step(50).unwrap();
    let points = s.frame().floaters.points.clone();
    let none = std::collections::HashMap::new();
    let again = Scene::from_json_with(&s.to_json().unwrap(), Settings::default(), &none, &points).unwrap();
    assert_eq!(again.frame().floaters.points, points);
    // Floaters that are nowhere near the surface do not matter, and missing ones come.
    let half: Vec<[f64; 3]> = points.iter().copied().filter(|p| p[0] < 2.0).chain([[9.0; 3]]).collect();
    let again = Scene::from_json_with(&s.to_json().unwrap(), Settings::default(), &none, &half).unwrap();
    assert!(again.frame().floaters.points.iter().any(|p| p[0] > 2.6));
    let field: &Field = again.field();
    assert_eq!(field.axes(), 3);
    assert!(
        Scene::from_json_with(&s.to_json().unwrap(), Settings::default(), &none, &[[f64::NAN; 3]]).is_err()
    );
}

#[test]
fn a_hidden_part_is_out_of_the_surface_and_comes_back_as_it_was() {
    let hide = |path: &str, hidden: bool| Command::Hide { path: path.into(), hidden };
    let mut s = scene("sphere(r=1) | translate(box(1, 1, 1), x=3)");
    let right = |s: &Scene| s.frame().floaters.points.iter().filter(|p| p[0] > 1.5).count();
    assert!(right(&s) > 50);
    let (before, all) = (s.model().unwrap(), paths(&s));
    s.apply(hide("translate", true)).unwrap();
    assert_eq!((right(&s), paths(&s)), (0, all));
    // Its parameters are there, and can be changed.
    s.apply(set("translate/x", 4.0, false)).unwrap();
    assert_eq!((value(&s, "translate/x"), right(&s)), (4.0, 0));
    let saved = s.to_json().unwrap();
    let again = Scene::from_json(&saved, Settings::default(), &std::collections::HashMap::new()).unwrap();
    assert_eq!(again.model().unwrap(), s.model().unwrap());
    assert!(again.model().unwrap().nodes().iter().any(|n| n.path == "translate" && n.hidden));
    s.apply(Command::Undo {}).unwrap();
    s.apply(Command::Undo {}).unwrap();
    assert!(right(&s) > 50 && s.model().unwrap() == before);
    s.apply(Command::Redo {}).unwrap();
    assert_eq!(right(&s), 0);
    // With the last part the surface would be gone: the command says so, and the scene stays.
    for path in ["sphere", "union"] {
        let refused = s.apply(hide(path, true)).unwrap_err().to_string();
        assert!(refused.contains("every part of the model is hidden"), "{path}: {refused}");
    }
    s.apply(hide("translate", false)).unwrap();
    assert!(right(&s) > 50 && s.model().unwrap() == before);
    s.apply(hide("sphere", true)).unwrap();
    assert!(right(&s) == s.frame().floaters.len());
}

#[test]
fn pins_go_with_the_part_that_they_are_on() {
    let mut s = scene("sphere(r=1) | translate(box(1, 1, 1), x=3)");
    for at in [[0.0, 0.0, 1.0], [3.5, 0.1, 0.2]] {
        s.apply(Command::Pin { at, name: None, weight: 1.0, softness: 0.0, along: None, grip: None })
            .unwrap();
    }
    let pins = |s: &Scene| s.frame().pins.iter().map(|p| p.id).collect::<Vec<_>>();
    let both = pins(&s);
    let values = |s: &Scene| s.field().parameters().iter().map(|p| p.value).collect::<Vec<_>>();
    let before = values(&s);
    let lost = s.apply(Command::Hide { path: "translate".into(), hidden: true }).unwrap().lost;
    assert_eq!((lost, pins(&s)), (vec![both[1]], vec![both[0]]));
    // What is left is not pulled to where the part was.
    s.apply(Command::Step { count: 20 }).unwrap();
    assert!(values(&s).iter().zip(&before).all(|(a, b)| (a - b).abs() < 1e-9));
    s.apply(Command::Undo {}).unwrap();
    assert_eq!(pins(&s), both);
    assert_eq!(s.apply(Command::Remove { path: "sphere".into() }).unwrap().lost, [both[0]]);
    // One that cannot be met was not on the surface before, and stays when something else is changed.
    s.apply(Command::Undo {}).unwrap();
    s.apply(Command::Freeze { pattern: "*".into(), frozen: true }).unwrap();
    s.apply(set("sphere/r", 0.4, false)).unwrap();
    s.apply(Command::Step { count: 5 }).unwrap();
    let (off, spacing) = (s.residuals().unwrap()[0], s.frame().spacing);
    assert!(off > 1.5 * spacing, "{off} {spacing}");
    let renamed = Command::Rename { path: "sphere".into(), name: "ball".into() };
    assert!(s.apply(renamed).unwrap().lost.is_empty());
    assert_eq!(pins(&s), both);
    // A copy that lies on the surface leaves the pins on it.
    assert!(s.apply(Command::Duplicate { path: "translate".into(), name: None }).unwrap().lost.is_empty());
}
