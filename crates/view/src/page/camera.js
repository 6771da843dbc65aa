// The camera: it turns about a target, z is up.

/** Half of the height that is seen, per distance. */
const SLOPE = Math.tan((17 * Math.PI) / 180);
/** The share of the picture that a reset fills. */
const ROOM = 0.82;
const STEEPEST = (89 * Math.PI) / 180;

class Camera {
  /** `points` is what a reset frames, three numbers each, about the centre of the scene; `box` is around them. */
  constructor(box, points) {
    this.box = box;
    this.points = points;
    this.radius = norm(subtract(box.high, box.low)) / 2;
  }

  /** Frames all of the points in a picture of that width over height. */
  reset(aspect) {
    const { low, high } = this.box;
    const [x, y] = subtract(high, low);
    // Across the longer of the two level sides.
    this.azimuth = ((x >= y ? -90 : 0) + 28) * (Math.PI / 180);
    this.elevation = (14 * Math.PI) / 180;
    this.target = scaled(add(low, high), 0.5);
    this.distance = 3 * this.radius;
    // Perspective moves the middle of the picture with the distance.
    for (let round = 0; round < 4; round++) this.#fit(aspect);
    this.fitted = this.distance;
  }

  /** Moves the target to the middle of the points as they are seen, and the eye to where all of them are. */
  #fit(aspect) {
    const { right, up, back } = this.axes();
    const place = [0, 0, 0];
    const seen = (visit) => {
      for (let i = 0; i < this.points.length; i += 3) {
        for (let k = 0; k < 3; k++) place[k] = this.points[i + k] - this.target[k];
        visit(dot(place, right), dot(place, up), dot(place, back));
      }
    };
    const [least, most] = [[Infinity, Infinity], [-Infinity, -Infinity]];
    seen((x, y, depth) => {
      [x, y].forEach((value, k) => {
        const share = value / Math.max(this.distance - depth, 1e-3 * this.distance);
        least[k] = Math.min(least[k], share);
        most[k] = Math.max(most[k], share);
      });
    });
    const middle = [0, 1].map((k) => (0.5 * (least[k] + most[k])) * this.distance);
    this.target = add(this.target, add(scaled(right, middle[0]), scaled(up, middle[1])));
    let distance = 0;
    seen((x, y, depth) => {
      const aside = Math.max(Math.abs(x) / aspect, Math.abs(y)) / (ROOM * SLOPE);
      distance = Math.max(distance, aside + depth);
    });
    this.distance = distance;
  }

  axes() {
    const [a, e] = [this.azimuth, this.elevation];
    const back = [Math.cos(a) * Math.cos(e), Math.sin(a) * Math.cos(e), Math.sin(e)];
    const right = [-Math.sin(a), Math.cos(a), 0];
    return { right, up: cross(back, right), back };
  }

  orbit(aside, up) {
    this.azimuth -= aside;
    this.elevation = Math.min(Math.max(this.elevation + up, -STEEPEST), STEEPEST);
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
    const far = norm(eye) + 6 * this.radius;
    const near = Math.max(this.distance * 0.02, far * 1e-4);
    const toClip = multiplied(perspective(SLOPE, aspect, near, far), viewMatrix(eye, right, up, back));
    return { toClip, eye };
  }
}

/**
 * Lets pointers and the wheel move a camera: `changed` is called after each change. `pictureAt` gives the middle and the
 * height of the picture at a place of the page.
 */
function attachGestures(canvas, camera, pictureAt, changed) {
  const pointers = new Map();
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return b ? Math.hypot(a.x - b.x, a.y - b.y) : 0;
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    const { height } = pictureAt(event.clientX, event.clientY);
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
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
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
