//! Files that are either the old one or the whole new one.
//!
//! The bytes go to a temporary file beside the target, are flushed and synchronised, and then renamed over it. On any
//! error the temporary file is removed and the old file is untouched.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

static COUNTER: AtomicU64 = AtomicU64::new(0);

/// Writes `path` through `body`, all or nothing.
///
/// Links are followed, so that the file they name is replaced and not the link. An existing file keeps its permissions.
/// What is not a regular file (`/dev/null`, a pipe) is written to directly.
///
/// # Errors
/// Whatever `body` returns, or an I/O error (no such directory, no permission, read-only target, disk full). The
/// temporary file is gone then, and the old file as it was.
pub fn write<E: From<io::Error>>(
    path: &Path,
    body: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), E> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let old = fs::metadata(&target).ok();
    if old.as_ref().is_some_and(fs::Metadata::is_dir) {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory").into());
    }
    if old.as_ref().is_some_and(|m| !m.is_file()) {
        return finish(OpenOptions::new().write(true).open(&target)?, body, false);
    }
    if old.as_ref().is_some_and(|m| m.permissions().readonly()) {
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file is read-only").into());
    }
    let (file, temporary) = create_beside(&target)?;
    let guard = Remove(Some(temporary));
    finish(file, body, true)?;
    guard.rename(&target, old.map(|m| m.permissions()))?;
    Ok(())
}

fn finish<E: From<io::Error>>(
    file: File,
    body: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
    sync: bool,
) -> Result<(), E> {
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    // An error of `body` must not be followed by another attempt to write when the buffer is dropped.
    let result = body(&mut writer).and_then(|()| writer.flush().map_err(E::from));
    let (file, _) = writer.into_parts();
    result?;
    if sync {
        file.sync_all()?;
    }
    Ok(())
}

/// A new file in the directory of `target`, with a name nobody uses.
fn create_beside(target: &Path) -> io::Result<(File, PathBuf)> {
    let name =
        target.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "no file name"))?;
    loop {
        let count = COUNTER.fetch_add(1, Ordering::Relaxed);
        let mut temporary = std::ffi::OsString::from(".");
        // The name may be cut: some file systems stop at 255 bytes.
        temporary.push(name.to_string_lossy().chars().take(40).collect::<String>());
        temporary.push(format!(".{}-{count}.tmp", std::process::id()));
        let path = target.with_file_name(temporary);
        match OpenOptions::new().write(true).read(true).create_new(true).open(&path) {
            Ok(file) => return Ok((file, path)),
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
}

/// Removes the temporary file unless it was renamed; also when the body panics.
struct Remove(Option<PathBuf>);

impl Remove {
    fn rename(mut self, target: &Path, permissions: Option<fs::Permissions>) -> io::Result<()> {
        if let Some(temporary) = &self.0 {
            if let Some(permissions) = permissions {
                fs::set_permissions(temporary, permissions)?;
            }
            fs::rename(temporary, target)?;
            self.0 = None;
            sync_directory(target);
        }
        Ok(())
    }
}

impl Drop for Remove {
    fn drop(&mut self) {
        if let Some(path) = &self.0 {
            let _ = fs::remove_file(path);
        }
    }
}

/// Makes the rename itself durable where directories can be synchronised; the file is complete either way.
fn sync_directory(target: &Path) {
    let parent = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if let Ok(directory) = File::open(parent) {
        let _ = directory.sync_all();
    }
}
