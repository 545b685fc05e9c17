//! The packages as somebody gets them: unpacked in an empty folder, built from the archive alone.

use std::{
    fs::{self, File},
    path::PathBuf,
    process::Command,
};

use super::cross::{BOARDS, emulate};
use super::host::{capture, expected};
use super::tools::{archive, folder, has, root, run, sources};

/// A package, unpacked in an empty folder.
fn unpacked(package: &str, into: &str) -> PathBuf {
    let out = root().join("target/c");
    let folder = folder(into);
    run(Command::new(sources().join("packages/pack")).arg(&out));
    let packed = fs::read_dir(out.join("packages"))
        .expect("the packages")
        .filter_map(|entry| Some(entry.ok()?.path()))
        .find(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with(&format!("beamfix-{package}-")) && name.ends_with(".tar.gz")
        })
        .unwrap_or_else(|| panic!("no package for {package}"));
    run(Command::new("tar")
        .arg("-xzf")
        .arg(packed)
        .current_dir(&folder));
    folder.join(package)
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the library is always a release build"
)]
fn every_package_builds_from_its_archive_or_says_that_it_was_not_tested() {
    archive("host");
    let cross = has("arm-none-eabi-gcc") && has("qemu-system-arm");
    if cross {
        archive("thumbv7em-none-eabihf");
    }
    let bytes = capture();
    if has("cmake") && has("cc") {
        let package = unpacked("cmake", "package-cmake");
        let configure = |project: &str, toolchain: &[&str]| {
            let folder = package.join("examples").join(project);
            run(Command::new("cmake")
                .args(["-S", ".", "-B", "build"])
                .args(toolchain)
                .arg(format!("-DCMAKE_PREFIX_PATH={}", package.display()))
                .current_dir(&folder));
            run(Command::new("cmake")
                .args(["--build", "build"])
                .current_dir(&folder));
            folder.join("build/replay")
        };
        let program = configure("replay", &[]);
        let input = package.join("input.bin");
        fs::write(&input, &bytes).expect("the capture");
        let output = Command::new(program)
            .stdin(File::open(&input).expect("the capture"))
            .output()
            .expect("it starts");
        assert_eq!(String::from_utf8_lossy(&output.stdout), expected(&bytes));
        if cross {
            let toolchain = "-DCMAKE_TOOLCHAIN_FILE=toolchain.cmake";
            let program = configure("emulated", &[toolchain]);
            assert_eq!(emulate(&BOARDS[0], &program, &package), expected(&bytes));
        }
    }
    arduino();
    for (package, why) in [
        ("pico-sdk", "the Pico SDK is not installed"),
        ("esp-idf", "ESP-IDF is not installed"),
        ("platformio", "PlatformIO fetches its compilers itself"),
        (
            "arduino",
            "no core of Arduino's that is supported is installed: its sketch is only read as C++",
        ),
    ] {
        println!("left out: the {package} package is not built: {why}");
    }
}

/// The sketch, read as C++ with the headers of Arduino's core for AVR, which no archive is for.
fn arduino() {
    let avr = PathBuf::from("/usr/share/arduino/hardware/arduino/avr");
    if !has("avr-g++") || !avr.is_dir() {
        println!("left out: arduino-core-avr is not installed");
        return;
    }
    let package = unpacked("arduino", "package-arduino");
    run(Command::new("avr-g++")
        .args([
            "-x",
            "c++",
            "-std=gnu++11",
            "-fsyntax-only",
            "-Wall",
            "-mmcu=atmega2560",
        ])
        .args([
            "-DF_CPU=16000000L",
            "-DARDUINO=10819",
            "-include",
            "Arduino.h",
        ])
        .arg("-I")
        .arg(avr.join("cores/arduino"))
        .arg("-I")
        .arg(avr.join("variants/mega"))
        .arg("-I")
        .arg(package.join("src"))
        .arg(package.join("examples/Pose/Pose.ino")));
}
