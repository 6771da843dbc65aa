// Hands: pointers that drag rods and bodies, pins, and keys that drive what is held.

/** Speed of what keys drive, in sizes of the scene a second; and of its turns [rad/s]. */
const DRIVEN = 0.3;
const DRIVEN_TURN = 1;
const DRIVE_KEYS = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "PageUp", "PageDown"];

class LiveHands {
  constructor(page, live) {
    Object.assign(this, { page, live });
    /** By pointers: what each holds. */
    this.holds = new Map();
    this.pressed = new Set();
    this.drives = false;
    const canvas = element("picture");
    const on = (type, action) => canvas.addEventListener(type, action, { capture: true });
    on("pointerdown", (event) => this.#down(event));
    on("pointermove", (event) => this.#move(event));
    on("pointerup", (event) => this.#up(event, true));
    on("pointercancel", (event) => this.#up(event, false));
    on("dblclick", (event) => this.#pinAt(event));
    window.addEventListener("keydown", (event) => this.#key(event, true), { capture: true });
    window.addEventListener("keyup", (event) => this.#key(event, false), { capture: true });
    window.addEventListener("blur", () => this.#release());
    element("pin").addEventListener("click", () => this.togglePin(this.page.chosen?.segment));
    element("drive").addEventListener("click", () => this.setDrive(!this.drives));
  }

  /** Where the pointer is at the depth of what it holds [m]. */
  #place(hold, x, y) {
    const { sight } = this.page.sightAt(x, y);
    const far = hold.depth / dot(sight.along, hold.ahead);
    return add(add(sight.eye, scaled(sight.along, far)), this.page.renderer.centre);
  }

  #down(event) {
    if (event.button !== 0 || event.shiftKey || !this.live.leads) return;
    const hit = this.page.pick(event.clientX, event.clientY, event.pointerType);
    if (hit?.segment === undefined) return;
    const hand = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9].find((k) => ![...this.holds.values()].some((hold) => hold.hand === k));
    if (hand === undefined) return;
    event.stopImmediatePropagation();
    element("picture").setPointerCapture(event.pointerId);
    const { sight } = this.page.sightAt(event.clientX, event.clientY);
    const ahead = scaled(this.page.camera.axes().back, -1);
    const hold = { hand, hit, ahead, depth: hit.far * dot(sight.along, ahead), x: event.clientX, y: event.clientY, moved: false };
    this.holds.set(event.pointerId, hold);
    this.live.act({ grab: { hand, segment: hit.segment, at: this.#place(hold, event.clientX, event.clientY) } });
  }

  #move(event) {
    const hold = this.holds.get(event.pointerId);
    if (!hold) return;
    event.stopImmediatePropagation();
    if (Math.hypot(event.clientX - hold.x, event.clientY - hold.y) > STILL) hold.moved = true;
    if (!hold.moved) return;
    hold.to = this.#place(hold, event.clientX, event.clientY);
    if (hold.waits) return;
    // At once; what moves within the same picture is sent with it.
    this.#send(hold);
    hold.waits = true;
    requestAnimationFrame(() => {
      hold.waits = false;
      this.#send(hold);
    });
  }

  #send(hold) {
    if (hold.to && [...this.holds.values()].includes(hold)) this.live.act({ move: { hand: hold.hand, to: hold.to } });
    hold.to = undefined;
  }

  #up(event, lifted) {
    const hold = this.holds.get(event.pointerId);
    if (!hold) return;
    event.stopImmediatePropagation();
    this.#send(hold);
    this.holds.delete(event.pointerId);
    this.live.act({ drop: { hand: hold.hand } });
    if (lifted && !hold.moved) this.page.choose(hold.hit);
  }

  #pinAt(event) {
    if (!this.live.leads) return;
    const hit = this.page.pick(event.clientX, event.clientY);
    if (hit?.segment === undefined) return;
    this.page.choose(hit);
    this.togglePin(hit.segment);
  }

  /** Pins a segment, or lets it go where it is pinned. */
  togglePin(segment) {
    if (segment === undefined) return this.page.say("Click a rod or a body first, then pin it.");
    this.live.act(this.live.pins.includes(segment) ? { unpin: { segment } } : { pin: { segment } });
  }

  setDrive(drives) {
    if (drives && this.page.chosen?.segment === undefined)
      return this.page.say("Click what is pinned or gripped first, then drive it with the arrow keys.");
    this.#release();
    this.drives = drives;
    element("drive").setAttribute("aria-pressed", drives);
    if (drives) this.page.say("Arrow keys and Page up, Page down move it; with Shift they turn it. Esc ends that.");
  }

  #release() {
    if (this.pressed.size > 0) {
      this.pressed.clear();
      this.#drive(false);
    }
  }

  /** Drives what is chosen as the pressed keys say. */
  #drive(turns) {
    const { camera, chosen } = this.page;
    const segment = chosen?.segment;
    if (segment === undefined) return;
    const { right, up, back } = camera.axes();
    const along = [["ArrowLeft", "ArrowRight", right], ["ArrowDown", "ArrowUp", up], ["PageDown", "PageUp", scaled(back, -1)]];
    const sum = along.reduce((all, [less, more, axis]) => add(all, scaled(axis, this.pressed.has(more) - this.pressed.has(less))), [0, 0, 0]);
    const [velocity, turn] = turns ? [[0, 0, 0], scaled(cross(back, sum), -DRIVEN_TURN)] : [scaled(sum, DRIVEN * camera.radius), [0, 0, 0]];
    this.live.act({ drive: { segment, velocity, turn } });
  }

  #key(event, down) {
    if (event.ctrlKey || event.metaKey || event.altKey || element("help").open) return;
    const isField = ["SELECT", "INPUT"].includes(event.target.tagName);
    if (down && event.key.toLowerCase() === "x" && !isField) {
      event.preventDefault();
      return this.togglePin(([...this.holds.values()][0]?.hit ?? this.page.chosen)?.segment);
    }
    if (!this.drives) return;
    if (down && event.key === "Escape") {
      event.stopImmediatePropagation();
      return this.setDrive(false);
    }
    if (!DRIVE_KEYS.includes(event.key)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (event.repeat) return;
    if (down) this.pressed.add(event.key);
    else this.pressed.delete(event.key);
    this.#drive(event.shiftKey);
  }

  /** Draws pins, and what pulls where. */
  draw() {
    const { page, live } = this;
    const { motion } = live;
    const { left, top } = element("picture").getBoundingClientRect();
    const on = (place) => page.project(place).map((x, k) => x - [left, top][k]);
    const marks = [];
    const shape = (tag, properties) => {
      const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
      for (const [name, value] of Object.entries(properties)) node.setAttribute(name, value);
      marks.push(node);
    };
    for (const segment of live.pins) {
      const [cx, cy] = on([...motion.poses.subarray(7 * segment, 7 * segment + 3)]);
      shape("circle", { class: "pin", cx, cy, r: 6 });
    }
    for (const [grip, target] of motion.hands) {
      const [[x1, y1], [x2, y2]] = [on(grip), on(target)];
      shape("line", { x1, y1, x2, y2 });
      shape("circle", { class: "hand", cx: x2, cy: y2, r: 9 });
    }
    element("hands").replaceChildren(...marks);
  }
}
