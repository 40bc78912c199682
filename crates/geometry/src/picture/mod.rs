//! Pictures of oriented discs, balls, meshes and solids, in one depth buffer and one light, on the CPU: a camera that frames
//! them by itself, soft light that is gathered from all directions of the sky, antialiasing, PNG.
//!
//! A picture does not depend on the number of threads, nor on the scale or place of the points.

mod animation;
mod buffer;
mod camera;
mod color;
mod image;
mod light;
mod options;
mod progress;
mod raster;
mod scene;
mod shade;
mod solid;
mod triangles;
mod vector;

use std::sync::atomic::AtomicBool;

pub use animation::animate;
pub use color::{Colormap, colors};
pub use image::Picture;
pub use options::{Background, Coloring, PictureOptions, Projection, Style};
pub use solid::{Section, Solid};
pub use triangles::{MeshLook, MeshStyle};

use crate::render::Caster;
use crate::{GeometryError, PointCloud};
use progress::{CAST, RASTER, Stage};
use solid::Surfels;

/// What a picture shows. Everything hides and shades everything else.
#[derive(Clone, Debug, Default)]
pub struct Subject<'a> {
    /// Discs or balls; those that touch a solid or a mesh are laid on it.
    pub cloud: PointCloud<'a>,
    /// Solids, by ray casting.
    pub solids: Vec<Solid<'a>>,
    /// Triangles.
    pub meshes: Vec<MeshLook<'a>>,
}

/// A picture, and what is to be said of it.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// The picture.
    pub picture: Picture,
    /// Whether there was nothing to see: only the background is there.
    pub empty: bool,
    /// Whether the solids' pixels are certain: intervals prove that no crossing was missed. Not so for opaque functions.
    pub certified: bool,
}

/// Draws a cloud. Radii that are missing come from the areas or from the distances between points; without normals
/// every point is drawn as a ball. No points give the empty background.
///
/// # Errors
/// What [`PointCloud::check`] and [`PictureOptions::check`] say, and [`GeometryError::MissingColumn`] if the colouring
/// needs a column that the cloud lacks.
pub fn render(cloud: &PointCloud<'_>, options: &PictureOptions) -> Result<Picture, GeometryError> {
    render_until(cloud, options, &AtomicBool::new(false))
}

/// [`render`] that gives up soon after `stop` becomes true, for front-ends that must answer Ctrl-C.
///
/// # Errors
/// Those of [`render`], and [`GeometryError::Cancelled`].
pub fn render_until(
    cloud: &PointCloud<'_>,
    options: &PictureOptions,
    stop: &AtomicBool,
) -> Result<Picture, GeometryError> {
    render_framed(cloud, None, options, stop)
}

/// [`render_until`] with a camera that frames other points than those of the cloud, so that pictures of a cloud that moves
/// belong together; what lies outside may be cut off. `None`: the cloud.
///
/// # Errors
/// Those of [`render_until`], and [`GeometryError::Option`] for points that are not finite.
pub fn render_framed(
    cloud: &PointCloud<'_>,
    frame: Option<&[[f64; 3]]>,
    options: &PictureOptions,
    stop: &AtomicBool,
) -> Result<Picture, GeometryError> {
    let subject = Subject { cloud: *cloud, ..Subject::default() };
    Ok(draw(&subject, frame, options, stop)?.picture)
}

/// Draws everything of a subject. `frame` as for [`render_framed`].
///
/// ```
/// use isoswarm_field::{Aabb, Field, text};
/// use isoswarm_geometry::{PictureOptions, Solid, Subject, draw, render::Clip};
/// let field = Field::new(&text::parse("x^2 + y^2 + z^2 - 1", &[])?)?;
/// let solid = Solid::new(&field, Clip::new(Aabb::new([-1.1; 3], [1.1; 3])));
/// let subject = Subject { solids: vec![solid], ..Subject::default() };
/// let options = PictureOptions { width: 64, height: 48, ..Default::default() };
/// let drawn = draw(&subject, None, &options, &false.into())?;
/// assert!(!drawn.empty && drawn.certified);
/// # Ok::<(), isoswarm_geometry::GeometryError>(())
/// ```
///
/// # Errors
/// Those of [`render_framed`], and what [`Solid::check`], [`MeshLook::check`] and [`Caster::new`] say.
pub fn draw(
    subject: &Subject<'_>,
    frame: Option<&[[f64; 3]]>,
    options: &PictureOptions,
    stop: &AtomicBool,
) -> Result<Drawn, GeometryError> {
    draw_told(subject, frame, options, stop, &|_| {})
}

/// [`draw`] that tells, from whichever thread, what part of the work is done, 0 to 1.
///
/// # Errors
/// Those of [`draw`].
pub fn draw_told(
    subject: &Subject<'_>,
    frame: Option<&[[f64; 3]]>,
    options: &PictureOptions,
    stop: &AtomicBool,
    told: &(dyn Fn(f64) + Sync),
) -> Result<Drawn, GeometryError> {
    let mut cloud = subject.cloud;
    cloud.check()?;
    options.check()?;
    subject.solids.iter().try_for_each(Solid::check)?;
    subject.meshes.iter().try_for_each(MeshLook::check)?;
    if let Some(p) = frame.and_then(|f| f.iter().find(|p| !p.iter().all(|v| v.is_finite()))) {
        let (name, expected) = ("frame", "finite points");
        return Err(GeometryError::Option { name, expected, given: format!("{p:?}") });
    }
    if options.style == Style::Points {
        cloud.normals = None;
    }
    let casters: Vec<Caster> =
        subject.solids.iter().map(|s| Caster::new(s.field, &s.clip.bounds)).collect::<Result<_, _>>()?;
    let surfels = Stands::of(subject, &casters, stop)?;
    let scene = scene::Scene::new(&cloud, &surfels.cloud(), frame, options)?;
    let camera = camera::Camera::new(&scene, options);
    let mut buffers = Vec::new();
    let tiles = subject.solids.len() * solid::Draw::tiles(options);
    let stage = Stage::new(told, CAST.0, CAST.1, tiles);
    for ((solid, caster), radius) in subject.solids.iter().zip(&casters).zip(&surfels.mean) {
        let draw =
            solid::Draw { solid, caster, scene: &scene, camera: &camera, options, stop, stage: &stage };
        buffers.push(draw.buffer(*radius)?);
    }
    for (look, radius) in subject.meshes.iter().zip(&surfels.mean[subject.solids.len()..]) {
        let radius = (radius / scene.place.unit) as f32;
        buffers.push(triangles::DrawMesh::new(look, &scene, &camera, options)?.buffer(radius, stop)?);
    }
    // From below, the ground would hide the points.
    let ground = options.ground && scene.up[2] > 0.03 && scene.len() > 0;
    let (light, ground) = light::gather(&scene, receivers(&buffers), ground, stop, told)?;
    let mut fragments = light[scene.drawn..].iter();
    for f in buffers.iter_mut().flat_map(|b| &mut b.fragments) {
        if let Some(light) = fragments.next() {
            (f.sky, f.key) = (light.sky[0], light.key[0]);
        }
    }
    let studio = shade::Studio::new(&camera, ground.as_ref(), scene.up, options);
    let strips = Stage::new(told, RASTER.0, RASTER.1, (options.height as usize).div_ceil(raster::TILE));
    let rgba =
        raster::Raster::new(&scene, &camera, &light, &studio, &buffers, options).draw(stop, &strips)?;
    Ok(Drawn {
        picture: Picture { width: options.width, height: options.height, rgba },
        empty: scene.len() == 0,
        certified: casters.iter().all(Caster::is_certified),
    })
}

/// The places of all fragments, where light arrives.
fn receivers(buffers: &[buffer::Buffer]) -> Vec<light::Receiver> {
    let of = |b: &buffer::Buffer| {
        let radius = b.radius;
        let one =
            move |f: &buffer::Fragment| light::Receiver { position: f.position, normal: f.normal, radius };
        b.fragments.iter().map(one).collect::<Vec<_>>()
    };
    buffers.iter().flat_map(of).collect()
}

/// Discs that stand for all solids and meshes in the light, and the mean radius of each one's.
struct Stands {
    all: Surfels,
    mean: Vec<f64>,
}

impl Stands {
    fn of(subject: &Subject, casters: &[Caster], stop: &AtomicBool) -> Result<Self, GeometryError> {
        let mut stands = Self { all: Surfels::default(), mean: Vec::new() };
        for (solid, caster) in subject.solids.iter().zip(casters) {
            stands.add(Surfels::of(solid, caster, stop)?);
        }
        subject.meshes.iter().for_each(|m| stands.add(m.surfels()));
        Ok(stands)
    }

    fn add(&mut self, s: Surfels) {
        self.mean.push(s.radii.iter().sum::<f64>() / s.radii.len().max(1) as f64);
        self.all.points.extend(s.points);
        self.all.normals.extend(s.normals);
        self.all.radii.extend(s.radii);
    }

    fn cloud(&self) -> PointCloud<'_> {
        PointCloud::new(&self.all.points).with_normals(&self.all.normals).with_radii(&self.all.radii)
    }
}
