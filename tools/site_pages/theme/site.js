// Menu, light or dark, search. Works from the file system: what is searched is a script too.
(() => {
  "use strict";
  const root = document.documentElement;
  const above = root.dataset.above;
  const get = id => document.getElementById("site-" + id);

  const menu = get("menu");
  const side = get("side");
  menu.addEventListener("click", () => {
    menu.setAttribute("aria-expanded", String(side.classList.toggle("open")));
  });
  const here = side.querySelector("[aria-current]");
  if (here && side.scrollHeight > side.clientHeight) {
    side.scrollTop = here.offsetTop - side.clientHeight / 2;
  }

  const theme = get("theme");
  const system = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (root.dataset.theme || (system.matches ? "dark" : "light")) === "dark";
  const label = () => { theme.textContent = isDark() ? "Light" : "Dark"; };
  theme.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    try { localStorage.setItem("perigeo-theme", root.dataset.theme); } catch (error) { /* none */ }
    label();
  });
  system.addEventListener("change", label);
  label();

  const input = get("search");
  const found = get("found");
  let asked = false;
  const load = () => {
    if (asked) return;
    asked = true;
    const script = document.createElement("script");
    script.src = above + "search.js";
    script.onload = show;
    document.head.append(script);
  };

  // An entry is [address, title of the page, heading, text].
  const score = (entry, words, phrase) => {
    const title = (entry[1] + " " + entry[2]).toLowerCase();
    const text = entry[3].toLowerCase();
    let sum = 0;
    for (const word of words) {
      const inTitle = title.includes(word);
      if (!inTitle && !text.includes(word)) return 0;
      sum += inTitle ? 6 : 1;
    }
    const exact = entry[2].toLowerCase() === phrase;
    if (exact) sum += 30;
    else if (title.includes(phrase)) sum += 12;
    sum += 4 * Math.min(text.split(phrase).length - 1, 5);
    // Documents go before sources, what defines a thing before what uses it.
    if (/^(modules|python|tests|tools|input|studies)\//.test(entry[0])) sum *= exact ? 1 : 0.25;
    else if (/^doc\/(input|theory|results)/.test(entry[0])) sum *= 1.5;
    return sum;
  };

  const marked = (text, words) => {
    const at = Math.max(0, text.toLowerCase().indexOf(words[0]) - 50);
    const part = (at ? "…" : "") + text.slice(at, at + 150);
    const escaped = words.map(w => w.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"));
    const line = document.createElement("span");
    for (const piece of part.split(new RegExp("(" + escaped.join("|") + ")", "i"))) {
      if (words.includes(piece.toLowerCase())) {
        const mark = document.createElement("mark");
        mark.textContent = piece;
        line.append(mark);
      } else line.append(piece);
    }
    return line;
  };

  function show() {
    const phrase = input.value.trim().toLowerCase();
    const words = phrase.split(/\s+/).filter(Boolean);
    found.replaceChildren();
    found.hidden = !words.length;
    if (!words.length || !window.perigeoSearch) return;
    const best = window.perigeoSearch
      .map(entry => [score(entry, words, phrase), entry])
      .filter(pair => pair[0] > 0)
      .sort((a, b) => b[0] - a[0])
      .slice(0, 20);
    for (const [, entry] of best) {
      const link = document.createElement("a");
      link.href = above + entry[0];
      const title = document.createElement("b");
      title.textContent = entry[1] === entry[2] ? entry[1] : entry[1] + ": " + entry[2];
      link.append(title, marked(entry[3], words));
      found.append(link);
    }
    if (!best.length) {
      const none = document.createElement("p");
      none.textContent = "Nothing found.";
      found.append(none);
    } else found.firstChild.classList.add("first");
  }

  input.addEventListener("focus", load);
  input.addEventListener("input", () => { load(); show(); });
  input.addEventListener("keydown", event => {
    if (event.key === "Enter" && found.querySelector("a")) found.querySelector("a").click();
    if (event.key === "Escape") { input.value = ""; show(); input.blur(); }
    if (event.key === "ArrowDown" && found.querySelector("a")) {
      event.preventDefault();
      found.querySelector("a").focus();
    }
  });
  found.addEventListener("keydown", event => {
    const links = [...found.querySelectorAll("a")];
    const next = links.indexOf(document.activeElement) +
      (event.key === "ArrowDown" ? 1 : event.key === "ArrowUp" ? -1 : NaN);
    if (links[next]) { event.preventDefault(); links[next].focus(); }
  });
  found.addEventListener("click", () => { found.hidden = true; });
  document.addEventListener("click", event => {
    if (!event.target.closest(".find")) found.hidden = true;
  });
  document.addEventListener("keydown", event => {
    if (event.key === "/" && !/INPUT|TEXTAREA/.test(document.activeElement.tagName)) {
      event.preventDefault();
      input.focus();
    }
  });
})();
