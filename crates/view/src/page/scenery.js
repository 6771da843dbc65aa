// What stands about: the ground with its grid, walls, round obstacles and meshes. Some of it may move.

/** A half space whose normal is so steep is the ground. */
const GROUND_STEEPNESS = 0.5;
const LIGHT = normalized([0.22, -0.32, 1]);
const LEVEL = [[1, 0, 0], [0, 1, 0]];

/** Planes, tubes and meshes of obstacles, about the centre of a scene that a camera looks at. */
class Scenery {
  constructor(gl, motions, box, centre, { radius, reach }) {
    this.gl = gl;
    // What is far around is no reason for a wide grid.
    this.reach = Math.min(reach, 2 * radius);
    this.centre = centre;
    const seen = new Set();
    const all = motions.flatMap((motion, run) => motion.obstacles.map((obstacle, index) => {
      const poses = motion.obstaclePoses.get(index);
      return { motion, run, index, isPlane: obstacle.kind === "half_space", moves: poses !== undefined, poses };
    }));
    const obstacles = all.filter(({ motion, index, poses }) => {
      const text = JSON.stringify([motion.obstacles[index], poses]);
      return !seen.has(text) && seen.add(text);
    });
    const planes = obstacles.filter((obstacle) => obstacle.isPlane).map((source) => ({ source, ...this.#planeAt(source, 0) }));
    const ground = planes.find((plane) => plane.normal[2] > GROUND_STEEPNESS);
    this.isGround = ground !== undefined;
    this.ground = ground ?? { normal: [0, 0, 1], offset: Math.max(box.low[2] - centre[2], -3 * radius), axes: LEVEL, slide: [0, 0] };
    this.walls = planes.filter((plane) => plane !== ground && (plane.source.moves || Math.abs(plane.offset) < 3 * this.reach));
    this.spacing = niceBelow(this.reach / 4);
    this.moving = planes.filter((plane) => plane.source.moves);
    const isMesh = ({ motion, index }) => motion.obstacles[index].kind === "mesh";
    this.round = obstacles.filter((obstacle) => !obstacle.isPlane && !isMesh(obstacle));
    this.solid = this.#tubes();
    this.meshes = obstacles.filter(isMesh);
    this.colour = 0;
    const each = this.meshes.map((_, i) => i);
    const surfaces = this.meshes.map(({ motion, index }) => motion.obstacles[index].surface);
    this.bodies = new RunBodies(gl, { segment: each, surface: each, surfaces });
    this.#placeMeshes(() => 0);
    // Stripes show turns.
    this.turns = this.round.some(({ poses }) => poses?.some((pose) => Math.abs(pose[6]) < 0.9999));
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    gl.bindVertexArray(null);
  }

  /** A plane in a frame: its normal, its offset from the scene's centre, two axes in it, and how far its grid has slid. */
  #planeAt({ motion, index }, frame) {
    const first = motion.obstacles[index];
    const { point, normal, turn } = motion.obstacleAt(index, frame);
    // On level ground the grid follows x and y.
    const own = Math.abs(first.normal[2]) > 0.999 ? LEVEL : across(first.normal);
    const axes = own.map((axis) => turned(turn, axis));
    const slide = own.map((axis, k) => dot(first.point, axis) - dot(point, axes[k]));
    return { normal, offset: dot(normal, subtract(point, this.centre)), axes, slide };
  }

  #tubes() {
    if (this.round.length === 0) return null;
    const tubes = new TubeSet(this.gl, this.round.length, OBSTACLE_DETAIL);
    const shapes = [];
    this.round.forEach((source, i) => {
      this.#place(tubes, source, i, 0);
      const { radius } = source.motion.obstacles[source.index];
      shapes.push(radius, radius, 1, 1);
    });
    tubes.setShapes(new Float32Array(shapes));
    return tubes;
  }

  #place(tubes, { motion, index }, i, frame) {
    const first = motion.obstacles[index];
    const { centre, start, end, turn } = motion.obstacleAt(index, frame);
    const ends = [start ?? centre, end ?? centre].map((x) => subtract(x, this.centre));
    const span = first.end ? subtract(first.end, first.start) : [0, 0, 0];
    const frameOfAxis = composed(turn, norm(span) > 0 ? turnFromZ(normalized(span)) : UNTURNED);
    tubes.floats.set([...ends[0], ...frameOfAxis, ...ends[1], ...frameOfAxis], WORDS * i);
  }

  #placeMeshes(frameOf) {
    const poses = this.meshes.flatMap(({ motion, run, index }) => {
      const { centre, turn } = motion.obstacleAt(index, frameOf(run));
      return [...subtract(centre, this.centre), ...turn];
    });
    this.bodies.update(poses, () => this.colour);
  }

  /** Makes room for what has moved further than at first: the ground, where no obstacle is one, lies below all of it. */
  widen(box, { radius, reach }) {
    this.reach = Math.min(reach, 2 * radius);
    if (!this.isGround) this.ground.offset = Math.max(box.low[2] - this.centre[2], -3 * radius);
  }

  /** Moves what moves to the frames shown; `frameOf` says which of a run is. */
  update(frameOf) {
    for (const plane of this.moving) Object.assign(plane, this.#planeAt(plane.source, frameOf(plane.source.run)));
    if (this.meshes.some((source) => source.moves)) this.#placeMeshes(frameOf);
    if (!this.round.some((source) => source.moves)) return;
    this.round.forEach((source, i) => this.#place(this.solid, source, i, frameOf(source.run)));
    this.solid.upload();
  }

  /** Colours the round obstacles and the meshes. */
  paint(theme) {
    const colour = paint(theme, "obstacle");
    this.colour = colour;
    this.bodies.paint(colour);
    if (!this.solid) return;
    for (let i = 0; i < this.solid.count; i++) this.solid.words[WORDS * i + 14] = colour;
    this.solid.upload();
  }

  /** The point of a plane that is nearest to the scene's centre. */
  foot(plane) {
    return scaled(plane.normal, plane.offset);
  }

  /** How far the ground is drawn [m]. */
  get extent() {
    return 4 * this.reach;
  }

  drawPlane(places, plane, extent, fill, line) {
    const { gl } = this;
    const centre = this.foot(plane);
    const [u, v] = plane.axes;
    const world = add(centre, this.centre);
    const [alongU, alongV] = [u, v].map((axis, k) => dot(world, axis) + plane.slide[k]);
    gl.uniform3fv(places.centre, centre);
    gl.uniform3fv(places.u, scaled(u, extent));
    gl.uniform3fv(places.v, scaled(v, extent));
    // Grid lines are at multiples of the spacing in the world; what is left keeps single precision exact.
    gl.uniform2f(places.shift, alongU % (5 * this.spacing), alongV % (5 * this.spacing));
    gl.uniform1f(places.spacing, this.spacing);
    gl.uniform4fv(places.fill, fill);
    gl.uniform4fv(places.line, line);
    gl.bindVertexArray(this.array);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.bindVertexArray(null);
  }
}
