//! For the build scripts of the emulated boards that localize.

use std::{env, fs, path::Path};

/// Puts the table that the program `localize` has in its flash there; an empty one where the environment names none.
pub fn put_into(out: &Path) {
    let table = env::var_os("BEAMFIX_FIELD").map(|path| {
        println!("cargo:rerun-if-changed={}", path.display());
        fs::read(path).expect("BEAMFIX_FIELD can be read")
    });
    fs::write(out.join("field.bin"), table.unwrap_or_default()).expect("OUT_DIR can be written");
    println!("cargo:rerun-if-env-changed=BEAMFIX_FIELD");
}
