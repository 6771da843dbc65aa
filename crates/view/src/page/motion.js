// Unpacking a run: base64 of a zlib stream of tracks, each the changes of one integer from frame to frame, in planes of
// bytes (the Rust crate `view` documents the format).

const CHANNELS = [
  { key: "curvature", label: "Curvature", unit: "1/m" },
  { key: "tension", label: "Tension", unit: "N" },
  { key: "residual", label: "Error at joints", unit: "lengths or rad" },
  { key: "speed", label: "Speed", unit: "m/s" },
];
const UNKNOWN = 255;
const TOP = 254;
const MIDDLE = 16383;
const COMPONENT = 0x7fff;
/** Segments, of all frames, that are looked at to frame a motion. */
const OUTLINE = 4000;
/** Frames in which obstacles and bodies are looked at to frame a motion, and vertices of each. */
const SOLID_FRAMES = 100;
const VERTICES = 60;
/** Segments that are looked at to see whether obstacles hide them. */
const LOOKED_AT = 24;
/** No turn at all. */
const UNTURNED = [0, 0, 0, 1];

/** Curves over time by their keys: of every run, then of its probes and reactions. */
function curvesOf(run) {
  const own = [["energy", "Energy [J]"], ["length_ratio", "Length / first length"], ["iterations", "Iterations a step"]];
  const all = own.map(([key, label]) => [key, { group: "", label, lines: [{ name: "", values: run[key] }] }]);
  for (const { group, label, unit, lines } of run.curves ?? []) {
    const text = unit ? `${label} [${unit}]` : label;
    // Of forces and moments, the size as well.
    if (/^N/.test(unit) && lines.length === 3 && lines[0].name === "x") {
      const size = (_, frame) => (lines[0].values[frame] === null ? null : Math.hypot(...lines.map(({ values }) => values[frame])));
      lines.push({ name: "magnitude", values: run.time.map(size) });
    }
    all.push([`${group}/${label}`, { group, label: text, lines }]);
  }
  return new Map(all.filter(([, { lines }]) => lines.some(({ values }) => values.some((value) => value !== null))));
}

async function inflate(base64) {
  const text = atob(base64);
  const packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) packed[i] = text.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A track: `count` integers in planes of bytes from `at` on, each stored as the change since the one so many before it. */
function track(bytes, at, count, width, stride) {
  const values = new [Uint8Array, Uint16Array, Uint32Array][width - 1](count);
  const mask = 2 ** (8 * width) - 1;
  for (let i = 0; i < count; i++) {
    let code = 0;
    for (let byte = 0; byte < width; byte++) code |= bytes[at + byte * count + i] << (8 * byte);
    const change = (code >>> 1) ^ -(code & 1);
    const before = i < stride ? 0 : values[i - stride];
    values[i] = (before + change) & mask;
  }
  return values;
}

/** The contacts of all frames: where each frame's begin, their segments, and the coordinates of places and forces. */
function contactsOf({ counts, more }, bytes) {
  const begins = [0];
  for (const count of counts) begins.push(begins.at(-1) + count);
  const all = begins.at(-1);
  const segments = track(bytes, 0, all, 3, 1);
  const upper = (k) => new Float32Array(Uint32Array.from(track(bytes, (3 + 2 * k) * all, all, 2, 1), (code) => code << 16).buffer);
  return { begins, segments, vectors: [0, 1, 2, 3, 4, 5].map(upper), most: more ? Math.max(...counts) : null };
}

class Motion {
  /** The motion of a run as it stands in the page. */
  static async unpack(run) {
    const bytes = await inflate(run.data);
    run.data = "";
    const contacts = run.contacts ? contactsOf(run.contacts, await inflate(run.contacts.data)) : null;
    return new this(run, bytes, contacts);
  }

  constructor(run, bytes, contacts) {
    this.name = run.name;
    this.time = run.time;
    this.frames = run.time.length;
    this.obstacles = run.obstacles;
    this.bodies = run.bodies ?? { segment: [], surface: [], surfaces: [] };
    this.obstaclePoses = new Map((run.obstacle_motions ?? []).map(({ obstacle, poses }) => [obstacle, poses]));
    this.rodNames = run.rods ?? [];
    this.obstacleNames = run.obstacle_names ?? [];
    this.chapters = run.chapters ?? [];
    this.grips = run.grips ?? [];
    this.loads = run.loads ?? [];
    this.contacts = contacts;
    this.ranges = run.ranges;
    this.curves = curvesOf(run);
    this.length = run.segments.length;
    this.radius = run.segments.radius;
    this.next = run.segments.next;
    this.rod = run.segments.rod;
    this.rods = this.rod.reduce((most, rod) => Math.max(most, rod + 1), 1);
    this.segments = this.length.length;
    this.origin = run.lattice.origin;
    this.step = run.lattice.step;
    const count = this.frames * this.segments;
    let at = 0;
    const next = (width) => {
      const values = track(bytes, at, count, width, this.segments);
      at += count * width;
      return values;
    };
    this.places = [0, 1, 2].map(() => next(run.lattice.bytes));
    this.turns = [0, 1, 2].map(() => next(2));
    this.values = CHANNELS.map(() => next(1));
  }

  /** Name of a segment's rod, its number along it, and how many segments that has. */
  placeOf(segment) {
    const rod = this.rod[segment] ?? 0;
    const own = this.rod.length > 0 ? this.rod.flatMap((other, i) => (other === rod ? [i] : [])) : [...this.radius.keys()];
    return { name: this.rodNames[rod] ?? `rod ${rod}`, number: own.indexOf(segment), count: own.length };
  }

  /** Whether there are grips, loads or contacts to show. */
  get hasMarks() {
    return this.grips.length > 0 || this.loads.length > 0 || this.contacts !== null;
  }

  /** Where a place in the axes of a segment is in a frame [m]. */
  #placeIn(frame, segment, at) {
    const pose = Array(7).fill(0);
    this.readPosition(frame, segment, pose, 0);
    this.readOrientation(frame, segment, pose, 3);
    return add(pose.slice(0, 3), turned(pose.slice(3), at));
  }

  /** Visits the loads and the contacts of a frame: forces [N], whether it is a contact, and what gives its place [m]. */
  visitForces(frame, visit) {
    for (const { segment, offset, force } of this.loads)
      visit(force[force.length > 1 ? frame : 0], false, () => this.#placeIn(frame, segment, [0, 0, offset]));
    const { begins, segments, vectors } = this.contacts ?? { begins: [] };
    for (let i = begins[frame]; i < begins[frame + 1]; i++) {
      const [x, y, z, ...force] = vectors.map((track) => track[i]);
      visit(force, true, () => {
        const centre = [0, 0, 0];
        this.readPosition(frame, segments[i], centre, 0);
        return add(centre, [x, y, z]);
      });
    }
  }

  /** Visits the grips that hold in a frame: places and the radii of the rods there [m], 0 in rigid bodies. */
  visitGrips(frame, visit) {
    for (const { segment, at, held } of this.grips)
      if (!held || held.some(([from, until]) => from <= frame && frame < until)) visit(this.#placeIn(frame, segment, at), this.bodies.segment.includes(segment) ? 0 : this.radius[segment]);
  }

  /** Writes the centre of a segment [m] into `out` from `at`. */
  readPosition(frame, segment, out, at) {
    const i = frame * this.segments + segment;
    for (let axis = 0; axis < 3; axis++) out[at + axis] = this.origin[axis] + this.step * this.places[axis][i];
  }

  /** Writes the orientation x, y, z, w of a segment into `out` from `at`. */
  readOrientation(frame, segment, out, at) {
    const i = frame * this.segments + segment;
    const [first, second] = [this.turns[0][i], this.turns[1][i]];
    const largest = (first >> 15) | ((second >> 15) << 1);
    let rest = 1;
    for (let k = 0, component = 0; component < 4; component++) {
      if (component === largest) continue;
      const value = ((this.turns[k++][i] & COMPONENT) - MIDDLE) / (MIDDLE * Math.SQRT2);
      out[at + component] = value;
      rest -= value * value;
    }
    out[at + largest] = Math.sqrt(Math.max(rest, 0));
  }

  /** The last frame that is not after a time [s]; the first, if all are. */
  frameAt(time) {
    let [low, high] = [0, this.frames - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** An obstacle where it is in a frame, with its `turn` since the start. */
  obstacleAt(index, frame) {
    const obstacle = this.obstacles[index];
    const pose = this.obstaclePoses.get(index)?.[frame];
    if (!pose) return { ...obstacle, turn: UNTURNED };
    const [middle, turn] = [pose.slice(0, 3), pose.slice(3)];
    if (obstacle.kind === "half_space") return { ...obstacle, point: middle, normal: turned(turn, obstacle.normal), turn };
    if (obstacle.kind === "sphere" || obstacle.kind === "mesh") return { ...obstacle, centre: middle, turn };
    const half = turned(turn, scaled(subtract(obstacle.end, obstacle.start), 0.5));
    return { ...obstacle, start: subtract(middle, half), end: add(middle, half), turn };
  }

  /** Whether a quarter of the rods, in some frame, is within surfaces: a catheter in a vessel. */
  hidesRods() {
    const meshes = this.obstacles.flatMap((obstacle, index) => (obstacle.kind === "mesh" ? [index] : []));
    if (meshes.length === 0) return false;
    const step = Math.ceil(this.segments / LOOKED_AT);
    return [this.frames - 1, this.frames >> 1].some((frame) => {
      let [inside, all] = [0, 0];
      for (let segment = step >> 1; segment < this.segments; segment += step, all++) {
        const place = [0, 0, 0];
        this.readPosition(frame, segment, place, 0);
        if (meshes.some((index) => encloses(this.obstacleAt(index, frame), place))) inside++;
      }
      return inside >= all / 4;
    });
  }

  /** Visits places of an obstacle in a frame, with radii [m]: some of its surface's vertices, or of its axis. Planes have none. */
  #visitObstacle(index, frame, visit) {
    const { kind, surface, centre, start, end, radius, turn } = this.obstacleAt(index, frame);
    if (kind === "mesh") visitSurface(surface, centre, turn, visit);
    else for (const place of [centre, start, end]) if (place) visit(place, radius);
  }

  /** Visits places of the obstacles that stand still. */
  visitStill(visit) {
    this.obstacles.forEach((_, index) => this.obstaclePoses.has(index) || this.#visitObstacle(index, 0, visit));
  }

  /** Visits places of obstacles that move and of rigid bodies, in as many frames as it takes to see where they go. */
  #visitSolids(visit) {
    const { segment, surface, surfaces } = this.bodies;
    const count = this.obstaclePoses.size + segment.length;
    const every = Math.ceil((this.frames * Math.max(count, 1)) / OUTLINE) * Math.ceil(this.frames / SOLID_FRAMES);
    const pose = [0, 0, 0, 0, 0, 0, 1];
    for (let frame = 0; frame < this.frames; frame += every) {
      for (const index of this.obstaclePoses.keys()) this.#visitObstacle(index, frame, visit);
      segment.forEach((body, i) => {
        this.readPosition(frame, body, pose, 0);
        this.readOrientation(frame, body, pose, 3);
        visitSurface(surfaces[surface[i]], pose.slice(0, 3), pose.slice(3), visit);
      });
    }
  }

  /** Visits places of what moves over the whole motion, with radii [m]: of rods, rigid bodies and obstacles. */
  visitMoving(visit) {
    // Without a common divisor, the steps come by all segments.
    const common = (a, b) => (b === 0 ? a : common(b, a % b));
    const isBody = new Set(this.bodies.segment);
    let every = Math.max(1, Math.floor((this.frames * this.segments) / OUTLINE));
    while (common(every, this.segments) > 1) every++;
    const place = [0, 0, 0];
    for (let i = 0; i < this.frames * this.segments; i += every) {
      const segment = i % this.segments;
      if (isBody.has(segment)) continue;
      this.readPosition(Math.floor(i / this.segments), segment, place, 0);
      visit(place, this.length[segment] / 2 + this.radius[segment]);
    }
    this.#visitSolids(visit);
  }

  /** Corners of a box around all that moves [m]. */
  box() {
    const rods = this.segments > this.bodies.segment.length;
    const low = rods ? [...this.origin] : [Infinity, Infinity, Infinity];
    const high = rods ? this.origin.map((x, axis) => x + this.step * this.places[axis].reduce((a, b) => Math.max(a, b), 0)) : low.map((x) => -x);
    const box = { low, high };
    this.visitMoving(widening(box));
    return box;
  }
}

/** Visits some of a surface's vertices, at its place and turn. */
function visitSurface({ positions }, centre, turn, visit) {
  const count = positions.length / 3;
  const step = Math.ceil(count / VERTICES);
  for (let i = 0; i < count; i += step) visit(add(centre, turned(turn, positions.slice(3 * i, 3 * i + 3))), 0);
}

/** What makes a box wide enough for places with radii. */
function widening({ low, high }) {
  return (place, radius) => {
    for (let axis = 0; axis < 3; axis++) {
      low[axis] = Math.min(low[axis], place[axis] - radius);
      high[axis] = Math.max(high[axis], place[axis] + radius);
    }
  };
}

/** Coordinates of points about the places that `visits` visits, from `centre` [m]. */
function surrounding(centre, visits) {
  const points = [];
  visits((place, radius) => {
    if (radius === 0) return points.push(...subtract(place, centre));
    for (let axis = 0; axis < 3; axis++) {
      for (const side of [-radius, radius]) for (let k = 0; k < 3; k++) points.push(place[k] - centre[k] + (k === axis ? side : 0));
    }
  });
  return points;
}
