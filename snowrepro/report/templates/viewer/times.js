/* In: when each frame is [s], and a time or a place in the list of frames.
 * Out: the other one of these two; a place is whole at a frame, and else lies between two. */

export function findPlace(seconds, time) {
  const after = seconds.findIndex((each) => each > time);
  if (after < 0) return seconds.length - 1;
  return Math.max(0, after - 1 + (time - seconds[after - 1]) / (seconds[after] - seconds[after - 1]));
}

export function findTime(seconds, at) {
  const frame = Math.floor(at);
  return frame === at ? seconds[frame] : seconds[frame] + (at - frame) * (seconds[frame + 1] - seconds[frame]);
}
