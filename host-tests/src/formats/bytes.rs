//! A file's content, unpacked where it is gzip.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, bail};

/// What a file holds.
#[derive(Debug, Clone, Default)]
pub struct Content {
    /// The bytes, unpacked.
    pub bytes: Vec<u8>,
    /// Why they end before they should.
    pub cut: Option<String>,
}

/// Reads `path`; gzip is told by its first two bytes. Empty is an error, a cut archive gives what came before the cut.
pub fn load(path: &Path) -> Result<Content> {
    let name = || path.display().to_string();
    let mut raw = Vec::new();
    File::open(path)
        .and_then(|mut file| file.read_to_end(&mut raw))
        .with_context(name)?;
    if raw.is_empty() {
        bail!("{}: the file is empty", path.display());
    }
    if !raw.starts_with(&[0x1f, 0x8b]) {
        return Ok(Content {
            bytes: raw,
            cut: None,
        });
    }
    let mut content = Content::default();
    if let Err(error) = flate2::read::MultiGzDecoder::new(&raw[..]).read_to_end(&mut content.bytes)
    {
        let good = content.bytes.len();
        if good == 0 {
            bail!(
                "{}: not a gzip archive that can be read: {error}",
                path.display()
            );
        }
        content.cut = Some(format!(
            "the archive breaks off after {good} unpacked bytes: {error}"
        ));
    }
    Ok(content)
}
