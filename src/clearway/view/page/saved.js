// A saved page: episodes that were recorded stand in for the viewer. What they are is in data.js, by view/saved.py.

export const saved = window.CLEARWAY_SAVED ?? null;

// Answers as the viewer does, from what was recorded.
export function openSaved() {
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
