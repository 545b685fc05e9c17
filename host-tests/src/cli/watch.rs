//! `watch`: draws what a board sends while it sends.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use beamfix::lidar::Model;
use beamfix_app::command::Command;
use beamfix_sim::drive::{Settings, drive};
use beamfix_sim::encoder::ld06::Sensor;
use host_tests::board::{Board, commands::Commands, stream::Stream};
use host_tests::bringup;
use host_tests::report::live::ADDRESS;
use host_tests::report::picture::{self, Kind};
use host_tests::report::terminal::View;
use host_tests::watch::Watch;
use serde_json::json;

use super::output;

/// Follow a board by its telemetry: a picture that is drawn again and again, in the terminal too (a line where there is
/// none), and, where the board sends it, a recording of the lidar's bytes that `replay` reads.
#[derive(clap::Args)]
pub struct Args {
    /// Where the frames come from: a file or a serial line, `tcp:HOST:PORT`, or `-` for standard input.
    #[arg(required_unless_present = "board")]
    source: Option<String>,
    /// Start this emulated board and drive it through the simulated flat.
    #[arg(long, value_name = "NAME", conflicts_with = "source")]
    board: Option<String>,
    /// How long the simulated drive takes.
    #[arg(long, default_value_t = 60.0, value_name = "S")]
    seconds: f64,
    /// The picture, .png or .svg.
    #[arg(long, value_name = "FILE", default_value = "target/beamfix/live.png")]
    out: PathBuf,
    /// Seconds between two pictures.
    #[arg(long, default_value_t = 1.0, value_name = "S")]
    every: f64,
    /// Ask the board for the lidar's bytes and write them here.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Ask the board how good each match was and write it here: a line of CSV for each.
    #[arg(long, value_name = "FILE")]
    quality: Option<PathBuf>,
    /// Tell the board which lidar hangs on it, where its firmware has a choice (feature `any-lidar`): a name of `lidars`.
    #[arg(long, value_name = "NAME")]
    lidar: Option<String>,
    /// Print a line instead of drawing in the terminal.
    #[arg(long)]
    plain: bool,
    /// Serve scans and poses to Foxglove or Lichtblick at ws://HOST:PORT, 127.0.0.1:8765 unless told; needs a build with
    /// `--features host-tests/foxglove`.
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, require_equals = true, default_missing_value = ADDRESS)]
    foxglove: Option<String>,
    /// The serial line's speed.
    #[arg(long, value_name = "BAUD", default_value_t = 921_600)]
    baud: u32,
    /// Give up where nothing comes over TCP for so long.
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    timeout: f64,
    /// Stop after so many poses.
    #[arg(long, value_name = "N")]
    poses: Option<u32>,
    /// Print one JSON object at the end.
    #[arg(long)]
    json: bool,
}

/// Bytes of an LD06 a second.
const RATE: f64 = 4500.0 / 12.0 * 47.0;

/// Reads until the end, draws.
pub fn run(args: &Args) -> Result<ExitCode> {
    if !(args.every.is_finite() && args.every >= 0.0) {
        bail!("--every {}: not a time", args.every);
    }
    if !(args.seconds.is_finite() && args.seconds > 0.0) {
        bail!("--seconds {}: not a time", args.seconds);
    }
    Kind::of(&args.out).context("--out")?;
    if !(args.timeout.is_finite() && args.timeout > 0.0) {
        bail!("--timeout {}: not a time", args.timeout);
    }
    let source = args.source.as_deref().map(Path::new);
    let written = [
        args.record.as_deref(),
        args.quality.as_deref(),
        Some(&args.out),
    ];
    output::spare(source.as_slice(), &written)?;
    if let Some(lidar) = &args.lidar
        && Model::named(lidar).is_none()
    {
        bail!("--lidar {lidar}: `lidars` lists the names");
    }
    let recording = args.record.as_deref().map(output::create).transpose()?;
    let qualities = args.quality.as_deref().map(output::create).transpose()?;
    let mut live = Live {
        args,
        watch: Watch::new(recording, qualities)?,
        drawn: Instant::now(),
        silent: false,
        view: if args.plain { None } else { View::open() },
    };
    live.watch.server = output::serve(args.foxglove.as_deref())?;
    if let Some(folder) = args.out.parent() {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    match (&args.board, args.source.as_deref()) {
        (Some(name), _) => live.board(Board::named(name)?)?,
        (None, Some("-")) => live.follow(io::stdin().lock(), "-")?,
        (None, Some(source)) => match source.strip_prefix("tcp:") {
            Some(address) => {
                let patience = Duration::from_secs_f64(args.timeout);
                let stream = connected(address, patience)
                    .with_context(|| format!("{source}: no connection"))?;
                stream.set_read_timeout(Some(patience))?;
                let mut commands = stream.try_clone()?;
                live.ask(&mut commands);
                live.follow(stream, source)?;
            }
            None => match line(source, args.baud)? {
                Line::Serial(mut port) => {
                    live.ask(&mut port);
                    live.follow(port, source)?;
                }
                Line::File(file) => {
                    // A pipe may take commands too; a file does not.
                    if !file.metadata()?.is_file()
                        && let Ok(mut commands) = File::options().append(true).open(source)
                    {
                        live.ask(&mut commands);
                    }
                    live.follow(file, source)?;
                }
            },
        },
        (None, None) => bail!("neither a source nor a board"),
    }
    live.finish()
}

struct Live<'a> {
    args: &'a Args,
    watch: Watch<BufWriter<File>>,
    drawn: Instant,
    /// Nothing came for as long as one waits.
    silent: bool,
    /// The terminal, where there is one.
    view: Option<View>,
}

impl Live<'_> {
    /// Reads a source to its end.
    fn follow(&mut self, mut source: impl Read, name: &str) -> Result<()> {
        let mut bytes = [0; 4096];
        loop {
            let n = match source.read(&mut bytes) {
                Ok(n) => n,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error)
                    if [ErrorKind::WouldBlock, ErrorKind::TimedOut].contains(&error.kind()) =>
                {
                    self.silent = true;
                    return Ok(());
                }
                Err(error) => return Err(error).with_context(|| name.to_owned()),
            };
            self.watch.push(&bytes[..n])?;
            if n == 0 || self.is_enough() {
                return Ok(());
            }
            self.show()?;
        }
    }

    /// Asks whoever listens for beams, and for the lidar's bytes where they are recorded.
    fn ask(&self, commands: &mut impl Write) {
        let mut asked = Commands::new();
        if let Some(lidar) = (self.args.lidar.as_deref()).filter(|_| self.watch.poses == 0) {
            asked.send(&Command::Choose { lidar });
        }
        asked.send(&Command::Send {
            raw: self.args.record.is_some(),
            scans: true,
            quality: true,
        });
        asked.ask_ready();
        asked.ask_health();
        let _ = commands.write_all(asked.bytes());
    }

    /// Drives an emulated board through the flat, at the lidar's own speed.
    fn board(&mut self, board: &Board) -> Result<()> {
        let settings = Settings {
            seconds: self.args.seconds,
            ..Settings::DEFAULT
        };
        let bytes = drive(&settings, &mut Sensor::ld06()).bytes;
        let mut stream = Stream::open(board)?;
        if let Some(commands) = stream.commands() {
            self.ask(commands);
            self.until_health(&mut stream)?;
        } else if self.args.record.is_some() || self.args.quality.is_some() {
            bail!(
                "--record, --quality: {} has no line for commands",
                board.name
            );
        }
        let mut lidar = stream.lidar()?;
        let feeder = thread::spawn(move || -> io::Result<()> {
            let start = Instant::now();
            for (k, packet) in bytes.chunks(47).enumerate() {
                let due = Duration::from_secs_f64(k as f64 * 47.0 / RATE);
                thread::sleep(due.saturating_sub(start.elapsed()));
                lidar.write_all(packet)?;
            }
            Ok(())
        });
        let mut bytes = [0; 4096];
        while !feeder.is_finished() && !self.is_enough() {
            let n = stream.read_for(&mut bytes, Duration::from_millis(100))?;
            self.watch.push(&bytes[..n])?;
            self.show()?;
        }
        if !self.is_enough() {
            match feeder.join() {
                Ok(fed) => fed.context("the board takes no more bytes")?,
                Err(_) => bail!("the lidar's thread ended early"),
            }
        }
        // What is still on its way: until nothing comes.
        loop {
            let n = stream.read_for(&mut bytes, Duration::from_millis(1000))?;
            self.watch.push(&bytes[..n])?;
            if n == 0 || self.is_enough() {
                break;
            }
        }
        if let Some(commands) = stream.commands() {
            self.ask(commands);
            self.until_health(&mut stream)?;
        }
        Ok(())
    }

    fn until_health(&mut self, stream: &mut Stream) -> Result<()> {
        self.watch.health = None;
        let mut bytes = [0; 4096];
        for _ in 0..100 {
            let n = stream.read_for(&mut bytes, Duration::from_millis(100))?;
            self.watch.push(&bytes[..n])?;
            if self.watch.health.is_some() {
                return Ok(());
            }
        }
        bail!("the board does not answer a command")
    }

    fn is_enough(&self) -> bool {
        self.args
            .poses
            .is_some_and(|poses| self.watch.poses >= poses)
    }

    /// Draws, where it is time to.
    fn show(&mut self) -> Result<()> {
        if self.drawn.elapsed().as_secs_f64() >= self.args.every {
            self.draw()?;
            if self.view.is_none() {
                eprintln!("{}", self.watch.status());
            }
        }
        Ok(())
    }

    fn draw(&mut self) -> Result<()> {
        let from = self.args.board.as_deref().or(self.args.source.as_deref());
        let title = format!("beamfix: live from {}", from.unwrap_or("-"));
        // Whoever looks at it never sees half a picture.
        let next = self
            .args
            .out
            .with_extension(match Kind::of(&self.args.out)? {
                Kind::Png => "next.png",
                Kind::Svg => "next.svg",
            });
        let map = self.watch.map(&title);
        picture::save(&map, &next)?;
        replace(&next, &self.args.out)?;
        if let Some(server) = &mut self.watch.server {
            server.seen(&map.points);
        }
        if let Some(view) = &mut self.view {
            view.draw(&map).context("the terminal")?;
        }
        self.drawn = Instant::now();
        Ok(())
    }

    fn finish(mut self) -> Result<ExitCode> {
        self.watch.finish()?;
        if self.watch.poses == 0 {
            let counters = self.watch.counters();
            let silence = if self.silent {
                format!("; nothing came for {} s", self.args.timeout)
            } else {
                String::new()
            };
            bail!(
                "no pose: {} frames understood, {} damaged{silence}",
                counters.frames,
                counters.errors
            );
        }
        self.draw()?;
        if let Some(view) = self.view.take() {
            view.close();
        }
        let watch = &self.watch;
        let counters = watch.counters();
        let value = json!({
            "poses": watch.poses, "missing": watch.missing, "starts": watch.starts,
            "frames": counters.frames, "damaged": counters.errors,
            "recorded_bytes": watch.recorded, "qualities": watch.qualities_seen, "weak": watch.weak, "pose_hash": watch.hash.to_string(),
            "bytes_lost": watch.health.map(|health| health.bytes_lost),
        });
        let text = format!("{}\n{}", watch.status(), self.args.out.display());
        output::report(self.args.json, &value, &text)?;
        if self.silent {
            bail!(
                "the board fell silent: nothing came for {} s",
                self.args.timeout
            );
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Where frames come from that is no network.
enum Line {
    Serial(Box<dyn serialport::SerialPort>),
    File(File),
}

/// Opens a serial line at its speed, or a file.
fn line(source: &str, baud: u32) -> Result<Line> {
    /// Nothing comes for so long where nothing is wrong: a board is silent while it starts.
    const PATIENCE: Duration = Duration::from_secs(3600);
    let is_file = fs::metadata(source).is_ok_and(|data| data.is_file());
    if !is_file && let Ok(port) = serialport::new(source, baud).timeout(PATIENCE).open() {
        return Ok(Line::Serial(port));
    }
    // A pipe, or a terminal that is no serial line.
    let file = File::open(source).map_err(|error| {
        let is_line = source.starts_with("/dev/tty") || source.to_uppercase().starts_with("COM");
        let advice = match is_line {
            true => bringup::advice(error.kind()),
            false => String::new(),
        };
        anyhow::Error::new(error).context(format!("{source}{advice}"))
    })?;
    Ok(Line::File(file))
}

/// A connection to the first address that answers in time.
fn connected(address: &str, patience: Duration) -> io::Result<TcpStream> {
    let mut last = io::Error::from(ErrorKind::NotFound);
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, patience) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = error,
        }
    }
    Err(last)
}

fn replace(new: &Path, old: &Path) -> Result<()> {
    fs::rename(new, old).with_context(|| old.display().to_string())
}
