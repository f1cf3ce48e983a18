// The chosen machine's graph: the state of the frame lit, its successors ringed, the way it came as a trail.

const TRAIL = 10;  // states before the current one
const LARGE = 1.7;  // times the room that there is: from here on a part around the current state is shown
const built = {machine: -1, panel: null, nodes: [], trail: null, halo: null, root: null};

/** The panel that is shown: the chosen one, or that of the state of the frame (or of the last known). */
function shownPanel(graph, machine) {
  if (graph.panels.length < 2 || graph.kind !== "plane") return -1;
  if (view.panel >= 0) return view.panel;
  const state = shownState(machine, view.frame);
  return state >= 0 ? graph.panel[state] : 0;
}

/** The state of a frame, its most probable candidate, or the last known one. */
function shownState(machine, frame) {
  for (let k = frame; k >= 0; k--) {
    if (machine.state[k] >= 0) return machine.state[k];
    const found = candidates(machine, k);
    if (found.length) return found[0][0];
  }
  return -1;
}

function boxOf(graph, panel) {
  if (panel < 0) return [-6, -6, graph.size[0] + 12, graph.size[1] + 12];
  const {x, y, width, height} = graph.panels[panel];
  return [x - 4, y - 4, width + 8, height + 8];
}

function buildGraph(machine, panel) {
  const graph = machine.graph, box = $("graph-box");
  box.replaceChildren();
  Object.assign(built, {machine: view.machine, panel, nodes: [], trail: null});
  $("graph-caption").textContent = graph ? graph.caption : "";
  if (!graph) { box.append(make("p", {class: "empty"}, `${machine.states.length} states: too many to draw here; \`gesturec graph\` draws them`)); return; }
  const shows = (state) => panel < 0 || graph.panel[state] === panel;
  const root = svg("svg", {viewBox: boxOf(graph, panel).join(" "), role: "img", "aria-label": graph.caption});
  root.append(arrowHead());
  for (const shape of graph.shapes) if (panel < 0 || shape.panel < 0 || shape.panel === panel) root.append(svg("path", {d: shape.path, fill: shape.fill, stroke: shape.stroke, opacity: 0.5}));
  if (graph.kind === "trellis") for (const p of graph.panels) root.append(svg("rect", {x: p.x, y: p.y, width: p.width, height: p.height, rx: 3, class: "panel-box"}));
  for (const [a, b, both] of graph.arcs) if (shows(a) && shows(b)) root.append(arcLine(graph, a, b, both));
  for (const text of graph.texts) if (panel < 0) root.append(svg("text", {x: text.x, y: text.y, "text-anchor": text.anchor, class: "soft"}, text.text));
  built.trail = svg("g", {class: "trail"});
  root.append(built.trail);
  graph.position.forEach((_, state) => { if (shows(state)) root.append(nodeOf(machine, state)); });
  built.halo = svg("circle", {class: "halo", r: graph.radius + Math.max(3, 0.25 * graph.radius), visibility: "hidden"});
  root.append(built.halo);
  built.root = root;
  box.append(root);
}

function isLarge(graph) {
  const box = $("graph-box");
  return graph.kind === "trellis" && Math.max(graph.size[0] / box.clientWidth, graph.size[1] / box.clientHeight) > LARGE;
}

/** Of a graph that is large for its place now, move the window to the state of the frame and say in which panel it is. */
function focusGraph(machine) {
  const graph = machine.graph, state = shownState(machine, view.frame);
  const near = isLarge(graph) && !view.whole && state >= 0, size = [$("graph-box").clientWidth, $("graph-box").clientHeight].map((side) => side / 0.9);
  const corner = near ? graph.position[state].map((at, axis) => Math.max(-6, Math.min(graph.size[axis] + 6 - size[axis], at - size[axis] / 2))) : null;
  built.root.setAttribute("viewBox", (near ? [...corner, ...size] : boxOf(graph, built.panel)).join(" "));
  $("graph-caption").textContent = near ? `around ${graph.panels[graph.panel[state]].title}` : graph.caption;
}

function arrowHead() {
  const defs = svg("defs"), marker = svg("marker", {id: "head", viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 7, markerHeight: 7, orient: "auto-start-reverse"});
  marker.append(svg("path", {d: "M0 0.8L7 4L0 7.2Z", class: "arrow"}));
  defs.append(marker);
  return defs;
}

function arcLine(graph, a, b, both) {
  const [ax, ay] = graph.position[a], [bx, by] = graph.position[b], far = Math.hypot(bx - ax, by - ay) || 1;
  const inset = Math.min(graph.radius + 1, far / 3), ux = (bx - ax) / far * inset, uy = (by - ay) / far * inset;
  return svg("path", {d: `M${ax + ux} ${ay + uy}L${bx - ux} ${by - uy}`, class: "arc", "marker-end": both || far < 3 * graph.radius ? null : "url(#head)"});
}

function nodeOf(machine, state) {
  const graph = machine.graph, [x, y] = graph.position[state];
  const group = svg("g", {class: "node", "data-state": machine.states[state], transform: `translate(${x} ${y})`});
  group.append(svg("circle", {r: graph.radius, fill: machine.colors[state]}), svg("title", {}, machine.states[state]));
  const lines = graph.labels[state] ? graph.labels[state].split("\n") : [];
  lines.forEach((line, k) => group.append(svg("text", {y: 3.4 + 10.5 * (k - (lines.length - 1) / 2)}, line)));
  built.nodes[state] = group;
  return group;
}

function markNodes(machine) {
  const state = machine.state[view.frame], possible = state < 0 ? candidates(machine, view.frame) : [];
  const graph = machine.graph, successors = new Set();
  if (state >= 0 && graph.successors) for (let k = graph.successors.start[state]; k < graph.successors.start[state + 1]; k++) successors.add(graph.successors.target[k]);
  const maybe = new Map(possible);
  built.nodes.forEach((node, s) => {
    const kind = s === state ? "node lit" : maybe.has(s) ? "node maybe" : successors.has(s) ? "node next" : "node";
    if (node.getAttribute("class") !== kind) node.setAttribute("class", kind);
    node.querySelector("title").textContent = maybe.has(s) ? `${machine.states[s]}: ${percent(maybe.get(s))}` : machine.states[s];
  });
  const lit = state >= 0 && built.nodes[state];
  built.halo.setAttribute("visibility", lit ? "visible" : "hidden");
  if (lit) {
    built.halo.setAttribute("cx", graph.position[state][0]);
    built.halo.setAttribute("cy", graph.position[state][1]);
  }
}

/** The last states before this frame, each once as it was entered. */
function trailOf(machine) {
  const states = [];
  for (let k = view.frame; k >= 0 && states.length <= TRAIL; k--) {
    const state = machine.state[k];
    if (state >= 0 && state !== states[states.length - 1]) states.push(state);
  }
  return states;
}

function drawTrail(machine) {
  built.trail.replaceChildren();
  const states = trailOf(machine), graph = machine.graph;
  for (let k = 0; k + 1 < states.length; k++) {
    if (!built.nodes[states[k]] || !built.nodes[states[k + 1]]) continue;
    const [ax, ay] = graph.position[states[k + 1]], [bx, by] = graph.position[states[k]];
    const fade = 1 - k / (TRAIL + 1);
    built.trail.append(svg("path", {d: `M${ax} ${ay}L${bx} ${by}`, opacity: 0.85 * fade, "stroke-width": 1 + 2.6 * fade}));
  }
}

/** What is to be chosen about a graph: each button's text, whether it is pressed, and what it changes of the view. */
function panelChoices(graph, panel) {
  const choices = isLarge(graph) ? [["near the state", false], ["whole", true]].map(([text, whole]) => ({text, title: "", pressed: view.whole === whole, change: {whole}})) : [];
  if (panel < 0) return choices;
  return [...choices, ...graph.panels.map((each, k) => {
    const kept = view.panel === k;
    return {text: each.title + (kept ? " ⚲" : ""), title: kept ? "back to the slice of the current state" : "show this slice", pressed: k === panel, change: {panel: kept ? -1 : k}};
  })];
}

/** Buttons stay the same elements, so that the focus stays and no press is lost while a take plays. */
function panelButtons(graph, panel) {
  const box = $("panels"), choices = graph ? panelChoices(graph, panel) : [];
  while (box.children.length > choices.length) box.lastChild.remove();
  choices.forEach(({text, title, pressed, change}, k) => {
    const button = box.children[k] || box.appendChild(make("button", {type: "button"}));
    if (button.textContent !== text) button.textContent = text;
    button.title = title;
    button.setAttribute("aria-pressed", String(pressed));
    button.onclick = () => show(change);
  });
}

function drawGraph() {
  const machine = data.machines[view.machine];
  if (!machine) return;
  const panel = machine.graph ? shownPanel(machine.graph, machine) : -1;
  if (built.machine !== view.machine || built.panel !== panel) buildGraph(machine, panel);
  panelButtons(machine.graph, panel);
  if (!machine.graph) return;
  if (!frameCount) return;
  markNodes(machine);
  drawTrail(machine);
  focusGraph(machine);
}

function startGraph() {
  if (!data.machines.length) $("graph-box").append(make("p", {class: "empty"}, "a rigid body: it has no machine, only a pose"));
  new ResizeObserver(drawGraph).observe($("graph-box"));
  drawers.push(drawGraph);
}
