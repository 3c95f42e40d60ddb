/* In: names of the viewer's elements, and texts.  Out: these elements, and new ones to put into them. */

export const SIDES = ["left", "right"];

export const $ = (name) => document.getElementById(`viewer-${name}`);

export function makeElement(tag, text, attributes = {}) {
  const made = Object.assign(document.createElement(tag), attributes);
  if (text !== undefined) made.textContent = text;
  return made;
}

/** A number with all its digits kept beside those shown. */
export function makeNumber(value) {
  return makeElement("data", value.toFixed(3), { value: String(value) });
}

/** Offer a choice; `options`: pairs of what is chosen and what is read. */
export function fillSelect(name, options) {
  $(name).append(...options.map(([value, text]) => makeElement("option", text, { value: String(value) })));
}
