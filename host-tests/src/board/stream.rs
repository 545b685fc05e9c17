//! A board's UARTs, live: lidar bytes in, frames out, in lockstep.
//!
//! QEMU hands a byte over only when the board's receive register is free, so nothing is lost however slow the
//! board is. The next piece is sent when the frames due for the last one have come; nothing depends on how fast
//! this computer is.

use std::{
    io::{ErrorKind, Read as _, Write as _},
    os::unix::net::{UnixListener, UnixStream},
    path::Path,
    time::{Duration, Instant},
};

use anyhow::{Context as _, Result, bail};
use beamfix_app::{
    link::Receiver,
    telemetry::{Health, LidarState, MotorState, Telemetry},
};

use super::{
    Board, Line,
    emulator::{self, Folder, Running},
};

/// Longest silence of a board that owes an answer.
const TIMEOUT: Duration = Duration::from_secs(60);

/// A board that runs the firmware, connected to this program.
pub struct Stream {
    lidar: UnixStream,
    /// The same socket as `lidar` on a board with one UART.
    telemetry: UnixStream,
    commands: Option<UnixStream>,
    motor: Option<UnixStream>,
    /// QEMU's own command line.
    monitor: UnixStream,
    receiver: Receiver,
    running: Running,
    _folder: Folder,
}

impl Stream {
    /// Builds and starts the firmware; returns when it listens.
    pub fn open(board: &Board) -> Result<Self> {
        let mut stream = Self::start(board)?;
        match stream.receive()? {
            Telemetry::Ready(_) => Ok(stream),
            other => bail!("{}: first came {other:?}, not that it listens", board.name),
        }
    }

    /// Builds and starts the firmware; it listens once it has sent something.
    pub fn start(board: &Board) -> Result<Self> {
        Self::start_program(board, &board.build("")?)
    }

    /// Starts a program that was built already.
    pub fn start_program(board: &Board, elf: &Path) -> Result<Self> {
        let folder = Folder::new()?;
        let mut command = emulator::start(board, elf);
        let mut listeners = Vec::new();
        for (k, line) in board.uarts.iter().enumerate() {
            let path = folder.0.join(format!("uart{k}"));
            listeners.push((*line, UnixListener::bind(&path)?));
            command.arg("-chardev");
            command.arg(format!("socket,id=u{k},path={}", path.display()));
            command.args(["-serial", &format!("chardev:u{k}")]);
        }
        let path = folder.0.join("monitor");
        let monitor = UnixListener::bind(&path)?;
        command.arg("-chardev");
        command.arg(format!("socket,id=monitor,path={}", path.display()));
        command.args(["-mon", "chardev=monitor"]);
        let mut running = Running::spawn(&mut command, board)?;
        let (mut lidar, mut telemetry, mut commands, mut motor) = (None, None, None, None);
        for (line, listener) in listeners {
            let socket = accept(&listener)
                .with_context(|| format!("{}: {}", board.name, running.complaint()))?;
            match line {
                Line::Lidar => lidar = Some(socket),
                Line::Telemetry => telemetry = Some(socket),
                Line::LidarAndTelemetry => {
                    lidar = Some(socket.try_clone()?);
                    telemetry = Some(socket);
                }
                Line::TelemetryAndCommands => {
                    commands = Some(socket.try_clone()?);
                    telemetry = Some(socket);
                }
                Line::Commands => commands = Some(socket),
                Line::Motor => motor = Some(socket),
            }
        }
        let monitor = accept(&monitor).with_context(|| board.name)?;
        let (Some(lidar), Some(telemetry)) = (lidar, telemetry) else {
            bail!("{}: no UART for the lidar or for the frames", board.name);
        };
        telemetry.set_read_timeout(Some(TIMEOUT))?;
        lidar.set_write_timeout(Some(TIMEOUT))?;
        Ok(Self {
            lidar,
            telemetry,
            commands,
            motor,
            monitor,
            receiver: Receiver::new(),
            running,
            _folder: folder,
        })
    }

    /// Sends bytes of the lidar.
    pub fn send(&mut self, bytes: &[u8]) -> Result<()> {
        self.lidar
            .write_all(bytes)
            .context("the board takes no more bytes")
    }

    /// The lidar's line, for a thread of its own.
    pub fn lidar(&self) -> Result<UnixStream> {
        Ok(self.lidar.try_clone()?)
    }

    /// The line for commands, where the board has one.
    pub fn commands(&mut self) -> Option<&mut UnixStream> {
        self.commands.as_mut()
    }

    /// What the board has done to the motor's line since this was last asked: its duties (%), in order.
    pub fn duties(&mut self) -> Result<Vec<u8>> {
        let mut duties = Vec::new();
        if let Some(motor) = &mut self.motor {
            motor.set_nonblocking(true)?;
            match motor.read_to_end(&mut duties) {
                Err(error) if error.kind() != ErrorKind::WouldBlock => return Err(error.into()),
                _ => {}
            }
        }
        Ok(duties)
    }

    /// Resets the board, as a supply that breaks down for a moment does; its memory keeps what it held.
    pub fn reset(&mut self) -> Result<()> {
        Ok(self.monitor.write_all(b"system_reset\n")?)
    }

    /// Reads what comes within this time, as it is: 0 bytes where nothing does.
    pub fn read_for(&mut self, bytes: &mut [u8], time: Duration) -> Result<usize> {
        self.telemetry.set_read_timeout(Some(time))?;
        match self.telemetry.read(bytes) {
            Ok(0) => bail!("the emulator ended: {}", self.running.complaint()),
            Ok(n) => Ok(n),
            Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(0),
            Err(error) => Err(error.into()),
        }
    }

    /// Waits for the next message.
    pub fn receive(&mut self) -> Result<Telemetry> {
        let mut byte = [0];
        loop {
            match self.telemetry.read(&mut byte) {
                Ok(0) => bail!("the emulator ended: {}", self.running.complaint()),
                Ok(_) => {
                    if let Some(message) = self.receiver.push(byte[0]) {
                        return Ok(message);
                    }
                    let errors = self.receiver.counters().errors;
                    if errors > 0 {
                        bail!("{errors} damaged frames from the board");
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    bail!("no answer from the board for {} s", TIMEOUT.as_secs())
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
}

/// Streams lidar bytes through a board's UART and compares every message with what the application sends here.
///
/// Gives the number of poses; an error names the first message that differs.
pub fn compare(board: &Board, bytes: &[u8]) -> Result<usize> {
    let mut app = super::Here::new(board.beams);
    let mut stream = Stream::open(board)?;
    let mut here = Receiver::new();
    let mut poses = 0;
    for piece in bytes.chunks(1024) {
        stream.send(piece)?;
        let mut sent = Vec::new();
        app.lidar(piece, |out| sent.extend_from_slice(out));
        for byte in sent {
            let Some(expected) = here.push::<Telemetry>(byte) else {
                continue;
            };
            let got = timeless(stream.receive()?);
            if format!("{got:?}") != format!("{expected:?}") {
                bail!("{}: pose {poses}: {got:?}, here {expected:?}", board.name);
            }
            poses += usize::from(matches!(expected, Telemetry::Pose(_)));
        }
    }
    Ok(poses)
}

/// Without what a board says by its own clock, which is not the lidar's in an emulator.
fn timeless(message: Telemetry) -> Telemetry {
    match message {
        Telemetry::Health(health) => Telemetry::Health(Health {
            lidar: LidarState::Unknown,
            motor: MotorState::Free,
            motor_restarts: 0,
            ..health
        }),
        other => other,
    }
}

fn accept(listener: &UnixListener) -> Result<UnixStream> {
    listener.set_nonblocking(true)?;
    let end = Instant::now() + TIMEOUT;
    loop {
        match listener.accept() {
            Ok((socket, _)) => {
                socket.set_nonblocking(false)?;
                return Ok(socket);
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock && Instant::now() < end => {
                std::thread::sleep(Duration::from_millis(5));
            }
            Err(error) => return Err(error).context("the emulator does not connect"),
        }
    }
}
