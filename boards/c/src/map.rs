//! Mapping: its object is made, and its map is drawn into the caller's memory.

use core::ffi::c_void;

use beamfix_core::{
    Grid, Pose,
    grid::{
        Shape,
        occupancy::{self, UpdateConfig},
    },
    slam::SLICE,
};

use crate::{
    lidars::Lidar,
    object::{Object, Storage, make, object, pointers, settings, status},
    place::{Mapping, place_mapping},
    types::*,
};

/// A budget for beamfix_work on mapping, between two revolutions: two million instructions.
pub const BEAMFIX_MAPPING_BUDGET: u32 = 20_000;
const _: () = assert!(BEAMFIX_MAPPING_BUDGET == SLICE);

/// A byte of a drawn map: nothing is there.
pub const BEAMFIX_CELL_FREE: u8 = 2;
/// A byte of a drawn map: not seen, or contradicted.
pub const BEAMFIX_CELL_UNKNOWN: u8 = 128;
/// A byte of a drawn map: something is there.
pub const BEAMFIX_CELL_OCCUPIED: u8 = 254;
const _: () = assert!(
    BEAMFIX_CELL_FREE == occupancy::FREE
        && BEAMFIX_CELL_UNKNOWN == occupancy::UNKNOWN
        && BEAMFIX_CELL_OCCUPIED == occupancy::OCCUPIED
);

/// What a map covers, in the frame in which the robot started.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Extent {
    /// Smallest coordinate forward (m).
    pub min_x: f32,
    /// Smallest coordinate to the left (m).
    pub min_y: f32,
    /// Largest coordinate forward (m).
    pub max_x: f32,
    /// Largest coordinate to the left (m).
    pub max_y: f32,
}

/// Makes mapping in `storage`: odometry, and a map of 224 keyframes whose loops are closed. A step's pose is in that map, in the frame
/// in which the robot started; it has no covariance.
///
/// `storage`: BEAMFIX_MAPPING_BYTES bytes aligned to BEAMFIX_ALIGN. `config`: null for the lidar's defaults. Call beamfix_work between
/// the revolutions, with BEAMFIX_MAPPING_BUDGET. A program that names this function takes about as many bytes of flash more, for how the
/// memory begins.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_make_mapping(
    storage: *mut c_void,
    bytes: usize,
    lidar: *const Lidar,
    config: *const Config,
    object: *mut *mut Object,
) -> Status {
    // SAFETY: what the header asks of the caller.
    status(unsafe { make_mapping(storage, bytes, lidar, config, object) })
}

/// # Safety
/// The pointers are those of a caller of `beamfix_make_mapping`.
unsafe fn make_mapping(
    storage: *mut c_void,
    bytes: usize,
    lidar: *const Lidar,
    config: *const Config,
    object: *mut *mut Object,
) -> Result<(), Status> {
    // SAFETY: the caller's promise.
    let (lidar, config, object) = unsafe { pointers(lidar, config, object)? };
    let storage = Storage::new(storage, bytes)?;
    let config = settings(config, lidar.model)?;
    // SAFETY: the caller's promise.
    *object = unsafe {
        make::<BEAMFIX_BEAMS, Mapping>(
            &storage,
            lidar,
            &lidar.usual,
            &config.points,
            0,
            |_, place| {
                place_mapping(place, &config);
                Ok(())
            },
        )?
    };
    Ok(())
}

/// Tells what the map covers, of all that was seen no farther than `max_range` (m) away. An object without a map, as odometry and
/// localization are, is refused; all zeros while there is nothing in it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_get_extent(
    object: *mut Object,
    max_range: f32,
    extent: *mut Extent,
) -> Status {
    // SAFETY: what the header asks of the caller.
    let (found, extent) = unsafe { (self::object(object), extent.as_mut()) };
    status(found.and_then(|object| {
        let extent = extent.ok_or(Status::NullPointer)?;
        if !max_range.is_finite() {
            return Err(Status::NotANumber);
        }
        // SAFETY: `make` put the task there; no call on the pipeline runs now.
        let map = unsafe { (*object.task).map() }.ok_or(Status::OtherTask)?;
        *extent = map
            .slam_mut()
            .extent(max_range)
            .map_or(Extent::default(), |(low, high)| Extent {
                min_x: low.x,
                min_y: low.y,
                max_x: high.x,
                max_y: high.y,
            });
        Ok(())
    }))
}

/// Draws the map into `cells`, a byte each: BEAMFIX_CELL_FREE, BEAMFIX_CELL_OCCUPIED or BEAMFIX_CELL_UNKNOWN. What they held is lost.
///
/// There are `width` times `height` cells of `cell` metres; the first lies at `min_x`, `min_y`, the next ones after it along x, and rows
/// along y. BEAMFIX_STATUS_BAD_CONFIG where such a grid cannot be, BEAMFIX_STATUS_STORAGE_TOO_SMALL where `bytes` are fewer than its
/// cells. Keyframes that lie outside are left out. It takes a while: some hundred thousand instructions for each keyframe.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_draw_map(
    object: *mut Object,
    cells: *mut u8,
    bytes: usize,
    width: u16,
    height: u16,
    cell: f32,
    min_x: f32,
    min_y: f32,
) -> Status {
    // SAFETY: what the header asks of the caller.
    let found = unsafe { self::object(object) };
    status(found.and_then(|object| {
        if cells.is_null() {
            return Err(Status::NullPointer);
        }
        if !(cell.is_finite() && min_x.is_finite() && min_y.is_finite()) {
            return Err(Status::NotANumber);
        }
        // SAFETY: `make` put the task there; no call on the pipeline runs now.
        let map = unsafe { (*object.task).map() }.ok_or(Status::OtherTask)?;
        let corner = Pose::new(min_x, min_y, 0.0);
        let shape =
            Shape::new(width.into(), height.into(), cell, corner).map_err(|_| Status::BadConfig)?;
        if bytes < shape.len() || shape.len() > 0x7fff_ffff {
            return Err(Status::StorageTooSmall);
        }
        // SAFETY: not null, as many bytes as the caller says, and the caller's alone during this call; they are written first.
        let cells = unsafe {
            cells.write_bytes(occupancy::UNKNOWN, shape.len());
            core::slice::from_raw_parts_mut(cells, shape.len())
        };
        let mut grid = Grid::new(shape, cells).map_err(|_| Status::BadConfig)?;
        for slot in 0..KEYFRAMES as u16 {
            map.slam_mut().draw(slot, &mut grid, &UpdateConfig::DEFAULT);
        }
        occupancy::decide(grid.cells_mut());
        Ok(())
    }))
}

/// Keyframes of a map.
pub(crate) const KEYFRAMES: usize = 224;
