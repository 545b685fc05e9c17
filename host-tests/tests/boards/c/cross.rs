//! The C example built by the microcontrollers' compilers, on the emulated boards: the host's poses.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use host_tests::board::BOARDS as EMULATED;
use object::{Object as _, ObjectSection as _, SectionKind};

use super::host::{capture, expected};
use super::tools::{archive, folder, has, run, sources};

/// A compiler and the machine that runs what it makes.
#[derive(Clone, Copy)]
pub struct Board {
    pub name: &'static str,
    target: &'static str,
    compiler: &'static str,
    flags: &'static [&'static str],
    flash_start: u32,
    ram: (u32, u32),
    emulator: &'static [&'static str],
}

pub const BOARDS: [Board; 4] = [
    Board {
        name: "m4f",
        target: "thumbv7em-none-eabihf",
        compiler: "arm-none-eabi-gcc",
        flags: &["-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"],
        flash_start: 0,
        ram: (0x2000_0000, 64 << 10),
        emulator: &["qemu-system-arm", "-M", "mps2-an386"],
    },
    Board {
        name: "m3",
        target: "thumbv7m-none-eabi",
        compiler: "arm-none-eabi-gcc",
        flags: &["-mcpu=cortex-m3"],
        flash_start: 0,
        ram: (0x2000_0000, 64 << 10),
        emulator: &["qemu-system-arm", "-M", "mps2-an385"],
    },
    Board {
        name: "m0",
        target: "thumbv6m-none-eabi",
        compiler: "arm-none-eabi-gcc",
        flags: &["-mcpu=cortex-m0"],
        flash_start: 0,
        ram: (0x2000_0000, 16 << 10),
        emulator: &["qemu-system-arm", "-M", "microbit"],
    },
    Board {
        name: "rv32",
        target: "riscv32imc-unknown-none-elf",
        compiler: "riscv64-unknown-elf-gcc",
        flags: &["-march=rv32imc", "-mabi=ilp32", "-mcmodel=medany"],
        flash_start: 0x8000_0000,
        ram: (0x8040_0000, 64 << 10),
        emulator: &["qemu-system-riscv32", "-M", "virt", "-bios", "none"],
    },
];

impl Board {
    /// The same with so much RAM (bytes).
    pub fn with_ram(self, bytes: u32) -> Self {
        let ram = (self.ram.0, bytes);
        Self { ram, ..self }
    }

    /// Compiles an example; `None` where a tool is missing.
    pub fn compile(&self, into: &Path, example: &[&Path]) -> Option<PathBuf> {
        self.compile_with(into, example, &[])
    }

    /// The same with more flags.
    fn compile_with(&self, into: &Path, example: &[&Path], flags: &[&str]) -> Option<PathBuf> {
        let emulator = self.emulator.first()?;
        if !has(self.compiler) || !has(emulator) {
            println!("left out: the C example on {}", self.name);
            return None;
        }
        let program = into.join(self.name);
        run(Command::new(self.compiler)
            .args(self.flags)
            .args(flags)
            .args([
                "-std=gnu99",
                "-Os",
                "-ffreestanding",
                "-nostdlib",
                "-ffunction-sections",
            ])
            .args(["-Wall", "-Wextra", "-Werror"])
            .arg("-I")
            .arg(sources().join("include"))
            .args(example)
            .arg(sources().join("emulated/platform_qemu.c"))
            .arg(archive(self.target))
            .arg("-lgcc")
            .args(["-Wl,--gc-sections", "-Wl,-z,noexecstack", "-T"])
            .arg(sources().join("emulated/board.ld"))
            .arg(format!("-Wl,--defsym=FLASH_START={}", self.flash_start))
            .arg(format!("-Wl,--defsym=RAM_START={}", self.ram.0))
            .arg(format!("-Wl,--defsym=RAM_BYTES={}", self.ram.1))
            .arg("-o")
            .arg(&program)
            .current_dir(into));
        Some(program)
    }
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the library is always a release build"
)]
fn the_c_example_finds_the_hosts_poses_on_every_core() {
    let folder = folder("cross");
    let bytes = capture();
    fs::write(folder.join("input.bin"), &bytes).expect("the capture");
    let expected = expected(&bytes);
    for board in &BOARDS {
        let Some(program) = board.compile(&folder, &[&sources().join("examples/replay.c")]) else {
            continue;
        };
        assert_eq!(
            emulate(board, &program, &folder),
            expected,
            "{}",
            board.name
        );
    }
}

/// Fewest bytes of the stack that the C example must never touch on the board with 16 KB of RAM.
const LEFT: u32 = 64;

/// It once ran out of stack, and its poses were wrong without a word.
#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the library is always a release build"
)]
fn the_c_example_has_stack_left_on_the_board_with_16_kb() {
    let folder = folder("stack");
    // Five revolutions, five from before them: from one to the other no match is found, and every start is tried.
    let bytes = capture();
    let jumping: Vec<u8> = bytes.chunks(190 * 47).rev().flatten().copied().collect();
    let board = BOARDS.iter().find(|board| board.name == "m0");
    let board = board.expect("it is there");
    let example = sources().join("examples/replay.c");
    let Some(program) = board.compile_with(&folder, &[&example], &["-DSHOW_STACK"]) else {
        return;
    };
    for (what, bytes) in [("a drive", bytes), ("jumps", jumping)] {
        fs::write(folder.join("input.bin"), &bytes).expect("the capture");
        let said = emulate(board, &program, &folder);
        let left = said
            .lines()
            .find_map(|line| line.strip_prefix("stack left: "))
            .and_then(|left| u32::from_str_radix(left, 16).ok());
        let left = left.unwrap_or_else(|| panic!("{what}: {said}"));
        println!("{what}: {left} bytes of the stack are left");
        assert!(
            left >= LEFT,
            "{what}: {left} bytes of the stack are left, {LEFT} must be"
        );
    }
}

/// What a program prints on a board, run in a folder with its `input.bin`.
pub fn emulate(board: &Board, program: &Path, folder: &Path) -> String {
    let [emulator, machine @ ..] = board.emulator else {
        panic!("{} has no emulator", board.name);
    };
    let output = run(Command::new("timeout")
        .args(["300", emulator])
        .args(machine)
        .args(["-display", "none", "-monitor", "none", "-serial", "null"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(program)
        .current_dir(folder));
    // The emulator's console for semihosting is its standard error or output.
    String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned()
}

/// Bytes of a program that lie in flash: code and constants, and the first values of what is in RAM.
fn flash_bytes(program: &Path) -> (u64, u64) {
    let bytes = fs::read(program).expect("the program");
    let file = object::File::parse(&*bytes).expect("an ELF file");
    let (mut fixed, mut first_values) = (0, 0);
    for section in file.sections() {
        match section.kind() {
            SectionKind::Text | SectionKind::ReadOnlyData | SectionKind::ReadOnlyString => {
                fixed += section.size();
            }
            SectionKind::Data => first_values += section.size(),
            _ => {}
        }
    }
    (fixed, first_values)
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the library is always a release build"
)]
fn the_c_example_is_at_most_4_kb_larger_than_the_same_calls_in_rust() {
    let folder = folder("size");
    for board in &BOARDS {
        let Some(rust) = EMULATED
            .iter()
            .find(|other| other.name == board.name && other.name != "rv32")
        else {
            continue;
        };
        let Some(program) = board.compile(&folder, &[&sources().join("examples/replay.c")]) else {
            continue;
        };
        let rust = rust
            .build("pipeline")
            .unwrap_or_else(|error| panic!("{error:#}"));
        let ((c, c_data), (rust, rust_data)) = (flash_bytes(&program), flash_bytes(&rust));
        println!(
            "{}: C {c} + {c_data} bytes of code, constants and first values; Rust {rust} + {rust_data}",
            board.name
        );
        // A Rust static of the pipeline has its first values in flash, C's memory has none: they do not count.
        assert!(
            c + c_data <= rust + 4096,
            "{}: {c} + {c_data}, Rust {rust}",
            board.name
        );
    }
}
