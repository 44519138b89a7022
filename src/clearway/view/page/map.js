// The map: the room from above, its zones or what an agent thinks of every pose, and the ways walked so far.
import { ACTIONS, GHOST, INK, STANDS, TARGET, WALL, ZONES, ZONE_OPACITY, drawAgent, drawBump, drawLine, drawTarget, hatching, heat, penOf } from "./looks.js";

const VEIL = "rgb(255 255 255 / 45%)"; // over the cells in the picture from above
const SHADE = "rgb(29 35 41 / 62%)"; // over the room, where an agent's belief is shown
const CELL_SHARE = 0.94;
const STAR = 0.27, STAR_MET = 0.44, ARROW = 0.24, ARROW_MET = 0.13; // of a cell; the second where they meet: neither hides the other
const LOWEST_PX = 220, LARGEST_CELL_PX = 90;

// `onPick(state, what)` is told of a pose chosen as "start" or "target" (null: as the page says); `onCursor(state)` of
// the pose that the keyboard's cursor is on, null when the map loses the focus.
export function createMap(canvas, onPick, onCursor) {
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
