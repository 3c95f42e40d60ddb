/* In: a run as snowrepro/report/viewer/embedded.py and packing.py packed it, texts of base64.
 * Out: the same run with arrays of numbers, and each particle's bonds listed. */

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

/** Both particles of each bond. */
function readEnds(pairs) {
  const count = pairs.length / 2;
  const one = addDifferences(pairs.slice(0, count), 1, count);
  const other = pairs.slice(count).map((apart, bond) => one[bond] + apart);
  return { one, other };
}

/** The bonds of particle i, by rising number, are bondOf[start[i]] to before bondOf[start[i + 1]]. */
function listBonds({ one, other }, particles) {
  const start = new Int32Array(particles + 1);
  for (let bond = 0; bond < one.length; bond++) {
    start[one[bond] + 1]++;
    start[other[bond] + 1]++;
  }
  for (let i = 0; i < particles; i++) start[i + 1] += start[i];
  const next = start.slice();
  const bondOf = new Int32Array(2 * one.length);
  for (let bond = 0; bond < one.length; bond++) {
    bondOf[next[one[bond]]++] = bond;
    bondOf[next[other[bond]]++] = bond;
  }
  return { start, bondOf };
}

async function unpackBonds(bonds, particles, frames) {
  const ends = readEnds(await inflateNumbers(bonds.pairs));
  return {
    count: bonds.count,
    ...ends,
    ...listBonds(ends, particles),
    steps: addDifferences(await inflateBytes(bonds.steps), bonds.count, frames),
    corrections: addDifferences(await inflateBytes(bonds.corrections), bonds.count, frames),
  };
}

/** A run ready to be drawn and cut; `data`: what all runs share. */
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
    gone: run.gone && (await inflateNumbers(run.gone)),
    bonds: await unpackBonds(run.bonds, run.particles, frames - data.release),
  };
}
