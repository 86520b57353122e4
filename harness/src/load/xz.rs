//! Files, compressed or not.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use super::LoadError;

/// The first bytes of every xz file.
const MAGIC: &[u8] = b"\xfd7zXZ\0";

/// The bytes of `path`, or of `path` with `.xz` added when `path` does not exist; unpacked.
pub fn read(path: &Path) -> Result<Vec<u8>, LoadError> {
    let bytes = match fs::read(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let mut packed = path.as_os_str().to_owned();
            packed.push(".xz");
            fs::read(packed).map_err(|_| {
                LoadError::new(path, None, "no such file (and none with `.xz` added)")
            })?
        }
        other => other.map_err(|e| LoadError::new(path, None, format!("cannot be read: {e}")))?,
    };
    if !bytes.starts_with(MAGIC) {
        return Ok(bytes);
    }
    let mut unpacked = Vec::new();
    lzma_rs::xz_decompress(&mut bytes.as_slice(), &mut unpacked)
        .map_err(|e| LoadError::new(path, None, format!("broken xz data: {e:?}")))?;
    Ok(unpacked)
}
