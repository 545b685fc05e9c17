//! A copy of the checkout in which a constant is changed, and what its programs then measure.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context as _, Result, ensure};
use serde_json::Value;

/// A copy of the checkout under `target/tune`.
#[derive(Debug)]
pub struct Copy {
    folder: PathBuf,
}

impl Copy {
    /// Copies what version control knows of the checkout, changed files as they are now.
    pub fn new(checkout: &Path) -> Result<Self> {
        let folder = checkout.join("target/tune/tree");
        let listed = Command::new("git")
            .current_dir(checkout)
            .args([
                "ls-files",
                "-z",
                "--cached",
                "--others",
                "--exclude-standard",
            ])
            .output()
            .context("git, which lists the checkout's files")?;
        ensure!(
            listed.status.success(),
            "git ls-files: {}",
            String::from_utf8_lossy(&listed.stderr).trim()
        );
        let listed = String::from_utf8(listed.stdout).context("names of files")?;
        for name in listed.split('\0').filter(|name| !name.is_empty()) {
            let (from, to) = (checkout.join(name), folder.join(name));
            // Deleted, but not yet committed.
            let Ok(content) = fs::read(&from) else {
                continue;
            };
            // What is the same keeps its time, so that it is not built again.
            if fs::read(&to).ok().as_ref() == Some(&content) {
                continue;
            }
            if let Some(parent) = to.parent() {
                fs::create_dir_all(parent)?;
            }
            fs::write(&to, content).with_context(|| to.display().to_string())?;
        }
        Ok(Self { folder })
    }

    /// The copy's folder of `src/` files.
    #[must_use]
    pub fn source(&self) -> PathBuf {
        self.folder.join("src")
    }

    /// Builds the tool in the copy.
    pub fn build(&self) -> Result<()> {
        let status = Command::new("cargo")
            .current_dir(&self.folder)
            .args([
                "build",
                "--release",
                "--quiet",
                "-p",
                "host-tests",
                "--bin",
                "beamfix",
            ])
            .env("CARGO_INCREMENTAL", "1")
            .status()
            .context("cargo")?;
        ensure!(status.success(), "the copy does not build with this value");
        Ok(())
    }

    /// Runs the copy's tool; gives the JSON object that it prints.
    pub fn run(&self, args: &[&str]) -> Result<Value> {
        let output = Command::new(self.folder.join("target/release/beamfix"))
            .current_dir(&self.folder)
            .args(args)
            .arg("--json")
            .stderr(Stdio::piped())
            .output()
            .context("the copy's tool")?;
        serde_json::from_slice(&output.stdout).with_context(|| {
            format!(
                "beamfix {}: {}",
                args.join(" "),
                String::from_utf8_lossy(&output.stderr).trim()
            )
        })
    }
}
