// The page's own state and controls: what is shown (`view`), and who is told when it changes.
// Reads the payload that view/payload.py documents; the other files each draw one part.

const TYPES = {u1: Uint8Array, u2: Uint16Array, i2: Int16Array, i4: Int32Array, f4: Float32Array, f8: Float64Array};
const UNKNOWN = -32768;
const SVG = "http://www.w3.org/2000/svg";

const $ = (id) => document.getElementById(id);

/** A packed array as a typed one. */
function unpack(packed) {
  const text = atob(packed.base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return new TYPES[packed.dtype](bytes.buffer);
}

/** Packed points as a function of frame and index: [x, y, z], or null where unknown. */
function unpackPoints(packed) {
  const steps = unpack(packed), count = packed.shape[1], {offset, step} = packed;
  return (frame, index) => {
    const at = 3 * (frame * count + index);
    return steps[at] === UNKNOWN ? null : [0, 1, 2].map((axis) => steps[at + axis] * step + offset[axis]);
  };
}

/** An element with attributes and text; text is never parsed. */
function make(name, attributes = {}, text = null, space = null) {
  const element = space ? document.createElementNS(space, name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) if (value !== null) element.setAttribute(key, value);
  if (text !== null) element.textContent = text;
  return element;
}
const svg = (name, attributes, text = null) => make(name, attributes, text, SVG);

const data = JSON.parse($("data").textContent);
const frameCount = data.frames.count;
const times = unpack(data.frames.time), statuses = unpack(data.frames.status);
const pose = unpack(data.frames.pose), scales = unpack(data.frames.scale), located = data.frames.located && unpack(data.frames.located);
for (const machine of data.machines) {
  for (const key of ["state", "candidate", "probability", "possible", "inside", "status", "fit"]) machine[key] = unpack(machine[key]);
  if (machine.graph && machine.graph.successors) {
    machine.graph.successors = {start: unpack(machine.graph.successors.start), target: unpack(machine.graph.successors.target)};
  }
}
for (const each of data.poses) each.value = unpack(each.value);

const view = {frame: 0, machine: 0, panel: -1, playing: false, camera: "follow", whole: false};
const drawers = [];

/** Candidates of a machine in a frame: [[state, probability], ...], the most probable first. */
function candidates(machine, frame) {
  const width = machine.candidate.length / Math.max(1, frameCount), found = [];
  for (let k = frame * width; k < (frame + 1) * width; k++) {
    if (machine.candidate[k] >= 0) found.push([machine.candidate[k], Math.max(machine.probability[k], 0.3) / 255]);
  }
  return found;
}

function percent(share) {
  return share > 0 && share < 0.01 ? "< 1 %" : `${Math.round(100 * share)} %`;
}

function clockText(frame) {
  return Number.isFinite(times[frame]) ? `${times[frame].toFixed(2)} s` : "no time";
}

function redraw() {
  for (const draw of drawers) draw();
}

function show(change) {
  Object.assign(view, change);
  view.frame = Math.max(0, Math.min(frameCount - 1, Math.round(view.frame)));
  $("slider").value = String(Math.max(0, view.frame));
  $("clock").textContent = frameCount ? `${clockText(view.frame)} · frame ${view.frame * data.frames.every}` : "no frames";
  $("play").textContent = view.playing ? "❚❚" : "▶";
  $("play").setAttribute("aria-label", view.playing ? "Pause" : "Play");
  if (data.machines.length) $("machine").value = String(view.machine);
  redraw();
}

let played = 0, last = null;
/** One picture while playing: as many frames on as time has passed. */
function play(now) {
  if (!view.playing) { last = null; return; }
  if (last !== null) {
    played += (now - last) / 1000 * (data.frames.rate || 25) / data.frames.every * Number($("speed").value);
    const whole = Math.floor(played);
    played -= whole;
    if (whole && view.frame + whole >= frameCount - 1) show({frame: frameCount - 1, playing: false});
    else if (whole) show({frame: view.frame + whole});
  }
  last = now;
  requestAnimationFrame(play);
}

function toggle() {
  if (frameCount < 2) return;
  const again = !view.playing && view.frame >= frameCount - 1;
  show({playing: !view.playing, frame: again ? 0 : view.frame});
  if (view.playing) { last = null; requestAnimationFrame(play); }
}

const TURN = 0.1, CLOSER = 1.15;  // rad and times that one key turns the body and brings it closer
function onKey(event) {
  if (event.target.tagName === "SELECT" || event.ctrlKey || event.altKey || event.metaKey) return;
  const stride = event.shiftKey ? 10 : 1, machines = Math.max(1, data.machines.length);
  const actions = {
    ArrowLeft: () => show({frame: view.frame - stride, playing: false}),
    ArrowRight: () => show({frame: view.frame + stride, playing: false}),
    Home: () => show({frame: 0, playing: false}),
    End: () => show({frame: frameCount - 1, playing: false}),
    ArrowUp: () => show({machine: (view.machine + machines - 1) % machines, panel: -1}),
    ArrowDown: () => show({machine: (view.machine + 1) % machines, panel: -1}),
    a: () => turn(TURN, 0),
    d: () => turn(-TURN, 0),
    w: () => turn(0, TURN),
    s: () => turn(0, -TURN),
    q: () => zoomBody(1 / CLOSER),
    e: () => zoomBody(CLOSER),
    "+": () => zoomTime(0.5),
    "-": () => zoomTime(2),
    " ": toggle,
  };
  if (!actions[event.key] || (event.key === " " && event.target.tagName === "BUTTON")) return;
  event.preventDefault();
  actions[event.key]();
}

/** `#frame=57&machine=index` opens the page there. */
function startFromHash() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  const machine = data.machines.findIndex((each) => each.name === wanted.get("machine"));
  const frame = Number(wanted.get("frame"));
  return {frame: Number.isFinite(frame) ? frame / data.frames.every : 0, machine: Math.max(0, machine)};
}

function header() {
  document.title = `${data.title} · gesturec`;
  $("title").textContent = data.title;
  for (const [text, hint] of data.facts) $("facts").append(make("span", {title: hint}, text));
  if (data.frames.every > 1) $("facts").append(make("span", {title: "the take is long: the page holds a part of its frames"}, `every ${data.frames.every}. frame shown`));
  $("slider").max = String(Math.max(0, frameCount - 1));
  $("slider").disabled = $("play").disabled = frameCount < 2;
  data.machines.forEach((machine, k) => $("machine").append(make("option", {value: k}, machine.name)));
  $("machine").hidden = !data.machines.length;
}

function start() {
  header();
  $("slider").addEventListener("input", () => show({frame: Number($("slider").value), playing: false}));
  $("play").addEventListener("click", toggle);
  $("machine").addEventListener("change", () => show({machine: Number($("machine").value), panel: -1}));
  document.addEventListener("keydown", onKey);
  startScene();
  startGraph();
  startRibbon();
  drawers.push(drawWhy);
  show(startFromHash());
  window.addEventListener("hashchange", () => show(startFromHash()));
  document.documentElement.dataset.ready = "yes";
}

// A fault of the page is told in the page itself: nobody reads the console of a file.
window.addEventListener("error", (event) => {
  document.documentElement.dataset.error = event.message;
  $("title").textContent = `this page has a fault: ${event.message}`;
});
