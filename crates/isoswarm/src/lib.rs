//! Even samples on implicit surfaces, by particles that are locked onto F(x, q) = 0.
//!
//! A surface is a function; a swarm lives on it; all else comes off the swarm. Data flows one way:
//!
//! | crate | what it holds |
//! |---|---|
//! | [`field`] | what a surface is: models, formulas, F with its derivatives and intervals |
//! | [`particles`] | what lives on it: the constraint, repulsion, birth and death; samples and their evenness |
//! | [`geometry`] | what comes off it: point files and pictures |
//! | [`scene`] | a model being edited: control points, adapters, fits, undo, replay |
//!
//! # A tour
//!
//! A model is a formula, a tree of shapes and operators, a `.vm` or `.iso.json` file, or a function of yours.
//! F is negative inside.
//!
//! ```
//! use isoswarm::field::{Field, text};
//!
//! let model = text::parse("torus(1, r) | sphere(0.4)", &[("r", 0.3)])?;
//! let field = Field::new(&model)?;
//! let mut value = [0.0];
//! field.value(&[0.0, 0.0, 0.0], &mut value)?;
//! assert_eq!(value, [-0.4]);
//! # Ok::<(), isoswarm::field::FieldError>(())
//! ```
//!
//! It knows its parameters, its derivatives with respect to place and parameters, and what it can be in a box:
//!
//! ```
//! # use isoswarm::field::{Field, text};
//! let field = Field::new(&text::parse("x^2 + y^2 + z^2 - r^2", &[("r", 1.0)])?)?;
//! let (mut f, mut fx, mut fq) = ([0.0], [0.0; 3], [0.0]);
//! field.parameter_gradient(&[2.0, 0.0, 0.0], &mut f, &mut fx, &mut fq)?;
//! assert_eq!((f, fx, fq), ([3.0], [4.0, 0.0, 0.0], [-2.0]));
//!
//! let far = field.interval(&[2.0, 2.0, 2.0], &[3.0, 3.0, 3.0])?[0];
//! assert!(far.lo > 0.0, "no zero in that box");
//! let bounds = field.bounds().expect("a sphere is compact");
//! assert!(bounds.contains([1.0, 0.0, 0.0]));
//! # Ok::<(), isoswarm::field::FieldError>(())
//! ```
//!
//! Samples are spread evenly by repulsion; say how many, or how far apart:
//!
//! ```
//! # use isoswarm::field::{Field, text};
//! use isoswarm::geometry::{PointCloud, save};
//! use isoswarm::particles::{Amount, Options, sample};
//!
//! let field = Field::new(&text::parse("x^2 + y^2 + z^2 - 1", &[])?)?;
//! let bounds = field.bounds().expect("a sphere is compact");
//! let options = Options { amount: Amount::Count(500), ..Default::default() };
//! let samples = sample(&field, &bounds, options)?;
//!
//! assert_eq!(samples.points.len(), 500);
//! let area: f64 = samples.areas.iter().sum();
//! assert!((area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 0.01);
//!
//! let cloud = PointCloud::new(&samples.points).with_normals(&samples.normals);
//! # let folder = std::env::temp_dir().join(format!("isoswarm-tour-{}", std::process::id()));
//! # std::fs::create_dir_all(&folder)?;
//! # let path = folder.join("sphere.ply");
//! save(&path, &cloud)?;
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A scene is a model being edited: pin points of its surface, drag others, and its parameters follow:
//!
//! ```
//! # use isoswarm::field::text;
//! use isoswarm::scene::{Command, Scene, Settings};
//!
//! let blobs = text::parse("blobs(0.5, -0.5, 0, 0, 0.8, 0.5, 0, 0, 0.8)", &[])?;
//! let mut scene = Scene::new(&blobs, Settings::default())?;
//! scene.pin([-1.2, 0.0, 0.0])?;
//! let hand = scene.pin([1.2, 0.0, 0.0])?;
//! let report = scene.drag(&[(hand, [1.8, 0.5, 0.0])])?;
//! assert!(report.reached && report.residual < 1e-8);
//! scene.apply(Command::Undo {})?;
//! assert!((scene.samples(Some(300))?.points.len()) == 300);
//! # Ok::<(), isoswarm::scene::Error>(())
//! ```
pub use isoswarm_field as field;
pub use isoswarm_geometry as geometry;
pub use isoswarm_particles as particles;
pub use isoswarm_scene as scene;
