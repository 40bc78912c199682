//! The cloud as the renderer wants it: scaled into the unit ball, turned so that the camera looks along -z, in `f32`.

use super::color::{Colormap, linear};
use super::options::{Coloring, PictureOptions, Style};
use super::vector::{V3, unit_f64};
use crate::{GeometryError, PointCloud};

/// Radius over distance to the nearest neighbour at which discs of an even sampling cover the surface: the
/// circumradius of a hexagonal lattice's triangles, 1/√3, and a little more.
const COVERING: f64 = 0.58;
/// The same radius, over that of the disc with the area of a point's cell: d² √3/2 = π r².
const COVERING_BY_AREA: f64 = 1.105;

/// Discs in view space: x to the right, y up, z towards the camera, everything inside the unit ball.
pub(super) struct Scene {
    pub position: Vec<V3>,
    /// Unit vectors. Towards the camera where there is no normal.
    pub normal: Vec<V3>,
    /// Covering radius.
    pub radius: Vec<f32>,
    /// Radius of a disc that is drawn, over its covering radius.
    pub shown: f32,
    /// Linear colours of the two sides.
    pub front: Vec<V3>,
    pub back: Vec<V3>,
    /// Without normals the discs face the camera and are shaded as balls.
    pub round: bool,
    /// The direction that is up, in view space.
    pub up: V3,
    /// What the camera frames instead of the discs.
    pub frame: Option<Vec<V3>>,
    /// Discs that are drawn; those after them only stand in the light.
    pub drawn: usize,
    /// Where view space lies in the world.
    pub place: Place,
}

/// View space in the world: the point `center` + `unit` · Σ v · axes for a point v of view space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub center: [f64; 3],
    pub unit: f64,
    /// To the right, up, and towards the camera.
    pub axes: [[f64; 3]; 3],
}

impl Place {
    /// A direction of view space in the world, in world units.
    pub fn direction(&self, v: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| self.unit * (0..3).map(|i| v[i] * self.axes[i][k]).sum::<f64>())
    }

    /// A point of view space in the world.
    pub fn point(&self, v: [f64; 3]) -> [f64; 3] {
        let d = self.direction(v);
        std::array::from_fn(|k| self.center[k] + d[k])
    }

    /// A world vector turned into view space, its length kept.
    pub fn turned(&self, v: [f64; 3]) -> V3 {
        self.axes.map(|a| (a[0] * v[0] + a[1] * v[1] + a[2] * v[2]) as f32)
    }

    /// A world point in view space.
    pub fn seen(&self, p: [f64; 3]) -> V3 {
        self.turned(std::array::from_fn(|k| (p[k] - self.center[k]) / self.unit))
    }
}

impl Scene {
    /// `occluders`, with normals and radii, are not drawn.
    pub fn new(
        cloud: &PointCloud<'_>,
        occluders: &PointCloud<'_>,
        frame: Option<&[[f64; 3]]>,
        options: &PictureOptions,
    ) -> Result<Self, GeometryError> {
        let view = View::new(options);
        let (mut front, mut back) = side_colors(cloud, options)?;
        let corners: Vec<[f64; 3]> =
            [cloud.bounds(), occluders.bounds()].into_iter().flatten().flat_map(|(a, b)| [a, b]).collect();
        // Nothing to see: what is framed, so that an empty picture has the scale of those around it.
        let corners = if corners.is_empty() { frame.unwrap_or_default() } else { &corners };
        let Some((low, high)) = PointCloud::new(corners).bounds() else {
            return Ok(Self::empty(&view));
        };

        // Twice: by the box, so that nothing overflows whatever the scale, then by the ball.
        let center: [f64; 3] = std::array::from_fn(|k| 0.5 * low[k] + 0.5 * high[k]);
        let half = (0..3).map(|k| 0.5 * high[k] - 0.5 * low[k]).fold(0.0, f64::max);
        let given = [cloud.radii, occluders.radii].into_iter().flatten().flatten();
        let largest = given.copied().fold(0.0, f64::max);
        let size = match half + largest {
            0.0 => 1.0,
            size => size.min(f64::MAX),
        };
        let moved = |p: &[f64; 3]| std::array::from_fn(|k| (p[k] - center[k]) / size);
        let mut points: Vec<[f64; 3]> = cloud.points.iter().map(moved).collect();
        let mut radii = radii(cloud, &points, size);
        let scale = options.disc_scale.unwrap_or(match options.style {
            Style::Surface => 1.0,
            _ => 0.82,
        });
        // Discs are cut out of a surface that keeps its radii, so that light does not leak through their gaps.
        let shown = match options.style {
            Style::Surface => {
                radii.iter_mut().for_each(|r| *r *= scale);
                1.0
            }
            _ => scale,
        };
        let drawn = points.len();
        points.extend(occluders.points.iter().map(moved));
        radii.extend(occluders.radii.unwrap_or_default().iter().map(|r| r / size));
        radii.resize(points.len(), 0.0);
        front.resize(points.len(), [0.5; 3]);
        back.resize(points.len(), [0.5; 3]);
        let ball = points
            .iter()
            .zip(&radii)
            .map(|(p, r)| (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt() + r)
            .fold(0.0, f64::max);
        let ball = if ball > 0.0 { ball } else { 1.0 };
        points.as_flattened_mut().iter_mut().for_each(|v| *v /= ball);
        let placed = |p: &[f64; 3]| view.turned(std::array::from_fn(|k| (p[k] - center[k]) / size / ball));
        let frame = frame.map(|points| points.iter().map(placed).collect());

        let turned = |n: &[f64; 3]| unit_f64(*n).map_or([0.0, 0.0, 1.0], |n| view.turned(n));
        let mut normal: Vec<V3> = cloud.normals.unwrap_or_default().iter().map(turned).collect();
        normal.resize(drawn, [0.0, 0.0, 1.0]);
        normal.extend(occluders.normals.unwrap_or_default().iter().map(turned));
        normal.resize(points.len(), [0.0, 0.0, 1.0]);
        Ok(Self {
            position: points.iter().map(|p| view.turned(*p)).collect(),
            normal,
            radius: radii.iter().map(|r| (r / ball) as f32).collect(),
            front,
            back,
            shown: shown as f32,
            round: cloud.normals.is_none(),
            up: view.turned(view.up),
            frame,
            drawn,
            place: Place { center, unit: size * ball, axes: [view.right, view.above, view.toward] },
        })
    }

    pub fn len(&self) -> usize {
        self.position.len()
    }

    fn empty(view: &View) -> Self {
        let none = Vec::new;
        Self {
            position: none(),
            normal: none(),
            radius: Vec::new(),
            front: none(),
            back: none(),
            shown: 1.0,
            round: false,
            up: view.turned(view.up),
            frame: None,
            drawn: 0,
            place: Place { center: [0.0; 3], unit: 1.0, axes: [view.right, view.above, view.toward] },
        }
    }
}

/// The rotation from the world to view space.
struct View {
    right: [f64; 3],
    above: [f64; 3],
    toward: [f64; 3],
    up: [f64; 3],
}

impl View {
    fn new(options: &PictureOptions) -> Self {
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let up = unit_f64(options.up).unwrap_or([0.0, 0.0, 1.0]);
        // Azimuth counts from the x axis, or from the y axis where x is up.
        let axis = if up[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let along = dot(axis, up);
        let e1 = unit_f64(std::array::from_fn(|k| axis[k] - along * up[k])).unwrap_or(axis);
        let e2 = cross(up, e1);
        let (sa, ca) = libm::sincos(options.azimuth);
        let (se, ce) = libm::sincos(options.elevation);
        let toward: [f64; 3] = std::array::from_fn(|k| ce * (ca * e1[k] + sa * e2[k]) + se * up[k]);
        let right: [f64; 3] = std::array::from_fn(|k| ca * e2[k] - sa * e1[k]);
        Self { right, above: cross(toward, right), toward, up }
    }

    fn turned(&self, p: [f64; 3]) -> V3 {
        [self.right, self.above, self.toward].map(|a| (a[0] * p[0] + a[1] * p[1] + a[2] * p[2]) as f32)
    }
}

/// Radii in units of `size`: given, or from the areas, or from the distance between neighbours.
fn radii(cloud: &PointCloud<'_>, points: &[[f64; 3]], size: f64) -> Vec<f64> {
    if let Some(radii) = cloud.radii {
        return radii.iter().map(|r| r / size).collect();
    }
    if let Some(areas) = cloud.areas {
        return areas.iter().map(|a| COVERING_BY_AREA * (a / std::f64::consts::PI).sqrt() / size).collect();
    }
    vec![COVERING * typical_distance(points); points.len()]
}

/// Median distance to the nearest other point, of up to 256 points spread over the list.
fn typical_distance(points: &[[f64; 3]]) -> f64 {
    let step = points.len().div_ceil(256).max(1);
    let mut nearest: Vec<f64> = points
        .iter()
        .step_by(step)
        .map(|p| {
            let square = |q: &[f64; 3]| (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f64>();
            points.iter().map(square).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min).sqrt()
        })
        .filter(|d| d.is_finite())
        .collect();
    nearest.sort_by(f64::total_cmp);
    nearest.get(nearest.len() / 2).copied().unwrap_or(0.1)
}

/// Linear colours of the outside and the inside at every point.
pub(super) fn side_colors(
    cloud: &PointCloud<'_>,
    options: &PictureOptions,
) -> Result<(Vec<V3>, Vec<V3>), GeometryError> {
    let n = cloud.len();
    if n == 0 {
        return Ok((Vec::new(), Vec::new())); // no columns either: a picture of other things
    }
    let srgb: Vec<[f64; 3]> = match options.coloring {
        Coloring::Uniform { front, back } => return Ok((vec![linear(front); n], vec![linear(back); n])),
        Coloring::Given => {
            let needed_for = "the colouring `given`";
            cloud.colors.ok_or(GeometryError::MissingColumn { column: "colors", needed_for })?.to_vec()
        }
        Coloring::Curvature => {
            let needed_for = "the colouring `curvature`";
            let k =
                cloud.curvatures.ok_or(GeometryError::MissingColumn { column: "curvatures", needed_for })?;
            let mean: Vec<f64> = k.iter().map(|k| 0.5 * k[0] + 0.5 * k[1]).collect();
            super::color::bend(&mean)
        }
        Coloring::Height => {
            let up = unit_f64(options.up).unwrap_or([0.0, 0.0, 1.0]);
            let heights: Vec<f64> =
                cloud.points.iter().map(|p| (0..3).map(|k| 0.25 * p[k] * up[k]).sum()).collect();
            super::color::colors(&heights, Colormap::Sequential)
        }
        Coloring::Normal => {
            let needed_for = "the colouring `normal`";
            let normals =
                cloud.normals.ok_or(GeometryError::MissingColumn { column: "normals", needed_for })?;
            let one = |n: &[f64; 3]| unit_f64(*n).unwrap_or([0.0; 3]).map(|v| 0.5 + 0.5 * v);
            normals.iter().map(one).collect()
        }
    };
    let front: Vec<V3> = srgb.iter().map(|c| linear(*c)).collect();
    let back = front.iter().map(|c| super::color::inside(*c)).collect();
    Ok((front, back))
}
