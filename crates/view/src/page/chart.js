// The strip chart: lines of the runs over time, and where the player is.

/** Dashes that tell lines of a curve apart where colours tell runs apart. */
const DASHES = [[], [6, 3], [2, 3], [9, 3, 2, 3]];
const MARGIN = { left: 76, right: 14, top: 10, bottom: 22 };

class Chart {
  constructor(canvas, motions) {
    this.canvas = canvas;
    this.motions = motions;
  }

  /** First and last time [s]. */
  get begin() {
    return Math.min(...this.motions.map((motion) => motion.time[0]));
  }

  get end() {
    return Math.max(...this.motions.map((motion) => motion.time.at(-1)));
  }

  /** The time [s] at a place of the page, from its left edge. */
  timeAt(clientX) {
    const { left, width } = this.canvas.getBoundingClientRect();
    const share = (clientX - left - MARGIN.left) / (width - MARGIN.left - MARGIN.right);
    return this.begin + Math.min(Math.max(share, 0), 1) * (this.end - this.begin);
  }

  /** The lines of a curve, by its key: of each of the runs, in colours and dashes that tell them apart. */
  lines(curve, runs, theme) {
    return runs.flatMap((run) => {
      const motion = this.motions[run];
      return (motion.curves.get(curve)?.lines ?? []).map(({ name, values }, i) => {
        const [hue, dash] = this.motions.length > 1 ? [run, i % DASHES.length] : [i, i < RUN_COLOURS ? 0 : 1];
        return { motion, name, values, colour: theme.runs[hue % RUN_COLOURS], dash: DASHES[dash] };
      });
    });
  }

  /** Lowest and highest of the values of lines, with some room. */
  #range(lines) {
    let [low, high] = [Infinity, -Infinity];
    for (const { values } of lines) {
      for (const value of values) {
        if (value === null) continue;
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
    }
    if (low > high) return null;
    // Rounding errors of a quantity that is kept are no curve.
    const room = Math.max((high - low) * 0.06, Math.abs(high) * 1e-6, Number.MIN_VALUE);
    return [low - room, high + room];
  }

  draw(curve, visible, time, theme) {
    const ratio = Math.min(window.devicePixelRatio || 1, MOST_PIXELS_PER_POINT);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    Object.assign(this.canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
    const pen = this.canvas.getContext("2d");
    pen.scale(ratio, ratio);
    pen.font = "12px system-ui, sans-serif";
    pen.textBaseline = "middle";
    const [right, bottom] = [width - MARGIN.right, height - MARGIN.bottom];
    const x = (t) => MARGIN.left + ((t - this.begin) / (this.end - this.begin || 1)) * (right - MARGIN.left);
    const lines = this.lines(curve, visible, theme);
    const range = this.#range(lines);
    this.#times(pen, x, bottom, theme);
    if (range) {
      const y = (value) => bottom - ((value - range[0]) / (range[1] - range[0])) * (bottom - MARGIN.top);
      this.#values(pen, range, y, right, theme);
      for (const line of lines) this.#line(pen, line, x, y, time);
    } else {
      pen.fillStyle = theme.text("muted");
      pen.textAlign = "center";
      pen.fillText("no values", (MARGIN.left + right) / 2, height / 2);
    }
    pen.fillStyle = theme.text("ink");
    pen.fillRect(x(time) - 0.5, MARGIN.top - 4, 1, bottom - MARGIN.top + 4);
  }

  #times(pen, x, bottom, theme) {
    pen.fillStyle = theme.text("muted");
    pen.textAlign = "center";
    const step = niceBelow((this.end - this.begin) / 3 || 1);
    for (let t = Math.ceil(this.begin / step) * step; t <= this.end + 1e-9 * step; t += step) {
      pen.fillText(`${formatNumber(t, 3)} s`, Math.min(x(t), x(this.end) - 8), bottom + 13);
    }
  }

  #values(pen, [low, high], y, right, theme) {
    const step = niceBelow((high - low) / 2);
    pen.textAlign = "right";
    // As many digits as tell two ticks apart.
    const digits = Math.min(7, 1 + Math.max(0, Math.ceil(Math.log10(Math.max(Math.abs(low), Math.abs(high)) / step))));
    for (let k = Math.ceil(low / step); k * step <= high; k++) {
      pen.fillStyle = theme.text("grid");
      pen.fillRect(MARGIN.left, Math.round(y(k * step)), right - MARGIN.left, 1);
      pen.fillStyle = theme.text("muted");
      pen.fillText(formatNumber(k * step, digits), MARGIN.left - 8, y(k * step));
    }
  }

  #line(pen, { motion, values, colour, dash }, x, y, time) {
    pen.strokeStyle = pen.fillStyle = colour;
    pen.setLineDash(dash);
    pen.lineWidth = 1.75;
    pen.lineJoin = "round";
    pen.beginPath();
    let drawing = false;
    values.forEach((value, frame) => {
      if (value !== null) pen[drawing ? "lineTo" : "moveTo"](x(motion.time[frame]), y(value));
      drawing = value !== null;
    });
    pen.stroke();
    const frame = motion.frameAt(time);
    if (values[frame] === null) return;
    pen.beginPath();
    pen.arc(x(motion.time[frame]), y(values[frame]), 3.5, 0, 2 * Math.PI);
    pen.fill();
  }
}
