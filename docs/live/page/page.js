"use strict";
const of_looks = (() => {
// Colours and marks that the map, the cards and the charts share. They match clearway.colours and viz.figures.

const ZONES = ["#f4f4f1", "#f6b73c", "#c1272d"]; // free, precollision, collision
const ZONE_OPACITY = [0, 0.55, 0.55];
const HATCH_INK = "#5c0f0b";
const WALL = "#3f4650";
const TARGET = "#00876c";
const STANDS = "#ffffff"; // where an agent holds that a body can stand
const GHOST = { colour: "rgb(255 255 255 / 0%)", halo: "#d81b60" }; // where it holds itself to be
const INK = "#22272e";

// First agent, second agent, the user: apart in lightness, and in dashes without colour.
const WALKERS = [
  { colour: "#0b3d91", halo: "#ffffff", dashes: [] },
  { colour: "#3ddc84", halo: "#16351f", dashes: [9, 5] },
  { colour: "#8e2c9c", halo: "#ffffff", dashes: [2.5, 5] },
];

const BY_REWARD = { shortest: WALKERS[0], "collision-aware": WALKERS[1] }; // where both walk, in whatever order: as on the demo's page

// The walkers, each with its `look`.
function withLooks(walkers) {
  const agents = walkers.filter(({ agent }) => agent), own = new Set(agents.map(({ reward }) => BY_REWARD[reward]));
  const differ = own.size === WALKERS.length - 1 && !own.has(undefined);
  return walkers.map((walker, index) => ({ ...walker, look: !walker.agent ? WALKERS[2] : differ ? BY_REWARD[walker.reward] : WALKERS[index] }));
}

// Forward, right, left, backward: Okabe and Ito's colours.
const ACTIONS = [
  { name: "forward", colour: "#0072b2", turn: 0, path: "M12 4l7 8h-4.5v8h-5v-8H5z" },
  { name: "turn right", colour: "#cc79a7", turn: 90, path: "M13 4l7 6-7 6v-4c-4 0-6 2-6 8H3c0-8 4-12 10-12z" },
  { name: "turn left", colour: "#009e73", turn: -90, path: "M11 4l-7 6 7 6v-4c4 0 6 2 6 8h4c0-8-4-12-10-12z" },
  { name: "backward", colour: "#d55e00", turn: 180, path: "M12 20l-7-8h4.5V4h5v8H19z" },
];

const CIVIDIS = [
  [0, 34, 78], [18, 53, 112], [59, 73, 108], [87, 93, 109], [112, 113, 115],
  [138, 134, 120], [165, 156, 116], [195, 179, 105], [225, 204, 85], [254, 232, 56],
];

// A colour for a share from 0 to 1: dark blue to yellow, even in lightness, safe for colour-blind readers.
function heat(share) {
  const place = Math.min(Math.max(share, 0), 1) * (CIVIDIS.length - 1);
  const low = Math.min(Math.floor(place), CIVIDIS.length - 2);
  const mixed = CIVIDIS[low].map((value, i) => Math.round(value + (CIVIDIS[low + 1][i] - value) * (place - low)));
  return `rgb(${mixed.join(" ")})`;
}

// Sharp drawing on any screen: sets the canvas's size in CSS pixels and gives back a pen in those units.
function penOf(canvas, width, height) {
  const density = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * density);
  canvas.height = Math.round(height * density);
  const pen = canvas.getContext("2d");
  pen.setTransform(density, 0, 0, density, 0, 0);
  return pen;
}

// An arrowhead along a heading (degrees, clockwise from upwards), with an edge.
function drawAgent(pen, x, y, size, heading, look) {
  const outline = [[0, -1], [0.78, 0.8], [0, 0.42], [-0.78, 0.8]];
  pen.save();
  pen.translate(x, y);
  pen.rotate((heading * Math.PI) / 180);
  pen.beginPath();
  outline.forEach(([right, down], i) => (i ? pen.lineTo(right * size, down * size) : pen.moveTo(right * size, down * size)));
  pen.closePath();
  pen.lineJoin = "round";
  pen.lineWidth = size * 0.5;
  pen.strokeStyle = look.halo;
  pen.stroke();
  pen.fillStyle = look.colour;
  pen.fill();
  pen.restore();
}

// A star, and a dart ahead of it that shows the heading.
function drawTarget(pen, x, y, size, heading) {
  pen.save();
  pen.translate(x, y);
  pen.lineJoin = "round";
  const fill = () => {
    pen.lineWidth = size * 0.3;
    pen.strokeStyle = "#ffffff";
    pen.stroke();
    pen.fillStyle = TARGET;
    pen.fill();
  };
  if (heading !== undefined) {
    pen.save();
    pen.rotate((heading * Math.PI) / 180);
    pen.beginPath();
    pen.moveTo(0, -1.75 * size);
    pen.lineTo(0.48 * size, -1.15 * size);
    pen.lineTo(-0.48 * size, -1.15 * size);
    pen.closePath();
    fill();
    pen.restore();
  }
  pen.beginPath();
  for (let i = 0; i < 10; i++) {
    const reach = size * (i % 2 ? 0.48 : 1);
    pen.lineTo(reach * Math.sin((i * Math.PI) / 5), -reach * Math.cos((i * Math.PI) / 5));
  }
  pen.closePath();
  fill();
  pen.restore();
}

// A cross: a blocked move.
function drawBump(pen, x, y, size, look) {
  for (const [width, colour] of [[size * 0.95, look.halo], [size * 0.45, look.colour]]) {
    pen.beginPath();
    pen.moveTo(x - size, y - size);
    pen.lineTo(x + size, y + size);
    pen.moveTo(x - size, y + size);
    pen.lineTo(x + size, y - size);
    pen.lineWidth = width;
    pen.strokeStyle = colour;
    pen.lineCap = "round";
    pen.setLineDash([]);
    pen.stroke();
  }
}

// A line with a halo, in the walker's dashes.
function drawLine(pen, points, look, width) {
  pen.lineJoin = "round";
  for (const [thick, colour, dashes, cap] of [
    [width * 1.9, look.halo, [], "round"],
    [width, look.colour, look.dashes.map((dash) => (dash * width) / 3), "butt"],
  ]) {
    pen.beginPath();
    points.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.lineWidth = thick;
    pen.strokeStyle = colour;
    pen.setLineDash(dashes);
    pen.lineCap = cap;
    pen.stroke();
  }
  pen.setLineDash([]);
}

// Diagonal lines for the collision zone.
function hatching(pen) {
  const tile = document.createElement("canvas");
  const side = 8;
  const tilePen = penOf(tile, side, side);
  tilePen.strokeStyle = HATCH_INK;
  tilePen.lineWidth = 1.1;
  tilePen.beginPath();
  for (const offset of [-side, 0, side]) {
    tilePen.moveTo(offset - 1, side + 1);
    tilePen.lineTo(offset + side + 1, -1);
  }
  tilePen.stroke();
  const pattern = pen.createPattern(tile, "repeat");
  const density = window.devicePixelRatio || 1;
  pattern.setTransform(new DOMMatrix().scale(1 / density));
  return pattern;
}

return { ZONES, ZONE_OPACITY, HATCH_INK, WALL, TARGET, STANDS, GHOST, INK, WALKERS, withLooks, ACTIONS, heat, penOf, drawAgent, drawTarget, drawBump, drawLine, hatching };
})();
const of_cards = (() => {
// A card for each walker: its view, its numbers, and what it thinks of the four actions (or buttons to drive by).
const { ACTIONS, drawAgent, penOf } = of_looks;

function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith("data-") || key.startsWith("aria-")) made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...children);
  return made;
}

function icon(path) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  const shape = document.createElementNS("http://www.w3.org/2000/svg", "path");
  shape.setAttribute("d", path);
  svg.append(shape);
  return svg;
}

const NUMBERS = [
  ["steps", "Steps", "steps taken so far"],
  ["collisions", "Collisions", "blocked moves so far"],
  ["to_go", "To go", "steps of a shortest path from here"],
  ["reward", "Reward", "earned by the last step"],
  ["earned", "Earned", "sum of all rewards so far"],
  ["value", "Value", "what the agent expects from here"],
];

function signed(number) {
  const digits = Math.abs(number) >= 1 || number === 0 ? 2 : 3;
  return number.toFixed(digits).replace("-", "−");
}

// The beginning that names share, up to a dash or the like, is the first to go where there is no room.
function sharedBeginning(names) {
  const [first, ...others] = names;
  let end = others.length ? Math.min(...names.map((name) => name.length)) : 0;
  while (end && !(others.every((name) => name.startsWith(first.slice(0, end))) && /[-_. ]/.test(first[end - 1]))) end -= 1;
  return end;
}

function createCard(walker, shared, pictures, onDrive) {
  const swatch = element("canvas", { ariaHidden: "true" });
  const badge = element("span", { className: "badge" });
  const view = element("img", { alt: "" });
  const missing = element("p", { textContent: "no pictures in this scene", hidden: pictures.any });
  view.hidden = !pictures.any;
  view.classList.toggle("coarse", pictures.coarse);
  const fields = NUMBERS.filter(([key]) => walker.values || key !== "value").map(([key, name, title]) => {
    const value = element("dd", { "data-field": key, className: "number" });
    return [key, value, element("div", { title }, element("dt", { textContent: name }), value)];
  });
  const numbers = element("dl", { className: "numbers" }, ...fields.map(([, , row]) => row));
  const bars = ACTIONS.map((action) => {
    const fill = element("div", { className: "fill" }), share = element("span", { className: "share" });
    const name = element("span", { className: "name", textContent: action.name });
    const row = element("li", {}, icon(action.path), name, element("div", { className: "track" }, fill), share);
    return { row, fill, share };
  });
  const below = walker.agent
    ? element("ul", { className: walker.values ? "bars" : "bars untold", "aria-label": walker.values ? "Probabilities of the next action" : "The next action" }, ...bars.map((bar) => bar.row))
    : element(
        "div",
        { className: "drive" },
        ...ACTIONS.map((action, number) => {
          const button = element("button", { type: "button", title: action.name, "aria-label": action.name, "data-action": number }, icon(action.path));
          button.addEventListener("click", () => onDrive(number));
          return button;
        }),
      );
  const parts = [["shared", walker.name.slice(0, shared)], ["own", walker.name.slice(shared)]].filter(([, text]) => text);
  const name = element("h2", { title: `${walker.name}, reward ${walker.reward}` }, ...parts.map(([className, textContent]) => element("span", { className, textContent })));
  const header = element("header", {}, swatch, name, badge);
  const picture = element("div", { className: pictures.any ? "picture" : "picture empty" }, view, missing);
  const inside = element("div", { className: "inside" }, picture, element("div", {}, numbers, below));
  const card = element("article", { className: walker.agent ? "card walker" : "card walker user", "data-walker": walker.name, "aria-label": walker.name }, header, inside);
  swatch.style.width = swatch.style.height = "22px";
  drawAgent(penOf(swatch, 22, 22), 11, 11.5, 7.5, 0, walker.look);

  function show(shown, ended, won) {
    const at = Math.min(shown, walker.steps.length - 1), step = walker.steps[at];
    if (pictures.any) {
      const source = pictures.path(step.state);
      if (view.getAttribute("src") !== source) view.src = source;
      view.alt = `View of ${walker.name} after ${at} steps`;
    }
    card.classList.toggle("bumped", step.blocked && at === shown);
    const said = { ...step, steps: at, reward: at ? signed(step.reward) : "–", earned: signed(step.earned), to_go: step.to_go < 0 ? "no path" : step.to_go, value: step.value === null ? "–" : signed(step.value) };
    for (const [key, value] of fields) value.textContent = said[key];
    badge.className = `badge ${step.reached ? "good" : step.blocked ? "bad" : ""}`;
    badge.textContent = step.reached ? (won ? "winner" : "reached") : step.blocked ? "blocked" : ended && at === walker.steps.length - 1 ? "gave up" : ["free", "precollision", "collision"][step.zone];
    badge.title = step.reached ? (won ? "First at the target" : "The target is reached") : "Zone of the pose";
    bars.forEach((bar, action) => {
      const share = step.probabilities ? step.probabilities[action] : null;
      bar.fill.style.width = `${(share ?? 0) * 100}%`;
      bar.share.textContent = share === null ? "–" : `${(share * 100).toFixed(share >= 0.0995 ? 0 : 1)} %`;
      bar.row.classList.toggle("next", step.next === action);
      bar.row.setAttribute("aria-current", step.next === action);
    });
  }

  return { card, show };
}

return { element, icon, sharedBeginning, createCard };
})();
const of_charts = (() => {
// Small line charts of the episode by step.
const { drawBump, drawLine, penOf } = of_looks;

const LEFT = 48, RIGHT = 8, TOP = 8, BOTTOM = 6;

// Draws `valueOf(step)` (null: nothing) of every walker; a mark stands at the step shown.
function drawChart(canvas, walkers, shown, valueOf, digits) {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return;
  const pen = penOf(canvas, width, height);
  const style = getComputedStyle(document.body);
  const values = walkers.flatMap((walker) => walker.steps.map(valueOf)).filter((value) => value !== null);
  if (!values.length) return;
  const longest = Math.max(10, ...walkers.map((walker) => walker.steps.length - 1));
  let low = Math.min(...values), high = Math.max(...values);
  if (high - low < 10 ** -digits) [low, high] = [low - 10 ** -digits, high + 10 ** -digits];
  const x = (step) => LEFT + ((width - LEFT - RIGHT) * step) / longest;
  const y = (value) => height - BOTTOM - ((height - TOP - BOTTOM) * (value - low)) / (high - low);
  pen.font = `11px ${style.fontFamily}`;
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  pen.lineWidth = 1;
  for (const value of [low, high]) {
    pen.fillStyle = style.getPropertyValue("--soft");
    pen.fillText(value.toFixed(digits).replace("-", "−"), LEFT - 6, y(value));
    line(pen, LEFT, y(value), width - RIGHT, y(value), style.getPropertyValue("--line"));
  }
  line(pen, x(shown), TOP - 4, x(shown), height - BOTTOM + 4, style.getPropertyValue("--soft"));
  walkers.forEach((walker) => {
    const points = walker.steps.map((step, at) => [x(at), valueOf(step)]).filter(([, value]) => value !== null);
    if (!points.length) return;
    const { look } = walker;
    drawLine(pen, points.map(([px, value]) => [px, y(value)]), look, 2.2);
    walker.steps.forEach((step, at) => step.blocked && valueOf(step) !== null && drawBump(pen, x(at), y(valueOf(step)), 3, look));
    const [lastX, lastValue] = points[Math.min(shown, points.length - 1)];
    pen.beginPath();
    pen.arc(lastX, y(lastValue), 4, 0, 2 * Math.PI);
    pen.fillStyle = look.colour;
    pen.strokeStyle = look.halo;
    pen.lineWidth = 3;
    pen.stroke();
    pen.fill();
  });
}

function line(pen, fromX, fromY, toX, toY, colour) {
  pen.beginPath();
  pen.moveTo(fromX, fromY);
  pen.lineTo(toX, toY);
  pen.strokeStyle = colour;
  pen.stroke();
}

return { drawChart };
})();
const of_saved = (() => {
// A saved page: episodes that were recorded stand in for the viewer. What they are is in data.js, by view/saved.py.

const saved = window.CLEARWAY_SAVED ?? null;

// Answers as the viewer does, from what was recorded.
function openSaved() {
  let episode = null, at = 0;

  // Of some poses the one nearest to a pose, a turn apart counting as half a cell.
  function nearest(scene, states, wanted) {
    const { locations_m, headings_deg, cell_size_m } = saved.files[`scenes/${scene}/map.json`];
    if (!locations_m[wanted]) return states[0];
    const apart = (state) => {
      const [dx, dz] = [0, 1].map((axis) => locations_m[state][axis] - locations_m[wanted][axis]);
      const turn = Math.abs(((headings_deg[state] - headings_deg[wanted] + 540) % 360) - 180);
      return Math.hypot(dx, dz) / cell_size_m + turn / 180;
    };
    return states.reduce((best, state) => (apart(state) < apart(best) ? state : best));
  }

  // The episode that is asked for, or of those recorded the nearest; without a start another one than before.
  function chosen(query) {
    const wanted = new URLSearchParams(query), names = saved.files["stage.json"].scenes;
    const scene = wanted.has("scene") ? names.indexOf(wanted.get("scene")) : saved.episodes[0].begun.scene;
    const here = saved.episodes.filter(({ begun }) => begun.scene === scene);
    if (!here.length) return null;
    const targets = here.map(({ begun }) => begun.target);
    const target = wanted.has("target") ? nearest(scene, targets, Number(wanted.get("target"))) : targets[0];
    const fits = here.filter(({ begun }) => begun.target === target);
    if (wanted.has("start")) {
      const start = nearest(scene, fits.map(({ begun }) => begun.start), Number(wanted.get("start")));
      return fits.find(({ begun }) => begun.start === start);
    }
    return fits[(fits.indexOf(episode) + 1) % fits.length];
  }

  function begin(query) {
    const found = chosen(query);
    if (!found) return { kind: "refused", text: "No such scene was saved here" };
    [episode, at] = [found, 0];
    const { begun } = episode; // its walkers' steps are added to, so the page gets its own
    return { ...begun, walkers: begun.walkers.map((walker) => ({ ...walker, steps: [...walker.steps] })) };
  }

  function step() {
    const { link } = episode.begun, told = episode.steps[at++];
    return told ? { kind: "steps", ...told, link } : { kind: "refused", text: "The recording ends here" };
  }

  return {
    async ask(message) {
      if (message.do === "begin") return begin(message.episode);
      if (message.do === "step") return step();
      if (message.do === "map") return saved.minds[`${episode.begun.scene} ${episode.begun.target} ${message.walker}`];
      return { kind: "refused", text: "A saved page only plays" };
    },
  };
}

return { saved, openSaved };
})();
const of_connection = (() => {
// Talks to the viewer: one question at a time over the WebSocket, answers in order.
const { saved } = of_saved;

const TOO_MANY_PAGES = 4001; // a code of the viewer's own

async function fetched(path) {
  if (saved) return saved.files[path];
  const response = await fetch(path);
  if (!response.ok) throw new Error(`${path}: ${response.status}`);
  return response.json();
}

// `onLost(reason)` is told why the viewer closed the connection, null where it ended.
function connect(onLost) {
  const address = new URL("live", location.href);
  address.protocol = "ws:";
  address.hash = "";
  const socket = new WebSocket(address);
  const waiting = [];
  const open = new Promise((resolve) => socket.addEventListener("open", resolve, { once: true }));
  socket.addEventListener("message", (event) => waiting.shift()(JSON.parse(event.data)));
  socket.addEventListener("close", ({ code, reason }) => onLost(code === TOO_MANY_PAGES ? reason : null));
  return {
    // Resolves to the answer; a refused question resolves too, with `kind` "refused".
    async ask(message) {
      await open;
      if (socket.readyState !== WebSocket.OPEN) return new Promise(() => {});
      return new Promise((resolve) => {
        waiting.push(resolve);
        socket.send(JSON.stringify(message));
      });
    },
  };
}

return { fetched, connect };
})();
const of_keys = (() => {
// The page by keyboard alone; what has the focus keeps the keys that it knows itself.

const LAYERS = { 1: "zones", 2: "value", 3: "policy", 4: "held" };
const DRIVE = { ArrowUp: 0, ArrowRight: 1, ArrowLeft: 2, ArrowDown: 3 };

function listenToKeys(acts) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    const { key, target } = event, onControl = target.closest("input, select");
    if (key in DRIVE) {
      if (onControl || target.id === "map") return;
      acts.drive(DRIVE[key]);
    } else if (key === " ") {
      if (onControl || target.closest("button, a")) return;
      acts.play();
    } else if (key in LAYERS) acts.chooseLayer(LAYERS[key]);
    else if (key === "+" || key === "=") acts.setSpeed(1);
    else if (key === "-") acts.setSpeed(-1);
    else {
      const act = { n: acts.step, b: acts.back, r: acts.restart, s: acts.newStart, d: acts.race, l: acts.copyLink, m: acts.toMap, "?": acts.help }[key.toLowerCase()];
      if (!act || target.closest("select")) return;
      act();
    }
    event.preventDefault();
  });
}

return { listenToKeys };
})();
const of_legend = (() => {
// What the map's colours mean, in words, for the layer shown.
const { element } = of_cards;
const { ACTIONS, GHOST, STANDS, TARGET, WALKERS, ZONES, ZONE_OPACITY, drawAgent, drawBump, drawTarget, hatching, heat, penOf } = of_looks;

function swatch(width, height, paint) {
  const canvas = element("canvas", { ariaHidden: "true" });
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  paint(penOf(canvas, width, height), width, height);
  return canvas;
}

function zoneSwatch(zone) {
  return swatch(18, 14, (pen, width, height) => {
    pen.fillStyle = "#ffffff";
    pen.fillRect(0, 0, width, height);
    pen.globalAlpha = ZONE_OPACITY[zone] + 0.1;
    pen.fillStyle = ZONES[zone];
    pen.fillRect(0, 0, width, height);
    if (zone === 2) {
      pen.fillStyle = hatching(pen);
      pen.fillRect(0, 0, width, height);
    }
  });
}

function entry(mark, text) {
  return element("span", {}, mark, text);
}

const marks = () => [
  entry(swatch(18, 18, (pen) => drawTarget(pen, 9, 9.5, 6.5)), "target"),
  entry(swatch(16, 16, (pen) => drawBump(pen, 8, 8, 3.6, WALKERS[0])), "blocked move"),
];

function showLegend(place, layer) {
  if (layer.kind === "zones") {
    place.replaceChildren(entry(zoneSwatch(2), "collision zone"), entry(zoneSwatch(1), "precollision zone"), ...marks());
  } else if (layer.kind === "held") {
    const filled = (colour) => swatch(18, 14, (pen, width, height) => {
      pen.fillStyle = "#5d646c";
      pen.fillRect(0, 0, width, height);
      pen.fillStyle = colour;
      pen.fillRect(3, 2, width - 6, height - 4);
    });
    const own = entry(swatch(18, 18, (pen) => drawAgent(pen, 9, 9.5, 6, 0, GHOST)), "it holds itself to be here");
    place.replaceChildren(entry(filled(STANDS), "can stand here"), entry(filled(TARGET), "target may be here"), own, ...marks());
  } else if (layer.kind === "value") {
    const scale = swatch(140, 12, (pen, width, height) => {
      for (let x = 0; x < width; x++) {
        pen.fillStyle = heat(x / (width - 1));
        pen.fillRect(x, 0, 1.5, height);
      }
    });
    const [low, high] = layer.range.map((value) => value.toFixed(2).replace("-", "−"));
    place.replaceChildren(element("span", {}, `value ${low}`, scale, high), ...marks());
  } else {
    const entries = ACTIONS.map((action) =>
      entry(swatch(16, 14, (pen, width, height) => {
        pen.fillStyle = action.colour;
        pen.fillRect(0, 0, width, height);
      }), action.name));
    place.replaceChildren(...entries, element("span", {}, "stronger: more probable"));
  }
}

return { showLegend };
})();
const of_map = (() => {
// The map: the room from above, its zones or what an agent thinks of every pose, and the ways walked so far.
const { ACTIONS, GHOST, INK, STANDS, TARGET, WALL, ZONES, ZONE_OPACITY, drawAgent, drawBump, drawLine, drawTarget, hatching, heat, penOf } = of_looks;

const VEIL = "rgb(255 255 255 / 45%)"; // over the cells in the picture from above
const SHADE = "rgb(29 35 41 / 62%)"; // over the room, where an agent's belief is shown
const CELL_SHARE = 0.94;
const STAR = 0.27, STAR_MET = 0.44, ARROW = 0.24, ARROW_MET = 0.13; // of a cell; the second where they meet: neither hides the other
const LOWEST_PX = 220, LARGEST_CELL_PX = 90;

// `onPick(state, what)` is told of a pose chosen as "start" or "target" (null: as the page says); `onCursor(state)` of
// the pose that the keyboard's cursor is on, null when the map loses the focus.
function createMap(canvas, onPick, onCursor) {
  const ground = document.createElement("canvas"); // all that stays the same from step to step
  let scene = null, above = null, layer = { kind: "zones" }, shown = null, cursor = null;
  let scale = 1, width = 0, height = 0;

  const place = (x, z) => [(x - scene.extent_m[0]) * scale, (scene.extent_m[3] - z) * scale];
  const at = (state) => place(...scene.locations_m[state]);

  // The point so far ahead of a pose, and to its right, in cells.
  const beside = (state, ahead, right) => besideAt(at(state), scene.headings_deg[state], ahead, right);

  function besideAt([x, y], heading, ahead, right) {
    const turn = (heading * Math.PI) / 180, side = scene.cell_size_m * scale;
    return [x + side * (ahead * Math.sin(turn) + right * Math.cos(turn)), y - side * (ahead * Math.cos(turn) - right * Math.sin(turn))];
  }

  const triangle = (pen, state) => triangleAt(pen, at(state), scene.headings_deg[state], scene.turn_deg);

  function triangleAt(pen, middle, heading, turn) {
    const reach = CELL_SHARE / 2, aside = reach * Math.tan((turn * Math.PI) / 360);
    pen.moveTo(...middle);
    pen.lineTo(...besideAt(middle, heading, reach, aside));
    pen.lineTo(...besideAt(middle, heading, reach, -aside));
    pen.closePath();
  }

  function fit() {
    const [left, right, low, high] = scene.extent_m;
    const room = canvas.parentElement.clientWidth;
    const tallest = Math.max(window.innerHeight - (window.innerWidth > 990 ? 300 : 260), LOWEST_PX);
    scale = Math.min(room / (right - left), tallest / (high - low), LARGEST_CELL_PX / scene.cell_size_m);
    width = Math.round((right - left) * scale);
    height = Math.round((high - low) * scale);
    canvas.style.width = `${width}px`;
    canvas.style.height = `${height}px`;
  }

  function paintGround() {
    const pen = penOf(ground, width, height), side = scene.cell_size_m * scale;
    pen.fillStyle = WALL;
    pen.fillRect(0, 0, width, height);
    if (above) pen.drawImage(above, 0, 0, width, height);
    pen.strokeStyle = "#ffffff";
    pen.lineWidth = 0.8;
    pen.fillStyle = layer.kind === "held" ? SHADE : above ? VEIL : ZONES[0];
    if (layer.kind === "held") return pen.fillRect(0, 0, width, height);
    for (const state of scene.firstOfCell) {
      const [x, y] = at(state);
      pen.fillRect(x - side / 2, y - side / 2, side, side);
      pen.strokeRect(x - side / 2, y - side / 2, side, side);
    }
    if (layer.kind === "zones") paintZones(pen);
    else if (layer.kind === "value") paintValues(pen);
    else paintPolicy(pen, side);
  }

  // What an agent with a map holds: light where it can stand, green where the target may be, hollow where it is itself.
  function paintHeld(pen, held) {
    const side = scene.cell_size_m * scale;
    for (const [x, z, stands] of held.cells) {
      const [left, top] = place(x, z);
      pen.globalAlpha = 0.72 * stands;
      pen.fillStyle = STANDS;
      pen.fillRect(left - side / 2 + 0.5, top - side / 2 + 0.5, side - 1, side - 1);
    }
    const most = Math.max(...held.target.map(([, , , share]) => share), 0.05);
    for (const [x, z, heading, share] of held.target) {
      pen.globalAlpha = 0.15 + 0.75 * (share / most);
      pen.beginPath();
      triangleAt(pen, place(x, z), heading, 90);
      pen.fillStyle = TARGET;
      pen.fill();
    }
    for (const [x, z, heading, share] of held.here) {
      pen.globalAlpha = Math.max(share, 0.2);
      drawAgent(pen, ...place(x, z), side * 0.34, heading, GHOST);
    }
    pen.globalAlpha = 1;
  }

  function paintZones(pen) {
    const hatch = hatching(pen);
    for (const zone of [1, 2]) {
      pen.beginPath();
      scene.zones.forEach((own, state) => own === zone && triangle(pen, state));
      pen.globalAlpha = ZONE_OPACITY[zone];
      pen.fillStyle = ZONES[zone];
      pen.fill();
      if (zone === 2) {
        pen.fillStyle = hatch;
        pen.fill();
      }
      pen.globalAlpha = 1;
    }
  }

  function paintValues(pen) {
    const [low, high] = layer.range;
    layer.values.forEach((value, state) => {
      pen.beginPath();
      triangle(pen, state);
      pen.fillStyle = heat((value - low) / Math.max(high - low, 1e-9));
      pen.fill();
    });
  }

  function paintPolicy(pen, side) {
    layer.probabilities.forEach((shares, state) => {
      const best = shares.indexOf(Math.max(...shares)), sure = (shares[best] - 0.25) / 0.75;
      pen.beginPath();
      triangle(pen, state);
      pen.globalAlpha = 0.25 + 0.7 * Math.max(sure, 0);
      pen.fillStyle = ACTIONS[best].colour;
      pen.fill();
      pen.globalAlpha = 1;
      const room = side * Math.min(0.15, 0.3 * Math.tan((scene.turn_deg * Math.PI) / 360));
      if (room < 3) return;
      const [x, y] = beside(state, 0.32, 0);
      pen.save();
      pen.translate(x, y);
      pen.rotate(((scene.headings_deg[state] + ACTIONS[best].turn) * Math.PI) / 180);
      pen.beginPath();
      pen.moveTo(0, -room * 0.8);
      pen.lineTo(room * 0.7, room * 0.6);
      pen.lineTo(-room * 0.7, room * 0.6);
      pen.closePath();
      pen.fillStyle = "#ffffff";
      pen.fill();
      pen.restore();
    });
  }

  function draw() {
    if (!scene || !shown || !width) return;
    const pen = penOf(canvas, width, height), side = scene.cell_size_m * scale;
    pen.drawImage(ground, 0, 0, width, height);
    const seer = layer.kind === "held" ? shown.walkers[layer.mind] : null;
    if (seer) paintHeld(pen, seer.steps[Math.min(shown.step, seer.steps.length - 1)].held);
    const there = (state) => scene.cells[state] === scene.cells[shown.target];
    const met = shown.walkers.some(({ steps }) => there(steps[Math.min(shown.step, steps.length - 1)].state));
    drawTarget(pen, ...at(shown.target), side * (met ? STAR_MET : STAR), scene.headings_deg[shown.target]);
    const lanes = shown.walkers.map((_, i) => (i - (shown.walkers.length - 1) / 2) * side * 0.13);
    const thick = Math.min(Math.max(side * 0.08, 2), 5);
    shown.walkers.forEach((walker, i) => {
      const { look } = walker, steps = walker.steps.slice(0, shown.step + 1);
      const moved = (state, ahead = 0) => beside(state, ahead, 0).map((value) => value + lanes[i]);
      const points = steps.map((step) => moved(step.state));
      if (points.length > 1) drawLine(pen, points, look, thick);
      dot(pen, points[0], thick * 1.5, look);
    });
    shown.walkers.forEach((walker, i) => {
      const { look } = walker, steps = walker.steps.slice(0, shown.step + 1);
      for (const step of steps.filter((each) => each.blocked)) {
        const [x, y] = beside(step.state, step.action === 3 ? -0.5 : 0.5, 0);
        drawBump(pen, x + lanes[i], y + lanes[i], side * 0.09, look);
      }
      const last = steps.at(-1), [x, y] = at(last.state);
      drawAgent(pen, x + lanes[i], y + lanes[i], side * (there(last.state) ? ARROW_MET : ARROW), scene.headings_deg[last.state], look);
    });
    if (cursor !== null && document.activeElement === canvas) drawCursor(pen);
  }

  function dot(pen, [x, y], radius, look) {
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fillStyle = look.colour;
    pen.strokeStyle = look.halo;
    pen.lineWidth = radius * 0.7;
    pen.stroke();
    pen.fill();
  }

  function drawCursor(pen) {
    for (const [colour, thick] of [["#ffffff", 5], [INK, 2.5]]) {
      pen.beginPath();
      triangle(pen, cursor);
      pen.lineWidth = thick;
      pen.lineJoin = "round";
      pen.strokeStyle = colour;
      pen.stroke();
    }
  }

  // The pose at a point: of the cell there, the heading that the point lies towards.
  function poseAt(x, y) {
    const reach = (scene.cell_size_m * scale) / 2;
    let best = null, least = Infinity;
    scene.locations_m.forEach((_, state) => {
      const [cx, cy] = at(state);
      if (Math.max(Math.abs(x - cx), Math.abs(y - cy)) > reach) return;
      const towards = (Math.atan2(x - cx, cy - y) * 180) / Math.PI;
      const apart = Math.abs(((scene.headings_deg[state] - towards + 540) % 360) - 180);
      if (apart < least) [best, least] = [state, apart];
    });
    return best;
  }

  canvas.addEventListener("click", (event) => {
    const box = canvas.getBoundingClientRect();
    const state = poseAt(event.clientX - box.left, event.clientY - box.top);
    if (state !== null) onPick(state, event.shiftKey ? "target" : null);
  });

  canvas.addEventListener("keydown", (event) => {
    const way = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] }[event.key];
    const turn = { PageUp: -1, PageDown: 1 }[event.key];
    if (way) moveCursor(...way);
    else if (turn) turnCursor(turn);
    else if (event.key === "Enter" && cursor !== null) onPick(cursor, "start");
    else if (event.key.toLowerCase() === "t" && cursor !== null) onPick(cursor, "target");
    else return;
    event.preventDefault();
    event.stopPropagation();
    onCursor(cursor);
    draw();
  });
  canvas.addEventListener("focus", () => {
    onCursor(cursor);
    draw();
  });
  canvas.addEventListener("blur", () => {
    onCursor(null);
    draw();
  });

  // To the nearest cell in that direction, keeping the heading.
  function moveCursor(dx, dz) {
    const [x, z] = scene.locations_m[cursor];
    let best = cursor, least = Infinity;
    scene.locations_m.forEach(([otherX, otherZ], state) => {
      const along = (otherX - x) * dx + (otherZ - z) * dz, aside = Math.abs((otherX - x) * dz) + Math.abs((otherZ - z) * dx);
      const apart = along + 2 * aside;
      if (along > 1e-6 && apart < least && scene.headings_deg[state] === scene.headings_deg[cursor]) [best, least] = [state, apart];
    });
    cursor = best;
  }

  function turnCursor(turn) {
    const wanted = (scene.headings_deg[cursor] + turn * scene.turn_deg + 360) % 360;
    const here = scene.cells[cursor];
    const found = scene.cells.findIndex((cell, state) => cell === here && Math.abs(scene.headings_deg[state] - wanted) < 1);
    if (found >= 0) cursor = found;
  }

  function refresh() {
    if (!scene) return;
    fit();
    paintGround();
    draw();
  }

  return {
    // All at once, after the wait; ways and target of the scene before go, `show` brings this one's.
    async setScene(json, picturePath) {
      const picture = json.has_above ? new Image() : null;
      if (picture) {
        picture.src = picturePath;
        await picture.decode();
      }
      above = picture;
      shown = null;
      layer = { kind: "zones" };
      scene = { ...json, firstOfCell: [] };
      json.cells.forEach((cell, state) => (scene.firstOfCell[cell] ??= state));
      cursor = 0;
      refresh();
    },
    setLayer(next) {
      layer = next;
      refresh();
    },
    show(next) {
      if (!shown || next.start !== shown.start) cursor = next.start;
      shown = next;
      draw();
    },
    refresh,
  };
}

return { createMap };
})();
const of_verdict = (() => {
// Who wins a race: who arrives first; of those who arrive together, the one with the fewest collisions.

const counted = (count, noun) => `${count} ${noun}${count === 1 ? "" : "s"}`;

// The winner's `index` (null: a tie) and what to say, by the indices of those who arrived first; null for none of them.
function verdict(walkers, first) {
  if (!first.length) return null;
  const bumps = (index) => walkers[index].steps.at(-1).collisions, least = Math.min(...first.map(bumps));
  const best = first.filter((index) => bumps(index) === least), names = best.map((index) => walkers[index].name);
  if (best.length > 1) return { index: null, text: `A tie: ${names.join(" and ")}` };
  const why = first.length > 1 ? `with fewer collisions (${least})` : `in ${counted(walkers[best[0]].steps.length - 1, "step")}`;
  return { index: best[0], text: `${names[0] === "you" ? "You win" : `${names[0]} wins`}, ${why}` };
}

return { counted, verdict };
})();
const of_app = (() => {
// The page: holds what is known of the episode, asks the viewer for more, and shows it.
const { createCard, element, sharedBeginning } = of_cards;
const { drawChart } = of_charts;
const { connect, fetched } = of_connection;
const { listenToKeys } = of_keys;
const { showLegend } = of_legend;
const { withLooks } = of_looks;
const { createMap } = of_map;
const { openSaved, saved } = of_saved;
const { counted, verdict } = of_verdict;

const $ = (id) => document.getElementById(id);
const STEPS_PER_S = [1, 2, 4, 8, 16, 30];
const STATUS_MS = 6000;

const known = { stage: null, scene: null, sceneIndex: -1, episode: null, walkers: [], ended: [], cards: [], pictures: null, minds: new Map(), link: "", first: [] };
let shown = 0; // the step looked at
let playing = false;
let turn = 0; // of playing: an older loop notices that it is over
let asked = Promise.resolve(); // done when the last question's answer is taken in

const map = createMap($("map"), pick, (state) => ($("cursor").textContent = state === null ? "" : `Cursor: ${nameOf(state)}`));
const viewer = saved ? openSaved() : connect((reason) => say(reason ?? "The viewer has ended. Start it again, then load its new address.", true, false));

async function start() {
  known.stage = await fetched("stage.json");
  $("scene").replaceChildren(...known.stage.scenes.map((name) => element("option", { value: name, textContent: name.replaceAll("_", " ") })));
  $("mind").replaceChildren(...known.stage.agents.map((agent, index) => element("option", { value: index, textContent: agent.name })));
  const some = { agent: known.stage.agents.length > 0, values: known.stage.agents.some(({ values }) => values), map: known.stage.agents.some((agent) => agent.map) };
  for (const [what, there] of Object.entries(some)) for (const part of document.querySelectorAll(`.needs-${what}`)) part.hidden = !there;
  for (const part of document.querySelectorAll(".needs-viewer")) part.hidden ||= Boolean(saved);
  if (some.map) document.querySelector("input[name=layer][value=held]").checked = true;
  $("scene-field").hidden = known.stage.scenes.length < 2;
  document.title = `clearway: ${known.stage.agents.map((agent) => agent.name).join(", ") || known.stage.scenes[0]}`;
  $("speed").dispatchEvent(new Event("input"));
  await load(location.hash.slice(1));
}

// Who walks where, in words: the page's title.
function titled() {
  const names = known.stage.agents.map(({ name }) => name), room = known.scene.name.replaceAll("_", " ");
  const walking = names.length ? `${names.join(" and ")}, to where the target's picture was taken` : "a walk to where the target's picture was taken";
  $("about").textContent = `${room}: ${walking}${saved ? " (recorded)" : ""}`;
}

async function load(query) {
  if (!(await ask({ do: "begin", episode: query }))) await ask({ do: "begin", episode: "" });
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (known.episode?.recorded && !still) play(true);
}

// A new episode like this one but for what `changes` say; without a start in them it begins where this one did.
async function begin(changes = {}) {
  play(false);
  const { scene, start, target, selection, seed, drive } = known.episode;
  const next = { scene: known.stage.scenes[scene], start, target, selection, seed, drive: drive ? 1 : 0, ...changes };
  for (const name of Object.keys(next)) if (next[name] === null) delete next[name];
  await ask({ do: "begin", episode: new URLSearchParams(next).toString() });
}

async function pick(state, put) {
  const what = put ?? document.querySelector("input[name=put]:checked").value, before = known.episode[what];
  await begin({ [what]: state });
  if (saved) say(`Nearest recorded ${what}: ${nameOf(known.episode[what])}${known.episode[what] === before ? ", as before" : ""}`);
}

function nameOf(state) {
  const { headings_deg, zones } = known.scene;
  return `pose ${state}, heading ${headings_deg[state]}°, ${["free", "precollision", "collision"][zones[state]]} zone`;
}

// Asks, takes in the answer, and says whether it was not refused; the next question waits until that is done.
function ask(message) {
  return (asked = asked.catch(() => {}).then(() => askNow(message)));
}

async function askNow(message) {
  const answer = await viewer.ask(message);
  if (answer.kind === "refused") {
    say(answer.text, true);
    return false;
  }
  await { episode: takeEpisode, steps: takeSteps, map: takeMind }[answer.kind](answer);
  return true;
}

async function takeEpisode(answer) {
  const before = known.episode;
  if (answer.scene !== known.sceneIndex) {
    const scene = await fetched(`scenes/${answer.scene}/map.json`);
    await map.setScene(scene, `scenes/${answer.scene}/above.jpg`);
    Object.assign(known, { scene, sceneIndex: answer.scene });
    titled();
    showSensors();
  }
  Object.assign(known, { episode: answer, walkers: withLooks(answer.walkers), ended: answer.ended, link: answer.link, first: [] });
  if (!before || before.scene !== answer.scene || before.target !== answer.target) known.minds.clear();
  shown = 0;
  $("scene").value = known.scene.name;
  $("selection").value = answer.selection;
  $("race").setAttribute("aria-pressed", answer.drive);
  const pictures = {
    any: known.scene.has_pictures,
    coarse: known.scene.has_pictures && known.scene.picture_shape[0] < 90,
    path: (state) => `scenes/${answer.scene}/${$("sensor").value || "views"}/${state}.jpg`,
  };
  known.pictures = pictures;
  const shared = sharedBeginning(known.stage.agents.map(({ name }) => name));
  known.cards = known.walkers.map((walker, index) => createCard({ ...walker, values: known.stage.agents[index]?.values }, walker.agent ? shared : 0, pictures, drive));
  $("walkers").replaceChildren(...known.cards.map(({ card }) => card));
  showTarget(pictures);
  await showLayer(askNow);
  show();
  keepLink();
}

// What may be seen by: colour, and sensors with one number a pixel, each drawn in grey over its range.
function showSensors() {
  const { sensors } = known.scene, before = $("sensor").value;
  const named = ({ name, low, high, unit }) => `${name}, ${low} to ${high} ${unit}`;
  $("sensor").replaceChildren(
    element("option", { value: "", textContent: "colour" }),
    ...sensors.map((sensor) => element("option", { value: sensor.name, textContent: named(sensor) })),
  );
  $("sensor").value = sensors.some(({ name }) => name === before) ? before : "";
  $("sensor-field").hidden = !sensors.length;
}

function takeSteps(answer) {
  answer.steps.forEach((step, index) => step && known.walkers[index].steps.push(step));
  const arrived = answer.steps.flatMap((step, index) => (step?.reached ? [index] : []));
  Object.assign(known, { ended: answer.ended, link: answer.link });
  if (!known.first.length) known.first = arrived; // of a race: who arrives later has lost
  shown = last();
  if (arrived.length) say([...arrived.map((index) => arrival(known.walkers[index])), winner()?.text].filter(Boolean).join(". "));
  show();
  if (!playing) keepLink();
  return answer.steps.some((step) => step);
}

function takeMind(answer) {
  known.minds.set(answer.walker, answer);
}

const arrival = ({ name, steps }) => `${name}: target reached in ${counted(steps.length - 1, "step")}, ${counted(steps.at(-1).collisions, "collision")}`;
const winner = () => (known.walkers.length > 1 ? verdict(known.walkers, known.first) : null);
const last = () => Math.max(...known.walkers.map((walker) => walker.steps.length - 1));
const over = () => known.ended.every((ended, index) => ended || (!known.walkers[index].agent && known.walkers.length > 1));

function show() {
  const end = last(), won = winner()?.index;
  known.cards.forEach(({ show: showCard }, index) => showCard(shown, known.ended[index], won === index));
  map.show({ walkers: known.walkers, target: known.episode.target, start: known.episode.start, step: shown });
  $("timeline").max = end;
  $("timeline").value = shown;
  $("position").textContent = `${shown} / ${end}`;
  $("back").disabled = shown === 0;
  showCharts();
}

function showCharts() {
  drawChart($("value-chart"), known.walkers, shown, (step) => step.value, 2);
  drawChart($("distance-chart"), known.walkers, shown, (step) => (step.to_go < 0 ? null : step.to_go), 0);
}

function showTarget(pictures) {
  const { target } = known.episode, heading = (state) => `pose ${state}, heading ${known.scene.headings_deg[state]}°`;
  $("goal-picture").hidden = !pictures.any;
  $("goal-missing").hidden = pictures.any;
  $("goal-picture").classList.toggle("coarse", pictures.coarse);
  if (pictures.any) {
    $("goal-picture").src = pictures.path(target);
    $("goal-picture").alt = `Picture of the target, ${heading(target)}`;
  }
  const trained = known.stage.agents[0]?.values ? ((known.scene.trained ?? known.scene.targets).includes(target) ? ", trained on" : ", not trained on") : "";
  $("goal-where").textContent = heading(target) + trained;
  const focused = $("targets").contains(document.activeElement);
  $("targets").replaceChildren(
    ...known.scene.targets.map((state) => {
      const inside = pictures.any ? element("img", { src: pictures.path(state), alt: "" }) : String(state);
      const button = element("button", { type: "button", "aria-pressed": state === target, "aria-label": `Target ${heading(state)}`, title: heading(state) }, inside);
      button.addEventListener("click", () => begin({ target: state }));
      return button;
    }),
  );
  if (focused) $("targets").querySelector("[aria-pressed=true]")?.focus();
}

const chosenLayer = () => document.querySelector("input[name=layer]:checked").value;

async function showLayer(asking = ask) {
  const kind = chosenLayer(), mind = Number($("mind").value);
  const ofPoses = kind === "value" || kind === "policy";
  $("mind-field").hidden = kind === "zones" || known.stage.agents.length < 2;
  if (ofPoses && !known.minds.has(mind)) await asking({ do: "map", walker: mind });
  if (kind !== chosenLayer() || mind !== Number($("mind").value)) return; // another was chosen meanwhile
  const { values, probabilities } = known.minds.get(mind) ?? {};
  const layer = { kind, mind, values, probabilities, range: values && [Math.min(...values), Math.max(...values)] };
  map.setLayer(layer);
  showLegend($("legend"), layer);
}

async function play(on) {
  const mine = ++turn;
  playing = on;
  document.body.classList.toggle("playing", on);
  $("play").setAttribute("aria-label", on ? "Pause" : "Play");
  if (!on) return keepLink();
  if (shown === last() && over()) await rewind();
  while (turn === mine) {
    const due = performance.now() + 1000 / STEPS_PER_S[$("speed").value];
    if (!(await forward())) return turn === mine ? play(false) : undefined;
    await new Promise((resolve) => setTimeout(resolve, Math.max(due - performance.now(), 0)));
  }
}

// One step further: what has been seen before first, then a new one. False where the episode is over.
async function forward() {
  if (shown < last()) {
    shown += 1;
    show();
    return true;
  }
  if (over()) return false;
  const before = last();
  return (await ask({ do: "step" })) && last() > before;
}

async function rewind() {
  shown = 0;
  show();
}

async function step() {
  play(false);
  await forward();
}

function back() {
  play(false);
  shown = Math.max(shown - 1, 0);
  show();
}

async function drive(action) {
  if (!known.episode.drive) return;
  shown = last();
  await ask({ do: "drive", action, along: !playing });
}

function keepLink() {
  try {
    if (known.link) history.replaceState(null, "", `#${known.link}`);
  } catch {
    return; // some browsers take only so many in a while; a later one will do
  }
}

async function copyLink() {
  keepLink();
  try {
    await navigator.clipboard.writeText(new URL(`#${known.link}`, location.href).href);
    say(saved ? "Link copied: it opens this page at this episode" : "Link copied: it replays this episode as long as this viewer runs");
  } catch {
    say("The link is in the address bar");
  }
}

async function saveFilm() {
  $("save-film").disabled = true;
  say("Making the film …", false, false);
  try {
    const response = await fetch(`film.mp4?${known.link}`);
    if (response.ok) {
      const address = URL.createObjectURL(await response.blob());
      element("a", { href: address, download: "episode.mp4" }).click();
      URL.revokeObjectURL(address);
      say("Film saved as episode.mp4");
    } else {
      say((await response.json().catch(() => null))?.text ?? "The viewer failed. Its terminal says why", true);
    }
  } catch {
    say("The viewer did not answer", true);
  } finally {
    $("save-film").disabled = false;
  }
}

let forget = 0;
function say(text, refusal = false, passing = true) {
  clearTimeout(forget);
  $("status").textContent = text;
  $("status").classList.toggle("refusal", refusal);
  if (passing) forget = setTimeout(() => ($("status").textContent = ""), STATUS_MS);
}

function setSpeed(change) {
  $("speed").value = Number($("speed").value) + change;
  $("speed").dispatchEvent(new Event("input"));
}

function chooseLayer(kind) {
  const choice = document.querySelector(`input[name=layer][value=${kind}]`);
  if (choice.closest("[hidden]")) return;
  choice.checked = true;
  showLayer();
}

const newStart = () => begin({ start: null, seed: Math.floor(Math.random() * 1e6) });
const race = () => !saved && known.stage.agents.length && begin({ drive: known.episode.drive ? 0 : 1 });
const help = () => $("help-dialog").showModal();

$("scene").addEventListener("change", () => begin({ scene: $("scene").value, start: null, target: null }));
$("selection").addEventListener("change", () => begin({ selection: $("selection").value }));
$("sensor").addEventListener("change", () => {
  showTarget(known.pictures);
  show();
});
$("layer").addEventListener("change", () => showLayer());
$("mind").addEventListener("change", () => showLayer());
$("timeline").addEventListener("input", () => {
  play(false);
  shown = Number($("timeline").value);
  show();
});
$("speed").addEventListener("input", () => ($("speed-shown").textContent = `${STEPS_PER_S[$("speed").value]} steps/s`));
for (const [id, act] of Object.entries({ play: () => play(!playing), step, back, restart: () => begin(), "new-start": newStart, race, "copy-link": copyLink, "save-film": saveFilm, help })) {
  $(id).addEventListener("click", act);
}
listenToKeys({ play: () => play(!playing), step, back, restart: () => begin(), newStart, race, drive, chooseLayer, setSpeed, copyLink, help, toMap: () => $("map").focus() });
window.addEventListener("resize", () => {
  map.refresh();
  if (known.walkers.length) showCharts();
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => known.walkers.length && showCharts());
window.addEventListener("hashchange", () => load(location.hash.slice(1)));
start();

return {  };
})();
