//! What surfaces leave in a picture before it is lit: for each pixel, or for each of its samples, the layers that are seen.

use super::vector::{V3, dot};

/// One layer of a surface at a pixel or sample, in view space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fragment {
    pub depth: f32,
    pub position: V3,
    /// Unit normal on the side that is seen.
    pub normal: V3,
    /// Whether that is the inside.
    pub back: bool,
    /// Linear colour.
    pub color: V3,
    /// Opacity, 0 to 1.
    pub alpha: f32,
    /// Light that arrives: see [`super::light::Light`].
    pub sky: f32,
    pub key: f32,
}

/// A run of fragments, nearest first; for a split pixel, a run of its samples' runs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Span {
    pub first: u32,
    pub count: u16,
    pub split: bool,
}

/// All fragments of one thing in a picture.
#[derive(Default)]
pub(super) struct Buffer {
    pub width: usize,
    /// Samples a pixel and direction.
    pub samples: usize,
    pub pixels: Vec<Span>,
    /// Runs of fragments of the samples of split pixels, row by row.
    pub splits: Vec<Span>,
    pub fragments: Vec<Fragment>,
    /// Radius of the discs that stand for the thing in the light, in view space.
    pub radius: f32,
}

impl Buffer {
    pub fn new(width: usize, height: usize, samples: usize) -> Self {
        Self { width, samples, pixels: vec![Span::default(); width * height], ..Self::default() }
    }

    pub fn pixel(&self, x: usize, y: usize) -> Span {
        self.pixels[y * self.width + x]
    }

    /// The fragments of sample (sx, sy) of a pixel.
    pub fn sample(&self, pixel: Span, sx: usize, sy: usize) -> &[Fragment] {
        if !pixel.split {
            return self.run(pixel);
        }
        self.run(self.splits[pixel.first as usize + sy * self.samples + sx])
    }

    pub fn run(&self, span: Span) -> &[Fragment] {
        &self.fragments[span.first as usize..span.first as usize + usize::from(span.count)]
    }

    /// Appends a run of fragments.
    pub fn push(&mut self, run: impl IntoIterator<Item = Fragment>) -> Span {
        let first = self.fragments.len();
        self.fragments.extend(run);
        Span { first: first as u32, count: (self.fragments.len() - first) as u16, split: false }
    }
}

impl Fragment {
    /// Depth on the ray from `start` along `ray`, on the plane that touches the surface here: for samples beside the pixel's centre.
    pub fn depth_along(&self, start: V3, ray: V3) -> f32 {
        let off: V3 = std::array::from_fn(|k| self.position[k] - start[k]);
        let depth = dot(self.normal, off) / dot(self.normal, ray);
        // At a horizon the plane says nothing.
        if (depth - self.depth).abs() < 0.1 * self.depth { depth } else { self.depth }
    }
}
