// Draws the runs into the canvas: ground, shadows, obstacles, tubes, walls.

const MOST_PIXELS_PER_POINT = 2;
/** How much is seen of a faded obstacle where one looks straight at it. */
const GLASS = 0.16;
/** How much is seen of an arrow through what hides it. */
const HIDDEN = 0.35;
/** How obstacles are drawn. */
const OBSTACLES = [["solid", "Solid"], ["faded", "Faded"], ["hidden", "Hidden"]];

class Renderer {
  constructor(canvas, motions) {
    this.canvas = canvas;
    this.motions = motions;
    const { low, high } = this.#bounds();
    this.centre = scaled(add(low, high), 0.5);
    this.camera = this.#framing();
    const wishes = { antialias: true, alpha: false, stencil: true, powerPreference: "high-performance" };
    this.gl = canvas.getContext("webgl2", wishes);
    if (!this.gl) throw new Error("This page draws with WebGL 2, which this browser does not offer or has switched off.");
    this.prepare();
  }

  /** Corners of a box around all that moves [m]. */
  #bounds() {
    const boxes = this.motions.map((motion) => motion.box());
    const low = [0, 1, 2].map((k) => Math.min(...boxes.map((box) => box.low[k])));
    const high = [0, 1, 2].map((k) => Math.max(...boxes.map((box) => box.high[k])));
    return { low, high };
  }

  /** A camera that frames what moves, and the box about that and what stands still. */
  #framing() {
    const { motions } = this;
    const moving = this.#bounds();
    this.box = { low: [...moving.low], high: [...moving.high] };
    for (const motion of motions) motion.visitStill(widening(this.box));
    const about = ({ low, high }) => ({ low: subtract(low, this.centre), high: subtract(high, this.centre) });
    const all = (visits) => surrounding(this.centre, (visit) => motions.forEach((motion) => motion[visits](visit)));
    return new Camera(about(moving), about(this.box), all("visitMoving"), all("visitStill"));
  }

  /** Frames what moves now, where that is more than at first; the view keeps its direction until it is reset. */
  reframe() {
    const { start, azimuth, elevation, target, distance, fitted } = this.camera;
    Object.assign(this.camera, this.#framing(), { start, azimuth, elevation, target, distance, fitted });
    this.scenery.widen(this.box, this.camera);
  }

  /** Everything that lives on the graphics processor; again after it was lost. */
  prepare() {
    const { gl, motions } = this;
    this.tubeProgram = compiled(gl, TUBE_VERTEX, TUBE_FRAGMENT);
    this.shadowProgram = compiled(gl, withShadow(TUBE_VERTEX), SHADOW_FRAGMENT);
    this.bodyProgram = compiled(gl, BODY_VERTEX, TUBE_FRAGMENT);
    this.bodyShadowProgram = compiled(gl, withShadow(BODY_VERTEX), SHADOW_FRAGMENT);
    this.planeProgram = compiled(gl, PLANE_VERTEX, PLANE_FRAGMENT);
    this.runs = motions.map((motion) => new RunTubes(gl, motion, this.centre));
    this.scenery = new Scenery(gl, motions, this.box, this.centre, this.camera);
    this.runMarks = undefined;
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  /** The marks of each run, made when they are first asked for. */
  get marks() {
    if (this.runMarks) return this.runMarks;
    const { spacing, reach } = this.scenery;
    this.forceScale ??= forceScale(this.motions, spacing, this.camera.radius);
    const perNewton = this.forceScale > 0 ? spacing / this.forceScale : 0;
    const made = (motion) => (motion.hasMarks ? new RunMarks(this.gl, motion, this.centre, reach, perNewton) : null);
    return (this.runMarks = this.motions.map(made));
  }

  /** Colours as the style sheet says now. */
  setTheme(theme) {
    this.theme = theme;
    this.scenery.paint(theme);
  }

  /** Parts of the canvas, one for each picture, as shares: left, bottom, width, height. */
  panes(count) {
    const { width, height } = this.canvas;
    const columns = width >= height ? count : 1;
    const rows = count / columns;
    return Array.from({ length: count }, (_, i) => {
      return [(i % columns) / columns, 1 - (Math.floor(i / columns) + 1) / rows, 1 / columns, 1 / rows];
    });
  }

  /** Width over height of a picture, of so many in the canvas. */
  aspect(count) {
    const [, , width, height] = this.panes(count)[0];
    return (this.canvas.width * width) / (this.canvas.height * height);
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, MOST_PIXELS_PER_POINT);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight].map((x) => Math.max(1, Math.round(x * ratio)));
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    this.ratio = ratio;
  }

  /**
   * Draws pictures side by side, each a list of indices of runs, with stripes and with marks or without; `obstacles` is one
   * of `OBSTACLES`.
   */
  draw(pictures, { stripe, obstacles, marks }) {
    const { gl, canvas, theme } = this;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...theme.colour.sky, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    const panes = this.panes(pictures.length);
    pictures.forEach((picture, i) => {
      const [left, bottom] = [panes[i][0] * canvas.width, panes[i][1] * canvas.height].map(Math.round);
      const [width, height] = [panes[i][2] * canvas.width, panes[i][3] * canvas.height].map(Math.round);
      gl.viewport(left, bottom, width, height);
      const view = this.camera.view(width / height);
      view.pixel = (0.9 * this.ratio * 2 * SLOPE) / height;
      const runs = picture.map((run) => this.runs[run]);
      const shown = marks ? picture.map((run) => this.marks[run]).filter((own) => own) : [];
      this.#picture(runs.map((run) => run.tubes), runs.map((run) => run.bodies), shown, view, { stripe, obstacles });
    });
  }

  #picture(tubes, bodies, marks, view, { stripe, obstacles }) {
    const { gl, scenery, theme } = this;
    const round = scenery.solid ? [scenery.solid] : [];
    const solid = obstacles === "solid";
    const { ground } = scenery;
    // From below one looks through the ground.
    const strength = dot(ground.normal, view.eye) > ground.offset ? 1 : 0.25;

    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    const plane = this.#use(this.planeProgram, view);
    const fill = (alpha) => [...theme.colour.ground, alpha * strength];
    scenery.drawPlane(plane, ground, scenery.extent, fill(scenery.isGround && obstacles !== "hidden" ? 1 : 0.55), [...theme.colour.line, strength]);

    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    const shadows = (program) => {
      const shadow = this.#use(program, view);
      gl.uniform4f(shadow.plane, ...ground.normal, ground.offset);
      gl.uniform4f(shadow.middle, ...scenery.foot(ground), scenery.extent);
      gl.uniform4f(shadow.shadow, ...theme.colour.shadow, 0.32 * strength);
      return shadow;
    };
    shadows(this.shadowProgram);
    for (const set of solid ? [...tubes, ...round] : tubes) set.draw();
    const bodyShadow = shadows(this.bodyShadowProgram);
    for (const set of solid ? [...bodies, scenery.bodies] : bodies) set.draw(bodyShadow);
    gl.disable(gl.STENCIL_TEST);
    gl.disable(gl.BLEND);

    gl.enable(gl.DEPTH_TEST);
    this.#surfaces(tubes, bodies, view, stripe, 0);
    const striped = stripe && scenery.turns;
    if (solid) this.#surfaces(round, [scenery.bodies], view, striped, 0);

    this.#marks(marks, view);

    gl.enable(gl.BLEND);
    gl.depthMask(false);
    // All are of one colour: which is drawn first does not show.
    if (obstacles === "faded") this.#surfaces(round, [scenery.bodies], view, striped, GLASS);
    const wall = this.#use(this.planeProgram, view);
    const colours = [[...theme.colour.ground, 0.4], [...theme.colour.line, 0.6]];
    for (const side of obstacles === "hidden" ? [] : scenery.walls) scenery.drawPlane(wall, side, 1.5 * scenery.reach, ...colours);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /** Arrows and dots, which show faintly through what hides them. */
  #marks(marks, view) {
    if (marks.length === 0) return;
    const { gl } = this;
    const draw = (glass) => {
      this.#surfaces(marks.map(({ arrows }) => arrows), [], view, false, glass);
      this.#surfaces(marks.map(({ dots }) => dots), [], { ...view, pixel: DOT * view.pixel }, false, glass);
    };
    gl.enable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    draw(HIDDEN);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    draw(0);
  }

  #surfaces(tubes, bodies, view, stripe, glass) {
    const { gl } = this;
    for (const [program, sets] of [[this.tubeProgram, tubes], [this.bodyProgram, bodies]]) {
      if (sets.length === 0) continue;
      const places = this.#use(program, view);
      gl.uniform3fv(places.eye, view.eye);
      gl.uniform1f(places.stripe, stripe ? this.theme.stripe : 0);
      gl.uniform1f(places.glass, glass);
      for (const set of sets) set.draw(places);
    }
  }

  #use({ program, places }, view) {
    this.gl.useProgram(program);
    this.gl.uniformMatrix4fv(places.toClip, false, view.toClip);
    if (places.pixel) this.gl.uniform1f(places.pixel, view.pixel);
    if (places.light) this.gl.uniform3fv(places.light, LIGHT);
    return places;
  }
}
