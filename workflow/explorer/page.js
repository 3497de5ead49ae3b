"use strict";
// The page: inputs, the drawing, the gripper's motion. Everything drawn is in L*; numbers shown are in m.

const GRAVITY = 9.81;
const STEP = 0.02; // L*: a motion of the gripper is followed in steps of this length
const TAUT = "The gripper cannot go farther here: the strip is taut. Move towards the held end.";
const tables = decodeTables(JSON.parse(document.getElementById("tables").textContent));
const FOLD_HEIGHT = tables.loop.height;
const LENGTHS = [tables.rPath.lengths[0], tables.rPath.lengths[tables.rPath.lengths.length - 1]];
const field = (id) => document.getElementById(id);
const view = field("view");
let strip, unit, gripper, state, fell, cameOff, stopped, playing = 0;

/** An SVG element with attributes, in `parent`. */
function draw(parent, name, attributes) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent.append(element);
  return element;
}

const number = (value, digits = 4) => Number(value.toPrecision(digits)).toString();
const metres = (value) => `${number(value * unit)} m`;
const asLine = (places) => "M" + places.map(([x, z]) => `${x.toFixed(4)} ${(-z).toFixed(4)}`).join("L");

/** A part of the strip as cubic curves between its places. */
function asCurve(places) {
  let text = `M${places[0].x.toFixed(5)} ${(-places[0].z).toFixed(5)}`;
  for (let i = 1; i < places.length; i++) {
    const [p, q] = [places[i - 1], places[i]], third = (q.s - p.s) / 3;
    const control = [p.x + third * p.dx, -p.z - third * p.dz, q.x - third * q.dx, -q.z + third * q.dz, q.x, -q.z];
    text += `C${control.map((value) => value.toFixed(5)).join(" ")}`;
  }
  return text;
}

/** The strip of the inputs, flat; where they cannot be used says why and leaves the picture as it is. */
function readStrip() {
  const length = Number(field("length").value), value = Number(field("material").value);
  const star = field("known").value === "fold" ? value / FOLD_HEIGHT : (value * GRAVITY) ** (-1 / 3);
  const relative = length / star, usable = relative >= LENGTHS[0] && relative <= LENGTHS[1];
  const known = star > 0 && isFinite(star);
  field("length").classList.toggle("refused", known && !usable);
  field("material").classList.toggle("refused", !known);
  field("actions").disabled = !usable;
  field("refusal").textContent = usable ? "" : `${refusal(known && star)} The picture shows the last strip.`;
  if (!usable) return;
  unit = star;
  strip = new Strip(tables, relative);
  field("height").min = tables.below.lowest;
  field("height").max = strip.highestFall;
  field("height").value = 6;
  layFlat();
}

/** Why the inputs cannot be used; `star`: L* of the material, false if there is none. */
function refusal(star) {
  if (!star) return "Give a positive number for the material.";
  const [least, most] = LENGTHS.map((length) => number(length * star, 3));
  return `A strip of this material can be ${least} to ${most} m long here (${LENGTHS.join(" to ")} L*).`;
}

function say(text, warns) {
  field("verdict").textContent = text;
  field("verdict").classList.toggle("warns", Boolean(warns));
}

function layFlat() {
  playing = 0;
  gripper = [-strip.half, 0];
  fell = cameOff = stopped = null;
  state = strip.state(...gripper);
  show();
}

/** Move the gripper to a place, in small steps, through a fall if there is one; false where it cannot go on. */
function moveTo(toX, toZ) {
  const { half } = strip, { lowest } = tables.below, { highest } = tables.above;
  const x = Math.min(Math.max(toX, -half), half), z = Math.min(Math.max(toZ, 0), highest);
  stopped = null;
  if (toX > half) stopped = "The gripper is above the held end: the fold ends here.";
  if (toX < -half) stopped = TAUT;
  if (toZ > highest) stopped = `The gripper cannot go higher: ${metres(highest)} is the greatest height with states.`;
  const way = Math.hypot(x - gripper[0], z - gripper[1]), steps = Math.max(1, Math.ceil(way / STEP));
  const begin = gripper;
  for (let i = 1; i <= steps; i++) {
    const place = [begin[0] + ((x - begin[0]) * i) / steps, begin[1] + ((z - begin[1]) * i) / steps];
    let next = strip.state(...place, state.touches);
    if (next.kind === "low") {
      place[1] = lowest;
      next = strip.state(...place, state.touches);
      stopped = `The gripper cannot go lower: ${metres(lowest)} is the lowest height with states while the strip ` +
        "is carried over.";
    }
    const falls = next.kind === "falls";
    if (falls) next = strip.lying(...place) ?? next;
    if (!next.parts) {
      stopped = next.kind === "stretched" ? TAUT
        : "The gripper cannot go farther here: nothing of the strip would lie on the floor.";
      show();
      return false;
    }
    if (falls) fell = { x: place[0], z: place[1], parts: state.parts };
    if (state.touches && !next.touches) {
      cameOff = place[1] > strip.touchLimit ? { x: place[0], z: place[1] } : null;
      fell = null;
    }
    if (next.touches) cameOff = null;
    gripper = place;
    state = next;
  }
  show();
  return true;
}

/** What the state means, in words, and whether it warns. */
function verdict() {
  if (stopped) return [stopped, true];
  if (fell) {
    const off = strip.limits(gripper[1]).comesOff - strip.half;
    const on = state.kind === "fold" ? "The fold lies: carry on to finish it" :
      `Carry on to finish the fold, or go back: at x = ${metres(off)} the sag comes off`;
    return [`The strip fell at x = ${metres(fell.x)}, z = ${metres(fell.z)}. ${on}. To avoid the fall, carry it over ` +
      `lower than ${metres(strip.touchLimit)} (low path), or use the R-path if the fabric has friction in bending.`, true];
  }
  if (cameOff && Math.hypot(gripper[0] - cameOff.x, gripper[1] - cameOff.z) < 1) {
    const { falls, comesOff } = strip.limits(cameOff.z);
    return [`The sag came off at x = ${metres(cameOff.x)}, ${metres(falls - comesOff)} before the place at which the ` +
      "strip falls: a hysteresis loop.", false];
  }
  const words = {
    flat: "The strip lies flat.", free: "Stable: the strip hangs free.",
    taut: "Stable: the strip is pulled taut.",
    contact: "Stable: the sag rests on the lower layer.", fold: "Stable: the fold lies, the upper layer is laid down.",
  };
  const near = state.kind === "free" && strip.margin(...gripper).distance < 0.25;
  return near ? ["Close to the stability boundary: a little farther and the strip falls. Go lower or back.", true] : [words[state.kind], false];
}

/** The places of the chosen path. */
function chosenPath() {
  const name = field("path").value;
  return name === "paper" ? strip.path(name, Number(field("height").value)) : strip.path(name);
}

function show() {
  const scene = field("scene"), half = strip.half, top = half * 1.12 + 0.6, left = -half - 1.2;
  scene.replaceChildren();
  view.setAttribute("viewBox", `${left} ${-top} ${-2 * left} ${top + 0.8}`);
  const thin = (-2 * left) / view.clientWidth; // one pixel
  draw(scene, "rect", { x: left, y: 0, width: -2 * left, height: 1, fill: "#ddd" });
  draw(scene, "path", { d: asLine(strip.boundary()), fill: "none", stroke: "#c00000", "stroke-width": 3 * thin, id: "boundary" });
  const off = { fill: "none", stroke: "#009e73", "stroke-width": 2 * thin };
  draw(scene, "path", { ...off, d: asLine(strip.comesOff()) });
  const limit = [[left, strip.touchLimit], [-left, strip.touchLimit]];
  for (const line of [strip.touches(), limit])
    draw(scene, "path", { d: asLine(line), fill: "none", stroke: "#0072b2", "stroke-width": thin, "stroke-dasharray": `${2 * thin} ${3 * thin}` });
  label(scene, strip.touchLimit + 6 * thin, left + 10 * thin, "never falls below this height", "#0072b2", 14 * thin);
  const [atX, atZ] = strip.boundary()[Math.floor(strip.boundary().length / 4)];
  const side = atX < half / 2 ? 1 : -1; // where there is room
  label(scene, atZ, atX + 14 * side * thin, "stability boundary", "#c00000", 14 * thin, side > 0 ? "start" : "end");
  if (field("path").value)
    draw(scene, "path", { d: asLine(chosenPath()), fill: "none", stroke: "#882288", "stroke-width": 1.5 * thin, "stroke-dasharray": `${6 * thin} ${3 * thin}`, id: "way" });
  if (fell) for (const part of fell.parts) draw(scene, "path", { d: asCurve(part), fill: "none", stroke: "#c00000", "stroke-width": 2 * thin, opacity: 0.6 });
  drawStrip(scene, state, 4 * thin);
  draw(scene, "path", { d: `M${half} 0l${6 * thin} ${12 * thin}h${-12 * thin}z`, fill: "#0072b2" });
  draw(scene, "circle", { cx: gripper[0], cy: -gripper[1], r: 11 * thin, fill: "#882288", "fill-opacity": 0.85, id: "gripper" });
  drawPlot();
  say(...verdict());
  field("height-shown").textContent = metres(Number(field("height").value));
  const sag = state.parts.length ? strip.sag(state) : Infinity;
  const margin = strip.margin(...gripper).distance, rows = {
    "gripper x": metres(gripper[0]), "gripper z": metres(gripper[1]), "advance λ": metres(strip.advance(gripper[0])),
    "to the boundary": state.touches ? "-" : metres(margin), "off the floor": state.free ? metres(state.free) : "-",
    "height of the sag": sag < Infinity ? metres(sag) : "-", "L*": `${number(unit)} m`, "never falls below": metres(strip.touchLimit),
  };
  field("numbers").replaceChildren(...Object.entries(rows).map(([name, value]) => {
    const row = document.createElement("div"), dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = name;
    dd.textContent = value;
    row.append(dt, dd);
    return row;
  }));
}

function label(scene, z, x, text, fill, size, anchor = "start") {
  draw(scene, "text", { x, y: -z, fill, "font-size": size, "text-anchor": anchor }).textContent = text;
}

/** Advance over height of the sag at the gripper's height or, while the gripper is low, at that of the paper's motion. */
function drawPlot() {
  const plot = field("plot"), lifted = gripper[1] >= tables.below.lowest;
  const z = lifted ? gripper[1] : Number(field("height").value);
  const { falls, comesOff } = strip.limits(z), width = Math.max(falls - comesOff, 0.01);
  const low = comesOff - 2 * width, high = falls + width, free = [];
  for (let i = 0; i <= 24; i++) {
    const advance = falls - (falls - low) * (i / 24) ** 2; // flat at its maximum
    const sag = strip.freeSag(z, advance);
    if (isFinite(sag)) free.push([sag, advance]);
  }
  const most = 1.2 * free[free.length - 1][0], inside = (value, from, to) => Math.min(Math.max(value, from), to);
  const at = ([sag, advance]) =>
    [30 + 160 * inside(sag / most, 0, 1), 185 - 160 * inside((advance - low) / (high - low), 0, 1)];
  const line = (places, look) => draw(plot, "path", { ...look, d: "M" + places.map((one) => at(one).join(" ")).join("L") });
  const write = (x, y, text, anchor) => { draw(plot, "text", { x, y, "text-anchor": anchor }).textContent = text; };
  plot.replaceChildren();
  draw(plot, "path", { d: "M30 20V185H195", stroke: "#777" });
  line(free, { stroke: "#111", "stroke-width": 2 });
  line([[0, high], [0, comesOff]], { stroke: "#009e73", "stroke-width": 4 });
  if (z > strip.touchLimit)
    for (const [sag, advance] of [free[0], [strip.freeSag(z, comesOff), comesOff]])
      line([[0, advance], [sag, advance]], { stroke: "#c00000", "stroke-dasharray": "4 3" });
  write(4, 14, `advance λ at z = ${metres(z)}`, "start");
  write(25, at([0, falls])[1] + 4, "λc", "end");
  write(30, 203, "0", "middle");
  write(195, 203, metres(most), "end");
  write(112, 221, "height of the sag", "middle");
  if (!lifted) return;
  const advance = strip.advance(gripper[0]), [cx, cy] = at([strip.sag(state), advance]);
  const opacity = advance < low || advance > high ? 0.3 : 0.85; // pale at the edge: outside the plot
  draw(plot, "circle", { cx, cy, r: 5, fill: "#882288", "fill-opacity": opacity, id: "marker" });
}

/** The layers on the floor and the parts off it. */
function drawStrip(scene, { kind, parts, liftOff }, width) {
  const look = { fill: "none", stroke: "#111", "stroke-width": width, "stroke-linecap": "round", class: "strip" };
  const floor = (from, to) => draw(scene, "path", { ...look, d: asLine([[from, 0], [to, 0]]) });
  floor(liftOff, strip.half);
  if (kind === "fold") floor(parts[0][parts[0].length - 1].x, parts[1][0].x);
  for (const part of parts) draw(scene, "path", { ...look, d: asCurve(part) });
}

/** The chosen path as a table that the command line reads. */
function asTable() {
  const places = chosenPath();
  const travelled = [0];
  for (let i = 1; i < places.length; i++)
    travelled.push(travelled[i - 1] + Math.hypot(places[i][0] - places[i - 1][0], places[i][1] - places[i - 1][1]));
  const rows = places.map(([x, z], i) => [travelled[i] / travelled[travelled.length - 1], x * unit, z * unit].map((v) => v.toFixed(7)));
  return ["# m; origin mid-strip on the floor, the held end at x = half the length", "t,x,z", ...rows.map((row) => row.join(","))].join("\n") + "\n";
}

/** Follow the chosen path from a flat strip on, through a fall if there is one. */
function follow() {
  if (!field("path").value) return say("Choose a path first.", true);
  layFlat();
  const places = chosenPath(), running = (playing = performance.now());
  let i = 0;
  const next = () => {
    if (playing !== running || i >= places.length) return;
    const goal = places[i], way = [goal[0] - gripper[0], goal[1] - gripper[1]], far = Math.hypot(...way), most = strip.length / 150;
    const place = far <= most ? places[i++] : [gripper[0] + (way[0] * most) / far, gripper[1] + (way[1] * most) / far];
    if (moveTo(...place)) requestAnimationFrame(next);
  };
  next();
}

/** Place of a pointer in L*. */
function placeOf(event) {
  const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(view.getScreenCTM().inverse());
  return [point.x, -point.y];
}

let drags = false;
view.addEventListener("pointerdown", (event) => {
  drags = true;
  playing = 0;
  view.focus();
  try { view.setPointerCapture(event.pointerId); } catch { /* an event without a pointer */ }
  moveTo(...placeOf(event));
});
view.addEventListener("pointermove", (event) => { if (drags) moveTo(...placeOf(event)); });
for (const name of ["pointerup", "pointercancel"]) view.addEventListener(name, () => { drags = false; });
view.addEventListener("keydown", (event) => {
  const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
  if (!way) return;
  event.preventDefault();
  playing = 0;
  const step = event.shiftKey ? 0.02 : 0.2;
  moveTo(gripper[0] + step * way[0], gripper[1] + step * way[1]);
});
field("inputs").addEventListener("submit", (event) => event.preventDefault());
for (const id of ["length", "material"]) field(id).addEventListener("input", readStrip);
field("known").addEventListener("change", () => {
  const fold = field("known").value === "fold", value = Number(field("material").value);
  field("material").value = number(fold ? FOLD_HEIGHT * (value * GRAVITY) ** (-1 / 3) : (FOLD_HEIGHT / value) ** 3 / GRAVITY);
  field("known-name").innerHTML = fold ? "height between mid-layers" : "η<sub>b</sub>";
  field("known-unit").textContent = fold ? "m" : "m⁻⁴ s²";
  readStrip();
});
field("path").addEventListener("change", show);
addEventListener("resize", show);
field("height").addEventListener("input", () => {
  field("path").value = "paper";
  show();
});
field("reset").addEventListener("click", layFlat);
field("paper").addEventListener("click", () => {
  field("path").value = "paper";
  follow();
});
field("follow").addEventListener("click", follow);
field("copy").addEventListener("click", async () => {
  if (!field("path").value) return say("Choose a path first.", true);
  try {
    await navigator.clipboard.writeText(asTable());
    say("Copied: t, x, z, in m.");
  } catch {
    say("The browser does not let this page use the clipboard.", true);
  }
});
readStrip();
