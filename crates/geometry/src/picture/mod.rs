//! Pictures of oriented discs, on the CPU: a perspective camera that frames the points by itself, soft light that is
//! gathered from all directions of the sky, antialiasing, PNG.
//!
//! A picture does not depend on the number of threads, nor on the scale or place of the points.

mod animation;
mod camera;
mod color;
mod image;
mod light;
mod options;
mod raster;
mod scene;
mod shade;
mod vector;

use std::sync::atomic::AtomicBool;

pub use animation::animate;
pub use color::{Colormap, colors};
pub use image::Picture;
pub use options::{Background, Coloring, PictureOptions, Style};

use crate::{GeometryError, PointCloud};

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
    cloud.check()?;
    options.check()?;
    if let Some(p) = frame.and_then(|f| f.iter().find(|p| !p.iter().all(|v| v.is_finite()))) {
        let (name, expected) = ("frame", "finite points");
        return Err(GeometryError::Option { name, expected, given: format!("{p:?}") });
    }
    let scene = scene::Scene::new(cloud, frame, options)?;
    let camera = camera::Camera::new(&scene, options);
    // From below, the ground would hide the points.
    let ground = options.ground && scene.up[2] > 0.03 && scene.len() > 0;
    let (light, ground) = light::gather(&scene, ground, stop)?;
    let studio = shade::Studio::new(&camera, ground.as_ref(), scene.up, options);
    let rgba = raster::Raster::new(&scene, &camera, &light, &studio, options).draw(stop)?;
    Ok(Picture { width: options.width, height: options.height, rgba })
}
