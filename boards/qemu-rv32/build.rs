//! Puts memory.x where the linker looks for it.

#[path = "../emulated/field_table.rs"]
mod field_table;

use std::{env, path::Path};

fn main() {
    let here = env::var("CARGO_MANIFEST_DIR").expect("set by cargo");
    field_table::put_into(Path::new(&env::var("OUT_DIR").expect("set by cargo")));
    println!("cargo:rustc-link-search={here}");
    println!("cargo:rerun-if-changed=memory.x");
}
