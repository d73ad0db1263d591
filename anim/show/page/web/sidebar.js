// The list beside the picture: clips, findings and worst positions, nodes, notes.

import { $, make, setPressed } from "./dom.js";
import { formatBytes, formatLength, formatTime } from "./format.js";

const MIN_FILTERED = 12; // nodes from which on there is a filter
const MAX_ROWS = 8; // of a panel, before the rest is folded
const INDENT_PX = 11;
const MAX_INDENT = 10;

/** Fill the sidebar. actions: {chooseClip, chooseNode, follow}. */
export function fillSidebar(sides, facts, actions) {
  const list = $("#side");
  const panels = (facts.panels ?? []).map((panel) => panelSection(panel, actions));
  const clips = clipSection(sides[0], facts, actions);
  list.append(...(sides.length > 1 ? [...panels, clips] : [clips, ...panels])); // of two files the errors matter most
  list.append(nodeSection(sides[0], actions), fileSection(facts));
}

export function markClip(index) {
  for (const button of document.querySelectorAll("[data-clip]")) {
    setPressed(button, Number(button.dataset.clip) === index);
  }
}

/** Scroll the list to a clip chosen by a key; one chosen in the list is in sight. */
export function scrollToClip(index) {
  document.querySelector(`[data-clip="${index}"]`)?.scrollIntoView({ block: "nearest" });
}

export function markNode(index, animated) {
  for (const button of document.querySelectorAll("[data-node]")) {
    setPressed(button, Number(button.dataset.node) === index);
    button.classList.toggle("animated", animated.has(Number(button.dataset.node)));
  }
}

function clipSection(side, facts, { chooseClip }) {
  const longest = Math.max(...side.clips.map((clip) => clip.duration), 1e-6);
  const rows = side.clips.map((clip, i) => {
    const error = facts.errors?.[i]?.max;
    const bar = make("i", { class: "bar" });
    bar.style.setProperty("--part", clip.duration / longest);
    return make(
      "button",
      { class: "row", "data-clip": i, title: side.clipNames[i], onclick: () => chooseClip(i) },
      make("span", { class: "name" }, side.clipNames[i]),
      error === undefined ? null : make("span", { class: error ? "hot" : "dim" }, formatLength(error)),
      make("span", { class: "dim" }, formatTime(clip.duration)),
      bar,
    );
  });
  const empty = make("p", { class: "dim" }, "No animation in this file.");
  return section(`Clips`, String(side.clips.length), ...(rows.length ? rows : [empty]));
}

function nodeSection(side, { chooseNode }) {
  const nodes = [...side.nodes.values()];
  const rows = nodes.map((node) => {
    const button = make(
      "button",
      { class: "row node", "data-node": node.index, title: node.name, onclick: () => chooseNode(node.index) },
      make("span", { class: "name" }, node.name),
    );
    button.style.paddingInlineStart = `${10 + INDENT_PX * Math.min(Math.max(node.depth - 1, 0), MAX_INDENT)}px`;
    return button;
  });
  const filter = make("input", { type: "search", placeholder: "Filter nodes", "aria-label": "Filter nodes" });
  filter.addEventListener("input", () => {
    const text = filter.value.toLowerCase();
    rows.forEach((row, i) => (row.hidden = !nodes[i].name.toLowerCase().includes(text)));
  });
  const found = section("Nodes", String(nodes.length), ...(nodes.length >= MIN_FILTERED ? [filter] : []), ...rows);
  found.classList.add("nodes");
  return found;
}

/** A table of Python's: rows of cells, each row a link to a clip, node and time where it has one. */
function panelSection(panel, { follow }) {
  const rows = panel.rows.map(({ cells, link, level }) => {
    const [name, ...others] = cells;
    const parts = [
      make("span", { class: "name" }, name),
      ...others.map((cell, i) => make("span", { class: panel.hot === i + 1 ? "hot" : "dim" }, cell)),
    ];
    // A sentence, not a table; or a position, whose name has a line of its own
    const shape = !others.length ? "long" : others.length > 1 && link ? "deep" : "";
    const attributes = { class: `row ${shape} ${level ?? ""}`, title: cells.join("  ") };
    return link
      ? make("button", { ...attributes, "data-link": "", onclick: () => follow(link) }, ...parts)
      : make("div", attributes, ...parts);
  });
  if (rows.length <= MAX_ROWS + 1) return section(panel.title, panel.count ?? "", ...rows);
  const more = make("details", { class: "more" }, make("summary", {}, `${rows.length - MAX_ROWS} more`));
  more.append(...rows.slice(MAX_ROWS));
  return section(panel.title, panel.count ?? "", ...rows.slice(0, MAX_ROWS), more);
}

function fileSection(facts) {
  const rows = facts.files.flatMap((file) => [
    make(
      "div",
      { class: "row" },
      make("span", { class: "name" }, file.name),
      make("span", { class: "dim" }, file.bytes ? formatBytes(file.bytes) : ""),
    ),
    ...file.notes.map((note) => make("p", { class: "note" }, note)),
  ]);
  return section(facts.files.length > 1 ? "Files" : "File", "", ...rows);
}

function section(title, count, ...children) {
  return make(
    "details",
    { open: "" },
    make("summary", {}, title, make("span", { class: "dim" }, count)),
    ...children,
  );
}
