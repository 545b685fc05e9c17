//! Values made in their place, not on the stack.
//!
//! A C task may have 2 KB of stack, and a Rust function that returns a value of 20 KB is given a place for it by its caller; but
//! Rust's callers first take one on their own stack and copy. So two steps of assembler stand between: they take the place as an
//! argument and pass it on as what every C ABI here calls the hidden first argument of a function that returns a large struct
//! (AAPCS 5.4, RISC-V "Procedure Calling Convention", System V AMD64 3.2.3).

use core::{arch::naked_asm, mem::size_of};

use beamfix_core::{
    Localizer, LocalizerConfig, MapLocalizer, Odometry, OdometryConfig,
    matching::correlative::Pyramid, pipeline::Mapper, scan::PointsConfig, slam::SlamConfig,
};

use crate::{map::KEYFRAMES, task::POINTS, types::BEAMFIX_BEAMS};

/// Localization as it lies in the caller's memory.
pub(crate) type Localization<const N: usize> = MapLocalizer<'static, N, POINTS>;

/// Mapping as it lies in the caller's memory: as `Mapper192k` has it, with revolutions of any lidar.
pub(crate) type Mapping = Mapper<BEAMFIX_BEAMS, KEYFRAMES, 512, 880, 144, 360>;

/// Goes on in another function with the same arguments.
macro_rules! go_on_in {
    ($function:expr) => {{
        #[cfg(target_arch = "arm")]
        naked_asm!("ldr r3, 1f", "bx r3", ".p2align 2", "1: .word {0}", sym $function);
        #[cfg(any(target_arch = "riscv32", target_arch = "riscv64"))]
        naked_asm!("tail {0}", sym $function);
        #[cfg(target_arch = "x86_64")]
        naked_asm!("jmp {0}", sym $function);
    }};
}

/// Writes odometry to its place.
///
/// # Safety
/// `place` is aligned, has room for it, and is the caller's.
#[unsafe(naked)]
pub(crate) unsafe extern "C" fn place_odometry<const N: usize>(
    place: *mut Odometry<N>,
    config: &OdometryConfig,
) {
    go_on_in!(odometry::<N>)
}

/// Writes localization to its place.
///
/// # Safety
/// As [`place_odometry`].
#[unsafe(naked)]
pub(crate) unsafe extern "C" fn place_localization<const N: usize>(
    place: *mut Localization<N>,
    pyramid: &Pyramid<'static>,
    config: &PointsConfig,
) {
    go_on_in!(localization::<N>)
}

/// Mapping that has seen nothing, in flash: Rust would make two of them on the stack.
static BEGINNING: Mapping = Mapping::new(OdometryConfig::DEFAULT, SlamConfig::DEFAULT);

/// Writes mapping to its place.
///
/// # Safety
/// As [`place_odometry`].
pub(crate) unsafe fn place_mapping(place: *mut Mapping, config: &OdometryConfig) {
    // SAFETY: the caller's promise; nothing in it points to itself, or must be dropped.
    let mapping = unsafe {
        place.copy_from_nonoverlapping(&BEGINNING, 1);
        &mut *place
    };
    mapping.set_up(*config);
}

#[allow(improper_ctypes_definitions, reason = "only Rust looks into it")]
extern "C" fn odometry<const N: usize>(config: &OdometryConfig) -> Odometry<N> {
    const { assert!(size_of::<Odometry<N>>() > 16, "returned in memory") };
    Odometry::new(*config)
}

#[allow(improper_ctypes_definitions, reason = "only Rust looks into it")]
extern "C" fn localization<const N: usize>(
    pyramid: &Pyramid<'static>,
    config: &PointsConfig,
) -> Localization<N> {
    const { assert!(size_of::<Localization<N>>() > 16, "returned in memory") };
    MapLocalizer::new(Localizer::new(*pyramid, LocalizerConfig::DEFAULT), *config)
}
