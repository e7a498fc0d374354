// The buttons over the picture: how both figures are shown.

import { el } from "../dom.js";

/** @typedef {import("./stage.js").Mode} Mode */
/** @typedef {import("./viewer.js").Viewer} Viewer */

/** @type {[Mode, string, string][]} */
const MODES = [["beside", "Side by side", "Source and result beside one another"], ["over", "Overlay", "The source as a ghost over the result (G)"], ["wipe", "Wipe", "A line between source and result that can be dragged"]];

/**
 * @param {HTMLElement} bar
 * @param {Viewer} viewer
 */
export function viewTools(bar, viewer) {
  const modes = MODES.map(([mode, text, title]) => el("button", { type: "button", title, onclick: () => viewer.setMode(mode) }, text));
  /** @type {[string, string, () => void, () => boolean][]} */
  const toggles = [
    ["Mesh", "Mesh (M)", () => viewer.toggleMesh(), () => viewer.hasMesh],
    ["Bones", "Bones (B)", () => viewer.toggleBones(), () => viewer.marks.bones],
    ["Contacts", "Where feet touch (C)", () => viewer.toggleContacts(), () => viewer.marks.contacts],
    ["Trails", "The ways of hands, feet and pelvis (T)", () => viewer.toggleTrails(), () => viewer.marks.trails],
    ["Follow", "Go along with the figures (V)", () => viewer.toggleFollow(), () => viewer.stage.isFollowed],
    ["True size", "Both as large as they are, instead of as high as one another (S)", () => viewer.toggleSize(), () => viewer.stage.isTrueSize],
  ];
  const buttons = toggles.map(([text, title, click]) => el("button", { type: "button", title, onclick: click }, text));
  const views = /** @type {const} */ ([["Front", "front", "1"], ["Side", "side", "3"], ["Top", "top", "7"], ["Fit", "three_quarter", "F"]]);
  bar.append(
    el("div", { class: "group" }, ...modes), el("div", { class: "group" }, ...buttons),
    el("div", { class: "group" }, ...views.map(([text, from, key]) => el("button", { type: "button", title: `${text} (${key})`, onclick: () => viewer.stage.fit(from) }, text))),
  );
  const draw = () => {
    modes.forEach((button, index) => button.setAttribute("aria-pressed", String(MODES[index][0] === viewer.stage.mode)));
    buttons.forEach((button, index) => button.setAttribute("aria-pressed", String(toggles[index][3]())));
  };
  viewer.onChange(draw);
  draw();
}
