/* In: the JSON in the page (snowrepro/report/viewer/viewer.py), and all that the reader does.
 * Out: the viewer: runs as particles over time, coloured by what became of the snow, with the shares of each frame.
 *
 * States, colours and shares are computed by snowrepro, and embedded; here they are shown. */

import { fillControls } from "./controls.js";
import { $, SIDES } from "./elements.js";
import { showLegend } from "./legend.js";
import { drawPanes, limitDrawing } from "./panes.js";
import { listenToPicture, Player } from "./player.js";
import { makeTable } from "./tables.js";
import { unpackRun } from "./unpack.js";

function listenToPlayer(view, player) {
  $("time").addEventListener("input", () => player.goTo(Number($("time").value)));
  $("play").addEventListener("click", () => player.toggle());
  for (const side of SIDES) listenToPicture($(`canvas-${side}`), view, player);
}

/** What is chosen to be seen, and the room for it. */
function listenToPanes(data, draw) {
  $("colour").addEventListener("input", () => {
    showLegend(data, $("colour").value);
    draw();
  });
  const resized = new ResizeObserver(draw);
  for (const side of SIDES) {
    $(`run-${side}`).addEventListener("input", draw);
    resized.observe($(`canvas-${side}`));
  }
}

function startViewer(data, runs) {
  const last = data.frames.length - 1;
  const view = { at: last, last, playing: null };
  const updateTable = makeTable(data, runs);
  const draw = limitDrawing(() => {
    drawPanes(data, runs, view);
    updateTable(Math.floor(view.at));
  });
  listenToPlayer(view, new Player(data, view, draw));
  listenToPanes(data, draw);
  showLegend(data, $("colour").value);
  drawPanes(data, runs, view);
  updateTable(last);
}

/** All runs, one after the other, with a bar that shows how many are there. */
async function unpackAll(data) {
  const runs = [];
  for (const run of data.runs) {
    Object.assign($("unpacked"), { max: data.runs.length, value: runs.length });
    $("unpacked-now").textContent = `${runs.length} of ${data.runs.length}`;
    await new Promise((goOn) => setTimeout(goOn)); // the screen is painted in between
    runs.push(await unpackRun(run, data));
  }
  return runs;
}

async function main() {
  const whole = document.getElementById("viewer");
  if (!whole) return;
  whole.hidden = false;
  if (!("DecompressionStream" in window)) {
    $("wait").textContent = "This browser cannot unpack the runs; one of 2023 or later can.";
    return;
  }
  const data = JSON.parse($("data").textContent);
  const runs = await unpackAll(data);
  fillControls(data, runs);
  $("wait").hidden = true;
  $("body").hidden = false;
  startViewer(data, runs);
}

main();
