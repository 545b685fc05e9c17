//! The caller's memory as a pipeline with its estimator behind it, and every call on it.
//!
//! ```text
//! Object │ Pipeline<P, Any<N>, N> │ Odometry<N> or MapLocalizer<N> │ the map's maxima
//! ```
//!
//! Everything lies in one block that never moves, so the pipeline may point to its estimator.

use core::{
    ffi::c_void,
    mem::{MaybeUninit, align_of, size_of},
    ptr,
};

use beamfix_core::{
    EgoMotion, Odometry, OdometryConfig, Pipeline, Point, Pose, Protocol, Revolution, Scan,
    lidar::{Model, parsers},
    matching::correlative::Pyramid,
    pipeline::Estimator,
    scan::{Mount, PointsConfig},
    sensor_model::likelihood_field::stored,
};

use crate::{
    lidars::Lidar,
    place::{Localization, place_localization, place_odometry},
    startup::{Starter, zero_cdeg},
    task::{Common, Known, Task, verdict},
    types::*,
};

/// Marks memory that an object was made in; the version is in it, so that a header of another version is noticed too.
const MAGIC: u32 = 0xbea0_0f00 + BEAMFIX_VERSION;

/// A pipeline with its estimator: bytes of a lidar in, steps out.
// The mark comes first: memory that is overwritten from its start on is known by it.
#[repr(C)]
pub struct Object {
    magic: u32,
    calls: &'static Calls,
    pipeline: *mut u8,
    pub(crate) task: *mut dyn Common,
    /// When the bytes of the last call came in.
    now_us: Option<u32>,
    sequence: u32,
    refused: u32,
}

/// The estimator of every pipeline here: hands each scan to the task behind it.
struct Any<const N: usize> {
    task: *mut dyn Task<N>,
    points: PointSink,
}

/// Who wants the places that each scan hit.
#[derive(Clone, Copy)]
struct PointSink {
    callback: PointCallback,
    user: *mut c_void,
    mount: Mount,
    nearest_mm: u16,
    farthest_mm: u16,
}

impl<const N: usize> Estimator<N> for Any<N> {
    type Step = Known;

    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Known {
        if self.points.callback.is_some() {
            self.points.tell(scan);
        }
        // SAFETY: `make` placed the task behind this pipeline, in memory that nothing else uses while a call on the object runs.
        unsafe { (*self.task).update(scan, ego) }
    }
}

impl PointSink {
    /// Tells every place. Apart, so that its memory is not on the stack during a match.
    #[inline(never)]
    fn tell<const N: usize>(&self, scan: &Scan<N>) {
        let Some(callback) = self.callback else {
            return;
        };
        for beam in scan.beams() {
            let Ok(mm) = beam.range.mm() else { continue };
            if !(self.nearest_mm..=self.farthest_mm).contains(&mm) {
                continue;
            }
            let bearing = match self.mount.upside_down {
                true => -beam.bearing.radians(),
                false => beam.bearing.radians(),
            };
            let range = f32::from(mm) * 1e-3;
            let at = self.mount.robot_from_lidar * Pose::new(0.0, 0.0, bearing);
            let Point { x, y } = at * Point::new(range, 0.0);
            // SAFETY: the caller of `beamfix_set_point_callback` vouches for it.
            unsafe { callback(self.user, x, y) };
        }
    }
}

/// A parser that is made from a row of the table of models.
pub(crate) trait ForModel: Protocol {
    /// For this model.
    fn for_model(model: &Model) -> Self;
}

macro_rules! for_model {
    ($($parser:ident)*) => {
        $(impl ForModel for parsers::$parser {
            fn for_model(model: &Model) -> Self {
                parsers::$parser::for_model(model)
            }
        })*
    };
}

for_model! {
    Camsense Delta Ldrobot Lds01 Lds006 Lslidar Rplidar RplidarCapsule RplidarHq RplidarUltraDense RplidarUltra Scip
    Sick Xv11 Xv11Early Ydlidar
}

/// What a lidar's code can do with a pipeline of up to N beams a revolution.
pub(crate) struct Ops<const N: usize> {
    bytes: usize,
    make: unsafe fn(*mut u8, &Model, Any<N>),
    calls: Calls,
}

/// What a revolution made known, and its end (µs).
type Found = (Known, u32);

/// The calls on a pipeline, whatever its parser and capacity.
struct Calls {
    push: unsafe fn(*mut u8, Option<u32>, &[u8], &mut Option<Found>) -> usize,
    wheels: unsafe fn(*mut u8, u32, Pose),
    gyro: unsafe fn(*mut u8, u32, f32),
    health: unsafe fn(*const u8) -> Health,
    set_points: unsafe fn(*mut u8, PointCallback, *mut c_void),
    set_zero: unsafe fn(*mut u8, u16),
}

impl<const N: usize> Ops<N> {
    /// Of a lidar whose protocol P is.
    pub(crate) const fn of<P: ForModel>() -> Self {
        const { assert!(align_of::<Pipeline<P, Any<N>, N>>() <= BEAMFIX_ALIGN) };
        Self {
            bytes: size_of::<Pipeline<P, Any<N>, N>>(),
            make: make_pipeline::<P, N>,
            calls: Calls {
                push: push::<P, N>,
                wheels: wheels::<P, N>,
                gyro: gyro::<P, N>,
                health: health::<P, N>,
                set_points: set_points::<P, N>,
                set_zero: set_zero::<P, N>,
            },
        }
    }
}

/// # Safety
/// `place` is aligned and has room for the pipeline.
unsafe fn make_pipeline<P: ForModel, const N: usize>(place: *mut u8, model: &Model, any: Any<N>) {
    // SAFETY: the caller's promise; what is written needs no initialised memory.
    let place = unsafe { &mut *place.cast::<MaybeUninit<Pipeline<P, Any<N>, N>>>() };
    place.write(Pipeline::new(P::for_model(model), any));
}

/// # Safety
/// `place` holds what [`make_pipeline`] of the same P and N made, and nobody else uses it now. So for all that follow.
unsafe fn push<P: ForModel, const N: usize>(
    place: *mut u8,
    now_us: Option<u32>,
    bytes: &[u8],
    found: &mut Option<Found>,
) -> usize {
    // SAFETY: the caller's promise.
    let pipeline = unsafe { &mut *place.cast::<Pipeline<P, Any<N>, N>>() };
    if let Some(now_us) = now_us {
        pipeline.set_time(now_us);
    }
    let mut taken = 0;
    while let Some(rest) = bytes.get(taken..).filter(|rest| !rest.is_empty()) {
        taken += pipeline.push_packet(rest, &mut |revolution: Revolution<'_, Any<N>, N>| {
            *found = Some((*revolution.step, revolution.scan.end_us()));
        });
        if found.is_some() {
            break;
        }
    }
    taken
}

/// # Safety
/// As [`push`].
unsafe fn wheels<P: ForModel, const N: usize>(place: *mut u8, time_us: u32, pose: Pose) {
    // SAFETY: the caller's promise.
    let pipeline = unsafe { &mut *place.cast::<Pipeline<P, Any<N>, N>>() };
    pipeline.tracker_mut().push_wheels(time_us, pose);
}

/// # Safety
/// As [`push`].
unsafe fn gyro<P: ForModel, const N: usize>(place: *mut u8, time_us: u32, rate: f32) {
    // SAFETY: the caller's promise.
    let pipeline = unsafe { &mut *place.cast::<Pipeline<P, Any<N>, N>>() };
    pipeline.tracker_mut().push_gyro(time_us, rate);
}

/// # Safety
/// As [`push`].
unsafe fn health<P: ForModel, const N: usize>(place: *const u8) -> Health {
    // SAFETY: the caller's promise.
    let pipeline = unsafe { &*place.cast::<Pipeline<P, Any<N>, N>>() };
    let lidar = pipeline.lidar().counters();
    Health {
        packets: lidar.packets,
        check_errors: lidar.check_errors,
        skipped_bytes: lidar.skipped_bytes,
        beams_refused: pipeline.tracker().refused_beams(),
        ..Health::default()
    }
}

/// # Safety
/// As [`push`].
unsafe fn set_points<P: ForModel, const N: usize>(
    place: *mut u8,
    callback: PointCallback,
    user: *mut c_void,
) {
    // SAFETY: the caller's promise.
    let pipeline = unsafe { &mut *place.cast::<Pipeline<P, Any<N>, N>>() };
    let points = &mut pipeline.tracker_mut().estimator_mut().points;
    (points.callback, points.user) = (callback, user);
}

/// # Safety
/// As [`push`].
unsafe fn set_zero<P: ForModel, const N: usize>(place: *mut u8, zero_cdeg: u16) {
    // SAFETY: the caller's promise.
    let pipeline = unsafe { &mut *place.cast::<Pipeline<P, Any<N>, N>>() };
    pipeline.lidar_mut().set_zero(zero_cdeg);
}

/// The caller's memory, from its start on.
pub(crate) struct Storage {
    start: *mut u8,
    bytes: usize,
}

impl Storage {
    /// # Errors
    /// Where it is null or misaligned.
    pub(crate) fn new(start: *mut c_void, bytes: usize) -> Result<Self, Status> {
        if start.is_null() {
            return Err(Status::NullPointer);
        }
        if !start.addr().is_multiple_of(BEAMFIX_ALIGN) {
            return Err(Status::Misaligned);
        }
        let start = start.cast();
        Ok(Self { start, bytes })
    }
}

/// The next multiple of the alignment.
const fn aligned(bytes: usize) -> usize {
    bytes.div_ceil(BEAMFIX_ALIGN) * BEAMFIX_ALIGN
}

/// Memory for an object (bytes): this lidar, a task of so many bytes, and no map.
pub(crate) const fn needed<const N: usize>(ops: &Ops<N>, task: usize) -> usize {
    aligned(size_of::<Object>()) + aligned(ops.bytes) + aligned(task)
}

/// Makes an object: T is the task, made of `extra` bytes of memory behind it.
///
/// # Safety
/// `storage` is the caller's memory, for this object alone.
pub(crate) unsafe fn make<const N: usize, T: Task<N> + 'static>(
    storage: &Storage,
    lidar: &'static Lidar,
    ops: &'static Ops<N>,
    points: &PointsConfig,
    extra: usize,
    task: impl FnOnce(*mut u8, *mut T) -> Result<(), Status>,
) -> Result<*mut Object, Status> {
    const { assert!(align_of::<Object>() <= BEAMFIX_ALIGN && align_of::<T>() <= BEAMFIX_ALIGN) };
    let pipeline_at = aligned(size_of::<Object>());
    let task_at = pipeline_at + aligned(ops.bytes);
    let extra_at = needed(ops, size_of::<T>());
    if storage.bytes < extra_at.saturating_add(extra) {
        return Err(Status::StorageTooSmall);
    }
    // SAFETY: all of these lie within the storage, as was just seen.
    let (pipeline, task_place, rest) = unsafe {
        (
            storage.start.add(pipeline_at),
            storage.start.add(task_at).cast::<T>(),
            storage.start.add(extra_at),
        )
    };
    task(rest, task_place)?;
    let task = task_place;
    let mm = |metres: f32| (metres * 1000.0) as u16;
    let points = PointSink {
        callback: None,
        user: ptr::null_mut(),
        mount: points.mount,
        nearest_mm: mm(points.min_range),
        farthest_mm: mm(points.max_range),
    };
    let object = storage.start.cast::<Object>();
    // SAFETY: `pipeline` has room for what the lidar's own `make` writes, and the object has its place before it.
    unsafe {
        (ops.make)(pipeline, lidar.model, Any { task, points });
        object.write(Object {
            magic: MAGIC,
            calls: &ops.calls,
            pipeline,
            task,
            now_us: None,
            sequence: 0,
            refused: 0,
        });
    }
    Ok(object)
}

/// What the pointers that every object is made with point to; the settings may be null.
///
/// # Safety
/// They are those of a caller of `beamfix_make_odometry`, or of another function that makes an object.
pub(crate) unsafe fn pointers<'a>(
    lidar: *const Lidar,
    config: *const Config,
    object: *mut *mut Object,
) -> Result<(&'static Lidar, Option<&'a Config>, &'a mut *mut Object), Status> {
    // SAFETY: where not null, each points to what its type says, by the header; the lidars are statics.
    let (lidar, config, object) = unsafe { (lidar.as_ref(), config.as_ref(), object.as_mut()) };
    let (Some(lidar), Some(object)) = (lidar, object) else {
        return Err(Status::NullPointer);
    };
    Ok((lidar, config, object))
}

/// # Safety
/// The pointers are those of a caller of `beamfix_make_odometry`.
unsafe fn make_odometry<const N: usize>(
    storage: *mut c_void,
    bytes: usize,
    lidar: *const Lidar,
    ops: impl FnOnce(&'static Lidar) -> &'static Ops<N>,
    config: *const Config,
    object: *mut *mut Object,
) -> Result<(), Status> {
    // SAFETY: the caller's promise.
    let (lidar, config, object) = unsafe { pointers(lidar, config, object)? };
    let storage = Storage::new(storage, bytes)?;
    let config = settings(config, lidar.model)?;
    // SAFETY: the caller's promise.
    *object = unsafe {
        make::<N, Odometry<N>>(
            &storage,
            lidar,
            ops(lidar),
            &config.points,
            0,
            |_, place| {
                place_odometry(place, &config);
                Ok(())
            },
        )?
    };
    Ok(())
}

/// The settings of the odometry, of which localization uses the points'.
pub(crate) fn settings(config: Option<&Config>, model: &Model) -> Result<OdometryConfig, Status> {
    let preset = OdometryConfig::for_model(model);
    match config {
        None => Ok(preset),
        Some(config) if config.is_finite() => {
            config.odometry(preset).map_err(|_| Status::BadConfig)
        }
        Some(_) => Err(Status::BadConfig),
    }
}

/// A map: the field and its bytes.
type Table = (*const u8, usize);

/// # Safety
/// The pointers are those of a caller of `beamfix_make_localization`.
unsafe fn make_localization<const N: usize>(
    storage: *mut c_void,
    bytes: usize,
    lidar: *const Lidar,
    ops: impl FnOnce(&'static Lidar) -> &'static Ops<N>,
    config: *const Config,
    (table, table_bytes): Table,
    object: *mut *mut Object,
) -> Result<(), Status> {
    // SAFETY: the caller's promise.
    let (lidar, config, object) = unsafe { pointers(lidar, config, object)? };
    // SAFETY: by the header the table stays where it is, unchanged, as long as the object is used.
    let table = unsafe { slice(table, table_bytes)? };
    let storage = Storage::new(storage, bytes)?;
    let config = settings(config, lidar.model)?.points;
    let field = stored::parse(table).map_err(|_| Status::BadField)?;
    let maxima = Pyramid::bytes(field.grid().shape());
    // SAFETY: the caller's promise; the maxima have room behind the task.
    *object = unsafe {
        make::<N, Localization<N>>(
            &storage,
            lidar,
            ops(lidar),
            &config,
            maxima,
            |rest, place| {
                rest.write_bytes(0, maxima);
                let rest = core::slice::from_raw_parts_mut(rest, maxima);
                let pyramid = Pyramid::new(field, rest).map_err(|_| Status::BadField)?;
                place_localization(place, &pyramid, &config);
                Ok(())
            },
        )?
    };
    Ok(())
}

/// Bytes of the caller, which may be null where there are none.
///
/// # Safety
/// They stay unchanged as long as the slice is used.
pub(crate) unsafe fn slice<'a>(bytes: *const u8, count: usize) -> Result<&'a [u8], Status> {
    match (bytes.is_null(), count) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(Status::NullPointer),
        (false, 1..=0x7fff_ffff) => {
            // SAFETY: not null, and the caller's promise for the rest.
            Ok(unsafe { core::slice::from_raw_parts(bytes, count) })
        }
        (false, _) => Err(Status::StorageTooSmall),
    }
}

/// The object behind a pointer, where there is one.
///
/// # Safety
/// Where not null and aligned, the memory can be read, and nobody else uses the object now.
pub(crate) unsafe fn object<'a>(pointer: *mut Object) -> Result<&'a mut Object, Status> {
    if pointer.is_null() {
        return Err(Status::NullPointer);
    }
    if !pointer.addr().is_multiple_of(BEAMFIX_ALIGN) {
        return Err(Status::Misaligned);
    }
    // SAFETY: the mark is read first, as a plain number, since nothing may have been made here.
    if unsafe { (&raw const (*pointer).magic).read() } != MAGIC {
        return Err(Status::NotMade);
    }
    // SAFETY: the mark says that `make` wrote it.
    let object = unsafe { &mut *pointer };
    // Moved memory would leave pointers to where it was.
    let offset = aligned(size_of::<Object>());
    match object.pipeline.addr() == pointer.addr() + offset {
        true => Ok(object),
        false => Err(Status::NotMade),
    }
}

pub(crate) const fn status(done: Result<(), Status>) -> Status {
    match done {
        Ok(()) => Status::Ok,
        Err(error) => error,
    }
}

/// Fills in the settings for a lidar at the robot's centre, upright, looking forward, with that lidar's ranges.
///
/// Null for either pointer gives an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_default_config(
    lidar: *const Lidar,
    config: *mut Config,
) -> Status {
    // SAFETY: where not null, each points to what its type says, by the header.
    let (Some(lidar), Some(config)) = (unsafe { lidar.as_ref() }, unsafe { config.as_mut() })
    else {
        return Status::NullPointer;
    };
    let points = OdometryConfig::for_model(lidar.model).points;
    *config = Config {
        mount_x: 0.0,
        mount_y: 0.0,
        mount_theta: 0.0,
        upside_down: 0,
        min_range: points.min_range,
        max_range: points.max_range,
    };
    Status::Ok
}

/// Makes odometry in `storage`: the robot's pose since the start, by its scans alone and what wheels and gyroscope tell.
///
/// `storage`: BEAMFIX_ODOMETRY_BYTES bytes aligned to BEAMFIX_ALIGN. `config`: null for the lidar's defaults. The object stands at
/// the start of the memory, and `object` receives its address. What the memory held before is lost.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_make_odometry(
    storage: *mut c_void,
    bytes: usize,
    lidar: *const Lidar,
    config: *const Config,
    object: *mut *mut Object,
) -> Status {
    // SAFETY: what the header asks of the caller.
    status(unsafe { make_odometry(storage, bytes, lidar, |lidar| &lidar.usual, config, object) })
}

/// The same with BEAMFIX_SMALL_BEAMS, in BEAMFIX_SMALL_ODOMETRY_BYTES.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_make_odometry_small(
    storage: *mut c_void,
    bytes: usize,
    lidar: *const Lidar,
    config: *const Config,
    object: *mut *mut Object,
) -> Status {
    // SAFETY: what the header asks of the caller.
    status(unsafe { make_odometry(storage, bytes, lidar, |lidar| &lidar.small, config, object) })
}

/// Makes localization in `storage`: the robot's pose in a known map, found anew where it is lost.
///
/// `storage`: BEAMFIX_LOCALIZATION_BYTES + BEAMFIX_MAP_BYTES(width, height) bytes aligned to BEAMFIX_ALIGN. `table`: the bytes that
/// `beamfix field MAP.yaml --out FILE` wrote, which stay where they are, in flash, as long as the object is used; the command tells
/// the map's width and height. `config`: null for the lidar's defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_make_localization(
    storage: *mut c_void,
    bytes: usize,
    lidar: *const Lidar,
    config: *const Config,
    table: *const u8,
    table_bytes: usize,
    object: *mut *mut Object,
) -> Status {
    let table = (table, table_bytes);
    // SAFETY: what the header asks of the caller.
    status(unsafe {
        make_localization(
            storage,
            bytes,
            lidar,
            |lidar| &lidar.usual,
            config,
            table,
            object,
        )
    })
}

/// The same with BEAMFIX_SMALL_BEAMS, in BEAMFIX_SMALL_LOCALIZATION_BYTES + BEAMFIX_MAP_BYTES(width, height).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_make_localization_small(
    storage: *mut c_void,
    bytes: usize,
    lidar: *const Lidar,
    config: *const Config,
    table: *const u8,
    table_bytes: usize,
    object: *mut *mut Object,
) -> Status {
    let table = (table, table_bytes);
    // SAFETY: what the header asks of the caller.
    status(unsafe {
        make_localization(
            storage,
            bytes,
            lidar,
            |lidar| &lidar.small,
            config,
            table,
            object,
        )
    })
}

/// Takes bytes of the lidar, in pieces of any size, until a revolution is complete or all are taken.
///
/// `now_us`: when they came in (us, wrapping), for the rest of them the same again. `taken` receives how many were taken: give the rest again. BEAMFIX_STATUS_STEP says
/// that a revolution is complete and `step` was written; this call has then matched it, which takes 4 to 60 ms on a microcontroller:
/// a ring of 2 KB behind the UART keeps what comes meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_push_lidar(
    object: *mut Object,
    now_us: u32,
    bytes: *const u8,
    count: usize,
    taken: *mut usize,
    step: *mut Step,
) -> Status {
    // SAFETY: what the header asks of the caller.
    match unsafe { push_lidar(object, now_us, (bytes, count), taken, step) } {
        Ok(true) => Status::Step,
        Ok(false) => Status::Ok,
        Err(error) => error,
    }
}

/// # Safety
/// The pointers are those of a caller of `beamfix_push_lidar`.
unsafe fn push_lidar(
    pointer: *mut Object,
    now_us: u32,
    (bytes, count): Table,
    taken: *mut usize,
    step: *mut Step,
) -> Result<bool, Status> {
    // SAFETY: where not null, each points to what its type says, by the header.
    let (taken, step) = unsafe { (taken.as_mut(), step.as_mut()) };
    let (Some(taken), Some(step)) = (taken, step) else {
        return Err(Status::NullPointer);
    };
    // SAFETY: the caller's promise.
    let (object, bytes) = unsafe { (self::object(pointer)?, slice(bytes, count)?) };
    let mut found = None;
    // Once for bytes that came in together: a lidar without a clock would seem to have gone back.
    let now_us = (object.now_us.replace(now_us) != Some(now_us)).then_some(now_us);
    // SAFETY: `make` put the pipeline there together with its calls.
    *taken = unsafe { (object.calls.push)(object.pipeline, now_us, bytes, &mut found) };
    let Some((known, time_us)) = found else {
        return Ok(false);
    };
    let pose = known.pose.unwrap_or(Pose::IDENTITY);
    let covariance = known.covariance.filter(|_| known.pose.is_some());
    let measured = known.reason == Reason::None || known.reason == Reason::FirstScan;
    object.refused = object.refused.wrapping_add(u32::from(!measured));
    *step = Step {
        x: pose.x,
        y: pose.y,
        theta: pose.theta,
        covariance: covariance.map_or([0.0; 6], |covariance| covariance.to_array()),
        time_us,
        sequence: object.sequence,
        lost: known.lost,
        verdict: match known.pose {
            Some(_) => verdict(known.verdict),
            None => Verdict::Unknown,
        },
        reason: known.reason,
        has_covariance: u8::from(covariance.is_some()),
    };
    object.sequence = object.sequence.wrapping_add(1);
    Ok(true)
}

/// Takes over what a start-up heard of the lidar: the angle of its own zero, which some YDLIDAR keep, in place of its model's.
///
/// Call it once when the start-up says that the lidar is ready, also for lidars that keep none: nothing changes then. Without it,
/// the poses of such a lidar are turned by that angle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_use_startup(
    object: *mut Object,
    startup: *const Starter,
) -> Status {
    // SAFETY: what the header asks of the caller.
    let found = unsafe { (self::object(object), zero_cdeg(startup)) };
    status(match found {
        (Ok(object), Ok(Some(zero_cdeg))) => {
            // SAFETY: `make` put the pipeline there together with its calls.
            unsafe { (object.calls.set_zero)(object.pipeline, zero_cdeg) };
            Ok(())
        }
        (Ok(_), Ok(None)) => Ok(()),
        (Err(error), _) | (_, Err(error)) => Err(error),
    })
}

/// Takes the robot's pose by its wheels at a time (us, wrapping): forward and left (m) and heading (rad), in a frame of their own.
///
/// Any rate from two a second on will do. Numbers that are not finite are refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_push_wheels(
    object: *mut Object,
    time_us: u32,
    x: f32,
    y: f32,
    theta: f32,
) -> Status {
    // SAFETY: what the header asks of the caller.
    status(unsafe { self::object(object) }.and_then(|object| {
        if !(x.is_finite() && y.is_finite() && theta.is_finite()) {
            return Err(Status::NotANumber);
        }
        let pose = Pose::new(x, y, theta);
        // SAFETY: `make` put the pipeline there together with its calls.
        unsafe { (object.calls.wheels)(object.pipeline, time_us, pose) };
        Ok(())
    }))
}

/// Takes the robot's rate of turn by a gyroscope at a time (us, wrapping): counter-clockwise (rad/s), 20 times a second or more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_push_gyro(object: *mut Object, time_us: u32, rate: f32) -> Status {
    // SAFETY: what the header asks of the caller.
    status(unsafe { self::object(object) }.and_then(|object| {
        if !rate.is_finite() {
            return Err(Status::NotANumber);
        }
        // SAFETY: `make` put the pipeline there together with its calls.
        unsafe { (object.calls.gyro)(object.pipeline, time_us, rate) };
        Ok(())
    }))
}

/// Does a bounded part of what is put off: of localization's search for a lost pose about `budget` bytes of the map looked up, 10
/// instructions each; of mapping about `budget` hundreds of instructions.
///
/// Call it between the lidar's bytes. `done` receives 1 where nothing is left to do before the next revolution, as always in
/// odometry and while a pose in a known map is known; else 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_work(object: *mut Object, budget: u32, done: *mut u8) -> Status {
    // SAFETY: what the header asks of the caller.
    let object = match unsafe { self::object(object) } {
        Ok(object) => object,
        Err(error) => return error,
    };
    // SAFETY: as above.
    let Some(done) = (unsafe { done.as_mut() }) else {
        return Status::NullPointer;
    };
    // SAFETY: `make` put the task there; no call on the pipeline runs now.
    *done = u8::from(unsafe { (*object.task).work(budget) });
    Status::Ok
}

/// Tells localization where the robot is in the map: forward and left (m) and heading (rad) in the map's frame. Without it, or after
/// it was wrong, the pose is searched.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_start_at(
    object: *mut Object,
    x: f32,
    y: f32,
    theta: f32,
) -> Status {
    // SAFETY: what the header asks of the caller.
    status(unsafe { self::object(object) }.and_then(|object| {
        if !(x.is_finite() && y.is_finite() && theta.is_finite()) {
            return Err(Status::NotANumber);
        }
        // SAFETY: `make` put the task there; no call on the pipeline runs now.
        match unsafe { (*object.task).start_at(Pose::new(x, y, theta)) } {
            true => Ok(()),
            false => Err(Status::OtherTask),
        }
    }))
}

/// Calls `callback` for every place that a beam of a revolution hit, during the call of beamfix_push_lidar that completes it, before
/// the match; null ends that.
///
/// For obstacles: the places are in the robot's frame, the lidar's mount taken into account. The callback must not call anything on
/// the same object.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_set_point_callback(
    object: *mut Object,
    callback: PointCallback,
    user: *mut c_void,
) -> Status {
    // SAFETY: what the header asks of the caller.
    status(unsafe { self::object(object) }.map(|object| {
        // SAFETY: `make` put the pipeline there together with its calls.
        unsafe { (object.calls.set_points)(object.pipeline, callback, user) };
    }))
}

/// Tells how the parts are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_get_health(object: *mut Object, health: *mut Health) -> Status {
    // SAFETY: what the header asks of the caller.
    let object = match unsafe { self::object(object) } {
        Ok(object) => object,
        Err(error) => return error,
    };
    // SAFETY: as above.
    let Some(health) = (unsafe { health.as_mut() }) else {
        return Status::NullPointer;
    };
    // SAFETY: `make` put the pipeline and the task there.
    let (counted, lost) = unsafe {
        (
            (object.calls.health)(object.pipeline),
            (*object.task).lost(),
        )
    };
    *health = Health {
        revolutions: object.sequence,
        refused: object.refused,
        lost,
        ..counted
    };
    Status::Ok
}
