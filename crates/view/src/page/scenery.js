// What stands still: the ground with its grid, walls and round obstacles.

/** A half space whose normal is so steep is the ground. */
const GROUND_STEEPNESS = 0.5;
const LIGHT = normalized([0.22, -0.32, 1]);

/** Planes and tubes of obstacles, about the centre of a scene of `reach` [m]. */
class Scenery {
  constructor(gl, motions, box, centre, reach) {
    this.gl = gl;
    this.reach = reach;
    const seen = new Set();
    const obstacles = motions.flatMap((motion) => motion.obstacles).filter((obstacle) => {
      const text = JSON.stringify(obstacle);
      return !seen.has(text) && seen.add(text);
    });
    const planes = obstacles.filter((obstacle) => obstacle.kind === "half_space").map(({ point, normal }) => {
      return { normal, offset: dot(normal, subtract(point, centre)) };
    });
    const ground = planes.find((plane) => plane.normal[2] > GROUND_STEEPNESS);
    this.isGround = ground !== undefined;
    this.ground = ground ?? { normal: [0, 0, 1], offset: box.low[2] - centre[2] };
    this.walls = planes.filter((plane) => plane !== ground && Math.abs(plane.offset) < 3 * reach);
    this.spacing = niceBelow(reach / 4);
    this.centre = centre;
    this.solid = this.#tubes(obstacles.filter((obstacle) => obstacle.kind !== "half_space"));
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    gl.bindVertexArray(null);
  }

  #tubes(obstacles) {
    if (obstacles.length === 0) return null;
    const tubes = new TubeSet(this.gl, obstacles.length, OBSTACLE_DETAIL);
    const shapes = [];
    obstacles.forEach((obstacle, i) => {
      const ends = [obstacle.start ?? obstacle.centre, obstacle.end ?? obstacle.centre].map((x) => subtract(x, this.centre));
      const span = subtract(ends[1], ends[0]);
      const turn = norm(span) > 0 ? turnFromZ(normalized(span)) : [0, 0, 0, 1];
      tubes.floats.set([...ends[0], ...turn, ...ends[1], ...turn], WORDS * i);
      shapes.push(obstacle.radius, obstacle.radius, 1, 1);
    });
    tubes.setShapes(new Float32Array(shapes));
    return tubes;
  }

  /** Colours the round obstacles. */
  paint(theme) {
    if (!this.solid) return;
    const colour = word(theme.colour.obstacle.map((c) => Math.round(255 * c)));
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
    // On level ground the grid follows x and y.
    const [u, v] = Math.abs(plane.normal[2]) > 0.999 ? [[1, 0, 0], [0, 1, 0]] : across(plane.normal);
    const world = add(centre, this.centre);
    gl.uniform3fv(places.centre, centre);
    gl.uniform3fv(places.u, scaled(u, extent));
    gl.uniform3fv(places.v, scaled(v, extent));
    // Grid lines are at multiples of the spacing in the world; what is left keeps single precision exact.
    gl.uniform2f(places.shift, dot(world, u) % (5 * this.spacing), dot(world, v) % (5 * this.spacing));
    gl.uniform1f(places.spacing, this.spacing);
    gl.uniform4fv(places.fill, fill);
    gl.uniform4fv(places.line, line);
    gl.bindVertexArray(this.array);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.bindVertexArray(null);
  }
}
