//! Puts memory.x where the linker looks for it.
use std::{env, fs, path::Path};

fn main() {
    let here = env::var("CARGO_MANIFEST_DIR").expect("set by cargo");
    field(Path::new(&env::var("OUT_DIR").expect("set by cargo")));
    println!("cargo:rustc-link-search={here}");
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
