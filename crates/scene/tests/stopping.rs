//! Commands that are ended early, and functions wherever they stand.

use std::ops::ControlFlow;
use std::sync::Arc;

use isoswarm_field::model::{Model, Value};
use isoswarm_field::{Aabb, Callback, FieldError, text};
use isoswarm_scene::{Amount, Command, Ending, Hand, PinRef, Scene, Settings};

fn scene(model: &Model) -> Scene {
    Scene::new(model, Settings { amount: Amount::Count(200), ..Settings::default() }).unwrap()
}

#[test]
fn the_log_of_what_was_ended_early_replays_to_the_same_bits() {
    let model = text::parse("translate(sphere(r=1))", &[]).unwrap();
    let mut s = scene(&model);
    let hand = s.pin([1.0, 0.0, 0.0]).unwrap();
    let drag = Command::Drag {
        hands: vec![Hand { pin: PinRef::Number(hand), to: [2.0, 0.5, 0.0] }],
        radius: None,
        steps: 1000,
    };
    let until = |last: usize| {
        move |_: &Scene, p: &isoswarm_scene::Progress| {
            if p.steps < last { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        }
    };
    let change = s.apply_with(drag, &mut until(4)).unwrap();
    assert_eq!(change.drag.unwrap().ending, Ending::Cancelled);
    s.apply_with(Command::Step { count: 100 }, &mut until(7)).unwrap();
    assert!(matches!(s.log()[1].command, Command::Drag { steps: 4, .. }));
    assert_eq!(s.log()[2].command, Command::Step { count: 7 });
    let mut again = scene(&model);
    again.replay(s.log(), &mut |_, _| ControlFlow::Continue(())).unwrap();
    assert_eq!(again.clock(), s.clock());
    assert_eq!(again.field().q(), s.field().q());
    assert_eq!(again.frame().floaters, s.frame().floaters);
}

/// A ball of radius 1 that nobody can look into.
struct Ball;

impl Callback for Ball {
    fn name(&self) -> &str {
        "ball"
    }

    fn value(&self, points: &[[f64; 3]], _: &[f64], value: &mut [f64]) -> Result<(), FieldError> {
        points.iter().zip(value).for_each(|(p, v)| *v = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - 1.0);
        Ok(())
    }

    fn bounds(&self) -> Option<Aabb> {
        Some(Aabb::new([-2.0; 3], [2.0; 3]))
    }
}

#[test]
fn functions_within_formulas_are_known_by_name() {
    let ball: Arc<dyn Callback> = Arc::new(Ball);
    let function = Model::function(ball).unwrap();
    let formula = Model::call("add", vec![Value::Model(function), Value::Number(0.2)], vec![]).unwrap();
    let names: Vec<String> = formula.functions().iter().map(|f| f.name().to_string()).collect();
    assert_eq!(names, ["ball"]);
    let settings =
        Settings { amount: Amount::Count(200), bounds: Some([[-4.0; 3], [4.0; 3]]), ..Settings::default() };
    let mut s = Scene::new(&text::parse("translate(sphere(r=0.5), x=3)", &[]).unwrap(), settings).unwrap();
    let part = isoswarm_field::json::to_json(&formula);
    let add = Command::Add { path: String::new(), model: part, name: None };
    assert!(s.apply(add.clone()).is_err(), "not known yet");
    s.learn_functions(&formula);
    s.apply(add).unwrap();
    assert!(s.frame().floaters.points.iter().any(|p| p[0] < 1.0));
}
