// The page: unpacks the runs, joins all parts, and draws when something has changed.

class Page {
  /** `kinds` are the classes of what says which frame is shown, and of the controls. */
  constructor(motions, kinds = { player: Player, controls: Controls }) {
    this.motions = motions;
    this.visible = motions.map(() => true);
    this.colour = this.kinds()[0][0];
    this.beside = false;
    this.stripe = true;
    this.obstacles = motions.some((motion) => motion.hidesRods()) ? "faded" : "solid";
    this.marks = false;
    this.chosen = null;
    this.moved = this.stale = true;
    this.renderer = new Renderer(element("picture"), motions);
    this.camera = this.renderer.camera;
    this.chart = new Chart(element("chart"), motions);
    this.player = new kinds.player(motions, () => this.#frameChanged());
    this.controls = new kinds.controls(this);
    this.card = new Card(this, Math.max(0, 3 - Math.ceil(Math.log10(this.camera.radius))));
    this.saver = new Saver(this);
    this.#readTheme();
    attachGestures(element("picture"), this.camera, (x, y) => this.#pictureAt(x, y), () => this.#moved(), (...at) => this.choose(this.pick(...at)));
    this.#watch();
    this.renderer.resize();
    this.resetView();
    // Of modes the first one swings, rather than all in turns.
    if (this.player.chapters.length > 1) this.player.choose(1);
    else this.player.seek(0);
    this.draw(0);
  }

  #watch() {
    const changed = () => {
      this.renderer.resize();
      if (!this.touched) this.resetView(this.view);
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

  setObstacles(obstacles) {
    this.obstacles = obstacles;
    this.#changed();
  }

  nextObstacles() {
    const all = OBSTACLES.map(([key]) => key);
    this.setObstacles(all[(all.indexOf(this.obstacles) + 1) % all.length]);
  }

  setMarks(marks) {
    this.marks = marks;
    this.#changed();
  }

  /** Shows the card of what is chosen: a run, and its segment or its obstacle; or of nothing, null. */
  choose(chosen) {
    this.chosen = chosen;
    this.#changed();
  }

  /** The line of sight to a place of the page, and the picture that it is in. */
  sightAt(x, y) {
    const pane = this.#pictureAt(x, y);
    const sight = this.camera.sight((2 * (x - pane.x)) / pane.width, (2 * (pane.y - y)) / pane.height, pane.width / pane.height, pane.height);
    return { sight, pane };
  }

  /** What is meant at a place of the page. */
  pick(x, y, pointer = "mouse") {
    // What was asked for since the last picture is where it will be seen.
    if (this.stale) this.draw(performance.now());
    const { sight, pane } = this.sightAt(x, y);
    const near = NEAR[pointer] ?? NEAR.mouse;
    return picked(sight, this.renderer, pane.runs, (run) => this.player.frameOf(run), this.obstacles, near);
  }

  /** Says something for a while. */
  say(text) {
    element("said").textContent = text;
    element("said").hidden = false;
    clearTimeout(this.saying);
    this.saying = setTimeout(() => (element("said").hidden = true), 6000);
  }

  setBeside(beside) {
    this.beside = beside;
    this.resetView(this.view);
  }

  show(run, visible) {
    this.visible[run] = visible;
    this.#changed();
  }

  /** Frames all that moves, as at the start or in one of `VIEWS`. */
  resetView(view) {
    this.touched = false;
    this.view = view;
    this.camera.reset(this.renderer.aspect(this.pictures().length), view);
    this.#changed();
  }

  moveCamera(move) {
    move();
    this.#moved();
  }

  /** Where a place of the world [m] is on the page, in its first picture [px]. */
  project(place) {
    const { left, top, width, height } = element("picture").getBoundingClientRect();
    const [, , wide, high] = this.renderer.panes(this.pictures().length)[0];
    const { toClip } = this.camera.view(this.renderer.aspect(this.pictures().length));
    const [x, y, z] = subtract(place, this.renderer.centre);
    const [across, up, , away] = [0, 1, 2, 3].map((row) => toClip[row] * x + toClip[4 + row] * y + toClip[8 + row] * z + toClip[12 + row]);
    return [left + ((1 + across / away) / 2) * wide * width, top + ((1 - up / away) / 2) * high * height];
  }

  /** The picture at a place of the page: its middle and sizes in pixels of the page, and its runs. */
  #pictureAt(x, y) {
    const { left, bottom, width, height } = element("picture").getBoundingClientRect();
    const pictures = this.pictures();
    const panes = this.renderer.panes(pictures.length).map(([aside, up, wide, high], i) => ({
      runs: pictures[i],
      x: left + (aside + wide / 2) * width,
      y: bottom - (up + high / 2) * height,
      width: wide * width,
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
    const visible = this.pictures().flat();
    if (this.stale) {
      const { chosen, renderer } = this;
      const ink = paint(theme, "ink");
      for (const run of visible) {
        const own = this.colourings[run];
        const marked = chosen?.run === run ? (frame, segment) => (segment === chosen.segment ? ink : own(frame, segment)) : own;
        renderer.runs[run].update(player.frameOf(run), marked);
        if (this.marks) renderer.marks[run]?.update(player.frameOf(run), { load: paint(theme, "load"), contact: paint(theme, "contact"), grip: ink });
      }
      this.renderer.scenery.update((run) => player.frameOf(run));
      if (this.renamed) this.controls.showChoices();
      this.controls.showFrame();
      this.card.show(chosen);
      if (this.curve) this.chart.draw(this.curve, visible, player.time, theme);
      this.stale = this.renamed = false;
    }
    this.drawPicture();
    this.overlay?.draw();
    this.saver.follow();
    if (player.playing) this.#request();
  }

  drawPicture() {
    this.renderer.draw(this.pictures(), this);
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
    obstacles: (how) => page.setObstacles(how),
    view: (name) => page.resetView(name),
    beside: (beside) => page.setBeside(beside),
    position: read("readPosition", 3),
    orientation: read("readOrientation", 4),
    forces: (shown) => page.setMarks(shown),
    chapter: (chapter) => player.choose(chapter),
    pick: (x, y) => page.pick(x, y),
    marks: (run, frame) => {
      const marks = [];
      motions[run].visitForces(frame, (force, _, place) => marks.push([place(), force]));
      motions[run].visitGrips(frame, (place) => marks.push([place]));
      return marks;
    },
    project: (place) => page.project(place),
    obstacle: (run, frame, index) => motions[run].obstacleAt(index, frame),
  };
}

function fail(error) {
  element("message").setAttribute("role", "alert");
  element("message").textContent = error.message ?? String(error);
  document.documentElement.dataset.state = "failed";
}

/** The runs that stand in the page, as motions of a `kind`. */
async function embedded(kind = Motion) {
  if (typeof DecompressionStream === "undefined")
    throw new Error("This page unpacks its data with DecompressionStream, which this browser does not offer. Browsers since 2023 do.");
  const runs = JSON.parse(element("runs").textContent);
  element("runs").remove();
  return Promise.all(runs.map((run) => kind.unpack(run)));
}

window.addEventListener("error", (event) => fail(event.error ?? event));
window.addEventListener("unhandledrejection", (event) => fail(event.reason));
