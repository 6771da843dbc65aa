// What a simulation that runs is told, in the place of a player: time goes on, stands, goes back.

class LivePlayer {
  constructor([motion], changed) {
    Object.assign(this, { motion, changed, frames: 1, frame: 0, chapters: [], chapter: null, loop: false });
    this.plays = true;
    this.pace = 1;
    // The page draws when a frame comes.
    this.playing = false;
    this.send = () => {};
  }

  get leader() {
    return this.motion;
  }

  get time() {
    return this.motion.time.at(-1);
  }

  get label() {
    return undefined;
  }

  /** Simulated seconds a second that are asked for. */
  get speed() {
    return this.pace;
  }

  set speed(pace) {
    this.pace = pace;
    this.send({ pace });
  }

  frameOf() {
    return 0;
  }

  nearest(time) {
    return time;
  }

  /** Goes to the last moment that is kept before a time [s]. */
  seek(time) {
    if (!this.wanted) requestAnimationFrame(() => {
      this.send({ back: this.wanted.time });
      this.wanted = undefined;
    });
    this.wanted = { time: Math.min(Math.max(time, this.motion.first), this.motion.last) };
  }

  toStart() {
    this.seek(this.motion.first);
  }

  toEnd() {
    this.seek(this.motion.last);
  }

  step(by) {
    if (by > 0) this.send("step");
    else this.seek(this.time - 0.25);
  }

  play() {
    this.send("play");
  }

  pause() {
    this.send("pause");
  }

  toggle() {
    this.send(this.plays ? "pause" : "play");
  }

  choose() {}

  advance() {}
}

/** Below this share of the pace that was asked for, a simulation is slow. */
const SLOW = 0.9;

class LiveControls extends Controls {
  constructor(page) {
    super(page);
    this.decimals = 2;
    element("scrubber").step = "any";
    element("scrubber").setAttribute("aria-label", "Time of the last 30 seconds");
    for (const id of ["loop", "save-video"]) element(id).hidden = true;
    element("speed").closest("label").firstChild.textContent = "Pace ";
  }

  said() {
    return `${this.page.player.time.toFixed(this.decimals)} s`;
  }

  /** How fast it goes, in words. */
  pace() {
    const { player } = this.page;
    const { motion } = player;
    if (player.busy) return `slow: this step has taken ${formatNumber(player.busy, 2)} s`;
    if (player.stuck) return `stopped: ${player.status}`;
    if (!player.plays) return "paused";
    if (!Number.isFinite(motion.speed)) return "…";
    const times = `${formatNumber(motion.speed, 2)}× real time`;
    if (player.solved === false) return `${player.status}: ${times}`;
    return motion.speed < SLOW * player.pace ? `slow: ${times}` : times;
  }

  showFrame() {
    const { player } = this.page;
    const { motion } = player;
    const scrubber = element("scrubber");
    Object.assign(scrubber, { min: motion.first, max: Math.max(motion.last, motion.first + 1e-9) });
    scrubber.value = player.wanted?.time ?? player.time;
    scrubber.setAttribute("aria-valuetext", this.said());
    const pace = this.pace();
    element("clock").replaceChildren(this.said(), make("small", { id: "pace", textContent: pace, className: player.solved === false || /^(slow|stopped)/.test(pace) ? "warns" : "" }));
    element("play").setAttribute("aria-label", player.plays ? "Pause" : "Play");
    element("play-icon").setAttribute("d", player.plays ? PAUSE_ICON : PLAY_ICON);
    if (document.activeElement !== element("speed")) element("speed").value = player.pace;
  }
}
