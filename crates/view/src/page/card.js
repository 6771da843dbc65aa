// The card of what was clicked: its name, and its values in the frame that is shown.

/** Names of the kinds of obstacles. */
const KINDS = { half_space: "Plane", sphere: "Sphere", capsule: "Capsule", mesh: "Surface" };

/** Twist of a rod about its axis at a segment [rad/m], the mean of its joints to its neighbours; null without any. */
function twistAt(motion, frame, segment, previous) {
  const turn = (i) => {
    const q = [0, 0, 0, 1];
    motion.readOrientation(frame, i, q, 0);
    return q;
  };
  const pairs = [[previous, segment], [segment, motion.next[segment]]].filter(([a, b]) => a >= 0 && b !== null);
  if (pairs.length === 0) return null;
  const twists = pairs.map(([a, b]) => {
    const [x, y, z, w] = turn(a);
    const between = composed([-x, -y, -z, w], turn(b));
    const angle = 2 * Math.atan2(between[2], between[3]);
    const least = angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
    return (2 * least) / (motion.length[a] + motion.length[b]);
  });
  return twists.reduce((sum, twist) => sum + twist, 0) / twists.length;
}

class Card {
  /** `decimals` are those of places [m]. */
  constructor(page, decimals) {
    this.page = page;
    this.decimals = decimals;
    element("card-close").addEventListener("click", () => page.choose(null));
  }

  /** Shows what is chosen, as it is in the frame shown. */
  show(chosen) {
    element("card").hidden = chosen === null;
    if (chosen === null) return;
    const { motions } = this.page;
    const motion = motions[chosen.run];
    const frame = this.page.player.frameOf(chosen.run);
    const { name, rows } = chosen.obstacle === undefined ? this.#segment(motion, frame, chosen) : this.#obstacle(motion, frame, chosen);
    if (motions.length > 1) rows.push(["Run", motion.name]);
    element("card-name").textContent = name;
    const items = rows.flatMap(([what, value]) => [make("dt", { textContent: what }), make("dd", { textContent: value })]);
    element("card-values").replaceChildren(...items);
  }

  #place(place) {
    return `${place.map((x) => x.toFixed(this.decimals).replace("-", "−")).join(", ")} m`;
  }

  #segment(motion, frame, { run, segment }) {
    const place = [0, 0, 0];
    motion.readPosition(frame, segment, place, 0);
    const rows = [["Position", this.#place(place)]];
    const { name, number, count } = motion.placeOf(segment);
    const isBody = motion.bodies.segment.includes(segment);
    if (!isBody) rows.unshift(["Segment", `${number} of 0 to ${count - 1}`]);
    CHANNELS.forEach(({ key, label, unit }, channel) => {
      if (key === "residual") return;
      const code = motion.values[channel][frame * motion.segments + segment];
      if (code !== UNKNOWN) rows.push([label, `${formatNumber(valueAt(motion.ranges[channel], code / TOP), 3)} ${unit}`]);
    });
    const twist = isBody ? null : twistAt(motion, frame, segment, this.page.renderer.runs[run].previous[segment]);
    if (twist !== null) rows.push(["Twist", `${formatNumber(twist, 3)} rad/m`]);
    return { name, rows };
  }

  #obstacle(motion, frame, { obstacle }) {
    const at = motion.obstacleAt(obstacle, frame);
    const { kind, centre, start, end, point, radius } = at;
    const rows = [["Obstacle", KINDS[kind]], ["Position", this.#place(point ?? centre ?? scaled(add(start, end), 0.5))]];
    if (kind === "sphere" || kind === "capsule") rows.push(["Radius", `${formatNumber(radius, 4)} m`]);
    return { name: motion.obstacleNames[obstacle] ?? `obstacle ${obstacle}`, rows };
  }
}
