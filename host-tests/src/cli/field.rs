//! `field`: a ROS map becomes a likelihood field for flash.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use beamfix::grid::occupancy::{self, Cell};
use beamfix::matching::correlative::pyramid::Pyramid;
use beamfix::sensor_model::likelihood_field::{FieldModel, stored};
use host_tests::formats::{field::of_map, ros_map};
use host_tests::report::picture::{self, heat::Heat};
use serde_json::json;

use super::output;

/// Likelihood field of a ROS map (YAML and PGM) for flash: a binary table, a Rust const, a heat map.
///
/// Writes FILE, FILE with .rs and the heat map. The table's layout: beamfix::sensor_model::likelihood_field::stored.
#[derive(clap::Args)]
pub struct Args {
    /// The map's YAML file.
    map: PathBuf,
    /// Where to write the table.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Where to draw the heat map, .png or .svg. Default: FILE with .png.
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Spread of hits (m).
    #[arg(long, default_value_t = 0.075)]
    sigma: f32,
    /// Weight of random returns; hits have the rest.
    #[arg(long, default_value_t = 0.1)]
    z_rand: f32,
    /// Longest range (m).
    #[arg(long, default_value_t = 12.0)]
    z_max: f32,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Reads, says how large it becomes, writes.
pub fn run(args: &Args) -> Result<ExitCode> {
    let ending = args.out.extension().and_then(|ending| ending.to_str());
    ensure!(
        !ending.is_some_and(|ending| ["yaml", "yml", "pgm", "rs", "png"].contains(&ending)),
        "--out {}: the table's own file, neither a map nor what is written beside it, e.g. flat.field",
        args.out.display()
    );
    let code = args.out.with_extension("rs");
    let image = match &args.picture {
        Some(path) => {
            picture::Kind::of(path).context("--picture")?;
            path.clone()
        }
        None => args.out.with_extension("png"),
    };
    output::spare(&[&args.map], &[Some(&args.out), Some(&code), Some(&image)])?;
    let mut remarks = Vec::new();
    let map = ros_map::read_remarking(&args.map, &mut remarks)?;
    output::remark(&remarks);
    let shape = *map.shape();
    let bytes = stored::HEADER + shape.len();
    let ram = Pyramid::bytes(&shape);
    eprintln!(
        "{} x {} cells of {} m: {bytes} bytes of flash, and {ram} bytes of RAM where it is searched",
        shape.width(),
        shape.height(),
        shape.resolution()
    );
    let model = FieldModel::new(1.0 - args.z_rand, args.z_rand, args.z_max, args.sigma)
        .context("--sigma, --z-rand, --z-max")?;
    let field = of_map(&map, &model)?;
    let header = stored::header(&field.as_slice());
    let mut file = output::create(&args.out)?;
    file.write_all(&header)?;
    file.write_all(field.grid().cells())?;
    file.flush()
        .with_context(|| args.out.display().to_string())?;
    write_const(&header, field.grid().cells(), &code)?;
    let heat = Heat {
        title: format!("Likelihood field of {}", args.map.display()),
        caption: format!(
            "{} x {} cells of {} m, sigma {} m",
            shape.width(),
            shape.height(),
            shape.resolution(),
            args.sigma
        ),
        field: field.as_slice(),
        path: Vec::new(),
    };
    picture::save(&heat, &image)?;
    let count = |cell: Cell| {
        map.cells()
            .iter()
            .filter(|&&byte| occupancy::cell(byte) == cell)
            .count()
    };
    let (occupied, unknown) = (count(Cell::Occupied), count(Cell::Unknown));
    let value = json!({
        "width": shape.width(), "height": shape.height(), "resolution": shape.resolution(), "flash_bytes": bytes,
        "ram_bytes": ram, "occupied": occupied, "free": count(Cell::Free), "unknown": unknown,
        "files": [args.out, code, image],
    });
    let text = format!(
        "{occupied} cells occupied, {unknown} unknown\nwrote {}, {} and {}",
        args.out.display(),
        code.display(),
        image.display()
    );
    output::report(args.json, &value, &text)?;
    if occupied == 0 {
        eprintln!(
            "beamfix: {}: no cell is occupied: nothing can be matched with it",
            args.map.display()
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// The same bytes as a constant for a firmware's source.
fn write_const(header: &[u8], cells: &[u8], path: &std::path::Path) -> Result<()> {
    let mut text = format!(
        "/// A likelihood field: `beamfix::sensor_model::likelihood_field::stored::parse(&FIELD)`.\n\
         pub const FIELD: [u8; {}] = [\n",
        header.len() + cells.len()
    );
    let all: Vec<u8> = header.iter().chain(cells).copied().collect();
    for row in all.chunks(32) {
        for byte in row {
            write!(text, "{byte},")?;
        }
        text.push('\n');
    }
    text.push_str("];\n");
    std::fs::write(path, text).with_context(|| path.display().to_string())
}
