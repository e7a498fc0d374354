"use strict";
// Searches the sections of all documents. The index is fetched from this service when the first letter is typed.
(() => {
  const input = document.getElementById("search");
  const list = document.getElementById("found");
  const MAX_FOUND = 12;
  // On a narrow screen the list of pages would fill the whole of it before the text begins.
  if (matchMedia("(max-width: 50rem)").matches) document.getElementById("pages").open = false;
  let index = null;

  const score = (section, words) => {
    const heading = (section.heading + " " + section.page).toLowerCase();
    const text = section.text.toLowerCase();
    let sum = 0;
    for (const word of words) {
      const value = (heading.includes(word) ? 10 : 0) + (text.includes(word) ? 1 : 0);
      if (value === 0) return 0;
      sum += value;
    }
    return sum;
  };

  const excerpt = (text, word) => {
    const near = Math.max(0, text.toLowerCase().indexOf(word) - 40);
    // Whole words at both ends.
    const at = near > 0 ? text.indexOf(" ", near) + 1 : 0;
    const end = text.indexOf(" ", at + 100);
    return (at > 0 ? "… " : "") + (end < 0 ? text.slice(at) : text.slice(at, end) + " …").trim();
  };

  const show = (words) => {
    const found = index
      .map((section) => ({ section, value: score(section, words) }))
      .filter((entry) => entry.value > 0)
      .sort((a, b) => b.value - a.value)
      .slice(0, MAX_FOUND);
    list.replaceChildren(
      ...found.map(({ section }) => {
        const entry = document.createElement("li");
        const link = document.createElement("a");
        link.href = section.address;
        link.textContent = section.heading === section.page ? section.page : section.page + ": " + section.heading;
        const small = document.createElement("small");
        small.textContent = excerpt(section.text, words[0]);
        link.append(small);
        entry.append(link);
        return entry;
      }),
    );
    if (found.length === 0) list.textContent = "Nothing found.";
    list.hidden = false;
  };

  input.addEventListener("input", async () => {
    const words = input.value.toLowerCase().split(/\s+/).filter((word) => word.length > 0);
    list.hidden = true;
    if (words.length === 0) return;
    index ??= await (await fetch("/docs/site/search.json")).json();
    show(words);
  });
})();
