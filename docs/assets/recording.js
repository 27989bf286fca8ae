/* Open a recording in the page: a button on its picture starts rerun's own viewer, whose files lie beside the site. */
(() => {
  const here = document.currentScript.src;

  async function open(place, state) {
    const { default: widget } = await import(new URL("../viewer/widget.js", here));
    const settings = {
      _url: new URL(`../${place.dataset.recording}`, here).href,
      _width: "auto",
      _height: 720,
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
  }

  for (const place of document.querySelectorAll("[data-recording]")) {
    const state = (value) => { place.dataset.state = value; };
    const button = document.createElement("button");
    button.className = "md-button";
    button.textContent = "Open the recording";
    button.onclick = () => {
      button.disabled = true;
      button.textContent = "Loading the viewer ...";
      open(place, state).then(() => button.remove()).catch((error) => {
        state("failed");
        button.textContent = `The viewer does not start: ${error.message}`;
      });
    };
    place.append(button);
    if (location.hash === `#${place.id}`) button.click();
  }
})();
