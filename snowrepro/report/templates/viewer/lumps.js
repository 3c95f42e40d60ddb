/* In: from which step on each bond holds (bonds.js), the step chosen, and the least mass of a lump.
 * Out: the fragment of each particle, and which fragments are lumps, as snowrepro/analysis/fragments.py has it. */

const ROUND_OFF = 1e-12; // of a sum of masses, as there

export const massOf = (run, i) => run.mass[run.mass.length > 1 ? i : 0];
export const isGone = (run, frame, i) => run.gone !== null && run.gone[i] <= frame;

/** The fragment of each particle, by the number of one of its particles: union-find over the bonds that hold. */
export function joinParticles(run, holds, step) {
  const parent = new Int32Array(run.particles).map((_, i) => i);
  const findRoot = (i) => {
    let root = i;
    while (parent[root] !== root) {
      parent[root] = parent[parent[root]];
      root = parent[root];
    }
    return root;
  };
  for (let bond = 0; bond < holds.length; bond++) {
    if (holds[bond] > step) continue;
    const a = findRoot(run.bonds.one[bond]);
    const b = findRoot(run.bonds.other[bond]);
    if (a !== b) parent[Math.max(a, b)] = Math.min(a, b);
  }
  for (let i = 0; i < run.particles; i++) parent[i] = findRoot(i);
  return parent;
}

/** Mass of each fragment, at the place of its number. */
function weighFragments(run, frame, fragment) {
  const mass = new Float64Array(run.particles);
  for (let i = 0; i < run.particles; i++) {
    if (!isGone(run, frame, i)) mass[fragment[i]] += massOf(run, i); // what has vanished is no part of a lump
  }
  return mass;
}

/** Lumps at a frame, heaviest first: numbers and masses of their fragments, and the part of all mass in them. */
export function findLumps(run, frame, fragment, leastMass) {
  const least = Math.max(leastMass * run.total, run.least) * (1 - ROUND_OFF);
  const lumps = [];
  weighFragments(run, frame, fragment).forEach((mass, name) => {
    if (mass > 0 && mass >= least) lumps.push({ name, mass });
  });
  lumps.sort((a, b) => b.mass - a.mass);
  return { frame, fragment, lumps, part: lumps.reduce((sum, lump) => sum + lump.mass, 0) / run.total };
}
