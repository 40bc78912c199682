//! All or nothing: a file is written beside its place, synced, then moved there.

#[cfg(not(target_arch = "wasm32"))]
use std::fs;
#[cfg(not(target_arch = "wasm32"))]
use std::io::BufWriter;
use std::io::{self, Write};
use std::path::Path;
#[cfg(not(target_arch = "wasm32"))]
use std::path::PathBuf;

use crate::GeometryError;

/// Writes a file so that a reader sees the old one or the new one, never a part: a temporary file in the same folder,
/// synced to the disk, then renamed. On any error, and if `write` panics, the temporary file is removed and an existing
/// file stays as it was.
///
/// A symbolic link is followed and kept. What is not a regular file, such as a pipe or `/dev/stdout`, is written to
/// directly. An existing file's permissions are kept.
///
/// # Errors
/// [`GeometryError::Io`] with the path, the cause and what to do.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), GeometryError> {
    try_write(path, write).map_err(|source| GeometryError::io(path, source))
}

/// There are no files in a browser.
#[cfg(target_arch = "wasm32")]
fn try_write(_: &Path, _: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(not(target_arch = "wasm32"))]
fn try_write(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let earlier = fs::metadata(&target).ok();
    if let Some(kind) = earlier.as_ref().map(fs::Metadata::file_type) {
        if kind.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        if !kind.is_file() {
            let mut out = BufWriter::new(fs::OpenOptions::new().write(true).open(&target)?);
            write(&mut out)?;
            return out.flush();
        }
    }

    let folder = folder_of(&target);
    let mut builder = tempfile::Builder::new();
    builder.prefix(".isoswarm-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666)); // reduced by the umask, as for any new file
    }
    let mut part = builder.tempfile_in(&folder)?;
    {
        let mut out = BufWriter::with_capacity(1 << 16, part.as_file_mut());
        write(&mut out)?;
        out.flush()?;
    }
    if let Some(earlier) = earlier {
        part.as_file().set_permissions(earlier.permissions())?;
    }
    part.as_file().sync_all()?;
    part.persist(&target).map_err(|failed| failed.error)?;
    // The rename itself is safe only once the folder is on the disk; file systems that cannot sync a folder say so.
    #[cfg(unix)]
    if let Ok(folder) = fs::File::open(&folder) {
        let _ = folder.sync_all();
    }
    Ok(())
}

#[cfg(not(target_arch = "wasm32"))]
fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_full_disk_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        fs::write(&path, "old").unwrap();
        let error = write_atomically(&path, |out| {
            out.write_all(&[0; 100_000])?;
            Err(io::ErrorKind::StorageFull.into())
        })
        .unwrap_err();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["a.ply"]);
        let text = error.to_string();
        assert!(text.contains("a.ply") && text.contains("free some space"), "{text}");
    }

    #[test]
    fn a_panic_in_the_writer_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        let result = std::panic::catch_unwind(|| write_atomically(&path, |_| panic!("boom")));
        assert!(result.is_err());
        assert!(names(folder.path()).is_empty());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_that_is_full_says_so_and_stays_a_device() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("full.csv");
        std::os::unix::fs::symlink("/dev/full", &path).unwrap();
        let error = write_atomically(&path, |out| out.write_all(b"x")).unwrap_err();
        assert!(
            matches!(&error, GeometryError::Io { source, .. } if source.kind() == io::ErrorKind::StorageFull)
        );
        assert_eq!(names(folder.path()), ["full.csv"]);
        assert!(!fs::metadata("/dev/full").unwrap().is_file());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_permissions_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real.csv"), folder.path().join("link.csv"));
        fs::write(&real, "old").unwrap();
        fs::set_permissions(&real, fs::Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_atomically(&link, |out| out.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&real).unwrap(), "new");
        assert_eq!(fs::metadata(&real).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(names(folder.path()), ["link.csv", "real.csv"]);
    }

    #[test]
    fn a_missing_folder_is_named_with_advice() {
        let folder = tempfile::tempdir().unwrap();
        let error = write_atomically(&folder.path().join("no/such/a.csv"), |_| Ok(())).unwrap_err();
        assert!(error.to_string().contains("create the folder first"), "{error}");
        let error = write_atomically(folder.path(), |_| Ok(())).unwrap_err();
        assert!(error.to_string().contains("add a file name"), "{error}");
    }
}
