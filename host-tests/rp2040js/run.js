// Runs an RP2040 ELF in rp2040js: the lidar's bytes go into UART 1 at their exact times, what UART 0 sends is kept.
//
//   node run.js FIRMWARE.elf JOB.json
//
// The job: {"lidar": FILE, "telemetry": FILE, "baud": 230400, "pieces": [[at, µs]…], "bursts": [[at, count]…]}
//   lidar      the bytes to send; "telemetry" gets what comes back
//   pieces     the piece from byte `at` on begins so long after the start, or when the line is free
//   bursts     so many bytes arrive in the very same moment, as if the core had been held up for so long
// Prints one JSON object: sent, overruns (bytes that found the UART's FIFO full), seconds, cycles, sleeping.
const fs = require('fs');
const path = require('path');
const { Simulator } = require('rp2040js');

const [elfFile, jobFile] = process.argv.slice(2);
const job = JSON.parse(fs.readFileSync(jobFile));
const lidar = fs.readFileSync(job.lidar);
const CLOCK_HZ = 125e6;
const NS = 1e9 / CLOCK_HZ;
const BYTE_NS = 10e9 / job.baud;
/// How long the firmware may take to start, and to answer after the last byte.
const START_NS = 1e9;
const END_NS = 200e6;

const simulator = new Simulator();
const { clock } = simulator;
const mcu = simulator.rp2040;
mcu.logger = { debug() {}, info() {}, warn() {}, error: (part, text) => console.error(part, text) };

// What rp2040js 1.4.1 lacks of Arm's PL011: interrupts that follow the FIFO, no DMA, and the overrun flags, one with
// the first byte that is read after the loss, one that stays until it is cleared.
const [DATA, STATUS, DMA] = [0, 4, 0x48];
const [DATA_OVERRUN, STATUS_OVERRUN] = [1 << 11, 1 << 3];
for (const uart of mcu.uart) {
  uart.dataFlag = 0;
  uart.statusFlag = 0;
  uart.checkInterrupts = function () {
    if (this.rxFIFO.empty) this.interruptStatus &= ~0x10;
    else this.interruptStatus |= 0x10;
    this.rp2040.setInterrupt(this.irq, !!(this.interruptStatus & this.interruptMask));
  };
  const read = uart.readUint32.bind(uart);
  uart.readUint32 = (offset) => {
    if (offset === DMA) return 0;
    if (offset === STATUS) return uart.statusFlag;
    if (offset !== DATA) return read(offset);
    const flag = uart.dataFlag;
    uart.dataFlag = 0;
    return read(offset) | flag;
  };
  const write = uart.writeUint32.bind(uart);
  uart.writeUint32 = (offset, value) => {
    if (offset === STATUS) uart.statusFlag = 0;
    else write(offset, value);
    if (offset !== DATA) return;
    uart.interruptStatus |= 0x20;
    uart.checkInterrupts();
  };
}

// An alarm that sets itself again for the very same moment, as 1.4.1's may by a rounding, would ring for ever.
const link = clock.linkAlarm.bind(clock);
clock.linkAlarm = (nanos, alarm) => link(Math.max(nanos, NS), alarm);
// Nobody looks at the PWM's edges, three alarms in 33 µs.
for (const channel of mcu.pwm.channels) {
  for (const alarm of [channel.alarmA, channel.alarmB, channel.alarmBottom]) alarm.clockAlarm.schedule = () => {};
}

const elf = fs.readFileSync(elfFile);
const [headers, count] = [elf.readUInt32LE(28), elf.readUInt16LE(44)];
for (let k = 0; k < count; k++) {
  const header = headers + 32 * k;
  const [type, offset, , address, size] = [0, 4, 8, 12, 16].map((at) => elf.readUInt32LE(header + at));
  if (type === 1 && size && address >= 0x10000000 && address < 0x11000000) {
    mcu.flash.set(elf.subarray(offset, offset + size), address - 0x10000000);
  }
}
// As the boot ROM and the second stage would leave it.
mcu.core.VTOR = 0x10000100;
mcu.core.SP = mcu.flashView.getUint32(0x100, true);
mcu.core.PC = mcu.flashView.getUint32(0x104, true) & ~1;

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
    uart.dataFlag = DATA_OVERRUN;
    uart.statusFlag = STATUS_OVERRUN;
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
    nextNs = startNs = clock.nanos;
  }
  while (clock.nanos >= nextNs && sent < lidar.length) arrive();
  if (sent === lidar.length && clock.nanos > lastNs + END_NS) break;
  if (sent === 0 && clock.nanos > START_NS) {
    console.error(`the firmware says nothing for ${START_NS / 1e9} s`);
    process.exit(1);
  }
}
fs.writeFileSync(job.telemetry, Buffer.from(telemetry));
const seconds = (lastNs - startNs) / 1e9;
console.log(JSON.stringify({ sent, overruns, seconds, cycles, sleeping: Math.round(sleeping), baud: uart.baudRate }));
