// Begins with a simulation that runs: what comes from it, and what it is told.

/** A page whose connection was lost tries again after this time [ms]. */
const AGAIN = 1000;

class Live {
  constructor(page) {
    this.page = page;
    [this.motion] = page.motions;
    this.pins = [];
    this.you = this.leader = undefined;
    page.player.send = (command) => this.send(command);
    document.querySelector("#view").append(document.createElementNS("http://www.w3.org/2000/svg", "svg"));
    document.querySelector("#view > svg").id = "hands";
    this.hands = new LiveHands(page, this);
    page.overlay = this.hands;
    this.#buttons();
    this.#knobs();
    this.#help();
    this.#connect();
  }

  /** Whether this page may do something. */
  get leads() {
    return this.you !== undefined && this.you === this.leader;
  }

  send(command) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }

  /** Does something to the motion. */
  act(input) {
    this.send({ do: input });
  }

  #connect() {
    const path = `${location.pathname.replace(/\/?$/, "/")}socket`;
    const socket = new WebSocket(`ws://${location.host}${path}`);
    socket.binaryType = "arraybuffer";
    socket.addEventListener("message", ({ data }) => (typeof data === "string" ? this.#told(JSON.parse(data)) : this.#frame(data)));
    socket.addEventListener("close", () => {
      this.you = undefined;
      this.#showLeader();
      element("watching").textContent = "The simulation has ended, or cannot be reached.";
      document.documentElement.dataset.live = "closed";
      setTimeout(() => this.#connect(), AGAIN);
    });
    this.socket = socket;
  }

  #frame(data) {
    const { page, motion } = this;
    const { isRecoloured, isBeyond } = motion.take(data);
    page.player.busy = undefined;
    if (isBeyond && this.hands.holds.size === 0) {
      motion.widen();
      page.renderer.reframe();
      if (!page.touched) page.resetView(page.view);
    }
    if (isRecoloured) page.setColour(page.colour);
    page.player.changed();
    document.documentElement.dataset.live = "open";
  }

  #told(message) {
    const { page } = this;
    const { player } = page;
    if (message.you !== undefined) this.you = message.you;
    if (message.refused) page.say(message.refused);
    if (message.saved) page.say(message.saved);
    if (message.busy) {
      player.busy = message.busy;
      page.controls.showFrame();
    }
    if (!message.status) return;
    const { plays, pace, pins, leader, viewers, knobs, rebuilds, saves, saving, status, solved, stuck } = message.status;
    Object.assign(player, { plays, pace, status, solved, stuck });
    Object.assign(this, { pins, leader, viewers });
    if (stuck) page.say(`The simulation has stopped: ${status}. Go back in time, or start over.`);
    element("save-run").hidden = !saves;
    element("save-run").disabled = saving;
    element("save-run").textContent = saving ? "Saving …" : "Save run";
    for (const part of document.querySelectorAll(".of-rebuilds")) part.hidden = !rebuilds;
    this.#showLeader();
    this.#showKnobs(knobs);
    player.changed();
  }

  #showLeader() {
    const others = (this.viewers ?? 1) - 1;
    const also = others > 0 ? `, ${others} more watching` : "";
    element("watching").textContent = this.leads ? `Drag a rod or a body to move it${also}` : "Another page leads; this one watches";
    for (const part of document.querySelectorAll("#live button, #knobs input, #play, #scrubber, #speed")) {
      if (part.id !== "knobs-open" && part.id !== "save-run") part.disabled = !this.leads;
    }
    element("picture").classList.toggle("holds", this.leads);
  }

  #buttons() {
    const { player } = this.page;
    const pressed = (id, action) => element(id).addEventListener("click", action);
    pressed("step", () => player.step(1));
    pressed("again", () => {
      this.motion.forget();
      this.send("reset");
    });
    pressed("save-run", () => this.send("save"));
    pressed("knobs-open", () => {
      const open = element("knobs").hidden;
      element("knobs").hidden = !open;
      element("knobs-open").setAttribute("aria-expanded", open);
    });
  }

  /** Sliders: what each sends, how a value reads, and where it stands. */
  #knobs() {
    const value = (id) => element(id).valueAsNumber;
    const wind = () => [Math.cos(value("wind-way") * degrees) * value("wind"), Math.sin(value("wind-way") * degrees) * value("wind"), 0];
    // Gravity points down, or up; as it is in the scene, it may point elsewhere.
    const sends = {
      gravity: () => ({ gravity: [0, 0, -value("gravity")] }),
      wind: () => ({ wind: wind() }),
      "wind-way": () => ({ wind: wind() }),
      stiffness: () => ({ stiffness: 10 ** value("stiffness") }),
      damping: () => ({ damping: value("damping") }),
      friction: () => ({ friction: value("friction") }),
    };
    for (const [id, knob] of Object.entries(sends)) {
      element(id).addEventListener("input", () => this.#showOutputs());
      // All but gravity builds the simulation anew.
      element(id).addEventListener(id === "gravity" ? "input" : "change", () => this.act({ set: knob() }));
    }
  }

  #showKnobs({ gravity, wind, stiffness, damping, friction }) {
    const set = (id, value) => document.activeElement !== element(id) && (element(id).value = value);
    set("gravity", -gravity[2]);
    set("wind", norm(wind));
    if (norm(wind) > 0) set("wind-way", Math.atan2(wind[1], wind[0]) / degrees);
    set("stiffness", Math.log10(stiffness));
    set("damping", damping);
    set("friction", friction);
    this.#showOutputs();
  }

  #showOutputs() {
    const value = (id) => element(id).valueAsNumber;
    const texts = {
      gravity: `${formatNumber(value("gravity"), 3)} m/s²`,
      wind: `${formatNumber(value("wind"), 3)} m/s`,
      "wind-way": `${value("wind-way")}° from x`,
      stiffness: `${formatNumber(10 ** value("stiffness"), 2)}×`,
      damping: `+ ${formatNumber(value("damping"), 2)} 1/s`,
      friction: `${formatNumber(value("friction"), 2)}×`,
    };
    for (const [id, text] of Object.entries(texts)) document.querySelector(`output[for="${id}"]`).textContent = text;
  }

  /** Keys and gestures that a recorded motion does not have. */
  #help() {
    const list = document.querySelector("#help dl");
    const rows = [
      ["Drag a rod or a body", "Pull it; let go to release it"],
      ["Drag beside them", "Turn the view"],
      ["Double click, x", "Pin a place, or let it go"],
      ["Drive, arrows, Page ↑ ↓", "Move what is pinned or gripped (Shift: turn it; Esc: end)"],
      ["→, ←", "One step, a quarter of a second back"],
    ];
    list.prepend(...rows.flatMap(([what, does]) => [make("dt", { textContent: what }), make("dd", { textContent: does })]));
  }
}

async function start() {
  const page = new Page(await embedded(LiveMotion), { player: LivePlayer, controls: LiveControls });
  const live = new Live(page);
  window.player = scriptable(page);
  window.live = { motion: live.motion, send: (command) => live.send(command), act: (input) => live.act(input), get leads() { return live.leads; }, get pins() { return live.pins; } };
  document.documentElement.dataset.state = "ready";
}

start().catch(fail);
