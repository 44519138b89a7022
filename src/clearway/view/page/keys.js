// The page by keyboard alone; what has the focus keeps the keys that it knows itself.

const LAYERS = { 1: "zones", 2: "value", 3: "policy", 4: "held" };
const DRIVE = { ArrowUp: 0, ArrowRight: 1, ArrowLeft: 2, ArrowDown: 3 };

export function listenToKeys(acts) {
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
