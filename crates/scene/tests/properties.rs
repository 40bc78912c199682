//! What holds for any sequence of commands: nothing panics, what fails changes nothing, undo gives every bit back, a log replays to
//! the same bits, a file holds all of it.

use std::ops::ControlFlow;

use isoswarm_field::text;
use isoswarm_scene::{Along, Amount, Command, Focus, Hand, PinRef, Scene, ScenePin, Settings};
use proptest::option;
use proptest::prelude::*;

const MODELS: [&str; 4] = [
    "smooth_union(translate(sphere(r=1), x=-0.8), translate(sphere(r=0.7), x=0.9), k=0.3)",
    "translate(ellipsoid(1, 0.8, 0.6)) & translate(sphere(r=1), x=0.2)",
    "rotate(box(1, 0.7, 0.5), 0.3, az=1) | translate(capsule(), z=1.5)",
    "planar(translate(sphere(r=1)))",
];

fn scene(model: usize) -> Scene {
    let settings = Settings { amount: Amount::Count(30), ..Settings::default() };
    Scene::new(&text::parse(MODELS[model], &[]).unwrap(), settings).unwrap()
}

/// Everything that a command may change, to the bit.
fn all(s: &Scene) -> impl PartialEq + std::fmt::Debug + use<> {
    let floaters = s.frame().floaters.clone();
    (document(s), floaters, s.clock(), s.log().len(), s.history(), s.is_held())
}

/// What undo restores.
fn document(s: &Scene) -> (String, Vec<(u64, bool)>, Vec<ScenePin>, String) {
    let values = s.field().parameters().iter().map(|p| (p.value.to_bits(), p.frozen)).collect();
    // With an adapter on there is no file.
    let file = s.to_json().unwrap_or_else(|_| format!("{:?} {:?}", s.model(), s.adapted().map(|f| f.q())));
    let file = file.lines().filter(|l| !l.contains("\"clock\"")).collect::<Vec<_>>().join("\n");
    (file, values, s.pins().to_vec(), format!("{:?}", s.settings()))
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -1.5..1.5f64,
        1 => prop::sample::select(vec![0.0, -0.0, 1e-300, 1e9, -1e40, 1e308, f64::NAN, f64::INFINITY]),
    ]
}

fn place() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![
        3 => [number(), number(), number()],
        2 => (-1.5..1.5f64, -1.5..1.5f64).prop_map(|(x, y)| [x, y, 0.0]),
    ]
}

fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![5 => 0.05..2.0f64, 1 => number()]
}

fn path() -> impl Strategy<Value = String> {
    let some = [
        "",
        "*",
        "*/x",
        "sphere/r",
        "sphere",
        "translate",
        "planar",
        "union",
        "box",
        "nothing",
        "ellipsoid/*",
    ];
    prop::sample::select(some.to_vec()).prop_map(String::from)
}

fn part() -> impl Strategy<Value = String> {
    let some = [
        "sphere(r=0.5)",
        "translate(box(0.5, 0.5, 0.5), y=1)",
        "x^2 + y^2 + 1",
        "sphere(",
        "planar(sphere(r=0.4))",
    ];
    prop::sample::select(some.to_vec()).prop_map(String::from)
}

fn hands() -> impl Strategy<Value = Vec<Hand>> {
    let hand = (0..4u64, place()).prop_map(|(pin, to)| Hand { pin: PinRef::Number(pin), to });
    prop::collection::vec(hand, 0..3)
}

fn command() -> impl Strategy<Value = Command> {
    let along = prop_oneof![place().prop_map(Along::Line), place().prop_map(Along::Plane)];
    let pin = (
        place(),
        positive(),
        prop_oneof![3 => Just(0.0), 1 => number()],
        option::of(along),
        option::of(positive()),
    );
    let settings = (
        prop_oneof![Just(Amount::Count(20)), Just(Amount::Spacing(0.5))],
        0.0..1.2f64,
        option::of((0.1..1.0f64, 0.4..1.1f64)),
    );
    let limits = [option::of(number()), option::of(number())];
    let adapters = ["mover", "scale", "taper", "bend", "lattice", "rotate", "none"];
    prop_oneof![
        1 => (path(), number()).prop_map(|(path, value)| Command::Set { path, value, continued: value > 0.5 }),
        1 => (path(), any::<bool>()).prop_map(|(pattern, frozen)| Command::Freeze { pattern, frozen }),
        1 => (path(), limits).prop_map(|(pattern, bounds)| Command::Limit { pattern, bounds }),
        1 => (path(), positive()).prop_map(|(pattern, scale)| Command::Scale { pattern, scale }),
        6 => pin.prop_map(|(at, weight, softness, along, grip)| Command::Pin { at, name: None, weight, softness, along, grip }),
        1 => (0..4u64).prop_map(|n| Command::Unpin { pin: PinRef::Number(n) }),
        3 => (hands(), option::of(positive())).prop_map(|(hands, radius)| Command::Grab { hands, radius }),
        1 => Just(Command::Release {}),
        4 => (hands(), option::of(positive()), 0..12usize).prop_map(|(hands, radius, steps)| Command::Drag { hands, radius, steps }),
        1 => (place(), place()).prop_map(|(rotation, translation)| Command::Turn {
            pins: vec![PinRef::Number(0)], centre: [0.0; 3], rotation, translation, steps: 5,
        }),
        3 => (0..4usize).prop_map(|count| Command::Step { count }),
        1 => prop::collection::vec(place(), 0..6).prop_map(|points| Command::Fit {
            points, weights: vec![], loss: Default::default(), iterations: 3,
        }),
        1 => Just(Command::Rest {}),
        1 => settings.prop_map(|(amount, recovery, focus)| Command::Settings { settings: Settings {
            amount, recovery, focus: focus.map(|(radius, factor)| Focus { radius, factor }), ..Settings::default()
        } }),
        1 => (path(), part()).prop_map(|(path, model)| Command::Add { path, model, name: None }),
        1 => (path(), part()).prop_map(|(path, model)| Command::Replace { path, model }),
        1 => path().prop_map(|path| Command::Remove { path }),
        1 => path().prop_map(|path| Command::Wrap { path, kind: "translate".into(), parameters: Default::default(), name: None }),
        1 => path().prop_map(|path| Command::Unwrap { path }),
        1 => path().prop_map(|path| Command::Reorder { path, order: vec![1, 0] }),
        1 => (path(), prop::sample::select(adapters.to_vec())).prop_map(|(path, a)| Command::Adapt {
            path, adapter: a.into(), center: None, axis: None, half: None, controls: None,
        }),
        1 => Just(Command::Accept {}),
        1 => Just(Command::Keep {}),
        1 => Just(Command::Cancel {}),
        1 => path().prop_map(|path| Command::Flatten { path }),
        2 => Just(Command::Undo {}),
        1 => Just(Command::Redo {}),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, max_shrink_iters: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_sequence_of_commands_is_safe(model in 0..MODELS.len(), commands in prop::collection::vec(command(), 1..14)) {
        let mut s = scene(model);
        for c in commands {
            let before = all(&s);
            let (states, shape) = (s.history().0, document(&s));
            let held = s.is_held();
            let turned = matches!(c, Command::Undo {} | Command::Redo {});
            if s.apply(c.clone()).is_err() {
                prop_assert!(all(&s) == before, "{c:?} failed and left its mark");
                continue;
            }
            if !turned && !held && !s.is_held() && s.history().0 == states + 1 {
                let (clock, after) = (s.clock(), document(&s));
                s.apply(Command::Undo {}).unwrap();
                prop_assert_eq!(&document(&s), &shape, "undo of {:?}", c);
                s.apply(Command::Redo {}).unwrap();
                prop_assert_eq!(&document(&s), &after, "redo of {:?}", c);
                prop_assert_eq!(s.clock(), clock);
            }
        }
        let mut again = scene(model);
        let log = isoswarm_scene::script_from_json(&isoswarm_scene::script_to_json(s.log())).unwrap();
        prop_assert_eq!(&log[..], s.log());
        again.replay(&log, &mut |_, _| ControlFlow::Continue(())).unwrap();
        prop_assert!(again.frame().floaters == s.frame().floaters && document(&again) == document(&s), "{log:?}");
        if let Ok(file) = s.to_json() {
            let back = Scene::from_json(&file, Settings::default(), &Default::default()).unwrap();
            prop_assert_eq!(back.to_json().unwrap(), file);
        }
    }
}
