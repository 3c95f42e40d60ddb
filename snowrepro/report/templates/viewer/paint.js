/* In: a run, a frame, and by what to colour: state or a field.
 * Out: `shades`, a list of colours, and `numbers`, which of them each particle that is drawn has. */

const readFrame = (run, values, frame) => values.subarray(frame * run.drawn, (frame + 1) * run.drawn);

export function paintParticles(run, data, frame, by) {
  if (by === "state") return { shades: data.colours.palette, numbers: readFrame(run, run.colours, frame) };
  const { shades } = data.colours;
  const levels = readFrame(run, run.fields[by], frame);
  return { shades, numbers: levels.map((level) => Math.round((level / (data.levels - 1)) * (shades.length - 1))) };
}
