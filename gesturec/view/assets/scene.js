// The body in space: what of a frame is painted, in which order, and how the camera is turned.

/** What is to be painted, each with its depth; the farthest is painted first. */
function pictureOf(frame, project, thick) {
  const {nodes, measured} = placesOf(frame), spots = nodes.map((p) => p && project(p)), items = [];
  const undecided = (machine) => machine >= 0 && data.machines[machine].state[frame] < 0;
  for (const nodes of data.body.hulls) {
    const hull = nodes.map((node) => spots[node]).filter((p) => p);
    if (hull.length > 1) items.push({depth: Math.max(...hull.map((p) => p.depth)), paint: () => paintHull(hullOf(hull), nodeKnown(frame, nodes[0]))});
  }
  data.body.bones.forEach(([a, b], k) => {
    if (!spots[a] || !spots[b]) return;
    const machine = data.body.machine[b], open = undecided(machine) || !nodeKnown(frame, b);
    items.push({depth: (spots[a].depth + spots[b].depth) / 2, paint: () => paintBone(spots[a], spots[b], machine, open, data.body.whisker[k] ? thick / 3 : thick)});
  });
  spots.forEach((spot, node) => {
    if (spot) items.push({depth: spot.depth - 1e-6, paint: () => paintJoint(spot, data.body.machine[node], undecided(data.body.machine[node]) || !nodeKnown(frame, node), thick)});
  });
  data.tokens.names.forEach((name, token) => {
    const at = measured[token] && project(measured[token]), model = spots[data.tokens.node[token]];
    if (at) items.push({depth: at.depth - 2e-6, paint: () => paintMeasured(at, model, data.tokens.colors[token])});
    else if (model && everSeen[token]) items.push({depth: model.depth - 2e-6, paint: () => paintHidden(model)});
  });
  return {items: items.sort((a, b) => b.depth - a.depth), spots};
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

const REACH = 12;  // px from a token within which the pointer means it
let pointed = () => "";
/** What is said of the token nearest to the pointer. */
function tokenAt(x, y, project) {
  const places = placesOf(view.frame);
  let best = "", least = REACH;
  data.tokens.names.forEach((name, token) => {
    if (!everSeen[token]) return;
    const point = places.measured[token] || places.nodes[data.tokens.node[token]], spot = point && project(point);
    const far = spot ? Math.hypot(spot.x - x, spot.y - y) : Infinity, away = residual(token, places);
    if (far >= least) return;
    least = far;
    best = places.measured[token] ? `${name}${away === null ? "" : `, ${lengthText(away)} from the decoded place`}` : `${name}, not seen: where the model has it`;
  });
  return best;
}

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
  pointed = (x, y) => tokenAt(x, y, lens.project);
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

function turn(yaw, pitch) {
  camera.yaw += yaw;
  camera.pitch = Math.max(-1.5, Math.min(1.5, camera.pitch + pitch));
  drawScene();
}

function zoomBody(factor) {
  camera.zoom = Math.max(0.2, Math.min(8, camera.zoom * factor));
  drawScene();
}

function startScene() {
  smoothMiddles();
  measureWhole();
  findGround();
  resetCamera();
  legend();
  let drag = null;
  canvas.addEventListener("pointerdown", (event) => { drag = event; canvas.setPointerCapture(event.pointerId); });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { drag = null; });
  canvas.addEventListener("pointermove", (event) => {
    if (!drag) { canvas.title = pointed(event.offsetX, event.offsetY); return; }
    turn((drag.clientX - event.clientX) * 0.008, (event.clientY - drag.clientY) * 0.008);
    drag = event;
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomBody(Math.exp(-event.deltaY * 0.0012));
  }, {passive: false});
  $("camera").addEventListener("change", () => show({camera: $("camera").value}));
  $("reset").addEventListener("click", () => { resetCamera(); drawScene(); });
  new ResizeObserver(drawScene).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  drawers.push(drawScene);
}
