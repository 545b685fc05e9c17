// The page around the twin: what is typed, dragged and dropped goes in, what the pipeline says is drawn.

const PART = { state: 0, scan: 1, keyframe: 2, pairs: 3, field: 4, map: 5, walls: 6, columns: 7, trails: [8, 9, 10] };
const COLOUR = { truth: '#000', located: '#0072b2', odometry: '#b26a00', scan: '#d55e00', keyframe: '#56b4e9', pair: '#009e73', wall: '#444' };
const SPEED = 0.6; // m/s
const TURN = 1.2; // rad/s
// A correspondence is millimetres long: it is drawn so many times as long.
const LONGER = 10;

const byId = (id) => document.getElementById(id);
const canvas = byId('view');
const context = canvas.getContext('2d', { alpha: false });
const module = WebAssembly.compileStreaming(fetch('twin.wasm'));
const [encoder, decoder] = [new TextEncoder(), new TextDecoder()];

/** An instance of the module: one drive or one recording. */
class Twin {
  static async make() {
    const twin = new Twin();
    twin.wasm = (await WebAssembly.instantiate(await module, {})).exports;
    twin.wasm.panicked();
    return twin;
  }

  /** Calls a function; the message of a panic becomes the error's. */
  call(name, ...args) {
    try {
      return this.wasm[name](...args);
    } catch (trap) {
      const why = decoder.decode(this.answer(this.wasm.panicked()));
      throw new Error(why || String(trap));
    }
  }

  give(bytes) {
    const at = this.call('input', bytes.length);
    new Uint8Array(this.wasm.memory.buffer, at, bytes.length).set(bytes);
  }

  answer(length) {
    return new Uint8Array(this.wasm.memory.buffer, this.wasm.output(), length).slice();
  }

  text(length) {
    return decoder.decode(this.answer(length));
  }

  bytes(part) {
    return this.answer(this.call('look', part));
  }

  floats(part) {
    return new Float32Array(this.bytes(part).buffer);
  }

  state() {
    return JSON.parse(this.text(this.call('look', PART.state)));
  }

  /** A grid as a picture, by a colour for each of 256 bytes; nothing where there is none. */
  picture(part, colours) {
    const bytes = this.bytes(part);
    if (bytes.length < 24) return null;
    const [width, height, side, x, y, theta] = new Float32Array(bytes.buffer, 0, 6);
    const image = new ImageData(width, height);
    const pixels = new Uint32Array(image.data.buffer);
    for (let row = 0; row < height; row++) {
      const [from, to] = [24 + row * width, (height - 1 - row) * width];
      for (let k = 0; k < width; k++) pixels[to + k] = colours[bytes[from + k]];
    }
    const sheet = new OffscreenCanvas(width, height);
    sheet.getContext('2d').putImageData(image, 0, 0);
    return { sheet, side, x, y, theta };
  }
}

/** 256 colours from one to another, each red, green, blue. */
function ramp(from, to) {
  return Uint32Array.from({ length: 256 }, (_, k) => {
    const [r, g, b] = from.map((low, c) => Math.round(low + ((to[c] - low) * k) / 255));
    return (255 << 24) | (b << 16) | (g << 8) | r;
  });
}
const FIELD = ramp([255, 255, 255], [120, 150, 185]);
const MAP = ramp([255, 255, 255], [20, 20, 20]);
MAP.fill(0xffd6d6d6, 100, 160);

let twin = null;
let mode = 'drive';
let state = {};
let drawn = {};
let ground = { kind: '', key: -1, at: 0, picture: null };
let centre = [0, 0];
let scale = 60; // pixels a metre
let dragged = null;
let lostAt = null;
let shots = [];
const pressed = new Set();

async function startDrive(description) {
  const next = await Twin.make();
  const world = description ?? byId('world').value;
  next.give(encoder.encode(`${byId('lidar').value}\n${world}`));
  const why = next.text(next.call('drive', 1));
  begin(next, 'drive', why);
  if (!why) say(`Driving in ${description ? 'your world' : world}.`);
}

async function startReplay(name, bytes, lidar = 'auto') {
  const next = await Twin.make();
  const head = encoder.encode(`${name}\n${lidar}\n`);
  const whole = new Uint8Array(head.length + bytes.length);
  whole.set(head);
  whole.set(bytes, head.length);
  next.give(whole);
  const why = next.text(next.call('open'));
  begin(next, 'replay', why);
  if (!why) say(`Replaying ${name}.`);
}

function begin(next, how, why) {
  if (why) {
    say(why);
    return;
  }
  [twin, mode, lostAt, shots] = [next, how, null, []];
  ground = { kind: '', key: -1, at: 0, picture: null };
  drawn = { walls: twin.floats(PART.walls), columns: twin.floats(PART.columns), scans: -1, trails: [] };
  state = twin.state();
  fit();
}

/** Chooses scale and centre so that the whole world is seen, or what is around the robot where it is large. */
function fit() {
  const { walls } = drawn;
  const [low, high] = [[Infinity, Infinity], [-Infinity, -Infinity]];
  for (let k = 0; k < walls.length; k++) {
    low[k % 2] = Math.min(low[k % 2], walls[k]);
    high[k % 2] = Math.max(high[k % 2], walls[k]);
  }
  const size = walls.length ? [high[0] - low[0], high[1] - low[1]] : [12, 12];
  const isLarge = Math.max(...size) > 32;
  byId('follow').checked = isLarge || !walls.length;
  const seen = isLarge ? [20, 20] : size;
  centre = walls.length && !isLarge ? [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2] : robot().slice(0, 2);
  const { clientWidth, clientHeight } = canvas;
  scale = 0.94 * Math.min(clientWidth / seen[0], clientHeight / seen[1]);
}

const robot = () => state.truth ?? state.odometry?.pose ?? [0, 0, 0];

function say(text) {
  byId('said').textContent = text;
}

function aim() {
  const held = (...keys) => keys.some((key) => pressed.has(key));
  const forward = held('ArrowUp', 'w') - held('ArrowDown', 's');
  const left = held('ArrowLeft', 'a') - held('ArrowRight', 'd');
  return [SPEED * forward, TURN * left];
}

/** Lets time pass. */
function live(seconds) {
  if (mode === 'drive') {
    twin.call('advance', seconds, ...aim());
    return;
  }
  const stop = Number(byId('stop').value) || Infinity;
  const until = performance.now() + 9;
  for (let count = state.scans; count < stop && performance.now() < until; count++) {
    if (twin.call('step', 1) === 0) break;
  }
}

function look() {
  const before = state;
  state = twin.state();
  if (state.scans !== drawn.scans) {
    drawn.scans = state.scans;
    const parts = ['scan', 'keyframe', 'pairs', ...(state.moves ? ['walls', 'columns'] : [])];
    for (const part of parts) drawn[part] = twin.floats(PART[part]);
    drawn.trails = PART.trails.map((part) => twin.floats(part));
  }
  const kind = document.querySelector('input[name=ground]:checked').value;
  // A map is drawn anew where a keyframe came, at most every second.
  const key = kind === 'map' || !state.located ? state.keyframes : 0;
  const isField = kind === 'field' && state.truth;
  const now = performance.now();
  if (kind !== ground.kind || (key !== ground.key && now - ground.at > 1000)) {
    const picture = isField ? twin.picture(PART.field, FIELD) : twin.picture(PART.map, MAP);
    ground = { kind, key, at: now, picture };
  }
  watch(before);
}

/** Tells where the robot is lost, and found again. */
function watch(before) {
  if (!state.located) return;
  const is = (of) => of.located?.verdict === 'measured';
  if (is(before) && !is(state)) [lostAt] = [state.seconds];
  if (state.located.verdict === 'unknown' && before.located?.verdict !== 'unknown') say('Lost: searching the whole map.');
  if (!is(before) && is(state)) {
    const after = lostAt === null ? '' : ` after ${(state.seconds - lostAt).toFixed(1)} s`;
    say(`Found${after}, ${(100 * state.error_m).toFixed(1)} cm off.`);
  }
}

function toScreen(x, y) {
  return [canvas.clientWidth / 2 + (x - centre[0]) * scale, canvas.clientHeight / 2 - (y - centre[1]) * scale];
}

function toWorld(x, y) {
  return [centre[0] + (x - canvas.clientWidth / 2) / scale, centre[1] - (y - canvas.clientHeight / 2) / scale];
}

function draw() {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  }
  if (byId('follow').checked && !dragged) centre = robot().slice(0, 2);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.fillStyle = '#fff';
  context.fillRect(0, 0, width, height);
  drawGround();
  drawWalls();
  ['truth', 'odometry', 'located'].forEach((who, k) => drawTrail(drawn.trails[k] ?? [], who));
  dots(drawn.keyframe ?? [], COLOUR.keyframe, 3, true);
  dots(drawn.scan ?? [], COLOUR.scan, 4, false);
  if (byId('show-pairs').checked) drawPairs(drawn.pairs ?? []);
  if (state.truth) drawRobot(state.truth, '#000', [2, 3], 'rgba(255,255,255,.6)');
  if (state.odometry) drawPose(state.odometry, COLOUR.odometry, [9, 5]);
  if (state.located && state.located.verdict !== 'unknown') drawPose(state.located, COLOUR.located, []);
  if (dragged?.to) drawRobot([...dragged.to, robot()[2]], '#000', [1, 4], null);
  drawScale(width, height);
}

function drawGround() {
  const { picture } = ground;
  if (!picture) return;
  const { sheet, side, x, y, theta } = picture;
  context.save();
  context.imageSmoothingEnabled = false;
  context.translate(...toScreen(x, y));
  context.rotate(-theta);
  context.drawImage(sheet, 0, -sheet.height * side * scale, sheet.width * side * scale, sheet.height * side * scale);
  context.restore();
}

function drawWalls() {
  const { walls, columns } = drawn;
  context.strokeStyle = COLOUR.wall;
  context.lineWidth = 1.5;
  context.beginPath();
  for (let k = 0; k < walls.length; k += 4) {
    context.moveTo(...toScreen(walls[k], walls[k + 1]));
    context.lineTo(...toScreen(walls[k + 2], walls[k + 3]));
  }
  for (let k = 0; k < columns.length; k += 3) {
    const [x, y] = toScreen(columns[k], columns[k + 1]);
    const radius = columns[k + 2] * scale;
    context.moveTo(x + radius, y);
    context.arc(x, y, radius, 0, 2 * Math.PI);
  }
  context.stroke();
}

function drawTrail(trail, who) {
  context.strokeStyle = COLOUR[who];
  context.lineWidth = who === 'truth' ? 2 : 3;
  context.setLineDash({ truth: [2, 4], odometry: [9, 5], located: [] }[who]);
  context.beginPath();
  let isDown = false;
  let last = null;
  for (let k = 0; k < trail.length; k += 2) {
    const [x, y] = [trail[k], trail[k + 1]];
    // Where the robot was carried, nobody drove.
    const isJump = last && Math.hypot(x - last[0], y - last[1]) > 0.5;
    if (Number.isNaN(x) || isJump) isDown = false;
    if (!Number.isNaN(x)) {
      context[isDown ? 'lineTo' : 'moveTo'](...toScreen(x, y));
      [isDown, last] = [true, [x, y]];
    }
  }
  context.stroke();
  context.setLineDash([]);
}

function dots(places, colour, size, isSquare) {
  context.fillStyle = colour;
  context.beginPath();
  for (let k = 0; k < places.length; k += 2) {
    const [x, y] = toScreen(places[k], places[k + 1]);
    if (isSquare) context.rect(x - size / 2, y - size / 2, size, size);
    else {
      context.moveTo(x + size / 2, y);
      context.arc(x, y, size / 2, 0, 2 * Math.PI);
    }
  }
  context.fill();
}

function drawPairs(pairs) {
  context.strokeStyle = COLOUR.pair;
  context.lineWidth = 1.2;
  context.beginPath();
  for (let k = 0; k < pairs.length; k += 4) {
    const [x, y, u, v] = pairs.subarray(k, k + 4);
    context.moveTo(...toScreen(x, y));
    context.lineTo(...toScreen(x + LONGER * (u - x), y + LONGER * (v - y)));
  }
  context.stroke();
}

/** A pose with the ellipse that holds 95 of 100, at least a few pixels. */
function drawPose({ pose, covariance }, colour, dash) {
  if (covariance) {
    const [xx, xy, yy] = covariance;
    const a = Math.sqrt(Math.max(xx, 0));
    const b = a > 0 ? xy / a : 0;
    const c = Math.sqrt(Math.max(yy - b * b, 0));
    context.beginPath();
    for (let k = 0; k <= 48; k++) {
      const [u, v] = [Math.cos((k * Math.PI) / 24), Math.sin((k * Math.PI) / 24)].map((side) => 2.4477 * side);
      context[k ? 'lineTo' : 'moveTo'](...toScreen(pose[0] + a * u, pose[1] + b * u + c * v));
    }
    [context.strokeStyle, context.lineWidth] = [colour, 2];
    context.stroke();
  }
  drawRobot(pose, colour, dash, null);
}

function drawRobot([x, y, theta], colour, dash, fill) {
  context.save();
  context.translate(...toScreen(x, y));
  context.rotate(-theta);
  const size = Math.max(0.18 * scale, 9);
  context.beginPath();
  context.moveTo(1.25 * size, 0);
  context.lineTo(-0.8 * size, 0.75 * size);
  context.lineTo(-0.8 * size, -0.75 * size);
  context.closePath();
  if (fill) {
    context.fillStyle = fill;
    context.fill();
  }
  [context.strokeStyle, context.lineWidth] = [colour, 2.5];
  context.setLineDash(dash);
  context.stroke();
  context.restore();
}

function drawScale(width, height) {
  const metres = [0.5, 1, 2, 5, 10, 20].find((length) => length * scale > 60) ?? 50;
  const [x, y] = [width - 20 - metres * scale, height - 16];
  [context.strokeStyle, context.fillStyle, context.lineWidth] = ['#000', '#000', 2];
  context.beginPath();
  context.moveTo(x, y - 5);
  context.lineTo(x, y);
  context.lineTo(width - 20, y);
  context.lineTo(width - 20, y - 5);
  context.stroke();
  context.font = '13px system-ui, sans-serif';
  context.fillText(`${metres} m`, x + 4, y - 4);
}

const cm = (metres) => `${(100 * metres).toFixed(1)} cm`;
const sigma = ({ covariance }) => {
  if (!covariance) return '';
  const [xx, , yy, tt] = covariance;
  return ` ± ${cm(Math.sqrt(Math.max(xx, yy)))}, ${((Math.sqrt(tt) * 180) / Math.PI).toFixed(2)}°`;
};
const place = ([x, y, theta]) => `${x.toFixed(2)} ${y.toFixed(2)} m, ${((theta * 180) / Math.PI).toFixed(0)}°`;

/** Figures, four times a second. */
function tell(rate) {
  const rows = [['pictures a second', `${rate.count.toFixed(0)}; ${rate.work.toFixed(1)} ms of work each`]];
  rows.push(['scans', `${state.scans}, ${state.refused} refused, ${state.keyframes} keyframes, ${state.loops} loops`]);
  if (state.left !== undefined) rows.push(['left', String(state.left)]);
  if (state.lidar) rows.push(['lidar', state.lidar]);
  if (state.located) {
    const { verdict, pose } = state.located;
    const words = { measured: place(pose), predicted: `${place(pose)}, by odometry`, unknown: 'lost, searching' }[verdict];
    rows.push(['located', words + (verdict === 'measured' ? sigma(state.located) : '')]);
    rows.push(['off the truth', state.error_m === undefined ? '' : cm(state.error_m)]);
  }
  if (state.odometry) rows.push(['odometry', place(state.odometry.pose) + sigma(state.odometry)]);
  rows.push(['pose hash', state.hash]);
  for (const remark of state.remarks ?? []) rows.push(['', remark]);
  const list = byId('figures');
  list.replaceChildren(
    ...rows.flatMap(([name, value]) => {
      const [term, text] = [document.createElement('dt'), document.createElement('dd')];
      [term.textContent, text.textContent] = [name, value];
      return [term, text];
    }),
  );
}

let last = performance.now();
let told = 0;
function frame(now) {
  requestAnimationFrame(frame);
  const passed = now - last;
  last = now;
  if (!twin) return;
  const began = performance.now();
  try {
    live(Math.min(passed, 100) / 1000);
    look();
    draw();
  } catch (error) {
    twin = null;
    say(`Stopped: ${error.message}`);
    throw error;
  }
  shots.push([passed, performance.now() - began]);
  if (shots.length > 120) shots.shift();
  if (now - told > 250) {
    told = now;
    const mean = [0, 1].map((k) => shots.reduce((sum, shot) => sum + shot[k], 0) / shots.length);
    const rate = { count: 1000 / mean[0], work: mean[1], longest: Math.max(...shots.map((shot) => shot[0])) };
    window.beamfix = { state, mode, rate, toScreen, toWorld, faces };
    tell(rate);
  }
}

/** The numbers of all that stands around, as it is drawn. */
const faces = () => [...drawn.walls, ...drawn.columns];

/** Takes a file: a world's description, or a recording. */
async function take(file) {
  if (file.name.endsWith('.txt')) await startDrive(await file.text());
  else await startReplay(file.name, new Uint8Array(await file.arrayBuffer()));
}

window.addEventListener('keydown', (event) => {
  if (['INPUT', 'SELECT', 'BUTTON'].includes(event.target.tagName) && event.key !== 'Escape') return;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (key === ' ') pressed.clear();
  else if (key === 'k') twin?.call('kidnap');
  else if (key === '+') scale *= 1.25;
  else if (key === '-') scale /= 1.25;
  else if (/^(Arrow.*|[wasd])$/.test(key)) pressed.add(key);
  else return;
  event.preventDefault();
});
window.addEventListener('keyup', (event) => pressed.delete(event.key.length === 1 ? event.key.toLowerCase() : event.key));
window.addEventListener('blur', () => pressed.clear());

canvas.addEventListener('pointerdown', (event) => {
  canvas.focus();
  const [x, y] = toScreen(...robot());
  const isNear = Math.hypot(event.offsetX - x, event.offsetY - y) < Math.max(28, 0.4 * scale);
  dragged = { robot: mode === 'drive' && isNear, at: [event.offsetX, event.offsetY] };
  canvas.setPointerCapture(event.pointerId);
});
canvas.addEventListener('pointermove', (event) => {
  if (!dragged || !twin) return;
  if (dragged.robot) {
    dragged.to = toWorld(event.offsetX, event.offsetY);
  } else {
    byId('follow').checked = false;
    centre = [centre[0] - (event.offsetX - dragged.at[0]) / scale, centre[1] + (event.offsetY - dragged.at[1]) / scale];
    dragged.at = [event.offsetX, event.offsetY];
  }
});
canvas.addEventListener('pointerup', () => {
  // Put down at once: a robot that is carried slowly is followed.
  if (dragged?.to && twin && !twin.call('carry', ...dragged.to, robot()[2])) say('Something stands there, or nothing is around.');
  dragged = null;
});
canvas.addEventListener('pointercancel', () => (dragged = null));
canvas.addEventListener('wheel', (event) => {
  event.preventDefault();
  scale *= event.deltaY < 0 ? 1.15 : 1 / 1.15;
}, { passive: false });

byId('drive').addEventListener('click', () => startDrive());
byId('world').addEventListener('change', () => startDrive());
byId('lidar').addEventListener('change', () => startDrive());
byId('kidnap').addEventListener('click', () => twin?.call('kidnap'));
byId('nearer').addEventListener('click', () => (scale *= 1.25));
byId('farther').addEventListener('click', () => (scale /= 1.25));
byId('file').addEventListener('change', (event) => event.target.files[0] && take(event.target.files[0]));
byId('save').addEventListener('click', () => {
  if (!twin || mode !== 'drive') return;
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([twin.answer(twin.call('recording'))]));
  link.download = 'lidar.rec';
  link.click();
  URL.revokeObjectURL(link.href);
});
document.addEventListener('dragover', (event) => event.preventDefault());
document.addEventListener('drop', (event) => {
  event.preventDefault();
  if (event.dataTransfer.files[0]) take(event.dataTransfer.files[0]);
});

function offer(select, choices, chosen) {
  for (const [value, words] of choices) select.add(new Option(`${value}: ${words}`, value, false, value === chosen));
}

const first = await Twin.make();
const { worlds, lidars } = JSON.parse(first.text(first.call('choices')));
offer(byId('world'), worlds, 'flat');
offer(byId('lidar'), lidars, 'ld06');
await startDrive();
requestAnimationFrame(frame);
