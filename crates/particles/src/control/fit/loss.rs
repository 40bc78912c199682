//! How much a distance costs.

use isoswarm_field::math::ln;

/// The cost of a distance t: squares, or less than squares beyond a distance c (a length, above 0), so that points that do not
/// belong to the surface pull less.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Loss {
    /// t²
    #[default]
    Squares,
    /// t² up to c, then 2 c t − c²: pulls as at c, no more.
    Huber(f64),
    /// 2 c² (√(1 + t²/c²) − 1): the same without a corner.
    SoftL1(f64),
    /// c² ln(1 + t²/c²): points far off hardly pull at all.
    Cauchy(f64),
}

/// ρ and its first two derivatives by z = (t/c)².
pub(crate) struct Rho {
    pub(crate) value: f64,
    pub(crate) first: f64,
    pub(crate) second: f64,
}

impl Loss {
    /// c
    pub(crate) fn scale(self) -> Option<f64> {
        match self {
            Loss::Squares => None,
            Loss::Huber(c) | Loss::SoftL1(c) | Loss::Cauchy(c) => Some(c),
        }
    }

    pub(crate) fn rho(self, z: f64) -> Rho {
        let rho = |value, first, second| Rho { value, first, second };
        match self {
            Loss::Squares => rho(z, 1.0, 0.0),
            Loss::Huber(_) if z <= 1.0 => rho(z, 1.0, 0.0),
            Loss::Huber(_) => {
                let root = z.sqrt();
                rho(2.0 * root - 1.0, 1.0 / root, -0.5 / (z * root))
            }
            Loss::SoftL1(_) => {
                let t = 1.0 + z;
                let root = t.sqrt();
                rho(2.0 * z / (root + 1.0), 1.0 / root, -0.5 / (t * root))
            }
            Loss::Cauchy(_) => {
                let t = 1.0 + z;
                // ln(1 + z) without the loss of digits of small z.
                let value = if z < 1e-6 { z - 0.5 * z * z } else { ln(t) };
                rho(value, 1.0 / t, -1.0 / (t * t))
            }
        }
    }

    /// The cost of t (squares: t²).
    pub(crate) fn cost(self, t: f64) -> f64 {
        let c = self.scale().unwrap_or(1.0);
        c * c * self.rho((t / c) * (t / c)).value
    }

    /// Factors of a row of the Jacobian and of its right-hand side that make least squares of this loss (Triggs et al. 2000;
    /// the curvature is kept positive).
    pub(crate) fn factors(self, t: f64) -> (f64, f64) {
        let c = self.scale().unwrap_or(1.0);
        let z = (t / c) * (t / c);
        let rho = self.rho(z);
        let row = (rho.first + 2.0 * z * rho.second).max(0.1 * rho.first).sqrt();
        (row, rho.first / row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_value() {
        for loss in [Loss::Squares, Loss::Huber(1.0), Loss::SoftL1(1.0), Loss::Cauchy(1.0)] {
            for z in [0.0f64, 1e-3, 0.4, 1.7, 30.0, 1e4] {
                let h = 1e-4 * (1.0 + z);
                let at = |z: f64| loss.rho(z.abs());
                let first = (at(z + h).value - at(z - h).value) / (2.0 * h);
                let second = (at(z + h).first - at(z - h).first) / (2.0 * h);
                if z > 0.0 {
                    assert!((at(z).first - first).abs() < 1e-6, "{loss:?} {z}");
                    assert!((at(z).second - second).abs() < 1e-6, "{loss:?} {z}");
                }
            }
            // The product of both factors is the pull.
            for t in [-3.0, -0.2, 0.7, 12.0] {
                let (row, right) = loss.factors(t);
                let pull = (loss.cost(t + 1e-5) - loss.cost(t - 1e-5)) / 4e-5;
                assert!((row * right * t - pull).abs() < 1e-6, "{loss:?} {t}");
            }
        }
    }

    #[test]
    fn distances_are_measured_against_the_scale() {
        assert_eq!(Loss::Huber(0.5).cost(0.25), 0.0625);
        assert_eq!(Loss::Huber(0.5).cost(2.0), 2.0 * 0.5 * 2.0 - 0.25);
        assert!(Loss::Cauchy(0.1).cost(1e3) < 0.01 * 19.0);
    }
}
