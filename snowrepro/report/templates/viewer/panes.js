/* In: the runs chosen, and `view` (player.js).
 * Out: the two pictures, the sentence below each, and the time beside its slider. */

import { drawSnow, drawStage, fitCanvas } from "./draw.js";
import { $, makeNumber, SIDES } from "./elements.js";
import { paintParticles } from "./paint.js";
import { findTime } from "./times.js";

function writeCaption(run, data, frame) {
  if (!run.shares[frame]) return ["pressed, not yet released."];
  const parts = data.states.flatMap((state, place) => [`${state} `, makeNumber(run.shares[frame][place]), ", "]);
  return [...parts.slice(0, -1), ` of the mass; number of lumps ${run.lumps[frame]}.`];
}

function drawPicture(canvas, run, data, at) {
  const scale = fitCanvas(canvas, run);
  const context = canvas.getContext("2d");
  const paint = paintParticles(run, data, Math.floor(at), $("colour").value);
  drawStage(context, run, data.colours, scale);
  drawSnow(context, run, paint, at, scale);
}

function drawPane(side, data, runs, view) {
  const run = runs[Number($(`run-${side}`).value || NaN)];
  const [canvas, caption] = [$(`canvas-${side}`), $(`caption-${side}`)];
  canvas.hidden = !run;
  caption.hidden = !run;
  if (!run) return;
  const frame = Math.floor(view.at);
  drawPicture(canvas, run, data, view.at);
  caption.replaceChildren(`Frame ${data.frames[frame]}: `, ...writeCaption(run, data, frame));
  if (!view.playing) canvas.setAttribute("aria-label", `${run.label}. ${caption.textContent}`);
}

function showTime(data, at) {
  const told = `frame ${data.frames[Math.floor(at)]}, ${findTime(data.seconds, at).toFixed(2)} s`;
  $("time").value = Math.round(at);
  $("time").setAttribute("aria-valuetext", told);
  $("time-now").value = told;
}

export function drawPanes(data, runs, view) {
  showTime(data, view.at);
  for (const side of SIDES) drawPane(side, data, runs, view);
}

/** At most one drawing before the screen is painted next, however often it is asked for. */
export function limitDrawing(draw) {
  let due = false;
  return () => {
    if (due) return;
    due = true;
    requestAnimationFrame(() => {
      due = false;
      draw();
    });
  };
}
