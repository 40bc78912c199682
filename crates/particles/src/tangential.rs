//! The velocity of particles that keep their normals while the surface moves.

use isoswarm_field::{Field, FieldError, Surface};

use crate::vector::{V3, along, cross, dot, frame, norm, scale, sub};

/// Motion along a direction in which the surface bends less than this part of its larger curvature is left out: where the
/// surface is flat, normals do not tell points apart.
const FLAT: f64 = 1e-9;

/// How F changes in time at a point, with the surface moving: all at fixed x.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Change {
    /// ∂F/∂t = ∂F/∂q · q̇ (units of F per time).
    pub value: f64,
    /// ∂∇F/∂t = ∂²F/∂x∂q · q̇ (units of F per length and time).
    pub gradient: [f64; 3],
}

/// The velocity of a particle on a moving surface F(x, t) = 0 that keeps its unit normal, or turns it with the angular
/// velocity `spin`: the one that identity and motion blur follow (J. Stam and R. Schmidt, "On the velocity of an implicit
/// surface", ACM Transactions on Graphics 30, 2011). Translations and uniform scalings are reproduced exactly, rotations with
/// their spin; the normal part, -∂F/∂t ∇F / |∇F|², is that of any particle that stays on the surface (WH94 eq. 5).
///
/// `gradient` is ∇F, `hessian` the second derivatives xx, xy, xz, yy, yz, zz. In directions in which the surface is flat the
/// particle has no tangential velocity; where the gradient vanishes it rests.
pub fn normal_keeping_velocity(
    gradient: [f64; 3],
    hessian: [f64; 6],
    change: Change,
    spin: [f64; 3],
) -> [f64; 3] {
    let length = norm(gradient);
    if !(length > 0.0 && length.is_finite() && change.value.is_finite()) {
        return [0.0; 3];
    }
    let n = scale(gradient, 1.0 / length);
    let [xx, xy, xz, yy, yz, zz] = hessian;
    let times = |v: V3| [dot([xx, xy, xz], v), dot([xy, yy, yz], v), dot([xz, yz, zz], v)];
    let across = scale(n, -change.value / length);
    // The tangential part of d∇F/dt = H v + ∂∇F/∂t is |∇F| dn/dt, which is to be |∇F| spin × n.
    let wanted = sub(scale(cross(spin, n), length), sub(times(across), scale(change.gradient, -1.0)));
    let (a, b) = frame(n);
    let (ha, hb) = (times(a), times(b));
    let along_surface = solve([dot(a, ha), dot(a, hb), dot(b, hb)], [dot(a, wanted), dot(b, wanted)]);
    let v = along(along(across, along_surface[0], a), along_surface[1], b);
    if v.iter().all(|c| c.is_finite()) { v } else { across }
}

/// Differences by which the rate of F is differentiated in space, in parts of the length within which the gradient turns.
const STEP: f64 = 1e-5;

/// [`normal_keeping_velocity`] at points of a surface F = 0 whose free parameters change at `rates` (q̇, one a free parameter). The rate
/// of ∇F is taken from that of F by central differences in space, to about nine digits.
///
/// # Errors
/// [`FieldError`] for another field than one equation in space, another number of rates, and what an opaque part raises.
///
/// ```
/// use isoswarm_field::{Field, text};
/// use isoswarm_particles::surface_velocity;
/// let ball = Field::new(&text::parse("(x - a)^2 + y^2 + z^2 - 1", &[("a", 0.0)])?)?;
/// // All of it moves along x, the poles too.
/// let v = surface_velocity(&ball, &[[0.0, 0.0, 1.0]], &[2.0], [0.0; 3])?;
/// assert!((v[0][0] - 2.0).abs() < 1e-8 && v[0][2].abs() < 1e-8);
/// # Ok::<(), isoswarm_field::FieldError>(())
/// ```
pub fn surface_velocity(
    field: &Field,
    points: &[[f64; 3]],
    rates: &[f64],
    spin: [f64; 3],
) -> Result<Vec<[f64; 3]>, FieldError> {
    if field.axes() != 3 || field.components() != 1 {
        let given = format!("{} equations of {} coordinates", field.components(), field.axes());
        return Err(FieldError::Shape {
            what: "field",
            expected: "one equation of x, y and z".into(),
            given,
        });
    }
    let n = points.len();
    let rate = |points: &[[f64; 3]]| {
        let (mut f, mut g, mut rate) = (vec![0.0; n], vec![[0.0; 3]; n], vec![0.0; n]);
        field.gradient_and_rate(points.as_flattened(), rates, &mut f, g.as_flattened_mut(), &mut rate)?;
        Ok::<_, FieldError>((g, rate))
    };
    let (gradient, value) = rate(points)?;
    let mut hessian = vec![[0.0; 6]; n];
    Surface::hessian(field, points, &mut hessian)?;
    // Where nothing bends, such as on a plane, parts of the point's distance from the origin.
    let steps: Vec<f64> = (0..n)
        .map(|i| {
            let bend = hessian[i].iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let (within, far) = (norm(gradient[i]) / bend, norm(points[i]));
            STEP * if within.is_finite() && within > 0.0 {
                within
            } else if far > 0.0 {
                far
            } else {
                1.0
            }
        })
        .collect();
    let mut change: Vec<Change> =
        value.into_iter().map(|value| Change { value, ..Change::default() }).collect();
    for a in 0..3 {
        let moved = |sign: f64| -> Vec<V3> {
            let one = |(p, h): (&V3, &f64)| [0, 1, 2].map(|k| if k == a { p[k] + sign * h } else { p[k] });
            points.iter().zip(&steps).map(one).collect()
        };
        let (places, others) = (moved(1.0), moved(-1.0));
        let (ahead, behind) = (rate(&places)?.1, rate(&others)?.1);
        for (i, c) in change.iter_mut().enumerate() {
            // By the distance that rounding has left of it.
            c.gradient[a] = (ahead[i] - behind[i]) / (places[i][a] - others[i][a]);
        }
    }
    let one = |i: usize| normal_keeping_velocity(gradient[i], hessian[i], change[i], spin);
    Ok((0..n).map(one).collect())
}

/// Solves [a b; b c] x = r, without the parts along directions of small eigenvalues.
fn solve([a, b, c]: [f64; 3], r: [f64; 2]) -> [f64; 2] {
    let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
    let root = (half * half + b * b).sqrt();
    let values = [mean + root, mean - root];
    let most = values[0].abs().max(values[1].abs());
    // The eigenvector of the first value; the other one is across it.
    let first = if half >= 0.0 { [half + root, b] } else { [b, root - half] };
    let size = (first[0] * first[0] + first[1] * first[1]).sqrt();
    let e = if size > 0.0 { [first[0] / size, first[1] / size] } else { [1.0, 0.0] };
    let f = [-e[1], e[0]];
    let mut out = [0.0; 2];
    for (value, e) in values.into_iter().zip([e, f]) {
        if value.abs() > FLAT * most {
            let k = (e[0] * r[0] + e[1] * r[1]) / value;
            out = [out[0] + k * e[0], out[1] + k * e[1]];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::{add, distance};

    /// F = xᵀ A x - 1 for A = Rᵀ D R moved by `centre`: F, ∇F and the Hessian at x.
    fn quadric(a: [[f64; 3]; 3], centre: V3, x: V3) -> (f64, V3, [f64; 6]) {
        let r = sub(x, centre);
        let g = [0, 1, 2].map(|i| 2.0 * dot(a[i], r));
        let h = [a[0][0], a[0][1], a[0][2], a[1][1], a[1][2], a[2][2]].map(|v| 2.0 * v);
        (0.5 * dot(g, r) - 1.0, g, h)
    }

    const A: [[f64; 3]; 3] = [[1.0, 0.2, -0.1], [0.2, 3.0, 0.3], [-0.1, 0.3, 0.6]];

    /// Points on the quadric around the origin.
    fn points() -> impl Iterator<Item = V3> {
        (0..40).map(|k| {
            let t = f64::from(k);
            let d = [(1.3 * t).sin(), (2.1 * t).cos(), (0.7 * t + 1.0).sin()];
            let f = quadric(A, [0.0; 3], d).0 + 1.0;
            scale(d, 1.0 / f.sqrt())
        })
    }

    /// ∂F/∂t and ∂∇F/∂t by central differences of a motion F(x, t).
    fn change(motion: impl Fn(f64, V3) -> (f64, V3, [f64; 6]), x: V3) -> Change {
        let h = 1e-5;
        let ((f, g, _), (e, d, _)) = (motion(h, x), motion(-h, x));
        Change { value: (f - e) / (2.0 * h), gradient: [0, 1, 2].map(|a| (g[a] - d[a]) / (2.0 * h)) }
    }

    fn check(motion: impl Fn(f64, V3) -> (f64, V3, [f64; 6]), velocity: impl Fn(V3) -> V3, spin: V3) {
        for x in points() {
            let (_, g, h) = motion(0.0, x);
            let v = normal_keeping_velocity(g, h, change(&motion, x), spin);
            let (found, wanted) = (v, velocity(x));
            assert!(
                distance(found, wanted) < 1e-8 * (1.0 + norm(wanted)),
                "{x:?}: {found:?}, not {wanted:?}"
            );
        }
    }

    /// A ball of radius r around (a, b, 0), far from the origin.
    fn ball() -> Field {
        let formula = "(x - a)^2 + (y - b)^2 + z^2 - r^2";
        Field::new(&isoswarm_field::text::parse(formula, &[("a", 1.5), ("b", 0.0), ("r", 0.7)]).unwrap())
            .unwrap()
    }

    /// The ball's velocities for rates of a, b and r against `wanted`.
    fn check_ball(rates: [(&str, f64); 3], spin: V3, wanted: impl Fn(V3) -> V3) {
        let field = ball();
        let rate = |i: &usize| {
            let path = &field.parameters()[*i].path;
            rates.iter().find(|r| r.0 == path).unwrap().1
        };
        let q: Vec<f64> = field.free().iter().map(rate).collect();
        let places: Vec<V3> = points().map(|d| add([1.5, 0.0, 0.0], scale(d, 0.7 / norm(d)))).collect();
        for (x, v) in places.iter().zip(surface_velocity(&field, &places, &q, spin).unwrap()) {
            assert!(distance(v, wanted(*x)) < 1e-8, "{x:?}: {v:?}, not {:?}", wanted(*x));
        }
    }

    #[test]
    fn a_ball_that_moves_grows_and_turns() {
        check_ball([("a", 0.3), ("b", -1.1), ("r", 0.0)], [0.0; 3], |_| [0.3, -1.1, 0.0]);
        let out = |x: V3| scale(sub(x, [1.5, 0.0, 0.0]), 0.4 / 0.7);
        check_ball([("a", 0.0), ("b", 0.0), ("r", 0.4)], [0.0; 3], out);
        // About the z axis of the origin: the middle runs along y, and the normals turn.
        let spin = [0.0, 0.0, 0.9];
        check_ball([("a", 0.0), ("b", 0.9 * 1.5), ("r", 0.0)], spin, |x| cross(spin, x));
    }

    #[test]
    fn a_small_ball_far_from_the_origin_moves_as_it_does_near() {
        let formula = "1 - exp(1 - ((x - a)^2 + y^2 + z^2)/s^2)";
        for (far, size) in [(0.0, 1.0), (1000.0, 1.0), (-3.0, 1e-3)] {
            let model = isoswarm_field::text::parse(formula, &[("a", far), ("s", size)]).unwrap();
            let field = Field::new(&model).unwrap();
            let q: Vec<f64> = field
                .free()
                .iter()
                .map(|&i| if field.parameters()[i].path == "a" { size } else { 0.0 })
                .collect();
            let places: Vec<V3> = points().map(|d| add([far, 0.0, 0.0], scale(d, size / norm(d)))).collect();
            for v in surface_velocity(&field, &places, &q, [0.0; 3]).unwrap() {
                assert!(distance(v, [size, 0.0, 0.0]) < 1e-6 * size, "{far} {size}: {v:?}");
            }
        }
    }

    #[test]
    fn other_fields_and_rates_are_refused() {
        let flat = Field::new(&isoswarm_field::text::parse("stack(x, y)", &[]).unwrap()).unwrap();
        assert!(surface_velocity(&flat, &[[0.0; 3]], &[], [0.0; 3]).is_err());
        assert!(surface_velocity(&ball(), &[[0.0; 3]], &[1.0], [0.0; 3]).is_err());
    }

    #[test]
    fn translation_is_exact() {
        let v = [0.4, -1.1, 0.7];
        check(|t, x| quadric(A, scale(v, t), x), |_| v, [0.0; 3]);
    }

    #[test]
    fn uniform_scaling_is_exact() {
        // F(x / s(t)), s' = .8 at s = 1: every point moves along its radius.
        let motion = |t: f64, x: V3| {
            let s = 1.0 + 0.8 * t;
            let (f, g, h) = quadric(A, [0.0; 3], scale(x, 1.0 / s));
            (f, scale(g, 1.0 / s), h.map(|v| v / (s * s)))
        };
        check(motion, |x| scale(x, 0.8), [0.0; 3]);
    }

    #[test]
    fn rotation_is_exact_with_its_spin() {
        let spin = [0.0, 0.0, 1.7];
        let motion = |t: f64, x: V3| {
            let (s, c) = (1.7 * t).sin_cos();
            let back = |p: V3| [c * p[0] + s * p[1], -s * p[0] + c * p[1], p[2]];
            let forth = |p: V3| [c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]];
            let (f, g, h) = quadric(A, [0.0; 3], back(x));
            (f, forth(g), h)
        };
        check(motion, |x| cross(spin, x), spin);
        // Without the spin the particle keeps its normal and still stays on the surface.
        for x in points() {
            let (_, g, h) = motion(0.0, x);
            let c = change(motion, x);
            let v = normal_keeping_velocity(g, h, c, [0.0; 3]);
            assert!((dot(g, v) + c.value).abs() < 1e-12);
            let turned = add(
                [dot([h[0], h[1], h[2]], v), dot([h[1], h[3], h[4]], v), dot([h[2], h[4], h[5]], v)],
                c.gradient,
            );
            assert!(norm(cross(turned, g)) < 1e-9 * dot(g, g));
        }
    }

    #[test]
    fn flat_directions_have_no_motion() {
        // A plane that moves along its normal, and a cylinder x² + y² = 1 that moves along its axis and across.
        let v = normal_keeping_velocity(
            [0.0, 0.0, 2.0],
            [0.0; 6],
            Change { value: -3.0, gradient: [0.0; 3] },
            [0.0; 3],
        );
        assert!(distance(v, [0.0, 0.0, 1.5]) < 1e-15);
        let change = Change { value: -2.0, gradient: [-2.0, 0.0, 0.0] };
        let v = normal_keeping_velocity([2.0, 0.0, 0.0], [2.0, 0.0, 0.0, 2.0, 0.0, 0.0], change, [0.0; 3]);
        assert!(distance(v, [1.0, 0.0, 0.0]) < 1e-15, "{v:?}");
        assert_eq!(normal_keeping_velocity([0.0; 3], [1.0; 6], change, [0.0; 3]), [0.0; 3]);
    }
}
