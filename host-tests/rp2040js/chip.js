// An RP2040 with a firmware in its flash, as the boot ROM and the second stage would leave it; what rp2040js 1.4.1 does not do
// as the chip does is put right.
const fs = require('fs');
const { Simulator } = require('rp2040js');

const NS = 1e9 / 125e6;

exports.NS = NS;
exports.chip = (elfFile) => {
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
    uart.overrun = () => {
      uart.dataFlag = DATA_OVERRUN;
      uart.statusFlag = STATUS_OVERRUN;
    };
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

  return { clock, mcu };
};
