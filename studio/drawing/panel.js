// The page of drawings: the drawing with its joints and its mask, beside it what moves, and what can be chosen.

import { byId, el, words } from "../dom.js";
import { watch } from "../state.js";
import { choicesPanel } from "./choices.js";
import { Editor, UNSURE } from "./editor.js";
import { beginAgain, canRedoDrawing, canUndoDrawing, clipChanged, drawn, findAgain, onDrawn, redoDrawing, remember, touch, undoDrawing } from "./live.js";
import { reportOf } from "./report.js";
import { takeAway } from "./take.js";

/** @typedef {import("./editor.js").Tool} Tool */

/** @type {[Tool, string, string][]} */
const TOOLS = [["joints", "Move joints", "Drag a joint, or choose one and press the arrow keys"], ["paint", "Paint the mask", "What is painted belongs to the figure"], ["erase", "Erase", "What is erased is paper"]];
const RIGS = { auto: "whichever fits", humanoid: "a human", quadruped: "an animal on four legs", chains: "anything with limbs" };

/** @param {{sample: () => void, file: () => void}} open */
export function drawingPage(open) {
  const place = byId("drawing");
  const canvas = el("canvas", { id: "drawn", tabindex: 0, "aria-label": "The drawing. N goes to the next joint, arrow keys move it, Shift by ten; with a brush arrow keys move the brush and Space paints; + and - zoom." });
  const editor = new Editor(canvas, { begin: remember, change: touch, select: () => drawJoints() });
  const tools = TOOLS.map(([tool, text, title]) => el("button", { type: "button", title, onclick: () => { editor.tool = tool; drawTools(); editor.draw(); } }, text));
  const size = el("input", { type: "range", min: 2, max: 60, ".value": editor.radius, "aria-label": "Size of the brush", oninput: () => { editor.radius = Number(size.value); editor.draw(); } });
  const brush = el("label", { class: "muted" }, "brush ", size);
  const joints = el("ul", { class: "joints", "aria-label": "Joints" });
  const notes = el("ul", { class: "warnings" });
  const moving = el("img", { id: "moving", alt: "The drawing as it moves", hidden: true });
  const busy = el("output", { class: "muted" });
  const report = el("div", {});
  const rig = el("select", { "aria-label": "What it is" }, ...Object.entries(RIGS).map(([value, text]) => el("option", { value }, text)));
  const start = el("div", { class: "start" },
    el("h2", {}, "A drawing that moves"),
    el("p", {}, "Open a picture of one figure on paper, a photograph of one or a drawing of Animated Drawings: its outline and its joints are found, can be corrected here, and the clip moves it."),
    el("div", { class: "row" }, el("button", { type: "button", class: "primary", id: "open-drawing", onclick: open.file }, "Open a drawing…"), el("button", { type: "button", id: "sample-drawing", onclick: open.sample }, "Try the sample")));
  const choices = el("div", {});
  const work = el("div", { class: "drawing-work", hidden: true },
    el("section", { class: "drawing-edit", "aria-label": "The drawing" },
      el("div", { class: "row", role: "toolbar", "aria-label": "Tools" }, el("div", { class: "group" }, ...tools), brush, el("span", { class: "grow" }),
        el("button", { type: "button", onclick: () => { beginAgain(); }, title: "Joints and mask as they came" }, "As it came"), el("button", { type: "button", onclick: open.file }, "Another drawing…")),
      canvas, el("p", { class: "hint" }, "What is veiled is no part of the figure. Yellow joints were guessed: look at them first. The wheel zooms.")),
    el("section", { class: "drawing-result", "aria-label": "The moving drawing" }, el("div", { class: "moving" }, moving, busy), report),
    el("aside", { class: "drawing-side" },
      el("details", { open: true }, el("summary", {}, "Joints"),
        el("div", { class: "row" }, rig, el("button", { type: "button", title: "Within the mask as it is painted", onclick: () => void findAgain(rig.value) }, "Find joints anew")), joints),
      choices, el("details", { open: true }, el("summary", {}, "Take it away"), takeAway()),
      el("h3", {}, "What was noticed"), notes));
  place.replaceChildren(start, work);
  choicesPanel(choices);

  function drawTools() {
    tools.forEach((button, index) => button.setAttribute("aria-pressed", String(TOOLS[index][0] === editor.tool)));
    brush.hidden = editor.tool === "joints";
  }

  function drawJoints() {
    const { drawing } = drawn;
    const focus = document.activeElement?.getAttribute("data-focus");
    joints.replaceChildren(...(drawing?.joints ?? []).map((joint) => {
      const sure = drawing?.sureness[joint.name] ?? 1;
      const box = (/** @type {0|1} */ axis) => el("input", {
        type: "number", min: 0, max: (axis ? drawing?.height ?? 1 : drawing?.width ?? 1) - 1, ".value": joint.loc[axis], "aria-label": `${words(joint.name)}: pixels from the ${axis ? "top" : "left"}`, "data-focus": `${joint.name} ${axis}`,
        onchange: (/** @type {any} */ event) => {
          remember();
          editor.selected = joint.name;
          editor.place(axis ? [joint.loc[0], Number(event.target.value)] : [Number(event.target.value), joint.loc[1]]);
          touch();
        },
      });
      return el("li", { class: `${sure < UNSURE ? "unsure" : "sure"}${joint.name === editor.selected ? " selected" : ""}` },
        el("span", { class: "dot", role: "img", "aria-label": sure < UNSURE ? "guessed" : "found", title: sure < 1 ? `${Math.round(sure * 100)} % sure` : "" }),
        el("button", { type: "button", class: "link", "data-focus": `${joint.name} name`, onclick: () => editor.select(joint.name) }, words(joint.name)), box(0), box(1));
    }));
    if (focus) /** @type {HTMLElement|null} */ (joints.querySelector(`[data-focus="${focus}"]`))?.focus();
  }

  const draw = () => {
    const { drawing, picture } = drawn;
    start.hidden = drawing !== null;
    work.hidden = drawing === null;
    if (drawing) editor.show(drawing);
    moving.hidden = picture === "";
    if (picture && moving.src !== picture) moving.src = picture;
    work.classList.toggle("is-busy", drawn.isBusy);
    busy.textContent = drawn.isBusy ? drawn.progress : "";
    report.replaceChildren(...reportOf(drawn.report));
    const found = [...drawing?.warnings ?? [], ...drawn.report?.warnings ?? []];
    const told = [...found.map(({ detail, hint }) => `${detail}${hint ? `; ${hint}` : ""}.`), ...(drawn.report?.drawing?.choices ?? []).map((/** @type {string} */ text) => `${text}.`)];
    notes.replaceChildren(...(told.length ? [...new Set(told)].map((text) => el("li", {}, text)) : [el("li", { class: "empty" }, "Nothing.")]));
    drawJoints();
    for (const [name, can] of /** @type {const} */ ([["undo", canUndoDrawing], ["redo", canRedoDrawing]])) if (!place.hidden) /** @type {HTMLButtonElement} */ (byId(name)).disabled = !can();
  };
  onDrawn(draw);
  watch(["source"], () => clipChanged());
  drawTools();
  draw();
  return { undo: undoDrawing, redo: redoDrawing, editor, draw };
}
