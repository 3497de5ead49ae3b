"use strict";
// The page: inputs, the drawing, the gripper's motion. Everything drawn is in L*; numbers shown are in m.

const GRAVITY = 9.81;
const STEP = 0.02; // L*: a motion of the gripper is followed in steps of this length
const tables = decodeTables(JSON.parse(document.getElementById("tables").textContent));
const FOLD_HEIGHT = tables.loop.height;
const LENGTHS = [tables.rPath.lengths[0], tables.rPath.lengths[tables.rPath.lengths.length - 1]];
const field = (id) => document.getElementById(id);
const view = field("view");
let strip, unit, gripper, lies, state, fell, playing = 0;

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

/** The strip of the inputs, or null with the fields marked that cannot be used. */
function readStrip() {
  const length = Number(field("length").value), value = Number(field("material").value);
  const star = field("known").value === "fold" ? value / FOLD_HEIGHT : (value * GRAVITY) ** (-1 / 3);
  const relative = length / star, usable = relative >= LENGTHS[0] && relative <= LENGTHS[1];
  for (const id of ["length", "material"]) field(id).classList.toggle("refused", !usable);
  if (!usable) {
    const allowed = `${number(LENGTHS[0] * star, 3)} to ${number(LENGTHS[1] * star, 3)} m`;
    say(star > 0 && isFinite(star) ? `A strip of this material can be ${allowed} long here (${LENGTHS.map((l) => number(l, 3)).join(" to ")} L*).`
      : "Give a positive number for the material.", true);
    return null;
  }
  unit = star;
  return new Strip(tables, relative);
}

function say(text, warns) {
  field("verdict").textContent = text;
  field("verdict").classList.toggle("warns", Boolean(warns));
}

/** A new strip, flat. */
function restart() {
  playing = 0;
  const found = readStrip();
  if (!found) return;
  strip = found;
  gripper = [-strip.half, 0];
  lies = fell = false;
  state = strip.state(...gripper);
  show();
}

/** Move the gripper to a place, in small steps; where the strip would fall it does. */
function moveTo(x, z) {
  if (!strip) return;
  x = Math.min(Math.max(x, -strip.half), strip.half);
  z = Math.min(Math.max(z, 0), tables.above.highest);
  const way = Math.hypot(x - gripper[0], z - gripper[1]), steps = Math.max(1, Math.ceil(way / STEP));
  const begin = gripper;
  for (let i = 1; i <= steps; i++) {
    const place = [begin[0] + ((x - begin[0]) * i) / steps, begin[1] + ((z - begin[1]) * i) / steps];
    let next = strip.state(...place, lies);
    if (next.kind === "low") {
      place[1] = tables.below.lowest; // the strip is not carried lower
      next = strip.state(...place, lies);
    }
    if (next.kind === "falls") {
      fell = { x: gripper[0], z: gripper[1], parts: state.parts };
      next = strip.lying(...place) ?? next;
    }
    if (!next.parts) {
      state = { ...state, refused: true };
      break;
    }
    if (!next.touches) fell = false;
    gripper = place;
    lies = next.touches;
    state = next;
  }
  show();
}

/** What the state means, in words. */
function verdict() {
  if (fell) {
    const limit = metres(strip.touchLimit);
    return [`The strip fell at x = ${metres(fell.x)}, z = ${metres(fell.z)}. Lay it flat again, then carry it over lower ` +
      `than ${limit} (low path), or use the R-path if the fabric has friction in bending.`, true];
  }
  if (state.refused) return ["The gripper cannot go farther here: nothing of the strip would lie on the floor.", true];
  const words = {
    flat: "The strip lies flat.", free: "Stable: the strip hangs free.",
    taut: "Stable: the strip is pulled taut.",
    contact: "Stable: the sag rests on the lower layer.", fold: "Stable: the fold lies, the upper layer is laid down.",
  };
  const near = state.kind === "free" && strip.margin(...gripper).distance < 0.25;
  return near ? ["Close to the stability boundary: a little farther and the strip falls. Go lower or back.", true] : [words[state.kind], false];
}

function show() {
  const scene = field("scene"), half = strip.half, top = half * 1.12 + 0.6, left = -half - 1.2;
  scene.replaceChildren();
  view.setAttribute("viewBox", `${left} ${-top} ${-2 * left} ${top + 0.8}`);
  const thin = (2 * half) / 500;
  draw(scene, "rect", { x: left, y: 0, width: -2 * left, height: 1, fill: "#ddd" });
  draw(scene, "path", { d: asLine(strip.boundary()), fill: "none", stroke: "#c00000", "stroke-width": 2 * thin, id: "boundary" });
  const limit = [[left, strip.touchLimit], [-left, strip.touchLimit]];
  for (const line of [strip.touches(), limit])
    draw(scene, "path", { d: asLine(line), fill: "none", stroke: "#0072b2", "stroke-width": thin, "stroke-dasharray": `${2 * thin} ${3 * thin}` });
  label(scene, strip.touchLimit + 6 * thin, left + 10 * thin, "never falls below this height", "#0072b2", 14 * thin);
  const [atX, atZ] = strip.boundary()[Math.floor(strip.boundary().length / 2)];
  label(scene, atZ, atX + 14 * thin, "stability boundary", "#c00000", 14 * thin);
  if (field("path").value)
    draw(scene, "path", { d: asLine(strip.path(field("path").value)), fill: "none", stroke: "#882288", "stroke-width": 1.5 * thin, "stroke-dasharray": `${6 * thin} ${3 * thin}`, id: "way" });
  if (fell) for (const part of fell.parts) draw(scene, "path", { d: asCurve(part), fill: "none", stroke: "#c00000", "stroke-width": 2 * thin, opacity: 0.6 });
  drawStrip(scene, state, 3.5 * thin);
  draw(scene, "path", { d: `M${half} 0l${6 * thin} ${12 * thin}h${-12 * thin}z`, fill: "#0072b2" });
  draw(scene, "circle", { cx: gripper[0], cy: -gripper[1], r: 9 * thin, fill: "#882288", "fill-opacity": 0.85, id: "gripper" });
  say(...verdict());
  const margin = strip.margin(...gripper).distance, rows = {
    "gripper x": metres(gripper[0]), "gripper z": metres(gripper[1]), "advance λ": metres(strip.advance(gripper[0])),
    "to the boundary": state.touches ? "-" : metres(margin), "off the floor": state.free ? metres(state.free) : "-",
    "L*": `${number(unit)} m`, "never falls below": metres(strip.touchLimit),
  };
  field("numbers").replaceChildren(...Object.entries(rows).map(([name, value]) => {
    const row = document.createElement("div"), dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = name;
    dd.textContent = value;
    row.append(dt, dd);
    return row;
  }));
}

function label(scene, z, x, text, fill, size) {
  draw(scene, "text", { x, y: -z, fill, "font-size": size }).textContent = text;
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
  const places = strip.path(field("path").value);
  const travelled = [0];
  for (let i = 1; i < places.length; i++)
    travelled.push(travelled[i - 1] + Math.hypot(places[i][0] - places[i - 1][0], places[i][1] - places[i - 1][1]));
  const rows = places.map(([x, z], i) => [travelled[i] / travelled[travelled.length - 1], x * unit, z * unit].map((v) => v.toFixed(7)));
  return ["# m; origin mid-strip on the floor, the held end at x = half the length", "t,x,z", ...rows.map((row) => row.join(","))].join("\n") + "\n";
}

function follow() {
  const name = field("path").value;
  if (!strip || !name) return;
  restart();
  const places = strip.path(name), running = ++playing || (playing = 1);
  let i = 0;
  const next = () => {
    if (playing !== running || i >= places.length || fell) return;
    const goal = places[i], way = [goal[0] - gripper[0], goal[1] - gripper[1]], far = Math.hypot(...way), most = strip.length / 150;
    if (far <= most) { moveTo(...goal); i++; } else moveTo(gripper[0] + (way[0] * most) / far, gripper[1] + (way[1] * most) / far);
    if (state.refused) return;
    requestAnimationFrame(next);
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
for (const id of ["length", "material"]) field(id).addEventListener("input", restart);
field("known").addEventListener("change", () => {
  const fold = field("known").value === "fold", value = Number(field("material").value);
  field("material").value = number(fold ? FOLD_HEIGHT * (value * GRAVITY) ** (-1 / 3) : (FOLD_HEIGHT / value) ** 3 / GRAVITY);
  field("known-name").innerHTML = fold ? "height between mid-layers" : "η<sub>b</sub>";
  field("known-unit").textContent = fold ? "m" : "m⁻⁴ s²";
  restart();
});
field("path").addEventListener("change", () => { if (strip) show(); });
field("reset").addEventListener("click", restart);
field("follow").addEventListener("click", follow);
field("copy").addEventListener("click", async () => {
  if (!strip || !field("path").value) return say("Choose a path first.", true);
  try {
    await navigator.clipboard.writeText(asTable());
    say("Copied: t, x, z, in m.");
  } catch {
    say("The browser does not let this page use the clipboard.", true);
  }
});
restart();
