// Where things are: tokens and the model's nodes in the world, the camera, and its perspective projection.

const nodeAt = unpackPoints(data.body.nodes), measuredAt = unpackPoints(data.tokens.measured);
const LENS = 3.6;  // distance over radius: a long lens, so that limbs near the eye do not look huge
const camera = {yaw: 0, pitch: 0, zoom: 1};

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times3 = (a, k) => [a[0] * k, a[1] * k, a[2] * k];
const dot3 = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross3 = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length3 = (a) => Math.hypot(a[0], a[1], a[2]);
const unit3 = (a) => times3(a, 1 / (length3(a) || 1));

// The last pose that was known at each frame; -1 before the first one, which is then taken instead.
const poseFrame = new Int32Array(frameCount);
let firstPose = -1;
for (let frame = 0, known = -1; frame < frameCount; frame++) {
  if (Number.isFinite(pose[12 * frame] + pose[12 * frame + 9])) known = frame;
  if (firstPose < 0) firstPose = known;
  poseFrame[frame] = known;
}
const poseKnown = (frame) => poseFrame[frame] === frame;
/** Whether the place of the body that a node is of is known; of one body this is its pose. */
const nodeKnown = (frame, node) => poseKnown(frame) && (!located || located[frame * data.body.hulls.length + data.body.owner[node]] === 1);

/** A point of the intrinsic frame in the world, by the pose of a frame. */
function toWorld(point, frame) {
  const at = 12 * frame;
  return [0, 1, 2].map((r) => pose[at + 3 * r] * point[0] + pose[at + 3 * r + 1] * point[1] + pose[at + 3 * r + 2] * point[2] + pose[at + 9 + r]);
}

/** The reverse of `toWorld`. */
function toBody(point, frame) {
  const at = 12 * frame, moved = [0, 1, 2].map((r) => point[r] - pose[at + 9 + r]);
  return [0, 1, 2].map((c) => pose[at + c] * moved[0] + pose[at + 3 + c] * moved[1] + pose[at + 6 + c] * moved[2]);
}

/** Positions to draw in a frame: nodes of the model (null without any pose) and measured tokens. */
function placesOf(frame) {
  const from = poseFrame[frame] >= 0 ? poseFrame[frame] : firstPose;
  const held = view.camera === "body" && from >= 0;
  const nodes = data.body.machine.map((_, node) => {
    const point = from < 0 ? null : nodeAt(frame, node);
    return point && toWorld(point, held ? firstPose : from);
  });
  const measured = data.tokens.names.map((_, token) => {
    const point = measuredAt(frame, token);
    return point && held ? toWorld(toBody(point, from), firstPose) : point;
  });
  return {nodes, measured};
}

function meanOf(points) {
  const known = points.filter((p) => p);
  return known.length ? times3(known.reduce(add, [0, 0, 0]), 1 / known.length) : null;
}

/** Middle of the box around points: what is to be in the middle of the picture. */
function middleOf(points) {
  const known = points.filter((p) => p);
  if (!known.length) return null;
  return [0, 1, 2].map((axis) => (Math.min(...known.map((p) => p[axis])) + Math.max(...known.map((p) => p[axis]))) / 2);
}

// Middle of the body in each frame, smoothed over a few frames so that the camera does not shake with the noise.
const middles = [];
function smoothMiddles() {
  const raw = [];
  for (let frame = 0; frame < frameCount; frame++) {
    const {nodes, measured} = placesOf(frame);
    raw.push(middleOf(nodes) || middleOf(measured));
  }
  const reach = Math.max(1, Math.round((data.frames.rate || 25) / data.frames.every * 0.3));
  for (let frame = 0, before = [0, 0, 0]; frame < frameCount; frame++) {
    before = meanOf(raw.slice(Math.max(0, frame - reach), frame + reach + 1)) || before;
    middles.push(before);
  }
}

let wholeMiddle = [0, 0, 0], wholeRadius = 0.1;
function measureWhole() {
  if (!middles.length) return;
  wholeMiddle = middleOf(middles);
  wholeRadius = data.camera.radius + Math.max(...middles.map((m) => length3(sub(m, wholeMiddle))));
}

/** The camera's axes: right, up, and towards the eye. */
function axes() {
  const up = data.camera.up, first = unit3(sub(data.camera.toward, times3(up, dot3(up, data.camera.toward))));
  const side = cross3(up, first);
  const level = add(times3(first, Math.cos(camera.yaw)), times3(side, Math.sin(camera.yaw)));
  const toward = add(times3(level, Math.cos(camera.pitch)), times3(up, Math.sin(camera.pitch)));
  const right = unit3(cross3(up, toward));
  return {right, up: cross3(toward, right), toward};
}

function projector(width, height) {
  const {right, up, toward} = axes();
  const still = view.camera === "world";
  const target = still ? wholeMiddle : view.camera === "body" && firstPose >= 0 ? middles[firstPose] : middles[Math.max(0, view.frame)] || [0, 0, 0];
  const radius = (still ? wholeRadius : data.camera.radius) * 1.1 / camera.zoom;
  const size = Math.min(width, height - 40) / 2 * LENS;
  const project = (point) => {
    const from = sub(point, target), depth = LENS * radius - dot3(from, toward);
    if (depth < 0.05 * radius) return null;
    return {x: width / 2 + size * dot3(from, right) / depth, y: height / 2 - size * dot3(from, up) / depth, depth};
  };
  return {project, pixels: size / (LENS * radius), target, right, up, toward};
}

function hullOf(points) {
  const sorted = [...points].sort((a, b) => a.x - b.x || a.y - b.y);
  const turn = (o, a, b) => (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
  const half = (list) => list.reduce((chain, p) => {
    while (chain.length > 1 && turn(chain[chain.length - 2], chain[chain.length - 1], p) <= 0) chain.pop();
    chain.push(p);
    return chain;
  }, []);
  return [...half(sorted).slice(0, -1), ...half(sorted.reverse()).slice(0, -1)];
}

const everSeen = data.tokens.names.map((_, token) => {
  for (let frame = 0; frame < frameCount; frame++) if (measuredAt(frame, token)) return true;
  return false;
});
