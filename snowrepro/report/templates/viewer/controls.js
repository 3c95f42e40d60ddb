/* In: the viewer's data and its runs.  Out: filled controls, at first with the two runs that differ most. */

import { $, fillSelect } from "./elements.js";

/** The hardest-pressed run with sintering beside the one without. */
function chooseRuns(runs) {
  const left = runs.map((run) => run.arm).lastIndexOf("sintered");
  $("run-left").value = String(Math.max(left, 0));
  $("run-right").value = left === runs.length - 1 ? "" : String(runs.length - 1);
}

export function fillControls(data, runs) {
  const labels = runs.map((run, number) => [number, run.label]);
  fillSelect("colour", [["state", "what became of it"], ...data.fields.map(({ key, name }) => [key, name])]);
  fillSelect("run-left", labels);
  fillSelect("run-right", [...labels, ["", "none"]]);
  $("time").max = data.frames.length - 1;
  chooseRuns(runs);
}
