//! Random numbers by counter: a pure function of (seed, stream, counter), so that no thread count, order of events or
//! earlier draw changes a result.

/// Independent uses of random numbers; each has its own stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Stream {
    /// Lines through the surface.
    Lines = 1,
    /// Which seeds are kept.
    Thinning = 2,
    /// Directions in which floaters split.
    Fission = 3,
    /// Who dies.
    Death = 4,
    /// Starting points of projections.
    Probes = 5,
    /// Displacements of a fresh generation.
    Jitter = 6,
}

/// A stream of random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rng {
    key: u64,
}

/// The finaliser of SplitMix64: a bijection of 64 bits in which every input bit flips half of the output bits.
#[inline(always)]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

impl Rng {
    /// The stream of that use under the seed.
    pub fn new(seed: u64, stream: Stream) -> Self {
        Self { key: mix(mix(seed.wrapping_add(GOLDEN)) ^ (stream as u64).wrapping_mul(GOLDEN)) }
    }

    /// A stream of its own below this one, for example one a step.
    pub fn child(self, index: u64) -> Self {
        Self { key: mix(self.key ^ mix(index.wrapping_add(GOLDEN))) }
    }

    /// 64 random bits.
    #[inline(always)]
    pub fn bits(self, counter: u64) -> u64 {
        mix(self.key.wrapping_add(counter.wrapping_add(1).wrapping_mul(GOLDEN)))
    }

    /// A uniform number in [0, 1), a multiple of 2^-53.
    #[inline(always)]
    pub fn unit(self, counter: u64) -> f64 {
        (self.bits(counter) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// A uniformly distributed unit vector (in the plane z = 0 where `axes` is 2), by rejection: no trigonometry.
    pub fn direction(self, counter: u64, axes: usize) -> [f64; 3] {
        let own = self.child(counter);
        for k in 0u64.. {
            let mut v = [0.0; 3];
            for a in 0..axes {
                v[a] = 2.0 * own.unit(3 * k + a as u64) - 1.0;
            }
            let s = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
            if (1e-4..=1.0).contains(&s) {
                let r = s.sqrt();
                return [v[0] / r, v[1] / r, v[2] / r];
            }
        }
        unreachable!("each try succeeds with probability above one half")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_and_uncorrelated() {
        let r = Rng::new(7, Stream::Lines);
        let n = 200_000u64;
        let mean = (0..n).map(|i| r.unit(i)).sum::<f64>() / n as f64;
        let lag = (0..n).map(|i| (r.unit(i) - 0.5) * (r.unit(i + 1) - 0.5)).sum::<f64>() / n as f64;
        let across = Rng::new(8, Stream::Lines);
        let seeds = (0..n).map(|i| (r.unit(i) - 0.5) * (across.unit(i) - 0.5)).sum::<f64>() / n as f64;
        // Standard errors: .29/sqrt(n) = 6.5e-4 for the mean, 1/12/sqrt(n) = 1.9e-4 for the products.
        assert!((mean - 0.5).abs() < 2.6e-3, "{mean}");
        assert!(lag.abs() < 8e-4 && seeds.abs() < 8e-4, "{lag} {seeds}");
    }

    #[test]
    fn directions_are_isotropic_units() {
        let r = Rng::new(1, Stream::Fission);
        let n = 50_000u64;
        let mut second = [0.0; 3];
        for i in 0..n {
            let v = r.direction(i, 3);
            assert!((v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - 1.0).abs() < 1e-14);
            for a in 0..3 {
                second[a] += v[a] * v[a] / n as f64;
            }
        }
        assert!(second.iter().all(|s| (s - 1.0 / 3.0).abs() < 0.006), "{second:?}");
        assert_eq!(r.direction(5, 2)[2], 0.0);
    }

    #[test]
    fn streams_differ_and_repeat() {
        let a = Rng::new(0, Stream::Lines);
        assert_eq!(a.bits(3), Rng::new(0, Stream::Lines).bits(3));
        assert_ne!(a.bits(3), Rng::new(0, Stream::Death).bits(3));
        assert_ne!(a.bits(3), Rng::new(1, Stream::Lines).bits(3));
        assert_ne!(a.bits(3), a.child(0).bits(3));
    }
}
