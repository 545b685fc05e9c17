//! The `beamfix` tool: simulate, replay, match pairs, decode, verify.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
