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

/// What a file is that starts with `bytes` and has no scan, in a few words.
pub fn what_it_is(name: &str, bytes: &[u8], lines: usize) -> String {
    if let Some((_, what)) = KNOWN.iter().find(|(magic, _)| bytes.starts_with(magic)) {
        return format!("it is {}", what.replace("FILE", name));
    }
    if bytes.get(257..262) == Some(b"ustar") {
        return "it is a tar archive: unpack it".into();
    }
    if telemetry::capture(bytes).is_some() {
        return format!(
            "it is what a board sent, with the lidar's bytes inside: beamfix replay {name} --lidar MODEL"
        );
    }
    let text = String::from_utf8_lossy(bytes);
    let is_text = bytes
        .iter()
        .all(|byte| (0x20..0x7f).contains(byte) || b"\t\r\n\x0c".contains(byte) || *byte >= 0xc2);
    if is_text && is_hex(&text) {
        return format!(
            "it is a hex dump: xxd -r -p {name} > bytes.bin makes bytes of it, then beamfix replay bytes.bin --lidar auto"
        );
    }
    if let Some(finding) = identify::identify(bytes) {
        let model = finding.model.name;
        return format!(
            "it is raw bytes of a lidar, by their look an {model}: beamfix replay {name} --lidar {model}"
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
            (b"0x54, 0x2c, 0x68, 0x08, 0xab\n", "hex dump"),
            (b"dead beef is what the log says here today\n", "text"),
            (b"$GPGGA,123519,4807.038,N,01131.000,E,1,08*47\n", "text"),
            (&[0, 1, 2, 3, 250, 7], "no log known"),
        ] {
            let said = what_it_is("x.bin", bytes, 1);
            assert!(said.contains(word), "{said}");
        }
    }
}
