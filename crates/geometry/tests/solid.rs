//! Pictures of solids, meshes and points together, by coarse numbers.

use std::sync::atomic::AtomicBool;

use isoswarm_field::{Aabb, Field, text};
use isoswarm_geometry::render::{Clip, Plane};
use isoswarm_geometry::{
    Background, Coloring, Drawn, Mesh, MeshLook, MeshStyle, PictureOptions, PointCloud, Projection, Section,
    Solid, Style, Subject, draw,
};

fn field(formula: &str) -> Field {
    Field::new(&text::parse(formula, &[]).unwrap()).unwrap()
}

fn cube(half: f64) -> Clip {
    Clip::new(Aabb::new([-half; 3], [half; 3]))
}

fn options() -> PictureOptions {
    PictureOptions {
        width: 120,
        height: 120,
        background: Background::Transparent,
        ground: false,
        supersampling: 3,
        ..Default::default()
    }
}

/// Corners of a cube, to frame.
fn frame(half: f64) -> Vec<[f64; 3]> {
    (0..8).map(|k| [0, 1, 2].map(|a| if k >> a & 1 == 0 { -half } else { half })).collect()
}

fn drawn(subject: &Subject, options: &PictureOptions) -> Drawn {
    draw(subject, Some(&frame(1.0)), options, &AtomicBool::new(false)).unwrap()
}

/// Sum of opacities, in pixels.
fn cover(d: &Drawn) -> f64 {
    d.picture.rgba.chunks_exact(4).map(|p| f64::from(p[3]) / 255.0).sum()
}

fn red(d: &Drawn) -> usize {
    let is_red = |p: &&[u8]| p[3] > 128 && u32::from(p[0]) > 2 * u32::from(p[1]) && p[0] > 2 * (p[2] / 2);
    d.picture.rgba.chunks_exact(4).filter(is_red).count()
}

fn ball<'a>(f: &'a Field) -> Subject<'a> {
    Subject { solids: vec![Solid::new(f, cube(1.1))], ..Subject::default() }
}

#[test]
fn a_ball_covers_the_disc_that_it_should() {
    let f = field("x^2 + y^2 + z^2 - 0.64");
    // In parallel projection: πr² over the frame, whose size follows from what two balls cover.
    let options = PictureOptions { projection: Projection::Parallel, ..options() };
    let large = cover(&drawn(&ball(&f), &options));
    let g = field("x^2 + y^2 + z^2 - 0.16");
    let small = cover(&drawn(&ball(&g), &options));
    assert!((large / small - 4.0).abs() < 0.02, "{large} {small}");
    // An ellipsoid seen along its axis of revolution is round, seen from the side it is not.
    let e = field("x^2 + y^2 + 4*z^2 - 0.64");
    let top = PictureOptions { elevation: std::f64::consts::FRAC_PI_2, ..options };
    let side = PictureOptions { elevation: 0.0, azimuth: 0.0, ..options };
    let scale = cover(&drawn(&ball(&f), &side)) / cover(&drawn(&ball(&f), &top));
    let ratio = cover(&drawn(&ball(&e), &side)) / cover(&drawn(&ball(&e), &top)) / scale;
    assert!((ratio - 0.5).abs() < 0.01, "{ratio}");
}

/// A red disc at distance `along` from the origin towards the camera.
fn with_disc<'a>(f: &'a Field, points: &'a [[f64; 3]], normals: &'a [[f64; 3]]) -> Subject<'a> {
    let cloud =
        PointCloud::new(points).with_normals(normals).with_radii(&[0.15]).with_colors(&[[0.9, 0.05, 0.05]]);
    Subject { cloud, ..ball(f) }
}

#[test]
fn discs_before_a_solid_show_and_those_behind_do_not() {
    let f = field("x^2 + y^2 + z^2 - 0.64");
    // The camera stands on the x axis.
    for projection in [Projection::Perspective, Projection::Parallel] {
        let o = PictureOptions {
            azimuth: 0.0,
            elevation: 0.0,
            style: Style::Discs,
            coloring: Coloring::Normal,
            projection,
            ..options()
        };
        let normals = [[1.0, 0.0, 0.0]];
        let given = PictureOptions { coloring: Coloring::Given, ..o };
        let count = |x: f64| {
            let points = [[x, 0.0, 0.0]];
            let values = field("x");
            let mut subject = with_disc(&f, &points, &normals);
            subject.solids[0].values = Some(&values);
            red(&drawn(&subject, &given))
        };
        let (before, on, inside, behind) = (count(1.0), count(0.8), count(0.2), count(-1.0));
        assert!(before > 50, "{before}");
        assert!(on > 40, "{on}");
        assert_eq!((inside, behind), (0, 0));
    }
}

#[test]
fn nothing_is_an_empty_background() {
    let f = field("x^2 + y^2 + z^2 + 1");
    let d = drawn(&ball(&f), &options());
    assert!(d.empty && d.certified);
    assert_eq!(cover(&d), 0.0);
}

#[test]
fn layers_let_light_through() {
    let f = field("x^2 + y^2 + z^2 - 0.64");
    let mut subject = ball(&f);
    let opaque = cover(&drawn(&subject, &options()));
    subject.solids[0].opacity = 0.5;
    // Two layers of a half: three quarters.
    let ratio = cover(&drawn(&subject, &options())) / opaque;
    assert!((ratio - 0.75).abs() < 0.01, "{ratio}");
}

#[test]
fn cuts_take_away_what_they_should() {
    let f = field("x^2 + y^2 + z^2 - 0.64");
    let o = PictureOptions { projection: Projection::Parallel, azimuth: 0.0, elevation: 0.0, ..options() };
    let whole = cover(&drawn(&ball(&f), &o));
    for section in [Section::Flat, Section::Hatched, Section::Distance] {
        let mut subject = ball(&f);
        subject.solids[0].section = section;
        subject.solids[0].clip.planes.push(Plane { normal: [0.0, 0.0, 1.0], offset: 0.0 });
        let half = cover(&drawn(&subject, &o)) / whole;
        assert!((half - 0.5).abs() < 0.01, "{half}");
    }
    // A slice shows the field outside the solid too.
    let mut subject = ball(&f);
    subject.solids[0].section = Section::Slice;
    subject.solids[0].clip.planes.push(Plane { normal: [1.0, 0.0, 0.0], offset: 0.0 });
    assert!(cover(&drawn(&subject, &o)) > 1.5 * whole);
}

/// An octahedron whose triangles are halved `times` times, on the sphere of radius r.
fn sphere(times: usize, r: f64) -> Mesh {
    let mut points: Vec<[f64; 3]> = vec![
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ];
    let mut faces: Vec<[u32; 3]> =
        vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..times {
        let mut next = Vec::new();
        for [a, b, c] in faces {
            let mut middle = |i: u32, j: u32| {
                let (p, q) = (points[i as usize], points[j as usize]);
                points.push(isoswarm_field::vector::unit([0, 1, 2].map(|k| p[k] + q[k])));
                points.len() as u32 - 1
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            next.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = next;
    }
    points.iter_mut().for_each(|p| *p = p.map(|v| r * v));
    Mesh::new(points, faces)
}

#[test]
fn a_mesh_looks_like_its_surface() {
    let f = field("x^2 + y^2 + z^2 - 0.64");
    let mesh = sphere(4, 0.8);
    let look =
        |style| Subject { meshes: vec![MeshLook { mesh: &mesh, style, colors: None }], ..Subject::default() };
    for projection in [Projection::Perspective, Projection::Parallel] {
        let o = PictureOptions { projection, ..options() };
        let (a, b) = (drawn(&ball(&f), &o), drawn(&look(MeshStyle::Smooth), &o));
        assert!((cover(&a) / cover(&b) - 1.0).abs() < 0.01);
        let off: f64 =
            a.picture.rgba.iter().zip(&b.picture.rgba).map(|(p, q)| f64::from(p.abs_diff(*q))).sum::<f64>()
                / a.picture.rgba.len() as f64;
        assert!(off < 3.0, "{off}");
        // Edges make it darker, and flat triangles hardly.
        let light = |d: &Drawn| d.picture.rgba.chunks_exact(4).map(|p| f64::from(p[1])).sum::<f64>();
        let (flat, wire) = (drawn(&look(MeshStyle::Flat), &o), drawn(&look(MeshStyle::Wireframe), &o));
        assert!((light(&flat) / light(&b) - 1.0).abs() < 0.03);
        assert!(light(&wire) < 0.95 * light(&flat));
    }
}

#[test]
fn threads_do_not_show() {
    let f = field("x^2 + y^2 + z^2 - 0.64");
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| drawn(&ball(&f), &PictureOptions { ground: true, ..options() }).picture)
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn wrong_things_are_said() {
    let f = field("x^2 + y^2 + z^2 - 0.64");
    let stop = AtomicBool::new(false);
    let mut subject = ball(&f);
    subject.solids[0].opacity = 0.0;
    assert!(draw(&subject, None, &options(), &stop).unwrap_err().to_string().contains("opacity"));
    let mut subject = ball(&f);
    subject.solids[0].clip.bounds.hi[1] = -2.0;
    assert!(draw(&subject, None, &options(), &stop).unwrap_err().to_string().contains("bounds"));
    let mut subject = ball(&f);
    subject.solids[0].clip.planes.push(Plane { normal: [0.0; 3], offset: 0.0 });
    assert!(draw(&subject, None, &options(), &stop).unwrap_err().to_string().contains("planes"));
    let mesh = Mesh::new(vec![[0.0; 3]; 2], vec![[0, 1, 2]]);
    let subject = Subject {
        meshes: vec![MeshLook { mesh: &mesh, style: MeshStyle::Flat, colors: None }],
        ..Subject::default()
    };
    assert!(draw(&subject, None, &options(), &stop).unwrap_err().to_string().contains("faces"));
    assert!(draw(&ball(&f), None, &options(), &AtomicBool::new(true)).is_err());
}
