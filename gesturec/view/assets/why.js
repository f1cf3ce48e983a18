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
  found.forEach(([state, probability], k) => {
    const outside = k >= machine.inside[frame];
    const row = rowOf([[machine.states[state], outside ? "soft" : null]]), cell = make("td", {class: "bar-cell"}), meter = make("div", {class: outside ? "meter outside" : "meter"}), fill = make("i");
    fill.style.width = `${100 * probability}%`;
    meter.append(fill);
    cell.append(meter);
    row.append(cell, make("td", {class: "number"}, percent(probability)));
    table.append(row);
  });
  box.append(table);
  const more = machine.possible[frame] - found.length;
  if (more > 0) line(box, `and ${more} more that are possible`, "soft");
  if (!found.length) line(box, "no candidate is known", "soft");
}

const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;

/** What a machine's answer rests on; NaN is what was not told. */
function evidenceOf(machine, frame) {
  const [chi, limit, delay, seen, reach, leaned] = [0, 1, 2, 3, 4, 5].map((k) => machine.fit[6 * frame + k]);
  return {chi, limit, delay, seen, reach, leaned, inside: machine.inside[frame]};
}

function fitText({chi, limit}) {
  if (!Number.isFinite(chi)) return "";
  return `χ² ${chi.toPrecision(3)}${Number.isFinite(limit) ? ` of at most ${limit.toPrecision(3)}` : ""}`;
}

/** How much of the probability is where it is by what the other limbs show. */
function leanText({leaned}) {
  return `${Math.round(100 * leaned)} %`;
}

/** The evidence in a few words, one a line: for the pointer. */
function evidenceLines(machine, m, frame) {
  const why = evidenceOf(machine, frame), tokens = data.tokens.machine.filter((owner) => owner === m).length, lines = [];
  if (!Number.isFinite(why.seen)) return ["nothing was told of this frame"];
  lines.push(`${why.seen} of ${plural(tokens, "token")} seen${fitText(why) ? `, ${fitText(why)}` : ""}`);
  lines.push(`${why.reach} of ${plural(machine.states.length, "state")} within reach, ${why.inside} in the 90 % set`);
  if (why.leaned >= 0.005) lines.push(`the pose of the other limbs moved ${leanText(why)} of the probability`);
  if (machine.state[frame] >= 0 && why.delay > 0) lines.push(`decided ${plural(why.delay, "frame")} later`);
  return lines;
}

function evidenceTable(box, machine, m, frame) {
  const why = evidenceOf(machine, frame), tokens = data.tokens.machine.filter((owner) => owner === m).length;
  if (!Number.isFinite(why.seen)) return;
  const table = make("table", {class: "evidence"});
  if (Number.isFinite(why.chi)) table.append(fitRow(why));
  table.append(rowOf([["tokens seen", "soft"], [`${why.seen} of ${tokens}`, "number"]]));
  table.append(rowOf([["within reach", "soft"], [`${why.reach} of ${plural(machine.states.length, "state")}`, "number"]]));
  table.append(rowOf([["90 % set", "soft"], [plural(why.inside, "state"), "number"]]));
  if (why.leaned >= 0.005) table.append(rowOf([["moved by the other limbs", "soft"], [leanText(why), "number"]]));
  if (machine.state[frame] >= 0) table.append(rowOf([["decided", "soft"], [why.delay > 0 ? `${plural(why.delay, "frame")} later` : "at once", "number"]]));
  box.append(table);
}

/** Chi-square as a bar: full at its limit, and red beyond it. */
function fitRow(why) {
  const row = rowOf([["fit", "soft"]]), cell = make("td", {class: "number"}, fitText(why)), known = Number.isFinite(why.limit);
  row.title = "squared distance of what was measured from the best state within reach, in units of its covariance; beyond the limit no state explains it";
  if (known) {
    const meter = make("div", {class: why.chi > why.limit ? "meter beyond" : "meter"}), fill = make("i");
    fill.style.width = `${Math.min(100, 100 * why.chi / why.limit)}%`;
    meter.append(fill);
    cell.append(meter);
  }
  row.append(cell);
  return row;
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
  const heading = make("h2", {class: "machine"}, `${machine.name}: ${state >= 0 ? machine.states[state] : "undecided"} `);
  const own = data.statuses[machine.status[frame]];
  if (own) heading.append(statusChip(own));
  box.append(heading);
  if (own) line(box, ["ok", "partial"].includes(own[0]) ? own[1] : `${own[1]}. ${own[2]}`, "soft");
  candidateTable(box, machine, frame);
  evidenceTable(box, machine, m, frame);
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

const MOST_CHIPS = 12;

function chips(box, title, names) {
  if (!names.length) return;
  box.append(make("h2", {}, title));
  for (const name of names.slice(0, MOST_CHIPS)) box.append(make("span", {class: "chip"}, name));
  if (names.length > MOST_CHIPS) box.append(make("span", {class: "soft", title: names.slice(MOST_CHIPS).join(", ")}, ` and ${names.length - MOST_CHIPS} more`));
}

/** A status as a word in a frame, coloured as in the ribbon; its meaning is under the pointer. */
function statusChip([word, doc, help]) {
  const chip = make("span", {class: "chip status", title: `${doc}. ${help}`}, word);
  chip.style.background = STATUS_COLORS[word] || "#d3d6da";
  return chip;
}

function drawWhy() {
  const box = $("why"), frame = view.frame;
  box.replaceChildren();
  if (!frameCount) { box.append(make("p", {class: "empty"}, "no frames")); return; }
  const whole = data.statuses[statuses[frame]], places = placesOf(frame), chosen = data.machines[view.machine];
  const heading = make("h2", {}, `frame ${frame * data.frames.every} `);
  heading.append(statusChip(whole));
  box.append(heading);
  if (!chosen || chosen.status[frame] !== statuses[frame]) line(box, whole[1], "soft");
  if (data.machines.length) machineWhy(box, view.machine, frame, places);
  rootWhy(box, frame, places);
  chips(box, "poses that hold", data.poses.filter((each) => each.value[frame] === 1).map((each) => each.name));
  const open = data.poses.filter((each) => each.value[frame] === 2).map((each) => each.name);
  chips(box, "poses that may hold", open);
  if (open.length) line(box, "what they ask for is not decided, or not known, in this frame", "soft");
  chips(box, "gestures", data.events.filter((e) => times[frame] >= e.start && (e.end === null || times[frame] <= e.end)).map((e) => e.name));
}
