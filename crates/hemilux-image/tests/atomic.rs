//! Files are the old one or the whole new one, whatever happens.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use hemilux_image::{Image, Reason, atomic, write};

/// A directory of its own for each test, removed at its end.
struct Directory(PathBuf);

impl Directory {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("hemilux-image-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(&self.0).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn new_bytes_replace_old_ones_and_nothing_else_stays() {
    let directory = Directory::new("replace");
    let path = directory.0.join("a.bin");
    for content in ["one", "longer than one", ""] {
        atomic::write::<io::Error>(&path, |w| w.write_all(content.as_bytes())).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), content);
        assert_eq!(directory.names(), ["a.bin"]);
    }
}

#[test]
fn an_error_leaves_the_old_file_and_no_other() {
    let directory = Directory::new("error");
    let path = directory.0.join("a.bin");
    fs::write(&path, "old").unwrap();
    let failed = atomic::write(&path, |w| {
        w.write_all(&[7; 200_000])?;
        Err(io::Error::other("stop"))
    });
    assert_eq!(failed.unwrap_err().to_string(), "stop");
    assert_eq!(
        (fs::read_to_string(&path).unwrap().as_str(), directory.names()),
        ("old", vec!["a.bin".to_owned()])
    );
    // A picture that its format cannot hold fails after the file was opened.
    let picture = directory.0.join("a.png");
    fs::write(&picture, "old").unwrap();
    assert!(write(&picture, &Image::new(2, 2)).is_err());
    assert_eq!(fs::read_to_string(&picture).unwrap(), "old");
    assert_eq!(directory.names(), ["a.bin", "a.png"]);
}

#[test]
fn a_panic_in_the_body_leaves_no_file() {
    let directory = Directory::new("panic");
    let path = directory.0.join("a.bin");
    let body = || atomic::write::<io::Error>(&path, |_| panic!("on purpose"));
    assert!(std::panic::catch_unwind(body).is_err());
    assert!(directory.names().is_empty());
}

#[test]
fn places_that_cannot_be_written_are_errors() {
    let directory = Directory::new("places");
    let image = Image::from_rgb(1, 1, &[[1.0; 3]]);
    let missing = directory.0.join("no/such/place.exr");
    let error = write(&missing, &image).unwrap_err();
    assert!(error.to_string().contains("place.exr") && matches!(error.reason, Reason::Io(_)));
    let folder = directory.0.join("folder.exr");
    fs::create_dir(&folder).unwrap();
    assert!(write(&folder, &image).is_err());
    assert!(atomic::write::<io::Error>(Path::new(""), |_| Ok(())).is_err());
    let locked = directory.0.join("locked.pfm");
    fs::write(&locked, "old").unwrap();
    let mut permissions = fs::metadata(&locked).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&locked, permissions.clone()).unwrap();
    let error = write(&locked, &image).unwrap_err();
    assert!(error.to_string().contains("read-only"), "{error}");
    assert_eq!(fs::read_to_string(&locked).unwrap(), "old");
    assert_eq!(directory.names(), ["folder.exr", "locked.pfm"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    let image = Image::from_rgb(64, 64, &[[1.0, 2.0, 3.0]; 4096]);
    let failed = atomic::write(Path::new("/dev/full"), |w| hemilux_image::pfm::encode(&image, w));
    match failed.unwrap_err().reason {
        Reason::Io(e) => assert_eq!(e.kind(), io::ErrorKind::StorageFull),
        other => panic!("{other}"),
    }
    assert!(atomic::write::<io::Error>(Path::new("/dev/null"), |w| w.write_all(b"gone")).is_ok());
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_permissions_kept() {
    use std::os::unix::fs::PermissionsExt;
    let directory = Directory::new("links");
    let (real, link) = (directory.0.join("real.bin"), directory.0.join("link.bin"));
    fs::write(&real, "old").unwrap();
    fs::set_permissions(&real, fs::Permissions::from_mode(0o640)).unwrap();
    std::os::unix::fs::symlink("real.bin", &link).unwrap();
    atomic::write::<io::Error>(&link, |w| w.write_all(b"new")).unwrap();
    assert_eq!(fs::read_to_string(&real).unwrap(), "new");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::metadata(&real).unwrap().permissions().mode() & 0o777, 0o640);
}
