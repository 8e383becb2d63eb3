// Rules of layout, evaluated in the page.

// Returns pairs of visible texts and controls that overlap although neither contains the other.
export function overlaps() {
  const chosen = "button, select, input, label, output, h1, h2, h3, p, summary, figcaption, legend, th, td, li";
  const visible = [...document.querySelectorAll(`main ${chosen.split(", ").join(", main ")}`)].filter((element) => {
    const box = element.getBoundingClientRect();
    const style = getComputedStyle(element);
    const clipped = element.closest(".scroll, .cm-editor, .u-legend, svg, [hidden]");
    return !clipped && box.width > 1 && box.height > 1 && style.visibility !== "hidden" && style.opacity !== "0";
  });
  const found = [];
  for (let i = 0; i < visible.length; i++) {
    for (let j = i + 1; j < visible.length; j++) {
      const [a, b] = [visible[i], visible[j]];
      if (a.contains(b) || b.contains(a)) {
        continue;
      }
      const [p, q] = [a.getBoundingClientRect(), b.getBoundingClientRect()];
      const x = Math.min(p.right, q.right) - Math.max(p.left, q.left);
      const y = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
      if (x > 2 && y > 2) {
        const name = (e) => `${e.tagName.toLowerCase()} "${(e.textContent || e.id || "").trim().slice(0, 24)}"`;
        found.push(`${name(a)} overlaps ${name(b)}`);
      }
    }
  }
  return found.slice(0, 3);
}

// Returns texts whose contrast with their background is below 4.5.
export function unreadable() {
  const channel = (value) => {
    const share = value / 255;
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  };
  const parse = (text) => (text.match(/[\d.]+/g) ?? []).map(Number);
  const light = ([r, g, b]) => 0.2126 * channel(r) + 0.7152 * channel(g) + 0.0722 * channel(b);
  const background = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const color = parse(getComputedStyle(at).backgroundColor);
      if (color.length === 3 || color[3] > 0.99) {
        return color;
      }
    }
    return [255, 255, 255];
  };
  const found = [];
  for (const element of document.querySelectorAll("h1, h2, h3, p, a, button, label, output, summary, th, td, figcaption, legend")) {
    const box = element.getBoundingClientRect();
    if (box.width < 2 || box.height < 2 || !element.textContent.trim() || element.closest("[hidden], svg")) {
      continue;
    }
    const [text, under] = [light(parse(getComputedStyle(element).color)), light(background(element))];
    const contrast = (Math.max(text, under) + 0.05) / (Math.min(text, under) + 0.05);
    if (contrast < 4.5) {
      found.push(`contrast ${contrast.toFixed(1)} of "${element.textContent.trim().slice(0, 24)}"`);
    }
  }
  return [...new Set(found)].slice(0, 3);
}
