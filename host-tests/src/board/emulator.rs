//! QEMU as a child process that does not outlive this one's interest in it.

use std::{
    fs,
    io::Read as _,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::atomic::{AtomicU32, Ordering},
    time::{Duration, Instant},
};

use anyhow::{Context as _, Result, bail};

use super::Board;

/// Longest that a program may take: a hundred times what one does take.
const TIMEOUT: Duration = Duration::from_secs(600);

/// Whether instructions are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// Exactly; slower.
    Exact,
    /// Not at all: what the program reports as instructions means nothing.
    None,
}

/// Runs a program that reads `input.bin` and leaves `output.bin`.
pub fn run(board: &Board, elf: &Path, input: &[u8], count: Count) -> Result<Vec<u8>> {
    let folder = Folder::new()?;
    fs::write(folder.0.join("input.bin"), input)?;
    let mut command = start(board, elf);
    command
        .args(["-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native"])
        .current_dir(&folder.0);
    if count == Count::Exact {
        command.arg("-icount");
        command.arg(format!("shift={},sleep=off", board.icount_shift));
    }
    let mut child = Running::spawn(&mut command, board)?;
    let status = child.wait(TIMEOUT)?;
    if status != 0 {
        bail!(
            "{}: {} ended with status {status}: {}",
            board.name,
            elf.display(),
            child.complaint()
        );
    }
    Ok(fs::read(folder.0.join("output.bin"))?)
}

/// The emulator with the program `demo`, which prints to standard output and ends by itself.
pub fn demo(board: &Board) -> Result<Command> {
    let elf = board.firmware.with("demo").build("demo")?;
    let mut command = start(board, &elf);
    command
        .args(["-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native"]);
    Ok(command)
}

/// Runs one test of an ELF file made with embedded-test, as probe-rs does: by its address. Gives the exit status.
pub fn run_test(board: &Board, elf: &Path, address: u32) -> Result<i32> {
    let mut command = start(board, elf);
    command
        .args(["-serial", "none", "-semihosting-config"])
        .arg(format!(
            "enable=on,target=native,arg=run_addr,arg={address}"
        ));
    Running::spawn(&mut command, board)?.wait(Duration::from_secs(60))
}

/// The emulator with a program, without any connection to it.
pub(super) fn start(board: &Board, elf: &Path) -> Command {
    let mut command = Command::new(board.emulator);
    command
        .args(board.machine)
        .args(["-display", "none", "-monitor", "none"])
        .arg("-kernel")
        .arg(elf);
    command
}

/// A child that is killed when it is dropped.
pub(super) struct Running(Child);

impl Running {
    pub(super) fn spawn(command: &mut Command, board: &Board) -> Result<Self> {
        let child = command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| {
                format!(
                    "{} is not there: `./test setup` installs it",
                    board.emulator
                )
            })?;
        Ok(Self(child))
    }

    fn wait(&mut self, timeout: Duration) -> Result<i32> {
        let end = Instant::now() + timeout;
        loop {
            if let Some(status) = self.0.try_wait()? {
                return Ok(status.code().unwrap_or(-1));
            }
            if Instant::now() > end {
                bail!("the emulator did not end within {} s", timeout.as_secs());
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// What it wrote to its standard error; waits for its end.
    pub(super) fn complaint(&mut self) -> String {
        let _ = self.0.kill();
        let mut text = String::new();
        if let Some(stderr) = &mut self.0.stderr {
            let _ = stderr.read_to_string(&mut text);
        }
        text.trim().to_string()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A folder of its own for every run, gone afterwards. Its path is short: a socket's may have 107 bytes.
pub(super) struct Folder(pub(super) PathBuf);

impl Folder {
    pub(super) fn new() -> Result<Self> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let name = format!(
            "beamfix-{}-{}",
            std::process::id(),
            NEXT.fetch_add(1, Ordering::Relaxed)
        );
        let path = std::env::temp_dir().join(name);
        fs::create_dir_all(&path).with_context(|| format!("no folder {}", path.display()))?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
