#!/usr/bin/env bash
# rosmsg2-serialization (JavaScript) writes no values where a typed array has another type than the field.
#
# Ranges computed in JavaScript are often a Float64Array, and sensor_msgs/LaserScan has float32[]. The guess before running
# it: MessageWriter converts each value, as it does for a plain Array, or refuses.
# Seen: it writes how many values follow and then none, so all ranges read 0 and whatever stands behind them is lost or
# shifted; of float32[3], a fixed array, three zeros. Int16Array and Uint8Array for float32[] and Uint8Array for uint16[]
# the same. A Float32Array in place of a Float64Array raises, for there the length is found too small. Plain arrays and the
# field's own typed array are right.
# For who writes bags from a browser: Float32Array.from(ranges) first; a scan of nothing but 0 is a scan without returns,
# which no check finds odd.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --cache "$folder/cache" @foxglove/rosmsg2-serialization@3.1.0 @foxglove/rosmsg@5.0.5
node - <<'JS'
const { MessageReader, MessageWriter } = require('@foxglove/rosmsg2-serialization');
const { parse } = require('@foxglove/rosmsg');

for (const name of ['rosmsg2-serialization', 'rosmsg']) {
  console.log(name, require(`./node_modules/@foxglove/${name}/package.json`).version);
}
function through(type, value) {
  const definition = parse(`${type} value`, { ros2: true });
  try {
    const wire = new MessageWriter(definition).writeMessage({ value });
    return `${wire.byteLength} bytes: ${[...new MessageReader(definition).readMessage(wire).value].join(' ')}`;
  } catch (error) {
    return `refused: ${error.message}`;
  }
}
const ranges = [1.5, 2.5, 3.5];
const cases = [
  ['float32[]', ranges, '20 bytes: 1.5 2.5 3.5'],
  ['float32[]', Float32Array.from(ranges), '20 bytes: 1.5 2.5 3.5'],
  ['float32[]', Float64Array.from(ranges), '8 bytes: 0 0 0'],
  ['float32[]', Int16Array.of(1, 2, 3), '8 bytes: 0 0 0'],
  ['float32[]', Uint8Array.of(1, 2, 3), '8 bytes: 0 0 0'],
  ['uint16[]', Uint8Array.of(1, 2, 3), '8 bytes: 0 0 0'],
  ['float32[3]', Float64Array.from(ranges), '16 bytes: 0 0 0'],
  ['float64[]', Float32Array.from(ranges), 'refused'],
];
let right = true;
for (const [type, value, expected] of cases) {
  const seen = through(type, value);
  console.log(`${type} from ${value.constructor.name} ${[...value].join(' ')}: ${seen}`);
  right &&= seen.startsWith(expected);
}
if (!right) console.log('it behaves otherwise now');
process.exit(right ? 0 : 1);
JS
