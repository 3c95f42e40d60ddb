/* In: the viewer's data, and the settings chosen, each as its place in a ladder or list.
 * Out: the report's own settings, filled controls, and settings in words beside the controls. */

import { $, fillSelect } from "./elements.js";

export const SIGN_NAMES = { both: "stretch or crushing", stretch: "stretch alone", crush: "crushing alone" };

export const formatPercent = (part) => `${Number((100 * part).toPrecision(3))} %`;

export function findReportSettings(data) {
  return {
    step: data.ladder.indexOf(data.report.break_strain),
    mass: data.lump_masses.indexOf(data.report.lump_mass),
    sign: data.signs.indexOf(data.report.break_by),
    core: data.cores.indexOf(data.report.core_fraction),
  };
}

/** At first what differs most: the hardest-pressed run with sintering beside the one without. */
function chooseRuns(runs) {
  const left = runs.map((run) => run.arm).lastIndexOf("sintered");
  $("run-left").value = String(Math.max(left, 0));
  $("run-right").value = left === runs.length - 1 ? "" : String(runs.length - 1);
}

export function fillControls(data, runs) {
  const fields = data.fields.map(({ key, name }) => [key, name]);
  const labels = runs.map((run, number) => [number, run.label]);
  const signs = data.signs.map((sign, number) => [number, SIGN_NAMES[sign]]);
  const cores = data.cores.map((core, number) => [number, core < 1 ? String(core) : "1 (no core rule)"]);
  fillSelect("colour", [["fragment", "fragment"], ...fields, ["damage", "damage (bonds lost)"]]);
  fillSelect("run-left", labels);
  fillSelect("run-right", [...labels, ["", "none"]]);
  fillSelect("sign", signs);
  fillSelect("core", cores);
  $("time").max = data.frames.length - 1;
  $("strain").max = data.ladder.length - 1;
  $("mass").max = data.lump_masses.length - 1;
  chooseRuns(runs);
}

export function showSettings(data, settings) {
  const report = findReportSettings(data);
  const own = (name) => (settings[name] === report[name] ? " (the report's)" : "");
  const strain = `${data.ladder[settings.step]}${own("step")}`;
  const mass = `${formatPercent(data.lump_masses[settings.mass])}${own("mass")}`;
  $("strain").value = settings.step;
  $("mass").value = settings.mass;
  $("sign").value = settings.sign;
  $("core").value = settings.core;
  $("strain-now").value = strain;
  $("mass-now").value = data.lump_cells ? `${mass}, but at least ${data.lump_cells} cells` : mass;
  $("strain").setAttribute("aria-valuetext", strain);
  $("mass").setAttribute("aria-valuetext", mass);
}
