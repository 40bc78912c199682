//! HBJF02, figures 1 to 3.

use isoswarm::scene::Command;

use crate::story::{diameter, off_surface, open, play, script, value};

/// Figure 1: a quartic with 35 coefficients, dragged.
#[test]
fn figure_1_a_quartic_with_35_coefficients_follows_a_hand() {
    let (scene, changes) = play("quartic");
    assert_eq!(scene.field().q().len(), 35);
    let drags: Vec<_> = changes.iter().filter_map(|c| c.drag.as_ref()).collect();
    assert!(drags.len() == 2 && drags.iter().all(|d| d.reached), "{drags:?}");
    assert_eq!(drags[1].rank, drags[1].pins, "each pin has a coefficient to itself");
    let size = diameter(&scene);
    assert!(scene.residuals().unwrap().iter().all(|d| *d < 1e-6 * size));
    let at = |name: &str| scene.pins().iter().find(|p| p.name.as_deref() == Some(name)).unwrap().pin.at;
    assert_eq!(at("left"), [-1.0, 0.0, 0.0], "held points have not moved");
    assert!((at("hand")[0] - 1.6).abs() < 1e-6);
    assert!(off_surface(&scene) < 1e-3 * size, "{}", off_surface(&scene));
    // From a sphere-like quartic with five coefficients to one with many.
    let used = scene.field().q().iter().filter(|v| v.abs() > 1e-6).count();
    assert!(used > 15, "{used} of 35 coefficients have moved");
}

/// Figure 2: a dumbbell of R-functions with 34 parameters, some typed in, some locked, the others given to the control points.
#[test]
fn figure_2_a_dumbbell_of_r_functions_is_dragged_part_by_part() {
    let start = open("dumbbell");
    let free = start.field().q().len();
    assert_eq!(free, 34, "continuous parameters; the discrete ones are visible but not in q");
    assert_eq!(start.field().parameters().iter().filter(|p| p.discrete).count(), 4);
    let mut scene = open("dumbbell");
    let bits = |s: &isoswarm::scene::Scene, prefix: &str| -> Vec<u64> {
        let params = s.field().parameters().iter();
        params.filter(|p| p.path.starts_with(prefix)).map(|p| p.value.to_bits()).collect()
    };
    let mut drags = 0;
    for entry in script("dumbbell") {
        let before = (bits(&scene, "quadric_3/"), bits(&scene, "quadric_2/"), bits(&scene, "translate/"));
        let change = scene.apply(entry.command).unwrap();
        let after = (bits(&scene, "quadric_3/"), bits(&scene, "quadric_2/"), bits(&scene, "translate/"));
        if let Some(d) = change.drag {
            assert!(d.reached, "{d:?}");
            drags += 1;
            // The bar was locked in the first drag, the balls in the second.
            let (same, moved) = if drags == 1 {
                ((&before.0, &after.0), (&before.1, &after.1))
            } else {
                ((&before.1, &after.1), (&before.0, &after.0))
            };
            assert_eq!(same.0, same.1, "locked: bit for bit");
            assert_ne!(moved.0, moved.1);
            assert_eq!(before.2, after.2);
        }
    }
    assert_eq!(drags, 2);
    let size = diameter(&scene);
    assert!(scene.residuals().unwrap().iter().all(|d| *d < 1e-6 * size));
    // A parameter is typed in, and the floaters are on the surface that follows.
    scene.apply(Command::Set { path: "offset/d".into(), value: 0.05, continued: false }).unwrap();
    assert_eq!(value(&scene, "offset/d").to_bits(), 0.05f64.to_bits());
    assert!(off_surface(&scene) < 1e-3 * size, "{}", off_surface(&scene));
}

/// Figure 3: an ellipsoid given by the ten coefficients of a quadric is moved by a Mover with one control point; the six of second
/// degree stay what they are, and the adapter leaves nothing behind.
#[test]
fn figure_3_a_mover_moves_an_ellipsoid_without_deforming_it() {
    let mut scene = open("ellipsoid");
    let q = scene.field().q();
    let mut moved = 0.0f64;
    for entry in script("ellipsoid") {
        let change = scene.apply(entry.command).unwrap();
        if let Some(d) = change.drag {
            assert!(d.reached && d.steps > 10, "{d:?}");
            let own = scene.field().q();
            moved = own.iter().map(|v| v * v).sum::<f64>().sqrt();
            assert_eq!(own.len(), 3, "one offset is all that is dragged");
            // The coefficients have followed at each step of the drag.
            let now = scene.adapted().unwrap().q();
            assert!((4..10).all(|k| (now[k] - q[k]).abs() < 1e-10), "{now:?}");
            assert!(change.transfer.unwrap().relative < 1e-10);
        }
    }
    let now = scene.field().q();
    assert_eq!(now.len(), 10, "the adapter is gone");
    assert!(moved > 0.5);
    for k in 4..10 {
        assert!((now[k] - q[k]).abs() < 1e-10, "q{k} was {} and is {}", q[k], now[k]);
    }
    // Eqs. 10 to 13 (corrected): an offset o changes the linear terms by -2 q4 ox, ... and the constant.
    let o = [-now[1] / (2.0 * q[4]), -now[2] / (2.0 * q[6]), -now[3] / (2.0 * q[9])];
    let constant = q[0] + q[4] * o[0] * o[0] + q[6] * o[1] * o[1] + q[9] * o[2] * o[2];
    assert!((now[0] - constant).abs() < 1e-9, "{} {constant}", now[0]);
    let offset = (o[0] * o[0] + o[1] * o[1] + o[2] * o[2]).sqrt();
    assert!((offset - moved).abs() < 1e-8);
    let hand = scene.pins()[0].pin.at;
    let f =
        q[4] * (hand[0] - o[0]).powi(2) + q[6] * (hand[1] - o[1]).powi(2) + q[9] * (hand[2] - o[2]).powi(2)
            - 1.0;
    assert!(f.abs() < 1e-8, "the hand is on it: {f}");
}
