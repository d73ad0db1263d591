// The list of clips: seconds, errors, figures of `inspect`; filtered and sorted.

import { breakable, make, setPressed } from "./dom.js";
import { filtered } from "./filter.js";
import { formatLength, formatTime } from "./format.js";
import { state, update } from "./state.js";

const NUM_BRIEF = 3; // figures of a clip that is not chosen
const FILE_ORDER = "file order";

/** Rows of all clips, below a filter and the order. */
export function clipList(side, facts, chooseClip) {
  const longest = Math.max(...side.clips.map((clip) => clip.duration), 1e-6);
  const rows = side.clips.map((clip, i) => {
    const error = facts.errors?.[i]?.max;
    const bar = make("i", { class: "bar" });
    bar.style.setProperty("--part", clip.duration / longest);
    return make(
      "button",
      { class: "row", "data-clip": i, title: side.clipNames[i], onclick: () => chooseClip(i) },
      make("span", { class: "name" }, ...breakable(side.clipNames[i])),
      error === undefined ? null : make("span", { class: error ? "hot" : "dim" }, formatLength(error)),
      make("span", { class: "dim" }, formatTime(clip.duration)),
      figures(facts.figures?.[i] ?? []),
      bar,
    );
  });
  if (!rows.length) return [make("p", { class: "about" }, "No animation in this file.")];
  const orders = clipOrders(side, facts);
  const options = [...orders.keys()].map((name) => make("option", { value: name }, name === FILE_ORDER ? name : `by ${name}`));
  const sort = make("select", { id: "sort", "aria-label": "Sort clips by", title: "Sort clips by" }, ...options);
  sort.addEventListener("change", () => update({ sort: sort.value === FILE_ORDER ? "" : sort.value }));
  return filtered(rows, "clips", sort);
}

/** Orders of the list by name, each a list of clip indices; figures begin with the largest. */
function clipOrders(side, facts) {
  const clips = side.clips.map((_, i) => i);
  const down = (value) => [...clips].sort((i, k) => (value(k) ?? -1) - (value(i) ?? -1));
  const names = new Intl.Collator(undefined, { numeric: true });
  const orders = new Map([
    [FILE_ORDER, clips],
    ["name", [...clips].sort((i, k) => names.compare(side.clipNames[i], side.clipNames[k]))],
    ["duration", down((i) => side.clips[i].duration)],
  ]);
  if (Object.keys(facts.errors ?? {}).length) orders.set("error", down((i) => facts.errors[i]?.max));
  for (const { label } of Object.values(facts.figures ?? {}).flat()) {
    if (!orders.has(label)) orders.set(label, down((i) => facts.figures[i]?.find((each) => each.label === label)?.value));
  }
  return orders;
}

/** Put the rows in the order of `state.sort`; an order that the page lacks is that of the file. */
export function sortClips(side, facts) {
  const sort = document.getElementById("sort");
  if (!sort) return;
  const orders = clipOrders(side, facts);
  const name = orders.has(state.sort) ? state.sort : FILE_ORDER;
  sort.value = name;
  const list = sort.closest("[role=tabpanel]");
  const rows = new Map([...list.querySelectorAll("[data-clip]")].map((row) => [Number(row.dataset.clip), row]));
  list.append(...orders.get(name).map((i) => rows.get(i)));
  list.scrollTop = 0;
}

export function markClip(index) {
  for (const button of document.querySelectorAll("[data-clip]")) {
    setPressed(button, Number(button.dataset.clip) === index);
  }
}

/** The clip after or before another one in the list as it is sorted and filtered; null if there is none. */
export function nextClip(index, direction) {
  const rows = [...document.querySelectorAll("[data-clip]")].filter((row) => !row.hidden);
  const at = rows.findIndex((row) => Number(row.dataset.clip) === index);
  const next = at < 0 ? rows[0] : rows[(at + direction + rows.length) % rows.length];
  return next ? Number(next.dataset.clip) : null;
}

/** Figures of a clip as terms and values; all of them where the clip is chosen. */
function figures(list) {
  if (!list.length) return null;
  const pairs = list.map(({ label, text }, i) =>
    make("span", { class: i < NUM_BRIEF ? "figure" : "figure more" }, `${label} `, make("b", {}, text)),
  );
  return make("span", { class: "figures" }, ...pairs);
}
