//! Gauss rules on triangles: fully symmetric, with positive weights and all nodes inside.
//!
//! D. A. Dunavant, "High degree efficient symmetrical Gaussian quadrature rules for the triangle", Int. J. Numer.
//! Methods Eng. 21 (1985), his rules of degree 6 and 8; the digits are polished to double precision.

/// A node: weight (they add up to 1) and barycentric coordinates.
pub(super) type Node = (f64, [f64; 3]);

/// Nodes of the rule whose value is reported.
pub(super) const REPORTED: usize = 12;
/// Nodes of the rule that it is compared with.
pub(super) const CHECK: usize = 16;
/// Nodes of both.
pub(super) const NODES: usize = REPORTED + CHECK;

/// The three nodes (a, b, b), (b, a, b), (b, b, a).
fn three(out: &mut Vec<Node>, w: f64, b: f64) {
    let a = 1.0 - 2.0 * b;
    out.extend([[a, b, b], [b, a, b], [b, b, a]].map(|p| (w, p)));
}

/// The six permutations of (a, b, c).
fn six(out: &mut Vec<Node>, w: f64, a: f64, b: f64) {
    let c = 1.0 - a - b;
    out.extend([[a, b, c], [b, c, a], [c, a, b], [a, c, b], [c, b, a], [b, a, c]].map(|p| (w, p)));
}

/// Exact for polynomials up to degree 6.
pub(super) fn degree_6() -> Vec<Node> {
    let mut out = Vec::with_capacity(REPORTED);
    three(&mut out, 0.116_786_275_726_379_37, 0.249_286_745_170_910_43);
    three(&mut out, 0.050_844_906_370_206_82, 0.063_089_014_491_502_23);
    six(&mut out, 0.082_851_075_618_373_57, 0.053_145_049_844_816_945, 0.310_352_451_033_784_4);
    out
}

/// Exact for polynomials up to degree 8.
pub(super) fn degree_8() -> Vec<Node> {
    let mut out = Vec::with_capacity(CHECK);
    out.push((0.144_315_607_677_787_17, [1.0 / 3.0; 3]));
    three(&mut out, 0.095_091_634_267_284_62, 0.459_292_588_292_723_2);
    three(&mut out, 0.103_217_370_534_718_24, 0.170_569_307_751_760_2);
    three(&mut out, 0.032_458_497_623_198_08, 0.050_547_228_317_030_98);
    six(&mut out, 0.027_230_314_174_434_993, 0.008_394_777_409_957_605, 0.263_112_829_634_638_1);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_exact_up_to_their_degrees_and_no_further() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        for (rule, degree) in [(degree_6(), 6), (degree_8(), 8)] {
            assert!(rule.iter().all(|(w, b)| *w > 0.0 && b.iter().all(|v| *v > 0.0)));
            let mut worst = [0.0f64; 2];
            for i in 0..=degree + 1 {
                for j in 0..=degree + 1 - i {
                    let exact = 2.0 * factorial(i) * factorial(j) / factorial(i + j + 2);
                    let found: f64 = rule.iter().map(|(w, b)| w * b[0].powi(i) * b[1].powi(j)).sum();
                    let beyond = usize::from(i + j > degree);
                    worst[beyond] = worst[beyond].max((found / exact - 1.0).abs());
                }
            }
            assert!(worst[0] < 3e-14 && worst[1] > 1e-6, "degree {degree}: {worst:?}");
        }
    }
}
