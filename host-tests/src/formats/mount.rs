//! How a lidar sits on the robot, as a command line has it.

use anyhow::{Result, bail};
use beamfix::{geometry::Pose, scan::Mount};

/// `x,y,degrees` or `x,y,degrees,down`.
pub fn parse(text: &str) -> Result<Mount> {
    let place = text.strip_suffix(",down");
    Ok(Mount {
        robot_from_lidar: pose(place.unwrap_or(text))?,
        upside_down: place.is_some(),
    })
}

/// `x,y,degrees`.
pub fn pose(text: &str) -> Result<Pose> {
    let numbers: Vec<f32> = text.split(',').map(str::parse).collect::<Result<_, _>>()?;
    match numbers[..] {
        [x, y, degrees] if numbers.iter().all(|v| v.is_finite()) => {
            Ok(Pose::new(x, y, degrees.to_radians()))
        }
        _ => bail!("three numbers wanted: x,y,degrees"),
    }
}
