//! The twin of a robot for a page in the browser: the simulator or a recording, and behind it the firmware's pipeline.
//!
//! ```text
//! live    a robot that is driven by hand, its lidar's bytes ─┐
//! replay  the pieces or scans of a recording ────────────────┴▶ twin: pipelines, poses, hash ─▶ view ─▶ page
//! ```
//!
//! The page is plain JavaScript over these functions and the module's memory: it writes into [`input`], calls, and reads
//! the [`output`] whose length the call gave. An instance serves one drive or one recording; the page makes a new one for
//! the next.

mod live;
mod replay;
mod twin;
mod view;

use std::cell::RefCell;
use std::sync::Mutex;

use beamfix_sim::TruePose;
use host_tests::size;
use serde_json::json;

use twin::Twin;

/// All that an instance has.
#[derive(Default)]
struct Instance {
    twin: Option<Twin>,
    input: Vec<u8>,
    output: Vec<u8>,
}

thread_local! {
    static INSTANCE: RefCell<Instance> = RefCell::default();
}

/// What went wrong where the module trapped.
static PANIC: Mutex<String> = Mutex::new(String::new());

fn with<R>(of: impl FnOnce(&mut Instance) -> R) -> R {
    INSTANCE.with_borrow_mut(of)
}

impl Instance {
    fn answer(&mut self, output: Vec<u8>) -> usize {
        self.output = output;
        self.output.len()
    }

    /// Keeps a new twin; answers with nothing, or with why there is none.
    fn begin(&mut self, twin: anyhow::Result<Twin>) -> usize {
        match twin {
            Ok(twin) => {
                self.twin = Some(twin);
                0
            }
            Err(error) => self.answer(format!("{error:#}").into_bytes()),
        }
    }
}

/// Room for so many bytes that the page writes before its next call.
#[unsafe(no_mangle)]
pub extern "C" fn input(length: usize) -> *mut u8 {
    with(|instance| {
        instance.input = vec![0; length];
        instance.input.as_mut_ptr()
    })
}

/// Where the last call's answer lies.
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    with(|instance| instance.output.as_ptr())
}

/// Why the module trapped; also keeps messages of later panics.
#[unsafe(no_mangle)]
pub extern "C" fn panicked() -> usize {
    std::panic::set_hook(Box::new(|panic| {
        if let Ok(mut text) = PANIC.lock() {
            *text = panic.to_string();
        }
    }));
    let text = PANIC.lock().map(|text| text.clone()).unwrap_or_default();
    // A trap may have left the instance borrowed.
    INSTANCE.with(|instance| match instance.try_borrow_mut() {
        Ok(mut instance) => instance.answer(text.into_bytes()),
        Err(_) => 0,
    })
}

/// What there is to choose from, as JSON: `worlds` and `lidars`, each a list of names and words.
#[unsafe(no_mangle)]
pub extern "C" fn choices() -> usize {
    let lidars: Vec<_> = live::lidars()
        .map(|model| {
            let rate = f64::from(model.revolutions_per_10s) / 10.0;
            let words = format!("{} beams, {rate} Hz", size::beams_of(model));
            [model.name.to_owned(), words]
        })
        .collect();
    let answer = json!({ "worlds": beamfix_sim::place::NAMES, "lidars": lidars });
    with(|instance| instance.answer(answer.to_string().into_bytes()))
}

/// Begins a drive: the input is the lidar's name, a line feed, and a world's name or its description.
#[unsafe(no_mangle)]
pub extern "C" fn drive(seed: u32) -> usize {
    with(|instance| {
        let text = String::from_utf8_lossy(&instance.input).into_owned();
        let (lidar, world) = text.split_once('\n').unwrap_or((&text, "flat"));
        instance.begin(live::Live::start(lidar, world, u64::from(seed)).and_then(Twin::drive))
    })
}

/// Begins a replay: the input is a file's name, a line feed, a lidar's name (for a capture without one) or `auto`, a line
/// feed, and the file's bytes.
#[unsafe(no_mangle)]
pub extern "C" fn open() -> usize {
    with(|instance| {
        let input = std::mem::take(&mut instance.input);
        let mut parts = input.splitn(3, |&byte| byte == b'\n');
        let mut text = || String::from_utf8_lossy(parts.next().unwrap_or_default()).into_owned();
        let (name, lidar) = (text(), text());
        let bytes = parts.next().unwrap_or_default().to_vec();
        let replay = replay::Replay::open(&name, &lidar, bytes);
        instance.begin(replay.and_then(Twin::replay))
    })
}

/// Lets the robot drive for `seconds` towards a speed (m/s) and a rate of turn (rad/s).
#[unsafe(no_mangle)]
pub extern "C" fn advance(seconds: f64, speed: f64, turn: f64) {
    with(|instance| {
        if let Some(twin) = &mut instance.twin {
            twin.advance(seconds, (speed, turn));
        }
    });
}

/// Replays up to so many scans; gives how many are left.
#[unsafe(no_mangle)]
pub extern "C" fn step(scans: usize) -> usize {
    with(|instance| {
        let twin = instance.twin.as_mut();
        twin.map_or(0, |twin| twin.step(scans))
    })
}

/// Puts the robot elsewhere (m, rad); its wheels do not know. 0 where it stands in a wall there, and stays.
#[unsafe(no_mangle)]
pub extern "C" fn carry(x: f64, y: f64, theta: f64) -> u32 {
    with(|instance| {
        let twin = instance.twin.as_mut();
        u32::from(twin.is_some_and(|twin| twin.carry(TruePose::new(x, y, theta))))
    })
}

/// Puts the robot at some free place.
#[unsafe(no_mangle)]
pub extern "C" fn kidnap() {
    with(|instance| {
        if let Some(twin) = &mut instance.twin {
            twin.kidnap();
        }
    });
}

/// The recording of the drive so far, for `beamfix replay`.
#[unsafe(no_mangle)]
pub extern "C" fn recording() -> usize {
    with(|instance| {
        let bytes = instance.twin.as_ref().and_then(Twin::recording);
        instance.answer(bytes.unwrap_or_default())
    })
}

/// What is to be drawn, by its number: `view::Part` in the source has them.
#[unsafe(no_mangle)]
pub extern "C" fn look(part: u32) -> usize {
    with(|instance| {
        let twin = instance.twin.as_mut();
        let bytes = twin.and_then(|twin| twin.look(view::Part::of(part)?));
        instance.answer(bytes.unwrap_or_default())
    })
}
