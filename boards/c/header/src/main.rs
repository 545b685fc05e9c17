//! Prints the C header of the crate whose folder is the argument.

use std::{error::Error, io, path::Path};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args()
        .nth(1)
        .ok_or("usage: beamfix-header FOLDER")?;
    let config = cbindgen::Config::from_file(Path::new(&folder).join("cbindgen.toml"))?;
    let bindings = cbindgen::Builder::new()
        .with_config(config)
        .with_crate(&folder)
        .generate()?;
    bindings.write(io::stdout().lock());
    Ok(())
}
