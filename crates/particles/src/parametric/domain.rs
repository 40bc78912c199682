//! The rectangle that a surface x(u, v) is made from, and how its edges hang together.

/// What becomes of the two edges at the ends of a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// They are boundaries of the surface, or poles where the surface closes in a point.
    #[default]
    Open,
    /// They are the same curve: x(lo, ·) = x(hi, ·).
    Periodic,
    /// They are the same curve, run through backwards: x(lo, v) = x(hi, v₀ + v₁ - v), as on a Möbius strip.
    Twisted,
}

/// The ranges of both parameters and how they close.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain {
    /// Smallest u and v.
    pub lo: [f64; 2],
    /// Largest u and v.
    pub hi: [f64; 2],
    /// How the edges at the ends of u, and of v, hang together.
    pub wrap: [Wrap; 2],
}

/// Which ends of which parameters are poles: `[axis][0 at lo, 1 at hi]`.
pub(super) type Poles = [[bool; 2]; 2];

impl Domain {
    /// Length of the range of a parameter.
    pub fn length(&self, a: usize) -> f64 {
        self.hi[a] - self.lo[a]
    }

    /// Whether the surface may have one side only.
    pub fn is_twisted(&self) -> bool {
        self.wrap.contains(&Wrap::Twisted)
    }

    /// The place in the rectangle that stands for (u, v): wrapped around, carried across a pole, or taken back to the edge.
    pub(super) fn inside(&self, mut p: [f64; 2], poles: &Poles) -> [f64; 2] {
        for a in [0, 1, 0] {
            let (b, length) = (1 - a, self.length(a));
            match self.wrap[a] {
                Wrap::Open => {
                    let end = usize::from(p[a] > self.hi[a]);
                    let edge = if end == 1 { self.hi[a] } else { self.lo[a] };
                    if p[a] >= self.lo[a] && p[a] <= self.hi[a] {
                        continue;
                    }
                    if poles[a][end] && self.wrap[b] == Wrap::Periodic {
                        // Straight on beyond a pole is half a turn further.
                        p[a] = 2.0 * edge - p[a];
                        p[b] += 0.5 * self.length(b);
                    }
                    p[a] = p[a].clamp(self.lo[a], self.hi[a]);
                }
                wrap => {
                    let turns = ((p[a] - self.lo[a]) / length).floor();
                    p[a] = (p[a] - turns * length).clamp(self.lo[a], self.hi[a]);
                    if wrap == Wrap::Twisted && turns % 2.0 != 0.0 {
                        p[b] = self.lo[b] + self.hi[b] - p[b];
                    }
                }
            }
        }
        p
    }
}

/// The place of number `d` on Hilbert's curve through a square of `side` by `side` cells, a power of two.
pub(super) fn hilbert(side: usize, mut d: usize) -> [usize; 2] {
    let (mut x, mut y, mut s) = (0, 0, 1);
    while s < side {
        let rx = 1 & (d / 2);
        let ry = 1 & (d ^ rx);
        if ry == 0 {
            if rx == 1 {
                (x, y) = (s - 1 - x, s - 1 - y);
            }
            std::mem::swap(&mut x, &mut y);
        }
        x += s * rx;
        y += s * ry;
        d /= 4;
        s *= 2;
    }
    [x, y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_hang_together() {
        let d = |wrap| Domain { lo: [0.0, -1.0], hi: [4.0, 1.0], wrap };
        let none = [[false; 2]; 2];
        assert_eq!(d([Wrap::Periodic, Wrap::Open]).inside([5.0, 3.0], &none), [1.0, 1.0]);
        assert_eq!(d([Wrap::Twisted, Wrap::Open]).inside([-1.0, 0.25], &none), [3.0, -0.25]);
        assert_eq!(d([Wrap::Twisted, Wrap::Open]).inside([9.0, 0.25], &none), [1.0, 0.25]);
        let pole = [[false; 2], [true, false]];
        assert_eq!(d([Wrap::Periodic, Wrap::Open]).inside([1.0, -1.25], &pole), [3.0, -0.75]);
    }

    #[test]
    fn the_curve_goes_from_cell_to_cell() {
        let places: Vec<_> = (0..256).map(|d| hilbert(16, d)).collect();
        for w in places.windows(2) {
            assert_eq!(w[0][0].abs_diff(w[1][0]) + w[0][1].abs_diff(w[1][1]), 1);
        }
    }
}
