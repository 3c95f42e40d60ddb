/* In: the settings, and what became of the claims under them.
 * Out: sentences for those who hear the page, once the reader has paused. */

import { $ } from "./elements.js";
import { formatPercent, SIGN_NAMES } from "./settings.js";

const SAY_AFTER_MS = 500; // so that what is read aloud does not follow a slider step by step

function describeSettings(data, { step, mass, sign, core }) {
  return (
    `Break strain ${data.ladder[step]} by ${SIGN_NAMES[data.signs[sign]]}, core rule ${data.cores[core]}, ` +
    `lumps from ${formatPercent(data.lump_masses[mass])}.`
  );
}

function describeClaims(claims) {
  const list = (wanted) => claims.filter(({ holds }) => holds === wanted).map(({ name }) => name);
  const say = (wanted) => list(wanted).join(", ") || "none";
  return `The numbers agree with: ${say(true)}; disagree with: ${say(false)}.`;
}

export function makeSpeaker(data) {
  let waiting = 0;
  return (settings, claims) => {
    const text = `${describeSettings(data, settings)} ${describeClaims(claims)}`;
    clearTimeout(waiting);
    waiting = setTimeout(() => {
      $("status").textContent = text;
    }, SAY_AFTER_MS);
  };
}
