//! What is written reads back, to the last bit.

use std::collections::HashMap;
use std::fs;
use std::io::Read;

use isoswarm_geometry::{FileFormat, GeometryError, PointCloud, save};
use proptest::prelude::*;

/// Columns that own their numbers.
#[derive(Debug, Clone)]
struct Cloud {
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    radii: Vec<f64>,
    areas: Vec<f64>,
    curvatures: Vec<[f64; 2]>,
}

impl Cloud {
    fn borrowed(&self) -> PointCloud<'_> {
        PointCloud::new(&self.points)
            .with_normals(&self.normals)
            .with_radii(&self.radii)
            .with_areas(&self.areas)
            .with_curvatures(&self.curvatures)
    }

    /// The numbers row by row, in the order of the PLY properties.
    fn rows(&self) -> Vec<Vec<f64>> {
        (0..self.points.len())
            .map(|i| {
                let mut row = self.points[i].to_vec();
                row.extend(self.normals[i]);
                row.extend([self.radii[i], self.areas[i]]);
                row.extend(self.curvatures[i]);
                row
            })
            .collect()
    }
}

const NAMES: [&str; 10] = ["x", "y", "z", "nx", "ny", "nz", "radius", "area", "k1", "k2"];

fn cloud() -> impl Strategy<Value = Cloud> {
    let any = prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO;
    let row = (
        prop::array::uniform3(any),
        prop::array::uniform3(any),
        any.prop_map(f64::abs),
        any.prop_map(f64::abs),
        prop::array::uniform2(any),
    );
    prop::collection::vec(row, 0..40).prop_map(|rows| Cloud {
        points: rows.iter().map(|r| r.0).collect(),
        normals: rows.iter().map(|r| r.1).collect(),
        radii: rows.iter().map(|r| r.2).collect(),
        areas: rows.iter().map(|r| r.3).collect(),
        curvatures: rows.iter().map(|r| r.4).collect(),
    })
}

fn bytes(format: FileFormat, cloud: &PointCloud<'_>) -> Vec<u8> {
    let mut out = Vec::new();
    format.write(cloud, &mut out).unwrap();
    out
}

/// Bits, so that -0.0 differs from 0.0 and NaN equals NaN.
fn bits(rows: &[Vec<f64>]) -> Vec<Vec<u64>> {
    rows.iter().map(|r| r.iter().map(|v| v.to_bits()).collect()).collect()
}

fn doubles(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
}

/// Property names and rows of a PLY file that holds nothing but doubles.
fn read_ply(bytes: &[u8]) -> (Vec<String>, Vec<Vec<f64>>) {
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = std::str::from_utf8(&bytes[..at]).unwrap();
    assert!(header.starts_with("ply\nformat binary_little_endian 1.0\n"));
    let names: Vec<String> =
        header.lines().filter_map(|l| l.strip_prefix("property double ")).map(str::to_owned).collect();
    let count: usize =
        header.lines().find_map(|l| l.strip_prefix("element vertex ")).unwrap().parse().unwrap();
    let numbers = doubles(&bytes[at..]);
    assert_eq!(bytes.len() - at, 8 * count * names.len());
    (names.clone(), numbers.chunks_exact(names.len()).map(<[f64]>::to_vec).collect())
}

/// Shape text and numbers of every array of an NPZ file.
fn read_npz(bytes: Vec<u8>) -> HashMap<String, (String, Vec<f64>)> {
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).unwrap();
    (0..archive.len())
        .map(|i| {
            let mut file = archive.by_index(i).unwrap();
            assert_eq!(file.compression(), zip::CompressionMethod::Stored);
            let mut all = Vec::new();
            file.read_to_end(&mut all).unwrap();
            assert_eq!(&all[..8], b"\x93NUMPY\x01\x00");
            let data = 10 + u16::from_le_bytes([all[8], all[9]]) as usize;
            assert_eq!(data % 64, 0);
            let header = std::str::from_utf8(&all[10..data]).unwrap().to_owned();
            assert!(
                header.starts_with("{'descr': '<f8', 'fortran_order': False, ") && header.ends_with('\n')
            );
            let shape = header[header.find('(').unwrap()..=header.find(')').unwrap()].to_owned();
            (file.name().unwrap().into_owned(), (shape, doubles(&all[data..])))
        })
        .collect()
}

proptest! {
    #[test]
    fn ply_round_trip(cloud in cloud()) {
        let (names, rows) = read_ply(&bytes(FileFormat::Ply, &cloud.borrowed()));
        prop_assert_eq!(names, NAMES);
        prop_assert_eq!(bits(&rows), bits(&cloud.rows()));
    }

    #[test]
    fn csv_round_trip(cloud in cloud()) {
        let text = String::from_utf8(bytes(FileFormat::Csv, &cloud.borrowed())).unwrap();
        let mut lines = text.lines();
        prop_assert_eq!(lines.next().unwrap(), NAMES.join(","));
        let rows: Vec<Vec<f64>> = lines.map(|l| l.split(',').map(|v| v.parse().unwrap()).collect()).collect();
        prop_assert_eq!(bits(&rows), bits(&cloud.rows()));
    }

    #[test]
    fn obj_round_trip(cloud in cloud()) {
        let text = String::from_utf8(bytes(FileFormat::Obj, &cloud.borrowed())).unwrap();
        let read = |tag: &str| -> Vec<Vec<f64>> {
            text.lines()
                .filter_map(|l| l.strip_prefix(tag))
                .map(|l| l.split(' ').map(|v| v.parse().unwrap()).collect())
                .collect()
        };
        let rows = |v: &[[f64; 3]]| bits(&v.iter().map(|v| v.to_vec()).collect::<Vec<_>>());
        prop_assert_eq!(bits(&read("v ")), rows(&cloud.points));
        prop_assert_eq!(bits(&read("vn ")), rows(&cloud.normals));
    }

    #[test]
    fn npz_round_trip(cloud in cloud()) {
        let arrays = read_npz(bytes(FileFormat::Npz, &cloud.borrowed()));
        let n = cloud.points.len();
        for (name, shape, values) in [
            ("points", format!("({n}, 3)"), cloud.points.as_flattened()),
            ("normals", format!("({n}, 3)"), cloud.normals.as_flattened()),
            ("radii", format!("({n},)"), &cloud.radii),
            ("areas", format!("({n},)"), &cloud.areas),
            ("curvatures", format!("({n}, 2)"), cloud.curvatures.as_flattened()),
        ] {
            let (got_shape, got) = &arrays[&format!("{name}.npy")];
            prop_assert_eq!(got_shape, &shape);
            prop_assert_eq!(bits(std::slice::from_ref(got)), bits(&[values.to_vec()]));
        }
        prop_assert_eq!(arrays.len(), 5);
    }
}

#[test]
fn columns_that_are_missing_are_left_out() {
    let points = [[1.0, 2.0, 3.0]];
    let bare = PointCloud::new(&points);
    assert_eq!(read_ply(&bytes(FileFormat::Ply, &bare)).0, ["x", "y", "z"]);
    assert_eq!(String::from_utf8(bytes(FileFormat::Csv, &bare)).unwrap(), "x,y,z\n1.0,2.0,3.0\n");
    assert_eq!(read_npz(bytes(FileFormat::Npz, &bare)).len(), 1);
    let some = bare.with_areas(&[0.5]);
    assert_eq!(String::from_utf8(bytes(FileFormat::Csv, &some)).unwrap(), "x,y,z,area\n1.0,2.0,3.0,0.5\n");
}

#[test]
fn colours_follow_the_numbers_of_a_ply_row() {
    let points = [[1.0, 2.0, 3.0]];
    let file = bytes(FileFormat::Ply, &PointCloud::new(&points).with_colors(&[[0.0, 0.5, 1.0]]));
    assert_eq!(file[file.len() - 3..], [0, 128, 255]);
}

#[test]
fn no_points_make_a_file_without_rows() {
    let folder = tempfile::tempdir().unwrap();
    for ending in FileFormat::ENDINGS {
        let path = folder.path().join(format!("none.{ending}"));
        save(&path, &PointCloud::new(&[])).unwrap();
    }
    assert!(read_ply(&fs::read(folder.path().join("none.ply")).unwrap()).1.is_empty());
    assert_eq!(read_npz(fs::read(folder.path().join("none.npz")).unwrap())["points.npy"].0, "(0, 3)");
}

#[test]
fn the_ending_chooses_the_format_in_either_case() {
    let folder = tempfile::tempdir().unwrap();
    let points = [[1.0, 2.0, 3.0]];
    for (name, start) in
        [("a.PLY", &b"ply\n"[..]), ("a.Csv", b"x,y,z"), ("a.obj", b"# iso"), ("a.npz", b"PK")]
    {
        save(folder.path().join(name), &PointCloud::new(&points)).unwrap();
        assert!(fs::read(folder.path().join(name)).unwrap().starts_with(start), "{name}");
    }
}

#[test]
fn an_unknown_ending_lists_the_known_ones() {
    for name in ["a.stl", "a", "a."] {
        let error = save(name, &PointCloud::new(&[])).unwrap_err();
        assert!(matches!(error, GeometryError::UnknownFormat { .. }));
        assert!(error.to_string().contains(".ply, .obj, .csv, .npz"), "{error}");
    }
}

#[test]
fn bad_columns_are_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    let points = [[0.0; 3], [1.0, f64::NAN, 0.0]];
    let good = [[0.0; 3], [1.0; 3]];
    let cases = [
        (PointCloud::new(&points), "points: expected finite numbers, but row 1 holds NaN"),
        (PointCloud::new(&good).with_normals(&points), "normals: expected finite"),
        (
            PointCloud::new(&good).with_radii(&[0.1, f64::INFINITY]),
            "radii: expected finite numbers, but row 1 holds inf",
        ),
        (
            PointCloud::new(&good).with_radii(&[-0.1, 0.1]),
            "radii: expected numbers that are not negative, but row 0",
        ),
        (PointCloud::new(&good).with_areas(&[0.1]), "areas: expected 2 rows, one for each point, but got 1"),
        (PointCloud::new(&good).with_colors(&[[0.0; 3], [255.0; 3]]), "divide 8-bit colours by 255"),
    ];
    for (cloud, message) in cases {
        let error = save(&path, &cloud).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
        assert!(!path.exists());
    }
}

#[test]
fn curvatures_may_be_unknown() {
    let points = [[0.0; 3]];
    let cloud = PointCloud::new(&points).with_curvatures(&[[f64::NAN, f64::INFINITY]]);
    cloud.check().unwrap();
    let rows = read_ply(&bytes(FileFormat::Ply, &cloud)).1;
    assert!(rows[0][3].is_nan() && rows[0][4] == f64::INFINITY);
}
