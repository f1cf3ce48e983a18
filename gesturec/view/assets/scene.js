// The body in space: an orbiting camera, a perspective projection and a painter's algorithm on a 2D canvas.

const canvas = $("canvas"), pen = canvas.getContext("2d");
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
  const nodes = data.body.machine.map((_, node) => from < 0 ? null : toWorld(nodeAt(frame, node), held ? firstPose : from));
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

const colorOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** What is to be painted, each with its depth; the farthest is painted first. */
function pictureOf(frame, project, thick) {
  const {nodes, measured} = placesOf(frame), spots = nodes.map((p) => p && project(p)), items = [];
  const undecided = (machine) => machine >= 0 && data.machines[machine].state[frame] < 0;
  const known = poseKnown(frame);
  const hull = data.body.hull.map((node) => spots[node]).filter((p) => p);
  if (hull.length > 1) items.push({depth: Math.max(...hull.map((p) => p.depth)), paint: () => paintHull(hullOf(hull), known)});
  data.body.bones.forEach(([a, b], k) => {
    if (!spots[a] || !spots[b]) return;
    const machine = data.body.machine[b], open = undecided(machine) || !known;
    items.push({depth: (spots[a].depth + spots[b].depth) / 2, paint: () => paintBone(spots[a], spots[b], machine, open, data.body.whisker[k] ? thick / 3 : thick)});
  });
  spots.forEach((spot, node) => {
    if (spot) items.push({depth: spot.depth - 1e-6, paint: () => paintJoint(spot, data.body.machine[node], undecided(data.body.machine[node]) || !known, thick)});
  });
  data.tokens.names.forEach((name, token) => {
    const at = measured[token] && project(measured[token]), model = spots[data.tokens.node[token]];
    if (at) items.push({depth: at.depth - 2e-6, paint: () => paintMeasured(at, model, data.tokens.colors[token])});
    else if (model && everSeen[token]) items.push({depth: model.depth - 2e-6, paint: () => paintHidden(model)});
  });
  return {items: items.sort((a, b) => b.depth - a.depth), spots};
}

function paintHull(points, known) {
  pen.beginPath();
  points.forEach((p, k) => k ? pen.lineTo(p.x, p.y) : pen.moveTo(p.x, p.y));
  pen.closePath();
  pen.globalAlpha = 0.3;
  pen.fillStyle = colorOf("--faint");
  if (known) pen.fill();
  pen.globalAlpha = 1;
  pen.setLineDash(known ? [] : [5, 4]);
  pen.lineWidth = 1.5;
  pen.strokeStyle = colorOf("--faint");
  pen.stroke();
  pen.setLineDash([]);
}

function machineColor(machine) {
  return machine < 0 ? colorOf("--soft") : data.machines[machine].color;
}

function paintBone(a, b, machine, open, thick) {
  pen.lineCap = "round";
  pen.beginPath();
  pen.moveTo(a.x, a.y);
  pen.lineTo(b.x, b.y);
  pen.lineWidth = thick + 3;
  pen.strokeStyle = colorOf("--panel");
  pen.stroke();
  pen.lineWidth = open ? Math.max(1.5, thick / 3) : thick;
  pen.setLineDash(open ? [6, 6] : []);
  pen.strokeStyle = machineColor(machine);
  pen.stroke();
  pen.setLineDash([]);
}

function paintJoint(at, machine, open, thick) {
  pen.beginPath();
  pen.arc(at.x, at.y, open ? thick * 0.42 : thick * 0.62, 0, 2 * Math.PI);
  pen.fillStyle = open ? colorOf("--panel") : machineColor(machine);
  pen.fill();
  pen.lineWidth = 1.3;
  pen.strokeStyle = open ? machineColor(machine) : colorOf("--panel");
  pen.stroke();
}

function paintMeasured(at, model, color) {
  if (model) {
    pen.beginPath();
    pen.moveTo(at.x, at.y);
    pen.lineTo(model.x, model.y);
    pen.lineWidth = 1;
    pen.strokeStyle = colorOf("--ink");
    pen.stroke();
  }
  pen.beginPath();
  pen.arc(at.x, at.y, 3.6, 0, 2 * Math.PI);
  pen.fillStyle = color || colorOf("--ink");
  pen.fill();
  pen.lineWidth = 1.2;
  pen.strokeStyle = colorOf("--panel");
  pen.stroke();
}

function paintHidden(at) {
  pen.beginPath();
  pen.arc(at.x, at.y, 5, 0, 2 * Math.PI);
  pen.fillStyle = colorOf("--panel");
  pen.fill();
  pen.lineWidth = 1.4;
  pen.setLineDash([2.5, 2]);
  pen.strokeStyle = colorOf("--ink");
  pen.stroke();
  pen.setLineDash([]);
}

/** Names of machines beside their outermost node; one that would cover another is left out. */
function paintNames(spots, width, height) {
  const taken = [];
  pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
  pen.textBaseline = "middle";
  data.machines.forEach((machine, m) => {
    const node = data.body.machine.lastIndexOf(m), spot = node >= 0 && spots[node];
    if (!spot) return;
    const wide = pen.measureText(machine.name).width, box = {x: spot.x + 9, y: spot.y - 16, w: wide, h: 14};
    const covered = taken.some((o) => box.x < o.x + o.w && o.x < box.x + box.w && box.y < o.y + o.h && o.y < box.y + box.h);
    if (covered || box.x + wide > width - 4 || box.y < 40 || box.y > height - 30) return;
    taken.push(box);
    pen.lineWidth = 3;
    pen.strokeStyle = colorOf("--panel");
    pen.strokeText(machine.name, box.x, box.y + 7);
    pen.fillStyle = colorOf("--ink");
    pen.fillText(machine.name, box.x, box.y + 7);
  });
}

function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value)), lead = value / power;
  return (lead >= 5 ? 5 : lead >= 2 ? 2 : 1) * power;
}

function lengthText(metres) {
  return metres >= 1 ? `${+metres.toPrecision(3)} m` : metres >= 0.01 ? `${+(metres * 100).toPrecision(3)} cm` : `${+(metres * 1000).toPrecision(3)} mm`;
}

/** A bar of a round length, and the world's axes. */
function paintScale(lens, width, height) {
  const bar = nice(90 / lens.pixels), wide = bar * lens.pixels, x = width - 16 - wide, y = height - 38;
  pen.strokeStyle = pen.fillStyle = colorOf("--soft");
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.moveTo(x, y - 4); pen.lineTo(x, y); pen.lineTo(x + wide, y); pen.lineTo(x + wide, y - 4);
  pen.stroke();
  pen.font = "11px system-ui, 'DejaVu Sans', sans-serif";
  pen.textAlign = "center";
  pen.fillText(lengthText(bar), x + wide / 2, y - 10);
  const base = [width - 46, 70];
  ["x", "y", "z"].forEach((name, axis) => {
    const dx = 22 * lens.right[axis], dy = -22 * lens.up[axis];
    pen.beginPath();
    pen.moveTo(...base); pen.lineTo(base[0] + dx, base[1] + dy);
    pen.stroke();
    pen.fillText(name, base[0] + 1.38 * dx, base[1] + 1.38 * dy + (Math.hypot(dx, dy) < 6 ? 10 : 0));
  });
  pen.textAlign = "start";
}

/** Lines on the ground below the body, where up is known: the eye takes depth from them. */
function paintGround(lens) {
  if (!data.up || !middles.length) return;
  const up = data.up, step = nice(data.camera.radius / 2), ground = groundHeight;
  const one = unit3(cross3(up, Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0])), two = cross3(up, one);
  const middle = add(lens.target, times3(up, ground - dot3(lens.target, up)));
  const start = (axis) => Math.round(dot3(middle, axis) / step);
  const at = (i, j) => lens.project(add(times3(up, ground), add(times3(one, (start(one) + i) * step), times3(two, (start(two) + j) * step))));
  pen.strokeStyle = colorOf("--line");
  pen.lineWidth = 1;
  for (let k = -6; k <= 6; k++) {
    for (const [a, b] of [[at(k, -6), at(k, 6)], [at(-6, k), at(6, k)]]) {
      if (!a || !b) continue;
      pen.beginPath();
      pen.moveTo(a.x, a.y); pen.lineTo(b.x, b.y);
      pen.stroke();
    }
  }
}

let groundHeight = 0;
function findGround() {
  if (!data.up) return;
  let lowest = Infinity;
  for (let frame = 0; frame < frameCount; frame += Math.max(1, Math.floor(frameCount / 200))) {
    const {nodes, measured} = placesOf(frame);
    for (const point of [...nodes, ...measured]) if (point) lowest = Math.min(lowest, dot3(point, data.up));
  }
  groundHeight = Number.isFinite(lowest) ? lowest - 0.05 * data.camera.radius : 0;
}

const everSeen = data.tokens.names.map((_, token) => {
  for (let frame = 0; frame < frameCount; frame++) if (measuredAt(frame, token)) return true;
  return false;
});

function drawScene() {
  const ratio = window.devicePixelRatio || 1, {clientWidth: width, clientHeight: height} = canvas;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  if (!frameCount) { $("scene-note").textContent = "this take has no frames"; return; }
  const lens = projector(width, height);
  if (view.camera !== "body") paintGround(lens);
  const thick = Math.max(3, Math.min(11, 0.055 * data.camera.radius * lens.pixels));
  const {items, spots} = pictureOf(view.frame, lens.project, thick);
  for (const item of items) item.paint();
  paintNames(spots, width, height);
  paintScale(lens, width, height);
  $("scene-note").textContent = noteOf(view.frame);
}

function noteOf(frame) {
  const seen = data.tokens.names.some((_, token) => measuredAt(frame, token));
  if (firstPose < 0) return seen ? "no pose in the whole take: measured points alone" : "nothing to see in this frame";
  if (poseKnown(frame)) return "";
  return poseFrame[frame] < 0 ? "pose not known yet: drawn at the first that is" : `pose unknown: the last one is drawn, of ${clockText(poseFrame[frame])}`;
}

function legend() {
  const symbol = (draw) => {
    const icon = svg("svg", {width: 22, height: 12, viewBox: "0 0 22 12", "aria-hidden": "true"});
    for (const [name, attributes] of draw) icon.append(svg(name, attributes));
    return icon;
  };
  const entries = [
    ["decided", [["path", {d: "M2 6H20", stroke: "currentColor", "stroke-width": 5, "stroke-linecap": "round"}]]],
    ["undecided", [["path", {d: "M1 6H21", stroke: "currentColor", "stroke-width": 2, "stroke-dasharray": "5 3"}]]],
    ["measured", [["circle", {cx: 11, cy: 6, r: 3.6, fill: "currentColor"}]]],
    ["not seen", [["circle", {cx: 11, cy: 6, r: 4.4, fill: "none", stroke: "currentColor", "stroke-dasharray": "2.5 2"}]]],
  ];
  for (const [text, draw] of entries) {
    const entry = make("span");
    entry.append(symbol(draw), make("span", {}, text));
    $("legend").append(entry);
  }
}

function resetCamera() {
  const rise = dot3(unit3(data.camera.toward), data.camera.up);
  Object.assign(camera, {yaw: 0, pitch: Math.asin(Math.max(-1, Math.min(1, rise))), zoom: 1});
}

function startScene() {
  smoothMiddles();
  measureWhole();
  findGround();
  resetCamera();
  legend();
  let drag = null;
  canvas.addEventListener("pointerdown", (event) => { drag = event; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointerup", () => { drag = null; });
  canvas.addEventListener("pointermove", (event) => {
    if (!drag) return;
    camera.yaw -= (event.clientX - drag.clientX) * 0.008;
    camera.pitch = Math.max(-1.5, Math.min(1.5, camera.pitch + (event.clientY - drag.clientY) * 0.008));
    drag = event;
    drawScene();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoom = Math.max(0.2, Math.min(8, camera.zoom * Math.exp(-event.deltaY * 0.0012)));
    drawScene();
  }, {passive: false});
  $("camera").addEventListener("change", () => show({camera: $("camera").value}));
  $("reset").addEventListener("click", () => { resetCamera(); drawScene(); });
  new ResizeObserver(drawScene).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  drawers.push(drawScene);
}
