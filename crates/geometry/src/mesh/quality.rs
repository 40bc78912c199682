//! How good triangles are.

use isoswarm_field::vector::{V3, cross, dot, norm, sub};

use rayon::prelude::*;

use super::Mesh;

/// Triangles that one task measures.
const CHUNK: usize = 2048;
/// Sine and cosine of an angle smaller than any, times the same length.
const ACUTE: [f64; 2] = [1.0, f64::MAX];

/// Quality of one triangle. A triangle without area has 0 for both measures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaceQuality {
    /// Frey and Borouchaki's Q = 6/√3 · S / (p h) = 2√3 r / h, with area S, half the perimeter p, longest edge h and radius of the inscribed
    /// circle r: 1 for equilateral triangles.
    pub q: f64,
    /// Twice the radius of the inscribed circle over that of the circumscribed one, 1 for equilateral triangles.
    pub radius_ratio: f64,
    /// Smallest angle, radians.
    pub smallest_angle: f64,
    /// Largest angle, radians.
    pub largest_angle: f64,
}

impl FaceQuality {
    /// Of the triangle with the given corners.
    pub fn of(corners: [V3; 3]) -> Self {
        let (quality, [sine, cosine]) = Self::but_largest_angle(corners);
        Self { largest_angle: libm::atan2(sine, cosine), ..quality }
    }

    /// The same but for the largest angle, whose sine and cosine are given, times the same length.
    fn but_largest_angle([a, b, c]: [V3; 3]) -> (Self, [f64; 2]) {
        let sides = [sub(c, b), sub(a, c), sub(b, a)];
        // Measured in the largest coordinate difference: squares of very small or large ones leave the range of numbers.
        let unit = sides.as_flattened().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let sides = sides.map(|s| s.map(|v| v / unit));
        let length = sides.map(norm);
        let twice = norm(cross(sides[0], sides[1]));
        let longest = length.iter().fold(0.0, |m: f64, &l| m.max(l));
        if !(twice > 0.0 && longest.is_finite()) {
            return (Self::default(), [0.0, -1.0]);
        }
        let half = 0.5 * (length[0] + length[1] + length[2]);
        let inscribed = 0.5 * twice / half;
        let circumscribed = 0.5 * length[0] * length[1] * length[2] / twice;
        // The larger the angle, the smaller the dot product of its sides, all three over the same length of the cross product.
        let cosine = [0, 1, 2].map(|k: usize| -dot(sides[(k + 1) % 3], sides[(k + 2) % 3]));
        let [least, most] =
            cosine.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, m], &c| [l.min(c), m.max(c)]);
        let quality = Self {
            q: 2.0 * 3f64.sqrt() * inscribed / longest,
            radius_ratio: 2.0 * inscribed / circumscribed,
            smallest_angle: libm::atan2(twice, most),
            largest_angle: 0.0,
        };
        (quality, [twice, least])
    }
}

/// Quality of all triangles of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Mean of Q.
    pub q_avg: f64,
    /// Smallest Q.
    pub q_min: f64,
    /// Mean of the ratio of the radii.
    pub radius_ratio_avg: f64,
    /// Smallest ratio of the radii.
    pub radius_ratio_min: f64,
    /// Smallest angle of all, degrees.
    pub smallest_angle: f64,
    /// Mean of the triangles' smallest angles, degrees.
    pub smallest_angle_avg: f64,
    /// Largest angle of all, degrees.
    pub largest_angle: f64,
    /// Part of the triangles with an angle below 30 degrees.
    pub below_30: f64,
    /// Part of the vertices with six triangles.
    pub six_valent: f64,
    /// Least and most triangles at a vertex, among vertices that have some.
    pub valence: [u32; 2],
}

impl Quality {
    /// Measures the faces over the points.
    pub fn of(points: &[V3], faces: &[[u32; 3]]) -> Self {
        if faces.is_empty() {
            return Self::default();
        }
        let none = Self {
            q_min: f64::INFINITY,
            radius_ratio_min: f64::INFINITY,
            smallest_angle: f64::INFINITY,
            ..Self::default()
        };
        let mut valence = vec![0u32; points.len()];
        faces.iter().flatten().for_each(|&v| valence[v as usize] += 1);
        // Sums in fixed parts: the number of threads does not matter.
        let larger = |a: [f64; 2], b: [f64; 2]| if b[1] * a[0] < a[1] * b[0] { b } else { a };
        let parts: Vec<(Self, [f64; 2])> = faces
            .par_chunks(CHUNK)
            .map(|faces| {
                let all = faces.iter().map(|f| FaceQuality::but_largest_angle(f.map(|v| points[v as usize])));
                all.fold((none, ACUTE), |(s, largest), (t, angle)| {
                    let with = s.with(Self {
                        q_avg: t.q,
                        q_min: t.q,
                        radius_ratio_avg: t.radius_ratio,
                        radius_ratio_min: t.radius_ratio,
                        smallest_angle: t.smallest_angle,
                        smallest_angle_avg: t.smallest_angle,
                        below_30: f64::from(u8::from(t.smallest_angle < 30f64.to_radians())),
                        ..none
                    });
                    (with, larger(largest, angle))
                })
            })
            .collect();
        let (mut out, [sine, cosine]) = parts
            .into_iter()
            .fold((none, ACUTE), |(s, largest), (t, angle)| (s.with(t), larger(largest, angle)));
        out.largest_angle = libm::atan2(sine, cosine);
        let n = faces.len() as f64;
        out.q_avg /= n;
        out.radius_ratio_avg /= n;
        out.smallest_angle_avg = (out.smallest_angle_avg / n).to_degrees();
        out.smallest_angle = out.smallest_angle.to_degrees();
        out.largest_angle = out.largest_angle.to_degrees();
        out.below_30 /= n;
        let used: Vec<u32> = valence.into_iter().filter(|v| *v > 0).collect();
        out.six_valent = used.iter().filter(|v| **v == 6).count() as f64 / used.len() as f64;
        out.valence = [used.iter().copied().min().unwrap_or(0), used.iter().copied().max().unwrap_or(0)];
        out
    }
}

impl Quality {
    /// Sums, and the smaller and larger of two.
    fn with(self, other: Self) -> Self {
        Self {
            q_avg: self.q_avg + other.q_avg,
            q_min: self.q_min.min(other.q_min),
            radius_ratio_avg: self.radius_ratio_avg + other.radius_ratio_avg,
            radius_ratio_min: self.radius_ratio_min.min(other.radius_ratio_min),
            smallest_angle: self.smallest_angle.min(other.smallest_angle),
            smallest_angle_avg: self.smallest_angle_avg + other.smallest_angle_avg,
            below_30: self.below_30 + other.below_30,
            ..self
        }
    }
}

impl Mesh {
    /// Quality of each triangle, (f,).
    pub fn face_quality(&self) -> Vec<FaceQuality> {
        (0..self.faces.len()).map(|f| FaceQuality::of(self.corners(f))).collect()
    }

    /// Quality of all triangles.
    pub fn quality(&self) -> Quality {
        Quality::of(&self.points, &self.faces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_triangles() {
        let h = 0.75f64.sqrt();
        for scale in [1e-120, 1.0, 1e120] {
            let at = |p: V3| p.map(|c| c * scale);
            let t = FaceQuality::of([at([0.0; 3]), at([1.0, 0.0, 0.0]), at([0.5, h, 0.0])]);
            assert!((t.q - 1.0).abs() < 1e-14 && (t.radius_ratio - 1.0).abs() < 1e-14, "{t:?}");
            assert!((t.smallest_angle.to_degrees() - 60.0).abs() < 1e-12);
            // 3, 4, 5: inscribed radius 1, circumscribed 2.5.
            let t = FaceQuality::of([at([0.0; 3]), at([3.0, 0.0, 0.0]), at([0.0, 4.0, 0.0])]);
            assert!((t.radius_ratio - 0.8).abs() < 1e-14, "{t:?}");
            assert!((t.q - 2.0 * 3f64.sqrt() / 5.0).abs() < 1e-14);
            assert!((t.largest_angle.to_degrees() - 90.0).abs() < 1e-12);
            assert!((t.smallest_angle - libm::atan2(3.0, 4.0)).abs() < 1e-12);
        }
        let flat = FaceQuality::of([[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]);
        assert_eq!((flat.q, flat.radius_ratio, flat.smallest_angle), (0.0, 0.0, 0.0));
        assert_eq!(Quality::of(&[], &[]), Quality::default());
        // The largest of all is that of the bluntest triangle, and 180 degrees where one is flat.
        let points = [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0], [5.0, 0.3, 0.0], [6.0, 0.0, 0.0]];
        let angle = |faces: &[[u32; 3]]| Quality::of(&points, faces).largest_angle;
        let bluntest = FaceQuality::of([points[0], points[3], points[4]]).largest_angle.to_degrees();
        assert!(bluntest > 150.0 && bluntest == angle(&[[0, 1, 2], [0, 3, 4], [1, 2, 4]]));
        assert_eq!(angle(&[[0, 1, 2], [0, 1, 4], [0, 3, 4]]), 180.0);
    }
}
