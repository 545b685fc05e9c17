//! What a file is that is no log, and how to read it.

use beamfix::lidar::identify;

use super::capture::telemetry;

/// So many bytes of a file are looked at.
pub const LOOKED_AT: usize = 100_000;

/// Files told by their first bytes.
const KNOWN: [(&[u8], &str); 8] = [
    (
        b"#ROSBAG V2.0",
        "a ROS 1 bag: rosbags-convert --src FILE --dst FOLDER makes a ROS 2 bag of it",
    ),
    (b"PK\x03\x04", "a zip archive: unpack it"),
    (b"BZh", "a bzip2 archive: unpack it"),
    (b"\xfd7zXZ\0", "an xz archive: unpack it"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive: unpack it"),
    (b"\x89PNG", "a picture"),
    (b"P5", "a picture"),
    (b"\x7fELF", "a program"),
];

/// A tar archive, told by what stands behind its first name.
const TAR: &str = "a tar archive: unpack it";

/// What a file is that begins as no lidar's bytes do, an archive or a picture, though frames may lie in it uncompressed. Two or
/// three bytes tell nothing: a capture may begin with any.
pub fn other_than_bytes(name: &str, bytes: &[u8]) -> Option<String> {
    let tar = (bytes.get(257..262) == Some(b"ustar")).then_some(TAR);
    let what = KNOWN
        .iter()
        .find(|(magic, _)| magic.len() > 3 && bytes.starts_with(magic))
        .map(|(_, what)| *what)
        .or(tar)?;
    Some(format!("it is {}", what.replace("FILE", name)))
}

/// What a file is that starts with `bytes` and has no scan, in a few words.
pub fn what_it_is(name: &str, bytes: &[u8], lines: usize) -> String {
    if let Some((_, what)) = KNOWN.iter().find(|(magic, _)| bytes.starts_with(magic)) {
        return format!("it is {}", what.replace("FILE", name));
    }
    if let Some(what) = other_than_bytes(name, bytes) {
        return what;
    }
    if telemetry::capture(bytes).is_some() {
        return format!(
            "it is what a board sent, with the lidar's bytes inside: beamfix replay {name} --lidar MODEL"
        );
    }
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return format!(
            "it is text in UTF-16: iconv -f UTF-16 -t UTF-8 {name} makes a text of bytes of it"
        );
    }
    let text = String::from_utf8_lossy(bytes);
    let is_text = bytes
        .iter()
        .all(|byte| (0x20..0x7f).contains(byte) || b"\t\r\n\x0c".contains(byte) || *byte >= 0xc2);
    if is_text && is_hex(&text) {
        let bytes_of_it = match dump(&text) {
            Dump::Plain => format!("xxd -r -p {name}"),
            Dump::Xxd => format!("xxd -r {name}"),
            Dump::Hexdump => format!("cut -c10-59 {name} | xxd -r -p"),
        };
        return format!(
            "it is a hex dump: {bytes_of_it} > bytes.bin makes bytes of it, then beamfix replay bytes.bin --lidar auto"
        );
    }
    if let Some(finding) = identify::identify(bytes) {
        let model = finding.model.name;
        return format!(
            "it is raw bytes of a lidar, by their look of the lidar {model}: beamfix replay {name} --lidar {model}"
        );
    }
    if is_text {
        return format!("it is text, but no FLASER or ROBOTLASER1 line in {lines} lines");
    }
    format!(
        "{} bytes or more that are no log known here (CARMEN, .lscan, ROS 2 bag, capture); raw bytes of a lidar want --lidar MODEL",
        bytes.len()
    )
}

/// How a hex dump has its lines.
enum Dump {
    /// Bytes alone.
    Plain,
    /// An offset with a colon before them.
    Xxd,
    /// An offset before them, as `hexdump -C` writes it.
    Hexdump,
}

/// By the first line: offsets are longer than what follows them.
fn dump(text: &str) -> Dump {
    let line = text.lines().find(|line| !line.trim().is_empty());
    let mut words = line.unwrap_or("").split_whitespace();
    let (first, second) = (words.next().unwrap_or(""), words.next().unwrap_or(""));
    let digits = first.trim_end_matches(':');
    if first.ends_with(':') {
        Dump::Xxd
    } else if digits.len() >= 7 && !digits.contains('x') && second.len() == 2 {
        Dump::Hexdump
    } else {
        Dump::Plain
    }
}

/// What a file is in which no lidar's frames were found, if its look tells: a text, an archive, a log that wants no `--lidar`.
pub fn without_frames(name: &str, bytes: &[u8]) -> Option<String> {
    let start = bytes.get(..LOOKED_AT).unwrap_or(bytes);
    let lines = start.split(|byte| *byte == b'\n').count();
    let text = String::from_utf8_lossy(start);
    if text
        .lines()
        .any(|line| line.starts_with("FLASER ") || line.starts_with("ROBOTLASER1 "))
    {
        return Some(format!(
            "it is a CARMEN log: beamfix replay {name}, without --lidar"
        ));
    }
    if start.starts_with(b"\x89MCAP") || start.starts_with(b"SQLite format 3\0") {
        return Some(format!(
            "it is a ROS 2 bag: beamfix replay {name}, without --lidar"
        ));
    }
    if start.starts_with(b"LSCN") {
        return Some(format!(
            "it is a log of scans: beamfix replay {name}, without --lidar"
        ));
    }
    let what = what_it_is(name, start, lines);
    what.starts_with("it is ")
        .then(|| match what.split_once(", but no FLASER") {
            Some((text, _)) => format!("{text} in which no lidar's frames are"),
            None => what,
        })
}

/// Whether a text is bytes in hexadecimal, with or without the offsets and letters that `xxd` and `hexdump` add.
fn is_hex(text: &str) -> bool {
    let mut pairs = 0;
    let mut lines = 0;
    for line in text.lines().take(50).filter(|line| !line.trim().is_empty()) {
        lines += 1;
        let words = line
            .split([' ', ',', '\t', '|'])
            .filter(|word| !word.is_empty());
        let is_byte = |word: &&str| {
            let word = word.trim_start_matches("0x");
            word.len().is_multiple_of(2)
                && word.len() >= 2
                && word.bytes().all(|byte| byte.is_ascii_hexdigit())
        };
        let bytes: usize = words.filter(is_byte).map(|word| word.len() / 2).sum();
        // A line that is mostly bytes: `xxd` adds an offset of 10 characters and the 16 letters.
        pairs += usize::from(bytes >= 4 && bytes * 5 >= line.trim().len());
    }
    lines > 0 && pairs * 10 >= lines * 9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_no_logs_are_told_apart() {
        let ld06: [u8; 47] = core::array::from_fn(|k| k as u8);
        let hex: String = ld06.iter().map(|byte| format!("{byte:02x} ")).collect();
        for (bytes, word) in [
            (&b"PK\x03\x04\x14\0"[..], "zip"),
            (b"#ROSBAG V2.0\n", "ROS 1"),
            (hex.as_bytes(), "hex dump"),
            (
                b"00000000: 542c 6808 ab7e e000 e4dc 00e2 d900 e5d5  T,h..~..........\n",
                "hex dump",
            ),
            (b"0x54, 0x2c, 0x68, 0x08, 0xab\n", "xxd -r -p x.bin >"),
            // With an offset the bytes alone are wanted.
            (
                b"00000000: 542c 6808 ab7e e000 e4dc 00e2 d900 e5d5  T,h..~..........\n",
                "xxd -r x.bin >",
            ),
            (
                b"00000000  54 2c 68 08 ab 7e e0 00  e4 dc 00 e2 d9 00 e5 d5  |T,h..~..........|\n",
                "cut -c10-59 x.bin | xxd -r -p >",
            ),
            (b"\xff\xfeh\0i\0\n\0", "UTF-16"),
            (b"dead beef is what the log says here today\n", "text"),
            (b"$GPGGA,123519,4807.038,N,01131.000,E,1,08*47\n", "text"),
            (&[0, 1, 2, 3, 250, 7], "no log known"),
        ] {
            let said = what_it_is("x.bin", bytes, 1);
            assert!(said.contains(word), "{said}");
        }
    }
}
