//! Colours: sRGB at the border, linear light inside, and two colour maps.

use std::sync::LazyLock;

use super::vector::V3;

/// Colour maps for numbers, even to the eye (interpolated in Oklab).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Colormap {
    /// Cool, pale in the middle, warm: for numbers with a meaningful zero at 0.5.
    Diverging,
    /// Dark blue to teal to sand, lighter all the way: for heights, distances, densities.
    Sequential,
}

impl Colormap {
    /// The sRGB colour at `t`, channels in 0..=1. `t` is clamped to 0..=1; NaN counts as 0.5.
    pub fn at(self, t: f64) -> [f64; 3] {
        const DIVERGING: [u32; 7] = [0x1B4F72, 0x2E86AB, 0x8CC3D9, 0xF1ECE2, 0xF3B487, 0xDD6B4D, 0x9B2C3B];
        const SEQUENTIAL: [u32; 6] = [0x2D2A5F, 0x2F5C8F, 0x2E8F9E, 0x5DB995, 0xB5D98B, 0xEBE19E];
        let stops: &[u32] = match self {
            Self::Diverging => &DIVERGING,
            Self::Sequential => &SEQUENTIAL,
        };
        let t = if t.is_nan() { 0.5 } else { t.clamp(0.0, 1.0) } * (stops.len() - 1) as f64;
        let k = (t as usize).min(stops.len() - 2);
        let (a, b) = (oklab(hex(stops[k])), oklab(hex(stops[k + 1])));
        let t = t - k as f64;
        from_oklab(std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t))
    }
}

/// sRGB colours for numbers: the smallest finite one gets the map's start, the largest its end. For a diverging map the
/// range is made symmetric about zero. Numbers that are not finite get the middle.
pub fn colors(values: &[f64], map: Colormap) -> Vec<[f64; 3]> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (mut low, mut high) = finite().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    if map == Colormap::Diverging {
        high = low.abs().max(high.abs());
        low = -high;
    }
    // Halved, so that the range of huge numbers does not overflow; a range of zero gives the middle.
    let half = 0.5 * high - 0.5 * low;
    values.iter().map(|v| map.at(if half > 0.0 { (0.5 * v - 0.5 * low) / half } else { 0.5 })).collect()
}

/// sRGB colours for mean curvatures: positive is warm, negative cool, clipped softly at the 90th percentile of their magnitude.
pub(super) fn bend(mean: &[f64]) -> Vec<[f64; 3]> {
    let mut sizes: Vec<f64> = mean.iter().map(|h| h.abs()).filter(|h| h.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let scale = sizes.get(sizes.len() * 9 / 10).copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    let one = |h: &f64| {
        let t = if h.is_finite() { h / scale } else { 0.0 };
        Colormap::Diverging.at(0.5 + 0.5 * t / (1.0 + t.abs().min(1e9).powi(2)).sqrt())
    };
    mean.iter().map(one).collect()
}

/// The inside of a surface of this linear colour: darker and greyer.
pub(super) fn inside(c: V3) -> V3 {
    let grey = 0.3 * c[0] + 0.6 * c[1] + 0.1 * c[2];
    c.map(|v| 0.55 * (0.5 * v + 0.5 * grey))
}

fn hex(rgb: u32) -> [f64; 3] {
    [16, 8, 0].map(|shift| f64::from((rgb >> shift) & 255) / 255.0)
}

/// sRGB (0..=1) to linear light.
pub(super) fn linear(srgb: [f64; 3]) -> V3 {
    srgb.map(|c| decode(c) as f32)
}

fn decode(c: f64) -> f64 {
    if c <= 0.040_45 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) }
}

fn encode(c: f64) -> f64 {
    if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * libm::pow(c, 1.0 / 2.4) - 0.055 }
}

const STEPS: usize = 1 << 14;
static BYTES: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..=STEPS).map(|i| (encode(i as f64 / STEPS as f64) * 255.0) as f32).collect());

/// Linear light to an sRGB byte, `noise` (in bytes) added before rounding.
pub(super) fn byte(c: f32, noise: f32) -> u8 {
    (BYTES[(c.clamp(0.0, 1.0) * STEPS as f32 + 0.5) as usize] + noise + 0.5) as u8
}

// Björn Ottosson, "A perceptual color space for image processing", 2020.
fn oklab(srgb: [f64; 3]) -> [f64; 3] {
    let [r, g, b] = srgb.map(decode);
    let l = libm::cbrt(0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b);
    let m = libm::cbrt(0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b);
    let s = libm::cbrt(0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b);
    [
        0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
        1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
        0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
    ]
}

fn from_oklab([l, a, b]: [f64; 3]) -> [f64; 3] {
    let p = l + 0.396_337_777_4 * a + 0.215_803_757_3 * b;
    let q = l - 0.105_561_345_8 * a - 0.063_854_172_8 * b;
    let s = l - 0.089_484_177_5 * a - 1.291_485_548_0 * b;
    let [p, q, s] = [p, q, s].map(|v| v * v * v);
    [
        4.076_741_662_1 * p - 3.307_711_591_3 * q + 0.230_969_929_2 * s,
        -1.268_438_004_6 * p + 2.609_757_401_1 * q - 0.341_319_396_5 * s,
        -0.004_196_086_3 * p - 0.703_418_614_7 * q + 1.707_614_701_0 * s,
    ]
    .map(|c| encode(c.clamp(0.0, 1.0)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_bytes_survive_the_way_to_linear_and_back() {
        for b in 0..=255u8 {
            assert_eq!(byte(linear([f64::from(b) / 255.0; 3])[0], 0.0), b);
        }
    }

    #[test]
    fn maps_hit_their_stops_and_clamp() {
        let close = |a: [f64; 3], b: u32| {
            let b = hex(b);
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 2e-3), "{a:?} {b:?}");
        };
        close(Colormap::Diverging.at(0.5), 0xF1ECE2);
        close(Colormap::Diverging.at(f64::NAN), 0xF1ECE2);
        close(Colormap::Sequential.at(-3.0), 0x2D2A5F);
        close(Colormap::Sequential.at(f64::INFINITY), 0xEBE19E);
    }

    #[test]
    fn numbers_are_spread_over_the_whole_map() {
        let c = colors(&[-2.0, 0.0, 1.0, f64::NAN], Colormap::Diverging);
        assert_eq!(c[1], Colormap::Diverging.at(0.5));
        assert_eq!(c[0], Colormap::Diverging.at(0.0));
        assert_eq!(c[3], Colormap::Diverging.at(0.5));
        assert_eq!(colors(&[7.0; 2], Colormap::Sequential), vec![Colormap::Sequential.at(0.5); 2]);
        assert_eq!(colors(&[-1e308, 1e308], Colormap::Sequential)[1], Colormap::Sequential.at(1.0));
        assert!(colors(&[], Colormap::Sequential).is_empty());
    }
}
