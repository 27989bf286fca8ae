/* Open a recording in the page: a button on its picture starts rerun's own viewer, whose files lie beside the site. */
(() => {
  const here = document.currentScript.src;
  const viewer = new URL("../viewer/re_viewer_bg.wasm", here).href;
  const megabytes = (bytes) => `${Math.max(1, Math.round(bytes / 1e6))} MB`;

  async function size(url) {
    const head = await fetch(url, { method: "HEAD" });
    if (!head.ok) return 0;
    return Number(head.headers.get("content-length")) || 0;
  }

  /* What is read here, the viewer then finds in the browser's cache. */
  async function load(url, received) {
    const answer = await fetch(url);
    if (!answer.ok) throw new Error(`${url}: ${answer.status}`);
    const reader = answer.body.getReader();
    for (let part = await reader.read(); !part.done; part = await reader.read()) received(part.value.length);
  }

  async function open(place, recording, state) {
    const { default: widget } = await import(new URL("../viewer/widget.js", here));
    const settings = {
      _url: recording,
      _width: "auto",
      _height: Math.round(0.85 * window.innerHeight),
      _theme: "dark",
      _panel_states: { top: "hidden", blueprint: "hidden", selection: "hidden", time: "collapsed" },
    };
    const model = {
      get: (key) => settings[key],
      on: () => {},
      send: (event) => {
        if (event === "ready") state("ready");
      },
    };
    const element = document.createElement("div");
    element.className = "viewer";
    place.querySelector("img").closest("p").replaceWith(element);
    widget.render({ model, el: element });
    element.scrollIntoView({ block: "center" });
  }

  for (const place of document.querySelectorAll("[data-recording]")) {
    const recording = new URL(`../${place.dataset.recording}`, here).href;
    const state = (value) => { place.dataset.state = value; };
    const button = document.createElement("button");
    button.className = "md-button";
    button.textContent = "Open the recording";
    const bar = document.createElement("progress");
    bar.hidden = true;
    const sizes = Promise.all([viewer, recording].map(size)).catch(() => [0, 0]);
    sizes.then(([program, data]) => {
      if (program && data && !button.disabled) {
        button.textContent = `Open the recording (${megabytes(data)}, and ${megabytes(program)} of viewer once)`;
      }
    });
    button.onclick = async () => {
      button.disabled = true;
      try {
        const whole = (await sizes).reduce((a, b) => a + b);
        let there = 0;
        bar.hidden = false;
        const received = (bytes) => {
          there += bytes;
          if (whole) bar.value = Math.min(1, there / whole);
          button.textContent = `Loading: ${megabytes(there)}${whole ? ` of ${megabytes(Math.max(whole, there))}` : ""}`;
        };
        await Promise.all([load(viewer, received), load(recording, received)]);
        button.textContent = "Starting the viewer ...";
        await open(place, recording, state);
        button.remove();
        bar.remove();
      } catch (error) {
        state("failed");
        bar.remove();
        button.textContent = `The viewer does not start: ${error.message}`;
      }
    };
    place.append(button, bar);
    if (location.hash === `#${place.id}`) button.click();
  }
})();
