//! Simple scenes whose pixels are known, and scenes that must not break anything.

use std::sync::atomic::AtomicBool;

use isoswarm_geometry::{
    Background, Coloring, GeometryError, Picture, PictureOptions, PointCloud, Style, render, render_until,
};

const RED: [f64; 3] = [1.0, 0.0, 0.0];
const GREEN: [f64; 3] = [0.0, 1.0, 0.0];

/// Looking along -x at discs on a transparent background, without ground.
fn plain(style: Style) -> PictureOptions {
    PictureOptions {
        width: 160,
        height: 120,
        azimuth: 0.0,
        elevation: 0.0,
        style,
        disc_scale: Some(1.0),
        body: None,
        background: Background::Transparent,
        ground: false,
        margin: 0.0,
        ..PictureOptions::default()
    }
}

fn pixel(picture: &Picture, x: u32, y: u32) -> [u8; 4] {
    picture.rgba[4 * (y * picture.width + x) as usize..][..4].try_into().unwrap()
}

/// Whether one channel is more than twice another.
fn beats(a: u8, b: u8) -> bool {
    u16::from(a) > 2 * u16::from(b)
}

/// Area covered, in pixels.
fn coverage(picture: &Picture) -> f64 {
    picture.rgba.chunks_exact(4).map(|p| f64::from(p[3]) / 255.0).sum()
}

fn fibonacci(n: usize) -> Vec<[f64; 3]> {
    (0..n)
        .map(|k| {
            let z = 1.0 - (2 * k + 1) as f64 / n as f64;
            let (r, a) = ((1.0 - z * z).sqrt(), 2.399963229728653 * k as f64);
            [r * a.cos(), r * a.sin(), z]
        })
        .collect()
}

#[test]
fn a_disc_that_faces_the_camera_fills_the_circle_it_is_framed_in() {
    // Without a margin the disc touches the top and the bottom: a circle of the picture's height. The camera is placed for
    // a ball of that radius, so that nothing is cut off: the circle is smaller by less than 5 %.
    let points = [[5.0, 6.0, 7.0]];
    let cloud = PointCloud::new(&points).with_normals(&[[2.0, 0.0, 0.0]]).with_radii(&[0.3]);
    let covered = coverage(&render(&cloud, &plain(Style::Discs)).unwrap());
    let circle = std::f64::consts::PI * 60.0 * 60.0;
    assert!((0.90..=1.0).contains(&(covered / circle)), "{covered} of {circle}");
}

#[test]
fn a_tilted_disc_covers_the_cosine_of_its_area() {
    // Two small discs at the ends of a segment fix the frame; the large one between them is turned by 60°.
    let points = [[0.0, -10.0, 0.0], [0.0, 0.0, 0.0], [0.0, 10.0, 0.0]];
    let (s, c) = (60f64.to_radians().sin(), 60f64.to_radians().cos());
    let facing = [[1.0, 0.0, 0.0]; 3];
    let tilted = [[1.0, 0.0, 0.0], [c, 0.0, s], [1.0, 0.0, 0.0]];
    let radii = [0.0, 3.0, 0.0];
    let options = PictureOptions { field_of_view: 0.05, supersampling: 4, ..plain(Style::Discs) };
    let area = |normals: &[[f64; 3]]| {
        let cloud = PointCloud::new(&points).with_normals(normals).with_radii(&radii);
        coverage(&render(&cloud, &options).unwrap())
    };
    let ratio = area(&tilted) / area(&facing);
    assert!((ratio - c).abs() < 0.01, "{ratio}");
}

#[test]
fn the_nearer_disc_hides_the_farther_one_in_either_order() {
    for style in [Style::Discs, Style::Surface] {
        for near_first in [true, false] {
            let mut points = vec![[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]];
            let mut colors = vec![RED, GREEN];
            if !near_first {
                points.reverse();
                colors.reverse();
            }
            let cloud = PointCloud::new(&points)
                .with_normals(&[[1.0, 0.0, 0.0]; 2])
                .with_radii(&[0.5; 2])
                .with_colors(&colors);
            let options = PictureOptions { coloring: Coloring::Given, ..plain(style) };
            let [r, g, b, a] = pixel(&render(&cloud, &options).unwrap(), 80, 60);
            assert!(r > 120 && beats(r, g) && beats(r, b) && a == 255, "{style:?} {:?}", [r, g, b, a]);
        }
    }
}

#[test]
fn the_two_sides_have_two_colours() {
    let points = [[0.0; 3]];
    for (normal, wanted) in [([1.0, 0.0, 0.0], 0), ([-1.0, 0.0, 0.0], 1)] {
        let normals = [normal];
        let cloud = PointCloud::new(&points).with_normals(&normals).with_radii(&[1.0]);
        let options = PictureOptions {
            coloring: Coloring::Uniform { front: RED, back: GREEN },
            ..plain(Style::Surface)
        };
        let seen = pixel(&render(&cloud, &options).unwrap(), 80, 60);
        assert!(beats(seen[wanted], seen[1 - wanted]), "{normal:?} {seen:?}");
    }
}

#[test]
fn azimuth_turns_from_x_to_y_and_elevation_goes_up() {
    // A disc on the +y side of a unit ball of discs is in the middle for azimuth 90°, one on top for elevation 90°.
    let mut points = fibonacci(400);
    points.extend([[0.0, 1.02, 0.0], [0.0, 0.0, 1.02]]);
    let mut colors = vec![[0.5; 3]; 400];
    colors.extend([RED, GREEN]);
    let radii = vec![0.12; 402];
    let cloud = PointCloud::new(&points).with_normals(&points).with_radii(&radii).with_colors(&colors);
    let quarter = std::f64::consts::FRAC_PI_2;
    for (azimuth, elevation, wanted) in [(quarter, 0.0, 0), (0.3, quarter, 1)] {
        let options = PictureOptions { azimuth, elevation, coloring: Coloring::Given, ..plain(Style::Discs) };
        let seen = pixel(&render(&cloud, &options).unwrap(), 80, 60);
        assert!(beats(seen[wanted], seen[1 - wanted]), "{wanted} {seen:?}");
    }
}

#[test]
fn gaps_show_the_body_only_if_there_is_one() {
    let points = fibonacci(300);
    let radii = vec![0.11; 300];
    let cloud = PointCloud::new(&points).with_normals(&points).with_radii(&radii);
    let open = PictureOptions { disc_scale: Some(0.3), ..plain(Style::Discs) };
    let closed = PictureOptions { body: Some([0.0, 1.0, 0.0]), ..open };
    let (open, closed) = (render(&cloud, &open).unwrap(), render(&cloud, &closed).unwrap());
    let disc = coverage(&render(&cloud, &plain(Style::Surface)).unwrap());
    assert!((coverage(&closed) - disc).abs() < 1.0);
    assert!(coverage(&open) < 0.5 * disc);
    let green = closed.rgba.chunks_exact(4).filter(|p| beats(p[1], p[0]) && beats(p[1], p[2])).count() as f64;
    assert!(green > 0.7 * disc, "{green} of {disc}");
}

#[test]
fn a_dense_sphere_is_round_and_has_no_holes() {
    let points = fibonacci(5_000);
    let radii = vec![0.03; 5_000];
    let cloud = PointCloud::new(&points).with_normals(&points).with_radii(&radii);
    let picture = render(&cloud, &plain(Style::Surface)).unwrap();
    let row: Vec<bool> = (0..160).map(|x| pixel(&picture, x, 60)[3] > 127).collect();
    let (first, last) = (row.iter().position(|c| *c).unwrap(), row.iter().rposition(|c| *c).unwrap());
    assert!(row[first..=last].iter().all(|c| *c));
    let circle = std::f64::consts::PI / 4.0 * ((last - first + 1) as f64).powi(2);
    assert!((coverage(&picture) / circle - 1.0).abs() < 0.03);
}

#[test]
fn hollows_and_shadows_are_darker() {
    // A plate under a ball: its middle sees less of the sky than its corner.
    let mut points: Vec<[f64; 3]> = Vec::new();
    let mut normals = Vec::new();
    for i in -20i32..=20 {
        for j in -20i32..=20 {
            points.push([0.1 * f64::from(i), 0.1 * f64::from(j), 0.0]);
            normals.push([0.0, 0.0, 1.0]);
        }
    }
    let middle = 20 * 41 + 20;
    let ball = fibonacci(800);
    points.extend(ball.iter().map(|p| [0.6 * p[0], 0.6 * p[1], 0.75 + 0.6 * p[2]]));
    normals.extend(ball);
    let mut colors = vec![[0.5; 3]; points.len()];
    // Marked so that they can be found: the plate's middle, and a place in the open.
    (colors[middle], colors[2]) = ([0.5, 0.0, 0.0], [0.0, 0.5, 0.0]);
    let radii = vec![0.07; points.len()];
    let cloud = PointCloud::new(&points).with_normals(&normals).with_radii(&radii).with_colors(&colors);
    let options = PictureOptions {
        coloring: Coloring::Given,
        elevation: 0.3,
        shadow: 0.0,
        width: 400,
        height: 300,
        ..plain(Style::Discs)
    };
    let brightest = |options: &PictureOptions, k: usize| {
        let picture = render(&cloud, options).unwrap();
        picture
            .rgba
            .chunks_exact(4)
            .filter(|p| beats(p[k], p[1 - k]) && p[3] == 255)
            .map(|p| p[k])
            .max()
            .unwrap()
    };
    let flat = PictureOptions { ambient_occlusion: 0.0, ..options };
    let loss = |k| i32::from(brightest(&flat, k)) - i32::from(brightest(&options, k));
    // The ball hides 64 % of the middle's sky, which is about a quarter of all the light there.
    let (hollow, open) = (loss(0), loss(1));
    assert!(hollow > 12 && open.abs() < 4, "{hollow} {open}");
}

#[test]
fn the_picture_does_not_depend_on_the_number_of_threads() {
    let points = fibonacci(3_000);
    let radii = vec![0.04; 3_000];
    let cloud = PointCloud::new(&points).with_normals(&points).with_radii(&radii);
    for style in [Style::Discs, Style::Surface] {
        let options = PictureOptions { width: 203, height: 151, style, ..PictureOptions::default() };
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| render(&cloud, &options).unwrap())
        };
        let one = with(1);
        assert_eq!(one, with(2));
        assert_eq!(one, with(7));
    }
}

#[test]
fn the_picture_does_not_depend_on_scale_or_place() {
    let points = fibonacci(500);
    let picture = |scale: f64, shift: f64| {
        let moved: Vec<[f64; 3]> = points.iter().map(|p| p.map(|v| scale * (v + shift))).collect();
        let radii = vec![0.1 * scale; points.len()];
        let cloud = PointCloud::new(&moved).with_normals(&points).with_radii(&radii);
        render(&cloud, &PictureOptions { width: 120, height: 90, ..PictureOptions::default() }).unwrap()
    };
    let usual = picture(1.0, 0.0);
    // Powers of two scale without rounding; the others may differ by rounding.
    for scale in [2f64.powi(-900), 2f64.powi(900)] {
        assert_eq!(usual, picture(scale, 0.0));
    }
    for (scale, shift) in [(1e-300, 0.0), (1e300, 0.0), (3.7, 1e6)] {
        let other = picture(scale, shift);
        let worst = usual.rgba.iter().zip(&other.rgba).filter(|(a, b)| a.abs_diff(**b) > 8).count();
        assert!(worst * 1000 < usual.rgba.len(), "{worst} bytes differ at {scale} {shift}");
    }
}

#[test]
fn no_points_give_the_background() {
    for style in [Style::Discs, Style::Surface] {
        let options = PictureOptions { width: 20, height: 10, style, ..PictureOptions::default() };
        let picture = render(&PointCloud::new(&[]), &options).unwrap();
        assert_eq!(picture.rgba.len(), 20 * 10 * 4);
        assert!(picture.rgba.chunks_exact(4).all(|p| p.iter().all(|c| *c > 220) && p[3] == 255));
        let clear = PictureOptions { background: Background::Transparent, ..options };
        assert!(render(&PointCloud::new(&[]), &clear).unwrap().rgba.chunks_exact(4).all(|p| p[3] == 0));
    }
}

#[test]
fn odd_clouds_do_not_panic() {
    let huge = [[f64::MAX; 3], [-f64::MAX; 3], [0.0; 3]];
    let tiny = [[5e-324, 0.0, 0.0], [0.0; 3]];
    let same = [[1.0, 2.0, 3.0]; 5];
    let normals = [[0.0; 3], [f64::MAX; 3], [5e-324, 0.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]];
    let options = PictureOptions { width: 33, height: 65, ..PictureOptions::default() };
    for points in [&huge[..], &tiny, &same, &same[..1]] {
        let n = points.len();
        for style in [Style::Discs, Style::Surface] {
            for elevation in [-1.5, std::f64::consts::FRAC_PI_2] {
                let options = PictureOptions { style, elevation, ..options };
                render(&PointCloud::new(points), &options).unwrap();
                let cloud = PointCloud::new(points).with_normals(&normals[..n]);
                render(&cloud, &options).unwrap();
                render(&cloud.with_areas(&[f64::MAX; 5][..n]), &options).unwrap();
                for radius in [0.0, 5e-324, f64::MAX] {
                    render(&cloud.with_radii(&[radius; 5][..n]), &options).unwrap();
                }
            }
        }
    }
}

#[test]
fn points_without_normals_are_balls_that_can_be_seen() {
    let points = fibonacci(300);
    let picture = render(&PointCloud::new(&points), &plain(Style::Surface)).unwrap();
    assert!(coverage(&picture) > 0.5 * std::f64::consts::PI * 55.0 * 55.0);
}

#[test]
fn every_colouring_works_or_names_the_column_it_lacks() {
    let points = fibonacci(50);
    let cloud = PointCloud::new(&points).with_normals(&points);
    let options = |name: &str| PictureOptions { coloring: name.parse().unwrap(), ..plain(Style::Surface) };
    for (name, column) in [("given", "colors"), ("curvature", "curvatures")] {
        let error = render(&cloud, &options(name)).unwrap_err();
        assert!(matches!(error, GeometryError::MissingColumn { column: c, .. } if c == column), "{error}");
    }
    let curvatures: Vec<[f64; 2]> =
        points.iter().map(|p| if p[2] > 0.0 { [1.0, 1.0] } else { [-1.0, f64::NAN] }).collect();
    render(&cloud.with_curvatures(&curvatures), &options("curvature")).unwrap();
    render(&cloud, &options("height")).unwrap();
    render(&cloud, &options("uniform")).unwrap();
    assert!("shiny".parse::<Coloring>().unwrap_err().to_string().contains("`height` or `normal`"));
    assert!("shiny".parse::<Style>().unwrap_err().to_string().contains("`points` or `surface`"));
}

#[test]
fn options_out_of_range_are_named() {
    let usual = PictureOptions::default();
    let cases = [
        (PictureOptions { width: 0, ..usual }, "width"),
        (PictureOptions { height: 16_385, ..usual }, "height"),
        (PictureOptions { azimuth: f64::NAN, ..usual }, "azimuth"),
        (PictureOptions { elevation: 90.0, ..usual }, "elevation"),
        (PictureOptions { up: [0.0; 3], ..usual }, "up"),
        (PictureOptions { field_of_view: 60.0, ..usual }, "field_of_view"),
        (PictureOptions { margin: 1.0, ..usual }, "margin"),
        (PictureOptions { disc_scale: Some(0.0), ..usual }, "disc_scale"),
        (PictureOptions { outline: -0.1, ..usual }, "outline"),
        (PictureOptions { ambient_occlusion: 2.0, ..usual }, "ambient_occlusion"),
        (PictureOptions { shadow: f64::INFINITY, ..usual }, "shadow"),
        (PictureOptions { supersampling: 9, ..usual }, "supersampling"),
        (PictureOptions { body: Some([2.0; 3]), ..usual }, "body"),
    ];
    for (options, wanted) in cases {
        let error = render(&PointCloud::new(&[]), &options).unwrap_err();
        assert!(matches!(error, GeometryError::Option { name, .. } if name == wanted), "{error}");
    }
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    let points = [[0.0, f64::INFINITY, 0.0]];
    let error = render(&PointCloud::new(&points), &PictureOptions::default()).unwrap_err();
    assert!(matches!(error, GeometryError::NotFinite { column: "points", row: 0, .. }));
}

#[test]
fn a_picture_can_be_cancelled() {
    let points = fibonacci(10);
    let stop = AtomicBool::new(true);
    let result = render_until(&PointCloud::new(&points), &PictureOptions::default(), &stop);
    assert!(matches!(result, Err(GeometryError::Cancelled)));
}

#[test]
fn png_holds_the_pixels() {
    let points = fibonacci(100);
    let cloud = PointCloud::new(&points).with_normals(&points);
    let folder = tempfile::tempdir().unwrap();
    for background in [Background::default(), Background::Transparent] {
        let picture = render(
            &cloud,
            &PictureOptions { width: 61, height: 40, background, ..PictureOptions::default() },
        )
        .unwrap();
        let path = folder.path().join("a.png");
        picture.save(&path).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.width, info.height), (61, 40));
        let wanted: Vec<u8> = match info.color_type {
            png::ColorType::Rgba => picture.rgba.clone(),
            _ => picture.rgba.chunks_exact(4).flat_map(|p| p[..3].to_vec()).collect(),
        };
        assert_eq!(info.color_type == png::ColorType::Rgba, background == Background::Transparent);
        assert_eq!(bytes, wanted);
    }
    let error = render(&cloud, &plain(Style::Discs)).unwrap().save("a.jpg").unwrap_err();
    assert!(error.to_string().contains("expected an ending out of .png"), "{error}");
}
