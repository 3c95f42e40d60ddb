/* In: the viewer's data, the runs, and a frame.  Out: the table of runs, brought up to date with the shares of that frame. */

import { $, makeElement, makeNumber } from "./elements.js";

/** One run; returns how to bring its row up to a frame. */
function addRunRow(run) {
  const bar = makeElement("td", undefined, { className: "viewer-parts", ariaHidden: "true" });
  const cells = [0, 1, 2].map(() => makeElement("td"));
  const count = makeElement("td");
  $("runs").insertRow().append(makeElement("th", run.label, { scope: "row" }), bar, ...cells, count);
  return (frame) => {
    const shares = run.shares[frame] || [];
    cells.forEach((cell, place) => {
      cell.replaceChildren(place < shares.length ? makeNumber(shares[place]) : "-");
    });
    bar.style.setProperty("--lump", shares[0] || 0);
    bar.style.setProperty("--crushed", shares[1] || 0);
    bar.style.setProperty("--loose", shares[2] || 0);
    count.textContent = shares.length ? run.lumps[frame] : "-";
  };
}

/** Make all rows, once, with bars in the colours of the pictures; returns how to bring them up to a frame. */
export function makeTable({ colours }, runs) {
  const { lumps, crushed, loose } = colours;
  Object.entries({ lump: lumps[0], crushed, loose }).forEach(([state, colour]) => {
    $("runs").style.setProperty(`--of-${state}`, colour);
  });
  const rows = runs.map(addRunRow);
  let shown = -1;
  return (frame) => {
    if (frame === shown) return;
    shown = frame;
    for (const update of rows) update(frame);
  };
}
