// Why the current frame got what it got: candidates with probabilities, how well they fit, what was not seen.

/** Distance between a measured token and the decoded model's, m; null where one of them is not known. */
function residual(token, places) {
  const measured = places.measured[token], model = places.nodes[data.tokens.node[token]];
  return measured && model ? length3(sub(measured, model)) : null;
}

function line(parent, text, kind = null) {
  parent.append(make("p", {class: kind}, text));
}

function rowOf(cells) {
  const row = make("tr");
  for (const [text, kind] of cells) row.append(make("td", {class: kind}, text));
  return row;
}

function candidateTable(box, machine, frame) {
  const found = candidates(machine, frame), table = make("table");
  for (const [state, probability] of found) {
    const row = rowOf([[machine.states[state], null]]), cell = make("td", {class: "bar-cell"}), meter = make("div", {class: "meter"}), fill = make("i");
    fill.style.width = `${100 * probability}%`;
    meter.append(fill);
    cell.append(meter);
    row.append(cell, make("td", {class: "number"}, percent(probability)));
    table.append(row);
  }
  box.append(table);
  const more = machine.possible[frame] - found.length;
  if (more > 0) line(box, `and ${more} more that are possible`, "soft");
  if (!found.length) line(box, "no candidate is known", "soft");
}

function fitText(machine, frame) {
  const [chi, limit, delay] = [0, 1, 2].map((k) => machine.fit[3 * frame + k]), parts = [];
  if (Number.isFinite(chi)) parts.push(`χ² ${chi.toPrecision(3)}${Number.isFinite(limit) ? ` of at most ${limit.toPrecision(3)}` : ""}`);
  if (Number.isFinite(delay) && delay > 0) parts.push(`decided ${delay} frame${delay === 1 ? "" : "s"} later`);
  return parts.join(" · ");
}

function residualTable(box, machine, places) {
  const table = make("table");
  data.tokens.names.forEach((name, token) => {
    if (data.tokens.machine[token] !== machine || !everSeen[token]) return;
    const away = residual(token, places);
    table.append(rowOf([[name, null], [away === null ? places.measured[token] ? "no pose" : "not seen" : away < 1 ? `${(1000 * away).toFixed(1)} mm` : `${away.toFixed(2)} m`, "number"]]));
  });
  if (!table.children.length) return;
  line(box, "measured from decoded", "soft");
  box.append(table);
}

function machineWhy(box, m, frame, places) {
  const machine = data.machines[m], state = machine.state[frame];
  box.append(make("h2", {}, `${machine.name}: ${state >= 0 ? machine.states[state] : "undecided"}`));
  const own = data.statuses[machine.status[frame]];
  if (own) line(box, `${own[0]}: ${own[1]}`, "soft");
  candidateTable(box, machine, frame);
  const fit = fitText(machine, frame);
  if (fit) line(box, fit);
  residualTable(box, m, places);
}

function rootWhy(box, frame, places) {
  const away = data.tokens.names.map((_, token) => data.tokens.machine[token] === -1 ? residual(token, places) : null).filter((r) => r !== null);
  box.append(make("h2", {}, "pose"));
  if (!poseKnown(frame)) line(box, "unknown in this frame");
  else if (away.length) line(box, `${away.length} root token${away.length === 1 ? "" : "s"}, residual ${(1000 * Math.sqrt(away.reduce((s, r) => s + r * r, 0) / away.length)).toFixed(1)} mm rms`);
  else line(box, "no root token seen");
  if (Number.isFinite(scales[frame])) line(box, `scale ${scales[frame].toFixed(3)}`, "soft");
}

function chips(box, title, names) {
  if (!names.length) return;
  box.append(make("h2", {}, title));
  for (const name of names) box.append(make("span", {class: "chip"}, name));
}

function drawWhy() {
  const box = $("why"), frame = view.frame;
  box.replaceChildren();
  if (!frameCount) { box.append(make("p", {class: "empty"}, "no frames")); return; }
  const [word, doc] = data.statuses[statuses[frame]], places = placesOf(frame);
  const heading = make("h2", {}, `frame ${frame * data.frames.every} `);
  heading.append(make("span", {class: word === "ok" || word === "partial" ? "chip" : "chip alarm", title: doc}, word));
  box.append(heading);
  line(box, doc, "soft");
  if (data.machines.length) machineWhy(box, view.machine, frame, places);
  rootWhy(box, frame, places);
  chips(box, "poses that hold", data.poses.filter((each) => each.value[frame] === 1).map((each) => each.name));
  const open = data.poses.filter((each) => each.value[frame] === 2).map((each) => each.name);
  chips(box, "poses that may hold", open);
  if (open.length) line(box, "what they ask for is not decided, or not known, in this frame", "soft");
  chips(box, "gestures", data.events.filter((e) => times[frame] >= e.start && (e.end === null || times[frame] <= e.end)).map((e) => e.name));
}
