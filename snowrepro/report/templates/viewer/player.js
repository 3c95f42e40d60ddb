/* In: `view`, whose `at` is the place in the list of frames, whole or between two; what draws it; the reader's keys.
 * Out: `view.at` moved on in time, or to where the reader wants it. */

import { $ } from "./elements.js";
import { findPlace, findTime } from "./times.js";

const STILL_MS = 700; // for which a frame stands where motion is unwanted

export class Player {
  constructor(data, view, draw) {
    this.seconds = data.seconds;
    this.view = view;
    this.draw = draw;
    this.still = window.matchMedia("(prefers-reduced-motion: reduce)");
    this.before = 0; // when the place was last moved on [ms]
    this.stood = 0; // for so long a frame has been shown, where motion is unwanted
  }

  goTo(frame) {
    this.view.at = Math.min(Math.max(frame, 0), this.view.last);
    this.stop();
  }

  toggle() {
    if (this.view.playing) this.stop();
    else this.play();
  }

  play() {
    const { view } = this;
    if (view.at >= view.last) view.at = 0;
    $("play").textContent = "Stop";
    this.before = performance.now();
    this.wait();
  }

  stop() {
    cancelAnimationFrame(this.view.playing);
    this.view.playing = null;
    $("play").textContent = "Play";
    this.draw();
  }

  wait() {
    this.view.playing = requestAnimationFrame((now) => this.moveOn(now));
  }

  moveOn(now) {
    const { view } = this;
    this.advance(Math.max(0, now - this.before));
    this.before = now;
    if (view.at >= view.last) {
      this.goTo(view.last);
    } else {
      this.wait();
      this.draw();
    }
  }

  /** `passed` milliseconds are over. */
  advance(passed) {
    if (this.still.matches) this.advanceByFrames(passed);
    else this.advanceSmoothly(passed);
  }

  advanceSmoothly(passed) {
    const seconds = (Number($("speed").value) * passed) / 1000;
    this.view.at = findPlace(this.seconds, findTime(this.seconds, this.view.at) + seconds);
  }

  advanceByFrames(passed) {
    this.stood += passed;
    if (this.stood < STILL_MS) return;
    this.stood = 0;
    this.view.at = Math.floor(this.view.at) + 1;
  }
}

/** Keys and clicks on a picture. */
export function listenToPicture(canvas, view, player) {
  const moves = {
    " ": () => player.toggle(),
    ArrowLeft: () => player.goTo(Math.ceil(view.at) - 1),
    ArrowRight: () => player.goTo(Math.floor(view.at) + 1),
    Home: () => player.goTo(0),
    End: () => player.goTo(view.last),
  };
  canvas.addEventListener("keydown", (event) => {
    if (!moves[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault(); // the page would scroll
    moves[event.key]();
  });
  canvas.addEventListener("click", () => player.toggle());
}
