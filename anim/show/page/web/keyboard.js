// Keys, and the sheet that lists them.

import { $, make } from "./dom.js";

/** bindings: [{keys: [" "], label: "play or pause", run(event), isShown}]; keys are those of KeyboardEvent.key. */
export function listenToKeys(bindings) {
  const byKey = new Map(bindings.flatMap((each) => each.keys.map((key) => [key, each])));
  addEventListener("keydown", (event) => {
    const tag = event.target.tagName;
    if (event.ctrlKey || event.metaKey || event.altKey || $("#keys").open) return;
    if (tag === "SELECT" || (tag === "INPUT" && event.target.type === "search")) return;
    if (event.key === " " && tag === "BUTTON" && event.target.id !== "play") return;
    if (event.key === " " && tag === "SUMMARY") return;
    if (event.key.startsWith("Page") && event.target.closest("#side")) return; // lists scroll
    const binding = byKey.get(event.key.length === 1 ? event.key.toLowerCase() : event.key);
    if (!binding || binding.isShown === false) return;
    event.preventDefault();
    binding.run(event);
  });
  addEventListener("click", releaseFocus);
  const rows = bindings
    .filter((each) => each.isShown !== false)
    .map((each) => {
      const keys = each.keys.map((key) => make("kbd", {}, LABELS[key] ?? key.toUpperCase()));
      return make("div", {}, make("span", {}, ...keys), each.label);
    });
  $("#keys .list").append(...rows);
}

/** Take the focus from a button that the mouse or a finger pressed, so that the space bar plays; keys keep theirs. */
function releaseFocus(event) {
  if (event.detail > 0) event.target.closest("button, summary")?.blur();
}

const LABELS = { " ": "space", ArrowLeft: "←", ArrowRight: "→", Home: "Home", End: "End", PageUp: "PgUp", PageDown: "PgDn" };

export function openSheet() {
  $("#keys").showModal();
}
