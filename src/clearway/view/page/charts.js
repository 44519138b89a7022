// Small line charts of the episode by step.
import { drawBump, drawLine, penOf } from "./looks.js";

const LEFT = 48, RIGHT = 8, TOP = 8, BOTTOM = 6;

// Draws `valueOf(step)` (null: nothing) of every walker; a mark stands at the step shown.
export function drawChart(canvas, walkers, shown, valueOf, digits) {
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
