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
    choice("colour", page.kinds(), (value) => page.setColour(value));
    const known = Object.keys(CURVES).filter((key) => motions.some((motion) => motion.curves[key].some((v) => v !== null)));
    choice("curve", known.map((key) => [key, CURVES[key]]), (value) => page.setCurve(value));
    page.curve = known[0];
    element("curve").closest("label").hidden = element("chart").hidden = known.length === 0;
    element("layout-label").hidden = motions.length < 2;
    element("layout").addEventListener("change", (event) => page.setBeside(event.target.value === "beside"));
  }

  #buttons() {
    const { page } = this;
    const pressed = (id, action) => element(id).addEventListener("click", action);
    pressed("play", () => page.player.toggle());
    pressed("loop", () => this.#loop());
    pressed("stripe", () => page.setStripe(!page.stripe));
    pressed("reset", () => page.resetView());
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
      Home: () => player.seek(0),
      End: () => player.seek(player.frames - 1),
      "+": () => page.moveCamera(() => camera.zoom(1 / 1.15)),
      "=": () => page.moveCamera(() => camera.zoom(1 / 1.15)),
      "-": () => page.moveCamera(() => camera.zoom(1.15)),
      ",": () => this.#faster(-1),
      ".": () => this.#faster(1),
      r: () => page.resetView(),
      c: () => page.nextColour(),
      s: () => page.setStripe(!page.stripe),
      l: () => this.#loop(),
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

  /** Says which frame is shown, and whether it plays. */
  showFrame() {
    const { player } = this.page;
    const scrubber = element("scrubber");
    const end = player.leader.time.at(-1);
    const times = `${player.time.toFixed(this.decimals)} / ${end.toFixed(this.decimals)} s`;
    scrubber.value = player.frame;
    scrubber.setAttribute("aria-valuetext", `Frame ${player.frame} of ${player.frames - 1}, ${player.time.toFixed(this.decimals)} s`);
    element("clock").replaceChildren(times, make("small", { textContent: `frame ${player.frame} / ${player.frames - 1}` }));
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
    element("layout").value = page.beside ? "beside" : "overlaid";
    element("stripe").setAttribute("aria-pressed", page.stripe);
    element("note").textContent = `Grid ${formatNumber(renderer.scenery.spacing, 1)} m`;
    element("chart").setAttribute("aria-label", `${CURVES[page.curve]} over time`);
    this.#bar();
    this.#panes();
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
