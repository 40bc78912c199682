//! Scripts, files and models that want too much, vanish or fail in the middle; what a change of the tree does to what hangs on it.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use isoswarm_field::model::{Model, Param, Payload, kind};
use isoswarm_field::{Aabb, Callback, FieldError, text};
use isoswarm_scene::{Along, Amount, Command, Error, Focus, Hand, PinRef, Scene, Settings, script_from_json};

fn settings(n: usize) -> Settings {
    Settings { amount: Amount::Count(n), ..Settings::default() }
}

fn scene(formula: &str, n: usize) -> Scene {
    Scene::new(&text::parse(formula, &[]).unwrap(), settings(n)).unwrap()
}

fn value(s: &Scene, path: &str) -> f64 {
    s.field().parameters()[s.field().parameter(path).unwrap()].value
}

fn pin(at: [f64; 3]) -> Command {
    Command::Pin { at, name: None, weight: 1.0, softness: 0.0, along: None, grip: None }
}

fn hand(pin: u64, to: [f64; 3]) -> Hand {
    Hand { pin: PinRef::Number(pin), to }
}

fn refused(s: &mut Scene, command: Command, reason: &str) {
    let values = |s: &Scene| s.field().parameters().to_vec();
    let before = (values(s), s.frame().floaters.clone(), s.log().to_vec());
    let error = s.apply(command.clone()).unwrap_err().to_string();
    assert!(error.contains(reason), "{command:?}: {error}");
    assert_eq!((values(s), s.frame().floaters.clone(), s.log().to_vec()), before);
}

fn adapt(path: &str) -> Command {
    Command::Adapt {
        path: path.into(),
        adapter: "mover".into(),
        center: None,
        axis: None,
        half: None,
        controls: None,
    }
}

#[test]
fn numbers_at_the_edge_of_their_range_are_refused_in_files() {
    let mut s = scene("sphere(r=1)", 40);
    s.apply(Command::Pin {
        at: [1.0, 0.0, 0.0],
        name: Some("a".into()),
        weight: 1.0,
        softness: 0.0,
        along: None,
        grip: None,
    })
    .unwrap();
    let good = s.to_json().unwrap();
    let pin = good.lines().find(|l| l.contains("\"id\":0")).unwrap();
    let twice = format!("{pin},{}", pin.replace("\"id\":0", "\"id\":1"));
    let most = u64::MAX.to_string();
    for (old, new, reason) in [
        ("\"id\":0", format!("\"id\":{most}"), "at most"),
        ("\"next_pin\": 1", format!("\"next_pin\": {most}"), "at most"),
        ("\"clock\": 0", format!("\"clock\": {most}"), "at most"),
        ("[1.0,0.0,0.0]", "[1e308,0.0,0.0]".into(), "pin 0"),
        ("\"spacing\": 0.", "\"spacing\": -0.".into(), "spacing"),
        ("\"weight\":1.0", "\"weight\":-1.0".into(), "pin 0: weight"),
        (pin, twice, "two pins are called `a`"),
    ] {
        let text = good.replacen(old, &new, 1);
        assert_ne!(text, good, "{old}");
        let error = Scene::from_json(&text, settings(40), &Default::default()).unwrap_err().to_string();
        assert!(error.contains(reason), "{new}: {error}");
    }
}

#[test]
fn endless_commands_are_refused_and_waiting_can_be_ended() {
    let mut s = scene("sphere(r=1)", 40);
    s.apply(pin([1.0, 0.0, 0.0])).unwrap();
    refused(&mut s, Command::Step { count: 1 << 60 }, "up to");
    let hands = vec![hand(0, [1.2, 0.0, 0.0])];
    refused(&mut s, Command::Drag { hands, radius: None, steps: usize::MAX }, "up to");
    let script = |at: &str| {
        let text = format!(
            "{{\"format\": \"isoswarm script\", \"version\": 1, \"commands\": [{{\"do\": \"step\", \"at_step\": {at}}}]}}"
        );
        script_from_json(&text).unwrap()
    };
    let on = &mut |_: &Scene, _| ControlFlow::Continue(());
    assert!(s.replay(&script("1000000000000000000"), on).unwrap_err().to_string().contains("up to"));
    let mut calls = 0;
    let changes = s.replay(&script("1000000"), &mut |_, _| {
        calls += 1;
        if calls < 5 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    assert_eq!((changes.unwrap().len(), s.clock()), (0, 5));
}

#[test]
fn steps_one_by_one_are_one_entry_of_the_log() {
    let mut s = scene("sphere(r=1)", 40);
    for _ in 0..30 {
        s.step(1).unwrap();
    }
    assert_eq!(s.log().len(), 1);
    assert_eq!(s.log()[0].command, Command::Step { count: 30 });
}

#[test]
fn hands_and_places_must_make_sense() {
    let mut s = scene("translate(sphere(r=1))", 40);
    s.apply(pin([1.0, 0.0, 0.0])).unwrap();
    let drag = |hands| Command::Drag { hands, radius: None, steps: 10 };
    refused(&mut s, drag(vec![hand(0, [1e200, 0.0, 0.0])]), "1e100");
    refused(&mut s, drag(vec![hand(0, [1.1, 0.0, 0.0]), hand(0, [1.2, 0.0, 0.0])]), "each pin once");
    let mut curve = scene("planar(translate(sphere(r=1)))", 40);
    refused(&mut curve, pin([1.0, 0.0, 0.5]), "plane curve");
    let along = Some(Along::Line([0.0, 0.0, 1.0]));
    let on_line =
        Command::Pin { at: [1.0, 0.0, 0.0], name: None, weight: 1.0, softness: 0.0, along, grip: None };
    refused(&mut curve, on_line, "plane curve");
    let gripped = Command::Pin {
        at: [1.0, 0.0, 0.0],
        name: None,
        weight: 1.0,
        softness: 0.0,
        along: None,
        grip: Some(0.3),
    };
    curve.apply(gripped).unwrap();
    refused(&mut curve, drag(vec![hand(0, [1.2, 0.0, 0.1])]), "plane curve");
    curve.apply(Command::Freeze { pattern: "sphere/r".into(), frozen: true }).unwrap();
    // Along the tangent: the grip keeps the curve from slipping under the pin.
    let report = curve.drag(&[(0, [1.0, 0.3, 0.0])]).unwrap();
    assert!(report.reached && value(&curve, "translate/y") > 0.25, "{report:?}");
    assert_eq!(curve.pins()[0].pin.at[2], 0.0);
    assert!(curve.frame().floaters.points.iter().all(|p| p[2] == 0.0));
}

#[test]
fn limits_do_not_undo_what_a_radius_asks_for() {
    let mut s = scene("sphere(r=1)", 40);
    s.apply(Command::Limit { pattern: "*".into(), bounds: [None, Some(2.0)] }).unwrap();
    let (lo, hi) = s.field().parameters()[0].bounds;
    assert!(lo > 0.0 && hi == 2.0, "{lo} {hi}");
    s.apply(Command::Limit { pattern: "*".into(), bounds: [Some(-5.0), None] }).unwrap();
    let (lo, hi) = s.field().parameters()[0].bounds;
    assert!(lo > 0.0 && hi == f64::INFINITY, "{lo} {hi}");
}

#[test]
fn a_surface_that_vanishes_in_a_step_is_told_and_comes_back() {
    let lens = "translate(sphere(r=1), x=-0.5) & translate(sphere(r=1), x=0.5)";
    let mut s = scene(lens, 60);
    // A rest shape without a surface: the spheres apart.
    let rest: Vec<String> = s
        .field()
        .parameters()
        .iter()
        .map(|p| if p.path.ends_with("/x") { 4.0 * p.value } else { p.value })
        .map(|v| v.to_string())
        .collect();
    let text =
        s.to_json().unwrap().replace("\"clock\"", &format!("\"rest\": [{}],\n  \"clock\"", rest.join(", ")));
    s = Scene::from_json(&text, settings(60), &Default::default()).unwrap();
    s.apply(Command::Settings { settings: Settings { recovery: 0.1, ..s.settings().clone() } }).unwrap();
    refused(&mut s, Command::Step { count: 60 }, "leaves no surface");
    assert_eq!(value(&s, "translate/x"), -0.5);
    s.step(2).unwrap();
}

#[test]
fn a_part_that_appears_during_a_drag_gets_floaters() {
    // With r above 1.2 there is a second ball, to which no floater leads.
    let formula = "sphere(r=r) | (x - 5)^2 + y^2 + z^2 - (r^2 - 1.44)";
    let settings = Settings { bounds: Some([[-3.0; 3], [8.0, 3.0, 3.0]]), ..settings(300) };
    let mut s = Scene::new(&text::parse(formula, &[("r", 1.0)]).unwrap(), settings).unwrap();
    let id = s.pin([1.0, 0.0, 0.0]).unwrap();
    assert!(s.frame().floaters.points.iter().all(|p| p[0] < 2.0));
    assert!(s.drag(&[(id, [1.6, 0.0, 0.0])]).unwrap().reached);
    let floaters = s.frame().floaters;
    let found = floaters.points.iter().filter(|p| p[0] > 3.0).count() as f64;
    let spacing = s.frame().spacing;
    let expected = 4.0 * std::f64::consts::PI * (1.6f64.powi(2) - 1.44) * 1.155 / (spacing * spacing);
    assert!((0.6 * expected..1.5 * expected).contains(&found), "{found} of about {expected}");
}

#[test]
fn the_spacing_comes_back_with_undo_and_from_files() {
    let mut s = scene("sphere(r=1)", 100);
    let spacing = s.frame().spacing;
    s.apply(Command::Settings { settings: settings(400) }).unwrap();
    assert!(s.frame().spacing < 0.7 * spacing);
    s.apply(Command::Undo {}).unwrap();
    assert_eq!(s.frame().spacing, spacing);
    let many = s.frame().floaters.len();
    s.step(60).unwrap();
    assert!(s.frame().floaters.len() < 140, "{many} become {}", s.frame().floaters.len());
    // Four times the area, four times the floaters, also when it is opened again.
    s.apply(Command::Set { path: "sphere/r".into(), value: 2.0, continued: false }).unwrap();
    let back = Scene::from_json(&s.to_json().unwrap(), settings(9), &Default::default()).unwrap();
    assert_eq!(back.frame().spacing, spacing);
    assert!(back.frame().floaters.len() > 300, "{}", back.frame().floaters.len());
}

#[test]
fn undo_of_what_does_not_touch_the_surface_leaves_the_floaters_alone() {
    let mut s = scene("sphere(r=1)", 100);
    s.step(5).unwrap();
    let floaters = s.frame().floaters.clone();
    s.apply(pin([1.0, 0.0, 0.0])).unwrap();
    s.apply(Command::Freeze { pattern: "*".into(), frozen: true }).unwrap();
    s.apply(Command::Undo {}).unwrap();
    s.apply(Command::Undo {}).unwrap();
    assert_eq!(s.frame().floaters, &floaters);
    assert!(s.pins().is_empty() && !s.field().parameters()[0].frozen);
    // A small change moves them, and keeps them.
    s.apply(Command::Set { path: "sphere/r".into(), value: 1.01, continued: false }).unwrap();
    assert_eq!(s.frame().floaters.id, floaters.id);
    let far = |p: &[f64; 3]| ((p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt() - 1.01).abs() > 1e-6;
    assert!(!s.frame().floaters.points.iter().any(far));
}

#[test]
fn the_rest_shape_goes_with_the_tree() {
    let mut s = scene("translate(sphere(r=1), x=-2) | translate(box(1,1,1), x=2)", 100);
    s.apply(Command::Rest {}).unwrap();
    s.apply(Command::Set { path: "sphere/r".into(), value: 1.4, continued: false }).unwrap();
    s.apply(Command::Reorder { path: "union".into(), order: vec![1, 0] }).unwrap();
    s.apply(Command::Add {
        path: "union".into(),
        model: "translate(sphere(r=0.5), y=4)".into(),
        name: Some("moon".into()),
    })
    .unwrap();
    s.apply(Command::Settings { settings: Settings { recovery: 0.3, ..s.settings().clone() } }).unwrap();
    s.step(100).unwrap();
    let values: Vec<f64> = s.field().parameters().iter().map(|p| p.value).collect();
    let expected = [2.0, 0.0, 0.0, 1.0, 1.0, 1.0, -2.0, 0.0, 0.0, 1.0, 0.0, 4.0, 0.0, 0.5];
    assert!(values.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{values:?}");
}

#[test]
fn a_second_adapter_is_not_taken_for_the_first() {
    let mut s = scene("translate(sphere(r=1), x=-2) | translate(sphere(r=0.5), x=2)", 100);
    s.apply(adapt("")).unwrap();
    s.apply(Command::Keep {}).unwrap();
    s.apply(adapt("adapter/translate_2")).unwrap();
    refused(
        &mut s,
        Command::Set { path: "adapter/sphere/r".into(), value: 2.0, continued: false },
        "while an adapter is on",
    );
    s.apply(Command::Freeze { pattern: "*".into(), frozen: false }).unwrap();
    assert_eq!(s.field().free().len(), 3, "the adapter's own");
    s.apply(pin([2.5, 0.0, 0.0])).unwrap();
    s.drag(&[(0, [2.8, 0.0, 0.0])]).unwrap();
    let report = s.apply(Command::Accept {}).unwrap().transfer.unwrap();
    assert!(report.relative < 1e-9, "{report:?}");
    assert!((value(&s, "adapter/translate_2/x") - 2.3).abs() < 1e-6);
    assert_eq!(value(&s, "adapter/x"), 0.0);
    assert_eq!(s.field().free().len(), 11);
}

#[test]
fn a_focus_does_not_let_the_floaters_grow_without_end() {
    let mut s = scene("sphere(r=1)", 40);
    s.apply(pin([1.0, 0.0, 0.0])).unwrap();
    let focus = |radius, factor| {
        let settings = Settings { focus: Some(Focus { radius, factor }), ..settings(40) };
        Command::Settings { settings }
    };
    refused(&mut s, focus(1.0, 1e-9), "focus factor");
    refused(&mut s, focus(f64::NAN, 0.5), "focus radius");
    s.apply(focus(1e308, 0.5)).unwrap();
    s.step(40).unwrap();
    assert!(s.frame().floaters.len() < 400, "{}", s.frame().floaters.len());
}

/// A ball that fails, or is not a number on one side, when it is told to.
struct Moody {
    fails: Arc<AtomicBool>,
    undefined: Arc<AtomicBool>,
}

impl Callback for Moody {
    fn name(&self) -> &str {
        "moody"
    }

    fn value(&self, points: &[[f64; 3]], _: &[f64], value: &mut [f64]) -> Result<(), FieldError> {
        if self.fails.load(Ordering::Relaxed) {
            return Err(FieldError::Invalid("not today".into()));
        }
        let undefined = self.undefined.load(Ordering::Relaxed);
        for (p, v) in points.iter().zip(value) {
            let ball = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - 1.0;
            *v = if undefined && p[0] > 0.5 { f64::NAN } else { ball };
        }
        Ok(())
    }

    fn bounds(&self) -> Option<Aabb> {
        Some(Aabb::new([-2.0; 3], [2.0; 3]))
    }
}

#[test]
fn functions_that_raise_or_are_undefined_in_mid_step() {
    let (fails, undefined) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let moody = Moody { fails: fails.clone(), undefined: undefined.clone() };
    let k = kind("translate").unwrap();
    let params = k.params.iter().map(Param::from_spec).collect();
    let model =
        Model::new(k, params, vec![Model::function(Arc::new(moody)).unwrap()], Payload::None).unwrap();
    let mut s = Scene::new(&model, settings(60)).unwrap();
    let id = s.pin([-1.0, 0.0, 0.0]).unwrap();
    let before = (s.to_json().unwrap(), s.frame().floaters.clone());
    let mut steps = 0;
    let drag = Command::Drag { hands: vec![hand(id, [-1.5, 0.0, 0.0])], radius: None, steps: 50 };
    let error = s.apply_with(drag, &mut |_, _| {
        steps += 1;
        fails.store(steps == 4, Ordering::Relaxed);
        ControlFlow::Continue(())
    });
    assert!(matches!(&error, Err(e) if e.to_string().contains("not today")), "{error:?}");
    fails.store(false, Ordering::Relaxed);
    assert_eq!((s.to_json().unwrap(), s.frame().floaters.clone()), before);
    // Where there is no F any more there are no floaters.
    undefined.store(true, Ordering::Relaxed);
    s.step(3).unwrap();
    assert!(s.frame().floaters.points.iter().all(|p| p[0] <= 0.5));
    assert!(s.frame().floaters.len() > 20);
    undefined.store(false, Ordering::Relaxed);
    assert!(s.drag(&[(id, [-1.2, 0.0, 0.0])]).unwrap().reached);
    assert!(s.frame().floaters.points.iter().any(|p| p[0] > 0.5), "and they come back");
}

#[test]
fn nothing_depends_on_the_size_of_the_model() {
    let ways: Vec<(f64, f64)> = [1e-6, 1.0, 1e6]
        .map(|k| {
            let formula = format!("translate(sphere(r={k:e}), x={:e})", 0.1 * k);
            let mut s = scene(&formula, 100);
            let id = s.pin([1.1 * k, 0.0, 0.0]).unwrap();
            let report = s.drag(&[(id, [1.5 * k, 0.3 * k, 0.0])]).unwrap();
            assert!(report.reached, "{k}: {report:?}");
            (value(&s, "sphere/r") / k, value(&s, "translate/x") / k)
        })
        .to_vec();
    for w in &ways {
        assert!((w.0 - ways[1].0).abs() < 0.01 && (w.1 - ways[1].1).abs() < 0.01, "{ways:?}");
    }
}

#[test]
fn a_drag_of_what_is_locked_ends_soon_and_moves_nothing() {
    let mut s = scene("sphere(r=1)", 40);
    let id = s.pin([1.0, 0.0, 0.0]).unwrap();
    s.apply(Command::Freeze { pattern: "*".into(), frozen: true }).unwrap();
    let report = s.drag(&[(id, [2.0, 0.0, 0.0])]).unwrap();
    assert!(!report.reached && report.steps < 20 && report.rank == 0, "{report:?}");
    assert_eq!(value(&s, "sphere/r"), 1.0);
    assert!(matches!(s.apply(Command::Release {}), Err(Error::Nothing(_))));
}
