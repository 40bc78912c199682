//! Pictures that belong together: one camera for all, one animated file.

use std::io::Cursor;
use std::sync::atomic::AtomicBool;

use isoswarm_geometry::{
    Background, GeometryError, Picture, PictureOptions, PointCloud, animate, render_framed,
};

fn options() -> PictureOptions {
    PictureOptions {
        width: 96,
        height: 96,
        azimuth: 0.0,
        elevation: 0.0,
        background: Background::Transparent,
        ground: false,
        margin: 0.0,
        ..PictureOptions::default()
    }
}

/// Mean column and row of what is covered, and how much that is.
fn middle(picture: &Picture) -> ([f64; 2], f64) {
    let (mut sum, mut all) = ([0.0; 2], 0.0);
    for (i, p) in picture.rgba.chunks_exact(4).enumerate() {
        let part = f64::from(p[3]) / 255.0;
        sum[0] += part * (i as f64 % 96.0 + 0.5);
        sum[1] += part * ((i / 96) as f64 + 0.5);
        all += part;
    }
    (sum.map(|s| s / all), all)
}

#[test]
fn a_frame_keeps_the_camera_where_it_is_while_a_disc_moves() {
    let corners: Vec<[f64; 3]> =
        (0..8).map(|i| std::array::from_fn(|k| if i >> k & 1 == 1 { 2.0 } else { -2.0 })).collect();
    let draw = |points: &[[f64; 3]], frame: Option<&[[f64; 3]]>| {
        let (normals, radii) = (vec![[1.0, 0.0, 0.0]; points.len()], vec![0.4; points.len()]);
        let cloud = PointCloud::new(points).with_normals(&normals).with_radii(&radii);
        middle(&render_framed(&cloud, frame, &options(), &AtomicBool::new(false)).unwrap())
    };
    let ([x0, y0], a0) = draw(&[[0.0; 3]], Some(&corners));
    let ([x1, y1], a1) = draw(&[[0.0, 1.0, -1.0]], Some(&corners));
    assert!((x0 - 48.0).abs() < 0.5 && (y0 - 48.0).abs() < 0.5, "{x0} {y0}");
    assert!((x1 - x0 - (y1 - y0)).abs() < 0.5 && x1 - x0 > 15.0, "to the right and down: {x1} {y1}");
    assert!((a1 / a0 - 1.0).abs() < 0.05, "of the same size: {a0} {a1}");
    let (place, alone) = draw(&[[0.0, 1.0, -1.0]], None);
    assert!((place[0] - 48.0).abs() < 0.5 && alone > 8.0 * a0, "without a frame it fills the picture");
    let bad = render_framed(
        &PointCloud::new(&[[0.0; 3]]),
        Some(&[[f64::NAN; 3]]),
        &options(),
        &AtomicBool::new(false),
    );
    assert!(matches!(bad, Err(GeometryError::Option { name: "frame", .. })), "{bad:?}");
}

#[test]
fn an_animation_holds_every_frame() {
    let frames: Vec<Picture> =
        (0u8..3).map(|k| Picture { width: 5, height: 4, rgba: [10 * k, 200, k, 255].repeat(20) }).collect();
    let files: Vec<Vec<u8>> = frames.iter().map(|f| f.to_png().unwrap()).collect();
    let bytes = animate(&files, 0.05).unwrap();
    let mut reader = png::Decoder::new(Cursor::new(&bytes)).read_info().unwrap();
    let control = *reader.info().animation_control().unwrap();
    assert_eq!((control.num_frames, control.num_plays), (3, 0));
    for frame in &frames {
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut data).unwrap();
        let delay = reader.info().frame_control().unwrap();
        assert_eq!((delay.delay_num, delay.delay_den), (50, 1000));
        let rgb: Vec<u8> = frame.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        assert_eq!(data, rgb);
    }
}

#[test]
fn frames_that_do_not_fit_together_are_refused() {
    let picture = |width: u32| Picture { width, height: 1, rgba: vec![255; 4 * width as usize] };
    let one = picture(2).to_png().unwrap();
    let error = |frames: &[Vec<u8>], seconds: f64| animate(frames, seconds).unwrap_err().to_string();
    assert!(error(&[], 0.1).contains("at least one"));
    assert!(error(std::slice::from_ref(&one), 0.0).contains("seconds"));
    assert!(error(&[one.clone(), picture(3).to_png().unwrap()], 0.1).contains("frame 1"));
    assert!(error(&[one, b"no picture".to_vec()], 0.1).contains("PNG"));
}
