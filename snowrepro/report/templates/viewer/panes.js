/* In: the runs chosen, `view` (player.js), and lumps (finder.js).
 * Out: the two pictures, the sentence below each, and the time beside its slider. */

import { drawSnow, drawStage, fitCanvas } from "./draw.js";
import { $, makeNumber, SIDES } from "./elements.js";
import { paintParticles } from "./paint.js";
import { findTime } from "./times.js";

function writeCaption(run, data, finder, frame) {
  if (frame < data.release) return ["pressed, not yet released."];
  const { part, lumps } = finder.findLumps(run, frame);
  return ["mass in lumps ", makeNumber(part), `, number of lumps ${lumps.length}.`];
}

function drawPicture(canvas, run, data, finder, at) {
  const scale = fitCanvas(canvas, run);
  const context = canvas.getContext("2d");
  const paint = paintParticles(run, data, finder, Math.floor(at), $("colour").value);
  drawStage(context, run, data.colours, scale);
  drawSnow(context, run, paint, at, scale);
}

function drawPane(side, data, runs, finder, view) {
  const run = runs[Number($(`run-${side}`).value || NaN)];
  const [canvas, caption] = [$(`canvas-${side}`), $(`caption-${side}`)];
  canvas.hidden = !run;
  caption.hidden = !run;
  if (!run) return;
  const frame = Math.floor(view.at);
  drawPicture(canvas, run, data, finder, view.at);
  caption.replaceChildren(`Frame ${data.frames[frame]}: `, ...writeCaption(run, data, finder, frame));
  if (!view.playing) canvas.setAttribute("aria-label", `${run.label}. ${caption.textContent}`);
}

function showTime(data, at) {
  const told = `frame ${data.frames[Math.floor(at)]}, ${findTime(data.seconds, at).toFixed(2)} s`;
  $("time").value = Math.round(at);
  $("time").setAttribute("aria-valuetext", told);
  $("time-now").value = told;
}

export function drawPanes(data, runs, finder, view) {
  showTime(data, view.at);
  for (const side of SIDES) drawPane(side, data, runs, finder, view);
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
