//! Puts a memory.x where the linker looks for it: the machine's RAM, or just that of a tier.

#[path = "../emulated/field_table.rs"]
mod field_table;

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
    field_table::put_into(Path::new(&out));
    println!("cargo:rustc-link-search={out}");
    println!("cargo:rerun-if-changed=memory.x");
}
