// A motion of which the newest frame is known, as it comes from a simulation that runs (the Rust crate `live` documents it).

/** Time that the chart shows [s], and most points of it. */
const RECENT = 30;
const POINTS = 1800;
/** Room beyond what is seen, as a share of its size, before the picture is framed anew; and places kept of it at a time. */
const MARGIN_OF_BOX = 0.1;
const SEEN_PLACES = 100;
const MOST_SEEN = 3000;

/** The next larger of 1, 2 and 5 times a power of ten. */
function niceAbove(value) {
  const below = niceBelow(value);
  return [1, 2, 2.5, 5, 10].map((k) => k * below).find((nice) => nice >= value * (1 - 1e-9) && niceBelow(nice) >= nice * (1 - 1e-9)) ?? 10 * below;
}

class LiveMotion extends Motion {
  constructor(run, bytes, contacts) {
    super(run, bytes, contacts);
    const count = this.segments;
    this.poses = new Float64Array(7 * count);
    for (let i = 0; i < count; i++) {
      super.readPosition(0, i, this.poses, 7 * i);
      super.readOrientation(0, i, this.poses, 7 * i + 3);
    }
    this.values = CHANNELS.map(() => new Uint8Array(count).fill(UNKNOWN));
    this.ranges = CHANNELS.map(() => ({ low: 0, high: 0, scale: "linear" }));
    this.time = [run.time[0]];
    this.obstaclePoses = new Map([...this.obstaclePoses].map(([index, poses]) => [index, [poses[0]]]));
    this.lines = { energy: [run.energy[0]], iterations: [null] };
    const curve = (label, values) => ({ group: "", label, lines: [{ name: "", values }] });
    this.curves = new Map([
      ["energy", curve("Energy [J]", this.lines.energy)],
      ["iterations", curve("Iterations a step", this.lines.iterations)],
    ]);
    this.steps = 0;
    this.speed = NaN;
    this.first = this.last = run.time[0];
    this.stepTime = 0;
    this.hasFrame = false;
    this.hands = [];
    this.seen = [];
    this.#see();
    this.seenBox = this.#around(0);
  }

  readPosition(_, segment, out, at) {
    for (let k = 0; k < 3; k++) out[at + k] = this.poses[7 * segment + k];
  }

  readOrientation(_, segment, out, at) {
    for (let k = 0; k < 4; k++) out[at + k] = this.poses[7 * segment + 3 + k];
  }

  frameAt(time) {
    return Math.max(0, this.time.findLastIndex((own) => own <= time));
  }

  /** Takes a frame. Returns whether colours mean something else now, and whether it goes beyond what was framed. */
  take(buffer) {
    const view = new DataView(buffer);
    const [segments, obstacles, hands, steps] = [0, 4, 8, 12].map((at) => view.getUint32(at, true));
    const [time, speed, energy, iterations, first, last, stepTime] = [0, 1, 2, 3, 4, 5, 6].map((k) => view.getFloat64(16 + 8 * k, true));
    if (segments !== this.segments || obstacles !== this.obstacles.length) throw new Error("The frame is of another simulation.");
    Object.assign(this, { steps, speed, first, last, stepTime });
    const floats = new Float32Array(11 * segments + 7 * obstacles + 6 * hands);
    for (let i = 0; i < floats.length; i++) floats[i] = view.getFloat32(72 + 4 * i, true);
    this.poses.set(floats.subarray(0, 7 * segments));
    const isRecoloured = this.#values(floats.subarray(7 * segments, 11 * segments));
    let at = 11 * segments;
    for (let index = 0; index < obstacles; index++, at += 7)
      if (this.obstaclePoses.has(index)) this.obstaclePoses.set(index, [[...floats.subarray(at, at + 7)]]);
    this.hands = [];
    for (let k = 0; k < hands; k++, at += 6) this.hands.push([[...floats.subarray(at, at + 3)], [...floats.subarray(at + 3, at + 6)]]);
    this.#remember(time, energy, iterations);
    return { isRecoloured, isBeyond: this.#goesBeyond() };
  }

  /** Takes what colours show: four numbers a segment. */
  #values(floats) {
    let isRecoloured = false;
    CHANNELS.forEach(({ key }, channel) => {
      let most = 0;
      for (let i = channel; i < floats.length; i += 4) if (Math.abs(floats[i]) > most) most = Math.abs(floats[i]);
      const range = this.ranges[channel];
      if (most > range.high || (range.high === 0 && most > 0)) {
        const high = niceAbove(most);
        this.ranges[channel] = { low: key === "tension" ? -high : 0, high, scale: "linear" };
        isRecoloured = true;
      }
      const { low, high } = this.ranges[channel];
      const scale = high > low ? TOP / (high - low) : 0;
      const codes = this.values[channel];
      for (let i = 0; i < codes.length; i++) {
        const value = floats[4 * i + channel];
        codes[i] = Number.isNaN(value) ? UNKNOWN : Math.round((value - low) * scale);
      }
    });
    return isRecoloured;
  }

  #remember(time, energy, iterations) {
    const { lines } = this;
    const all = [this.time, lines.energy, lines.iterations];
    // What stands in the page is how it was when the simulation began.
    if (!this.hasFrame) all.forEach((list) => (list.length = 0));
    this.hasFrame = true;
    // Time went back.
    while (this.time.length > 0 && this.time.at(-1) >= time) all.forEach((list) => list.pop());
    [time, energy, iterations].forEach((value, k) => all[k].push(Number.isFinite(value) ? value : null));
    let old = Math.max(0, this.time.length - POINTS);
    while (this.time[old] < time - RECENT) old++;
    if (old > 0) all.forEach((list) => list.splice(0, old));
  }

  /** Keeps some of the places where segments are, to be framed. */
  #see() {
    const step = Math.max(1, Math.ceil(this.segments / SEEN_PLACES));
    for (let i = 0; i < this.segments; i += step) this.seen.push([[...this.poses.subarray(7 * i, 7 * i + 3)], this.length[i] / 2 + this.radius[i]]);
    const last = this.segments - 1;
    this.seen.push([[...this.poses.subarray(7 * last, 7 * last + 3)], this.length[last] / 2 + this.radius[last]]);
    if (this.seen.length > MOST_SEEN) this.seen = this.seen.filter((_, i) => i % 2 === 0);
  }

  /** The box around what was seen, and a share of its size more. */
  #around(share) {
    const box = { low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity] };
    const widen = widening(box);
    for (const [place, radius] of this.seen) widen(place, radius);
    const room = share * norm(subtract(box.high, box.low));
    return { low: box.low.map((x) => x - room), high: box.high.map((x) => x + room) };
  }

  #goesBeyond() {
    const { low, high } = this.seenBox;
    const step = Math.max(1, Math.floor(this.segments / 200));
    for (let i = 0; i < this.segments; i += step) {
      for (let k = 0; k < 3; k++) {
        const x = this.poses[7 * i + k];
        if (x < low[k] || x > high[k]) return true;
      }
    }
    return false;
  }

  /** Takes what is there now for something to be framed. */
  widen() {
    this.#see();
    this.seenBox = this.#around(MARGIN_OF_BOX);
  }

  /** Forgets what was seen. */
  forget() {
    this.seen = [];
    this.ranges = CHANNELS.map(() => ({ low: 0, high: 0, scale: "linear" }));
    this.#see();
    this.seenBox = this.#around(0);
  }

  visitMoving(visit) {
    for (const [place, radius] of this.seen) visit(place, radius);
  }

  box() {
    return this.#around(0);
  }
}
