// Buttons, choices, keys, and what they say. `page` holds what is shown: runs, colours, layout, stripe, curve.

const PLAY_ICON = "M4 2.5v11l9-5.5z";
const PAUSE_ICON = "M3.5 2.5h3.2v11H3.5zM9.3 2.5h3.2v11H9.3z";

class Controls {
  constructor(page) {
    this.page = page;
    const { player, motions } = page;
    // As many decimals as tell neighbouring frames apart.
    const { time } = player.leader;
    const apart = player.frames > 1 ? (time.at(-1) - time[0]) / (player.frames - 1) : 1;
    this.decimals = Math.min(Math.max(Math.ceil(-Math.log10(apart || 1)), 1), 6);
    this.#legend(motions);
    this.#choices(motions);
    this.#buttons();
    element("scrubber").max = player.frames - 1;
    element("scrubber").addEventListener("input", (event) => player.seek(event.target.valueAsNumber));
    window.addEventListener("keydown", (event) => this.#key(event));
    this.#chartGestures();
  }

  #legend(motions) {
    this.swatches = motions.map((motion, run) => {
      const swatch = make("span", { className: "swatch" });
      const label = make("label");
      if (motions.length > 1) {
        const box = make("input", { type: "checkbox", checked: true });
        box.addEventListener("change", () => this.page.show(run, box.checked));
        label.append(box);
      }
      label.append(swatch, make("span", { textContent: motion.name }));
      element("legend").append(label);
      return swatch;
    });
  }

  #choices(motions) {
    const { page } = this;
    const choice = (id, options, chosen) => {
      element(id).append(...options.map(([value, text]) => make("option", { value, textContent: text })));
      element(id).addEventListener("change", (event) => chosen(event.target.value));
    };
    choice("speed", SPEEDS.map((speed) => [speed, `${speed}×`]), (value) => (page.player.speed = Number(value)));
    element("speed").value = page.player.speed;
    const { chapters } = page.player;
    const named = chapters.map(({ label }, i) => [i, label]);
    choice("chapter", [["all", "All"], ...named], (value) => page.player.choose(value === "all" ? null : Number(value)));
    choice("colour", page.kinds(), (value) => page.setColour(value));
    this.#curves(motions);
    choice("obstacles", OBSTACLES, (value) => page.setObstacles(value));
    // What no run has is not spoken of.
    const has = { obstacles: ({ obstacles }) => obstacles.length > 0, marks: ({ hasMarks }) => hasMarks, chapters: ({ chapters }) => chapters.length > 0 };
    for (const [what, inRun] of Object.entries(has))
      for (const part of document.querySelectorAll(`.of-${what}`)) part.hidden = !motions.some(inRun);
    element("layout-label").hidden = motions.length < 2;
    element("layout").addEventListener("change", (event) => page.setBeside(event.target.value === "beside"));
  }

  /** The choice of curves, by groups. */
  #curves(motions) {
    const { page } = this;
    this.curves = new Map(motions.flatMap((motion) => [...motion.curves]));
    const groups = new Map();
    for (const [value, { group, label }] of this.curves) {
      if (!groups.has(group)) groups.set(group, group ? make("optgroup", { label: group }) : element("curve"));
      groups.get(group).append(make("option", { value, textContent: label }));
    }
    groups.delete("");
    element("curve").append(...groups.values());
    element("curve").addEventListener("change", (event) => page.setCurve(event.target.value));
    page.curve = this.curves.keys().next().value;
    element("curve").closest("label").hidden = element("chart").hidden = this.curves.size === 0;
  }

  #buttons() {
    const { page } = this;
    const pressed = (id, action) => element(id).addEventListener("click", action);
    pressed("play", () => page.player.toggle());
    pressed("loop", () => this.#loop());
    pressed("stripe", () => page.setStripe(!page.stripe));
    for (const view of [...Object.keys(VIEWS), "reset"]) pressed(view, () => page.resetView(view));
    pressed("marks", () => page.setMarks(!page.marks));
    pressed("save-picture", () => page.saver.picture());
    pressed("save-video", () => page.saver.video());
    pressed("help-open", () => element("help").showModal());
  }

  #loop() {
    const { player } = this.page;
    player.loop = !player.loop;
    element("loop").setAttribute("aria-pressed", player.loop);
  }

  #chartGestures() {
    const chart = element("chart");
    const { player } = this.page;
    const seek = (event) => player.seek(player.nearest(this.page.chart.timeAt(event.clientX)));
    chart.addEventListener("pointerdown", (event) => {
      chart.setPointerCapture(event.pointerId);
      seek(event);
    });
    chart.addEventListener("pointermove", (event) => event.buttons & 1 && seek(event));
  }

  #key(event) {
    const { page } = this;
    const { player, camera } = page;
    const { tagName } = event.target;
    if (event.ctrlKey || event.metaKey || event.altKey || element("help").open || tagName === "SELECT") return;
    const pressesTarget = tagName === "BUTTON" || event.target.type === "checkbox";
    const turn = (aside, up) => page.moveCamera(() => camera.orbit(aside, up));
    const arrows = { ArrowLeft: [-0.12, 0], ArrowRight: [0.12, 0], ArrowUp: [0, 0.08], ArrowDown: [0, -0.08] };
    const actions = {
      ArrowLeft: () => player.step(-1),
      ArrowRight: () => player.step(1),
      Home: () => player.toStart(),
      End: () => player.toEnd(),
      "+": () => page.moveCamera(() => camera.zoom(1 / 1.15)),
      "=": () => page.moveCamera(() => camera.zoom(1 / 1.15)),
      "-": () => page.moveCamera(() => camera.zoom(1.15)),
      ",": () => this.#faster(-1),
      ".": () => this.#faster(1),
      r: () => page.resetView(),
      t: () => page.resetView("top"),
      f: () => page.resetView("front"),
      d: () => page.resetView("side"),
      c: () => page.nextColour(),
      s: () => page.setStripe(!page.stripe),
      l: () => this.#loop(),
      g: () => page.setMarks(!page.marks),
      p: () => page.saver.picture(),
      v: () => page.saver.video(),
      Escape: () => page.choose(null),
      PageUp: () => this.#chapter(-1),
      PageDown: () => this.#chapter(1),
      o: () => page.nextObstacles(),
      "?": () => element("help").showModal(),
    };
    let action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (event.shiftKey && arrows[event.key]) action = () => turn(...arrows[event.key]);
    if (event.key === " " && !pressesTarget) action = () => player.toggle();
    if (!action) return;
    event.preventDefault();
    action();
  }

  #faster(by) {
    const { player } = this.page;
    const place = Math.min(Math.max(SPEEDS.indexOf(player.speed) + by, 0), SPEEDS.length - 1);
    element("speed").value = player.speed = SPEEDS[place];
  }

  /** The time of the frame shown, or the label of its chapter. */
  said() {
    const { player } = this.page;
    const end = player.leader.time.at(-1);
    return player.label ?? `${player.time.toFixed(this.decimals)} / ${end.toFixed(this.decimals)} s`;
  }

  /** Goes on to another chapter, if there are any. */
  #chapter(by) {
    const { player } = this.page;
    const last = player.chapters.length - 1;
    if (last >= 0) player.choose(Math.min(Math.max((player.chapter ?? -1) + by, 0), last));
  }

  /** Says which frame is shown, and whether it plays. */
  showFrame() {
    const { player } = this.page;
    const scrubber = element("scrubber");
    scrubber.value = player.frame;
    const frame = `frame ${player.frame} / ${player.frames - 1}`;
    scrubber.setAttribute("aria-valuetext", `${frame}, ${this.said()}`);
    element("clock").replaceChildren(this.said(), ...(player.label === undefined ? [make("small", { textContent: frame })] : []));
    element("chapter").value = player.chapter ?? "all";
    element("play").setAttribute("aria-label", player.playing ? "Pause" : "Play");
    element("play-icon").setAttribute("d", player.playing ? PAUSE_ICON : PLAY_ICON);
  }

  /** Says how it is shown: colours, layout, chart. */
  showChoices() {
    const { page } = this;
    const { theme, renderer, colour } = page;
    this.swatches.forEach((swatch, run) => {
      swatch.style.background = theme.runs[run % RUN_COLOURS];
      swatch.hidden = colour !== "run";
    });
    element("colour").value = colour;
    element("obstacles").value = page.obstacles;
    element("layout").value = page.beside ? "beside" : "overlaid";
    element("stripe").setAttribute("aria-pressed", page.stripe);
    element("marks").setAttribute("aria-pressed", page.marks);
    this.#note();
    if (page.curve) this.#curveLegend();
    this.#bar();
    this.#panes();
  }

  /** Says how large a cell of the grid is, and what marks mean. */
  #note() {
    const { page } = this;
    const { scenery, forceScale } = page.renderer;
    const cell = `${formatNumber(scenery.spacing, 1)} m`;
    const parts = [make("span", { textContent: `Grid ${cell}` })];
    const sign = (className, text) => parts.push(make("span", {}, make("i", { className }), text));
    const shown = page.marks ? page.pictures().flat().map((run) => page.motions[run]) : [];
    if (shown.some(({ grips }) => grips.length > 0)) sign("grip", "Grips");
    if (shown.some(({ loads }) => loads.length > 0)) sign("load", "Loads");
    const pressed = shown.filter(({ contacts }) => contacts);
    const most = pressed.find(({ contacts }) => contacts.most)?.contacts.most;
    if (pressed.length > 0) sign("contact", most ? `Contact forces, the ${most} largest` : "Contact forces");
    if (page.marks && forceScale > 0) parts.push(make("span", { textContent: `${formatNumber(forceScale, 1)} N is as long as ${cell}` }));
    element("note").replaceChildren(...parts);
  }

  /** Says what the lines of the chart are, where they are several or have names. */
  #curveLegend() {
    const { page } = this;
    const { label } = this.curves.get(page.curve);
    element("chart").setAttribute("aria-label", `${label} over time`);
    // Of several runs each has a colour of its own, and dashes tell the lines of all apart.
    const first = page.pictures().flat().find((run) => page.motions[run].curves.has(page.curve));
    const lines = page.chart.lines(page.curve, [first ?? 0], page.theme).filter(({ name }) => name);
    const entry = ({ name, colour, dash }) => {
      const swatch = make("span", { className: "swatch" });
      swatch.style.borderTop = `2px ${dash.length > 0 ? (dash[0] < 4 ? "dotted" : "dashed") : "solid"}`;
      swatch.style.borderColor = page.motions.length > 1 ? "" : colour;
      return make("span", {}, swatch, name);
    };
    element("curve-legend").hidden = lines.length === 0;
    element("curve-legend").replaceChildren(make("b", { textContent: label }), ...lines.map(entry));
  }

  #bar() {
    const { colour, shared } = this.page;
    element("bar").hidden = shared === null;
    if (shared === null) return;
    const { label, unit } = CHANNELS.find(({ key }) => key === colour);
    const scale = { linear: "", log: ", logarithmic", asinh: ", logarithmic on both sides" }[shared.scale];
    element("bar-label").textContent = `${label} [${unit}]${scale}`;
    const pen = element("bar-colours").getContext("2d");
    const words = codeColours(shared);
    const pixels = Uint32Array.from(words, (_, i) => words[Math.min(i, TOP)]);
    pen.putImageData(new ImageData(new Uint8ClampedArray(pixels.buffer), 256, 1), 0, 0);
    const shares = shared.high > shared.low ? [0, 0.25, 0.5, 0.75, 1] : [0];
    const tick = (share) => {
      const mark = make("span", { textContent: formatNumber(valueAt(shared, share)) });
      mark.style.left = `${100 * share}%`;
      return mark;
    };
    element("bar-ticks").replaceChildren(...shares.map(tick));
    // Where ticks are wide, the ends and the middle count most.
    const marks = [...element("bar-ticks").children];
    const taken = [];
    for (const pair of [[0, 4], [2], [1, 3]].map((pair) => pair.flatMap((i) => marks[i] ?? []))) {
      const own = pair.map((mark) => mark.getBoundingClientRect());
      const overlap = own.some(({ left, right }) => taken.some((other) => left < other.right + 8 && other.left < right + 8));
      for (const mark of pair) mark.style.visibility = overlap ? "hidden" : "";
      if (!overlap) taken.push(...own);
    }
  }

  /** Frames and names of the pictures that stand side by side. */
  #panes() {
    const { page } = this;
    const pictures = page.pictures();
    const visible = pictures.flat();
    const panes = page.renderer.panes(pictures.length);
    const frame = (picture, i) => {
      const box = make("div", {}, make("span", { textContent: page.motions[picture[0]].name }));
      ["left", "bottom", "width", "height"].forEach((side, k) => (box.style[side] = `${100 * panes[i][k]}%`));
      return box;
    };
    element("panes").replaceChildren(...(page.beside && visible.length > 0 ? pictures.map(frame) : []));
  }
}
