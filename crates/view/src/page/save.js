// Pictures and videos of what is seen, with names, time and colours.

/** Kinds of videos, best first. */
const VIDEOS = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];
const FRAMES_PER_SECOND = 30;

/** Hands a file to the browser's downloads. */
function download(blob, name) {
  const url = URL.createObjectURL(blob);
  make("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 60000);
}

class Saver {
  constructor(page) {
    this.page = page;
    this.canvas = make("canvas");
  }

  get name() {
    return this.page.motions.map(({ name }) => name).join(" and ").replace(/[^\p{L}\p{N}]+/gu, "-").slice(0, 80);
  }

  /** Draws what is seen into the canvas of pictures. */
  compose() {
    const { page, canvas } = this;
    const { renderer, theme, motions, colour, shared } = page;
    const { width, height } = renderer.canvas;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const pen = canvas.getContext("2d");
    // What WebGL has drawn is there until the browser shows it.
    page.drawPicture();
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.drawImage(renderer.canvas, 0, 0);
    pen.scale(renderer.ratio, renderer.ratio);
    pen.font = "600 14px system-ui, sans-serif";
    pen.textBaseline = "middle";
    let y = 22;
    page.pictures().flat().forEach((run) => {
      pen.fillStyle = theme.runs[run % RUN_COLOURS];
      if (colour === "run") pen.fillRect(16, y - 3, 22, 6);
      pen.fillStyle = theme.text("ink");
      pen.fillText(motions[run].name, colour === "run" ? 46 : 16, y);
      y += 22;
    });
    pen.fillText(page.controls.said(), 16, y);
    this.#note(pen, height / renderer.ratio - 18);
    if (shared) this.#bar(pen, width / renderer.ratio);
  }

  /** What the grid and the marks mean. */
  #note(pen, y) {
    let x = 16;
    for (const part of element("note").children) {
      const sign = part.querySelector("i");
      if (sign) {
        pen.fillStyle = getComputedStyle(sign).backgroundColor;
        pen.fillRect(x, y - 3, 12, 6);
        x += 18;
      }
      pen.fillStyle = this.page.theme.text("muted");
      pen.fillText(part.textContent, x, y);
      x += pen.measureText(part.textContent).width + 16;
    }
  }

  #bar(pen, width) {
    const { shared, theme } = this.page;
    pen.fillStyle = theme.text("ink");
    const size = Math.min(280, width / 2 - 24);
    const left = width - size - 16;
    pen.textAlign = "right";
    pen.fillText(element("bar-label").textContent, width - 16, 22);
    pen.drawImage(element("bar-colours"), left, 34, size, 10);
    pen.font = "12px system-ui, sans-serif";
    pen.fillStyle = theme.text("muted");
    [["left", 0], ["center", 0.5], ["right", 1]].forEach(([align, share]) => {
      pen.textAlign = align;
      pen.fillText(formatNumber(valueAt(shared, share)), left + share * size, 56);
    });
    pen.textAlign = "left";
  }

  picture() {
    this.compose();
    const { player } = this.page;
    this.canvas.toBlob((blob) => download(blob, `${this.name}-${player.frame}.png`), "image/png");
  }

  /** Plays once from the first frame, and saves what is seen; or ends what is being recorded. */
  video() {
    if (this.recorder) return this.recorder.stop();
    const type = typeof MediaRecorder === "undefined" ? undefined : VIDEOS.find((kind) => MediaRecorder.isTypeSupported(kind));
    if (!type || !this.canvas.captureStream) {
      this.page.say("This browser cannot record videos (it lacks MediaRecorder for WebM). Save pictures instead.");
      return;
    }
    const { player } = this.page;
    const { loop } = player;
    player.seek(player.first);
    this.compose();
    const recorder = new MediaRecorder(this.canvas.captureStream(FRAMES_PER_SECOND), { mimeType: type, videoBitsPerSecond: 8e6 });
    const parts = [];
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    recorder.addEventListener("stop", () => {
      this.recorder = undefined;
      player.loop = loop;
      player.pause();
      download(new Blob(parts, { type }), `${this.name}.${type.slice(6, type.includes("mp4") ? 9 : 10)}`);
    });
    this.recorder = recorder;
    player.loop = false;
    recorder.start();
    player.play();
    this.page.say("Recording. It ends with the motion, or when you press the button again.");
  }

  /** Goes on with a video after each frame of the page. */
  follow() {
    if (!this.recorder) return;
    this.compose();
    // The last frame is to be in the video, too.
    if (!this.page.player.playing) setTimeout(() => this.recorder?.stop(), 2000 / FRAMES_PER_SECOND);
  }
}
