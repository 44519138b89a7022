// The page: holds what is known of the episode, asks the viewer for more, and shows it.
import { createCard, element, sharedBeginning } from "./cards.js";
import { drawChart } from "./charts.js";
import { connect, fetched } from "./connection.js";
import { listenToKeys } from "./keys.js";
import { showLegend } from "./legend.js";
import { withLooks } from "./looks.js";
import { createMap } from "./map.js";
import { openSaved, saved } from "./saved.js";
import { counted, verdict } from "./verdict.js";

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
