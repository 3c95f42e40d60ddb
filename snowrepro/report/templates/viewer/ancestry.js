/* In: lumps at a frame (lumps.js), lumps and their colours at the frame before.
 * Out: the number of each lump's colour, as fragment_colours in snowrepro/report/drawing/common.py has it. */

import { isGone, massOf } from "./lumps.js";

/** How much mass each lump shares with each fragment before: maps of mass by fragment, by lump. */
function shareMasses(run, now, before) {
  const shared = new Map(now.lumps.map((lump) => [lump.name, new Map()]));
  now.fragment.forEach((name, i) => {
    const parts = shared.get(name);
    if (!parts || isGone(run, now.frame, i)) return;
    const parent = before.fragment[i];
    parts.set(parent, (parts.get(parent) || 0) + massOf(run, i));
  });
  return shared;
}

/** Which lumps are the heaviest heir of which lump before; the parent of a lump is what holds most of its mass. */
function findHeirs(run, now, before) {
  const best = new Map(before.lumps.map((lump) => [lump.name, { heir: null, part: 0 }]));
  for (const [heir, parts] of shareMasses(run, now, before)) {
    const [parent, part] = [...parts].reduce((most, each) => (each[1] > most[1] ? each : most));
    if (best.has(parent) && part > best.get(parent).part) best.set(parent, { heir, part });
  }
  return new Map([...best].filter(([, { heir }]) => heir !== null).map(([parent, { heir }]) => [heir, parent]));
}

/** The heaviest heir of a lump keeps its colour, another lump takes the one of `colours` that has the least mass. */
export function chooseColours(run, now, before, colours) {
  const colourOf = new Map();
  const taken = new Array(colours).fill(0);
  const give = (lump, colour) => {
    colourOf.set(lump.name, colour);
    taken[colour] += lump.mass;
  };
  const heirs = before ? findHeirs(run, now, before.now) : new Map();
  for (const lump of now.lumps) {
    if (heirs.has(lump.name)) give(lump, before.colourOf.get(heirs.get(lump.name)));
  }
  for (const lump of now.lumps) {
    if (!colourOf.has(lump.name)) give(lump, taken.indexOf(Math.min(...taken)));
  }
  return { now, colourOf };
}
