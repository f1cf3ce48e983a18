// Strokes of the scene on a 2D canvas; each takes projected points and leaves the pen as it was but for colours.

const canvas = $("canvas"), pen = canvas.getContext("2d");

const colorOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

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

const AWAY = [0, 15, 30, 45];  // px that a name may stand from its usual places
const cover = (a, b) => a.x < b.x + b.w && b.x < a.x + a.w && a.y < b.y + b.h && b.y < a.y + a.h;

/** Where a name may stand around a spot, inside the picture, the best place first; `away`: that much higher and lower. */
function placesAround(spot, wide, width, height, away) {
  const clamp = (value, low, high) => Math.max(low, Math.min(high, value));
  const box = (x, y) => ({x: clamp(x, 4, width - wide - 4), y: clamp(y, 40, height - 44), w: wide, h: 14});
  const right = spot.x + 9, left = spot.x - 9 - wide, middle = spot.x - wide / 2;
  return [[right, -16], [left, -16], [right, 4], [left, 4], [middle, -26], [middle, 12]].map(([x, y]) => box(x, spot.y + y + Math.sign(y) * away));
}

/** Names of machines beside their outermost node, where they cover least; one without any room is left out. */
function paintNames(spots, width, height) {
  const taken = [], nodes = spots.filter((p) => p).map((p) => ({x: p.x - 6, y: p.y - 6, w: 12, h: 12}));
  pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
  pen.textBaseline = "middle";
  data.machines.forEach((machine, m) => {
    const node = data.body.machine.lastIndexOf(m), spot = node >= 0 && spots[node];
    if (!spot || spot.x < 0 || spot.x > width || spot.y < 0 || spot.y > height) return;
    const around = (away) => placesAround(spot, pen.measureText(machine.name).width, width, height, away).filter((each) => !taken.some((o) => cover(each, o)));
    const free = AWAY.map(around).find((places) => places.length);
    if (!free) return;
    const hides = free.map((each) => nodes.filter((node) => cover(each, node)).length), box = free[hides.indexOf(Math.min(...hides))];
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
