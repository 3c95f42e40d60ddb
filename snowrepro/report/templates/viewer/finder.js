/* In: the reader's settings; then a run and a frame.
 * Out: lumps and their colours there.  What the next question may need again is remembered. */

import { chooseColours } from "./ancestry.js";
import { findExactSteps } from "./bonds.js";
import { findLumps, joinParticles } from "./lumps.js";

/** What a map has for a key; made and kept if it has nothing. */
function recall(map, key, make) {
  if (!map.has(key)) map.set(key, make());
  return map.get(key);
}

export class Finder {
  constructor(data) {
    this.data = data;
    this.settings = null;
    this.memory = new Map(); // run -> what holds by frame, lumps by frame, colours by frame
  }

  /** What holds does not depend on the step, nor on the least mass: a slider needs but a new cut. */
  useSettings(settings) {
    const before = this.settings;
    const sameBonds = before && before.sign === settings.sign && before.core === settings.core;
    for (const kept of this.memory.values()) {
      kept.lumps.clear();
      kept.colours = [];
      if (!sameBonds) kept.holds.clear();
    }
    this.settings = { ...settings };
  }

  findLumps(run, frame) {
    const { lumps, holds } = this.recallRun(run);
    return recall(lumps, frame, () => {
      const { sign, core, step, mass } = this.settings;
      const steps = recall(holds, frame, () => findExactSteps(run, this.data, frame, sign, core));
      return findLumps(run, frame, joinParticles(run, steps, step), this.data.lump_masses[mass]);
    });
  }

  /** Colours go by ancestry, so those of all frames before are needed. */
  findColours(run, frame) {
    const { release, colours } = this.data;
    const known = this.recallRun(run).colours;
    for (let at = release + known.length; at <= frame; at++) {
      known.push(chooseColours(run, this.findLumps(run, at), known[known.length - 1], colours.lumps.length));
    }
    return known[frame - release];
  }

  recallRun(run) {
    return recall(this.memory, run, () => ({ holds: new Map(), lumps: new Map(), colours: [] }));
  }
}
