// Just enough of a page for the galleries' script: data on stdin, what it made on stdout.
"use strict";
const vm = require("node:vm");
const { script, data, steps } = JSON.parse(require("node:fs").readFileSync(0, "utf8"));

class Element {
  constructor(name) { Object.assign(this, { name, children: [], listeners: {}, text: "" }); }
  append(...children) { this.children.push(...children); }
  replaceChildren(...children) { this.children = children; }
  setAttribute(name, value) { this[name] = value; }
  set textContent(text) { this.text = String(text); this.children = []; }
  get textContent() { return this.text; }
  all(test) {
    const inner = this.children.filter((child) => child instanceof Element);
    return [...inner.filter(test), ...inner.flatMap((child) => child.all(test))];
  }
  querySelector() { return { textContent: JSON.stringify(data) }; }
  getContext() {
    return {
      createImageData: (width, height) => ({ data: new Uint8ClampedArray(4 * width * height) }),
      putImageData: (image) => { this.pixels = [...image.data]; },
    };
  }
}

const host = new Element("div");
vm.runInNewContext(script, {
  atob, Uint8Array, JSON, Math, Set,
  document: {
    createElement: (name) => new Element(name),
    querySelectorAll: () => [host],
  },
  matchMedia: () => ({ matches: false, addEventListener() {} }),
});

function label(text) {
  return host.all((one) => one.name === "label" && String(one.children[0]).trim() === text)[0];
}

function state() {
  const figures = host.all((one) => one.name === "figure");
  return {
    filters: host.all((one) => one.name === "label").map((one) => one.children[0].trim()),
    captions: figures.map((one) => one.children[1].text),
    titles: figures.map((one) => one.title),
    status: host.all((one) => one.className === "soft")[0].text,
    more: host.all((one) => one.name === "button").map((one) => one.hidden ? "" : one.text)[0],
    pixels: figures[0] ? figures[0].children[0].children[0].pixels : [],
  };
}

const states = [state()];
for (const [what, value, index] of steps) {
  if (what === "more") {
    host.all((one) => one.name === "button")[0].onclick();
  } else {
    const control = label(what).children.filter((child) => child instanceof Element)[index ?? 0];
    const handler = control.name === "select" ? "onchange" : "oninput";
    control[handler]({ target: { value } });
  }
  states.push(state());
}
process.stdout.write(JSON.stringify(states));
