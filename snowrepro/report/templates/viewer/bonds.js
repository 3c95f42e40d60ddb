/* In: a run's bonds, a frame, and by which strain and core rule bonds break.
 * Out: for each bond the step of the ladder of break strains from which on it holds; the rule is that of
 * snowrepro/analysis/tree.py, and the numbers those that snowrepro.classify finds. */

/** From which step on each bond has held by itself up to a frame: stretch, crushing, or the worse of both. */
export function readStrainSteps(run, data, frame, sign) {
  const { count, steps } = run.bonds;
  const at = (which) => (which * (data.frames.length - data.release) + frame - data.release) * count;
  const stretch = steps.subarray(at(0), at(0) + count);
  const crush = steps.subarray(at(1), at(1) + count);
  if (sign === "stretch") return stretch;
  if (sign === "crush") return crush;
  return stretch.map((step, bond) => Math.max(step, crush[bond]));
}

/** Sort the numbers from `low` to before `high`, so few that insertion is fastest. */
function sortFew(numbers, low, high) {
  for (let i = low + 1; i < high; i++) {
    const value = numbers[i];
    let place = i;
    for (; place > low && numbers[place - 1] > value; place--) numbers[place] = numbers[place - 1];
    numbers[place] = value;
  }
}

/** From which step on each particle is core: it has lost less than `coreFraction` of its bonds. */
function findCoreSteps(run, steps, coreFraction) {
  const { start, bondOf } = run.bonds;
  const core = new Uint8Array(run.particles).fill(255); // without bonds: never
  const own = new Uint8Array(bondOf.length);
  for (let k = 0; k < own.length; k++) own[k] = steps[bondOf[k]];
  for (let i = 0; i < run.particles; i++) {
    const degree = start[i + 1] - start[i];
    sortFew(own, start[i], start[i + 1]);
    if (degree) core[i] = own[start[i + 1] - Math.ceil(coreFraction * degree)]; // the most strained come last
  }
  return core;
}

/** By which bond particle i first hangs on a neighbour that is core, and from which step on. */
function findSupport({ one, other, start, bondOf }, steps, core, i) {
  let earliest = Infinity;
  let hangs = -1; // stays so without bonds
  for (let k = start[i]; k < start[i + 1]; k++) {
    const bond = bondOf[k];
    const neighbour = one[bond] === i ? other[bond] : one[bond];
    const step = Math.max(steps[bond], core[neighbour]);
    if (step >= earliest) continue; // of several that tie the first counts
    earliest = step;
    hangs = bond;
  }
  return [hangs, earliest];
}

/** From which step on each bond holds its ends in one fragment: both are core, or one hangs on the other by it. */
function findHoldingSteps(run, steps, core) {
  const { count, one, other } = run.bonds;
  const holds = new Uint8Array(count);
  for (let bond = 0; bond < count; bond++) holds[bond] = Math.max(steps[bond], core[one[bond]], core[other[bond]]);
  for (let i = 0; i < run.particles; i++) {
    const [hangs, earliest] = findSupport(run.bonds, steps, core, i);
    if (hangs >= 0) holds[hangs] = Math.min(holds[hangs], earliest);
  }
  return holds;
}

/** Add to steps what they lack where strains within one step decide on which core a particle hangs. */
function correctSteps(holds, run, data, frame, sign, core) {
  const set = sign * data.cores.length + core;
  const first = (set * (data.frames.length - data.release) + frame - data.release) * run.bonds.count;
  for (let bond = 0; bond < holds.length; bond++) holds[bond] += run.bonds.corrections[first + bond]; // modulo 256
}

/** From which step on each bond holds, exactly; `sign` and `core`: places in the lists of what can be chosen. */
export function findExactSteps(run, data, frame, sign, core) {
  const steps = readStrainSteps(run, data, frame, data.signs[sign]);
  const holds = findHoldingSteps(run, steps, findCoreSteps(run, steps, data.cores[core]));
  correctSteps(holds, run, data, frame, sign, core);
  return holds;
}
