// Which frame is shown, and when the next one is. Frames are those of the run that has most; the others follow by time.

/** Speeds to choose from, in seconds shown a second. */
const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10];
/** The first speed lets a motion last so long [s], if real time would be shorter. */
const SHORTEST_SHOW = 2.5;

class Player {
  /** `changed` is called whenever the frame, or whether it plays, has changed. */
  constructor(motions, changed) {
    this.motions = motions;
    this.leader = motions.reduce((most, motion) => (motion.frames > most.frames ? motion : most));
    this.frames = this.leader.frames;
    this.frame = 0;
    this.playing = false;
    this.loop = true;
    this.changed = changed;
    const { time } = this.leader;
    const slow = SPEEDS.filter((speed) => speed <= 1 && (time.at(-1) - time[0]) / speed >= SHORTEST_SHOW);
    this.speed = slow.at(-1) ?? SPEEDS[0];
  }

  /** Time of the frame shown [s]. */
  get time() {
    return this.leader.time[this.frame];
  }

  /** The frame of a run that is shown. */
  frameOf(run) {
    const motion = this.motions[run];
    return motion === this.leader ? this.frame : motion.frameAt(this.time);
  }

  /** Shows a frame: the nearest there is. */
  seek(frame) {
    this.frame = Math.min(Math.max(Math.round(frame), 0), this.frames - 1);
    this.clock = this.time;
    this.changed();
  }

  /** Shows a frame so many further on, and stops there. */
  step(by) {
    this.playing = false;
    this.seek(this.frame + by);
  }

  /** The frame nearest to a time [s]. */
  nearest(time) {
    const frame = this.leader.frameAt(time);
    const after = Math.min(frame + 1, this.frames - 1);
    return this.leader.time[after] - time < time - this.leader.time[frame] ? after : frame;
  }

  /** Plays, from the start if it stands at the end. */
  play() {
    if (this.frames < 2) return;
    if (this.frame === this.frames - 1) this.frame = 0;
    this.playing = true;
    this.clock = this.time;
    this.last = undefined;
    this.changed();
  }

  pause() {
    this.playing = false;
    this.changed();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  /** Goes on to the time `now` [ms] of an animation frame. */
  advance(now) {
    if (!this.playing) return;
    const { time } = this.leader;
    const [first, end] = [time[0], time.at(-1)];
    // A page that was hidden does not jump.
    if (this.last !== undefined) this.clock += Math.min((now - this.last) / 1000, 0.25) * this.speed;
    this.last = now;
    if (this.clock > end) {
      if (!this.loop || end <= first) {
        this.frame = this.frames - 1;
        this.pause();
        return;
      }
      this.clock = first + ((this.clock - first) % (end - first));
    }
    const frame = this.leader.frameAt(this.clock);
    if (frame === this.frame) return;
    this.frame = frame;
    this.changed();
  }
}
