/* In: a run as snowrepro/report/viewer/embedded.py and packing.py packed it, texts of base64.
 * Out: the same run with arrays of numbers. */

async function inflateBytes(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Whole numbers with sign from their four planes of bytes. */
async function inflateNumbers(text) {
  const bytes = await inflateBytes(text);
  const count = bytes.length / 4;
  const numbers = new Int32Array(count);
  for (let i = 0; i < count; i++) {
    const zigzag = bytes[i] | (bytes[count + i] << 8) | (bytes[2 * count + i] << 16) | (bytes[3 * count + i] << 24);
    numbers[i] = (zigzag >>> 1) ^ -(zigzag & 1);
  }
  return numbers;
}

/** Undo differences in place: in blocks of `rows` rows of `width` numbers, each row adds to the one before. */
function addDifferences(numbers, width, rows) {
  for (let block = 0; block < numbers.length; block += width * rows) {
    for (let i = block + width; i < block + width * rows; i++) numbers[i] += numbers[i - width];
  }
  return numbers;
}

/** A run ready to be drawn; `data`: what all runs share. */
export async function unpackRun(run, data) {
  const frames = data.frames.length;
  const places = await inflateNumbers(run.places);
  const drawn = places.length / (2 * frames);
  const fields = {};
  for (const { key } of data.fields) {
    fields[key] = addDifferences(await inflateBytes(run.fields[key]), drawn, frames);
  }
  return {
    ...run,
    drawn,
    places: addDifferences(places, 2 * drawn, frames),
    fields,
    colours: addDifferences(await inflateBytes(run.colours), drawn, frames),
    gone: run.gone && (await inflateNumbers(run.gone)),
  };
}
