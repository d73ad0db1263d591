// A filter above a list of rows.

import { make } from "./dom.js";

const MIN_FILTERED = 8; // rows from which on a list has a filter

/** A filter, what is beside it, and the rows, whose titles it looks into. */
export function filtered(rows, what, ...beside) {
  if (rows.length < MIN_FILTERED) return rows;
  const input = make("input", { type: "search", placeholder: `Filter ${what}`, "aria-label": `Filter ${what}`, title: "Filter (/)" });
  const none = make("p", { class: "about", role: "status" }, "");
  const show = () => {
    const text = input.value.trim().toLowerCase();
    for (const row of rows) row.hidden = !row.title.toLowerCase().includes(text);
    none.textContent = rows.every((row) => row.hidden) ? `No ${what} have '${input.value}' in their name.` : "";
  };
  input.addEventListener("input", show);
  input.addEventListener("keydown", (event) => {
    if (event.key === "Enter") [...rows].sort(byPosition).find((row) => !row.hidden)?.click();
    if (event.key !== "Escape") return;
    if (!input.value) input.blur();
    input.value = "";
    show();
  });
  return [make("div", { class: "filter" }, input, ...beside), none, ...rows];
}

/** Rows in the order in which they are shown. */
function byPosition(one, other) {
  return one.compareDocumentPosition(other) & Node.DOCUMENT_POSITION_FOLLOWING ? -1 : 1;
}
