// Runs one test made with embedded-test in rp2040js: answers the semihosting calls that a probe would.
//
//   node test.js TEST.elf "run_addr ADDRESS"
//
// Exit status: the test's own; 3 where it does not end within ten simulated seconds.
const { chip, NS } = require('./chip.js');

const [elfFile, command] = process.argv.slice(2);
const { clock, mcu } = chip(elfFile);
const { core } = mcu;
const SEMIHOSTING = 0xab;
const [GET_COMMAND, EXIT, EXIT_WITH_STATUS] = [0x15, 0x18, 0x20];
const APPLICATION_EXIT = 0x20026;
const END_NS = 10e9;

mcu.onBreak = (code) => {
  if (code !== SEMIHOSTING) {
    console.error(`breakpoint ${code}`);
    process.exit(101);
  }
  const [call, block] = core.registers;
  if (call === GET_COMMAND) {
    const [buffer, size] = [mcu.readUint32(block), mcu.readUint32(block + 4)];
    const fits = command.length < size;
    for (let k = 0; fits && k <= command.length; k++) mcu.writeUint8(buffer + k, command.charCodeAt(k) || 0);
    mcu.writeUint32(block + 4, command.length);
    core.registers[0] = fits ? 0 : 0xffffffff;
  } else if (call === EXIT) {
    process.exit(block === APPLICATION_EXIT ? 0 : 1);
  } else if (call === EXIT_WITH_STATUS) {
    process.exit(mcu.readUint32(block) === APPLICATION_EXIT ? mcu.readUint32(block + 4) : 1);
  } else {
    console.error(`semihosting call ${call}`);
    process.exit(2);
  }
};

while (clock.nanos < END_NS) {
  if (core.waiting && core.checkForInterrupts()) core.waiting = false;
  clock.tick(core.waiting ? 1e4 : core.executeInstruction() * NS);
}
process.exit(3);
