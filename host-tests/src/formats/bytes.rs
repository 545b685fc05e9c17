//! A file's content, unpacked where it is gzip or zstd.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

/// What a file holds.
#[derive(Debug, Clone, Default)]
pub struct Content {
    /// The bytes, unpacked.
    pub bytes: Vec<u8>,
    /// Why they end before they should.
    pub cut: Option<String>,
}

/// How a gzip archive starts.
const GZIP: [u8; 2] = [0x1f, 0x8b];
/// How a zstd frame starts.
pub const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Most bytes of a file that is not packed; of a device or a pipe too, which may have no end.
const MAX_FILE: u64 = 2 << 30;
/// An archive may unpack to this much, and to [`MAX_RATIO`] times its size beyond it: logs pack by 5 to 20.
const MAX_UNPACKED: u64 = 64 << 20;
const MAX_RATIO: u64 = 100;

/// Reads `path`; gzip and zstd are told by their first bytes. Empty is an error, a cut archive gives what came before
/// the cut. Memory is bounded: what is larger than any log is an error.
pub fn load(path: &Path) -> Result<Content> {
    load_at_most(path, MAX_FILE)
}

/// [`load`] for files that have at most so many bytes before they are unpacked.
pub fn load_at_most(path: &Path, most: u64) -> Result<Content> {
    let name = path.display();
    let mut raw = Vec::new();
    File::open(path)
        .and_then(|file| file.take(most + 1).read_to_end(&mut raw))
        .with_context(|| name.to_string())?;
    ensure!(
        raw.len() as u64 <= most,
        "{name}: more than {most} bytes, which no such file has"
    );
    unpack(&name.to_string(), raw)
}

/// [`load`] for the bytes of a file that is called so.
pub fn unpack(name: &str, raw: Vec<u8>) -> Result<Content> {
    ensure!(!raw.is_empty(), "{name}: the file is empty");
    let mut content = Content::default();
    let most = MAX_UNPACKED + MAX_RATIO * raw.len() as u64;
    let (kind, unpacked) = if raw.starts_with(&GZIP) {
        let archive = flate2::read::MultiGzDecoder::new(&raw[..]);
        (
            "gzip",
            archive.take(most + 1).read_to_end(&mut content.bytes),
        )
    } else if raw.starts_with(&ZSTD) {
        let archive = unzstd(&raw).with_context(|| name.to_owned())?;
        (
            "zstd",
            archive.take(most + 1).read_to_end(&mut content.bytes),
        )
    } else {
        content.bytes = raw;
        return Ok(content);
    };
    let good = content.bytes.len();
    ensure!(
        good as u64 <= most,
        "{name}: unpacks to more than {} MB, over {MAX_RATIO} times its size: not a recording",
        most >> 20
    );
    if let Err(error) = unpacked {
        if good == 0 {
            bail!("{name}: not a {kind} archive that can be read: {error}");
        }
        content.cut = Some(format!(
            "the archive breaks off after {good} unpacked bytes: {error}"
        ));
    }
    Ok(content)
}

/// What a zstd frame holds.
#[cfg(not(target_family = "wasm"))]
pub fn unzstd(packed: &[u8]) -> Result<impl Read> {
    Ok(zstd::Decoder::new(packed)?)
}

/// What a zstd frame holds: nothing, as the library for it is of C.
#[cfg(target_family = "wasm")]
pub fn unzstd(_: &[u8]) -> Result<std::io::Empty> {
    bail!("packed with zstd, which is not read in a browser: unpack it")
}
