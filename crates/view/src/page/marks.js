// Grips as dots, loads and forces of contacts as arrows.

/** How long an arrow of a usual force is, as a share of the scene's size. */
const ARROW = 0.3;
/** Dots are at least so many pixels wide, in those of thin rods. */
const DOT = 4;

/** The largest force of each frame of a run [N], of its loads and contacts. */
function largestForces(motion) {
  return Array.from(motion.time, (_, frame) => {
    let most = 0;
    motion.visitForces(frame, (force) => (most = Math.max(most, norm(force))));
    return most;
  });
}

/** The force of an arrow as long as a cell of the grid, of `spacing` [m]: a round number [N]; 0 where there are no forces. */
function forceScale(motions, spacing, reach) {
  const forces = motions.flatMap(largestForces).filter((force) => force > 0).sort((a, b) => a - b);
  if (forces.length === 0) return 0;
  // Impacts are no measure.
  const usual = forces[Math.floor(0.9 * (forces.length - 1))];
  return niceBelow((1.5 * usual * spacing) / (ARROW * reach));
}

/** The marks of a run, about `centre`; a newton is as long as `perNewton` [m]. */
class RunMarks {
  constructor(gl, motion, centre, reach, perNewton) {
    Object.assign(this, { motion, centre, perNewton });
    this.thick = 0.004 * reach;
    let most = 0;
    motion.time.forEach((_, frame) => {
      let count = 0;
      motion.visitForces(frame, () => count++);
      most = Math.max(most, count);
    });
    const detail = { sides: 10, rings: 2, caps: 3 };
    this.arrows = new TubeSet(gl, 2 * most, detail);
    this.dots = new TubeSet(gl, motion.grips.length, detail);
    this.arrowShapes = new Float32Array(8 * most);
    this.dotShapes = new Float32Array(4 * motion.grips.length);
  }

  /** Moves the marks to a frame; `colours` are those of a load, a contact, a grip, as words. */
  update(frame, { load, contact, grip }) {
    const { motion, arrows, dots } = this;
    arrows.count = dots.count = 0;
    motion.visitForces(frame, (force, isContact, place) => this.#arrow(place(), force, isContact ? contact : load));
    motion.visitGrips(frame, (place, radius) => {
      this.#tube(dots, subtract(place, this.centre), subtract(place, this.centre), UNTURNED, grip);
      this.dotShapes.set([1.7 * radius, 1.7 * radius, 1, 1], 4 * (dots.count - 1));
    });
    for (const [set, shapes] of [[arrows, this.arrowShapes], [dots, this.dotShapes]]) {
      set.setShapes(shapes);
      set.upload();
    }
  }

  #tube(set, start, end, frame, colour) {
    set.floats.set([...start, ...frame, ...end, ...frame], WORDS * set.count);
    set.words[WORDS * set.count + 14] = colour;
    set.count++;
  }

  #arrow(place, force, colour) {
    const size = norm(force);
    if (size === 0) return;
    const length = size * this.perNewton;
    const head = Math.min(9 * this.thick, 0.6 * length);
    const thick = Math.min(this.thick, length / 15);
    const [start, along, frame] = [subtract(place, this.centre), scaled(force, 1 / size), turnFromZ(scaled(force, 1 / size))];
    const neck = add(start, scaled(along, length - head));
    this.#tube(this.arrows, start, neck, frame, colour);
    this.#tube(this.arrows, neck, add(start, scaled(along, length)), frame, colour);
    this.arrowShapes.set([thick, thick, 1, 1, 2.8 * thick, 0, 0.3, 1], 4 * (this.arrows.count - 2));
  }
}
