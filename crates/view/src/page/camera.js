// The camera: it turns about a target, z is up.

/** Half of the height that is seen, per distance. */
const SLOPE = Math.tan((17 * Math.PI) / 180);
const STEEPEST = (89 * Math.PI) / 180;

class Camera {
  /** `box` is what a reset frames, about the centre of the scene. */
  constructor(box) {
    this.box = box;
    this.radius = norm(subtract(box.high, box.low)) / 2;
    this.reset(1);
  }

  /** Frames all of the box in a picture of that width over height. */
  reset(aspect) {
    const { low, high } = this.box;
    const [x, y] = subtract(high, low);
    // Across the longer of the two level sides.
    this.azimuth = ((x >= y ? -90 : 0) + 28) * (Math.PI / 180);
    this.elevation = (14 * Math.PI) / 180;
    this.target = scaled(add(low, high), 0.5);
    const { right, up, back } = this.axes();
    let distance = 0;
    for (let corner = 0; corner < 8; corner++) {
      const place = [0, 1, 2].map((k) => ((corner >> k) & 1 ? high[k] : low[k]) - this.target[k]);
      const aside = Math.max(Math.abs(dot(place, right)) / aspect, Math.abs(dot(place, up)) * 1.1);
      distance = Math.max(distance, aside / SLOPE + dot(place, back));
    }
    this.distance = distance * 1.06;
    this.fitted = this.distance;
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

/** Lets pointers and the wheel move a camera: `changed` is called after each change. */
function attachGestures(canvas, camera, changed) {
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
    const height = canvas.clientHeight;
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
    camera.zoom(Math.exp(Math.min(Math.max(lines, -200), 200) * 0.0015));
    changed();
  };
  canvas.addEventListener("wheel", zoomed, { passive: false });
}
