"use strict";
(() => {
  const SIDE = 30, PLANE = 113, OPENING = 33, MORE = 330;
  const dark = matchMedia("(prefers-color-scheme: dark)");

  // Base64 to bytes.
  function bytes(text) {
    return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  }

  function element(name, properties, ...children) {
    const made = Object.assign(document.createElement(name), properties);
    made.append(...children);
    return made;
  }

  function bit(packed, start, cell) {
    return (packed[start + (cell >> 3)] >> (7 - (cell & 7))) & 1;
  }

  // What can be found of a place; `null` of a count is unknown.
  function places(data) {
    return data.id.map((id, index) => ({
      index, id,
      scenario: data.scenario[index],
      site: data.sites[data.site[index]],
      robot: data.robots[data.robot[index]],
      origin: data.origins[data.origin[index]],
      count: data.count[index],
      traversable: data.traversable[index] ? "yes" : "no",
      chosen: data.chosen[index] ? "yes" : "no",
      occupied: data.occupied[index],
    }));
  }

  const NAMED = ["chosen", "site", "robot", "origin", "traversable"];

  function fits(place, wanted) {
    return NAMED.every((name) => !wanted[name] || place[name] === wanted[name]) &&
      (wanted.least === null || (place.count !== null && place.count >= wanted.least)) &&
      (wanted.most === null || (place.count !== null && place.count <= wanted.most));
  }

  // Unknown counts come last, whichever way round.
  function byCount(sign) {
    return (a, b) => (a.count === null) - (b.count === null) || sign * (a.count - b.count);
  }

  const ORDERS = {
    "as listed": () => 0,
    "highest count first": byCount(-1),
    "lowest count first": byCount(1),
    "fullest first": (a, b) => b.occupied - a.occupied,
    "emptiest first": (a, b) => a.occupied - b.occupied,
    "by site and robot": (a, b) =>
      a.site.localeCompare(b.site) || a.robot.localeCompare(b.robot),
  };

  function draw(canvas, packed, index, colors) {
    const context = canvas.getContext("2d");
    const image = context.createImageData(SIDE, SIDE);
    const cells = 2 * PLANE * index;
    for (let cell = 0; cell < SIDE * SIDE; cell++) {
      const kind = bit(packed, cells, cell) ? 1 : bit(packed, cells + PLANE, cell) ? 0 : 2;
      image.data.set(colors[kind], 4 * cell);
    }
    context.putImageData(image, 0, 0);
  }

  function describe(place, words) {
    return [
      `environment ${place.id}`,
      place.scenario && `scenario ${place.scenario}`,
      place.site && `${place.site} / ${place.robot}`,
      place.count !== null && `${place.count} ${words}`,
      `from ${place.origin}`,
      place.traversable === "no" && "the robot cannot cross it",
    ].filter(Boolean).join(" · ");
  }

  function choice(label, options, onchange) {
    const select = element("select", { onchange }, ...options.map(
      ([value, text]) => element("option", { value, textContent: text })));
    return [select, element("label", {}, `${label} `, select)];
  }

  function show(host) {
    const data = JSON.parse(host.querySelector("script").textContent);
    const packed = bytes(data.cells), all = places(data);
    const wanted = { least: null, most: null }, filters = [];
    let order = "as listed", shown = OPENING;

    const grid = element("div", { className: "places" });
    const status = element("span", { className: "soft" });
    const more = element("button", { type: "button", onclick: () => { shown += MORE; update(); } });
    const detail = element("p", { className: "soft detail" });
    detail.setAttribute("aria-live", "polite");

    function change(name, value) {
      wanted[name] = value;
      shown = OPENING;
      update();
    }

    const WORDS = {
      chosen: ["Chosen", { yes: "chosen", no: "not chosen" }],
      site: ["Site", {}], robot: ["Robot", {}], origin: ["From", {}],
      traversable: ["Can be crossed", {}],
    };
    for (const name of NAMED) {
      const values = [...new Set(all.map((place) => place[name]))].sort();
      if (values.length < 2) continue;
      const [label, words] = WORDS[name];
      const [select, control] = choice(label,
        [["", "all"], ...values.map((value) => [value, words[value] ?? value])],
        (event) => change(name, event.target.value));
      // At first what the page speaks of.
      if (name === "chosen") select.value = wanted.chosen = "yes";
      filters.push(control);
    }
    const counts = all.map((place) => place.count).filter((count) => count !== null);
    if (new Set(counts).size > 1) {
      const bounds = ["least", "most"].map((name) => element("input", {
        type: "number", min: 0, step: "any",
        placeholder: (name === "least" ? Math.min : Math.max).apply(null, counts),
        ariaLabel: `${name} ${data.words}`,
        oninput: (event) => change(name, event.target.value === "" ? null : +event.target.value),
      }));
      filters.push(element("label", {}, "Count ", bounds[0], " to ", bounds[1]));
    }
    const useful = Object.keys(ORDERS).filter((name) =>
      (counts.length || !name.includes("count")) &&
      (data.sites.length > 1 || data.robots.length > 1 || !name.includes("site")));
    const [, sorting] = choice("Sorted", useful.map((name) => [name, name]), (event) => {
      order = event.target.value;
      update();
    });
    filters.push(sorting);

    function figure(place) {
      const words = describe(place, data.words);
      const canvas = element("canvas", { width: SIDE, height: SIDE });
      draw(canvas, packed, place.index, dark.matches ? data.dark : data.light);
      const made = element("figure", { className: "place", title: words, tabIndex: 0 },
        element("span", {}, canvas),
        element("figcaption", { textContent: place.count ?? "" }));
      made.onclick = made.onfocus = () => { detail.textContent = words; };
      return made;
    }

    function update() {
      const found = all.filter((place) => fits(place, wanted)).sort(ORDERS[order]);
      grid.replaceChildren(...found.slice(0, shown).map(figure));
      const left = Math.max(0, found.length - shown);
      status.textContent = `${Math.min(shown, found.length)} of ${found.length} shown`;
      more.textContent = `Show ${Math.min(MORE, left)} more`;
      more.hidden = left === 0;
      detail.textContent = "";
    }

    dark.addEventListener("change", update);
    host.append(element("div", { className: "filters" }, ...filters, status), detail, grid, more);
    update();
  }

  document.querySelectorAll(".gallery").forEach(show);
})();
