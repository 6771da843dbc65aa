// The camera: it turns about a target, z is up.

/** Half of the height that is seen, per distance. */
const SLOPE = Math.tan((17 * Math.PI) / 180);
/** The share of the picture that a reset fills. */
const ROOM = 0.86;
/** Obstacles that stand still are framed, too, where the eye has to be no more than so much further away for it. */
const ASIDE = 1.3;
/** By how much a start view must show more than the usual one. */
const WORTH = 1.15;
/** A pointer that has moved no further means a click [px]. */
const STILL = 5;
const degrees = Math.PI / 180;
/** Views by name: azimuth and elevation of the eye. */
const VIEWS = { top: [-90 * degrees, 90 * degrees], front: [-90 * degrees, 0], side: [0, 0] };

class Camera {
  /**
   * Of what moves, about the centre of the scene, and of that with what stands still: boxes around them, and the points that
   * a reset frames, three numbers each.
   */
  constructor(box, whole, points, still) {
    this.box = box;
    this.points = points;
    this.still = still;
    this.radius = norm(subtract(box.high, box.low)) / 2;
    this.reach = Math.max(norm(whole.low), norm(whole.high));
    const [x, y] = subtract(box.high, box.low);
    this.start = this.#mostOf([(x >= y ? -90 : 0) + 28, 14].map((angle) => angle * degrees));
  }

  /** The start view: the `usual` one, across the longer of the two level sides, or one that shows more of what moves. */
  #mostOf(usual) {
    const every = 3 * Math.ceil(this.points.length / 3 / 500);
    const shown = ([azimuth, elevation]) => {
      Object.assign(this, { azimuth, elevation });
      const { right, up } = this.axes();
      const size = (axis) => {
        let [least, most] = [Infinity, -Infinity];
        for (let i = 0; i < this.points.length; i += every) {
          const along = this.points[i] * axis[0] + this.points[i + 1] * axis[1] + this.points[i + 2] * axis[2];
          least = Math.min(least, along);
          most = Math.max(most, along);
        }
        return most - least;
      };
      return size(right) * size(up);
    };
    let [best, most] = [usual, WORTH * shown(usual)];
    for (const elevation of [14, 30]) {
      // Of two alike, as from both sides, the nearer one.
      for (let turn = 0; turn <= 180; turn += 15) {
        for (const way of [-turn, turn]) {
          const view = [usual[0] + way * degrees, elevation * degrees];
          const share = shown(view);
          if (share > 1.01 * most) [best, most] = [view, share];
        }
      }
    }
    return best;
  }

  /** Frames all of the points in a picture of that width over height, seen as a view of that name; or as at the start. */
  reset(aspect, view) {
    [this.azimuth, this.elevation] = VIEWS[view] ?? this.start;
    this.#frame(aspect, this.points);
    const { target, distance } = this;
    if (this.still.length > 0) this.#frame(aspect, this.points.concat(this.still));
    if (this.distance > ASIDE * distance) Object.assign(this, { target, distance });
    this.fitted = this.distance;
  }

  /** Moves the eye to where all of the points are seen: between the rays to the outermost ones on both sides. */
  #frame(aspect, points) {
    const { right, up, back } = this.axes();
    const sides = [[right, aspect], [up, 1]].map(([axis, wide]) => {
      const slope = ROOM * SLOPE * wide;
      let [least, most] = [Infinity, -Infinity];
      for (let i = 0; i < points.length; i += 3) {
        const place = [points[i], points[i + 1], points[i + 2]];
        const [aside, depth] = [dot(place, axis), slope * dot(place, back)];
        least = Math.min(least, aside - depth);
        most = Math.max(most, aside + depth);
      }
      return { middle: scaled(axis, (least + most) / 2), distance: (most - least) / (2 * slope) };
    });
    this.target = add(sides[0].middle, sides[1].middle);
    this.distance = Math.max(sides[0].distance, sides[1].distance);
  }

  axes() {
    const [a, e] = [this.azimuth, this.elevation];
    const back = [Math.cos(a) * Math.cos(e), Math.sin(a) * Math.cos(e), Math.sin(e)];
    const right = [-Math.sin(a), Math.cos(a), 0];
    return { right, up: cross(back, right), back };
  }

  orbit(aside, up) {
    this.azimuth -= aside;
    this.elevation = Math.min(Math.max(this.elevation + up, -90 * degrees), 90 * degrees);
  }

  /** Moves the target by shares of the picture's height. */
  pan(aside, upwards) {
    const { right, up } = this.axes();
    const size = 2 * SLOPE * this.distance;
    this.target = add(this.target, add(scaled(right, -aside * size), scaled(up, upwards * size)));
  }

  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, this.fitted * 1e-3), this.fitted * 20);
  }

  /** Matrix to clip space, and the eye. */
  view(aspect) {
    const { right, up, back } = this.axes();
    const eye = add(this.target, scaled(back, this.distance));
    const far = norm(eye) + 6 * this.reach;
    const near = Math.max(this.distance * 0.02, far * 1e-4);
    const toClip = multiplied(perspective(SLOPE, aspect, near, far), viewMatrix(eye, right, up, back));
    return { toClip, eye };
  }

  /** The line of sight to a place of a picture, from -1 to 1 to the right and up, that is so many pixels high. */
  sight(x, y, aspect, height) {
    const { right, up, back } = this.axes();
    const along = add(add(scaled(right, x * SLOPE * aspect), scaled(up, y * SLOPE)), scaled(back, -1));
    return new Sight(add(this.target, scaled(back, this.distance)), normalized(along), (2 * SLOPE) / height);
  }
}

/**
 * Lets pointers and the wheel move a camera: `changed` is called after each change. `pictureAt` gives the middle and the
 * height of the picture at a place of the page; `clicked` is called where a pointer goes down and up without a way.
 */
function attachGestures(canvas, camera, pictureAt, changed, clicked) {
  const pointers = new Map();
  let press = null;
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return b ? Math.hypot(a.x - b.x, a.y - b.y) : 0;
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    press = pointers.size === 1 && event.button === 0 ? { x: event.clientX, y: event.clientY } : null;
  });
  canvas.addEventListener("pointermove", (event) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    const { height } = pictureAt(event.clientX, event.clientY);
    if (press && Math.hypot(event.clientX - press.x, event.clientY - press.y) > STILL) press = null;
    // A finger trembles.
    if (press) return;
    const before = spread();
    const [x, y] = [(event.clientX - pointer.x) / height, (event.clientY - pointer.y) / height];
    pointer.x = event.clientX;
    pointer.y = event.clientY;
    if (pointers.size > 1) {
      // Each of two fingers moves the picture by half.
      camera.pan(x / 2, y / 2);
      if (before > 0 && spread() > 0) camera.zoom(before / spread());
    } else if (event.shiftKey || event.buttons & 6) {
      camera.pan(x, y);
    } else {
      camera.orbit(3 * x, 3 * y);
    }
    changed();
  });
  canvas.addEventListener("pointerup", (event) => press && clicked(event.clientX, event.clientY, event.pointerType));
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (event) => {
      pointers.delete(event.pointerId);
      press = null;
    });
  }
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  const zoomed = (event) => {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY : event.deltaY * 30;
    const factor = Math.exp(Math.min(Math.max(lines, -200), 200) * 0.0015);
    // What is under the pointer stays there.
    const { x, y, height } = pictureAt(event.clientX, event.clientY);
    camera.pan(((x - event.clientX) / height) * (1 - factor), ((y - event.clientY) / height) * (1 - factor));
    camera.zoom(factor);
    changed();
  };
  canvas.addEventListener("wheel", zoomed, { passive: false });
}
