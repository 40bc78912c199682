//! Deformations that an operand can express, and some that it cannot.

use isoswarm_field::model::adapters::{Adapter, inverse, wrap};
use isoswarm_field::{Field, Model, text};

use super::*;

/// A drag of an adapter: `at(s)` are its parameters at s in (0, 1].
struct Drag {
    operand: Field,
    node: Model,
    field: FieldPoints,
    moved: Vec<V3>,
}

fn model(formula: &str) -> Model {
    text::parse(formula, &[]).unwrap()
}

impl Drag {
    fn new(adapter: &Adapter, operand: &Model, bounds: &Aabb) -> Self {
        let node = wrap(adapter, operand, "hand").unwrap();
        let operand = Field::new(operand).unwrap();
        let count = 4 * operand.freedom();
        let field = FieldPoints::sprinkle(&operand, bounds, count, 0.1 * bounds.diagonal(), 7).unwrap();
        assert_eq!(field.points.len(), count);
        let moved = field.points.clone();
        Self { operand, node, field, moved }
    }

    /// Sets parameters of the adapter by name, and lets the operand follow.
    fn to(&mut self, parameters: &[(&str, f64)]) -> Transfer {
        for (name, value) in parameters {
            self.node = self.node.edit(&format!("hand/{name}"), |p| p.value = *value).unwrap();
        }
        let back = inverse(&self.node).unwrap().map(|m| Field::new(&m).unwrap());
        self.moved = carry([&back[0], &back[1], &back[2]], &self.field.points, &self.moved).unwrap();
        transfer(&mut self.operand, &self.field, &self.moved, TransferOptions::default()).unwrap()
    }
}

fn cube(h: f64) -> Aabb {
    Aabb::new([-h; 3], [h; 3])
}

fn adapter(name: &str) -> Adapter {
    Adapter::around(name, &cube(1.5)).unwrap()
}

#[test]
fn an_ellipsoid_that_is_moved_keeps_its_form() {
    // HBJF02 figure 3: eqs. 10 to 13 (corrected) say what translation does to the ten coefficients.
    let q = [-1.0, 0.1, -0.2, 0.05, 1.0, 0.3, 2.0, -0.2, 0.1, 1.5];
    let list: Vec<String> = q.iter().map(|v| v.to_string()).collect();
    let mut drag = Drag::new(&adapter("mover"), &model(&format!("quadric({})", list.join(", "))), &cube(1.5));
    for step in 1..=300 {
        let s = step as f64 / 300.0;
        let o = [3.0 * s, -2.0 * s * s, 1.5 * (6.0 * s).sin()];
        let t = drag.to(&[("x", o[0]), ("y", o[1]), ("z", o[2])]);
        assert!(t.largest < 1e-12, "{step}: {t:?}");
        assert_eq!((t.rank, t.freedom), (10, 10));
        let now = drag.operand.q();
        for k in 4..10 {
            assert!((now[k] - q[k]).abs() < 1e-10, "{step}: q{k} is {} and was {}", now[k], q[k]);
        }
        let [x, y, z] = o;
        let q0 =
            q[0] + q[4] * x * x + q[5] * x * y + q[6] * y * y + q[7] * x * z + q[8] * y * z + q[9] * z * z
                - (q[1] * x + q[2] * y + q[3] * z);
        let expected = [
            q0,
            q[1] - 2.0 * q[4] * x - q[5] * y - q[7] * z,
            q[2] - q[5] * x - 2.0 * q[6] * y - q[8] * z,
            q[3] - q[7] * x - q[8] * y - 2.0 * q[9] * z,
        ];
        for k in 0..4 {
            assert!(
                (now[k] - expected[k]).abs() < 1e-9,
                "{step}: q{k} is {} and should be {}",
                now[k],
                expected[k]
            );
        }
    }
}

#[test]
fn one_long_step_does_as_well() {
    let mut drag = Drag::new(&adapter("mover"), &model("quadric()"), &cube(1.5));
    let t = drag.to(&[("x", 40.0), ("y", -7.0)]);
    assert!(t.relative < 1e-12, "{t:?}");
    assert!((drag.operand.q()[1] + 80.0).abs() < 1e-8);
}

#[test]
fn a_sphere_grows_with_its_scale() {
    let mut drag = Drag::new(&adapter("scale"), &model("translate(sphere(1), 0.1, 0, 0)"), &cube(1.5));
    for step in 1..=20 {
        let s = 1.0 + 0.05 * step as f64;
        let t = drag.to(&[("sx", s), ("sy", s), ("sz", s)]);
        assert!(t.largest < 1e-12, "{t:?}");
        assert_eq!(t.rank, 4);
    }
    let q = drag.operand.q();
    assert!((q[3] - 2.0).abs() < 1e-12 && (q[0] - 0.2).abs() < 1e-12, "{q:?}");
    // Only along z it is no sphere: the residual says by how much.
    let t = drag.to(&[("sx", 1.0), ("sy", 1.0), ("sz", 1.5)]);
    assert!(t.largest > 0.02 && t.largest < 0.5, "{t:?}");
}

#[test]
fn a_box_and_blobs_turn() {
    let turned = "rotate_about(box(1, 1.4, 0.8))";
    let mut drag = Drag::new(&adapter("rotate"), &model(turned), &cube(1.2));
    let mut t = None;
    for step in 1..=10 {
        let s = 0.1 * step as f64;
        t = Some(drag.to(&[("rx", 0.3 * s), ("ry", -0.2 * s), ("rz", 0.9 * s)]));
    }
    let t = t.unwrap();
    assert!(t.largest < 1e-9, "{t:?}");
    let q = drag.operand.q();
    for (v, e) in q.iter().zip([0.3, -0.2, 0.9, 1.0, 1.4, 0.8]) {
        assert!((v - e).abs() < 1e-8, "{q:?}");
    }
    // Centres turn, radii stay.
    let blobs = "blobs(0.5, 0.4, 0, 0, 0.6, -0.3, 0.2, 0.1, 0.7, 0, -0.4, 0.3, 0.5)";
    let mut drag = Drag::new(&adapter("rotate"), &model(blobs), &cube(1.5));
    for step in 1..=10 {
        let t = drag.to(&[("rz", 0.1 * step as f64)]);
        assert!(t.largest < 1e-11, "{t:?}");
        assert_eq!(t.rank, 13);
    }
    let q = drag.operand.q();
    assert!((q[1] - 0.4 * 1f64.cos()).abs() < 1e-10 && (q[2] - 0.4 * 1f64.sin()).abs() < 1e-10, "{q:?}");
    for (k, e) in [(0, 0.5), (4, 0.6), (8, 0.7), (12, 0.5)] {
        assert!((q[k] - e).abs() < 1e-10, "{q:?}");
    }
}

#[test]
fn what_cannot_be_expressed_is_told_in_lengths() {
    // A sphere that is twisted about its own axis stays; tapered it is no sphere.
    let ball = model("translate(sphere(1))");
    let mut drag = Drag::new(&adapter("twist"), &ball, &cube(1.5));
    let t = drag.to(&[("rate", 0.8)]);
    assert!(t.largest < 1e-8, "{t:?}");
    let mut drag = Drag::new(&adapter("taper"), &ball, &cube(1.5));
    let t = drag.to(&[("rate", 0.3)]);
    // The widest part of the tapered sphere is 1.04 or so; the nearest sphere misses it by hundredths.
    assert!(t.largest > 0.03 && t.largest < 0.3, "{t:?}");
    assert!(t.rms > 0.01 && t.rms < t.largest && t.relative < t.largest, "{t:?}");
    // It is the distance of the deformed points from the sphere that was found.
    let q = drag.operand.q();
    let on = drag.field.on;
    let far = |p: &V3| (norm([p[0] - q[0], p[1] - q[1], p[2] - q[2]]) - q[3]).abs();
    let largest = drag.moved[..on].iter().map(far).fold(0.0f64, f64::max);
    assert!((largest - t.largest).abs() < 1e-12, "{largest} {t:?}");
    // Back to nothing: the sphere is what it was.
    let t = drag.to(&[("rate", 0.0)]);
    assert!(t.largest < 1e-8, "{t:?}");
    assert!(drag.operand.q().iter().zip([0.0, 0.0, 0.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-8));
}

#[test]
fn a_lattice_bends_blobs() {
    let blobs = "blobs(0.5, 0.5, 0, 0, 0.7, -0.5, 0, 0, 0.7)";
    let mut drag = Drag::new(&adapter("lattice"), &model(blobs), &cube(1.5));
    // The whole lattice moved: exact.
    let all: Vec<String> = (0..27).map(|i| format!("dy{i}")).collect();
    let all: Vec<(&str, f64)> = all.iter().map(|n| (n.as_str(), 0.4)).collect();
    let t = drag.to(&all);
    assert!(t.largest < 1e-10, "{t:?}");
    let q = drag.operand.q();
    assert!((q[2] - 0.4).abs() < 1e-9 && (q[6] - 0.4).abs() < 1e-9, "{q:?}");
    // One corner more: followed as well as two balls can.
    let t = drag.to(&[("dx26", 0.5)]);
    assert!(t.largest > 1e-4 && t.largest < 0.2, "{t:?}");
}

#[test]
fn a_target_that_is_not_finite_leaves_the_operand_alone() {
    let mut ball = Field::new(&model("sphere(1)")).unwrap();
    let target = Field::new(&model("ln(x)")).unwrap();
    let e =
        transfer_from(&mut ball, &target, &[[-1.0, 0.0, 0.0]], 1, TransferOptions::default()).unwrap_err();
    assert!(e.to_string().contains("finite"), "{e}");
    assert_eq!(ball.q(), [1.0]);
    // Turned inside out: points have nowhere to go.
    let flat = [0, 1, 2].map(|_| Field::new(&model("0*x")).unwrap());
    assert!(carry([&flat[0], &flat[1], &flat[2]], &[[0.3, 0.0, 0.0]], &[[0.3, 0.0, 0.0]]).is_err());
}

#[test]
fn any_target_will_do() {
    let mut ball = Field::new(&model("translate(sphere(1), 0, 0, 0)")).unwrap();
    let target = Field::new(&model("translate(sphere(1.2), 0.3, -0.1, 0.2)")).unwrap();
    let field = FieldPoints::sprinkle(&target, &cube(2.0), 16, 0.2, 1).unwrap();
    let t = transfer_from(
        &mut ball,
        &target,
        &field.points,
        field.on,
        TransferOptions { steps: 8, ..Default::default() },
    )
    .unwrap();
    assert!(t.largest < 1e-12, "{t:?}");
    assert!(ball.q().iter().zip([0.3, -0.1, 0.2, 1.2]).all(|(a, b)| (a - b).abs() < 1e-12));
}
