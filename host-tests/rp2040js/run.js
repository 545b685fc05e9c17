// Runs an RP2040 ELF in rp2040js: the lidar's bytes go into UART 1 at their exact times, what UART 0 sends is kept.
//
//   node run.js FIRMWARE.elf JOB.json
//
// The job: {"lidar": FILE, "telemetry": FILE, "baud": 230400, "pieces": [[at, µs]…], "bursts": [[at, count]…], "rest": 0.2}
//   lidar      the bytes to send; "telemetry" gets what comes back
//   pieces     the piece from byte `at` on begins so long after the start, or when the line is free
//   rest       goes on for so long (s) after the last byte
//   bursts     so many bytes arrive in the very same moment, as if the core had been held up for so long
// Prints one JSON object: sent, overruns (bytes that found the UART's FIFO full), seconds, cycles, sleeping, reset (when the
// watchdog bit, s, or null: it ends there), duties (of the motor's line: [s, %] at each change).
const fs = require('fs');
const { chip, NS } = require('./chip.js');

const [elfFile, jobFile] = process.argv.slice(2);
const job = JSON.parse(fs.readFileSync(jobFile));
const lidar = fs.readFileSync(job.lidar);
const BYTE_NS = 10e9 / job.baud;
/// How long the firmware may take to start.
const START_NS = 1e9;
const END_NS = 1e9 * job.rest;

const { clock, mcu } = chip(elfFile);
let resetNs = null;
mcu.peripherals[0x40058].onWatchdogTrigger = () => (resetNs ??= clock.nanos);
const duties = [];
// The motor's line is GP6: slice 3, channel A.
const slice = mcu.pwm.channels[3];
const set = slice.writeRegister.bind(slice);
slice.writeRegister = (offset, value) => {
  set(offset, value);
  const duty = Math.round((100 * (slice.cc & 0xffff)) / (slice.top + 1));
  if (slice.top < 0xffff && duty !== duties.at(-1)?.[1]) duties.push([clock.nanos, duty]);
};
const telemetry = [];
mcu.uart[0].onByte = (byte) => telemetry.push(byte);

let [cycles, sleeping, overruns, sent, startNs, lastNs] = [0, 0, 0, 0, 0, 0];
let nextNs = Infinity;
const bursts = new Map(job.bursts || []);
const pieces = new Map(job.pieces || []);
let burst = 0;
const uart = mcu.uart[1];

function arrive() {
  if (uart.rxFIFO.full) {
    overruns++;
    uart.overrun();
  } else uart.feedByte(lidar[sent]);
  sent++;
  lastNs = clock.nanos;
  if (bursts.has(sent)) burst = bursts.get(sent);
  if (burst > 0) {
    burst--;
    return;
  }
  nextNs += BYTE_NS;
  if (pieces.has(sent)) nextNs = Math.max(nextNs, startNs + 1e3 * pieces.get(sent));
}

for (;;) {
  // 1.4.1 falls asleep though an interrupt is pending, and sleeps through SysTick's; Arm's core does neither.
  if (mcu.core.waiting && mcu.core.checkForInterrupts()) mcu.core.waiting = false;
  if (mcu.core.waiting) {
    // To the next thing that can happen, but not over it.
    const step = Math.max(NS, Math.min(clock.nanosToNextAlarm || 1e4, 1e4, sent < lidar.length ? nextNs - clock.nanos : 1e4));
    clock.tick(step);
    if (sent > 0 && sent < lidar.length) sleeping += step / NS;
  } else {
    const taken = mcu.core.executeInstruction();
    clock.tick(taken * NS);
    if (sent > 0 && sent < lidar.length) cycles += taken;
  }
  if (nextNs === Infinity && sent === 0 && telemetry.length > 0) {
    // The firmware has said that it listens.
    nextNs = startNs = lastNs = clock.nanos;
  }
  while (clock.nanos >= nextNs && sent < lidar.length) arrive();
  if (nextNs !== Infinity && sent === lidar.length && clock.nanos > lastNs + END_NS) break;
  if (resetNs !== null) break;
  if (nextNs === Infinity && clock.nanos > START_NS) {
    console.error(`the firmware says nothing for ${START_NS / 1e9} s`);
    process.exit(1);
  }
}
fs.writeFileSync(job.telemetry, Buffer.from(telemetry));
const seconds = (lastNs - startNs) / 1e9;
const since = (ns) => (ns - startNs) / 1e9;
console.log(
  JSON.stringify({
    sent,
    overruns,
    seconds,
    cycles,
    sleeping: Math.round(sleeping),
    reset: resetNs === null ? null : since(resetNs),
    duties: duties.map(([ns, duty]) => [since(ns), duty]),
  }),
);
