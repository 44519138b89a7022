// Colours and marks that the map, the cards and the charts share. They match clearway.colours and viz.figures.

export const ZONES = ["#f4f4f1", "#f6b73c", "#c1272d"]; // free, precollision, collision
export const ZONE_OPACITY = [0, 0.55, 0.55];
export const HATCH_INK = "#5c0f0b";
export const WALL = "#3f4650";
export const TARGET = "#00876c";
export const STANDS = "#ffffff"; // where an agent holds that a body can stand
export const GHOST = { colour: "rgb(255 255 255 / 0%)", halo: "#d81b60" }; // where it holds itself to be
export const INK = "#22272e";

// First agent, second agent, the user: apart in lightness, and in dashes without colour.
export const WALKERS = [
  { colour: "#0b3d91", halo: "#ffffff", dashes: [] },
  { colour: "#3ddc84", halo: "#16351f", dashes: [9, 5] },
  { colour: "#8e2c9c", halo: "#ffffff", dashes: [2.5, 5] },
];

const BY_REWARD = { shortest: WALKERS[0], "collision-aware": WALKERS[1] }; // where both walk, in whatever order: as on the demo's page

// The walkers, each with its `look`.
export function withLooks(walkers) {
  const agents = walkers.filter(({ agent }) => agent), own = new Set(agents.map(({ reward }) => BY_REWARD[reward]));
  const differ = own.size === WALKERS.length - 1 && !own.has(undefined);
  return walkers.map((walker, index) => ({ ...walker, look: !walker.agent ? WALKERS[2] : differ ? BY_REWARD[walker.reward] : WALKERS[index] }));
}

// Forward, right, left, backward: Okabe and Ito's colours.
export const ACTIONS = [
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
export function heat(share) {
  const place = Math.min(Math.max(share, 0), 1) * (CIVIDIS.length - 1);
  const low = Math.min(Math.floor(place), CIVIDIS.length - 2);
  const mixed = CIVIDIS[low].map((value, i) => Math.round(value + (CIVIDIS[low + 1][i] - value) * (place - low)));
  return `rgb(${mixed.join(" ")})`;
}

// Sharp drawing on any screen: sets the canvas's size in CSS pixels and gives back a pen in those units.
export function penOf(canvas, width, height) {
  const density = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * density);
  canvas.height = Math.round(height * density);
  const pen = canvas.getContext("2d");
  pen.setTransform(density, 0, 0, density, 0, 0);
  return pen;
}

// An arrowhead along a heading (degrees, clockwise from upwards), with an edge.
export function drawAgent(pen, x, y, size, heading, look) {
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
export function drawTarget(pen, x, y, size, heading) {
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
export function drawBump(pen, x, y, size, look) {
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
export function drawLine(pen, points, look, width) {
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
export function hatching(pen) {
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
