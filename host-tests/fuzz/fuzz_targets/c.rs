//! Calls of the C interface in any order, with memory that is short, odd or overwritten: an error code, no panic, and
//! nothing read or written outside of what was given, as the address sanitizer sees it.
#![no_main]

use std::{
    ffi::{CString, c_void},
    ptr,
};

use arbitrary::Arbitrary;
use beamfix::lidar::Model;
use beamfix_c::*;
use libfuzzer_sys::fuzz_target;

#[derive(Arbitrary, Debug)]
struct Input {
    model: u8,
    calls: Vec<Call>,
}

#[derive(Arbitrary, Debug)]
enum Call {
    Odometry {
        bytes: u16,
        offset: u8,
        small: bool,
        config: Option<[f32; 5]>,
        upside_down: u8,
    },
    Localization {
        bytes: u16,
        table: Vec<u8>,
        small: bool,
    },
    Mapping {
        missing: u8,
    },
    Extent(f32),
    Draw {
        bytes: u16,
        side: [u16; 2],
        cell: f32,
        corner: [f32; 2],
    },
    /// Without an object: null.
    Forget,
    Overwrite(u16, u8),
    Lidar(u32, Vec<u8>),
    Wheels(u32, f32, f32, f32),
    Gyro(u32, f32),
    Work(u32),
    StartAt(f32, f32, f32),
    Points(bool),
    Health,
    Startup {
        bytes: u16,
        answers: Vec<(u16, Vec<u8>)>,
    },
}

unsafe extern "C" fn count(user: *mut c_void, x: f32, y: f32) {
    assert!(x.is_finite() && y.is_finite());
    // SAFETY: `user` is what was given with the callback.
    unsafe { *user.cast::<u32>() += 1 };
}

/// Memory of just so many bytes, aligned to 8 and then moved by an offset.
struct Memory {
    words: Vec<u64>,
    bytes: usize,
    offset: usize,
}

impl Memory {
    fn new(bytes: usize, offset: usize) -> Self {
        Self {
            words: vec![0xa5a5_a5a5_a5a5_a5a5; (bytes + offset).div_ceil(8)],
            bytes,
            offset,
        }
    }

    fn start(&mut self) -> *mut c_void {
        // SAFETY: there are `offset` bytes and more.
        unsafe { self.words.as_mut_ptr().cast::<u8>().add(self.offset) }.cast()
    }
}

fuzz_target!(|input: Input| {
    let model = &Model::ALL[usize::from(input.model) % Model::ALL.len()];
    let name = CString::new(model.name).expect("no zero in a name");
    // SAFETY of all calls: pointers are null or to what their types say, and sizes are as told.
    let lidar = unsafe { beamfix_lidar_named(name.as_ptr()) };
    assert!(!lidar.is_null());
    let mut memory = Memory::new(0, 0);
    let mut table: Vec<u8>;
    let mut object: *mut Object = ptr::null_mut();
    let mut points = Box::new(0u32);
    for call in &input.calls {
        match call {
            Call::Odometry {
                bytes,
                offset,
                small,
                config,
                upside_down,
            } => {
                memory = Memory::new(usize::from(*bytes), usize::from(offset % 9));
                object = ptr::null_mut();
                let config =
                    config.map(
                        |[mount_x, mount_y, mount_theta, min_range, max_range]| Config {
                            mount_x,
                            mount_y,
                            mount_theta,
                            upside_down: *upside_down,
                            min_range,
                            max_range,
                        },
                    );
                let config = config.as_ref().map_or(ptr::null(), ptr::from_ref);
                let (start, bytes) = (memory.start(), memory.bytes);
                let status = unsafe {
                    match small {
                        true => {
                            beamfix_make_odometry_small(start, bytes, lidar, config, &mut object)
                        }
                        false => beamfix_make_odometry(start, bytes, lidar, config, &mut object),
                    }
                };
                assert_eq!(status == Status::Ok, !object.is_null());
            }
            Call::Localization {
                bytes,
                table: field,
                small,
            } => {
                memory = Memory::new(usize::from(*bytes), 0);
                object = ptr::null_mut();
                table = field.clone();
                let (start, bytes) = (memory.start(), memory.bytes);
                let (at, length) = (table.as_ptr(), table.len());
                let status = unsafe {
                    let make = match small {
                        true => beamfix_make_localization_small,
                        false => beamfix_make_localization,
                    };
                    make(start, bytes, lidar, ptr::null(), at, length, &mut object)
                };
                assert_eq!(status == Status::Ok, !object.is_null());
                // The table must stay; what was made without one is forgotten with it.
                if object.is_null() {
                    continue;
                }
                std::mem::forget(table);
            }
            Call::Mapping { missing } => {
                memory = Memory::new(
                    BEAMFIX_MAPPING_BYTES.saturating_sub(1000 * usize::from(*missing)),
                    0,
                );
                object = ptr::null_mut();
                let (start, bytes) = (memory.start(), memory.bytes);
                let status =
                    unsafe { beamfix_make_mapping(start, bytes, lidar, ptr::null(), &mut object) };
                assert_eq!(status == Status::Ok, !object.is_null());
            }
            Call::Extent(max_range) => {
                let mut extent = Extent::default();
                let _ = unsafe { beamfix_get_extent(object, *max_range, &mut extent) };
                assert!(extent.min_x <= extent.max_x && extent.min_y <= extent.max_y);
            }
            Call::Draw {
                bytes,
                side: [width, height],
                cell,
                corner: [x, y],
            } => {
                let mut cells = vec![0; usize::from(*bytes)];
                let (at, length) = (cells.as_mut_ptr(), cells.len());
                let _ =
                    unsafe { beamfix_draw_map(object, at, length, *width, *height, *cell, *x, *y) };
            }
            Call::Forget => object = ptr::null_mut(),
            // What C may do by mistake; what was made there then is no object any more.
            Call::Overwrite(at, with) => {
                if let Some(word) = memory.words.get_mut(usize::from(*at)) {
                    *word = u64::from(*with);
                    if *at > 0 {
                        object = ptr::null_mut();
                    }
                }
            }
            Call::Lidar(now_us, bytes) => {
                let mut rest = &bytes[..];
                while !rest.is_empty() {
                    let mut taken = 0;
                    let mut step = std::mem::MaybeUninit::<Step>::zeroed();
                    let status = unsafe {
                        beamfix_push_lidar(
                            object,
                            *now_us,
                            rest.as_ptr(),
                            rest.len(),
                            &mut taken,
                            step.as_mut_ptr(),
                        )
                    };
                    match status {
                        Status::Step => {
                            // SAFETY: the status says that it was written.
                            let step = unsafe { step.assume_init() };
                            assert!(
                                step.x.is_finite() && step.y.is_finite() && step.theta.is_finite()
                            );
                        }
                        Status::Ok => assert_eq!(taken, rest.len()),
                        _ => break,
                    }
                    rest = &rest[taken..];
                }
            }
            Call::Wheels(time_us, x, y, theta) => {
                let _ = unsafe { beamfix_push_wheels(object, *time_us, *x, *y, *theta) };
            }
            Call::Gyro(time_us, rate) => {
                let _ = unsafe { beamfix_push_gyro(object, *time_us, *rate) };
            }
            Call::Work(budget) => {
                let mut done = 0;
                let _ = unsafe { beamfix_work(object, budget % 100_000, &mut done) };
            }
            Call::StartAt(x, y, theta) => {
                let _ = unsafe { beamfix_start_at(object, *x, *y, *theta) };
            }
            Call::Points(on) => {
                let user = ptr::from_mut(&mut *points).cast();
                let callback: PointCallback = if *on { Some(count) } else { None };
                let _ = unsafe { beamfix_set_point_callback(object, callback, user) };
            }
            Call::Health => {
                let mut health = Health::default();
                let status = unsafe { beamfix_get_health(object, &mut health) };
                assert!(status == Status::Ok || object.is_null() || health.revolutions == 0);
            }
            Call::Startup { bytes, answers } => {
                let mut memory = Memory::new(usize::from(*bytes), 0);
                let mut startup = ptr::null_mut();
                let (start, bytes) = (memory.start(), memory.bytes);
                let status = unsafe { beamfix_make_startup(start, bytes, lidar, &mut startup) };
                assert_eq!(status == Status::Ok, !startup.is_null());
                let mut now_us = 0u32;
                for (wait, bytes) in answers {
                    now_us = now_us.wrapping_add(u32::from(*wait) << 8);
                    let mut action = std::mem::MaybeUninit::<Action>::zeroed();
                    let status =
                        unsafe { beamfix_poll_startup(startup, now_us, action.as_mut_ptr()) };
                    if status == Status::Ok {
                        // SAFETY: the status says that it was written.
                        let action = unsafe { action.assume_init() };
                        assert!(usize::from(action.count) <= BEAMFIX_ACTION_BYTES);
                    }
                    let _ = unsafe { beamfix_push_startup(startup, bytes.as_ptr(), bytes.len()) };
                }
                let _ = unsafe { beamfix_use_startup(object, startup) };
            }
        }
    }
});
