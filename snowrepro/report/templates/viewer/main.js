/* In: the JSON in the page (snowrepro/report/viewer/viewer.py), and all that the reader does.
 * Out: the viewer: runs as particles over time, and lumps anew under any setting.
 *
 * Bonds between particles are laid when the snow is released.  A break strain is a step of a ladder; of each bond it
 * is known, for each embedded frame, from which step on it has held so far.  unpack.js reads that, bonds.js and
 * lumps.js work out what is held together, finder.js remembers it, the others show it. */

import { $, SIDES } from "./elements.js";
import { Finder } from "./finder.js";
import { showLegend } from "./legend.js";
import { drawPanes, limitDrawing } from "./panes.js";
import { listenToPicture, Player } from "./player.js";
import { fillControls, findReportSettings, showSettings } from "./settings.js";
import { makeSpeaker } from "./speaker.js";
import { makeTables } from "./tables.js";
import { unpackRun } from "./unpack.js";

const onInput = (name, act) => $(name).addEventListener("input", () => act(Number($(name).value)));

/** All that shows lumps follows the settings; returns how to change some of these. */
function makeChanger(data, runs, finder, view, draw) {
  const settings = findReportSettings(data);
  const updateTables = makeTables(data, runs);
  const say = makeSpeaker(data);
  return (chosen) => {
    Object.assign(settings, chosen);
    finder.useSettings(settings);
    showSettings(data, settings);
    const claims = updateTables((run) => finder.findLumps(run, view.last));
    say(settings, claims);
    draw();
  };
}

function listenToSettings(data, change) {
  onInput("strain", (step) => change({ step }));
  onInput("mass", (mass) => change({ mass }));
  onInput("sign", (sign) => change({ sign }));
  onInput("core", (core) => change({ core }));
  $("reset").addEventListener("click", () => change(findReportSettings(data)));
}

function listenToPlayer(view, player) {
  onInput("time", (frame) => player.goTo(frame));
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
  const finder = new Finder(data);
  const draw = limitDrawing(() => drawPanes(data, runs, finder, view));
  const change = makeChanger(data, runs, finder, view, draw);
  listenToSettings(data, change);
  listenToPlayer(view, new Player(data, view, draw));
  listenToPanes(data, draw);
  showLegend(data, $("colour").value);
  change({});
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
