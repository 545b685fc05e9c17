//! Where the firmware's instructions go: the emulator says each one that it executes.

use std::{
    collections::HashMap,
    fs,
    io::{BufRead as _, BufReader},
    path::Path,
    process::Stdio,
};

use anyhow::{Context as _, Result, anyhow, ensure};
use serde::Serialize;

use super::{
    Board,
    emulator::{self, Folder},
};

/// Instructions of one function, inlined or not, over a drive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Share {
    /// Its path, without type parameters.
    pub function: String,
    /// Executed instructions that stem from its own lines.
    pub instructions: u64,
}

/// Executed instructions of the library alone by function over bytes of an LD06, most first. With `inlined`, code that was
/// inlined counts for the function that it was written in; else for the one that it was compiled into.
pub fn profile(board: &Board, bytes: &[u8], inlined: bool) -> Result<Vec<Share>> {
    let elf = board.firmware.build_with_lines("pipeline")?;
    let counts = executed(board, &elf, bytes)?;
    ensure!(
        !counts.is_empty(),
        "{}: the emulator said nothing",
        board.name
    );
    let loader = addr2line::Loader::new(&elf)
        .map_err(|error| anyhow!("{}: no line table: {error}", elf.display()))?;
    let mut functions: HashMap<String, u64> = HashMap::new();
    for (address, count) in counts {
        *functions
            .entry(function(&loader, address, inlined))
            .or_default() += count;
    }
    let mut shares: Vec<Share> = functions
        .into_iter()
        .map(|(function, instructions)| Share {
            function,
            instructions,
        })
        .collect();
    shares.sort_by(|a, b| (b.instructions, &a.function).cmp(&(a.instructions, &b.function)));
    Ok(shares)
}

/// How often the instruction at each address was executed.
///
/// The emulator says which instructions each block that it translates has, and whenever it enters a block.
fn executed(board: &Board, elf: &Path, input: &[u8]) -> Result<HashMap<u64, u64>> {
    let folder = Folder::new()?;
    fs::write(folder.0.join("input.bin"), input)?;
    let mut command = emulator::start(board, elf);
    command
        .args(["-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native"])
        .args(["-d", "in_asm,exec,nochain"])
        .current_dir(&folder.0)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    let mut child = command.spawn().with_context(|| {
        format!(
            "{} is not there: `./test setup` installs it",
            board.emulator
        )
    })?;
    let said = child.stderr.take().context("no standard error")?;
    let mut blocks: HashMap<u64, Vec<u64>> = HashMap::new();
    let mut entered: HashMap<u64, u64> = HashMap::new();
    let mut translated: Vec<u64> = Vec::new();
    let mut line = String::new();
    let mut reader = BufReader::with_capacity(1 << 20, said);
    while reader.read_line(&mut line)? > 0 {
        if line.starts_with("0x") {
            // `0x00000110:  4a0a  ldr …`
            translated.extend(
                line.split_once(':')
                    .and_then(|(at, _)| hexadecimal(&at[2..])),
            );
        } else if let Some(&start) = translated.first() {
            blocks.insert(start, std::mem::take(&mut translated));
        }
        if let Some((_, rest)) = line
            .split_once("Trace ")
            .and_then(|(_, rest)| rest.split_once('['))
        {
            // `Trace 0: 0x7f… [flags/program counter/…]`
            let start = rest.split('/').nth(1).and_then(hexadecimal);
            *entered
                .entry(start.context("a trace without an address")?)
                .or_default() += 1;
        }
        line.clear();
    }
    let status = child.wait()?;
    ensure!(status.success(), "{}: ended with {status}", board.name);
    let mut counts = HashMap::new();
    for (start, times) in entered {
        for &address in blocks.get(&start).map_or(&[start][..], |block| block) {
            *counts.entry(address).or_default() += times;
        }
    }
    Ok(counts)
}

fn hexadecimal(text: &str) -> Option<u64> {
    u64::from_str_radix(text, 16).ok()
}

/// The function that an address belongs to: the innermost of this project's, or the one that was compiled.
fn function(loader: &addr2line::Loader, address: u64, inlined: bool) -> String {
    let mut found = None;
    if let Ok(mut frames) = loader.find_frames(address) {
        while let Ok(Some(frame)) = frames.next() {
            let name = frame
                .function
                .and_then(|function| Some(plain(&function.demangle().ok()?)));
            let is_ours = name
                .as_ref()
                .is_some_and(|name| name.starts_with("beamfix"));
            found = name.or(found);
            if inlined && is_ours {
                break;
            }
        }
    }
    found.unwrap_or_else(|| {
        loader
            .find_symbol(address)
            .unwrap_or("without a name")
            .to_owned()
    })
}

/// A path without type parameters; of a method of a trait, the type's path and the method's name.
fn plain(name: &str) -> String {
    let depth_at = |name: &str, at: usize| {
        let before = &name[..at];
        before.matches('<').count() as i32 - before.matches('>').count() as i32
    };
    // `<Type as Trait>::method`
    let whole = name
        .match_indices(" as ")
        .find(|&(at, _)| name.starts_with('<') && depth_at(name, at) == 1)
        .map_or_else(
            || name.to_owned(),
            |(at, _)| {
                let method = name.rsplit("::").next().unwrap_or_default();
                format!("{}::{method}", &name[1..at])
            },
        );
    let outside = |&(at, c): &(usize, char)| !"<>".contains(c) && depth_at(&whole, at) == 0;
    let text: String = whole
        .char_indices()
        .filter(outside)
        .map(|(_, c)| c)
        .collect();
    text.replace("::::", "::")
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn a_path_is_told_without_its_parameters() {
        assert_eq!(
            plain("beamfix::scan::points::Points<456>::assign"),
            "beamfix::scan::points::Points::assign"
        );
        assert_eq!(
            plain(
                "<beamfix::odometry::state::Odometry<456> as beamfix::pipeline::estimator::Estimator<456>>::update"
            ),
            "beamfix::odometry::state::Odometry::update"
        );
    }
}
