// What `./test` does in the browser.
import assert from 'node:assert/strict';
import { readFile, writeFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join } from 'node:path';
import { chromium } from 'playwright-core';

const { CHROMIUM, FOLDER, OUT, WANTED } = process.env;
const [wanted, ...finer] = JSON.parse(WANTED);
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm' };

const server = createServer(async (request, answer) => {
  const name = request.url === '/' ? 'index.html' : request.url.slice(1);
  try {
    const content = await readFile(join(FOLDER, name));
    answer.writeHead(200, { 'content-type': TYPES[extname(name)] ?? 'application/octet-stream' });
    answer.end(content);
  } catch {
    answer.writeHead(404).end();
  }
});
await new Promise((done) => server.listen(0, '127.0.0.1', done));

const browser = await chromium.launch({ executablePath: CHROMIUM, args: ['--no-sandbox'] });
const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, acceptDownloads: true });
const complaints = [];
page.on('pageerror', (error) => complaints.push(error.message));
page.on('console', (message) => message.type() === 'error' && complaints.push(message.text()));

const state = () => page.evaluate(() => window.beamfix?.state);
const said = () => page.textContent('#said');
/** Waits until the page's state is as wanted. */
async function until(what, is, seconds = 20) {
  const end = Date.now() + 1000 * seconds;
  for (;;) {
    const now = await state();
    if (now && is(now)) return now;
    assert.ok(Date.now() < end, `${what}: not within ${seconds} s; ${await said()} ${JSON.stringify(now)}`);
    await new Promise((done) => setTimeout(done, 100));
  }
}
const isLocated = (now) => now.located?.verdict === 'measured' && now.error_m < 0.1;

try {
  await page.goto(`http://127.0.0.1:${server.address().port}/`);

  // The robot is lost at first, and found in the world's map.
  let now = await until('located', isLocated);
  console.log(`located: ${(100 * now.error_m).toFixed(1)} cm off after ${now.seconds.toFixed(1)} s`);

  // The keyboard drives.
  await page.focus('#view');
  const before = now.truth;
  await page.keyboard.down('ArrowUp');
  now = await until('driven', (now) => Math.hypot(now.truth[0] - before[0], now.truth[1] - before[1]) > 0.7);
  await page.keyboard.up('ArrowUp');
  await page.keyboard.down('ArrowLeft');
  now = await until('turned', (now) => Math.abs(now.truth[2] - before[2]) > 0.5);
  await page.keyboard.up('ArrowLeft');
  now = await until('located while driving', isLocated);
  await new Promise((done) => setTimeout(done, 2500));
  const rate = await page.evaluate(() => window.beamfix.rate);
  console.log(`${rate.count.toFixed(1)} pictures a second with an LD06 at 10 Hz, ${rate.work.toFixed(1)} ms of work each, the longest after ${rate.longest.toFixed(0)} ms`);
  await page.screenshot({ path: join(OUT, 'drive.png') });

  // What it recorded, for the tool.
  const downloading = page.waitForEvent('download');
  const shown = await page.evaluate(() => {
    document.getElementById('save').click();
    return window.beamfix.state;
  });
  await (await downloading).saveAs(join(OUT, 'driven.rec'));
  await writeFile(join(OUT, 'driven.hash'), shown.hash);
  await writeFile(join(OUT, 'driven.scans'), String(shown.scans));

  // Dragged by the mouse into another room: lost, and found again.
  const at = await page.evaluate(() => window.beamfix.toScreen(...window.beamfix.state.truth.slice(0, 2)));
  const to = await page.evaluate(() => window.beamfix.toScreen(3.0, 5.6));
  const { lost } = await state();
  await page.mouse.move(...at);
  await page.mouse.down();
  for (let k = 1; k <= 12; k++) await page.mouse.move(...at.map((from, c) => from + ((to[c] - from) * k) / 12));
  await page.mouse.up();
  now = await until('lost after it was dragged', (now) => now.lost > lost);
  await page.screenshot({ path: join(OUT, 'dragged.png') });
  now = await until('found after it was dragged', (now) => isLocated(now) && now.error_m < 0.05, 40);
  console.log(`dragged: ${await said()}`);
  await page.screenshot({ path: join(OUT, 'found.png') });

  // The recording, up to its 200th scan.
  await page.fill('#stop', '200');
  await page.setInputFiles('#file', join(OUT, 'run', 'lidar.rec'));
  now = await until('replayed', (now) => now.scans === 200 && now.truth === undefined, 30);
  assert.equal(now.hash, wanted.pose_hash, 'the pose hash of 200 scans');
  assert.equal(now.keyframes, wanted.keyframes);
  console.log(`replayed: ${now.scans} scans, pose hash ${now.hash}, as the tool has it`);
  await page.check('input[value=map]');
  await new Promise((done) => setTimeout(done, 400));
  await page.screenshot({ path: join(OUT, 'replay.png') });

  // Others with more beams a revolution.
  for (const fine of finer) {
    await page.fill('#stop', String(fine.scans));
    await page.setInputFiles('#file', join(OUT, fine.lidar, 'lidar.rec'));
    const is = (now) => now.lidar === fine.lidar && now.scans === fine.scans && now.truth === undefined;
    now = await until(`replayed ${fine.lidar}`, is, 60);
    assert.equal(now.hash, fine.pose_hash, `the pose hash of ${fine.lidar}`);
    console.log(`replayed: ${now.scans} scans of ${fine.lidar}, pose hash ${now.hash}, as the tool has it`);
  }

  // A place where doors open and people walk: what stands there is drawn as it is now.
  const place = 'rectangle 9 7\nstart -2 -1 0\nway 2 -1\ndoor -1 2 1 2 0 30\nperson -3 1 0 0.2\nfollower 0.8\n';
  await page.setInputFiles('#file', { name: 'moving.txt', mimeType: 'text/plain', buffer: Buffer.from(place) });
  now = await until('driven where things move', (now) => now.moves && now.seconds > 1);
  const faces = () => page.evaluate(() => [...window.beamfix.faces()]);
  const then = await faces();
  now = await until('things moved', (now) => now.seconds > 3);
  const moved = (await faces()).filter((value, k) => value !== then[k]).length;
  // The door's edge, and where the person walks; the robot stands, and so does who follows it.
  assert.equal(moved, 3, `${moved} numbers have changed`);
  console.log('moved: a door and a person');

  // What cannot be read is told, and the page goes on.
  await page.setInputFiles('#file', { name: 'x.log', mimeType: 'text/plain', buffer: Buffer.from('no log\n') });
  await page.waitForFunction(() => document.getElementById('said').textContent.includes('x.log'));
  console.log(`told: ${await said()}`);
  assert.deepEqual(complaints, []);
} finally {
  await browser.close();
  server.close();
}
