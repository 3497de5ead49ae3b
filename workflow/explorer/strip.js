"use strict";
// Static states of a strip without friction, interpolated in stored tables of the heavy elastica. Lengths in L*, the
// origin mid-strip on the floor, the held end at +length/2 (docs/physics.md, section 4).

const POINTS = 6; // of a polynomial

/** Weights of the neighbours for interpolation of equally spaced values at the fractional index `at`. */
function neighbours(at, count) {
  const first = Math.min(Math.max(Math.floor(at) - POINTS / 2 + 1, 0), count - POINTS);
  const weights = [];
  for (let i = 0; i < POINTS; i++) {
    let weight = 1;
    for (let j = 0; j < POINTS; j++) if (j !== i) weight *= (at - first - j) / (i - j);
    weights.push(weight);
  }
  return { first, weights };
}

/** Rows of `width` numbers, equally spaced, interpolated at a fractional index. */
function between(values, width, at, begin = 0) {
  const { first, weights } = neighbours(at, (values.length - begin) / width);
  const found = new Float64Array(width);
  for (let i = 0; i < POINTS; i++) {
    const start = begin + (first + i) * width;
    for (let k = 0; k < width; k++) found[k] += weights[i] * values[start + k];
  }
  return found;
}

/** Where the increasing function of a fractional index, from 0 to last, is `wanted`; by bisection. */
function indexOf(value, wanted, last) {
  let low = 0, high = last;
  for (let i = 0; i < 50; i++) {
    const middle = (low + high) / 2;
    if (value(middle) < wanted) low = middle; else high = middle;
  }
  return (low + high) / 2;
}

/** States at heights in geometric progression: a row of states at each, the advance growing along it. */
class States {
  constructor({ lowest, highest, heights, states, lengths, angles }) {
    const count = heights * states, some = lengths.length / count, many = angles.length / count, width = some + many;
    const values = new Float64Array(count * width);
    for (let i = 0; i < count; i++) {
      values.set(lengths.subarray(i * some, (i + 1) * some), i * width);
      values.set(angles.subarray(i * many, (i + 1) * many), i * width + some);
    }
    Object.assign(this, { lowest, highest, heights, states, width, values });
  }

  /** All states at a height: `states` times `width` numbers, the advance first. */
  row(z) {
    const at = (Math.log(z / this.lowest) / Math.log(this.highest / this.lowest)) * (this.heights - 1);
    return between(this.values, this.states * this.width, Math.min(Math.max(at, 0), this.heights - 1));
  }

  /** First and last advance at a height. */
  ends(z) {
    const row = this.row(z);
    return [row[0], row[(this.states - 1) * this.width]];
  }

  /** The state with an advance. */
  at(z, advance) {
    const row = this.row(z), last = this.states - 1, most = row[last * this.width];
    const advances = Float64Array.from({ length: this.states }, (_, i) => row[i * this.width]);
    // At a maximum of the advance its root below the maximum is smooth, the advance too flat to be inverted.
    const change = this.maximum ? (value) => -Math.sqrt(Math.max(most - value, 0)) : (value) => value;
    const along = advances.map(change);
    return between(row, this.width, indexOf((at) => between(along, 1, at)[0], change(advance), last));
  }
}

/** The strip of one length and its states. */
class Strip {
  constructor(tables, length) {
    this.tables = tables;
    this.length = length;
    this.half = length / 2;
  }

  advance(x) { return x + this.half; }

  get touchLimit() { return this.tables.touchLimit; }

  free(z) { return z > this.touchLimit ? this.tables.above : this.tables.below; }

  /** Places along a part of the given angles and length, from `start` on: x, z and the direction at each. */
  part(angles, length, [x, z], sign) {
    const n = this.tables.nodes.length, found = [], cos = Array.from(angles, Math.cos), sin = Array.from(angles, Math.sin);
    for (let i = 0; i < n; i++) {
      let dx = 0, dz = 0;
      for (let j = 0; j < n; j++) {
        const weight = this.tables.integral[i * n + j];
        dx += weight * cos[j];
        dz += weight * sin[j];
      }
      found.push({
        x: x + sign * length * dx, z: z + length * dz, dx: sign * cos[i], dz: sin[i],
        s: length * this.tables.nodes[i],
      });
    }
    return found;
  }

  /** A part lifted to a height without horizontal force: angles and length. Below the lowest height as a beam. */
  lifted(z) {
    const { lengths, angles } = this.tables.lifted, n = this.tables.nodes.length;
    if (z < lengths[0]) {
      const share = z / lengths[0];
      return { length: lengths[1] * share ** 0.25, angles: Array.from(angles.subarray(0, n), (a) => a * share ** 0.75) };
    }
    const index = indexOf((at) => between(lengths, 2, at)[0], z, lengths.length / 2 - 1);
    return { length: between(lengths, 2, index)[1], angles: between(angles, n, index) };
  }

  /**
   * The state with the gripper at (x, z).
   *
   * `lies`: whether the sag lies on the lower layer so far. Gives `kind`: "flat", "free", "taut" (drawn as a cable),
   * "contact" (in a point), "fold" (in an interval), or why there is none: "falls" (past the largest advance), "hangs"
   * (nothing lies), "stretched" (too taut), "low" (below the tables); `parts` from the held end, and `touches`: whether the sag lies.
   */
  state(x, z, lies = false) {
    const advance = this.advance(x);
    if (z < 1e-4 && !lies) return { kind: "flat", parts: [], touches: false, liftOff: -this.half };
    if (lies) {
      const found = this.lying(x, z);
      if (found) return found;
    }
    if (z < this.tables.below.lowest) return this.nearFloor(x, z);
    const states = this.free(z), [first, last] = states.ends(z);
    if (advance > last) {
      if (z > this.touchLimit) return { kind: "falls", critical: last, touches: false };
      return this.lying(x, z) ?? { kind: "hangs", touches: false };
    }
    if (advance < first) return this.taut(x, z, advance);
    const [, length, ...angles] = states.at(z, advance);
    if (length > this.length - 1e-3) return { kind: "hangs", touches: false };
    return this.ofFree(x, length, angles);
  }

  ofFree(x, length, angles) {
    const shape = this.part(angles, length, [0, 0], -1);
    const origin = x - shape[shape.length - 1].x;
    for (const place of shape) place.x += origin;
    return { kind: "free", parts: [shape], touches: false, liftOff: origin, free: length };
  }

  /** Pulled so that bending does not count: a parabola whose arc is longer than its span by the advance. */
  taut(x, z, advance) {
    const span = (2 * z * z) / (3 * Math.max(advance, 1e-9)), last = 16, shape = [];
    if (span > this.length) return { kind: "stretched", touches: false };
    for (let i = 0; i <= last; i++) {
      const share = i / last, slope = (2 * z * share) / span, scale = Math.hypot(1, slope);
      shape.push({ x: x + span * (1 - share), z: z * share * share, dx: -1 / scale, dz: slope / scale, s: span * share });
    }
    return { kind: "taut", parts: [shape], touches: false, liftOff: x + span, free: span };
  }

  /** Lower than the tables: nearly flat, as lifted without horizontal force. */
  nearFloor(x, z) {
    const { length, angles } = this.lifted(z), shape = this.part(angles, length, [0, 0], -1);
    const atRest = length + shape[shape.length - 1].x - this.half;
    if (Math.abs(x - atRest) > 0.1) return { kind: "low", touches: false };
    return this.ofFree(x, length, angles);
  }

  /** With the sag on the lower layer; null where the strip leaves it. */
  lying(x, z) {
    const { contact, loop } = this.tables, advance = this.advance(x);
    const height = Math.max(z, 1e-6), n = this.tables.nodes.length;
    // Lower than the tables the contact is an interval, or not reached.
    const [first, last] = height < contact.lowest ? [Infinity, this.foldAdvance(height)] : contact.ends(height);
    if (advance >= last) return this.folded(x, height, loop);
    if (advance < first) return null;
    const [, lower, upper, ...angles] = contact.at(height, advance);
    const below = this.part(angles.slice(0, n), lower, [0, 0], -1);
    const landed = below[below.length - 1];
    const above = this.part(angles.slice(n), upper, [landed.x, 0], -1);
    const origin = x - above[above.length - 1].x;
    for (const place of [...below, ...above]) place.x += origin;
    if (lower + upper > this.length) return { kind: "hangs", touches: false };
    return { kind: "contact", parts: [below, above], touches: true, liftOff: origin, free: lower + upper };
  }

  /** Advance from which the contact is an interval. */
  foldAdvance(z) {
    const { length, angles } = this.lifted(z), { loop } = this.tables, tail = this.part(angles, length, [0, 0], 1);
    return loop.arc + length + loop.offset + tail[tail.length - 1].x;
  }

  /** The folded loop, and the rest of the upper layer lifted without horizontal force. */
  folded(x, z, loop) {
    const { length, angles } = this.lifted(z), tail = this.part(angles, length, [0, 0], 1);
    const landing = x - tail[tail.length - 1].x;
    for (const place of tail) place.x += landing;
    const liftOff = (loop.arc - loop.offset + landing + length - this.half) / 2;
    const below = this.part(loop.angles, loop.arc, [liftOff, 0], -1);
    if (liftOff > this.half) return { kind: "hangs", touches: false };
    return { kind: "fold", parts: [below, tail], touches: true, liftOff, free: loop.arc + length };
  }

  /** Distance of a place from the stability boundary and the nearest place on it; above the touch limit. */
  margin(x, z) {
    let found = { distance: Infinity };
    const at = (p, q, share) => [p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])];
    const line = this.boundary();
    for (let i = 1; i < line.length; i++) {
      const p = line[i - 1], q = line[i], d = [q[0] - p[0], q[1] - p[1]];
      const share = ((x - p[0]) * d[0] + (z - p[1]) * d[1]) / (d[0] ** 2 + d[1] ** 2);
      const near = at(p, q, Math.min(Math.max(share, 0), 1));
      const distance = Math.hypot(x - near[0], z - near[1]);
      if (distance < found.distance) found = { distance, near };
    }
    return found;
  }

  /** Gripper positions (x, z) at which the strip loses its stability, from the touch limit up. */
  boundary() {
    if (this.line) return this.line;
    const { above } = this.tables;
    this.line = [];
    for (let i = 0; i < 4 * above.heights; i++) {
      const z = above.lowest * (above.highest / above.lowest) ** (i / (4 * above.heights - 1));
      const row = above.row(z), end = (above.states - 1) * above.width;
      if (row[end + 1] > this.length) break;
      this.line.push([row[end] - this.half, z]);
    }
    return this.line;
  }

  /** Advances at a height: where the strip falls or, below the touch limit, touches, and where the sag comes off again. */
  limits(z) { return { falls: this.free(z).ends(z)[1], comesOff: this.tables.contact.ends(z)[0] }; }

  /** Gripper positions at which the sag of a strip that fell comes off the lower layer. */
  comesOff() { return (this.offLine ??= this.boundary().map(([, z]) => [this.limits(z).comesOff - this.half, z])); }

  /** Greatest height at which the strip falls before the gripper is above the held end. */
  get highestFall() {
    return this.boundary().reduce((highest, [x, z]) => (x < this.half ? z : highest), this.touchLimit);
  }

  /** Height of the lowest point of the hanging part; infinite where the strip rises all the way to the gripper. */
  sag({ kind, parts }) {
    if (kind === "contact" || kind === "fold") return 0;
    const shape = parts[0];
    for (let i = shape.length - 1; i > 0; i--) {
      const [p, q] = [shape[i - 1], shape[i]];
      if (q.dz < 0) return q.z;
      if (p.dz < 0) return p.z + (p.dz ** 2 / (p.dz - q.dz)) * (q.s - p.s) / 2;
    }
    return Infinity;
  }

  /** Height of the sag of a strip that hangs free. */
  freeSag(z, advance) {
    const [, length, ...angles] = this.free(z).at(z, advance);
    return this.sag({ kind: "free", parts: [this.part(angles, length, [0, 0], -1)] });
  }

  /** Gripper positions at which the sag touches, below the touch limit. */
  touches() {
    const { below } = this.tables, line = [];
    for (let i = 0; i < 60; i++) {
      const z = below.lowest * (below.highest / below.lowest) ** (i / 59);
      line.push([below.ends(z)[1] - this.half, z]);
    }
    return line;
  }

  /** The gripper's way by the name of a path: places (x, z); low path and the paper's motion at a height. */
  path(name, height = 1.2) {
    const half = this.half, line = [];
    if (name === "triangular") return [[-half, 0], [0, half], [half, 0]];
    if (name === "circular") {
      for (let i = 0; i <= 180; i++) {
        const angle = (Math.PI * i) / 180;
        line.push([-half * Math.cos(angle), half * Math.sin(angle)]);
      }
      return line;
    }
    if (name === "low") {
      const up = this.lift((z) => z <= height, height);
      return [...up, ...up.map(([x, z]) => [-x, z]).reverse()];
    }
    if (name === "paper") {
      // Forth until the strip has fallen and back until the sag is off, slowly, as the loop is narrow.
      const { falls, comesOff } = this.limits(height), width = Math.max(falls - comesOff, 0.05), slow = [];
      for (let i = -30; i <= 60; i++) slow.push([Math.min(comesOff + (i * width) / 15 - half, half), height]);
      return [...this.lift((z) => z <= height, height), ...slow, ...slow.slice(0, -1).reverse()];
    }
    const { lengths, values, width } = this.tables.rPath, { loop } = this.tables;
    const free = half + (loop.arc - loop.offset) / 2;
    const at = (Math.log(this.length / lengths[0]) / Math.log(lengths[lengths.length - 1] / lengths[0]));
    const middle = between(values, width, at * (lengths.length - 1));
    const lift = this.lift((z, length) => length < free);
    const lay = this.lift((z, length) => length < free - loop.arc).map(([x, z]) => [-x, z]).reverse();
    for (let i = 0; i < width; i += 2) line.push([middle[i], middle[i + 1]]);
    return [...lift, ...line, ...lay];
  }

  /** Places of a lift without horizontal force while `goesOn(z, length)`, and to `last` exactly if given. */
  lift(goesOn, last) {
    const line = [[-this.half, 0]];
    const add = (z) => {
      const { length, angles } = this.lifted(z), shape = this.part(angles, length, [0, 0], -1);
      if (!goesOn(z, length)) return false;
      line.push([length + shape[shape.length - 1].x - this.half, z]);
      return true;
    };
    for (let i = 1; add(0.02 * 1.06 ** i); i++);
    if (last) add(last);
    return line;
  }
}

/** Tables from the page's data, in which arrays of 32 and 64 bit numbers are in base 64. */
function decodeTables(data) {
  const decode = (value) => {
    const packed = value && (value.f4 ?? value.f8);
    if (packed) {
      const bytes = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
      return value.f8 ? new Float64Array(bytes.buffer) : Float64Array.from(new Float32Array(bytes.buffer));
    }
    if (value === null || typeof value !== "object" || Array.isArray(value)) return value;
    return Object.fromEntries(Object.entries(value).map(([key, one]) => [key, decode(one)]));
  };
  const tables = decode(data);
  for (const name of ["below", "above", "contact"]) tables[name] = new States(tables[name]);
  tables.above.maximum = true;
  return tables;
}
