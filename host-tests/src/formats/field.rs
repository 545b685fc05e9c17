//! The likelihood field of a map on disk: a table that `field` wrote, or one made from a ROS map.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use beamfix::grid::occupancy;
use beamfix::sensor_model::likelihood_field::{FieldModel, LikelihoodField, Profile, stored};

use super::bytes;
use super::ros_map::{self, Map};

/// How a table starts.
const MAGIC: &[u8] = b"BFLF";
/// Larger files are neither (bytes).
const MAX_FILE: u64 = 1 << 29;

/// A field in memory.
pub enum FieldFile {
    /// A table as it lies in flash: the model that it was made with stands in its header.
    Table(Vec<u8>),
    /// Made from a ROS map.
    Made(LikelihoodField<Vec<u8>>),
}

impl FieldFile {
    /// Reads `path`: a table where it starts as one, a ROS map's YAML file otherwise, from which a field is made with
    /// [`FieldModel::DEFAULT`]. `remarks` gets a line about each odd thing.
    pub fn read(path: &Path, remarks: &mut Vec<String>) -> Result<Self> {
        let name = || path.display().to_string();
        let bytes = bytes::load_at_most(path, MAX_FILE)?.bytes;
        if bytes.starts_with(MAGIC) || path.extension().is_some_and(|ending| ending == "field") {
            let file = Self::Table(bytes);
            file.field().with_context(name)?;
            return Ok(file);
        }
        let map = ros_map::read_remarking(path, remarks)?;
        Ok(Self::Made(of_map(&map, &FieldModel::DEFAULT)?))
    }

    /// The field over its bytes.
    pub fn field(&self) -> Result<LikelihoodField<&[u8]>> {
        match self {
            Self::Table(bytes) => {
                stored::parse(bytes).map_err(|error| anyhow!("not a table of `field`: {error}"))
            }
            Self::Made(field) => Ok(field.as_slice()),
        }
    }
}

/// The field of a map by a model: beams end at the map's occupied cells.
pub fn of_map(map: &Map, model: &FieldModel) -> Result<LikelihoodField<Vec<u8>>> {
    let squares = ros_map::squares(map, occupancy::is_occupied);
    let cells = vec![0; map.shape().len()];
    let profile = Profile::new(model);
    Ok(LikelihoodField::from_map(
        &map.as_slice(),
        &squares,
        &profile,
        cells,
    )?)
}
