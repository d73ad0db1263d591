// The lists beside the picture, one at a time: findings or errors, clips, nodes, files.

import { clipList } from "./clips.js";
import { hasNodes } from "./data.js";
import { $, breakable, make, setPressed } from "./dom.js";
import { filtered } from "./filter.js";
import { formatBytes } from "./format.js";
import { state, update } from "./state.js";

const INDENT_PX = 11;
const MAX_INDENT = 10;
const LINK_TOLERANCE_S = 1e-3; // of times in the address

const links = new Map(); // of rows of panels, in their order

/** Fill the sidebar, and return the name of the list that matters most. actions: {chooseClip, chooseNode, follow}. */
export function fillSidebar(sides, facts, actions) {
  const isPair = sides.length > 1;
  const panels = facts.panels ?? [];
  const numNotes = facts.files.reduce((sum, file) => sum + file.notes.length, 0);
  const lists = [
    ["report", isPair ? "Errors" : "Findings", panels[0]?.count, panels.map((panel) => panelSection(panel, actions))],
    ["clips", "Clips", sides[0].clips.length, clipList(sides[0], facts, actions.chooseClip)],
    ["nodes", "Nodes", sides[0].nodes.size, hasNodes(facts) ? nodeList(sides[0], actions) : []],
    ["files", isPair ? "Files" : "File", numNotes || "", fileList(facts)],
  ].filter(([, , , children]) => children.length);
  const tabs = lists.map(([name, title, count]) =>
    make(
      "button",
      { role: "tab", id: `tab-${name}`, "data-tab": name, "aria-controls": `list-${name}`, onclick: () => update({ tab: name }) },
      title,
      make("span", { class: "dim" }, String(count ?? "")),
    ),
  );
  const bar = make("div", { role: "tablist", "aria-label": "Lists" }, ...tabs);
  bar.addEventListener("keydown", (event) => moveTab(event, tabs));
  const bodies = lists.map(([name, , , children]) =>
    make("div", { role: "tabpanel", id: `list-${name}`, "aria-labelledby": `tab-${name}` }, ...children),
  );
  $("#side").append(bar, ...bodies);
  $("#side").addEventListener("keydown", moveRow);
  return panels.length || sides[0].clips.length || !hasNodes(facts) ? lists[0][0] : "nodes";
}

/** Mark the first row that links to a clip and time of the first file, where the page begins. */
export function markLink(clip, time) {
  const isThere = (link) => link.clip === clip && link.time !== null && Math.abs(link.time - time) < LINK_TOLERANCE_S;
  [...links].find(([, link]) => isThere(link))?.[0].setAttribute("aria-current", "true");
}

export function markTab(name) {
  for (const tab of document.querySelectorAll("[data-tab]")) {
    const isChosen = tab.dataset.tab === name;
    tab.setAttribute("aria-selected", isChosen ? "true" : "false");
    tab.tabIndex = isChosen ? 0 : -1;
    $(`#list-${tab.dataset.tab}`).hidden = !isChosen;
  }
}

export function markNode(index, animated) {
  for (const button of document.querySelectorAll("[data-node]")) {
    setPressed(button, Number(button.dataset.node) === index);
    button.classList.toggle("animated", animated.has(Number(button.dataset.node)));
  }
}

/** Scroll the chosen row of each list into sight: one that was chosen by a key, a link or a click on the picture. */
export function scrollToChosen() {
  for (const row of document.querySelectorAll('#side .row[aria-pressed="true"]')) row.scrollIntoView({ block: "nearest" });
}

/** Show the lists where they cover the picture, on a phone. */
export function showSide(isShown) {
  document.body.classList.toggle("with-side", isShown);
  $("#menu").setAttribute("aria-expanded", isShown ? "true" : "false");
}

/** Put the cursor in the filter of the list that is shown, if it has one. */
export function focusFilter() {
  showSide(true);
  $(`#list-${state.tab} input[type="search"]`)?.focus();
}

/** ← → between tabs, as readers of screens expect. */
function moveTab(event, tabs) {
  const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (!step) return;
  event.preventDefault();
  event.stopPropagation();
  const next = tabs[(tabs.indexOf(event.target.closest("[data-tab]")) + step + tabs.length) % tabs.length];
  update({ tab: next.dataset.tab });
  next.focus();
}

/** ↑ ↓ between the rows of the list, from its filter too. */
function moveRow(event) {
  const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
  if (!step || event.target.tagName === "SELECT") return;
  const rows = [...$(`#list-${state.tab}`).querySelectorAll("button.row")].filter(isReachable);
  const next = rows[rows.indexOf(event.target.closest(".row")) + step];
  event.preventDefault();
  (next ?? (step < 0 ? $(`#list-${state.tab} input[type="search"]`) : null))?.focus();
}

function isReachable(row) {
  return !row.hidden && !row.closest("details:not([open])");
}

function nodeList(side, { chooseNode }) {
  const rows = [...side.nodes.values()].map((node) => {
    const button = make(
      "button",
      { class: "row node", "data-node": node.index, title: node.name, onclick: () => chooseNode(node.index) },
      make("span", { class: "name" }, node.name),
    );
    button.style.paddingInlineStart = `${10 + INDENT_PX * Math.min(Math.max(node.depth - 1, 0), MAX_INDENT)}px`;
    return button;
  });
  return filtered(rows, "nodes");
}

/** A table of Python's: rows of cells, each row a link to a clip, node and time where it has one. */
function panelSection(panel, { follow }) {
  const followRow = (row, link) => {
    document.querySelector("#side [aria-current]")?.removeAttribute("aria-current");
    row.setAttribute("aria-current", "true");
    follow(link);
  };
  const rows = panel.rows.map(({ cells, text, advice, link, level, parts = [] }) => {
    const [name, ...others] = cells;
    const columns = [
      make("span", { class: "name" }, ...breakable(name)),
      level ? make("span", { class: "dim" }, level) : null,
      ...others.map((cell, i) => make("span", { class: panel.hot === i + 1 ? "hot" : "dim" }, cell)),
      text ? make("span", { class: "text" }, ...breakable(text)) : null,
      advice ? make("span", { class: "text dim" }, ...unbroken(advice)) : null,
    ];
    // A position or a finding, whose name has a line of its own
    const shape = text || (others.length > 1 && link) ? "deep" : "";
    const attributes = { class: `row ${shape} ${level ?? ""}` };
    const row = link
      ? make("button", { ...attributes, "data-link": "", onclick: (event) => followRow(event.currentTarget, link) }, ...columns)
      : make("div", attributes, ...columns);
    if (link) links.set(row, link);
    return [row, parts.length ? partList(parts, followRow) : null];
  });
  const about = panel.about ? make("p", { class: "about" }, panel.about) : null;
  const title = panel.title === "Findings" ? null : make("h2", {}, panel.title); // the tab has this name
  return make("section", {}, title, about, ...rows.flat());
}

/** Links to everything that a row sums up, folded. */
function partList(parts, follow) {
  const rows = parts.map(({ label, link }) =>
    make("button", { class: "row", "data-link": "", onclick: (event) => follow(event.currentTarget, link) }, make("span", { class: "name" }, label)),
  );
  return make("details", { class: "parts" }, make("summary", {}, `all ${parts.length}`), ...rows);
}

/** Advice in which options of commands stay on one line. */
function unbroken(advice) {
  return advice.split(/(gltf-anim|--\S+)/).map((part, i) => (i % 2 ? make("span", { class: "option" }, part) : part));
}

function fileList(facts) {
  return facts.files.flatMap((file) => [
    make(
      "div",
      { class: "row" },
      make("span", { class: "name" }, file.name),
      make("span", { class: "dim" }, file.bytes ? formatBytes(file.bytes) : ""),
    ),
    ...file.notes.map((note) => make("p", { class: "note" }, note)),
  ]);
}
