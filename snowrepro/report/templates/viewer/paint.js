/* In: a run, a frame, and by what to colour: fragment, damage or a field.
 * Out: `shades`, a list of colours, and `numbers`, which of them each particle that is drawn has. */

import { readStrainSteps } from "./bonds.js";

function paintFragments(run, data, finder, frame) {
  const { lumps, powder, snow } = data.colours;
  const shades = [...lumps, powder, snow];
  if (frame < data.release) return { shades, numbers: new Uint8Array(run.drawn).fill(lumps.length + 1) };
  const { now, colourOf } = finder.findColours(run, frame);
  const numbers = Uint8Array.from({ length: run.drawn }, (_, k) => {
    const colour = colourOf.get(now.fragment[k * data.thinning]);
    return colour === undefined ? lumps.length : colour;
  });
  return { shades, numbers };
}

/** By the part of its bonds that a particle has lost. */
function paintDamage(run, data, finder, frame) {
  const { shades } = data.colours;
  if (frame < data.release) return { shades, numbers: new Uint8Array(run.drawn) };
  const { start, bondOf } = run.bonds;
  const { sign, step } = finder.settings;
  const steps = readStrainSteps(run, data, frame, data.signs[sign]);
  const numbers = Uint8Array.from({ length: run.drawn }, (_, k) => {
    const own = bondOf.subarray(start[k * data.thinning], start[k * data.thinning + 1]);
    const lost = own.reduce((sum, bond) => sum + (steps[bond] > step), 0);
    return Math.round((own.length ? lost / own.length : 0) * (shades.length - 1));
  });
  return { shades, numbers };
}

function paintField(run, data, frame, field) {
  const { shades } = data.colours;
  const levels = run.fields[field].subarray(frame * run.drawn, (frame + 1) * run.drawn);
  return { shades, numbers: levels.map((level) => Math.round((level / (data.levels - 1)) * (shades.length - 1))) };
}

export function paintParticles(run, data, finder, frame, by) {
  if (by === "fragment") return paintFragments(run, data, finder, frame);
  if (by === "damage") return paintDamage(run, data, finder, frame);
  return paintField(run, data, frame, by);
}
