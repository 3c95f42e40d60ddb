/* In: a canvas or its context, a run, colours (paint.js), and a place in the list of frames.
 * Out: nothing but pixels; a length times `scale` is pixels. */

const SQUARE = Math.sqrt(Math.PI) / 2; // side of a square that covers what a disc of diameter 1 does

const isGone = (run, frame, i) => run.gone !== null && run.gone[i] <= frame;

/** Fit a canvas to its box and to the screen's pixels; returns the scale. */
export function fitCanvas(canvas, run) {
  canvas.style.aspectRatio = `${run.width} / ${run.height}`;
  const width = Math.max(1, Math.round(canvas.clientWidth * (window.devicePixelRatio || 1)));
  const height = Math.round((width * run.height) / run.width);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  return width / run.width;
}

export function drawStage(context, run, colours, scale) {
  const { width, height } = context.canvas;
  context.fillStyle = colours.sky;
  context.fillRect(0, 0, width, height);
  context.fillStyle = colours.floor;
  context.beginPath();
  for (const curve of run.floor) {
    for (const [x, y] of curve) context.lineTo(x * scale, height - y * scale);
    context.closePath();
  }
  context.fill();
}

/** Gives coordinates at a place in the list of frames, whole or between two; first all x, then all y. */
function makeReader(run, at) {
  const frame = Math.floor(at);
  const on = at - frame;
  const now = run.places.subarray(frame * 2 * run.drawn);
  const next = on ? run.places.subarray((frame + 1) * 2 * run.drawn) : now;
  return (k) => now[k] + on * (next[k] - now[k]);
}

/** Squares as large as the discs of the report's pictures, which take much longer to fill. */
export function drawSnow(context, run, { shades, numbers }, at, scale) {
  const frame = Math.floor(at);
  const read = makeReader(run, at);
  const side = run.diameter * SQUARE * scale;
  const pixels = run.quantum * scale;
  const thinning = Math.round(run.particles / run.drawn);
  shades.forEach((shade, number) => {
    context.fillStyle = shade;
    for (let k = 0; k < run.drawn; k++) {
      if (numbers[k] !== number || isGone(run, frame, k * thinning)) continue;
      const left = read(k) * pixels - side / 2;
      const top = context.canvas.height - read(run.drawn + k) * pixels - side / 2;
      context.fillRect(left, top, side, side);
    }
  });
}
