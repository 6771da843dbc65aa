// Begins with recorded runs.

async function start() {
  const page = new Page(await embedded());
  window.player = scriptable(page);
  document.documentElement.dataset.state = "ready";
  if (!window.matchMedia("(prefers-reduced-motion: reduce)").matches) page.player.play();
}

start().catch(fail);
