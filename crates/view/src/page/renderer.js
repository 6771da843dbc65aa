// Draws the runs into the canvas: ground, shadows, obstacles, tubes, walls.

const MOST_PIXELS_PER_POINT = 2;

class Renderer {
  constructor(canvas, motions) {
    this.canvas = canvas;
    this.motions = motions;
    const boxes = motions.map((motion) => motion.box());
    const low = [0, 1, 2].map((k) => Math.min(...boxes.map((box) => box.low[k])));
    const high = [0, 1, 2].map((k) => Math.max(...boxes.map((box) => box.high[k])));
    this.box = { low, high };
    this.centre = scaled(add(low, high), 0.5);
    const points = motions.flatMap((motion) => motion.outline(this.centre));
    this.camera = new Camera({ low: subtract(low, this.centre), high: subtract(high, this.centre) }, points);
    const wishes = { antialias: true, alpha: false, stencil: true, powerPreference: "high-performance" };
    this.gl = canvas.getContext("webgl2", wishes);
    if (!this.gl) throw new Error("This page draws with WebGL 2, which this browser does not offer or has switched off.");
    this.prepare();
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
    this.scenery = new Scenery(gl, motions, this.box, this.centre, this.camera.radius);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
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

  /** Draws pictures side by side, each a list of indices of runs. */
  draw(pictures, stripe) {
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
      const bodies = [...runs.map((run) => run.bodies), this.scenery.bodies];
      this.#picture(runs.map((run) => run.tubes), bodies, view, stripe);
    });
  }

  #picture(tubes, bodies, view, stripe) {
    const { gl, scenery, theme } = this;
    const solids = scenery.solid ? [...tubes, scenery.solid] : tubes;
    const { ground } = scenery;
    // From below one looks through the ground.
    const strength = dot(ground.normal, view.eye) > ground.offset ? 1 : 0.25;

    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    const plane = this.#use(this.planeProgram, view);
    const fill = (alpha) => [...theme.colour.ground, alpha * strength];
    scenery.drawPlane(plane, ground, scenery.extent, fill(scenery.isGround ? 1 : 0.55), [...theme.colour.line, strength]);

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
    for (const set of solids) set.draw();
    const bodyShadow = shadows(this.bodyShadowProgram);
    for (const set of bodies) set.draw(bodyShadow);
    gl.disable(gl.STENCIL_TEST);
    gl.disable(gl.BLEND);

    gl.enable(gl.DEPTH_TEST);
    const tube = this.#use(this.tubeProgram, view);
    gl.uniform3fv(tube.eye, view.eye);
    gl.uniform1f(tube.stripe, stripe ? theme.stripe : 0);
    for (const set of tubes) set.draw();
    gl.uniform1f(tube.stripe, stripe && scenery.turns ? theme.stripe : 0);
    if (scenery.solid) scenery.solid.draw();
    const body = this.#use(this.bodyProgram, view);
    gl.uniform3fv(body.eye, view.eye);
    for (const set of bodies) set.draw(body);

    gl.enable(gl.BLEND);
    gl.depthMask(false);
    const wall = this.#use(this.planeProgram, view);
    const colours = [[...theme.colour.ground, 0.4], [...theme.colour.line, 0.6]];
    for (const side of scenery.walls) scenery.drawPlane(wall, side, 1.5 * scenery.reach, ...colours);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  #use({ program, places }, view) {
    this.gl.useProgram(program);
    this.gl.uniformMatrix4fv(places.toClip, false, view.toClip);
    if (places.pixel) this.gl.uniform1f(places.pixel, view.pixel);
    if (places.light) this.gl.uniform3fv(places.light, LIGHT);
    return places;
  }
}
