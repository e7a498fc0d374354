// The panels at the side, one at a time.

import { el } from "./dom.js";

/**
 * @param {HTMLElement} list
 * @param {HTMLElement} place
 * @param {[string, string, (panel: HTMLElement) => void][]} tabs name, text, and what fills the panel
 */
export function tabs(list, place, tabs) {
  const panels = tabs.map(([name, text, fill]) => {
    const panel = el("section", { id: `panel-${name}`, role: "tabpanel", "aria-labelledby": `tab-${name}`, hidden: true, tabindex: 0 });
    const tab = el("button", { type: "button", id: `tab-${name}`, role: "tab", "aria-controls": `panel-${name}`, onclick: () => show(name) }, text);
    fill(panel);
    return { name, panel, tab };
  });
  list.append(...panels.map(({ tab }) => tab));
  place.append(...panels.map(({ panel }) => panel));
  list.addEventListener("keydown", (event) => {
    const by = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    const at = panels.findIndex(({ tab }) => tab === document.activeElement);
    if (!by || at < 0) return;
    const next = panels[(at + by + panels.length) % panels.length];
    show(next.name);
    next.tab.focus();
    event.preventDefault();
    event.stopPropagation();
  });
  /** @param {string} wanted */
  function show(wanted) {
    for (const { name, panel, tab } of panels) {
      const isShown = name === wanted;
      panel.hidden = !isShown;
      tab.setAttribute("aria-selected", String(isShown));
      tab.tabIndex = isShown ? 0 : -1;
    }
  }
  show(panels[0].name);
  return show;
}
