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
    this.chapters = this.leader.chapters;
    this.chapter = null;
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

  /** First and last frame of what is played: of a chapter, or of all. */
  get first() {
    return this.chapter === null ? 0 : this.chapters[this.chapter].frame;
  }

  get last() {
    return (this.chapters[this.chapter === null ? Infinity : this.chapter + 1]?.frame ?? this.frames) - 1;
  }

  /** What the frame shown is called; undefined where there are no chapters. */
  get label() {
    return this.chapters.findLast(({ frame }) => frame <= this.frame)?.label;
  }

  /** Plays a chapter alone, or with null all of them. */
  choose(chapter) {
    this.chapter = chapter;
    this.seek(this.first);
  }

  /** The frame of a run that is shown. */
  frameOf(run) {
    const motion = this.motions[run];
    return motion === this.leader ? this.frame : motion.frameAt(this.time);
  }

  /** Shows a frame: the nearest there is. */
  seek(frame) {
    this.frame = Math.min(Math.max(Math.round(frame), 0), this.frames - 1);
    if (this.chapter !== null && (this.frame < this.first || this.frame > this.last))
      this.chapter = this.chapters.findLastIndex(({ frame }) => frame <= this.frame);
    this.clock = this.time;
    this.changed();
  }

  /** Shows the first frame. */
  toStart() {
    this.seek(0);
  }

  /** Shows the last frame. */
  toEnd() {
    this.seek(this.frames - 1);
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
    if (this.frame >= this.last || this.frame < this.first) this.frame = this.first;
    this.playing = true;
    this.clock = this.time;
    this.before = undefined;
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
    const first = time[this.first];
    // A mode swings on: from its last frame to its first one it is as far as from one to the next.
    const end = this.chapter === null ? time[this.last] : time[this.last] + (time[this.last] - first) / Math.max(this.last - this.first, 1);
    // A page that was hidden does not jump.
    if (this.before !== undefined) this.clock += Math.min((now - this.before) / 1000, 0.25) * this.speed;
    this.before = now;
    if (this.clock > end) {
      if (!this.loop || end <= first) {
        this.frame = this.last;
        this.pause();
        return;
      }
      this.clock = first + ((this.clock - first) % (end - first));
    }
    const frame = Math.min(this.leader.frameAt(this.clock), this.last);
    if (frame === this.frame) return;
    this.frame = frame;
    this.changed();
  }
}
