//! Puts a memory.x where the linker looks for it: the machine's RAM, or just that of a tier.
use std::{env, fs, path::Path};

fn main() {
    let out = env::var("OUT_DIR").expect("set by cargo");
    let memory = fs::read_to_string("memory.x").expect("memory.x beside this file");
    let ram = if env::var_os("CARGO_FEATURE_TIER_64K").is_some() {
        "64K"
    } else if env::var_os("CARGO_FEATURE_TIER_192K").is_some() {
        "192K"
    } else if env::var_os("CARGO_FEATURE_TIER_512K").is_some() {
        "512K"
    } else {
        "4M"
    };
    let line = "RAM : ORIGIN = 0x20000000, LENGTH = ";
    let memory = memory.replace(&format!("{line}4M"), &format!("{line}{ram}"));
    fs::write(Path::new(&out).join("memory.x"), memory).expect("OUT_DIR can be written");
    field(Path::new(&out));
    println!("cargo:rustc-link-search={out}");
    println!("cargo:rerun-if-changed=memory.x");
}

/// The table that the program `localize` has in its flash; empty where none is named.
fn field(out: &Path) {
    let table = env::var_os("BEAMFIX_FIELD").map(|path| {
        println!("cargo:rerun-if-changed={}", path.display());
        fs::read(path).expect("BEAMFIX_FIELD can be read")
    });
    fs::write(out.join("field.bin"), table.unwrap_or_default()).expect("OUT_DIR can be written");
    println!("cargo:rerun-if-env-changed=BEAMFIX_FIELD");
}
