// Who wins a race: who arrives first; of those who arrive together, the one with the fewest collisions.

export const counted = (count, noun) => `${count} ${noun}${count === 1 ? "" : "s"}`;

// The winner's `index` (null: a tie) and what to say, by the indices of those who arrived first; null for none of them.
export function verdict(walkers, first) {
  if (!first.length) return null;
  const bumps = (index) => walkers[index].steps.at(-1).collisions, least = Math.min(...first.map(bumps));
  const best = first.filter((index) => bumps(index) === least), names = best.map((index) => walkers[index].name);
  if (best.length > 1) return { index: null, text: `A tie: ${names.join(" and ")}` };
  const why = first.length > 1 ? `with fewer collisions (${least})` : `in ${counted(walkers[best[0]].steps.length - 1, "step")}`;
  return { index: best[0], text: `${names[0] === "you" ? "You win" : `${names[0]} wins`}, ${why}` };
}
