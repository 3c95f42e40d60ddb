/* The viewer of a report: runs as particles over time, and lumps anew under any setting.
 *
 * Bonds between particles are laid when the snow is released.  A break strain is a step of a ladder; of each bond it
 * is known, for each embedded frame, from which step on it has held so far.  What is held together at a step is
 * worked out as snowrepro/analysis/tree.py does, so that the numbers are those that snowrepro.classify finds.
 */
(() => {
  "use strict";

  const $ = (name) => document.getElementById(`viewer-${name}`);
  const SIDES = ["left", "right"];
  const ROUND_OFF = 1e-12; // of a sum of masses, as in snowrepro/analysis/fragments.py
  const SQUARE = Math.sqrt(Math.PI) / 2; // side of a square that covers what a disc of diameter 1 does
  const STILL_MS = 700; // for which a frame stands where motion is unwanted
  const SAY_AFTER_MS = 500; // so that what is read aloud does not follow a slider step by step
  const SIGN_NAMES = { both: "stretch or crushing", stretch: "stretch alone", crush: "crushing alone" };

  // --- Unpacking: see snowrepro/report/packing.py -------------------------------------------------------------------

  async function inflate(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  /** Whole numbers from their four planes of bytes. */
  async function inflateNumbers(text) {
    const bytes = await inflate(text);
    const count = bytes.length / 4;
    const numbers = new Int32Array(count);
    for (let i = 0; i < count; i++) {
      const zigzag = bytes[i] | (bytes[count + i] << 8) | (bytes[2 * count + i] << 16) | (bytes[3 * count + i] << 24);
      numbers[i] = (zigzag >>> 1) ^ -(zigzag & 1);
    }
    return numbers;
  }

  /** Undo differences in time: in blocks of `rows` rows of `width` numbers, each row adds to the one before. */
  function accumulate(numbers, width, rows) {
    for (let block = 0; block < numbers.length; block += width * rows) {
      for (let i = block + width; i < block + width * rows; i++) numbers[i] += numbers[i - width];
    }
    return numbers;
  }

  /** A run ready to be drawn and cut: numbers unpacked, and each particle's bonds listed. */
  async function unpackRun(run, data) {
    const frames = data.frames.length;
    const bonded = frames - data.release;
    const places = await inflateNumbers(run.places);
    const drawn = places.length / (2 * frames);
    const fields = {};
    for (const { key } of data.fields) fields[key] = accumulate(await inflate(run.fields[key]), drawn, frames);
    return {
      ...run,
      drawn,
      places: accumulate(places, 2 * drawn, frames),
      fields,
      gone: run.gone && (await inflateNumbers(run.gone)),
      bonds: {
        count: run.bonds.count,
        ...byParticle(await inflateNumbers(run.bonds.pairs), run.particles),
        steps: accumulate(await inflate(run.bonds.steps), run.bonds.count, bonded),
        corrections: accumulate(await inflate(run.bonds.corrections), run.bonds.count, bonded),
      },
    };
  }

  /** Ends of the bonds, and for particle i, from start[i] to start[i + 1], its bonds by rising number. */
  function byParticle(pairs, particles) {
    const count = pairs.length / 2;
    const one = accumulate(pairs.slice(0, count), 1, count);
    const other = pairs.slice(count).map((apart, bond) => one[bond] + apart);
    const start = new Int32Array(particles + 1);
    for (let bond = 0; bond < count; bond++) {
      start[one[bond] + 1]++;
      start[other[bond] + 1]++;
    }
    for (let i = 0; i < particles; i++) start[i + 1] += start[i];
    const next = start.slice();
    const bondOf = new Int32Array(2 * count);
    for (let bond = 0; bond < count; bond++) {
      bondOf[next[one[bond]]++] = bond;
      bondOf[next[other[bond]]++] = bond;
    }
    return { one, other, start, bondOf };
  }

  // --- Lumps: the rule of snowrepro/analysis/tree.py in steps of the ladder -----------------------------------------

  /** From which step on each bond has held by itself up to a frame: stretch, crushing, or the worse of both. */
  function strainSteps(run, data, frame, sign) {
    const { count, steps } = run.bonds;
    const at = (which) => (which * (data.frames.length - data.release) + frame - data.release) * count;
    const stretch = steps.subarray(at(0), at(0) + count);
    const crush = steps.subarray(at(1), at(1) + count);
    if (sign === "stretch") return stretch;
    if (sign === "crush") return crush;
    return stretch.map((step, bond) => Math.max(step, crush[bond]));
  }

  /** From which step on each particle is core: it has lost less than `coreFraction` of its bonds. */
  function coreSteps(run, steps, coreFraction) {
    const { start, bondOf } = run.bonds;
    const core = new Uint8Array(run.particles).fill(255); // without bonds: never
    const own = new Uint8Array(bondOf.length);
    for (let k = 0; k < own.length; k++) own[k] = steps[bondOf[k]];
    for (let i = 0; i < run.particles; i++) {
      const degree = start[i + 1] - start[i];
      sortFew(own, start[i], start[i + 1]);
      if (degree) core[i] = own[start[i + 1] - Math.ceil(coreFraction * degree)]; // the most strained come last
    }
    return core;
  }

  /** Sort the numbers from `low` to before `high`, so few that insertion is fastest. */
  function sortFew(numbers, low, high) {
    for (let i = low + 1; i < high; i++) {
      const value = numbers[i];
      let place = i;
      for (; place > low && numbers[place - 1] > value; place--) numbers[place] = numbers[place - 1];
      numbers[place] = value;
    }
  }

  /** From which step on each bond holds its ends in one fragment: both are core, or one hangs on the other by it. */
  function holdingSteps(run, steps, core) {
    const { count, one, other, start, bondOf } = run.bonds;
    const holds = new Uint8Array(count);
    for (let bond = 0; bond < count; bond++) holds[bond] = Math.max(steps[bond], core[one[bond]], core[other[bond]]);
    for (let i = 0; i < run.particles; i++) {
      let earliest = Infinity;
      let hangs = -1;
      for (let k = start[i]; k < start[i + 1]; k++) {
        const bond = bondOf[k];
        const neighbour = one[bond] === i ? other[bond] : one[bond];
        const step = Math.max(steps[bond], core[neighbour]);
        if (step >= earliest) continue; // of several that tie the first counts
        earliest = step;
        hangs = bond;
      }
      if (hangs >= 0) holds[hangs] = Math.min(holds[hangs], earliest);
    }
    return holds;
  }

  /** The same, right where strains within one step decide on which core a particle hangs. */
  function rightHoldingSteps(run, data, frame, sign, core) {
    const steps = strainSteps(run, data, frame, data.signs[sign]);
    const holds = holdingSteps(run, steps, coreSteps(run, steps, data.cores[core]));
    const set = sign * data.cores.length + core;
    const first = (set * (data.frames.length - data.release) + frame - data.release) * run.bonds.count;
    for (let bond = 0; bond < holds.length; bond++) holds[bond] += run.bonds.corrections[first + bond]; // modulo 256
    return holds;
  }

  /** The fragment of each particle, by the number of one of its particles: union-find over the bonds that hold. */
  function fragmentsAt(run, holds, step) {
    const parent = new Int32Array(run.particles).map((_, i) => i);
    const rootOf = (i) => {
      while (parent[i] !== i) i = parent[i] = parent[parent[i]];
      return i;
    };
    for (let bond = 0; bond < holds.length; bond++) {
      if (holds[bond] > step) continue;
      const a = rootOf(run.bonds.one[bond]);
      const b = rootOf(run.bonds.other[bond]);
      if (a !== b) parent[Math.max(a, b)] = Math.min(a, b);
    }
    for (let i = 0; i < run.particles; i++) parent[i] = rootOf(i);
    return parent;
  }

  const massOf = (run, i) => run.mass[run.mass.length > 1 ? i : 0];
  const isGone = (run, frame, i) => run.gone !== null && run.gone[i] <= frame;

  /** Lumps at a frame, heaviest first: numbers and masses of their fragments, and the part of all mass in them. */
  function lumpsOf(run, frame, fragment, leastMass) {
    const mass = new Float64Array(run.particles);
    for (let i = 0; i < run.particles; i++) {
      if (!isGone(run, frame, i)) mass[fragment[i]] += massOf(run, i); // what has vanished is no part of a lump
    }
    const least = Math.max(leastMass * run.total, run.least) * (1 - ROUND_OFF);
    const lumps = [];
    mass.forEach((value, name) => value > 0 && value >= least && lumps.push({ name, mass: value }));
    lumps.sort((a, b) => b.mass - a.mass);
    return { frame, fragment, lumps, part: lumps.reduce((sum, lump) => sum + lump.mass, 0) / run.total };
  }

  /** Finds lumps under the present settings, and remembers what the next question may need again. */
  function makeFinder(data) {
    let settings = null;
    const memory = new Map(); // run -> what holds by frame, lumps by frame, colours by frame

    const memoryOf = (run) => {
      if (!memory.has(run)) memory.set(run, { holds: new Map(), lumps: new Map(), colours: [] });
      return memory.get(run);
    };
    const remember = (map, key, make) => {
      if (!map.has(key)) map.set(key, make());
      return map.get(key);
    };

    /** What holds does not depend on the step, nor on the least mass: a slider needs but a new cut. */
    const use = (now) => {
      const sameBonds = settings && settings.sign === now.sign && settings.core === now.core;
      for (const kept of memory.values()) {
        kept.lumps.clear();
        kept.colours = [];
        if (!sameBonds) kept.holds.clear();
      }
      settings = { ...now };
    };
    const lumpsAt = (run, frame) =>
      remember(memoryOf(run).lumps, frame, () => {
        const { sign, core, step, mass } = settings;
        const holds = remember(memoryOf(run).holds, frame, () => rightHoldingSteps(run, data, frame, sign, core));
        return lumpsOf(run, frame, fragmentsAt(run, holds, step), data.lump_masses[mass]);
      });
    /** Colours go by ancestry, so those of all frames before are needed. */
    const coloursAt = (run, frame) => {
      const { colours } = memoryOf(run);
      for (let at = data.release + colours.length; at <= frame; at++) {
        colours.push(lumpColours(run, lumpsAt(run, at), colours[colours.length - 1], data.colours.lumps.length));
      }
      return colours[frame - data.release];
    };
    return { use, lumpsAt, coloursAt, settings: () => settings };
  }

  // --- Colours: as fragment_colours in snowrepro/report/drawing.py --------------------------------------------------

  /** Number of each lump's colour: the heaviest heir of a lump keeps its, another takes what the least mass has. */
  function lumpColours(run, now, before, colours) {
    const colourOf = new Map();
    const taken = new Array(colours).fill(0);
    const give = (lump, colour) => {
      colourOf.set(lump.name, colour);
      taken[colour] += lump.mass;
    };
    const heirs = before ? heirsOf(run, now, before.now) : new Map();
    for (const lump of now.lumps) {
      if (heirs.has(lump.name)) give(lump, before.colourOf.get(heirs.get(lump.name)));
    }
    for (const lump of now.lumps) {
      if (!colourOf.has(lump.name)) give(lump, taken.indexOf(Math.min(...taken)));
    }
    return { now, colourOf };
  }

  /** Which lumps are the heaviest heir of which lump before; the parent of a lump is what holds most of its mass. */
  function heirsOf(run, now, before) {
    const shared = new Map(now.lumps.map((lump) => [lump.name, new Map()]));
    now.fragment.forEach((name, i) => {
      const parts = shared.get(name);
      if (!parts || isGone(run, now.frame, i)) return;
      const parent = before.fragment[i];
      parts.set(parent, (parts.get(parent) || 0) + massOf(run, i));
    });
    const best = new Map(before.lumps.map((lump) => [lump.name, { heir: null, part: 0 }]));
    for (const [heir, parts] of shared) {
      const [parent, part] = [...parts].reduce((most, each) => (each[1] > most[1] ? each : most));
      if (best.has(parent) && part > best.get(parent).part) best.set(parent, { heir, part });
    }
    return new Map([...best].filter(([, { heir }]) => heir !== null).map(([parent, { heir }]) => [heir, parent]));
  }

  /** Number of the colour of each particle that is drawn, and the colours. */
  function paint(run, data, finder, frame, by) {
    if (by === "fragment") return paintFragments(run, data, finder, frame);
    if (by === "damage") return paintDamage(run, data, finder, frame);
    const levels = run.fields[by].subarray(frame * run.drawn, (frame + 1) * run.drawn);
    const { shades } = data.colours;
    return { shades, numbers: levels.map((level) => Math.round((level / (data.levels - 1)) * (shades.length - 1))) };
  }

  function paintFragments(run, data, finder, frame) {
    const { lumps, powder, snow } = data.colours;
    const shades = [...lumps, powder, snow];
    if (frame < data.release) return { shades, numbers: new Uint8Array(run.drawn).fill(lumps.length + 1) };
    const { now, colourOf } = finder.coloursAt(run, frame);
    const numbers = Uint8Array.from({ length: run.drawn }, (_, k) => {
      const colour = colourOf.get(now.fragment[k * data.thinning]);
      return colour === undefined ? lumps.length : colour;
    });
    return { shades, numbers };
  }

  /** By the part of its bonds that a particle has lost. */
  function paintDamage(run, data, finder, frame) {
    const { shades } = data.colours;
    if (frame < data.release) return { shades, numbers: new Uint8Array(run.drawn) };
    const { start, bondOf } = run.bonds;
    const { sign, step } = finder.settings();
    const steps = strainSteps(run, data, frame, data.signs[sign]);
    const numbers = Uint8Array.from({ length: run.drawn }, (_, k) => {
      const own = bondOf.subarray(start[k * data.thinning], start[k * data.thinning + 1]);
      const lost = own.reduce((sum, bond) => sum + (steps[bond] > step), 0);
      return Math.round((own.length ? lost / own.length : 0) * (shades.length - 1));
    });
    return { shades, numbers };
  }

  // --- Claims: as `points` in snowrepro/analysis/claims.py ----------------------------------------------------------

  /** Mean over the runs of one arm and pressure, by rising pressure. */
  function meansOf(runs, arm, value) {
    const groups = new Map();
    for (const run of runs.filter((each) => each.arm === arm)) {
      groups.set(run.pressure, [...(groups.get(run.pressure) || []), value(run)]);
    }
    const mean = (values) => values.reduce((sum, each) => sum + each, 0) / values.length;
    return new Map([...groups].sort((a, b) => a[0] - b[0]).map(([pressure, values]) => [pressure, mean(values)]));
  }

  /** Whether the values that `value` gives for runs of one scene point a claim's way; null if they cannot tell. */
  function agrees(claim, runs, value) {
    const sintered = meansOf(runs, "sintered", value);
    const unsintered = meansOf(runs, "unsintered", value);
    let pairs = [...(claim.of === "unsintered" ? unsintered : sintered)];
    if (claim.of === "contrast") {
      pairs = pairs.filter(([p]) => unsintered.has(p)).map(([p, mean]) => [p, mean - unsintered.get(p)]);
    }
    const values = pairs.map(([, mean]) => mean);
    const chosen = { every: values, lowest: values.slice(0, 1), highest: values.slice(-1) }[claim.at];
    if (chosen.length < (claim.test === "rises" ? 2 : 1)) return null;
    if (claim.test === "below") return chosen.every((each) => each < claim.threshold);
    if (claim.test === "above") return chosen.every((each) => each > claim.threshold);
    const rise = chosen[chosen.length - 1] - chosen[0];
    return rise > claim.threshold && chosen.slice(1).every((each, k) => each > chosen[k]);
  }

  const verdict = (holds) => (holds === null ? "no answer" : holds ? "agree" : "disagree");

  // --- Drawing ------------------------------------------------------------------------------------------------------

  /** Fit a canvas to its box and to the screen's pixels; returns pixels in a unit of length. */
  function fit(canvas, run) {
    canvas.style.aspectRatio = `${run.width} / ${run.height}`;
    const width = Math.max(1, Math.round(canvas.clientWidth * (window.devicePixelRatio || 1)));
    const height = Math.round((width * run.height) / run.width);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    return width / run.width;
  }

  function drawStage(context, run, colours, scale) {
    const { width, height } = context.canvas;
    context.fillStyle = colours.sky;
    context.fillRect(0, 0, width, height);
    context.fillStyle = colours.floor;
    context.beginPath();
    for (const [x, y] of run.floor) context.lineTo(x * scale, height - y * scale);
    context.fill();
  }

  /** Squares as large as the discs of the report's pictures, which take much longer to fill. */
  function drawSnow(context, run, { shades, numbers }, at, scale) {
    const frame = Math.floor(at);
    const on = at - frame;
    const now = run.places.subarray(frame * 2 * run.drawn);
    const next = on ? run.places.subarray((frame + 1) * 2 * run.drawn) : now;
    const side = run.diameter * SQUARE * scale;
    const pixels = run.quantum * scale;
    const along = (k) => now[k] + on * (next[k] - now[k]);
    const thinning = Math.round(run.particles / run.drawn);
    shades.forEach((shade, number) => {
      context.fillStyle = shade;
      for (let k = 0; k < run.drawn; k++) {
        if (numbers[k] !== number || isGone(run, frame, k * thinning)) continue;
        const left = along(k) * pixels - side / 2;
        const top = context.canvas.height - along(run.drawn + k) * pixels - side / 2;
        context.fillRect(left, top, side, side);
      }
    });
  }

  // --- Controls -----------------------------------------------------------------------------------------------------

  const element = (tag, text, attributes = {}) => {
    const made = Object.assign(document.createElement(tag), attributes);
    if (text !== undefined) made.textContent = text;
    return made;
  };

  const fill = (select, options) =>
    select.append(...options.map(([value, text]) => element("option", text, { value: String(value) })));

  const percent = (part) => `${Number((100 * part).toPrecision(3))} %`;

  /** Where each of the report's own settings is in its ladder or list. */
  function reportSettings(data) {
    return {
      step: data.ladder.indexOf(data.report.break_strain),
      mass: data.lump_masses.indexOf(data.report.lump_mass),
      sign: data.signs.indexOf(data.report.break_by),
      core: data.cores.indexOf(data.report.core_fraction),
    };
  }

  function fillControls(data, runs) {
    const fields = data.fields.map(({ key, name }) => [key, name]);
    fill($("colour"), [["fragment", "fragment"], ...fields, ["damage", "damage (bonds lost)"]]);
    const labels = runs.map((run, number) => [number, run.label]);
    fill($("run-left"), labels);
    fill($("run-right"), [...labels, ["", "none"]]);
    fill($("sign"), data.signs.map((sign, number) => [number, SIGN_NAMES[sign]]));
    fill($("core"), data.cores.map((core, number) => [number, core < 1 ? String(core) : "1 (no core rule)"]));
    $("time").max = data.frames.length - 1;
    $("strain").max = data.ladder.length - 1;
    $("mass").max = data.lump_masses.length - 1;
    // What differs most: the hardest-pressed run with sintering beside the one without.
    const left = runs.map((run) => run.arm).lastIndexOf("sintered");
    $("run-left").value = String(Math.max(left, 0));
    $("run-right").value = left === runs.length - 1 ? "" : String(runs.length - 1);
  }

  function showSettings(data, settings) {
    const own = (same) => (same ? " (the report's)" : "");
    const report = reportSettings(data);
    const strain = `${data.ladder[settings.step]}${own(settings.step === report.step)}`;
    const mass = `${percent(data.lump_masses[settings.mass])}${own(settings.mass === report.mass)}`;
    $("strain").value = settings.step;
    $("mass").value = settings.mass;
    $("sign").value = settings.sign;
    $("core").value = settings.core;
    $("strain-now").value = strain;
    $("mass-now").value = data.lump_cells ? `${mass}, but at least ${data.lump_cells} cells` : mass;
    $("strain").setAttribute("aria-valuetext", strain);
    $("mass").setAttribute("aria-valuetext", mass);
  }

  function showLegend(data, by) {
    const { lumps, powder, snow, shades } = data.colours;
    const swatch = (colours, text) => {
      const boxes = element("span", undefined, { className: "viewer-swatches", ariaHidden: "true" });
      boxes.append(...colours.map((colour) => element("i", undefined, { style: `background: ${colour}` })));
      const item = element("span");
      item.append(boxes, text);
      return item;
    };
    if (by === "fragment") {
      $("legend").replaceChildren(
        swatch(lumps, "lumps, by fragment"), swatch([powder], "powder"), swatch([snow], "not yet released"));
      return;
    }
    const damage = { low: 0, high: 1, name: "damage", unit: "part of a particle's bonds" };
    const { low, high, name, unit } = data.fields.find(({ key }) => key === by) || damage;
    const bar = element("div", undefined, { style: `background: linear-gradient(90deg, ${shades.join(", ")})` });
    const ends = element("div");
    const shown = [low, (low + high) / 2, high].map((value) => String(Number(value.toPrecision(3))));
    if (by !== "damage") [shown[0], shown[2]] = [`\u2264 ${shown[0]}`, `\u2265 ${shown[2]}`];
    ends.append(...shown.map((value) => element("span", value)));
    const scale = element("div", undefined, { className: "viewer-scale" });
    scale.append(bar, ends);
    $("legend").replaceChildren(element("span", unit === "1" ? name : `${name} [${unit}]`), scale);
  }

  /** A number with all its digits kept beside those shown. */
  const part = (value) => element("data", value.toFixed(3), { value: String(value) });

  /** Rows of the two tables, made once; returns how to bring them up to date, which gives what became of the claims. */
  function makeTables(data, runs) {
    const numbers = runs.map((run) => {
      const row = $("runs").insertRow();
      const now = element("td", undefined, { className: "viewer-part" });
      const report = element("td");
      const lumps = element("td");
      row.append(element("th", run.label, { scope: "row" }), now, report, lumps);
      report.append(part(run.lump_fraction));
      return { run, now, lumps };
    });
    const scenes = [...new Set(runs.map((run) => run.scene))];
    const claims = scenes.flatMap((scene) => data.claims.map((claim) => claimRow(data, runs, scene, claim, scenes)));
    return (found) => {
      for (const { run, now, lumps } of numbers) {
        const { part: value, lumps: list } = found(run);
        now.replaceChildren(part(value));
        now.style.setProperty("--part", value);
        lumps.textContent = list.length;
      }
      return claims.map((update) => update((run) => found(run).part));
    };
  }

  /** One claim about one scene; returns how to judge it anew. */
  function claimRow(data, runs, scene, claim, scenes) {
    const own = runs.filter((run) => run.scene === scene);
    const name = scenes.length > 1 ? `${claim.name}, ${scene}` : claim.name;
    const judged = (value) => (data.incomplete.includes(scene) ? null : agrees(claim, own, value));
    const report = judged((run) => run.lump_fraction);
    const now = element("td");
    const row = $("claims").insertRow();
    row.append(element("th", `${name}: ${claim.statement}`, { scope: "row" }), now, element("td", verdict(report)));
    return (value) => {
      const holds = judged(value);
      now.textContent = verdict(holds);
      now.classList.toggle("viewer-differs", holds !== report);
      return { name, holds };
    };
  }

  /** Frame by its place in the list, whole or between two, at which a time falls. */
  function placeOf(seconds, time) {
    const after = seconds.findIndex((each) => each > time);
    if (after < 0) return seconds.length - 1;
    return Math.max(0, after - 1 + (time - seconds[after - 1]) / (seconds[after] - seconds[after - 1]));
  }

  function timeOf(seconds, at) {
    const frame = Math.floor(at);
    return frame === at ? seconds[frame] : seconds[frame] + (at - frame) * (seconds[frame + 1] - seconds[frame]);
  }

  /** Frames go by: `view.at` is the place in the list of frames, whole or between two, `draw` shows it. */
  function makePlayer(data, view, draw) {
    const still = window.matchMedia("(prefers-reduced-motion: reduce)");
    let stood = 0; // for so long a frame has been shown, where motion is unwanted

    function advance(passed) {
      if (!still.matches) {
        const seconds = (Number($("speed").value) * passed) / 1000;
        view.at = placeOf(data.seconds, timeOf(data.seconds, view.at) + seconds);
        return;
      }
      stood += passed;
      if (stood < STILL_MS) return;
      stood = 0;
      view.at = Math.floor(view.at) + 1;
    }

    function play() {
      if (view.at >= view.last) view.at = 0;
      $("play").textContent = "Stop";
      let before = performance.now();
      const tick = (now) => {
        advance(Math.max(0, now - before));
        before = now;
        if (view.at >= view.last) return goTo(view.last);
        view.playing = requestAnimationFrame(tick);
        return draw();
      };
      view.playing = requestAnimationFrame(tick);
    }

    function stop() {
      cancelAnimationFrame(view.playing);
      view.playing = null;
      $("play").textContent = "Play";
      draw();
    }

    function goTo(frame) {
      view.at = Math.min(Math.max(frame, 0), view.last);
      stop();
    }

    return { goTo, toggle: () => (view.playing ? stop() : play()) };
  }

  /** The two pictures and what is said below them; returns what draws them. */
  function makePanes(data, runs, finder, view) {
    function captionOf(run, frame) {
      if (frame < data.release) return ["pressed, not yet released."];
      const { part: value, lumps } = finder.lumpsAt(run, frame);
      return ["mass in lumps ", part(value), `, number of lumps ${lumps.length}.`];
    }

    function drawPane(side) {
      const run = runs[Number($(`run-${side}`).value || NaN)];
      const [canvas, caption] = [$(`canvas-${side}`), $(`caption-${side}`)];
      canvas.hidden = caption.hidden = !run;
      if (!run) return;
      const frame = Math.floor(view.at);
      const scale = fit(canvas, run);
      const context = canvas.getContext("2d");
      drawStage(context, run, data.colours, scale);
      drawSnow(context, run, paint(run, data, finder, frame, $("colour").value), view.at, scale);
      caption.replaceChildren(`Frame ${data.frames[frame]}: `, ...captionOf(run, frame));
      if (!view.playing) canvas.setAttribute("aria-label", `${run.label}. ${caption.textContent}`);
    }

    return () => {
      const frame = data.frames[Math.floor(view.at)];
      const told = `frame ${frame}, ${timeOf(data.seconds, view.at).toFixed(2)} s`;
      $("time").value = Math.round(view.at);
      $("time").setAttribute("aria-valuetext", told);
      $("time-now").value = told;
      SIDES.forEach(drawPane);
    };
  }

  /** At most one drawing before the screen is painted next, however often it is asked for. */
  function oncePerFrame(draw) {
    let due = false;
    return () => {
      if (!due) requestAnimationFrame(() => ((due = false), draw()));
      due = true;
    };
  }

  /** Says what came out, once the reader has paused. */
  function makeSpeaker(data) {
    let waiting = 0;
    return ({ step, mass, sign, core }, claims) => {
      const those = (wanted) => claims.filter(({ holds }) => holds === wanted).map(({ name }) => name);
      const list = (wanted) => those(wanted).join(", ") || "none";
      const chosen =
        `Break strain ${data.ladder[step]} by ${SIGN_NAMES[data.signs[sign]]}, core rule ${data.cores[core]}, ` +
        `lumps from ${percent(data.lump_masses[mass])}.`;
      const found = `The numbers agree with: ${list(true)}; disagree with: ${list(false)}.`;
      clearTimeout(waiting);
      waiting = setTimeout(() => ($("status").textContent = `${chosen} ${found}`), SAY_AFTER_MS);
    };
  }

  function listenToKeys(canvas, view, player) {
    const moves = {
      " ": player.toggle,
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
    canvas.addEventListener("click", player.toggle);
  }

  /** Everything that reacts to the reader. */
  function start(data, runs) {
    const view = { at: data.frames.length - 1, last: data.frames.length - 1, playing: null };
    const settings = reportSettings(data);
    const finder = makeFinder(data);
    const updateTables = makeTables(data, runs);
    const draw = oncePerFrame(makePanes(data, runs, finder, view));
    const say = makeSpeaker(data);
    const player = makePlayer(data, view, draw);
    const onInput = (name, act) => $(name).addEventListener("input", () => act(Number($(name).value)));

    function change(settled) {
      Object.assign(settings, settled);
      finder.use(settings);
      showSettings(data, settings);
      say(settings, updateTables((run) => finder.lumpsAt(run, view.last)));
      draw();
    }

    onInput("strain", (step) => change({ step }));
    onInput("mass", (mass) => change({ mass }));
    onInput("sign", (sign) => change({ sign }));
    onInput("core", (core) => change({ core }));
    onInput("time", player.goTo);
    $("reset").addEventListener("click", () => change(reportSettings(data)));
    $("play").addEventListener("click", player.toggle);
    $("colour").addEventListener("input", () => (showLegend(data, $("colour").value), draw()));
    const resized = new ResizeObserver(draw);
    for (const side of SIDES) {
      $(`run-${side}`).addEventListener("input", draw);
      listenToKeys($(`canvas-${side}`), view, player);
      resized.observe($(`canvas-${side}`));
    }
    showLegend(data, $("colour").value);
    change({});
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
    const runs = [];
    for (const run of data.runs) runs.push(await unpackRun(run, data));
    fillControls(data, runs);
    $("wait").hidden = true;
    $("body").hidden = false;
    start(data, runs);
  }

  main();
})();
