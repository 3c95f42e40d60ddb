/* In: by what particles are coloured.  Out: the legend: a swatch for each kind, or a scale with numbers and unit. */

import { $, makeElement } from "./elements.js";

function makeSwatch(colours, text) {
  const boxes = makeElement("span", undefined, { className: "viewer-swatches", ariaHidden: "true" });
  boxes.append(...colours.map((colour) => makeElement("i", undefined, { style: `background: ${colour}` })));
  const item = makeElement("span");
  item.append(boxes, text);
  return item;
}

function makeScale(shades, words) {
  const bar = makeElement("div", undefined, { style: `background: linear-gradient(90deg, ${shades.join(", ")})` });
  const ends = makeElement("div");
  ends.append(...words.map((word) => makeElement("span", word)));
  const scale = makeElement("div", undefined, { className: "viewer-scale" });
  scale.append(bar, ends);
  return scale;
}

function showStates({ lumps, crushed, loose, snow }) {
  $("legend").replaceChildren(
    makeSwatch(lumps, "lumps, a colour each"),
    makeSwatch([crushed], "crushed"),
    makeSwatch([loose], "loose"),
    makeSwatch([snow], "not yet released"),
  );
}

/** The outermost colours of a field are also those of what lies beyond. */
function showScale(shades, { low, high, name, unit }) {
  const words = [low, (low + high) / 2, high].map((value) => String(Number(value.toPrecision(3))));
  [words[0], words[2]] = [`\u2264 ${words[0]}`, `\u2265 ${words[2]}`];
  const title = makeElement("span", unit ? `${name} [${unit}]` : name);
  $("legend").replaceChildren(title, makeScale(shades, words));
}

export function showLegend(data, by) {
  const field = data.fields.find(({ key }) => key === by);
  if (field) showScale(data.colours.shades, field);
  else showStates(data.colours);
}
