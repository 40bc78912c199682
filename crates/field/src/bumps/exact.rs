//! Values that do not depend on the points beside them.

use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

use super::{Bump, CHUNK, LANES, RUN, Sum, WIDE, columns};
use crate::math;

impl Sum {
    /// Number of bumps.
    pub(crate) fn len(&self) -> usize {
        self.bumps.len()
    }

    /// F, and ∂F/∂x where it is wanted, of each point from the bumps that reach it alone: not a bit of it depends on the
    /// points beside it.
    pub(crate) fn exactly(&self, points: &[[f64; 3]], value: &mut [f64], gradient: Option<&mut [[f64; 3]]>) {
        let work = |points: &[[f64; 3]], value: &mut [f64], mut gradient: Option<&mut [[f64; 3]]>| {
            let (arch, mut near, mut some) = (Arch::new(), Vec::new(), Vec::new());
            self.numbered_runs(points, WIDE, &mut near, &mut |start, end, near| {
                some.clear();
                some.extend(near.iter().map(|&i| (self.bumps[i as usize], self.reach[i as usize])));
                let (f, g) =
                    arch.dispatch(Exact { offset: self.offset, bumps: &some, points: &points[start..end] });
                value[start..end].copy_from_slice(&f[..end - start]);
                if let Some(gradient) = gradient.as_deref_mut() {
                    (start..end).for_each(|i| gradient[i] = [0, 1, 2].map(|a| g[a][i - start]));
                }
            });
        };
        let parts = points.par_chunks(CHUNK).zip(value.par_chunks_mut(CHUNK));
        match gradient {
            Some(g) => parts.zip(g.par_chunks_mut(CHUNK)).for_each(|((p, v), g)| work(p, v, Some(g))),
            None => parts.for_each(|(p, v)| work(p, v, None)),
        }
    }
}

/// Up to [`RUN`] points next to each other, and the bumps around them with the reach of each, beyond which it counts for nothing.
struct Exact<'a> {
    offset: f64,
    bumps: &'a [(Bump, f64)],
    points: &'a [[f64; 3]],
}

impl NullaryFnOnce for Exact<'_> {
    type Output = ([f64; LANES], [[f64; LANES]; 3]);

    #[inline(always)]
    fn call(self) -> Self::Output {
        let x = columns(self.points);
        let mut f = [self.offset; LANES];
        for j in 0..LANES {
            if (x[0][j] + x[1][j] + x[2][j]).is_nan() {
                f[j] = f64::NAN;
            }
        }
        let mut g = [[0.0; LANES]; 3];
        for (b, reach) in self.bumps {
            let (mut d, mut e) = ([[0.0; LANES]; 3], [0.0; LANES]);
            for a in 0..3 {
                for j in 0..LANES {
                    let r = x[a][j] - b.center[a];
                    d[a][j] = b.weight[a] * r;
                    e[j] += d[a][j] * r;
                }
            }
            for j in 0..LANES {
                let bump = b.factor * math::exp(b.level - e[j]);
                let bump = if e[j] <= *reach { bump } else { 0.0 };
                f[j] += bump;
                for a in 0..3 {
                    g[a][j] -= 2.0 * bump * d[a][j];
                }
            }
        }
        (f, g)
    }
}

const _: () = assert!(RUN == LANES, "a run fills the lanes once");
