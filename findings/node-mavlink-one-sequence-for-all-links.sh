#!/usr/bin/env bash
# node-mavlink numbers the messages of all links with one counter: on two links each end counts half of them lost.
#
# MAVLink's sequence counts what one component sends on one link, so that the other end can tell losses. The guess before
# running it: node-mavlink's send() keeps a counter for each stream, or for each protocol object, of which a program has one
# a component.
# Seen: one counter for the whole process. A program that sends to a serial port and to a socket in turn, each with a
# protocol object of its own, sends 0 2 4 6 on one and 1 3 5 7 on the other; with one link the numbers are right and wrap at
# 255.
# For who bridges a lidar to two autopilots or an autopilot and a ground station: "50 % lost" there is no bad cable; number
# the messages yourself with serialize(message, sequence). Our counter is one a link.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --cache "$folder/cache" node-mavlink@2.3.0
node - <<'JS'
const { PassThrough } = require('stream');
const { MavLinkProtocolV2, minimal, send } = require('node-mavlink');

console.log('node-mavlink', require('./node_modules/node-mavlink/package.json').version);
function link(component) {
  const stream = new PassThrough();
  const sequences = [];
  stream.on('data', (frame) => sequences.push(frame[4]));
  return { stream, protocol: new MavLinkProtocolV2(1, component), sequences };
}
function lost(sequences) {
  return sequences.slice(1).reduce((sum, sequence, k) => sum + ((sequence - sequences[k] - 1) & 255), 0);
}
(async () => {
  const [serial, socket] = [link(196), link(197)];
  for (let k = 0; k < 50; k++) {
    for (const { stream, protocol } of [serial, socket]) await send(stream, new minimal.Heartbeat(), protocol);
  }
  const alone = link(196);
  for (let k = 0; k < 300; k++) await send(alone.stream, new minimal.Heartbeat(), alone.protocol);
  await new Promise((done) => setTimeout(done, 100));
  const counts = [serial, socket, alone].map(({ sequences }) => [sequences.length, lost(sequences)]);
  console.log('serial port:', serial.sequences.slice(0, 8).join(' '), '…; socket:', socket.sequences.slice(0, 8).join(' '), '…');
  console.log('received and taken for lost: serial port', counts[0].join(', '), '; socket', counts[1].join(', '), '; one link alone', counts[2].join(', '));
  const right = JSON.stringify(counts) === '[[50,49],[50,49],[300,0]]';
  if (!right) console.log('it behaves otherwise now');
  process.exit(right ? 0 : 1);
})();
JS
