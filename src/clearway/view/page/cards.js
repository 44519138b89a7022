// A card for each walker: its view, its numbers, and what it thinks of the four actions (or buttons to drive by).
import { ACTIONS, drawAgent, penOf } from "./looks.js";

export function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith("data-") || key.startsWith("aria-")) made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...children);
  return made;
}

export function icon(path) {
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
export function sharedBeginning(names) {
  const [first, ...others] = names;
  let end = others.length ? Math.min(...names.map((name) => name.length)) : 0;
  while (end && !(others.every((name) => name.startsWith(first.slice(0, end))) && /[-_. ]/.test(first[end - 1]))) end -= 1;
  return end;
}

export function createCard(walker, shared, pictures, onDrive) {
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
