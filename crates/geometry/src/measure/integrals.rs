//! What is integrated at each node, and its sums by both rules.

use isoswarm_field::vector::{V3, dot, norm, sub};

use super::curved::Nodes;
use super::rules::{NODES, REPORTED};

/// Integrals that are always taken; the user's follow.
pub(super) const BUILT_IN: usize = 24;

pub(super) const AREA: usize = 0;
pub(super) const VOLUME: usize = 1;
/// ∫ x dV
pub(super) const SOLID_FIRST: usize = 2;
/// ∫ x xᵀ dV: xx, xy, xz, yy, yz, zz
pub(super) const SOLID_SECOND: usize = 5;
/// ∫ x dA
pub(super) const SHELL_FIRST: usize = 11;
/// ∫ x xᵀ dA
pub(super) const SHELL_SECOND: usize = 14;
pub(super) const MEAN_CURVATURE: usize = 20;
pub(super) const GAUSSIAN_CURVATURE: usize = 21;
pub(super) const WILLMORE: usize = 22;
pub(super) const THIN_PLATE: usize = 23;

/// A sum with the rounding error of its additions carried along (Neumaier).
#[derive(Clone, Copy, Default)]
struct Compensated {
    sum: f64,
    lost: f64,
}

impl Compensated {
    fn add(&mut self, v: f64) {
        let sum = self.sum + v;
        self.lost += if self.sum.abs() >= v.abs() { (self.sum - sum) + v } else { (v - sum) + self.sum };
        self.sum = sum;
    }

    fn value(self) -> f64 {
        self.sum + self.lost
    }
}

/// Integrals over one leaf by both rules.
#[derive(Clone, Default)]
pub(super) struct OfLeaf {
    pub(super) reported: Vec<f64>,
    pub(super) check: Vec<f64>,
    /// Sums of absolute values, for rounding errors.
    size: Vec<f64>,
    /// Whether a node did not get to the surface, or has no curvature.
    pub(super) lost: bool,
}

/// Mean curvature (of outward normals: positive where convex) and Gaussian curvature, from ∇F and the second
/// derivatives (Goldman, "Curvature formulas for implicit curves and surfaces", 2005).
fn curvatures(g: V3, h: [f64; 6]) -> [f64; 2] {
    let square = dot(g, g);
    let length = square.sqrt();
    let [xx, xy, xz, yy, yz, zz] = h;
    let times = |m: [f64; 6]| {
        let [a, b, c, d, e, f] = m;
        g[0] * (a * g[0] + 2.0 * (b * g[1] + c * g[2])) + g[1] * (d * g[1] + 2.0 * e * g[2]) + f * g[2] * g[2]
    };
    let mean = 0.5 * (square * (xx + yy + zz) - times(h)) / (square * length);
    let adjugate = [
        yy * zz - yz * yz,
        xz * yz - xy * zz,
        xy * yz - xz * yy,
        xx * zz - xz * xz,
        xy * xz - xx * yz,
        xx * yy - xy * xy,
    ];
    [mean, times(adjugate) / (square * square)]
}

impl OfLeaf {
    /// Integrals over the leaf in place `k` of `nodes`, coordinates taken from `origin`. `user` holds the values of the
    /// user's integrands, one column of all nodes each.
    pub(super) fn new(nodes: &Nodes, k: usize, origin: V3, user: &[Vec<f64>]) -> Self {
        let m = BUILT_IN + user.len();
        let mut out = Self { reported: vec![0.0; m], check: vec![0.0; m], size: vec![0.0; m], lost: false };
        let mut f = vec![0.0; m];
        for q in 0..NODES {
            let i = k * NODES + q;
            out.lost |= !nodes.reached[i];
            fill(&mut f, nodes, i, origin, &mut out.lost);
            for (j, column) in user.iter().enumerate() {
                f[BUILT_IN + j] = column[i];
            }
            let weight = nodes.measure[i];
            let sums = if q < REPORTED { &mut out.reported } else { &mut out.check };
            for j in 0..m {
                sums[j] += f[j] * weight;
            }
            if q < REPORTED {
                if !nodes.reached[i] {
                    any_flux(&mut f, sub(nodes.points[i], origin));
                }
                for j in 0..m {
                    out.size[j] += (f[j] * weight).abs();
                }
            }
        }
        out
    }

    /// Difference between the rules.
    pub(super) fn off(&self, j: usize) -> f64 {
        (self.check[j] - self.reported[j]).abs()
    }
}

/// What is integrated through the normal, for the worst of all normals: that of the surface is not known at a node that did not get there.
fn any_flux(f: &mut [f64], x: V3) {
    let flux = norm(x);
    f[VOLUME] = flux / 3.0;
    for a in 0..3 {
        f[SOLID_FIRST + a] = x[a] * flux / 4.0;
    }
    for a in 0..6 {
        f[SOLID_SECOND + a] = f[SHELL_SECOND + a] * flux / 5.0;
    }
}

fn fill(f: &mut [f64], nodes: &Nodes, i: usize, origin: V3, lost: &mut bool) {
    let (x, n) = (sub(nodes.points[i], origin), nodes.normals[i]);
    let flux = dot(x, n);
    let second = [x[0] * x[0], x[0] * x[1], x[0] * x[2], x[1] * x[1], x[1] * x[2], x[2] * x[2]];
    f[AREA] = 1.0;
    // div x = 3, div (x xᵢ) = 4 xᵢ, div (x xᵢ xⱼ) = 5 xᵢ xⱼ.
    f[VOLUME] = flux / 3.0;
    for a in 0..3 {
        f[SOLID_FIRST + a] = x[a] * flux / 4.0;
        f[SHELL_FIRST + a] = x[a];
    }
    for a in 0..6 {
        f[SOLID_SECOND + a] = second[a] * flux / 5.0;
        f[SHELL_SECOND + a] = second[a];
    }
    f[MEAN_CURVATURE..BUILT_IN].fill(0.0);
    if nodes.reached[i] && !nodes.hessian.is_empty() {
        let [mean, gauss] = curvatures(nodes.gradient[i], nodes.hessian[i]);
        if mean.is_finite() && gauss.is_finite() && norm(nodes.gradient[i]) > 0.0 {
            f[MEAN_CURVATURE] = mean;
            f[GAUSSIAN_CURVATURE] = gauss;
            f[WILLMORE] = mean * mean;
            f[THIN_PLATE] = 4.0 * mean * mean - 2.0 * gauss;
        } else {
            *lost = true;
        }
    }
}

/// Sums over all leaves.
pub(super) struct Sums {
    reported: Vec<Compensated>,
    check: Vec<Compensated>,
    size: Vec<f64>,
    /// What differences of the rules that cancel may hide.
    apart: Vec<f64>,
    /// What the leaves that are not resolved may be off.
    open: Vec<f64>,
}

impl Sums {
    pub(super) fn new(integrands: usize) -> Self {
        let zeros = vec![Compensated::default(); BUILT_IN + integrands];
        let none = vec![0.0; zeros.len()];
        Self { reported: zeros.clone(), check: zeros, size: none.clone(), apart: none.clone(), open: none }
    }

    /// Adds a leaf; `open` where its rules still differ too much.
    pub(super) fn add(&mut self, leaf: &OfLeaf, open: bool) {
        for j in 0..self.size.len() {
            self.reported[j].add(leaf.reported[j]);
            self.check[j].add(leaf.check[j]);
            self.size[j] += leaf.size[j];
            self.apart[j] += CANCELLED * leaf.off(j);
            if open || leaf.lost {
                self.open[j] += leaf.off(j) + if leaf.lost { BULGED * leaf.size[j] } else { 0.0 };
            }
        }
    }

    /// The integrals that are reported.
    pub(super) fn reported(&self) -> Vec<f64> {
        self.reported.iter().map(|s| s.value()).collect()
    }

    /// The same by the rule of higher degree.
    pub(super) fn check(&self) -> Vec<f64> {
        self.check.iter().map(|s| s.value()).collect()
    }

    /// What each may be off besides the difference of the rules: rounding, leaves that are not resolved, and differences that cancel.
    /// `missing` is the area that the mesh may leave out or cover twice: it may hold as much of each integral as the rest does.
    pub(super) fn slack(&self, missing: f64) -> Vec<f64> {
        let part =
            ROUNDING + if missing > 0.0 { missing / self.size[AREA].max(f64::MIN_POSITIVE) } else { 0.0 };
        let one = |j: usize| part * self.size[j] + self.open[j] + self.apart[j];
        (0..self.size.len()).map(one).collect()
    }
}

/// Part of the absolute differences of the rules that an integral may be off where those of leaves happen to cancel: the rules' own
/// errors need not cancel as well.
const CANCELLED: f64 = 0.05;

/// A leaf with nodes that did not get to the surface counts as flat, and may hide so many times its area: the surface bulges or folds there.
const BULGED: f64 = 2.0;

/// Rounding error of an integral in parts of its absolute values: values and Jacobians carry a few units in the last
/// place, of either sign.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curvatures_of_a_torus() {
        // F = (sqrt(x²+y²) - 2)² + z² - 1/4 at its outer equator, where the curvatures are 2 and 1/2.5.
        let [mean, gauss] = curvatures([1.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.4, 0.0, 2.0]);
        assert!((mean - 1.2).abs() < 1e-15 && (gauss - 0.8).abs() < 1e-15, "{mean} {gauss}");
    }
}
