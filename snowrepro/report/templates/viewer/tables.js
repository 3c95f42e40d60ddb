/* In: the runs, and a function that gives lumps of a run under the present settings.
 * Out: the two tables, of runs and of claims, each cell brought up to date; what became of the claims. */

import { judgeClaim, nameVerdict } from "./claims.js";
import { $, makeElement, makeNumber } from "./elements.js";

/** One run; returns how to bring its row up to date. */
function addRunRow(run) {
  const now = makeElement("td", undefined, { className: "viewer-part" });
  const report = makeElement("td");
  const count = makeElement("td");
  report.append(makeNumber(run.lump_fraction));
  const row = $("runs").insertRow();
  row.append(makeElement("th", run.label, { scope: "row" }), now, report, count);
  return (find) => {
    const { part, lumps } = find(run);
    now.replaceChildren(makeNumber(part));
    now.style.setProperty("--part", part);
    count.textContent = lumps.length;
  };
}

/** One claim about some runs; `whole`: whether all runs of the scene are there.  Returns how to judge it anew. */
function addClaimRow(claim, name, runs, whole) {
  const judge = (read) => (whole ? judgeClaim(claim, runs, read) : null);
  const report = judge((run) => run.lump_fraction);
  const now = makeElement("td");
  const title = makeElement("th", `${name}: ${claim.statement}`, { scope: "row" });
  const row = $("claims").insertRow();
  row.append(title, now, makeElement("td", nameVerdict(report)));
  return (find) => {
    const holds = judge((run) => find(run).part);
    now.textContent = nameVerdict(holds);
    now.classList.toggle("viewer-differs", holds !== report);
    return { name, holds };
  };
}

function addClaimRows(data, runs) {
  const scenes = [...new Set(runs.map((run) => run.scene))];
  const nameOf = (claim, scene) => (scenes.length > 1 ? `${claim.name}, ${scene}` : claim.name);
  return scenes.flatMap((scene) => {
    const own = runs.filter((run) => run.scene === scene);
    const whole = !data.incomplete.includes(scene);
    return data.claims.map((claim) => addClaimRow(claim, nameOf(claim, scene), own, whole));
  });
}

/** Make all rows, once; returns how to bring them up to date, which gives what became of the claims. */
export function makeTables(data, runs) {
  const runRows = runs.map(addRunRow);
  const claimRows = addClaimRows(data, runs);
  return (find) => {
    for (const update of runRows) update(find);
    return claimRows.map((update) => update(find));
  };
}
