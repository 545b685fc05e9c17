//! Building the crates in `boards/`.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::Mutex,
};

use anyhow::{Context as _, Result, bail};

use super::root;

/// A crate in `boards/`.
#[derive(Debug, Clone, Copy)]
pub struct Firmware {
    /// Its folder and name.
    pub package: &'static str,
    target: &'static str,
    feature: &'static str,
    /// Whether it is built for size, not as its profile says.
    is_small: bool,
    /// Whether the firmware is linked only if no panic can be reached.
    is_proven: bool,
}

impl Firmware {
    /// The crate as it is.
    #[must_use]
    pub const fn new(package: &'static str, target: &'static str) -> Self {
        Self {
            package,
            target,
            feature: "",
            is_small: false,
            is_proven: false,
        }
    }

    /// The same with a feature.
    #[must_use]
    pub const fn with(self, feature: &'static str) -> Self {
        Self { feature, ..self }
    }

    /// The same, built for size.
    #[must_use]
    pub const fn small(self) -> Self {
        let is_small = true;
        Self { is_small, ..self }
    }

    /// The same, where its programs without semihosting link only if no panic can be reached.
    #[must_use]
    pub const fn proven(self) -> Self {
        let is_proven = true;
        Self { is_proven, ..self }
    }

    /// Builds one of its programs (`""`: the one of its name); gives a copy of the ELF file that nobody overwrites with
    /// another feature's.
    pub fn build(&self, program: &str) -> Result<PathBuf> {
        static ONE_BY_ONE: Mutex<()> = Mutex::new(());
        let _alone = ONE_BY_ONE.lock();
        let target_dir = root().join("target/boards");
        let program = match program {
            "" => self.package,
            other => other,
        };
        let has_proof = program == self.package || matches!(program, "maps" | "mapping" | "stages");
        let proof = match self.is_proven && has_proof {
            true => "prove-no-panic",
            false => "",
        };
        let options = ["--features", self.feature, "--features", proof];
        let built = self.compile(program, &options, &target_dir, "0", None)?;
        let folder =
            target_dir
                .join("elf")
                .join(self.package)
                .join(match (self.feature, self.is_small) {
                    ("", true) => "small",
                    ("", false) => "plain",
                    (feature, _) => feature,
                });
        fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let kept = folder.join(program);
        fs::copy(&built, &kept).with_context(|| built.display().to_string())?;
        Ok(kept)
    }

    /// Builds one of its programs with a line table; gives the ELF file.
    pub fn build_with_lines(&self, program: &str) -> Result<PathBuf> {
        self.compile(program, &[], &root().join("target/profile"), "1", None)
    }

    /// Builds its program `localize` with a table in its flash; gives the ELF file, in a folder of its own.
    pub fn build_in_map(&self, table: &Path) -> Result<PathBuf> {
        let folder = root().join("target/localize");
        self.compile("localize", &[], &folder, "0", Some(table))
    }

    /// Builds one of its programs into a folder, with so much for a debugger; gives the ELF file.
    fn compile(
        &self,
        program: &str,
        options: &[&str],
        target_dir: &Path,
        debug: &str,
        table: Option<&Path>,
    ) -> Result<PathBuf> {
        let folder = root().join("boards").join(self.package);
        let size = ["--config", "profile.release.opt-level=\"z\""];
        let output = cargo()
            .args(["build", "--release", "--bin", program])
            .args(options)
            .args(if self.is_small { &size[..] } else { &[] })
            .env("CARGO_PROFILE_RELEASE_DEBUG", debug)
            .envs(table.map(|table| ("BEAMFIX_FIELD", table)))
            .arg("--target-dir")
            .arg(target_dir)
            .current_dir(&folder)
            .output()
            .with_context(|| format!("cargo could not be started in {}", folder.display()))?;
        if !output.status.success() {
            bail!(
                "boards/{}: {program} does not build (`./test setup` adds the targets):\n{}",
                self.package,
                String::from_utf8_lossy(&output.stderr)
            );
        }
        Ok(target_dir.join(self.target).join("release").join(program))
    }

    /// Builds its test of this name for the board; gives the ELF file.
    pub fn build_test(&self, test: &str) -> Result<PathBuf> {
        let folder = root().join("boards").join(self.package);
        let output = cargo()
            .args(["test", "--release", "--no-run", "--test", test])
            .args(["--message-format", "json"])
            .arg("--target-dir")
            .arg(root().join("target/boards"))
            .current_dir(&folder)
            .output()
            .with_context(|| format!("cargo could not be started in {}", folder.display()))?;
        let messages = String::from_utf8_lossy(&output.stdout);
        let built = messages
            .lines()
            .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
            // The crate's program is built too, and may be told last.
            .filter(|message| message["target"]["name"] == test)
            .filter_map(|message| Some(PathBuf::from(message["executable"].as_str()?)))
            .next_back();
        built.with_context(|| {
            format!(
                "boards/{}: the test {test} does not build:\n{}",
                self.package,
                String::from_utf8_lossy(&output.stderr)
            )
        })
    }
}

fn cargo() -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo
        // The board's own flags count, not those that this program was started with.
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .env_remove("CARGO_BUILD_TARGET")
        // For a debugger, and no emulator has one: half of what the builds leave on the disk. `./test boards` does the same.
        .env("CARGO_PROFILE_RELEASE_DEBUG", "0")
        .stdin(Stdio::null());
    cargo
}
