//! Adapters on parts of a scene (HBJF02 section 5): what they show, what they hand over, what they say when they cannot.

use isoswarm_field::text;
use isoswarm_scene::{Amount, Change, Command, Ending, Hand, PinRef, Scene, Settings};

fn scene(formula: &str) -> Scene {
    let bounds = Some([[-3.0; 3], [4.0, 3.0, 3.0]]);
    let settings = Settings { amount: Amount::Count(300), bounds, ..Settings::default() };
    Scene::new(&text::parse(formula, &[]).unwrap(), settings).unwrap()
}

fn adapt(path: &str, adapter: &str) -> Command {
    Command::Adapt {
        path: path.into(),
        adapter: adapter.into(),
        center: None,
        axis: None,
        half: None,
        controls: None,
    }
}

fn value(s: &Scene, path: &str) -> f64 {
    s.field().parameters()[s.field().parameter(path).unwrap()].value
}

fn drag(s: &mut Scene, pin: u64, to: [f64; 3]) -> Change {
    s.apply(Command::Drag { hands: vec![Hand { pin: PinRef::Number(pin), to }], radius: None, steps: 1000 })
        .unwrap()
}

const PAIR: &str = "translate(sphere(1), 0, 0, 0) | translate(sphere(0.5), 3, 0, 0)";

#[test]
fn a_mover_moves_one_part_and_leaves_no_trace() {
    let mut s = scene(PAIR);
    let before = s.model().unwrap();
    s.apply(adapt("translate_2", "mover")).unwrap();
    assert_eq!(s.field().q().len(), 3, "only the adapter's parameters can be moved");
    let hand = s.pin([3.5, 0.0, 0.0]).unwrap();
    let change = drag(&mut s, hand, [3.9, 0.0, 0.0]);
    assert!(change.drag.unwrap().reached);
    let report = change.transfer.unwrap();
    assert!(report.relative < 1e-9 && report.freedom == 4, "{report:?}");
    // The part's own parameters follow at each step, before anything is accepted.
    assert!((s.adapted().unwrap().q()[0] - 3.4).abs() < 1e-6, "{:?}", s.adapted().unwrap().q());
    s.apply(Command::Accept {}).unwrap();
    assert!((value(&s, "translate_2/x") - 3.4).abs() < 1e-6, "{}", value(&s, "translate_2/x"));
    assert!((value(&s, "sphere_2/r") - 0.5).abs() < 1e-9);
    assert_eq!(value(&s, "translate/x").to_bits(), 0.0f64.to_bits(), "the other part has every bit");
    assert_eq!(s.model().unwrap().nodes().len(), before.nodes().len(), "no node is left over");
    assert!(s.adapting().is_none());
    // Undo goes back through the acceptance, the drag and the adapter.
    for _ in 0..4 {
        s.apply(Command::Undo {}).unwrap();
    }
    assert_eq!(s.model().unwrap(), before);
}

#[test]
fn an_adapter_is_cancelled_or_kept() {
    let mut s = scene("sphere(1)");
    let before = s.model().unwrap();
    s.apply(Command::Adapt {
        path: String::new(),
        adapter: "taper".into(),
        center: Some([0.0; 3]),
        axis: Some(2),
        half: None,
        controls: None,
    })
    .unwrap();
    let own = s.field().parameters().iter().find(|p| p.is_free()).unwrap().path.clone();
    let change = s.apply(Command::Set { path: own.clone(), value: 0.4, continued: false }).unwrap();
    let report = change.transfer.unwrap();
    assert!(report.relative > 0.02 && report.relative < 0.5, "a sphere cannot be a pear: {report:?}");
    assert!(s.apply(Command::Remove { path: "sphere".into() }).unwrap_err().to_string().contains("adapter"));
    s.apply(Command::Cancel {}).unwrap();
    assert_eq!(s.model().unwrap(), before);
    s.apply(Command::Undo {}).unwrap();
    assert_eq!(value(&s, &own), 0.4, "the adapter is on again");
    s.apply(Command::Keep {}).unwrap();
    assert_eq!(s.model().unwrap().nodes().len(), 2, "an operator and the sphere");
    assert_eq!(value(&s, &own), 0.4);
    assert!(s.field().parameters().iter().all(|p| p.path != "adapter/sphere/r" || p.is_free()));
    assert!(s.apply(Command::Accept {}).unwrap_err().to_string().contains("no adapter"));
}

#[test]
fn chains_are_flattened_where_the_operand_can_take_them_on() {
    let mut s = scene("translate(scale(translate(sphere(1), 0.2, 0, 0), 1.5), 0, 1, 0)");
    let samples = s.samples(Some(200)).unwrap();
    // From outside to inside: first the scale is given to what it scales, then the outer motion.
    s.apply(Command::Flatten { path: "scale".into() }).unwrap();
    s.apply(Command::Flatten { path: "translate".into() }).unwrap();
    assert_eq!(s.model().unwrap().nodes().len(), 2);
    let q = s.field().q();
    for (v, e) in q.iter().zip([0.3, 1.0, 0.0, 1.5]) {
        assert!((v - e).abs() < 1e-8, "{q:?}");
    }
    let far = |p: &[f64; 3]| ((p[0] - 0.3).powi(2) + (p[1] - 1.0).powi(2) + p[2] * p[2]).sqrt() - 1.5;
    assert!(samples.points.iter().all(|p| far(p).abs() < 1e-8), "the same surface");
    let mut s = scene("twist(box(1, 1, 2), 0.6)");
    let error = s.apply(Command::Flatten { path: "twist".into() }).unwrap_err().to_string();
    assert!(error.contains("stays") && error.contains("of the size"), "{error}");
}

#[test]
fn what_an_adapter_cannot_do_is_said() {
    let mut s = scene(PAIR);
    assert!(s.apply(adapt("translate_2", "squeeze")).unwrap_err().to_string().contains("mover"));
    assert!(s.apply(adapt("nobody", "mover")).unwrap_err().to_string().contains("translate_2"));
    s.apply(Command::Freeze { pattern: "*".into(), frozen: true }).unwrap();
    assert!(s.apply(adapt("translate_2", "mover")).unwrap_err().to_string().contains("release"));
}

#[test]
fn an_adapter_whose_box_cannot_be_found_is_undone_and_done_again() {
    // Intervals see no end of a tapered surface; the box of the surface before serves.
    let settings = Settings { amount: Amount::Count(200), ..Settings::default() };
    let mut s = Scene::new(&text::parse("sphere(1)", &[]).unwrap(), settings).unwrap();
    s.apply(adapt("", "taper")).unwrap();
    let own = s.field().parameters().iter().find(|p| p.is_free()).unwrap().path.clone();
    s.apply(Command::Undo {}).unwrap();
    s.apply(Command::Redo {}).unwrap();
    s.apply(Command::Set { path: own, value: 0.3, continued: false }).unwrap();
    let hand = s.pin([1.0, 0.0, 0.0]).unwrap();
    drag(&mut s, hand, [1.2, 0.0, 0.3]);
    s.apply(Command::Undo {}).unwrap();
    s.apply(Command::Redo {}).unwrap();
    s.apply(Command::Cancel {}).unwrap();
    assert_eq!(s.model().unwrap(), text::parse("sphere(1)", &[]).unwrap());
}

fn reopened(text: &str) -> Result<Scene, isoswarm_scene::Error> {
    Scene::from_json(text, Settings::default(), &Default::default())
}

fn bits(s: &Scene) -> Vec<u64> {
    let part = s.adapted().map(|f| f.q()).unwrap_or_default();
    s.field().parameters().iter().map(|p| p.value).chain(part).map(f64::to_bits).collect()
}

/// A scene with a pin and an adapter that has been dragged a little.
fn under_way() -> (Scene, u64) {
    let mut s = scene(PAIR);
    let hand = s.pin([3.5, 0.0, 0.0]).unwrap();
    s.apply(Command::Rest {}).unwrap();
    s.apply(adapt("translate_2", "mover")).unwrap();
    drag(&mut s, hand, [3.6, 0.1, 0.0]);
    s.apply(Command::Freeze { pattern: "adapter/z".into(), frozen: true }).unwrap();
    (s, hand)
}

#[test]
fn a_scene_with_an_adapter_on_is_saved_and_goes_on_to_the_same_bits() {
    let (mut s, hand) = under_way();
    let text = s.to_json().unwrap();
    assert!(text.contains("\"version\": 2,\n  \"model\""), "older programs are told that they are too old");
    let mut t = reopened(&text).unwrap();
    assert_eq!(t.to_json().unwrap(), text, "every bit");
    assert_eq!(t.adapter(), s.adapter());
    assert_eq!((bits(&t), t.model().unwrap()), (bits(&s), s.model().unwrap()));
    // The frozen parameter stays so, and the others can be moved.
    assert_eq!(t.field().q().len(), 2);
    for s in [&mut s, &mut t] {
        s.apply(Command::Set { path: "adapter/x".into(), value: 0.25, continued: false }).unwrap();
    }
    assert_eq!((bits(&t), t.adapting()), (bits(&s), s.adapting()));
    // Undo leads back to what was read, with the adapter on.
    t.apply(Command::Undo {}).unwrap();
    assert_eq!(t.to_json().unwrap(), text);
    t.apply(Command::Redo {}).unwrap();
    for s in [&mut s, &mut t] {
        s.apply(Command::Accept {}).unwrap();
    }
    assert_eq!((bits(&t), t.model().unwrap()), (bits(&s), s.model().unwrap()));
    assert!(t.to_json().unwrap().contains("\"version\": 1,\n  \"model\""));
    // What was accepted is taken back, and the adapter is on again.
    t.apply(Command::Undo {}).unwrap();
    assert_eq!(t.adapter().unwrap().0, "adapter");
    let mut c = reopened(&text).unwrap();
    assert!(drag(&mut c, hand, [3.8, 0.1, 0.0]).drag.unwrap().reached);
    c.apply(Command::Cancel {}).unwrap();
    assert_eq!(c.model().unwrap(), scene(PAIR).model().unwrap());
    let mut k = reopened(&text).unwrap();
    k.apply(Command::Keep {}).unwrap();
    assert_eq!(k.model().unwrap().nodes().len(), s.model().unwrap().nodes().len() + 1);
}

#[test]
fn an_adapter_that_does_not_fit_its_file_is_refused() {
    let text = under_way().0.to_json().unwrap();
    let refused = |from: &str, to: &str, why: &str| {
        assert!(text.contains(from), "{from}");
        let error = reopened(&text.replacen(from, to, 1)).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains(why), "{from}: {error}");
    };
    refused("\"version\": 2", "\"version\": 1", "version 2");
    refused("\"path\": \"translate_2\"", "\"path\": \"translate\"", "adapting");
    refused("\"path\": \"translate_2\"", "\"path\": \"nobody\"", "nobody");
    refused("\"adapter\": \"adapter\"", "\"adapter\": \"sphere\"", "adapting");
    refused("\"own\": [\"adapter/x\",", "\"own\": [\"sphere/r\",", "own");
    refused("\"on\": ", "\"on\": 1", "field points");
    refused("\"part\": [", "\"part\": [1,", "adapting");
    refused("\"bounds\": [[-3.0", "\"bounds\": [[9.0", "box");
    refused("\"report\": {", "\"report\": {\"mood\": 1, ", "mood");
}

#[test]
fn an_operator_whose_box_cannot_be_found_keeps_that_of_the_scene() {
    let settings = Settings { amount: Amount::Count(150), ..Settings::default() };
    let mut s = Scene::new(&text::parse("sphere(1)", &[]).unwrap(), settings).unwrap();
    s.apply(adapt("", "lattice")).unwrap();
    s.apply(Command::Keep {}).unwrap();
    assert_eq!(s.field().bounds().is_none(), s.settings().bounds.is_some());
    assert!(reopened(&s.to_json().unwrap()).is_ok(), "and can be opened again");
    s.apply(Command::Undo {}).unwrap();
    assert!(s.settings().bounds.is_none());
}

#[test]
fn a_bend_that_would_fold_over_stops_instead_of_failing() {
    let settings = Settings { amount: Amount::Count(300), ..Settings::default() };
    let model = text::parse("translate(capsule(0.3, 3))", &[]).unwrap();
    let mut s = Scene::new(&model, settings).unwrap();
    let before = s.model().unwrap();
    let hand = s.pin([0.0, 0.0, 1.8]).unwrap();
    s.apply(adapt("", "bend")).unwrap();
    let report = drag(&mut s, hand, [0.05, 0.02, 1.83]).drag.unwrap();
    assert!(!report.reached && report.ending == Ending::Stuck, "{report:?}");
    assert!(s.field().q()[0].abs() < 10.0, "{:?}", s.field().q());
    s.apply(Command::Cancel {}).unwrap();
    assert_eq!(s.model().unwrap(), before);
}

#[test]
fn a_twist_about_an_axis_of_symmetry_does_nothing() {
    let settings = Settings { amount: Amount::Count(200), ..Settings::default() };
    let mut s = Scene::new(&text::parse("capsule(0.3, 3)", &[]).unwrap(), settings).unwrap();
    let hand = s.pin([0.3, 0.0, 0.5]).unwrap();
    s.apply(adapt("", "twist")).unwrap();
    let before = s.field().q();
    let report = drag(&mut s, hand, [0.5, 0.2, 0.6]).drag.unwrap();
    assert_eq!((report.ending, report.rank, s.field().q()), (Ending::Stuck, 0, before));
}

#[test]
fn a_bend_about_y_bends_what_is_long_in_z() {
    let settings = Settings { amount: Amount::Count(200), ..Settings::default() };
    let mut s = Scene::new(&text::parse("capsule(0.3, 3)", &[]).unwrap(), settings).unwrap();
    let hand = s.pin([0.0, 0.0, 1.8]).unwrap();
    let mut bend = adapt("", "bend");
    let Command::Adapt { axis, .. } = &mut bend else { unreachable!() };
    *axis = Some(1);
    s.apply(bend).unwrap();
    let report = drag(&mut s, hand, [0.2, 0.0, 1.79]).drag.unwrap();
    assert!(report.distance < 0.05, "{report:?}");
    assert!((s.field().q()[0].abs() - 0.123).abs() < 0.01, "{:?}", s.field().q());
}
