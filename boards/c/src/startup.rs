//! What a lidar must be sent before it measures, in the caller's memory.

use core::{
    ffi::c_void,
    mem::{align_of, size_of},
};

use beamfix_core::lidar::startup::{Action as Wanted, StartConfig, Startup};

use crate::{lidars::Lidar, types::*};

/// Marks memory that a start-up was made in.
const MAGIC: u32 = 0xbea0_5700 + BEAMFIX_VERSION;

/// Start-up of one lidar: polled until it says that measurements come.
pub struct Starter {
    magic: u32,
    startup: Startup,
}

const _: () = assert!(size_of::<Starter>() <= BEAMFIX_STARTUP_BYTES);
const _: () = assert!(align_of::<Starter>() <= BEAMFIX_ALIGN);

/// Makes a lidar's start-up in `storage`: BEAMFIX_STARTUP_BYTES bytes aligned to BEAMFIX_ALIGN.
///
/// Poll it with beamfix_poll_startup and give it what the lidar answers with beamfix_push_startup, until it says that the lidar is
/// ready; give it to beamfix_use_startup then, and its memory is free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_make_startup(
    storage: *mut c_void,
    bytes: usize,
    lidar: *const Lidar,
    startup: *mut *mut Starter,
) -> Status {
    // SAFETY: where not null, each points to what its type says, by the header.
    let (lidar, startup) = unsafe { (lidar.as_ref(), startup.as_mut()) };
    let (Some(lidar), Some(startup), false) = (lidar, startup, storage.is_null()) else {
        return Status::NullPointer;
    };
    if !storage.addr().is_multiple_of(BEAMFIX_ALIGN) {
        return Status::Misaligned;
    }
    if bytes < size_of::<Starter>() {
        return Status::StorageTooSmall;
    }
    let place = storage.cast::<Starter>();
    // SAFETY: aligned and large enough, as was just seen, and the caller's.
    unsafe {
        place.write(Starter {
            magic: MAGIC,
            startup: Startup::new(lidar.model, StartConfig::DEFAULT),
        });
    }
    *startup = place;
    Status::Ok
}

/// Tells what is to be done now (us, wrapping): do it, and ask again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_poll_startup(
    startup: *mut Starter,
    now_us: u32,
    action: *mut Action,
) -> Status {
    // SAFETY: what the header asks of the caller.
    let starter = match unsafe { starter(startup) } {
        Ok(starter) => starter,
        Err(error) => return error,
    };
    // SAFETY: as above.
    let Some(action) = (unsafe { action.as_mut() }) else {
        return Status::NullPointer;
    };
    *action = Action {
        kind: ActionKind::Wait,
        baud: 0,
        count: 0,
        bytes: [0; BEAMFIX_ACTION_BYTES],
    };
    match starter.startup.poll(now_us) {
        Wanted::Send(request) => {
            action.kind = ActionKind::Send;
            for (to, byte) in action.bytes.iter_mut().zip(request.as_slice()) {
                *to = *byte;
                action.count += 1;
            }
        }
        Wanted::SetBaud(baud) => (action.kind, action.baud) = (ActionKind::SetBaud, baud),
        Wanted::MotorOn => action.kind = ActionKind::MotorOn,
        Wanted::Wait => {}
        Wanted::Ready(_) => action.kind = ActionKind::Ready,
        Wanted::Failed(_) => action.kind = ActionKind::Failed,
    }
    Status::Ok
}

/// Takes bytes that the lidar answered.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_push_startup(
    startup: *mut Starter,
    bytes: *const u8,
    count: usize,
) -> Status {
    // SAFETY: what the header asks of the caller.
    let taken = unsafe { starter(startup) }.and_then(|starter| {
        // SAFETY: as above.
        let bytes = unsafe { crate::object::slice(bytes, count)? };
        bytes.iter().for_each(|byte| starter.startup.push(*byte));
        Ok(())
    });
    crate::object::status(taken)
}

/// The angle that looks forward by the lidar's own calibration (0.01°), where it told one.
///
/// # Safety
/// As [`starter`].
pub(crate) unsafe fn zero_cdeg(startup: *const Starter) -> Result<Option<u16>, Status> {
    // SAFETY: the caller's promise; it is only read.
    unsafe { starter(startup.cast_mut()) }.map(|starter| starter.startup.zero_cdeg())
}

/// # Safety
/// Where not null and aligned, the memory can be read, and nobody else uses it now.
unsafe fn starter<'a>(pointer: *mut Starter) -> Result<&'a mut Starter, Status> {
    if pointer.is_null() {
        return Err(Status::NullPointer);
    }
    if !pointer.addr().is_multiple_of(BEAMFIX_ALIGN) {
        return Err(Status::Misaligned);
    }
    // SAFETY: the mark is read first, as a plain number, since nothing may have been made here.
    match unsafe { (&raw const (*pointer).magic).read() } {
        // SAFETY: the mark says that it was made.
        MAGIC => Ok(unsafe { &mut *pointer }),
        _ => Err(Status::NotMade),
    }
}
