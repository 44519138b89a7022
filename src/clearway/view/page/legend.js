// What the map's colours mean, in words, for the layer shown.
import { element } from "./cards.js";
import { ACTIONS, GHOST, STANDS, TARGET, WALKERS, ZONES, ZONE_OPACITY, drawAgent, drawBump, drawTarget, hatching, heat, penOf } from "./looks.js";

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

export function showLegend(place, layer) {
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
