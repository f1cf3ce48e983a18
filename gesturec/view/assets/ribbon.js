// States over time: one row a machine, runs merged, what is undecided hatched; then status, gestures and poses.

const ROW = 21, GAP = 4, RIGHT = 8;
const GRAIN = 1.5;  // px: of stretches below it none could be seen
const LETTER = 6.6;  // px of a letter of a row's name, about
// One colour a status by what it asks of the reader: fine, carried on, open, wrong, unknown.
const STATUS_COLORS = {
  ok: "#a9d8b8", partial: "#cde6c3", coasting: "#f1df9a", any: "#e3e5e8", undecided: "#d3d6da", "partly-misfit": "#f5c6b8", misfit: "#f0a38f", lost: "#f0a38f",
  "pose-held": "#cbb9e3", "pose-unknown": "#b79bd9", "no-tokens": "#b79bd9", "time-refused": "#9aa0a8", "input-refused": "#9aa0a8", starting: "#e3e5e8",
};
const SHORTEST = 20;  // frames of the narrowest window
const ribbon = {width: 0, left: 0, playhead: null, names: [], rows: [], from: 0, to: Math.max(1, frameCount)};

/** Stretches of frames with one key: [[start, end, key], ...], end not included. */
function runsOf(key) {
  const runs = [];
  for (let frame = 0; frame < frameCount; frame++) {
    const value = key(frame), before = runs[runs.length - 1];
    if (before && before[2] === value) before[1] = frame + 1;
    else runs.push([frame, frame + 1, value]);
  }
  return runs;
}

/** What of a window's runs is drawn: neighbours below a grain's width become one, of the gravest that is among them. */
function drawnRuns(runs, gravity) {
  const grain = GRAIN * (ribbon.to - ribbon.from) / Math.max(1, ribbon.width - ribbon.left - RIGHT), drawn = [];
  let open = null, heaviest = 0;
  for (const run of runs) {
    const long = run[1] - run[0];
    if (run[1] <= ribbon.from || run[0] >= ribbon.to) continue;
    if (grain <= 1 || long >= grain) { drawn.push(run); open = null; continue; }
    if (!open || open[1] - open[0] >= grain) { drawn.push(open = [...run]); heaviest = long; continue; }
    open[1] = run[1];
    const graver = gravity(run[2]) - gravity(open[2]);
    if (graver > 0 || (graver === 0 && long > heaviest)) { open[2] = run[2]; heaviest = long; }
  }
  return drawn;
}

/** Where a frame is across the ribbon; frames outside the window are at its edges. */
function xOf(frame) {
  const share = (frame - ribbon.from) / (ribbon.to - ribbon.from);
  return ribbon.left + Math.max(0, Math.min(1, share)) * (ribbon.width - ribbon.left - RIGHT);
}

/** A run as a rectangle with its name where that fits. */
function block(parent, run, y, height, look) {
  const [start, end] = run;
  if (end <= ribbon.from || start >= ribbon.to) return;
  const x = xOf(start), wide = Math.max(0.6, xOf(end) - x - (xOf(end) - x > 4 ? 1 : 0));
  const rect = svg("rect", {x: x.toFixed(2), y, width: wide.toFixed(2), height, rx: wide > 6 ? 2 : 0, fill: look.fill, class: look.kind || null});
  if (look.title) rect.append(svg("title", {}, look.title));
  parent.append(rect);
  const fits = Math.floor((wide - 6) / 6.2), text = [look.text].flat().find((each) => each && each.length <= fits);
  if (text) parent.append(svg("text", {x: x + 4, y: y + height / 2 + 3.8, class: look.kind ? "run open" : "run"}, text));
}

function spanText(run) {
  const end = Math.min(frameCount - 1, run[1]);
  return `${clockText(run[0])} to ${clockText(end)}`;
}

/** How much a reader wants to see a stretch: what is wrong before what is open, and that before a state. */
function machineGravity(key) {
  return key >= 0 ? 0 : isWrong(key) ? 2 : 1;
}

function wordOf(key) {
  return data.statuses[-1 - key] ? data.statuses[-1 - key][0] : "undecided";
}

const isWrong = (key) => ["misfit", "lost"].includes(wordOf(key));

/** How a stretch of one state looks; of an undecided one the states still possible are named where there is room. */
function stateLook(machine, run) {
  const [start, end, key] = run;
  if (key >= 0) return {fill: machine.colors[key] || "#b9cdea", text: machine.states[key]};
  if (isWrong(key)) return {fill: "url(#alarm)", kind: "undecided misfit", text: wordOf(key)};
  const middle = Math.floor((start + end) / 2), count = machine.inside[middle], some = candidates(machine, middle).slice(0, count).map(([s]) => machine.states[s]);
  const set = count && count === some.length && count < 4 ? `undecided: ${some.join(" or ")}` : null;
  return {fill: "url(#hatch)", kind: "undecided", text: [set, count ? `undecided: one of ${count} states (90 %)` : null, "undecided"]};
}

function machineKey(machine, frame) {
  const state = machine.state[frame];
  return state >= 0 ? state : -1 - (machine.status[frame] === 255 ? statuses[frame] : machine.status[frame]);
}

function patterns() {
  const defs = svg("defs");
  for (const [id, line] of [["hatch", "hatch-line"], ["alarm", "alarm-line"]]) {
    const pattern = svg("pattern", {id, width: 6, height: 6, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)"});
    pattern.append(svg("line", {x1: 0, y1: 0, x2: 0, y2: 6, class: line}));
    defs.append(pattern);
  }
  return defs;
}

/** Rows of bars that may overlap: each goes into the first lane that is free. */
function lanesOf(spans) {
  const ends = [], lanes = [];
  for (const span of [...spans].sort((a, b) => a.start - b.start)) {
    let lane = ends.findIndex((end) => end <= span.start);
    if (lane < 0) lane = ends.push(0) - 1;
    ends[lane] = span.end;
    lanes.push({...span, lane});
  }
  return {lanes, count: ends.length};
}

/** The first frame at or after a time; the last one if there is none. */
function frameAt(time) {
  for (let frame = 0; frame < frameCount; frame++) if (times[frame] >= time - 1e-9) return frame;
  return frameCount - 1;
}

const seconds = (time, without) => time === null ? without : `${time.toFixed(2)} s`;

function eventSpans() {
  return data.events.map((event) => {
    const start = event.start === null ? 0 : frameAt(event.start), end = event.end === null ? frameCount : Math.max(start + 1, frameAt(event.end) + 1);
    const sure = event.confidence === null ? "" : `, confidence ${percent(event.confidence)}`;
    const title = `${event.name}: ${seconds(event.start, "the start")} to ${seconds(event.end, "the end")}, decided at ${seconds(event.decided, "an unknown time")}${sure}`;
    return {start, end, text: event.name, fill: "#8fc79f", title};
  });
}

function poseSpans() {
  const spans = [];
  for (const each of data.poses) {
    if (each.name.includes(".")) continue;
    for (const run of runsOf((frame) => each.value[frame])) {
      if (run[2] === 1) spans.push({start: run[0], end: run[1], text: each.name, fill: "#a8c8e8", title: `${each.name}, ${spanText(run)}`});
    }
  }
  return spans;
}

function rowName(root, text, y, machine = null) {
  const most = Math.floor(ribbon.left / LETTER), short = text.length > most ? `${text.slice(0, most - 1)}…` : text;
  const name = svg("text", {x: ribbon.left - 8, y: y + ROW / 2 + 4, "text-anchor": "end", class: machine === null ? "name soft" : "name", "data-machine": machine}, short);
  name.append(svg("title", {}, text));
  if (machine !== null) name.addEventListener("pointerdown", (event) => { event.stopPropagation(); show({machine, panel: -1}); });
  root.append(name);
  if (machine !== null) ribbon.names[machine] = name;
}

function laneBack(root, y) {
  root.append(svg("rect", {x: ribbon.left, y, width: ribbon.width - ribbon.left - RIGHT, height: ROW, class: "lane", rx: 2}));
}

function spanRows(root, name, spans, y) {
  const {lanes, count} = lanesOf(spans);
  if (!count) return y;
  rowName(root, name, y);
  for (let lane = 0; lane < count; lane++) laneBack(root, y + lane * (ROW + 2));
  for (const span of lanes) block(root, [span.start, span.end], y + span.lane * (ROW + 2), ROW, span);
  return y + count * (ROW + 2) + GAP - 2;
}

function timeAxis(root, y) {
  const known = times.subarray(ribbon.from, ribbon.to).filter(Number.isFinite);
  if (known.length < 2) return;
  const first = Math.min(known[0], known[known.length - 1]), last = Math.max(known[0], known[known.length - 1]);
  const step = nice(Math.max(1e-6, (last - first) / Math.max(2, (ribbon.width - ribbon.left) / 90)) * 2);
  const digits = Math.max(0, -Math.floor(Math.log10(step)));
  for (let k = Math.ceil(first / step); k * step <= last; k++) {
    const x = xOf(frameAt(k * step));
    root.append(svg("line", {x1: x, x2: x, y1: y, y2: y + 4, class: "tick"}), svg("text", {x, y: y + 14, "text-anchor": "middle", class: "soft"}, `${(k * step).toFixed(digits)} s`));
  }
}

function buildRibbon() {
  const box = $("ribbon");
  box.replaceChildren();
  ribbon.width = box.clientWidth;
  ribbon.left = Math.round(Math.max(66, Math.min(104, ribbon.width / 5)));
  ribbon.names = [];
  ribbon.rows = [];
  if (!frameCount) { box.append(make("p", {class: "empty"}, "no frames: nothing was decoded")); return; }
  const root = svg("svg", {role: "img", "aria-label": "states over time"});
  root.append(patterns());
  let y = 2;
  data.machines.forEach((machine, m) => {
    rowName(root, machine.name, y, m);
    laneBack(root, y);
    ribbon.rows.push([y - GAP / 2, y + ROW + GAP / 2]);
    machine.runs ??= runsOf((frame) => machineKey(machine, frame));
    for (const run of drawnRuns(machine.runs, machineGravity)) block(root, run, y, ROW, stateLook(machine, run));
    y += ROW + GAP;
  });
  rowName(root, "status", y);
  for (const run of drawnRuns(runsOf((frame) => statuses[frame]), (status) => status)) {
    const [word, doc] = data.statuses[run[2]];
    block(root, run, y, ROW - 6, {fill: STATUS_COLORS[word] || "#d3d6da", text: word, title: `${word}: ${doc}; ${spanText(run)}`});
  }
  y += ROW - 6 + GAP;
  y = spanRows(root, "gestures", eventSpans(), y);
  y = spanRows(root, "poses", poseSpans(), y);
  timeAxis(root, y);
  ribbon.playhead = svg("line", {y1: 0, y2: y + 2, class: "playhead"});
  root.append(ribbon.playhead);
  root.setAttribute("height", y + 20);
  root.setAttribute("viewBox", `0 0 ${ribbon.width} ${y + 20}`);
  document.documentElement.style.setProperty("--ribbon", `${y + 20}px`);
  listen(root);
  box.append(root, make("div", {id: "hint", hidden: ""}));
}

/** The frame and the machine (-1: none) under the pointer. */
function pointedAt(root, event) {
  const box = root.getBoundingClientRect(), share = (event.clientX - box.left - ribbon.left) / (ribbon.width - ribbon.left - RIGHT);
  const y = event.clientY - box.top, machine = ribbon.rows.findIndex(([top, bottom]) => y >= top && y < bottom);
  const frame = Math.max(0, Math.min(frameCount - 1, Math.floor(ribbon.from + share * (ribbon.to - ribbon.from))));
  return {frame, machine, x: event.clientX - box.left, y};
}

/** Why the machine under the pointer has its state in that frame. */
function drawHint(root, event) {
  const {frame, machine: m, x, y} = pointedAt(root, event), hint = $("hint"), machine = data.machines[m];
  hint.hidden = !machine || x < ribbon.left;
  if (hint.hidden) return;
  const state = machine.state[frame], own = data.statuses[machine.status[frame]] || data.statuses[statuses[frame]];
  const found = candidates(machine, frame).slice(0, 4).map(([s, p]) => `${machine.states[s]} ${percent(p)}`);
  hint.replaceChildren(make("b", {}, `${machine.name} ${state >= 0 ? machine.states[state] : "undecided"} · ${clockText(frame)}`));
  hint.append([`${own[0]}: ${own[1]}`, found.length ? `${found.join(", ")}${machine.possible[frame] > found.length ? ", …" : ""}` : "no candidates", ...evidenceLines(machine, m, frame)].join("\n"));
  hint.style.left = `${Math.max(0, Math.min(x + 14, ribbon.width - hint.offsetWidth - 4))}px`;
  hint.style.top = `${y - hint.offsetHeight - 10}px`;
}

function listen(root) {
  const seek = (event) => show({frame: pointedAt(root, event).frame, playing: false});
  const choose = (event) => {
    const {machine} = pointedAt(root, event);
    if (machine >= 0 && machine !== view.machine) show({machine, panel: -1});
    seek(event);
  };
  root.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.shiftKey) return;
    event.preventDefault();
    zoomTime(Math.exp((event.deltaY || event.deltaX) * 0.002));
  }, {passive: false});
  root.addEventListener("pointerdown", (event) => { if (event.offsetX > ribbon.left - 4) { root.setPointerCapture(event.pointerId); choose(event); } });
  root.addEventListener("pointerleave", () => { $("hint").hidden = true; });
  root.addEventListener("pointermove", (event) => { drawHint(root, event); if (event.buttons & 1 && root.hasPointerCapture(event.pointerId)) seek(event); });
}

/** Show a window of frames of that size around the current one. */
function setWindow(size) {
  const width = Math.round(Math.max(Math.min(SHORTEST, frameCount), Math.min(frameCount, size)));
  const from = Math.max(0, Math.min(frameCount - width, Math.round(view.frame - width / 2)));
  if (from === ribbon.from && from + width === ribbon.to) return;
  Object.assign(ribbon, {from, to: from + width});
  buildRibbon();
}

function zoomTime(factor) {
  if (!frameCount) return;
  setWindow((ribbon.to - ribbon.from) * factor);
  drawRibbon();
}

function drawRibbon() {
  if (!ribbon.playhead || !frameCount) return;
  if (view.frame < ribbon.from || view.frame >= ribbon.to) setWindow(ribbon.to - ribbon.from);
  const x = xOf(view.frame + 0.5);
  ribbon.playhead.setAttribute("x1", x);
  ribbon.playhead.setAttribute("x2", x);
  ribbon.names.forEach((name, m) => name.setAttribute("class", m === view.machine ? "name chosen" : "name"));
}

function startRibbon() {
  $("closer").addEventListener("click", () => zoomTime(0.5));
  $("wider").addEventListener("click", () => zoomTime(2));
  buildRibbon();
  new ResizeObserver(() => { if ($("ribbon").clientWidth !== ribbon.width) { buildRibbon(); drawRibbon(); } }).observe($("ribbon"));
  drawers.push(drawRibbon);
}
