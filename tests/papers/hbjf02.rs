//! HBJF02, figures 1 to 3.

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
    for p in scene.pins() {
        assert!(scene.residuals().unwrap()[&p.id] < 1e-6 * size);
    }
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
    assert!(scene.residuals().unwrap().values().all(|d| *d < 1e-6 * size));
    assert!(value(&scene, "offset/d").is_finite());
}
