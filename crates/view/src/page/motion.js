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
/** Frames in which obstacles that move are looked at to frame a motion. */
const OBSTACLE_FRAMES = 100;
/** No turn at all. */
const UNTURNED = [0, 0, 0, 1];

async function inflate(base64) {
  const text = atob(base64);
  const packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) packed[i] = text.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

class Motion {
  /** The motion of a run as it stands in the page. */
  static async unpack(run) {
    const bytes = await inflate(run.data);
    run.data = "";
    return new Motion(run, bytes);
  }

  constructor(run, bytes) {
    this.name = run.name;
    this.time = run.time;
    this.frames = run.time.length;
    this.obstacles = run.obstacles;
    this.bodies = run.bodies ?? { segment: [], surface: [], surfaces: [] };
    this.obstaclePoses = new Map((run.obstacle_motions ?? []).map(({ obstacle, poses }) => [obstacle, poses]));
    this.ranges = run.ranges;
    this.curves = { energy: run.energy, length_ratio: run.length_ratio, iterations: run.iterations };
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
      const values = this.#track(bytes, at, count, width);
      at += count * width;
      return values;
    };
    this.places = [0, 1, 2].map(() => next(run.lattice.bytes));
    this.turns = [0, 1, 2].map(() => next(2));
    this.values = CHANNELS.map(() => next(1));
  }

  #track(bytes, at, count, width) {
    const values = new [Uint8Array, Uint16Array, Uint32Array][width - 1](count);
    const mask = 2 ** (8 * width) - 1;
    for (let i = 0; i < count; i++) {
      let code = 0;
      for (let byte = 0; byte < width; byte++) code |= bytes[at + byte * count + i] << (8 * byte);
      const change = (code >>> 1) ^ -(code & 1);
      const before = i < this.segments ? 0 : values[i - this.segments];
      values[i] = (before + change) & mask;
    }
    return values;
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

  /** Visits places of all obstacles that are no planes, with their radii, in as many frames as it takes to see where they go. */
  #visitObstacles(visit) {
    this.obstacles.forEach((_, index) => {
      const every = this.obstaclePoses.has(index) ? Math.ceil(this.frames / OBSTACLE_FRAMES) : this.frames;
      for (let frame = 0; frame < this.frames; frame += every) {
        const { centre, start, end, radius } = this.obstacleAt(index, frame);
        for (const place of [centre, start, end]) if (place) visit(place, radius);
      }
    });
  }

  /** Coordinates of points that lie around the motion and the obstacles that are no planes, from `centre` [m]. */
  outline(centre) {
    const points = [];
    const surround = (place, reach) => {
      for (let axis = 0; axis < 3; axis++) {
        for (const side of [-reach, reach]) for (let k = 0; k < 3; k++) points.push(place[k] - centre[k] + (k === axis ? side : 0));
      }
    };
    // Without a common divisor, the steps come by all segments.
    const common = (a, b) => (b === 0 ? a : common(b, a % b));
    let every = Math.max(1, Math.floor((this.frames * this.segments) / OUTLINE));
    while (common(every, this.segments) > 1) every++;
    const place = [0, 0, 0];
    for (let i = 0; i < this.frames * this.segments; i += every) {
      const segment = i % this.segments;
      this.readPosition(Math.floor(i / this.segments), segment, place, 0);
      surround(place, this.length[segment] / 2 + this.radius[segment]);
    }
    this.#visitObstacles(surround);
    return points;
  }

  /** Corners of a box around all of the motion and the obstacles that are no planes [m]. */
  box() {
    const reach = this.length.reduce((most, length, i) => Math.max(most, length / 2 + this.radius[i]), 0);
    const low = [...this.origin];
    const high = this.origin.map((x, axis) => x + this.step * this.places[axis].reduce((a, b) => Math.max(a, b), 0));
    const widen = (centre, by) => {
      for (let axis = 0; axis < 3; axis++) {
        low[axis] = Math.min(low[axis], centre[axis] - by);
        high[axis] = Math.max(high[axis], centre[axis] + by);
      }
    };
    for (let axis = 0; axis < 3; axis++) {
      low[axis] -= reach;
      high[axis] += reach;
    }
    this.#visitObstacles(widen);
    return { low, high };
  }
}
