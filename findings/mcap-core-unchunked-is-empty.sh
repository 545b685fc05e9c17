#!/usr/bin/env bash
# @mcap/core's indexed reader finds an MCAP file without chunks empty.
#
# MCAP may hold its messages in chunks or plainly one behind the other, as a small logger writes them. The guess before
# running it: @mcap/core's McapIndexedReader says that such a file has no index to read by, or reads it from front to back.
# Seen: it opens, `statistics` tells how many messages there are, and readMessages ends without one, forwards and in
# reverse. Chunks without message indexes it does refuse with a sentence. McapStreamReader reads both.
# For who writes a logger for browser viewers: write chunks, one that holds all is enough.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --cache "$folder/cache" @mcap/core@2.2.2
node - <<'JS'
const { McapIndexedReader, McapStreamReader, McapWriter, TempBuffer } = require('@mcap/core');

console.log('@mcap/core', require('./node_modules/@mcap/core/package.json').version);
async function record(options) {
  const file = new TempBuffer();
  const writer = new McapWriter({ writable: file, ...options });
  await writer.start({ profile: '', library: 'findings' });
  const channelId = await writer.registerChannel({ topic: '/scan', messageEncoding: 'json', schemaId: 0, metadata: new Map() });
  for (const time of [10n, 20n, 30n]) {
    await writer.addMessage({ channelId, sequence: 0, logTime: time, publishTime: time, data: new Uint8Array([123, 125]) });
  }
  await writer.end();
  return file;
}
async function indexed(file, options) {
  try {
    const reader = await McapIndexedReader.Initialize({ readable: file });
    const times = [];
    for await (const message of reader.readMessages(options)) times.push(Number(message.logTime));
    return `tells ${reader.statistics.messageCount}, yields [${times}]`;
  } catch (error) {
    return `refused: ${error.message}`;
  }
}
function streamed(file) {
  const reader = new McapStreamReader();
  reader.append(file.get());
  const times = [];
  for (let record; (record = reader.nextRecord()); ) if (record.type === 'Message') times.push(Number(record.logTime));
  return `yields [${times}]`;
}
const cases = [
  ['chunks', {}, ['tells 3, yields [10,20,30]', 'tells 3, yields [30,20,10]']],
  ['no chunks', { useChunks: false }, ['tells 3, yields []', 'tells 3, yields []']],
  ['no message index', { useMessageIndex: false }, ['refused', 'refused']],
];
(async () => {
  let right = true;
  for (const [name, options, expected] of cases) {
    const file = await record(options);
    const seen = [await indexed(file, {}), await indexed(file, { reverse: true })];
    console.log(`${name}: indexed ${seen[0]}; in reverse ${seen[1]}; stream ${streamed(file)}`);
    right &&= expected.every((text, k) => seen[k].startsWith(text)) && streamed(file) === 'yields [10,20,30]';
  }
  if (!right) console.log('it behaves otherwise now');
  process.exit(right ? 0 : 1);
})();
JS
