// The page: unpacks the runs, joins all parts, and draws when something has changed.

class Page {
  constructor(motions) {
    this.motions = motions;
    this.visible = motions.map(() => true);
    this.colour = this.kinds()[0][0];
    this.beside = false;
    this.stripe = true;
    this.moved = this.stale = true;
    this.renderer = new Renderer(element("picture"), motions);
    this.camera = this.renderer.camera;
    this.chart = new Chart(element("chart"), motions);
    this.player = new Player(motions, () => this.#frameChanged());
    this.controls = new Controls(this);
    this.#readTheme();
    attachGestures(element("picture"), this.camera, (x, y) => this.#pictureAt(x, y), () => this.#moved());
    this.#watch();
    this.renderer.resize();
    this.camera.reset(this.renderer.aspect(1));
    this.player.seek(0);
    this.draw(0);
  }

  #watch() {
    const changed = () => {
      this.renderer.resize();
      if (!this.touched) this.camera.reset(this.renderer.aspect(this.pictures().length));
      this.#changed();
    };
    new ResizeObserver(changed).observe(element("view"));
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#readTheme());
    const canvas = element("picture");
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.renderer.prepare();
      this.#readTheme();
    });
  }

  #readTheme() {
    this.theme = readTheme();
    this.renderer.setTheme(this.theme);
    this.#recolour();
  }

  /** What colours may tell apart, best first: names and labels. */
  kinds() {
    const several = [this.motions.length > 1, this.motions.some((motion) => motion.rods > 1)];
    const kinds = [["run", "Run"], ["rod", "Rod"]].filter((_, i) => several[i]);
    return [...(kinds.length > 0 ? kinds : [["run", "One colour"]]), ...CHANNELS.map(({ key, label }) => [key, label])];
  }

  /** Colours of the runs, of their rods, or of the codes of each run: a function of frame and segment for each run. */
  #recolour() {
    const channel = CHANNELS.findIndex(({ key }) => key === this.colour);
    this.shared = channel < 0 ? null : unitedRange(this.motions.map((motion) => motion.ranges[channel]));
    const palette = this.theme.runs.map((colour) => word(parseColour(colour)));
    this.colourings = this.motions.map((motion, run) => {
      if (this.colour === "run") return () => palette[run % RUN_COLOURS];
      if (this.colour === "rod") return (_, segment) => palette[(motion.rod[segment] ?? 0) % RUN_COLOURS];
      const colours = recoded(motion.ranges[channel], this.shared);
      const codes = motion.values[channel];
      return (frame, segment) => colours[codes[frame * motion.segments + segment]];
    });
    this.#changed();
  }

  setColour(colour) {
    this.colour = colour;
    this.#recolour();
  }

  nextColour() {
    const all = this.kinds().map(([key]) => key);
    this.setColour(all[(all.indexOf(this.colour) + 1) % all.length]);
  }

  setCurve(curve) {
    this.curve = curve;
    this.#changed();
  }

  setStripe(stripe) {
    this.stripe = stripe;
    this.#changed();
  }

  setBeside(beside) {
    this.beside = beside;
    this.resetView();
  }

  show(run, visible) {
    this.visible[run] = visible;
    this.#changed();
  }

  resetView() {
    this.touched = false;
    this.camera.reset(this.renderer.aspect(this.pictures().length));
    this.#changed();
  }

  moveCamera(move) {
    move();
    this.#moved();
  }

  /** Middle and height of the picture at a place of the page, in pixels of the page. */
  #pictureAt(x, y) {
    const { left, bottom, width, height } = element("picture").getBoundingClientRect();
    const panes = this.renderer.panes(this.pictures().length).map(([aside, up, wide, high]) => ({
      x: left + (aside + wide / 2) * width,
      y: bottom - (up + high / 2) * height,
      height: high * height,
    }));
    const away = (pane) => Math.hypot(pane.x - x, pane.y - y);
    return panes.reduce((nearest, pane) => (away(pane) < away(nearest) ? pane : nearest));
  }

  #moved() {
    this.touched = true;
    this.#request();
  }

  #frameChanged() {
    this.stale = true;
    this.#request();
  }

  #changed() {
    this.stale = this.renamed = true;
    this.#request();
  }

  /** What each picture shows: all visible runs, or one. */
  pictures() {
    const runs = this.motions.map((_, run) => run).filter((run) => this.visible[run]);
    return this.beside && runs.length > 0 ? runs.map((run) => [run]) : [runs];
  }

  #request() {
    this.requested ??= requestAnimationFrame((now) => this.draw(now));
  }

  draw(now) {
    this.requested = undefined;
    this.player.advance(now);
    const { player, theme } = this;
    const pictures = this.pictures();
    const visible = pictures.flat();
    if (this.stale) {
      for (const run of visible) this.renderer.runs[run].update(player.frameOf(run), this.colourings[run]);
      this.renderer.scenery.update((run) => player.frameOf(run));
      if (this.renamed) this.controls.showChoices();
      this.controls.showFrame();
      if (this.curve) this.chart.draw(this.curve, visible, player.time, theme);
      this.stale = this.renamed = false;
    }
    this.renderer.draw(pictures, this.stripe);
    if (player.playing) this.#request();
  }
}

/** What scripts may ask and do. Frames of `seek` are the player's; those of `position` and `orientation` the run's. */
function scriptable(page) {
  const { motions, player } = page;
  const read = (method, size) => (run, frame, segment) => {
    const out = Array(size).fill(0);
    motions[run][method](frame, segment, out, 0);
    return out;
  };
  return {
    get frame() {
      return player.frame;
    },
    get frames() {
      return player.frames;
    },
    seek: (frame) => player.seek(frame),
    play: () => player.play(),
    pause: () => player.pause(),
    colour: (key) => page.setColour(key),
    beside: (beside) => page.setBeside(beside),
    position: read("readPosition", 3),
    orientation: read("readOrientation", 4),
    obstacle: (run, frame, index) => motions[run].obstacleAt(index, frame),
  };
}

function fail(error) {
  element("message").setAttribute("role", "alert");
  element("message").textContent = error.message ?? String(error);
  document.documentElement.dataset.state = "failed";
}

async function start() {
  if (typeof DecompressionStream === "undefined")
    throw new Error("This page unpacks its data with DecompressionStream, which this browser does not offer. Browsers since 2023 do.");
  const runs = JSON.parse(element("runs").textContent);
  element("runs").remove();
  const page = new Page(await Promise.all(runs.map((run) => Motion.unpack(run))));
  window.player = scriptable(page);
  document.documentElement.dataset.state = "ready";
  if (!window.matchMedia("(prefers-reduced-motion: reduce)").matches) page.player.play();
}

window.addEventListener("error", (event) => fail(event.error ?? event));
window.addEventListener("unhandledrejection", (event) => fail(event.reason));
start().catch(fail);
