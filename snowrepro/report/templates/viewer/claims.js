/* In: a claim, the runs of one scene, and a function that gives the number of a run.
 * Out: whether the numbers point the claim's way, as `check_agreement` in snowrepro/evidence/claims.py has it. */

/** Mean over the runs of one arm and pressure, by rising pressure. */
function averageByPressure(runs, arm, read) {
  const groups = new Map();
  for (const run of runs.filter((each) => each.arm === arm)) {
    groups.set(run.pressure, [...(groups.get(run.pressure) || []), read(run)]);
  }
  const mean = (values) => values.reduce((sum, each) => sum + each, 0) / values.length;
  return new Map([...groups].sort((a, b) => a[0] - b[0]).map(([pressure, values]) => [pressure, mean(values)]));
}

/** What a claim is about, by rising pressure: one arm, or by how much the sintered exceeds the other. */
function compareArms(claim, runs, read) {
  const sintered = averageByPressure(runs, "sintered", read);
  const unsintered = averageByPressure(runs, "unsintered", read);
  if (claim.of === "unsintered") return [...unsintered.values()];
  if (claim.of !== "contrast") return [...sintered.values()];
  const both = [...sintered].filter(([pressure]) => unsintered.has(pressure));
  return both.map(([pressure, mean]) => mean - unsintered.get(pressure));
}

/** Whether the numbers agree with a claim; null if they cannot tell. */
export function judgeClaim(claim, runs, read) {
  const values = compareArms(claim, runs, read);
  const chosen = { every: values, lowest: values.slice(0, 1), highest: values.slice(-1) }[claim.at];
  if (chosen.length < (claim.test === "rises" ? 2 : 1)) return null;
  const numbers = claim.test === "rises" ? chosen.slice(1).map((each, k) => each - chosen[k]) : chosen;
  return numbers.every((each) => (claim.test === "below" ? each < claim.threshold : each > claim.threshold));
}

export function nameVerdict(holds) {
  if (holds === null) return "no answer";
  return holds ? "agree" : "disagree";
}
